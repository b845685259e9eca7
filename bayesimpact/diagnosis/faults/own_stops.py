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
from bayesimpact.inference.fit import Fit, Target
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.priors import Priors
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import Layout

Array = NDArray[np.float64]

STEP = 1e-6  # of a parameter, for differences
CHANCE = 0.01  # of stiffnesses that speak against a label: it only decides what is compared


def share_stops(campaign: Campaign) -> bool:
    """Whether some recordings are said to share a stop."""
    return campaign.stop and len(campaign.cases) < len(campaign.recordings)


def with_own_stops(fit: Fit) -> Fit:
    """The mode of a fit's model where every recording has its own stop, from where the fit is."""
    o = fit.target.oscillator
    recordings = tuple(replace(r, case=r.name) for r in o.campaign.recordings)
    own = build_oscillator(
        replace(o.campaign, recordings=recordings),
        o.effects,
        smoothing=o.smoothing,
        sigma_per_recording=o.layout.roles("noise").size > 1,
    )
    shared = shared_places(own.layout, o.layout)
    priors = Priors(tuple(fit.target.priors.parameters[i] for i in shared))
    likelihood, start = Likelihood(own, fit.target.likelihood.noise), fit.mode[shared]
    exact = own.is_base and not own.sensors
    steps = None if exact else np.maximum(STEP * np.abs(start), 1e-9)
    return find_mode(Target(likelihood, priors, fit.target.replaced), start, steps=steps)


def shared_values(own: Fit, layout: Layout) -> dict[str, float]:
    """Parameter of the same model with shared stops -> value; the mean of those that share it."""
    places = shared_places(own.target.oscillator.layout, layout)
    total = np.bincount(places, own.mode, layout.size) / np.bincount(places, minlength=layout.size)
    return dict(zip(layout.names, map(float, total), strict=True))


def shared_places(own: Layout, shared: Layout) -> NDArray[np.int64]:
    """Where the parameters of a layout with own stops stand in that with shared ones, (d,)."""
    found = np.array([_place(shared, name) for name in own.names])
    fed = own.columns >= 0
    found[own.columns[fed]] = shared.columns[fed]
    return found


def _place(layout: Layout, name: str) -> int:
    return layout.index(name) if name in layout.names else -1


def labels_are_doubted(campaign: Campaign, values: Mapping[str, float]) -> bool:
    """Whether stiffnesses `k2[<recording>]` agree far better once one recording has another label.

    By an F test of their logarithms against the scatter that is left then; not where a stiffness is
    not positive, which none of these measures.
    """
    stiffness = np.array([values[f"k2[{r.name}]"] for r in campaign.recordings])
    if not np.all(stiffness > 0.0):
        return False
    logs, labels = np.log(stiffness), [r.case for r in campaign.recordings]
    before, least = _scatter(logs, labels)[0], 1.0
    for r, own in enumerate(labels):
        for other in {*labels, ""} - {own}:  # "": a stop that no other recording shows
            left, freedom = _scatter(logs, [*labels[:r], other, *labels[r + 1 :]])
            if freedom > 0:
                ratio = (before - left) / max(left / freedom, 1e-300)
                least = min(least, float(f_distribution.sf(ratio, 1, freedom)))
    return least < CHANCE


def _scatter(logs: Array, labels: Sequence[str]) -> tuple[float, int]:
    """Sum of squares about the means of those of one label, and its degrees of freedom."""
    groups = [logs[[one == label for one in labels]] for label in set(labels)]
    return sum(float(np.sum((g - g.mean()) ** 2)) for g in groups), logs.size - len(groups)
