"""The catalogue of effects as the rig plays them: an implementation of its own, from the equations.

d = y - g is the indentation, v = y'. Forces in N on the left-hand side of m y'' + ... = 0. An
effect may add a part, change the recording's site, distort the probe or change the chain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi, sin

from bayesimpact.data.campaign import Smoothing
from bayesimpact.trial.rig.measuring_chain import MeasuringChain, Probe
from bayesimpact.trial.rig.modes import base_inertia, base_motion, obstacle_mode, second_mode
from bayesimpact.trial.rig.parts import Law, Piece, Rates, RigPart, Site, State

Numbers = Mapping[str, float]
Contact = Callable[[float, float], float]  # (d, v) -> N

MILLIMETRE = 1e-3


@dataclass(frozen=True)
class Planted:
    """How an effect enters the rig.

    Attributes
    ----------
    parameters : names of its numbers, SI (frequencies in Hz)
    per_recording, per_case : names of numbers that differ between recordings or obstacles
    optional : names that may be left out
    obstacle : whether it means something only with an obstacle
    part : (site, numbers, first own state) -> what is added to the motion
    site, probe, chain : what is changed, given the numbers
    """

    parameters: tuple[str, ...] = ()
    per_recording: tuple[str, ...] = ()
    per_case: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    obstacle: bool = False
    part: Callable[[Site, Numbers, int], RigPart] | None = None
    site: Callable[[Site, Numbers], Site] | None = None
    probe: Callable[[Probe, Numbers], Probe] | None = None
    chain: Callable[[MeasuringChain, Numbers], MeasuringChain] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Every parameter it takes."""
        return self.parameters + self.per_recording + self.per_case + self.optional


def everywhere(law: Law) -> Callable[[Piece], Law]:
    """A law that is the same on every piece."""
    return lambda piece: law


def in_contact(force: Contact) -> RigPart:
    """A force between mass and obstacle, given as a function of indentation and velocity."""

    def law(piece: Piece) -> Law | None:
        gap = piece.gap
        return (lambda t, y, v, state: force(y - gap, v)) if piece.contact else None

    return RigPart(law, in_reaction=True)


def _damping_indentation(site: Site, p: Numbers, slot: int) -> RigPart:
    """Lam d v (Hunt & Crossley 1975)."""
    lam = p["coefficient"]
    return in_contact(lambda d, v: lam * d * v)


def _damping_speed(site: Site, p: Numbers, slot: int) -> RigPart:
    """B abs(v) v in contact."""
    b = p["coefficient"]

    def law(piece: Piece) -> Law | None:
        signed = b * piece.sign
        return (lambda t, y, v, state: signed * v * v) if piece.contact else None

    return RigPart(law, in_reaction=True)


def _hardening(site: Site, p: Numbers, slot: int) -> RigPart:
    """K3 d^3."""
    k3 = p["stiffness"]
    return in_contact(lambda d, v: k3 * d * d * d)


def _power_law(site: Site, p: Numbers, slot: int) -> RigPart:
    """What k2 d (d / 1 mm)^(n-1) adds to k2 d; odd in d where a unilateral contact goes below 0."""
    k2, power = site.k2, p["exponent"] - 1
    return in_contact(lambda d, v: k2 * d * ((abs(d) / MILLIMETRE) ** power - 1) if d else 0.0)


def _hunt_crossley(site: Site, p: Numbers, slot: int) -> RigPart:
    """K2 d^n (1 + chi v), d in mm, less the k2 d that the site has; its c2 is put to zero."""
    k2, power, chi = site.k2, p["exponent"] - 1, p["damping"]

    def force(d: float, v: float) -> float:
        return k2 * d * ((abs(d) / MILLIMETRE) ** power * (1 + chi * v) - 1) if d else 0.0

    return in_contact(force)


def _second_stage(site: Site, p: Numbers, slot: int) -> RigPart:
    """Ks (d - ds) when d > ds."""
    ks, depth = p["stiffness"], p["depth"]

    def law(piece: Piece) -> Law | None:
        edge = piece.gap + depth
        if not (piece.contact and piece.above(edge)):
            return None
        return lambda t, y, v, state: ks * (y - edge)

    return RigPart(law, in_reaction=True, depths=(depth,))


def _contact_stiffness_drift(site: Site, p: Numbers, slot: int) -> RigPart:
    """What k2 (1 + r t) adds to k2."""
    growth = site.k2 * p["rate"]

    def law(piece: Piece) -> Law | None:
        gap = piece.gap
        return (lambda t, y, v, state: growth * t * (y - gap)) if piece.contact else None

    return RigPart(law, in_reaction=True)


def _relaxation(site: Site, p: Numbers, slot: int) -> RigPart:
    """Maxwell branch: force z, z' = kz v - z/tau in contact, z' = -z/tau in flight."""
    kz, decay = p["stiffness"], 1 / p["time"]

    def law(piece: Piece) -> Law | None:
        return (lambda t, y, v, state: state[slot]) if piece.contact else None

    def rates(piece: Piece) -> Rates:
        feed = kz if piece.contact else 0.0
        return lambda t, y, v, state: (feed * v - decay * state[slot],)

    return RigPart(law, in_reaction=True, states=(0.0,), rates=rates)


def _coulomb(site: Site, p: Numbers, slot: int) -> RigPart:
    """F sign(v), sticking."""
    force = p["force"]
    return RigPart(friction=lambda piece: lambda v: force)


def _drag(site: Site, p: Numbers, slot: int) -> RigPart:
    """B abs(v) v."""
    b = p["coefficient"]

    def law(piece: Piece) -> Law:
        signed = b * piece.sign
        return lambda t, y, v, state: signed * v * v

    return RigPart(law)


def _spring_quadratic(site: Site, p: Numbers, slot: int) -> RigPart:
    kq = p["stiffness"]
    return RigPart(everywhere(lambda t, y, v, state: kq * y * y))


def _spring_cubic(site: Site, p: Numbers, slot: int) -> RigPart:
    k3 = p["stiffness"]
    return RigPart(everywhere(lambda t, y, v, state: k3 * y * y * y))


def _stiffness_drift(site: Site, p: Numbers, slot: int) -> RigPart:
    """What k1 (1 + r t) adds to k1."""
    growth = site.k1 * p["rate"]
    return RigPart(everywhere(lambda t, y, v, state: growth * t * y))


def _forcing(site: Site, p: Numbers, slot: int) -> RigPart:
    """-A sin(w t + phase)."""
    amplitude, omega, phase = p["amplitude"], 2 * pi * p["frequency"], p["phase"]
    period = 1 / p["frequency"]

    def law(t: float, y: float, v: float, state: State) -> float:
        return -amplitude * sin(omega * t + phase)

    return RigPart(everywhere(law), period=period)


def _opposite_stop(site: Site, p: Numbers, slot: int) -> RigPart:
    """Ks (y + gs) when y < -gs."""
    ks, place = p["stiffness"], -p["gap"]

    def law(piece: Piece) -> Law | None:
        return None if piece.above(place) else (lambda t, y, v, state: ks * (y - place))

    return RigPart(law, kinks=(place,))


def _spring_piecewise(site: Site, p: Numbers, slot: int) -> RigPart:
    """Kp (y + gp) + cp v when y < -gp."""
    kp, place, cp = p["stiffness"], -p["gap"], p["damping"]

    def law(piece: Piece) -> Law | None:
        if piece.above(place):
            return None
        return lambda t, y, v, state: kp * (y - place) + cp * v

    return RigPart(law, kinks=(place,))


def _pendulum(site: Site, p: Numbers, slot: int) -> RigPart:
    """What K sin y adds to K y; K is k1 for a plain pendulum."""
    weight = p.get("stiffness", site.k1)
    return RigPart(everywhere(lambda t, y, v, state: weight * (sin(y) - y)))


def _spring_quintic(site: Site, p: Numbers, slot: int) -> RigPart:
    k5 = p["stiffness"]
    return RigPart(everywhere(lambda t, y, v, state: k5 * y**5))


def _power_damping(site: Site, p: Numbers, slot: int) -> RigPart:
    """C abs(v)^n sign(v)."""
    c, exponent = p["coefficient"], p["exponent"]

    def law(piece: Piece) -> Law:
        sign = piece.sign
        return lambda t, y, v, state: sign * c * max(sign * v, 0.0) ** exponent

    return RigPart(law)


def _structural_damping(site: Site, p: Numbers, slot: int) -> RigPart:
    """H k1 abs(y) sign(v)."""
    share = p["loss"] * site.k1

    def law(piece: Piece) -> Law:
        side = 1 if piece.above(0.0) else -1
        signed = share * (piece.sign or -side) * side  # at rest it helps to hold against the spring
        return lambda t, y, v, state: signed * y

    return RigPart(law, kinks=(0.0,))


def _bouc_wen(site: Site, p: Numbers, slot: int) -> RigPart:
    """Force a z, z' = v - b abs(v) z, from the share `start` of 1 / b on."""
    stiffness, decay = p["stiffness"], p["decay"]

    def rates(piece: Piece) -> Rates:
        signed = piece.sign * decay
        return lambda t, y, v, state: (v * (1 - signed * state[slot]),)

    law = everywhere(lambda t, y, v, state: stiffness * state[slot])
    return RigPart(law, states=(p.get("start", 0.0) / decay if decay else 0.0,), rates=rates)


def _presliding(site: Site, p: Numbers, slot: int) -> RigPart:
    """Dahl's friction: force F u, u' = v (1 - u sign(v)) / x, from u = `start` on."""
    force, way = p["force"], p["displacement"]

    def rates(piece: Piece) -> Rates:
        sign = piece.sign
        return lambda t, y, v, state: (v * (1 - sign * state[slot]) / way,)

    law = everywhere(lambda t, y, v, state: force * state[slot])
    return RigPart(law, states=(p.get("start", 0.0),), rates=rates)


def _smoothing(chain: MeasuringChain, p: Numbers) -> MeasuringChain:
    """Savitzky-Golay with window and order, or a first-order lag with time_constant."""
    if "time_constant" in p:
        return replace(chain, smoothing=Smoothing("lag", time_constant=p["time_constant"]))
    return replace(chain, smoothing=Smoothing("savgol", int(p["window"]), int(p["order"])))


def _hum(probe: Probe, p: Numbers) -> Probe:
    return replace(probe, hum=p["amplitude"], hum_frequency=p["frequency"], hum_phase=p["phase"])


def _released_mode(probe: Probe, p: Numbers) -> Probe:
    return replace(_hum(probe, p), hum_decay=p["decay"])


def _high_pass(probe: Probe, p: Numbers) -> Probe:
    return replace(probe, corner=p["corner"], settling=p["rate"])


CATALOGUE: Mapping[str, Planted] = {
    "contact_damping_indentation": Planted(
        ("coefficient",), obstacle=True, part=_damping_indentation
    ),
    "contact_damping_speed": Planted(("coefficient",), obstacle=True, part=_damping_speed),
    "contact_damping_per_case": Planted(
        per_case=("c2",), obstacle=True, site=lambda site, p: replace(site, c2=p["c2"])
    ),
    "contact_hardening": Planted(("stiffness",), obstacle=True, part=_hardening),
    "contact_power_law": Planted(("exponent",), obstacle=True, part=_power_law),
    "contact_second_stage": Planted(("stiffness", "depth"), obstacle=True, part=_second_stage),
    "contact_stiffness_drift": Planted(("rate",), obstacle=True, part=_contact_stiffness_drift),
    "hunt_crossley": Planted(
        ("exponent", "damping"),
        obstacle=True,
        part=_hunt_crossley,
        site=lambda site, p: replace(site, c2=0.0),
    ),
    "contact_no_tension": Planted(
        obstacle=True, site=lambda site, p: replace(site, unilateral=True)
    ),
    "obstacle_mass": Planted(
        ("mass",),
        obstacle=True,
        site=lambda site, p: replace(site, unilateral=True, obstacle_mass=p["mass"]),
    ),
    "adhesion": Planted(
        ("force",),
        obstacle=True,
        site=lambda site, p: replace(site, unilateral=True, adhesion=p["force"]),
    ),
    "obstacle_restitution": Planted(
        ("coefficient",),
        obstacle=True,
        site=lambda site, p: replace(site, restitution=p["coefficient"]),
    ),
    "contact_relaxation": Planted(("stiffness", "time"), obstacle=True, part=_relaxation),
    "obstacle_mode": Planted(("mass", "frequency", "damping"), obstacle=True, part=obstacle_mode),
    "base_motion": Planted(
        ("frequency", "damping", "mass_ratio"), part=base_motion, site=base_inertia
    ),
    "second_mode": Planted(("frequency", "damping", "gain"), obstacle=True, part=second_mode),
    "gap_wear": Planted(
        ("step",), obstacle=True, site=lambda site, p: replace(site, gap_step=p["step"])
    ),
    "gap_per_recording": Planted(
        per_recording=("g",), obstacle=True, site=lambda site, p: replace(site, gap=p["g"])
    ),
    "coulomb_friction": Planted(("force",), part=_coulomb),
    "quadratic_drag": Planted(("coefficient",), part=_drag),
    "spring_quadratic": Planted(("stiffness",), part=_spring_quadratic),
    "spring_cubic": Planted(("stiffness",), part=_spring_cubic),
    "stiffness_drift": Planted(("rate",), part=_stiffness_drift),
    "harmonic_forcing": Planted(
        ("amplitude", "frequency"), per_recording=("phase",), part=_forcing
    ),
    "opposite_stop": Planted(("stiffness", "gap"), part=_opposite_stop),
    "spring_piecewise": Planted(("stiffness", "gap", "damping"), part=_spring_piecewise),
    "sensor_drift": Planted(("rate",), probe=lambda probe, p: replace(probe, drift=p["rate"])),
    "sensor_quadratic": Planted(
        ("gain",), probe=lambda probe, p: replace(probe, quadratic=p["gain"])
    ),
    "sensor_cubic": Planted(("gain",), probe=lambda probe, p: replace(probe, cubic=p["gain"])),
    "sensor_hum": Planted(("amplitude", "frequency"), per_recording=("phase",), probe=_hum),
    "sensor_high_pass": Planted(("corner",), per_recording=("rate",), probe=_high_pass),
    "released_mode": Planted(
        ("frequency", "decay"), per_recording=("amplitude", "phase"), probe=_released_mode
    ),
    "pendulum_sine": Planted(optional=("stiffness",), part=_pendulum),
    "pendulum_with_spring": Planted(("stiffness",), part=_pendulum),
    "spring_quintic": Planted(("stiffness",), part=_spring_quintic),
    "power_damping": Planted(("coefficient", "exponent"), part=_power_damping),
    "structural_damping": Planted(("loss",), part=_structural_damping),
    "hysteresis_bouc_wen": Planted(("stiffness", "decay"), optional=("start",), part=_bouc_wen),
    "presliding_friction": Planted(
        ("force", "displacement"), optional=("start",), part=_presliding
    ),
    "smoothing": Planted(optional=("window", "order", "time_constant"), chain=_smoothing),
    "noise_correlated": Planted(
        ("correlation",), chain=lambda chain, p: replace(chain, correlation=p["correlation"])
    ),
}
