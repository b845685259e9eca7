"""Scans over frequency: where refits begin."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.diagnosis.refits.refit import _shift, refit
from bayesimpact.diagnosis.score_test.frequency_scan import periodic_scores
from bayesimpact.inference.identify import identify

PLANTED = {  # near the motion's own frequency of 6.4 Hz: initial conditions absorb most of either
    "harmonic_forcing": {"amplitude": 2e-4, "frequency": 7.1, "phase": 1.0},
    "sensor_hum": {"amplitude": 4e-6, "frequency": 7.1, "phase": 1.0},
}


@pytest.mark.parametrize("effect_id", PLANTED)
def test_a_line_near_resonance_is_fitted_from_where_its_score_says(effect_id):
    """Amplitude and phases alone do not fit, for initial conditions have absorbed much of them: the
    start takes back what these hold.
    """
    effect = BY_ID[effect_id]
    campaign = small_rig.record(4, {effect_id: PLANTED[effect_id]}, duration=3.0)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    (score,) = periodic_scores(fit, [effect], scales)
    assert score.gain > 50
    density = extend(fit, (effect,), scales)
    layout = density.oscillator.layout
    alone = transfer(fit, layout, (effect,), scales, score.shapes)
    alone[layout.index(f"{effect_id}.amplitude")] = score.size[0]
    start = transfer(fit, layout, (effect,), scales, score.shapes)
    _shift(fit, layout.names, start, [score])
    least, reached = (density.likelihood(theta[None])[0] for theta in (alone, start))
    assert least < reached and reached - fit.log_likelihood > 0.5 * score.gain
    found = refit(fit, [score], scales).fit
    assert found.converged and found.iterations <= 12
    assert found.log_likelihood - fit.log_likelihood > score.gain
    amplitude = found.value(f"{effect_id}.amplitude")
    sd = found.sd[found.names.index(f"{effect_id}.amplitude")]
    assert abs(amplitude - PLANTED[effect_id]["amplitude"]) < 4 * sd
