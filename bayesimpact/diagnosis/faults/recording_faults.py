"""Faults of recordings as part of a diagnosis: found, corrected before any physics is searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, groupby
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault, fault_document
from bayesimpact.data.faults.find import set_aside
from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.faults.alone import SharedModel, has_own_size
from bayesimpact.diagnosis.faults.compare import (
    Compared,
    base_failed,
    compare_recordings,
    misfits,
)
from bayesimpact.diagnosis.faults.outliers import faults_set_aside, residual_spikes
from bayesimpact.diagnosis.measurement.input_noise import with_input_noise
from bayesimpact.diagnosis.measurement.slow_noise import with_slow_noise
from bayesimpact.diagnosis.measurement.smoothing import proved_smoothing
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.errors import InputError
from bayesimpact.formula.law import is_formula
from bayesimpact.inference.fit import Z90, Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.noise.spectrum import Fingerprint
from bayesimpact.model.effects.effect import Effect

Step = tuple[Compared, ...]


@dataclass(frozen=True, eq=False)
class Corrected:
    """A campaign with the faults of its recordings set aside or corrected.

    Attributes
    ----------
    identification : of the base model on the corrected campaign, through the filter
    own : faults found in the recordings themselves, notices among them
    compared : faults found against the fit or by comparing recordings, in the order of their
        correction
    filtered : the filter that the noise spectrum proves and campaign.toml does not declare
    """

    identification: Identification
    own: tuple[Fault, ...] = ()
    compared: tuple[Compared, ...] = ()
    filtered: Fingerprint | None = None

    __repr__ = short_repr

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults that were set aside or corrected."""
        kept = self.identification.fit.density.oscillator.campaign.keep_faults
        own = () if kept else tuple(f for f in self.own if f.action != "notice")
        return (*own, *(c.fault for c in self.told))

    @property
    def told(self) -> tuple[Compared, ...]:
        """Comparisons, without those that a later one of the same kind covers: a start that was
        cut once and then again.
        """
        return tuple(
            c
            for i, c in enumerate(self.compared)
            if not any(covers(later.fault, c.fault) for later in self.compared[i + 1 :])
        )

    @property
    def is_open(self) -> bool:
        """Whether another explanation of what comparing showed is not out of the question.

        Of two recordings of a stop that differ neither is the faulty one.
        """
        return any(_others(c) for c in self.compared)


def covers(fault: Fault, other: Fault) -> bool:
    """Whether a fault is a later start of the same recording."""
    starts = fault.id == other.id == "recording_start" and fault.recording == other.recording
    return starts and fault.start_s <= other.start_s <= other.end_s <= fault.end_s


def cleaned_campaign(campaign: Campaign, *, rng: np.random.Generator, search: bool) -> Corrected:
    """Set aside what the recordings show of themselves, and fit the base model.

    With `faults = "keep"` in campaign.toml nothing is changed.

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    cleaned, own = set_aside(campaign)
    cleaned, filtered = _through_filter(cleaned, None)
    if filtered is not None:  # what was cut before it reaches further
        cleaned, own = set_aside(replace(campaign, measurement=cleaned.measurement))
    found = Corrected(identified(cleaned, rng=rng, search=search), own, filtered=filtered)
    fit = found.identification.fit
    spikes = () if campaign.keep_faults or base_failed(fit) else residual_spikes(fit)
    if not spikes:
        return found
    without = without_faults(found, spikes, campaign, rng=rng)
    # where a fit is wrong, what stands out at a contact may be physics
    return found if misfits(without.identification.fit) else without


def without_faults(
    found: Corrected, faults: Sequence[Fault], as_read: Campaign, *, rng: np.random.Generator
) -> Corrected:
    """The same with faults set aside that a fit shows; as it was where no oscillation is left."""
    before = found.identification
    whole = before.fit.density.oscillator.campaign
    campaign = faults_set_aside(whole, faults)
    try:
        again = replace(identified(campaign, rng=rng, search=False), search=before.search)
    except InputError:
        return found
    change = before.fit.reduced_chi2, again.fit.reduced_chi2
    told = (fault_as_read(fault, whole, as_read) for fault in faults)
    return replace(
        found,
        identification=again,
        compared=(*found.compared, *(Compared(f, campaign, *change) for f in told)),
    )


def with_faults(
    before: Corrected, identification: Identification, faults: Step, as_read: Campaign
) -> Corrected:
    """The same with faults set aside or corrected that a model showed; `identification` is without
    them.
    """
    whole, told = before.identification.fit.density.oscillator.campaign, list[Compared]()
    for one in faults:  # each is told of the recordings without those before it
        told.append(replace(one, fault=fault_as_read(one.fault, whole, as_read)))
        whole = one.campaign
    return replace(before, identification=identification, compared=(*before.compared, *told))


def fault_as_read(fault: Fault, campaign: Campaign, as_read: Campaign) -> Fault:
    """A fault found in a campaign, its samples counted from the recording's first as read."""
    now, before = ({r.name: r for r in c.recordings}[fault.recording] for c in (campaign, as_read))
    cut = round((now.start - before.start) / now.interval)
    return replace(fault, spans=tuple((a + cut, b + cut) for a, b in fault.spans))


def comparisons(
    before: Corrected,
    as_read: Campaign,
    beside: Sequence[Effect] = (),
    values: Mapping[str, float] | None = None,
) -> tuple[Step, ...]:
    """Faults that comparing the recordings shows, what is corrected together in a step.

    They are compared by the base model and those effects `beside` it that hold for all recordings
    alike, whose fits begin at `values` of parameters.
    """
    base, noise = before.identification.fit, before.identification.noise
    campaign = base.density.oscillator.campaign
    if campaign.keep_faults:
        return ()
    effects = shared_effects(beside)
    model = SharedModel(noise, effects, values or values_of(base))
    whole = model.fitted(campaign) if effects else base
    if whole is None:
        return ()
    found = [
        replace(one, fault=fault_as_read(one.fault, campaign, as_read))
        for one in compare_recordings(whole, model)
    ]
    return tuple(tuple(step) for _, step in groupby(found, key=lambda one: one.after))


def fitted_beside(before: Corrected, effects: Sequence[Effect], fit: Fit) -> Fit | None:
    """The campaign's fit with effects, from where those of `fit` stand; None where it has none."""
    base, noise = before.identification.fit, before.identification.noise
    model = SharedModel(noise, tuple(effects), values_of(fit))
    return model.fitted(base.density.oscillator.campaign)


def values_of(fit: Fit) -> dict[str, float]:
    """Parameter of a fit -> value."""
    return dict(zip(fit.names, map(float, fit.mode), strict=True))


def shared_effects(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects of the catalogue without a parameter of every recording's own."""
    return tuple(e for e in effects if not (is_formula(e) or has_own_size(e)))


def with_steps(
    before: Corrected, steps: Sequence[Step], *, rng: np.random.Generator, search: bool
) -> Corrected:
    """The same with the next steps of `comparisons` corrected, each after all before it."""
    campaign, filtered = _through_filter(steps[-1][-1].campaign, before.filtered)
    identification = identified(campaign, rng=rng, search=search)
    compared = (*before.compared, *chain.from_iterable(steps))
    return Corrected(identification, before.own, compared, filtered)


def identified(campaign: Campaign, *, rng: np.random.Generator, search: bool) -> Identification:
    """The base model's mode, under slow noise where it leaves that and nothing else, and that of
    measured inputs.
    """
    return with_input_noise(with_slow_noise(identify(campaign, rng=rng, search=search)))


def _through_filter(
    campaign: Campaign, known: Fingerprint | None
) -> tuple[Campaign, Fingerprint | None]:
    """The campaign with the filter that it proves, unless that is known already, and which it is.

    Noise behind a filter is taken for another one without it, and what recordings differ by is
    weighed against that.
    """
    filtered = known or proved_smoothing(campaign)
    if filtered is None:
        return campaign, None
    measurement = replace(campaign.measurement, smoothing=filtered.smoothing)
    return replace(campaign, measurement=measurement), filtered


def as_effects(corrected: Corrected) -> list[dict[str, Any]]:
    """Faults as entries of diagnosis.json's effects (family `recording`)."""
    by_comparison = {id(c.fault): c for c in corrected.compared}
    return [_entry(f, by_comparison.get(id(f))) for f in corrected.faults]


def fault_entries(corrected: Corrected) -> list[dict[str, Any]]:
    """All faults, notices too, for diagnosis.json's `faults`."""
    entries = [
        fault_document(f) | {"action": f.action, "chi2_before": None, "chi2_after": None}
        for f in corrected.own
    ]
    return entries + [
        fault_document(c.fault)
        | {"action": "correct", "chi2_before": c.before, "chi2_after": c.after}
        for c in corrected.told
    ]


def _others(compared: Compared) -> tuple[tuple[str, float], ...]:
    """Other explanations that are not out of the question."""
    return tuple((name, p) for name, p in compared.alternatives if p > np.exp(-DECISIVE))


def _sentence(fault: Fault, compared: Compared | None) -> str:
    """What is wrong, and what correcting it changes."""
    words = f"Recording {fault.recording}: {fault.statement}."
    if compared is None or not np.isfinite(compared.before):
        return words
    change = f"from {compared.before:.3g} to {compared.after:.3g}"
    others = "".join(f" Or {name} ({100 * p:.2g} %)." for name, p in _others(compared))
    return f"{words} Without it the reduced chi2 goes {change}.{others}"


def _entry(fault: Fault, compared: Compared | None) -> dict[str, Any]:
    others = sum(p for _, p in compared.alternatives) if compared else 0.0
    size = float(fault.size) if np.isfinite(fault.size) else 0.0
    half = Z90 * fault.error
    return {
        "id": fault.id,
        "title": fault.id.removeprefix("recording_").replace("_", " "),
        "family": "recording",
        "statement": _sentence(fault, compared),
        "probability": max(0.0, 1.0 - others),
        "delta_log_evidence": float(fault.strength) if compared else None,
        "parameters": {
            f"{fault.id}.size[{fault.recording}]": {
                "unit": fault.unit,
                "median": size,
                "ci90": [size - half, size + half],
            }
        },
        "location": place([fault]),
        "size": {"value": size, "unit": fault.unit, "percent": None, "of": ""},
    }


def place(faults: Sequence[Fault]) -> dict[str, Any]:
    """Where faults lie, as diagnosis.json's location."""
    return {
        "regime": "measurement",
        "share": 1.0,
        "displacement_m": None,
        "velocity_m_s": None,
        "time_s": [min(f.start_s for f in faults), max(f.end_s for f in faults)],
        "recordings": list(dict.fromkeys(f.recording for f in faults)),
        "cases": [],
        "force_rms_n": None,
    }


def in_words(corrected: Corrected) -> str:
    """Faults that were set aside or corrected, in sentences; empty without any."""
    by_comparison = {id(c.fault): c for c in corrected.compared}
    return "".join(f" {_sentence(f, by_comparison.get(id(f)))}" for f in corrected.faults)
