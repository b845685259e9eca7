"""How every effect is planted: shapes drawn at random, one size left free, and where it acts.

An `EffectForm` turns a size into the effect's numbers, SI, as the rig takes them. Sizes are found
later, in units of what the campaign could detect; `start` is a size that is certainly small.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi
from types import MappingProxyType

import numpy as np

from bayesimpact.trial.draw.designs import DrawnRig, log_uniform
from bayesimpact.trial.rig.recordings import Effects, Parameters

Rng = np.random.Generator


@dataclass(frozen=True)
class EffectForm:
    """An effect with its shape drawn and its size open.

    Attributes
    ----------
    build : size -> numbers; the size carries the sign
    start : a small size; 0 for an effect that is on or off
    reference : what is present at size zero, where that is not the base model
    place : displacements between which a local force acts, m, or None
    largest : the size beyond which the effect is no longer physical
    """

    build: Callable[[float], Parameters]
    start: float
    reference: Effects = field(default_factory=lambda: MappingProxyType({}))
    place: tuple[float, float] | None = None
    largest: float = np.inf


@dataclass(frozen=True)
class PlantedEffect:
    """How an effect is drawn.

    Attributes
    ----------
    regimes : places that are right: free, contact, everywhere, measurement
    form : draws its shape for a design
    obstacles, recordings : how many it needs at least
    slots : effects that share one of these exclude each other
    by_noise : its trace in the noise shows it, however small its response
    angle : it means something for angles only
    free : it means something without an obstacle only
    """

    regimes: tuple[str, ...]
    form: Callable[[DrawnRig, Rng], EffectForm]
    obstacles: int = 0
    recordings: int = 1
    slots: tuple[str, ...] = ()
    by_noise: bool = False
    angle: bool = False
    free: bool = False

    def fits(self, cases: int, recordings: int, angle: bool = False) -> bool:
        """Whether a campaign with so many obstacles and recordings can show it.

        `angle` says that the recordings are of an angle.
        """
        enough = cases >= self.obstacles and recordings >= self.recordings
        return enough and (angle or not self.angle) and not (self.free and cases)


def sign_of(rng: Rng) -> float:
    """A sign drawn at random."""
    return float(rng.choice([-1.0, 1.0]))


def one_number(
    name: str, scale: Callable[[DrawnRig], float], signed: bool = False
) -> Callable[..., EffectForm]:
    """An effect with one number, small against its natural scale."""

    def form(design: DrawnRig, rng: Rng) -> EffectForm:
        sign = sign_of(rng) if signed else 1.0
        return EffectForm(
            lambda size: {name: sign * size}, 1e-4 * scale(design), largest=scale(design)
        )

    return form


def _exponent(design: DrawnRig, rng: Rng) -> EffectForm:
    sign = sign_of(rng)
    return EffectForm(lambda size: {"exponent": 1 + sign * size}, 1e-4, largest=0.4)


def _per_case(design: DrawnRig, rng: Rng) -> EffectForm:
    keys = list(design.rig.k2)
    shares = _contrast(len(keys), rng)
    c2 = design.rig.c2

    def build(size: float) -> Parameters:
        return {"c2": {k: c2 + size * s for k, s in zip(keys, shares, strict=True)}}

    return EffectForm(build, 1e-4 * c2, largest=0.9 * c2 / max(-shares.min(), 1e-9))


def _gaps(design: DrawnRig, rng: Rng) -> EffectForm:
    keys = [r.name for r in design.releases]
    shares = _contrast(len(keys), rng)
    gap = design.rig.g

    def build(size: float) -> Parameters:
        return {"g": {k: gap + size * s for k, s in zip(keys, shares, strict=True)}}

    return EffectForm(build, 1e-5 * design.indentation, largest=0.2 * design.indentation)


def _contrast(size: int, rng: Rng) -> np.ndarray:
    """Differences with mean zero and root mean square one, (size,)."""
    values = rng.standard_normal(size)
    values -= values.mean()
    return np.asarray(values / np.sqrt(np.mean(values**2)))


def _second_stage(design: DrawnRig, rng: Rng) -> EffectForm:
    at = design.indentation * rng.uniform(0.25, 0.65)
    k2 = design.contact_stiffness
    return EffectForm(lambda size: {"stiffness": size, "depth": at}, 1e-4 * k2, largest=2 * k2)


def _hunt_crossley(design: DrawnRig, rng: Rng) -> EffectForm:
    """Between a dashpot that grows with the depth, at size zero, and a stiffer or softer power."""
    chi = log_uniform(rng, (0.03, 0.3)) / design.speed
    sign = 1.0 if rng.random() < 0.8 else -1.0

    def build(size: float) -> Parameters:
        return {"exponent": 1 + sign * size, "damping": chi}

    return EffectForm(build, 1e-4, {"hunt_crossley": build(0.0)}, largest=1.0 if sign > 0 else 0.3)


def _relaxation(design: DrawnRig, rng: Rng) -> EffectForm:
    time = log_uniform(rng, (0.1, 1.0)) / design.contact_omega
    k2 = design.contact_stiffness
    return EffectForm(lambda size: {"stiffness": size, "time": time}, 1e-4 * k2, largest=k2)


def _obstacle_mass(design: DrawnRig, rng: Rng) -> EffectForm:
    mass = design.rig.mass
    reference: Effects = {"contact_no_tension": {}}
    return EffectForm(lambda size: {"mass": size}, 1e-5 * mass, reference, largest=0.3 * mass)


def _adhesion(design: DrawnRig, rng: Rng) -> EffectForm:
    force = design.contact_stiffness * design.indentation
    reference: Effects = {"contact_no_tension": {}}
    return EffectForm(lambda size: {"force": size}, 1e-4 * force, reference, largest=0.3 * force)


def _restitution(design: DrawnRig, rng: Rng) -> EffectForm:
    return EffectForm(lambda size: {"coefficient": 1.0 - size}, 1e-5, largest=0.5)


def _second_mode(design: DrawnRig, rng: Rng) -> EffectForm:
    """Faster than a contact; what it adds stays below a third of the depth of contact."""
    omega = design.contact_omega * log_uniform(rng, (1.5, 8.0))
    damping, sign = log_uniform(rng, (0.005, 0.1)), sign_of(rng)

    def build(size: float) -> Parameters:
        return {"frequency": omega / (2 * pi), "damping": damping, "gain": sign * size}

    largest = 0.3 * omega**2 / design.contact_stiffness
    return EffectForm(build, 1e-5 * largest, largest=largest)


def _obstacle_mode(design: DrawnRig, rng: Rng) -> EffectForm:
    frequency = design.contact_omega / (2 * pi) * log_uniform(rng, (1.5, 6.0))
    damping, mass = log_uniform(rng, (0.005, 0.1)), design.rig.mass

    def build(size: float) -> Parameters:
        return {"mass": size, "frequency": frequency, "damping": damping}

    return EffectForm(build, 1e-5 * mass, largest=0.3 * mass)


def _base_motion(design: DrawnRig, rng: Rng) -> EffectForm:
    frequency = design.omega / (2 * pi) * log_uniform(rng, (1.5, 8.0))
    damping = log_uniform(rng, (0.005, 0.1))

    def build(size: float) -> Parameters:
        return {"frequency": frequency, "damping": damping, "mass_ratio": size}

    return EffectForm(build, 1e-5, largest=0.3)


def _forcing(design: DrawnRig, rng: Rng) -> EffectForm:
    side = (0.4, 0.85) if rng.random() < 0.5 else (1.2, 4.0)
    frequency = design.omega / (2 * pi) * log_uniform(rng, side)
    phases = {r.name: float(rng.uniform(0, 2 * pi)) for r in design.releases}
    force = design.rig.k1 * design.amplitude

    def build(size: float) -> Parameters:
        return {"amplitude": size, "frequency": frequency, "phase": phases}

    return EffectForm(build, 1e-5 * force, largest=0.2 * force)


def _opposite_stop(design: DrawnRig, rng: Rng) -> EffectForm:
    gap = design.amplitude * rng.uniform(0.5, 0.85)
    k1 = design.rig.k1
    return EffectForm(lambda size: {"stiffness": size, "gap": gap}, 1e-4 * k1, largest=5 * k1)


def _spring_piecewise(design: DrawnRig, rng: Rng) -> EffectForm:
    """The damper takes a good share of what the spring stores."""
    gap = design.amplitude * rng.uniform(0.4, 0.8)
    time = log_uniform(rng, (0.1, 0.5)) / design.omega
    k1 = design.rig.k1

    def build(size: float) -> Parameters:
        return {"stiffness": size, "gap": gap, "damping": time * size}

    return EffectForm(build, 1e-4 * k1, largest=5 * k1)


def _power_damping(design: DrawnRig, rng: Rng) -> EffectForm:
    """An exponent that none of the simpler laws has."""
    exponent = float(
        rng.choice([rng.uniform(0.3, 0.7), rng.uniform(1.4, 1.65), rng.uniform(2.5, 4)])
    )
    unit = design.rig.c1 * design.speed / design.speed**exponent
    return EffectForm(
        lambda size: {"coefficient": size, "exponent": exponent}, 1e-3 * unit, largest=10 * unit
    )


def _bouc_wen(design: DrawnRig, rng: Rng) -> EffectForm:
    """A loop as wide as the amplitude."""
    decay, k1 = log_uniform(rng, (1.0, 5.0)) / design.amplitude, design.rig.k1
    return EffectForm(lambda size: {"stiffness": size, "decay": decay}, 1e-4 * k1, largest=k1)


def _presliding(design: DrawnRig, rng: Rng) -> EffectForm:
    """It slides over most of the amplitude."""
    way = design.amplitude * log_uniform(rng, (0.01, 0.1))
    force = design.rig.k1 * design.amplitude
    return EffectForm(
        lambda size: {"force": size, "displacement": way}, 1e-5 * force, largest=0.1 * force
    )


def _hum(design: DrawnRig, rng: Rng) -> EffectForm:
    below = [f for f in (50.0, 60.0, 100.0, 150.0) if f < 0.4 * design.rate]
    frequency = float(rng.choice(below or [0.2 * design.rate])) * (1 + 1e-3 * rng.standard_normal())
    phases = {r.name: float(rng.uniform(0, 2 * pi)) for r in design.releases}
    reach = design.amplitude

    def build(size: float) -> Parameters:
        return {"amplitude": size, "frequency": frequency, "phase": phases}

    return EffectForm(build, 1e-6 * reach, largest=0.05 * reach)


def _released_mode(design: DrawnRig, rng: Rng) -> EffectForm:
    """Above the motion and below the band's end; every release excites it as it happens to."""
    natural, highest = design.omega / (2 * pi), 0.2 * design.rate
    frequency = log_uniform(rng, (1.5 * natural, max(min(8.0 * natural, highest), 2.0 * natural)))
    decay = log_uniform(rng, (0.5, 10.0)) / design.duration
    shares = {r.name: log_uniform(rng, (0.5, 2.0)) for r in design.releases}
    phases = {r.name: float(rng.uniform(0, 2 * pi)) for r in design.releases}
    reach = design.amplitude

    def build(size: float) -> Parameters:
        amplitudes = {name: size * share for name, share in shares.items()}
        return {
            "frequency": frequency, "decay": decay, "amplitude": amplitudes, "phase": phases
        }  # fmt: skip

    return EffectForm(build, 1e-6 * reach, largest=0.1 * reach)


def _high_pass(design: DrawnRig, rng: Rng) -> EffectForm:
    """Settled somewhere between the rest and the place of the release."""
    shares = {r.name: float(rng.uniform(0.0, 1.0)) for r in design.releases}
    natural = design.omega / (2 * pi)

    def build(size: float) -> Parameters:
        w = 2 * pi * size
        return {
            "corner": size,
            "rate": {r.name: w * shares[r.name] * r.y0 for r in design.releases},
        }

    return EffectForm(build, 1e-6 * natural, largest=0.5 * natural)


def _smoothing(design: DrawnRig, rng: Rng) -> EffectForm:
    """An undeclared Savitzky-Golay filter; on or off, its window drawn."""
    contact = pi / design.contact_omega * design.rate
    window = 2 * int(rng.integers(3, max(4, int(min(10.0, 0.35 * contact)) + 1))) + 1
    return EffectForm(lambda size: {"window": window, "order": 2}, 0.0)


PLANTED_EFFECTS: Mapping[str, PlantedEffect] = {
    "contact_damping_indentation": PlantedEffect(
        ("contact",), one_number("coefficient", lambda d: d.contact_stiffness / d.speed), 1
    ),
    "contact_damping_speed": PlantedEffect(
        ("contact",),
        one_number("coefficient", lambda d: d.contact_stiffness * d.indentation / d.speed**2),
        1,
    ),
    "contact_damping_per_case": PlantedEffect(("contact",), _per_case, 2, slots=("c2",)),
    "contact_hardening": PlantedEffect(
        ("contact",),
        one_number(
            "stiffness", lambda d: 0.3 * d.contact_stiffness / d.indentation**2, signed=True
        ),
        1,
    ),
    "contact_power_law": PlantedEffect(("contact",), _exponent, 1, slots=("k2 d",)),
    "contact_second_stage": PlantedEffect(("contact",), _second_stage, 1),
    "contact_stiffness_drift": PlantedEffect(
        ("contact",), one_number("rate", lambda d: 0.3 / d.duration, signed=True), 1
    ),
    "hunt_crossley": PlantedEffect(("contact",), _hunt_crossley, 1, slots=("c2", "k2 d")),
    "contact_no_tension": PlantedEffect(
        ("contact",), lambda d, r: EffectForm(lambda s: {}, 0.0), 1, slots=("end",)
    ),
    "contact_relaxation": PlantedEffect(("contact",), _relaxation, 1),
    "obstacle_mass": PlantedEffect(("contact",), _obstacle_mass, 1, slots=("end",)),
    "adhesion": PlantedEffect(("contact",), _adhesion, 1, slots=("end",)),
    "obstacle_restitution": PlantedEffect(("contact",), _restitution, 1),
    "obstacle_mode": PlantedEffect(("contact",), _obstacle_mode, 1),
    "base_motion": PlantedEffect(("everywhere", "free", "contact"), _base_motion),
    "second_mode": PlantedEffect(("contact",), _second_mode, 1),
    "gap_wear": PlantedEffect(
        ("contact",), one_number("step", lambda d: 0.1 * d.indentation), 1, slots=("wear",)
    ),
    "gap_per_recording": PlantedEffect(("contact",), _gaps, 1, 2, slots=("g",)),
    "coulomb_friction": PlantedEffect(
        ("free",), one_number("force", lambda d: 0.1 * d.rig.k1 * d.amplitude)
    ),
    "quadratic_drag": PlantedEffect(
        ("free",), one_number("coefficient", lambda d: 10 * d.rig.c1 / d.speed)
    ),
    "spring_quadratic": PlantedEffect(
        ("free",), one_number("stiffness", lambda d: 0.3 * d.rig.k1 / d.amplitude, signed=True)
    ),
    "spring_cubic": PlantedEffect(
        ("free",), one_number("stiffness", lambda d: 0.3 * d.rig.k1 / d.amplitude**2, signed=True)
    ),
    "stiffness_drift": PlantedEffect(
        ("free",), one_number("rate", lambda d: 0.3 / d.duration, signed=True), slots=("k1",)
    ),
    "harmonic_forcing": PlantedEffect(("everywhere", "free"), _forcing),
    "opposite_stop": PlantedEffect(("free",), _opposite_stop, slots=("second stop",)),
    "spring_piecewise": PlantedEffect(("free",), _spring_piecewise, slots=("second stop",)),
    "sensor_drift": PlantedEffect(
        ("measurement",), one_number("rate", lambda d: 0.3 * d.amplitude / d.duration, signed=True)
    ),
    "sensor_quadratic": PlantedEffect(
        ("measurement",), one_number("gain", lambda d: 0.3 / d.amplitude, signed=True)
    ),
    "sensor_cubic": PlantedEffect(
        ("measurement",), one_number("gain", lambda d: 0.3 / d.amplitude**2, signed=True)
    ),
    "sensor_hum": PlantedEffect(("measurement",), _hum, slots=("hum",)),
    "sensor_high_pass": PlantedEffect(("measurement",), _high_pass),
    "released_mode": PlantedEffect(("measurement",), _released_mode, slots=("hum",), free=True),
    "pendulum_sine": PlantedEffect(
        ("free",), lambda d, r: EffectForm(lambda s: {}, 0.0), angle=True
    ),
    "pendulum_with_spring": PlantedEffect(
        ("free",), one_number("stiffness", lambda d: d.rig.k1), angle=True
    ),
    "spring_quintic": PlantedEffect(
        ("free",), one_number("stiffness", lambda d: 0.3 * d.rig.k1 / d.amplitude**4, signed=True)
    ),
    "power_damping": PlantedEffect(("free",), _power_damping),
    "structural_damping": PlantedEffect(("free",), one_number("loss", lambda d: 0.1), obstacles=1),
    "hysteresis_bouc_wen": PlantedEffect(("free",), _bouc_wen),
    "presliding_friction": PlantedEffect(("free",), _presliding),
    "smoothing": PlantedEffect(("measurement",), _smoothing, slots=("smoothing",), by_noise=True),
}
"""Every effect of the catalogue that may be planted, by its id."""
