"""Unknown forces as effects like any: a(y) + b(y) v, a(t) y + b(t) v, a(d) + b(d) v in contact.

The conservative part a and the dissipative part b are cubic B-splines with one coefficient per knot
each. With independent normal priors of equal width this is a Gaussian process of correlation length
about one knot spacing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Scales

Array = NDArray[np.float64]

EQUATIONS = {0: "a(y) + b(y) v", 1: "a(t) y / reach + b(t) v", -1: "a(d) + b(d) v in contact"}
LEARNED = "learned_force"
KNOTS = 24
TIMES = 8  # knots over time: what changes does so slowly
DEPTHS = 6  # knots over the indentation


def force(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Force a + b v of the displacement, of time (`reach` above 0; a y / reach) or in contact, N.

    p = (n, lowest, spacing, reach, a_1..a_n, b_1..b_n); a negative reach stands for contact.
    """
    n = int(p[0])
    along = y if p[3] == 0.0 else t
    if p[3] < 0.0:
        along = d
    x = min(max((along - p[1]) / p[2], 0.0), n - 3.0)
    i = min(int(x), n - 4)
    u = x - i
    w, uu = 1.0 - u, u * u
    w0, w3 = w * w * w, uu * u
    w1, w2 = 4.0 + 3.0 * (w3 - 2.0 * uu), 4.0 + 3.0 * (w0 - 2.0 * w * w)
    j = 4 + i
    a = (w0 * p[j] + w1 * p[j + 1]) + (w2 * p[j + 2] + w3 * p[j + 3])
    j += n
    b = (w0 * p[j] + w1 * p[j + 1]) + (w2 * p[j + 2] + w3 * p[j + 3])
    if p[3] > 0.0:
        a *= y / p[3]
    return (a + b * v) * (1.0 / 6.0)


def feature_length(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Distance of the knots, m; those over time lie too far apart to matter to a step."""
    return p[2] if p[3] <= 0.0 else math.inf


def spline_basis(y: Array, low: float, spacing: float, count: int) -> Array:
    """Values (n, count) of the B-splines at displacements (n,)."""
    x = np.clip((y - low) / spacing, 0.0, count - 3.0)
    i = np.minimum(x.astype(np.int64), count - 4)
    u = x - i
    w = 1.0 - u
    weights = (w**3, 3 * u**3 - 6 * u**2 + 4, 3 * w**3 - 6 * w**2 + 4, u**3)
    basis = np.zeros((y.size, count))
    rows = np.arange(y.size)
    for k, weight in enumerate(weights):
        basis[rows, i + k] = weight / 6
    return basis


def learned_force(
    low: float, high: float, conservative: float, dissipative: float, knots: int = KNOTS
) -> Effect:
    """a(y) + b(y) v for displacements `low` to `high` m; prior widths of a in N, of b in N s/m."""
    return _learned(low, high, 0.0, conservative, dissipative, knots)


def learned_drift(
    duration: float, reach: float, conservative: float, dissipative: float, knots: int = TIMES
) -> Effect:
    """a(t) y / `reach` + b(t) v for times up to `duration` s: stiffness and damping that change."""
    return _learned(0.0, duration, reach, conservative, dissipative, knots)


def learned_contact(
    depth: float, conservative: float, dissipative: float, knots: int = DEPTHS
) -> Effect:
    """a(d) + b(d) v for indentations up to `depth` m, in contact alone."""
    found = _learned(0.0, depth, -1.0, conservative, dissipative, knots)
    return replace(
        found,
        regime="contact",
        law=Law(force, where="contact", feature_length=feature_length, polynomial=True),
        needs_stop=True,
    )


@dataclass(frozen=True)
class Knots:
    """Where the splines of a learned force stand.

    Attributes
    ----------
    low, spacing : first displacement and distance, m (times in s, for a change with time)
    count : of the coefficients of a, and of b
    reach : 0 for a(y) + b(y) v; above for a change with time, below for a force in contact
    """

    low: float
    spacing: float
    count: int
    reach: float

    def basis(self, along: Array) -> Array:
        """Values (n, count) of the splines at displacements (or times) (n,)."""
        return spline_basis(along, self.low, self.spacing, self.count)


def knots_of(effect: Effect) -> Knots:
    """The knots of a learned force."""
    low, spacing, count, reach = (
        float(effect.parameter(n).fixed or 0.0) for n in ("lowest", "spacing", "knots", "reach")
    )
    return Knots(low, spacing, int(count), reach)


def refined_force(effect: Effect, factor: int) -> Effect:
    """A learned force of the displacement with its knots `factor` times as near."""
    knots = knots_of(effect)
    a, b = (effect.parameter(n).scale for n in ("a1", "b1"))
    intervals = knots.count - 3
    high = knots.low + intervals * knots.spacing
    assert isinstance(a, Constant) and isinstance(b, Constant)
    return learned_force(knots.low, high, a.value, b.value, intervals * factor + 3)


def may_restate(force: Effect, effect: Effect) -> bool:
    """Whether a learned force may be the force of an effect: it depends on the same things.

    One of displacement and velocity may be any law of these, but no change with time; one that
    changes with time no other law; one in contact what acts there. None has a memory, and none is
    an error of the readings.
    """
    law = effect.law
    memory = law is not None and (law.rate or law.travel)
    if effect.observe is not None or effect.regime == "measurement" or memory:
        return False
    of_time = law is not None and law.of_time
    reach = knots_of(force).reach
    if reach > 0.0:
        return of_time and effect.family == "free stiffness"
    in_flight = effect.regime in ("free", "everywhere")
    return not of_time and (reach == 0.0 or not in_flight)


@dataclass(frozen=True)
class Constant:
    """A prior's width whatever the campaign; a record, for lambdas cannot be pickled."""

    value: float

    def __call__(self, scales: Scales) -> float:
        """The width."""
        return self.value


def _learned(
    low: float, high: float, reach: float, conservative: float, dissipative: float, knots: int
) -> Effect:
    def fixed(name: str, unit: str, value: float) -> EffectParameter:
        return EffectParameter(name, unit, scale=Constant(1.0), fixed=value)

    head = (
        fixed("knots", "1", float(knots)),
        fixed("lowest", "m", low),
        fixed("spacing", "m", (high - low) / (knots - 3)),
        fixed("reach", "m", reach),
    )
    a = tuple(EffectParameter(f"a{i + 1}", "N", scale=Constant(conservative)) for i in range(knots))
    b = tuple(
        EffectParameter(f"b{i + 1}", "N s/m", scale=Constant(dissipative)) for i in range(knots)
    )
    return Effect(
        id=LEARNED,
        family="unknown",
        title="learned force",
        equation=EQUATIONS[int(np.sign(reach))],
        regime="everywhere",
        energy="either",
        statement=(
            "A force outside the catalogue acts, up to {size} ({share} of the peak elastic force)."
        ),
        parameters=head + a + b,
        law=Law(force, feature_length=feature_length, polynomial=True),
    )
