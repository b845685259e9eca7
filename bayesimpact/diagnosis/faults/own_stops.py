"""A campaign in which every recording has a stop of its own, whatever its label says.

A wrong label bends everything that all recordings share: the base model's gap and damping, and the
laws that are asked for beside it. Where every recording has a contact stiffness of its own it bends
nothing, and the stiffnesses found beside the same laws tell which recordings share a stop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.priors import Priors
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import Layout

Array = NDArray[np.float64]

STEP = 1e-6  # of a parameter, for differences
CHANCE = 0.01  # of stiffnesses that doubt a label: it only decides what is fitted; set by hand


def share_stops(campaign: Campaign) -> bool:
    """Whether there are several stops, and some recordings are said to share one; not of several
    channels of a motion, which share their stop whatever its label.
    """
    single = all(not r.motion_name for r in campaign.recordings)
    return campaign.stop and single and 1 < len(campaign.cases) < len(campaign.recordings)


def with_own_stops(fit: Fit) -> Fit:
    """The mode of a fit's model where every recording has its own stop, from where the fit is."""
    o = fit.density.oscillator
    recordings = tuple(replace(r, case=r.name) for r in o.campaign.recordings)
    own = build_oscillator(
        replace(o.campaign, recordings=recordings),
        o.effects,
        smoothing=o.smoothing,
        sigma_per_recording=o.layout.roles("noise").size > 1,
    )
    shared = shared_places(own.layout, o.layout)
    priors = Priors(tuple(fit.density.priors.parameters[i] for i in shared))
    likelihood, start = Likelihood(own, fit.density.likelihood.noise), fit.mode[shared]
    exact = own.is_base and not own.sensors
    steps = None if exact else np.maximum(STEP * np.abs(start), 1e-9)
    return find_mode(PosteriorDensity(likelihood, priors, fit.density.replaced), start, steps=steps)


def shared_values(values: Mapping[str, float], own: Layout, shared: Layout) -> dict[str, float]:
    """Parameter of a layout with shared stops -> value: the mean of `values` of those that share
    it in a layout with `own` ones; none of a parameter that only one of the layouts has.
    """
    found = dict[str, list[float]]()
    for name, place in zip(own.names, shared_places(own, shared), strict=True):
        if place >= 0:
            found.setdefault(shared.names[place], []).append(values[name])
    return {name: float(np.mean(those)) for name, those in found.items()}


def shared_places(own: Layout, shared: Layout) -> NDArray[np.int64]:
    """Where the parameters of a layout with own stops stand in that with shared ones, (d,); -1
    where that has none.
    """
    found = np.array([_place(shared, name) for name in own.names])
    fed = own.columns >= 0
    found[own.columns[fed]] = shared.columns[fed]
    return found


def _place(layout: Layout, name: str) -> int:
    return layout.index(name) if name in layout.names else -1


def shown_label(campaign: Campaign, values: Mapping[str, float]) -> tuple[int, str] | None:
    """The recording, by its place, and the label with which stiffnesses `k2[<recording>]` agree far
    better; None where no label is doubted, or a stiffness is not positive, which measures none.

    By F tests of their logarithms against the scatter that is left then.
    """
    stiffness = np.array([values[f"k2[{r.name}]"] for r in campaign.recordings])
    if not np.all(stiffness > 0.0):
        return None
    logs, labels = np.log(stiffness), [r.case for r in campaign.recordings]
    before, found = _scatter(logs, labels)[0], list[tuple[float, tuple[int, str]]]()
    for r, own in enumerate(labels):
        for other in sorted({*labels} - {own}):
            left, freedom = _scatter(logs, [*labels[:r], other, *labels[r + 1 :]])
            if freedom > 0:
                ratio = (before - left) / max(left / freedom, 1e-300)
                found.append((float(f_distribution.sf(ratio, 1, freedom)), (r, other)))
    chance, best = min(found, default=(1.0, (0, "")))
    return best if chance < CHANCE else None


def _scatter(logs: Array, labels: Sequence[str]) -> tuple[float, int]:
    """Sum of squares about the means of those of one label, and its degrees of freedom."""
    groups = [logs[[one == label for one in labels]] for label in set(labels)]
    return sum(float(np.sum((g - g.mean()) ** 2)) for g in groups), logs.size - len(groups)
