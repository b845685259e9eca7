"""What the campaigns of a fleet say together: changes, population, and those unlike the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.fleet.plan import Plan
from bayesimpact.fleet.population import Population, population
from bayesimpact.fleet.run import Row
from bayesimpact.fleet.trend import NORMAL_90, Trend, find_trend

Array = NDArray[np.float64]

SHARED = 0.5  # of the campaigns must have a parameter for it to be compared


@dataclass(frozen=True)
class Series:
    """One parameter over the campaigns that have it: positions in the plan, SI values."""

    parameter: str
    unit: str
    at: NDArray[np.int64]
    estimates: Array
    low: Array
    high: Array

    @property
    def errors(self) -> Array:
        """Standard errors, as if the intervals were normal."""
        return (self.high - self.low) / (2 * NORMAL_90)


@dataclass(frozen=True)
class Comparison:
    """Everything that the campaigns say together.

    Attributes
    ----------
    series : of every parameter that at least half of the campaigns have
    trends : changes found along date (or order) and conditions
    populations : mean and scatter of every parameter
    unlike : names of campaigns whose named effects are not those of most others
    usual : the effects that most campaigns have
    """

    series: tuple[Series, ...]
    trends: tuple[Trend, ...]
    populations: tuple[Population, ...]
    unlike: tuple[str, ...]
    usual: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {
            "trends": [
                {
                    **asdict(t),
                    "place": None if t.kind == "drift" else list(t.place),
                    "ci90": list(t.ci90),
                }
                for t in self.trends
            ],
            "populations": [asdict(p) for p in self.populations],
            "unlike": list(self.unlike),
            "usual_effects": list(self.usual),
        }


def compare(plan: Plan, rows: Sequence[Row], *, rng: np.random.Generator) -> Comparison:
    """Compare the rows of `run_fleet`; failed campaigns count nowhere."""
    series = _series(rows)
    trends = tuple(
        trend
        for along, values in axes(plan).items()
        for one in series
        if (trend := _trend(one, along, values, len(series), rng)) is not None
    )
    populations = (population(s.parameter, s.estimates, s.errors) for s in series)
    found = [tuple(row["effects"]) if "failed" not in row else None for row in rows]
    sets = Counter(frozenset(e) for e in found if e is not None)
    usual, count = sets.most_common(1)[0] if sets else (frozenset(), 0)
    told = usual if count > 0.5 * sum(sets.values()) else None
    unlike = [
        session.name
        for session, effects in zip(plan.sessions, found, strict=True)
        if told is not None and effects is not None and frozenset(effects) != told
    ]
    kept = tuple(p for p in populations if p is not None)
    return Comparison(series, trends, kept, tuple(unlike), tuple(sorted(usual)))


def axes(plan: Plan) -> dict[str, Array]:
    """What parameters may change along: the date (else the order), and numeric conditions."""
    days = [s.day for s in plan.sessions]
    dated = all(day is not None for day in days)
    found = {"date" if dated else "order": np.array(days if dated else range(len(days)), float)}
    names = dict.fromkeys(name for s in plan.sessions for name in s.conditions)
    for name in names:
        values = [s.conditions.get(name) for s in plan.sessions]
        if all(isinstance(v, float) for v in values):
            found[name] = np.array(values, dtype=np.float64)
    return found


def _series(rows: Sequence[Row]) -> tuple[Series, ...]:
    sound = [(i, row["parameters"]) for i, row in enumerate(rows) if "failed" not in row]
    names = dict.fromkeys(name for _, parameters in sound for name in parameters)
    found = []
    for name in names:
        having = [(i, p[name]) for i, p in sound if name in p]
        if len(having) < max(2, SHARED * len(sound)):
            continue
        columns = (np.array([e[k] for _, e in having]) for k in ("estimate", "low", "high"))
        at = np.array([i for i, _ in having], dtype=np.int64)
        found.append(Series(name, having[0][1]["unit"], at, *columns))
    return tuple(found)


def _trend(
    one: Series, along: str, values: Array, tests: int, rng: np.random.Generator
) -> Trend | None:
    known = one.errors > 0
    return find_trend(
        (one.parameter, along),
        values[one.at][known],
        one.estimates[known],
        one.errors[known],
        rng=rng,
        tests=tests,
        steps=along in ("date", "order"),
    )
