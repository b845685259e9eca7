"""A slow and obvious twin of the general simulator: SciPy's DOP853 from event to event.

Every line of `force` is a line of the catalogue: d = y - g, v = y', forces on the left-hand side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

FREE, CONTACT, RELEASED = "free", "contact", "released"


@dataclass
class Naive:
    """One recording of an oscillator with effects (id -> parameters); SI, frequencies in Hz."""

    mass: float
    c1: float
    k1: float
    c2: float = 0.0
    g: float = np.inf
    k2: float = 0.0
    y0: float = 0.0
    v0: float = 0.0
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        self.c2 = self.number("contact_damping_per_case", "c2", self.c2)
        self.g = self.number("gap_per_recording", "g", self.g)
        self.gap, self.m2 = self.g, self.number("obstacle_mass", "mass")
        self.one_sided = bool(
            {"contact_no_tension", "obstacle_mass", "adhesion"} & set(self.effects)
        )
        self.pull = self.number("adhesion", "force")
        self.friction = self.number("coulomb_friction", "force")
        self.t, self.slide = 0.0, np.sign(self.v0)
        self.beyond = self.y0 < -self.number("spring_piecewise", "gap", np.inf)
        # y, v, relaxation, displacement and velocity of second mode, obstacle, frame; loops
        bouc_wen, dahl = (
            self.number(e, "start") for e in ("hysteresis_bouc_wen", "presliding_friction")
        )
        bouc_wen /= self.number("hysteresis_bouc_wen", "decay") or 1.0
        dahl *= self.number("presliding_friction", "force")
        self.state = [self.y0, self.v0, *[0.0] * 7, bouc_wen, dahl]
        self.ratio = self.number("base_motion", "mass_ratio")
        self.mode = FREE

    def number(self, effect: str, name: str, default: float = 0.0) -> float:
        return self.effects.get(effect, {}).get(name, default)

    def in_contact(self, t: float, y: float, v: float, z: float) -> float:
        """Everything that acts between obstacle and mass, N."""
        d, p = y - self.gap, self.number
        force = self.c2 * v + self.k2 * d
        force += p("contact_damping_indentation", "coefficient") * d * v
        force += p("contact_damping_speed", "coefficient") * abs(v) * v
        force += p("contact_hardening", "stiffness") * d**3
        force += self.k2 * p("contact_stiffness_drift", "rate") * t * d
        n = p("contact_power_law", "exponent", 1.0)
        force += self.k2 * d * ((abs(d) / 1e-3) ** (n - 1) - 1) if d != 0 else 0.0
        if "hunt_crossley" in self.effects:
            n, chi = p("hunt_crossley", "exponent"), p("hunt_crossley", "damping")
            force -= self.c2 * v + self.k2 * d
            force += self.k2 * 1e-3 * np.sign(d) * abs(d / 1e-3) ** n * (1 + chi * v)
        if d > p("contact_second_stage", "depth", np.inf):
            force += p("contact_second_stage", "stiffness") * (
                d - p("contact_second_stage", "depth")
            )
        return force + z

    def everywhere(self, t: float, y: float, v: float) -> float:
        """Everything else but dry friction, N."""
        p = self.number
        force = self.c1 * v + self.k1 * (1 + p("stiffness_drift", "rate") * t) * y
        force += p("quadratic_drag", "coefficient") * abs(v) * v
        force += p("spring_quadratic", "stiffness") * y**2 + p("spring_cubic", "stiffness") * y**3
        w = 2 * np.pi * p("harmonic_forcing", "frequency")
        phase = p("harmonic_forcing", "phase")
        force -= p("harmonic_forcing", "amplitude") * np.sin(w * t + phase)
        K = p("pendulum_with_spring", "stiffness") + self.k1 * ("pendulum_sine" in self.effects)
        force += K * (np.sin(y) - y) + p("spring_quintic", "stiffness") * y**5
        force += (
            p("power_damping", "coefficient")
            * abs(v) ** p("power_damping", "exponent")
            * (np.sign(v))
        )
        force += p("structural_damping", "loss") * self.k1 * abs(y) * self.slide
        if y < -p("opposite_stop", "gap", np.inf):
            force += p("opposite_stop", "stiffness") * (y + p("opposite_stop", "gap"))
        if self.beyond:
            force += p("spring_piecewise", "stiffness") * (y + p("spring_piecewise", "gap"))
            force += p("spring_piecewise", "damping") * v
        return force

    def mode_of(self, effect: str) -> tuple[float, float]:
        """Squared angular frequency and damping rate of an effect's mode."""
        w = 2 * np.pi * self.number(effect, "frequency")
        return w**2, 2 * self.number(effect, "damping") * w

    def ringing(self, state: list[float]) -> float:
        """Pull of the place of contact on the mass inside the obstacle, per kg of it."""
        W, drag = self.mode_of("obstacle_mode")
        place, speed = (state[0] - self.gap, state[1]) if self.mode == CONTACT else (0.0, 0.0)
        return W * (place - state[5]) + drag * (speed - state[6])

    def obstacle(self, t: float, state: list[float]) -> float:
        """Everything between obstacle and mass, the mass inside the obstacle included, N."""
        inside = self.number("obstacle_mode", "mass") * self.ringing(state)
        return self.in_contact(t, *state[:3]) + inside

    def frame_pull(self, state: list[float]) -> float:
        """What spring and damper of the frame do to it, per kg of it."""
        W, drag = self.mode_of("base_motion")
        return -W * state[7] - drag * state[8]

    def acceleration(self, t: float, state: list[float]) -> float:
        """y'' from m (y'' + X'') + N = 0, X'' = pull + r N / m; N contains m2 y''."""
        force = self.everywhere(t, *state[:2]) + self.friction * self.slide + self.slipping(state)
        touching, rest = self.mode == CONTACT, 1 + self.ratio
        if touching:
            force += self.obstacle(t, state)
        inertia = self.mass + rest * self.m2 * touching
        return -(rest * force + self.mass * self.frame_pull(state)) / inertia

    def reaction(self, t: float, state: list[float]) -> float:
        """Force of the obstacle on the mass, N: what moves the obstacle's own mass comes on top."""
        return self.obstacle(t, state) + self.m2 * self.acceleration(t, state)

    def right_hand_side(self, t: float, state: list[float]) -> list[float]:
        v, z = state[1:3]
        touching = self.mode == CONTACT
        stiffness, time = (self.number("contact_relaxation", n) for n in ("stiffness", "time"))
        rate = stiffness * v * touching - z / time if time else 0.0
        held = self.friction > 0 and self.slide == 0
        a = 0.0 if held else self.acceleration(t, state)
        slope = [0.0 if held else v, a, rate]
        slope += [*self.second_mode(t, state, held), state[6], self.ringing(state)]
        shaken = -(self.ratio * a - self.frame_pull(state)) / (1 + self.ratio)
        return [*slope, state[8], shaken, *self.loops(slope[0], *state[9:])]

    def loops(self, v: float, z: float, friction: float) -> list[float]:
        """Rates of Bouc and Wen's z and of Dahl's friction force."""
        p, F = self.number, self.number("presliding_friction", "force")
        bouc_wen = v - p("hysteresis_bouc_wen", "decay") * v * self.slide * z
        if F == 0:
            return [bouc_wen, 0.0]
        s = F / p("presliding_friction", "displacement")
        return [bouc_wen, s * v * (1 - friction / F * self.slide)]

    def slipping(self, state: list[float]) -> float:
        """Forces of the two, N."""
        return self.number("hysteresis_bouc_wen", "stiffness") * state[9] + state[10]

    def second_mode(self, t: float, state: list[float], held: bool) -> list[float]:
        """Rates of the mode that the contact force excites."""
        p, force = self.number, 0.0
        if self.mode == CONTACT:
            force = self.obstacle(t, state) if held else self.reaction(t, state)
        W, drag = self.mode_of("second_mode")
        return [state[4], p("second_mode", "gain") * force - W * state[3] - drag * state[4]]

    def watches(self, sign: float) -> dict[str, tuple[object, float]]:
        """Event -> (function of t and state, direction in which it crosses zero)."""
        found = {"turn": (lambda t, s: s[1], -sign)}
        if self.mode == FREE:
            found["touch"] = (lambda t, s: s[0] - self.gap, 1.0)
        elif self.mode == RELEASED or not self.one_sided:
            found["gap"] = (lambda t, s: s[0] - self.gap, -1.0)
        else:
            found["release"] = (lambda t, s: self.reaction(t, s) + self.pull, -1.0)
        for effect, name, scale in (
            ("opposite_stop", "gap", -1.0),
            ("spring_piecewise", "gap", -1.0),
            ("contact_second_stage", "depth", 1.0),
            ("structural_damping", "", -1.0),
        ):
            if effect in self.effects:
                base = 0.0 if scale < 0 else self.gap
                level = base + scale * self.number(effect, name)
                if sign * (level - self.state[0]) <= 1e-14:
                    continue  # behind, or just crossed
                found[effect] = (lambda t, s, level=level: s[0] - level, sign)
        return found

    def run(self, times: np.ndarray) -> np.ndarray:
        """Displacement at `times`, (n,), m."""
        out, filled = np.empty(times.size), 0
        if self.y0 > self.gap:
            self.mode = CONTACT
            if self.one_sided and self.reaction(0.0, self.state) <= -self.pull:
                self.mode = RELEASED
        while filled < times.size:
            sign = self.start()
            watches = self.watches(sign)
            if sign == 0:
                watches = {"slip": (self.slack, -1.0)}
            events = []
            for function, direction in watches.values():
                event = lambda t, s, function=function: function(t, s)  # noqa: E731
                event.terminal, event.direction = True, direction
                events.append(event)
            answer = solve_ivp(
                self.right_hand_side, (self.t, times[-1] + 1e-9), self.state, "DOP853",
                events=events, dense_output=True, rtol=self.tolerance, atol=1e-15,
                max_step=0.1 * np.sqrt(self.mass / (self.k1 + self.k2)),
            )  # fmt: skip
            end = answer.t[-1]
            upto = times.size if answer.status == 0 else int(np.searchsorted(times, end))
            if upto > filled:
                out[filled:upto] = answer.sol(times[filled:upto])[[0, 3]].sum(axis=0)
            filled = upto
            self.t, self.state = end, list(answer.y[:, -1])
            for name, hits in zip(watches, answer.t_events, strict=True):
                if hits.size:
                    self.happen(name)
        return out

    def start(self) -> float:
        """Direction of the piece that begins now; 0 while dry friction holds."""
        if self.state[1] != 0:
            self.slide = np.sign(self.state[1])
            return self.slide
        self.slide = 0.0
        pull = self.inertia() * self.acceleration(self.t, self.state)
        if abs(pull) > self.friction:
            self.slide = np.sign(pull)
        return self.slide

    def inertia(self) -> float:
        return self.mass / (1 + self.ratio) + self.m2 * (self.mode == CONTACT)

    def slack(self, t: float, state: list[float]) -> float:
        at_rest = [state[0], 0.0, *state[2:]]
        return self.friction - self.inertia() * abs(self.acceleration(t, at_rest))

    def happen(self, name: str) -> None:
        if name == "turn":
            self.state[1] = 0.0
        elif name == "touch":
            self.mode, self.state[0] = CONTACT, self.gap
            before = self.state[1]
            mass = self.mass / (1 + self.ratio)
            self.state[1] *= mass / (mass + self.m2)
            self.state[1] *= self.number("obstacle_restitution", "coefficient", 1.0)
            lost = mass * (before - self.state[1])
            self.state[4] += self.number("second_mode", "gain") * lost
            self.state[8] += self.ratio * lost / self.mass
        elif name == "spring_piecewise":
            self.beyond = not self.beyond
        elif name == "gap" and self.mode == RELEASED:
            self.mode = FREE
        elif name in ("gap", "release"):
            if name == "gap":
                self.state[0] = self.gap
            self.gap += self.number("gap_wear", "step")
            self.mode = RELEASED if self.state[0] > self.gap else FREE
