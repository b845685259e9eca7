"""Initial estimates of every parameter from the recordings alone: the start of the identification.

k1, c1 and the rest readings come from the flights on the free side and from the free tails; gap,
stiffness and damping of the stop from the cycles between lower turning points; y0 and v0 from the
first samples. Where a recording has a measured input, all of it comes from the equation of motion
in weak form (`driven`). Nothing here follows a whole recording with impacts, so nothing can lock
onto a wrong phase.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.frozen import Picklable
from bayesimpact.data.gaps import before_gap
from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.inference.initial.contact import Contact, Free, fit_contact
from bayesimpact.inference.initial.driven import estimate_driven
from bayesimpact.inference.initial.observe import (
    Observed,
    look,
    observe_cycles,
    observe_decay,
    observe_flights,
    with_tails,
)
from bayesimpact.inference.initial.preloaded import estimate_preloaded, is_preloaded
from bayesimpact.inference.initial.readings import decay_of_readings
from bayesimpact.inference.initial.release import RoughOscillator, release
from bayesimpact.response import local
from bayesimpact.response.flight import Flight
from bayesimpact.response.half_cycles import spectral_period

MEANS = 100.0  # the mean of a velocity or an acceleration is as good as that of so many samples


@dataclass(frozen=True, eq=False)
class Estimates(Picklable):
    """Rough values of all parameters of a campaign, SI units.

    Attributes
    ----------
    k1, c1 : N/m, N s/m
    g, c2 : m, N s/m; without a stop infinite and zero
    k2 : case -> N/m; empty without a stop
    offset, y0, v0 : recording -> the reading's unit, m, m/s (rad for angles); y0 counts from the
        rest position
    noise : recording -> standard deviation of the noise, in the reading's unit
    sd : parameter name -> rough standard error, names as in `values`; infinite where the recordings
        do not tell, for example k2 of an obstacle that was never touched
    impacts : recording -> number of cycles with an impact
    input_gain : of the inputs whose gain is free, None without any
    high_pass_state : recording -> what a declared high-pass had settled on, from rest
    """

    k1: float
    c1: float
    g: float
    c2: float
    k2: Mapping[str, float]
    offset: Mapping[str, float]
    y0: Mapping[str, float]
    v0: Mapping[str, float]
    noise: Mapping[str, float]
    sd: Mapping[str, float]
    impacts: Mapping[str, int]
    input_gain: float | None = None
    high_pass_state: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    __repr__ = short_repr

    @property
    def values(self) -> dict[str, float]:
        """All estimates by parameter name: c1, k1, c2, g, k2[<case>], y0[<recording>], ..."""
        named = {"c1": self.c1, "k1": self.k1}
        if self.k2:
            named |= {"c2": self.c2, "g": self.g}
            named |= {f"k2[{case}]": value for case, value in self.k2.items()}
        if self.input_gain is not None:
            named["input_gain"] = self.input_gain
        for kind in ("y0", "v0", "offset", "high_pass_state"):
            table: Mapping[str, float] = getattr(self, kind)
            named |= {f"{kind}[{name}]": value for name, value in table.items()}
        return named

    def start(self, name: str, level: float) -> float:
        """Where a search begins: the estimate of a base parameter, or for a gain 1, for others the
        noise's `level`.
        """
        return self.values.get(name, 1.0 if name.startswith("gain[") else level)

    def with_unknown_errors(self) -> Estimates:
        """The same values, of which nobody knows how good they are."""
        unknown = {name: float("inf") for name in self.values}
        return replace(self, sd=MappingProxyType(unknown))


def estimate(campaign: Campaign) -> Estimates:
    """Estimate all parameters of a campaign from its recordings.

    Parameters
    ----------
    campaign : one or more recordings of one oscillator

    Raises
    ------
    InputError : the recordings show no oscillation that can be told from the noise
    """
    if any(r.input is not None for r in campaign.recordings):
        return _driven(campaign)
    campaign = replace(campaign, recordings=tuple(map(before_gap, campaign.recordings)))
    observed = look(campaign)
    if campaign.stop:
        observed, flight = observe_flights(observed)
    else:
        flight = observe_decay(observed)
        observed, flight = decay_of_readings(campaign.recordings, observed, flight)
    if flight is None:
        raise InputError(
            f"campaign {campaign.name!r}",
            "no oscillation above the noise",
            "free decays of two periods or more",
        )
    contact, impacts = None, [0] * len(campaign.recordings)
    if campaign.stop and is_preloaded(observed):
        found = estimate_preloaded(campaign, observed)
        if found is not None:
            flight = replace(flight, offsets=found.offsets, sd_offset=found.sd_offset)
            return _collect(campaign, observed, flight, found.contact, found.impacts)
    if campaign.stop:
        cases = [campaign.cases.index(r.case) for r in campaign.recordings]
        # Twice: the first gap tells where the free tails begin, these sharpen the decay rate, and
        # the second estimate of the stop needs that.
        for _ in range(2):
            cycles, places = observe_cycles(cases, observed, flight)
            free = _free(campaign.mass, flight)
            if len(places):
                contact = fit_contact(cycles, free, len(campaign.cases), contact)
            flight, impacts = with_tails(observed, flight, cycles, places, contact, campaign.mass)
        if contact is not None:
            relative = 0.5 * float(np.log(contact.k1 / _free(campaign.mass, flight).k1))
            flight = replace(flight, offsets=flight.offsets + relative * flight.offset_slope)
    return _collect(campaign, observed, flight, contact, impacts)


def _driven(campaign: Campaign) -> Estimates:
    """Estimates for a campaign with measured inputs; standard errors are not known."""
    found, recordings = estimate_driven(campaign), campaign.recordings
    known = found.k2[np.isfinite(found.k2)]
    usual = float(np.exp(np.mean(np.log(known)))) if known.size else found.k1
    k2 = np.where(np.isfinite(found.k2), found.k2, usual)
    impacts = [int(np.sum((m[:-1] < found.gap) & (m[1:] >= found.gap))) for m in found.moved]

    def named(values: Iterable[float]) -> Mapping[str, float]:
        pairs = zip(recordings, values, strict=True)
        return MappingProxyType({r.name: float(value) for r, value in pairs})

    noises = [local.noise_level(r.samples, spectral_period(r.samples, r.order)) for r in recordings]
    free = any(r.input is not None and r.input.free for r in recordings)
    estimates = Estimates(
        k1=found.k1,
        c1=found.c1,
        g=found.gap,
        c2=found.c2,
        k2=MappingProxyType(dict(zip(campaign.cases, map(float, k2), strict=True))),
        offset=named(found.offset),
        y0=named(found.y0),
        v0=named(found.v0),
        noise=named(noises),
        sd=MappingProxyType({}),
        impacts=MappingProxyType({r.name: n for r, n in zip(recordings, impacts, strict=True)}),
        input_gain=found.gain if free else None,
    )
    return estimates.with_unknown_errors()


def _free(mass: float, flight: Flight) -> Free:
    """The free oscillator from its flights, with standard errors that allow for a small misfit."""
    c1, k1 = 2 * mass * flight.decay, mass * (flight.omega**2 + flight.decay**2)
    sd_c1 = float(np.hypot(2 * mass * flight.sd_decay, 0.01 * abs(c1))) + 1e-9 * mass * flight.omega
    sd_k1 = float(np.hypot(2 * flight.sd_omega / flight.omega, 2e-5)) * k1
    return Free(mass=mass, c1=max(c1, 0.0), k1=k1, sd_c1=sd_c1, sd_k1=sd_k1)


def _collect(
    campaign: Campaign,
    observed: Observed,
    flight: Flight,
    contact: Contact | None,
    impacts: list[int],
) -> Estimates:
    free = _free(campaign.mass, flight)
    c1, k1, sd = free.c1, free.k1, {"c1": free.sd_c1, "k1": free.sd_k1}
    g, c2, k2 = float("inf"), 0.0, {}
    if contact is not None:
        # The joint fit knows more where hardly a cycle is free, and no less elsewhere.
        c1, k1 = contact.c1, contact.k1
        g, c2 = contact.g, contact.c2
        known = contact.k2[contact.had_contact]
        usual = float(np.exp(np.mean(np.log(known)))) if known.size else k1
        k2 = {
            case: float(value) if hit else usual
            for case, value, hit in zip(
                campaign.cases, contact.k2, contact.had_contact, strict=True
            )
        }
        sd |= {"c1": contact.sd_c1, "k1": contact.sd_k1, "c2": contact.sd_c2, "g": contact.sd_g}
        sd |= {
            f"k2[{case}]": float(s) for case, s in zip(campaign.cases, contact.sd_k2, strict=True)
        }
    elif campaign.stop:
        # Never touched: the gap is at least what was reached; nothing tells of the stop itself.
        g = max(float((x - o).max()) for x, o in zip(observed.samples, flight.offsets, strict=True))
        c2, k2 = c1, {case: k1 for case in campaign.cases}
        sd |= {name: float("inf") for name in ("c2", "g", *(f"k2[{case}]" for case in k2))}
    # A decay too slow to be seen still needs a positive number to search around.
    c1 = max(c1, 0.5 * sd["c1"])
    offset, y0, v0, noise = {}, {}, {}, {}
    for r, recording in enumerate(campaign.recordings):
        name = recording.name
        stiffness = k2.get(recording.case, 0.0)
        start = release(
            observed.samples[r] - flight.offsets[r],
            recording.interval,
            RoughOscillator(campaign.mass, c1, k1, c2, g, stiffness),
            max(observed.noises[r], 1e-12 * observed.size(r)),
        )
        bias = observed.biases[r]
        offset[name] = float(flight.offsets[r]) if bias is None else bias
        noise[name] = observed.reading_noises[r]
        y0[name], v0[name], sd[f"y0[{name}]"], sd[f"v0[{name}]"] = start
        still = flight.sd_offset if bias is None else np.std(recording.samples) / np.sqrt(MEANS)
        sd[f"offset[{name}]"] = float(still)
    return Estimates(
        k1=k1,
        c1=c1,
        g=g,
        c2=c2,
        k2=MappingProxyType(k2),
        offset=MappingProxyType(offset),
        y0=MappingProxyType(y0),
        v0=MappingProxyType(v0),
        noise=MappingProxyType(noise),
        sd=MappingProxyType(sd),
        impacts=MappingProxyType(
            {r.name: count for r, count in zip(campaign.recordings, impacts, strict=True)}
        ),
    )
