"""What a model loses without an effect, to first order, against fits without it."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import base_candidate, grown
from bayesimpact.diagnosis.refits.sizes import loss_without
from bayesimpact.inference.identify import identify

EFFECT = BY_ID["quadratic_drag"]


@pytest.mark.parametrize("size", [0.003, 0.03, 0.3])
def test_the_linear_loss_is_that_of_a_refit(size):
    """A drag of a fraction of a standard error and of many; its force is linear in its size."""
    campaign = small_rig.record(effects={EFFECT.id: {"coefficient": size}})
    base = identify(campaign, rng=np.random.default_rng(1), search=False).fit
    scales = campaign_scales(base)
    whole = grown(base_candidate(base), (EFFECT,), scales)
    lost = whole.fit.log_likelihood - base.log_likelihood
    assert loss_without(whole.fit, EFFECT) == pytest.approx(lost, rel=0.1, abs=0.5)


def test_what_has_no_size_or_replaces_a_parameter_tells_nothing():
    campaign = small_rig.record()
    base = identify(campaign, rng=np.random.default_rng(1), search=False).fit
    scales = campaign_scales(base)
    for effect_id in ("contact_no_tension", "gap_per_recording"):
        whole = grown(base_candidate(base), (BY_ID[effect_id],), scales)
        assert loss_without(whole.fit, BY_ID[effect_id]) == 0.0
