"""Everything a report needs, as plain arrays and strings: nothing here refers to a live model.

A report is written from a `Results` alone, so it can be made again from files, on another machine,
without the recordings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from bayesimpact.data.html import html_table
from bayesimpact.data.quantity import Quantity, is_angular, unit_of
from bayesimpact.data.short_repr import short_repr
from bayesimpact.model.units import typeset
from bayesimpact.report.codec import Array as Array
from bayesimpact.report.digits import Digits, digits
from bayesimpact.report.recording_result import RecordingResult as RecordingResult


@dataclass(frozen=True, eq=False)
class Row:
    """One unknown, in SI units.

    Attributes
    ----------
    name, unit : as in the contract
    role : physical, effect, learned (coefficients of a learned force), nuisance or noise
    meaning : in a few words
    mode, sd : where the posterior is highest, standard deviation there (Laplace)
    median, ci90 : of the posterior (of the Laplace approximation where there are no draws)
    total90 : `ci90` widened by the stated uncertainties of mass, clock and gain
    ratio : (median, low, high) over the mass; NaN unless the parameter scales with the mass
    ratio_unit : of `ratio`
    references : published or theoretical values by label
    prior : in words
    posterior_sd : of the draws; NaN without
    """

    name: str
    unit: str
    role: str
    meaning: str
    mode: float
    sd: float
    median: float
    ci90: tuple[float, float]
    total90: tuple[float, float]
    ratio: tuple[float, float, float]
    ratio_unit: str
    references: Mapping[str, float]
    prior: str
    posterior_sd: float = float("nan")

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class SearchSummary:
    """History of the global search, one entry per generation, and where it and the guess ended.

    Attributes
    ----------
    evaluations, best, median, spread, temperature : (G,), see `inference.search.History`
    stopped : "converged" or "budget"
    agree : guess and search ended at the same mode
    distance : largest distance between the two ends, standard deviations
    """

    evaluations: Array
    best: Array
    median: Array
    spread: Array
    temperature: Array
    stopped: str
    agree: bool
    distance: float

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class SamplerSummary:
    """What the sampler did and whether it converged.

    Attributes
    ----------
    converged, reasons : the verdict, and what speaks against it in words
    names : d parameters
    tau, ess_bulk, ess_tail, rhat : (d,) see `inference.sampling.convergence.ConvergenceRecord`
    ensembles, steps, walkers, draws : kept
    acceptance : fraction of accepted proposals
    trace_names, trace_units : p parameters whose traces are kept
    traces : (ensembles, T, walkers shown, p), SI
    trace_steps : (T,) step of the sampler of every kept point
    """

    converged: bool
    reasons: tuple[str, ...]
    names: tuple[str, ...]
    tau: Array
    ess_bulk: Array
    ess_tail: Array
    rhat: Array
    ensembles: int
    steps: int
    walkers: int
    draws: int
    acceptance: float
    trace_names: tuple[str, ...]
    trace_units: tuple[str, ...]
    traces: Array
    trace_steps: Array

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of some parameters for pictures.

    Attributes
    ----------
    label : whose posterior it is
    names, units : p parameters
    values : (S, p), SI
    """

    label: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class BackboneCurve:
    """One branch of a recording's backbone and the band of simulated ones.

    Attributes
    ----------
    recording, case : whose
    branch : "upper" (towards the stop) or "lower"
    times, amplitude, frequency, damping_ratio : (k,) as recorded; s, m, Hz, 1
    frequency_band, damping_band : (k, 3) lower end, median and upper end at the same cycles
    """

    recording: str
    case: str
    branch: str
    times: Array
    amplitude: Array
    frequency: Array
    damping_ratio: Array
    frequency_band: Array
    damping_band: Array

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class BackboneSummary:
    """Recorded backbones against simulated ones.

    Attributes
    ----------
    curves : of every recording and branch
    probability : of the bands
    labels : cases, then "all" where there is more than one (or none), for each of the following
    inside : (n,) fraction of the recorded points inside the bands
    p_values : (n,) posterior-predictive; the last is over everything
    replicates : simulated recordings per recording
    """

    curves: tuple[BackboneCurve, ...]
    probability: float
    labels: tuple[str, ...]
    inside: Array
    p_values: Array
    replicates: int

    __repr__ = short_repr


@dataclass(frozen=True)
class ChecklistItem:
    """One line of the checklist: status is "passed", "failed" or "note" (for information)."""

    title: str
    status: str
    finding: str
    meaning: str = ""


@dataclass(frozen=True)
class EffectSummary:
    """An effect that the model includes beside the base oscillator."""

    id: str
    title: str
    equation: str
    statement: str = ""


@dataclass(frozen=True)
class NoiseSummary:
    """The noise as estimated; level in m (or rad). Independent: from the recordings alone."""

    kind: str
    level: float
    level_error: float
    correlation: float
    source: str
    is_independent: bool


@dataclass(frozen=True)
class MeasuringChainSummary:
    """What campaign.toml says of the measuring chain; uncertainties are relative standard ones."""

    smoothing: str
    mass_sd: float
    clock_sd: float
    gain_sd: float

    @property
    def stated(self) -> bool:
        """True when any of the three is stated."""
        return max(self.mass_sd, self.clock_sd, self.gain_sd) > 0


@dataclass(frozen=True)
class Provenance:
    """Where the numbers come from: enough to make them again."""

    command: str
    seed: int
    date: str
    data_sha256: str
    versions: Mapping[str, str]
    seconds: float = float("nan")


@dataclass(frozen=True, eq=False)
class Results:
    """All results of one campaign.

    Attributes
    ----------
    name, mass, stop, quantity : of the campaign; mass in kg (kg m2 for angles), the first
        recording's quantity
    recordings, rows : what was measured; what was found
    effects : added to the base oscillator
    noise, chain : of the measurement
    verdict : "adequate", "slight", "inadequate" or "overestimated" (see `checks.assess`)
    headline : the verdict in words
    reduced_chi2, chi2_z : misfit of all recordings against the independent noise level, and its
        distance from 1 in standard errors
    log_posterior : at the mode
    covariance : (d, d) Laplace, in the order of `rows`, SI
    fit_converged : the last step of the fit was negligible
    search, sampler, draws, backbone : None where there are none
    before, before_backbone : draws and backbone check of the model without the effects
    checks : the checklist
    diagnosis : content of diagnosis.json, and arrays for its figures
    notes : what was set aside in the recordings, a sentence each
    """

    name: str
    mass: float
    stop: bool
    quantity: str
    recordings: tuple[RecordingResult, ...]
    rows: tuple[Row, ...]
    effects: tuple[EffectSummary, ...]
    noise: NoiseSummary
    chain: MeasuringChainSummary
    verdict: str
    headline: str
    reduced_chi2: float
    chi2_z: float
    log_posterior: float
    covariance: Array
    fit_converged: bool
    search: SearchSummary | None
    sampler: SamplerSummary | None
    draws: Draws | None
    backbone: BackboneSummary | None
    checks: tuple[ChecklistItem, ...]
    provenance: Provenance
    before: Draws | None = None
    before_backbone: BackboneSummary | None = None
    diagnosis: Mapping[str, Any] | None = None
    diagnosis_arrays: Mapping[str, Array] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """One line."""
        found = self.verdict if self.diagnosis is None else self.diagnosis["verdict"]
        count = f"{len(self.recordings)} recordings, {len(self.rows)} parameters"
        return f"<Results of {self.name!r}: {found}, {count}>"

    def _repr_html_(self) -> str:
        """Parameters that all recordings share, with 90 % intervals, as the report has them."""
        return html_table(repr(self), *self.table)

    @property
    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Columns and rows of what all recordings share, with 90 % intervals, for a notebook."""
        rows = []
        for row in self.select("physical", "effect"):
            shown = self.digits(row)
            values = map(shown.value, (row.median, *row.ci90))
            rows.append((row.name, *values, typeset(shown.unit)))
        return ("parameter", self.centre, "5 %", "95 %", "unit"), rows

    @property
    def cases(self) -> tuple[str, ...]:
        """Obstacles in order of first appearance; () without a stop."""
        return tuple(dict.fromkeys(r.case for r in self.recordings)) if self.stop else ()

    @property
    def kind(self) -> str:
        """What the intervals come from: "posterior" (draws) or "fit" (Laplace)."""
        return "fit" if self.draws is None else "posterior"

    @property
    def remains(self) -> bool:
        """True where a diagnosis leaves something unexplained, which the intervals then carry."""
        return (self.diagnosis or {}).get("remainder") is not None

    @property
    def centre(self) -> str:
        """What an interval stands about: "median" or "mode"."""
        return "mode" if self.draws is None and self.diagnosis is None else "median"

    @property
    def unit(self) -> str:
        """SI unit of the recordings (of the first, where they differ)."""
        return unit_of(cast(Quantity, self.quantity))

    @property
    def length(self) -> str:
        """SI unit of the displacement: "m", or "rad" for angles."""
        return "rad" if self.angular else "m"

    @property
    def angular(self) -> bool:
        """True when the motion is about an axis."""
        return is_angular(cast(Quantity, self.quantity))

    @property
    def rms(self) -> float:
        """Root mean square residual over all samples, in `unit`; others count by their noise."""
        count = sum(r.count for r in self.recordings)
        left = sum(np.sum((r.residual / r.scale) ** 2) for r in self.recordings)
        return float(np.sqrt(left / count))

    @property
    def share(self) -> float:
        """Root mean square residual over that of the signals about their means."""
        signal = np.concatenate([(r.samples - r.samples.mean()) / r.scale for r in self.recordings])
        return self.rms / float(np.sqrt(np.mean(signal**2)))

    @property
    def failed(self) -> tuple[ChecklistItem, ...]:
        """Checks that failed."""
        return tuple(c for c in self.checks if c.status == "failed")

    def row(self, name: str) -> Row:
        """The row of one unknown; KeyError when there is none."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(name)

    def digits(self, row: Row) -> Digits:
        """How a row's numbers are written, beside what a diagnosis says of its parameter."""
        both = (self.diagnosis or {}).get("parameters") or {}
        known = [both.get(key, {}).get(row.name) for key in ("before", "after")]
        told = [x for x in known if x and None not in (x["median"], *x["ci90"])]
        return digits(row.unit, row.median, row.ci90, told)

    def select(self, *roles: str) -> tuple[Row, ...]:
        """Rows with one of the given roles."""
        return tuple(row for row in self.rows if row.role in roles)
