"""How often would this diagnosis be wrong on a campaign of this very design?

The loop is repeated on simulated campaigns with the recordings, releases, noise and filter of the
one that was diagnosed: with nothing missing, and with the effects that were named, at their sizes
(a parametric bootstrap, Efron 1979). The simulator is the diagnosis' own, so what the bootstrap
cannot see is physics that the simulator gets wrong; blind trials see that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects import SEARCHED
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.measurement import smooth

Rng = np.random.Generator


@dataclass(frozen=True)
class ParametricBootstrap:
    """Outcomes of the repeated loop.

    Attributes
    ----------
    controls, false_alarms : campaigns with nothing missing; how many were not called adequate
    planted, named, misnamed : campaigns with the effects that were named; how many were named the
        same, and how many got another name. All 0 when nothing was named
    """

    controls: int
    false_alarms: int
    planted: int
    named: int
    misnamed: int


def parametric_bootstrap(
    diagnosis: Diagnosis,
    count: int,
    *,
    rng: Rng,
    effects: Sequence[Effect] = SEARCHED,
    progress: Callable[[str], None] | None = None,
) -> ParametricBootstrap:
    """Repeat the loop `count` times with nothing missing and `count` times with what was named."""
    say = progress or (lambda message: None)

    def answers(fit: Fit, what: str) -> list[tuple[str, frozenset[str]]]:
        found: list[tuple[str, frozenset[str]]] = []
        for i in range(count):
            say(f"parametric bootstrap: {what} {i + 1} of {count}")
            again = diagnose(simulated(fit, rng), rng=rng, effects=effects, search=False)
            found.append((again.verdict, frozenset(e.id for e in again.effects)))
        return found

    controls = answers(diagnosis.selection.base.candidate.fit, "control")
    named = diagnosis.selection.chosen.candidate
    planted = answers(named.fit, "planted") if diagnosis.verdict == "named" and named.ids else []
    wanted = frozenset(named.ids)
    return ParametricBootstrap(
        len(controls),
        sum(verdict != "adequate" for verdict, _ in controls),
        len(planted),
        sum(verdict == "named" and ids == wanted for verdict, ids in planted),
        sum(verdict == "named" and ids != wanted for verdict, ids in planted),
    )


def simulated(fit: Fit, rng: Rng) -> Campaign:
    """The fit's campaign recorded once more: its motion with fresh noise of the level that the
    recordings show by themselves, in the steps that they come in.

    A filter that was only proved counts as declared.
    """
    likelihood = fit.density.likelihood
    noise, campaign = likelihood.noise, likelihood.oscillator.campaign
    recordings = []
    for r, (recording, motion) in enumerate(zip(campaign.recordings, fit.seen, strict=True)):
        rounding = likelihood.rounding(r, motion)
        level = noise.level if rounding is None else rounding.noise / noise.scales[recording.order]
        raw = noise.drawn(rng, recording, level)
        read = motion + smooth(raw, noise.smoothing, recording.interval)
        samples = read if rounding is None else rounding.step * np.round(read / rounding.step)
        recordings.append(replace(recording, samples=samples))
    return replace(campaign, recordings=tuple(recordings))
