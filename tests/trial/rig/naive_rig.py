"""A slow, obvious twin of the rig: small Runge-Kutta steps, forces as the catalogue states them.

A step in which any condition changes is cut where it first does, by bisection.
"""

from __future__ import annotations

from math import exp, pi, sin

import numpy as np

KINKS = (
    ("contact_second_stage", "depth", 1),
    ("opposite_stop", "gap", -1),
    ("spring_piecewise", "gap", -1),
    ("friction_pad", "low", 1),
    ("friction_pad", "high", 1),
    ("eddy_brake", "low", 1),
    ("eddy_brake", "high", 1),
)


def sign(x):
    return (x > 0) - (x < 0)


def contact_forces(e, rig, k2, t, d, v, s):
    """What the obstacle does to the mass, c2 and k2 included."""
    total = rig.c2 * v
    n = e.get("contact_power_law", {}).get("exponent", 1.0)
    total += k2 * d if n == 1 else k2 * d * (abs(d) / 1e-3) ** (n - 1)
    if "hunt_crossley" in e:
        p = e["hunt_crossley"]
        n, chi = p["exponent"], p["damping"]
        total = k2 * 1e-3 * sign(d) * (abs(d) / 1e-3) ** n * (1 + chi * v)
    if "contact_damping_indentation" in e:
        total += e["contact_damping_indentation"]["coefficient"] * d * v
    if "contact_damping_speed" in e:
        total += e["contact_damping_speed"]["coefficient"] * abs(v) * v
    if "contact_hardening" in e:
        total += e["contact_hardening"]["stiffness"] * d**3
    if "contact_stiffness_drift" in e:
        total += k2 * e["contact_stiffness_drift"]["rate"] * t * d
    if "contact_second_stage" in e:
        p = e["contact_second_stage"]
        total += p["stiffness"] * max(d - p["depth"], 0.0)
    if "contact_relaxation" in e:
        total += s["maxwell"]
    if "contact_preload" in e:
        total += e["contact_preload"]["force"]
    if "contact_bump" in e:
        p = e["contact_bump"]
        total += p["force"] * exp(-(((d - p["depth"]) / p["width"]) ** 2))
    return total


def free_forces(e, rig, t, y, v, s):
    total = rig.c1 * v + rig.k1 * y
    if "quadratic_drag" in e:
        total += e["quadratic_drag"]["coefficient"] * abs(v) * v
    if "spring_quadratic" in e:
        total += e["spring_quadratic"]["stiffness"] * y**2
    if "spring_cubic" in e:
        total += e["spring_cubic"]["stiffness"] * y**3
    if "stiffness_drift" in e:
        total += rig.k1 * e["stiffness_drift"]["rate"] * t * y
    if "harmonic_forcing" in e:
        p = e["harmonic_forcing"]
        total -= p["amplitude"] * sin(2 * pi * p["frequency"] * t + p["phase"]["r"])
    if "opposite_stop" in e:
        p = e["opposite_stop"]
        total += p["stiffness"] * min(y + p["gap"], 0.0)
    if "spring_piecewise" in e and s["from"] <= -e["spring_piecewise"]["gap"]:
        p = e["spring_piecewise"]
        total += p["stiffness"] * (y + p["gap"]) + p["damping"] * v
    if "pendulum_sine" in e:
        total += e["pendulum_sine"].get("stiffness", rig.k1) * (sin(y) - y)
    if "pendulum_with_spring" in e:
        total += e["pendulum_with_spring"]["stiffness"] * (sin(y) - y)
    if "spring_quintic" in e:
        total += e["spring_quintic"]["stiffness"] * y**5
    if "power_damping" in e:
        p = e["power_damping"]
        total += p["coefficient"] * abs(v) ** p["exponent"] * sign(v)
    if "structural_damping" in e:
        total += e["structural_damping"]["loss"] * rig.k1 * abs(y) * s["going"]
    if "detent" in e:
        p = e["detent"]
        x = y - p["place"]
        total += p["stiffness"] * x * exp(-((x / p["width"]) ** 2))
    if "hysteresis_bouc_wen" in e:
        total += e["hysteresis_bouc_wen"]["stiffness"] * s["bouc"]
    if "presliding_friction" in e:
        total += s["dahl"]
    if "damping_bump" in e:
        p = e["damping_bump"]
        total += p["coefficient"] * exp(-(((y - p["place"]) / p["width"]) ** 2)) * v
    if "eddy_brake" in e:
        p = e["eddy_brake"]
        total += p["coefficient"] * v * (p["low"] < s["from"] <= p["high"])
    if "resonator" in e:
        total += resonator_pull(e["resonator"], y, v, s)
    if "damping_drift" in e:
        total += rig.c1 * e["damping_drift"]["rate"] * t * v
    if "knock" in e:
        p = e["knock"]
        phase = (t - p["time"]) / p["width"]
        if 0 < phase < 1:
            total -= p["impulse"] * pi / 2 / p["width"] * sin(pi * phase)
    return total


def resonator_pull(p, y, v, s):
    w = 2 * pi * p["frequency"]
    return p["mass"] * (w * w * (y - s["x"]) + 2 * p["damping_ratio"] * w * (v - s["u"]))


def obstacle_pull(p, place, speed, s):
    w = 2 * pi * p["frequency"]
    return w * w * (place - s["b"]) + 2 * p["damping"] * w * (speed - s["b_rate"])


def frame_hold(p, s):
    w = 2 * pi * p["frequency"]
    return w * w * s["X"] + 2 * p["damping"] * w * s["X_rate"]


def dry_level(e, y, v, touching):  # y: where the step began
    level = e.get("coulomb_friction", {}).get("force", 0.0)
    if "friction_pad" in e and e["friction_pad"]["low"] < y <= e["friction_pad"]["high"]:
        p = e["friction_pad"]
        level += p["force"] + p["extra"] * exp(-((v / p["speed"]) ** 2))
    if "contact_friction" in e and touching:
        level += e["contact_friction"]["force"]
    return level


class NaiveRig:
    def __init__(self, rig, release, effects):
        self.rig, self.e, self.k2 = rig, effects, rig.k2[release.case]
        self.gap, self.step = rig.g, effects.get("gap_wear", {}).get("step", 0.0)
        if "gap_per_recording" in effects:
            self.gap = effects["gap_per_recording"]["g"][release.name]
        if "contact_damping_per_case" in effects:
            c2 = effects["contact_damping_per_case"]["c2"][release.case]
            self.rig = type(rig)(rig.mass, rig.c1, rig.k1, c2, rig.g, rig.k2)
        self.m2 = effects.get("obstacle_mass", {}).get("mass", 0.0)
        self.one_sided = bool({"obstacle_mass", "contact_no_tension", "adhesion"} & set(effects))
        self.pull = effects.get("adhesion", {}).get("force", 0.0)
        self.touching = release.y0 > self.gap
        self.stuck = self.released = False
        self.names = (
            "maxwell",
            "bouc",
            "x",
            "u",
            "q",
            "q_rate",
            "b",
            "b_rate",
            "X",
            "X_rate",
            "dahl",
        )
        self.state = [release.y0, release.v0, 0.0, 0.0, release.y0, release.v0, *[0.0] * 7]

    def named(self, state):
        """Own states, and where the step began: it decides what is switched on."""
        return {
            **dict(zip(self.names, state[2:], strict=True)),
            "from": self.state[0],
            "going": sign(self.state[1]),
        }

    def sums(self, t, state):
        """(all forces but dry friction, obstacle's force on the mass without inertia)."""
        y, v = state[:2]
        s = self.named(state)
        push = 0.0
        if self.touching:
            push = contact_forces(self.e, self.rig, self.k2, t, y - self.gap, v, s)
            if "obstacle_mode" in self.e:
                p = self.e["obstacle_mode"]
                push += p["mass"] * obstacle_pull(p, y - self.gap, v, s)
        return free_forces(self.e, self.rig, t, y, v, s) + push, push

    def slope(self, t, state):
        y, v = state[:2]
        s = self.named(state)
        if self.stuck:
            v = acceleration = 0.0
        else:
            begun = self.state
            level = dry_level(self.e, begun[0], v, self.touching)
            force = self.sums(t, state)[0]
            force += level * (sign(begun[1]) or -sign(force))
            ratio = 1.0 + self.e.get("base_motion", {}).get("mass_ratio", 0.0)
            if ratio > 1.0:
                force -= self.rig.mass / ratio * frame_hold(self.e["base_motion"], s)
            acceleration = -force / (self.rig.mass / ratio + self.m2 * self.touching)
        out = [v, acceleration, *[0.0] * 11]
        if "contact_relaxation" in self.e:
            p = self.e["contact_relaxation"]
            out[2] = p["stiffness"] * v * self.touching - s["maxwell"] / p["time"]
        if "hysteresis_bouc_wen" in self.e:
            out[3] = v - abs(v) * s["bouc"] * self.e["hysteresis_bouc_wen"]["decay"]
        if "presliding_friction" in self.e:
            p = self.e["presliding_friction"]
            out[12] = p["force"] / p["displacement"] * v * (1 - s["dahl"] / p["force"] * sign(v))
        if "resonator" in self.e:
            p = self.e["resonator"]
            out[4:6] = [s["u"], resonator_pull(p, y, v, s) / p["mass"]]
        if "second_mode" in self.e:
            p = self.e["second_mode"]
            w = 2 * pi * p["frequency"]
            push = self.sums(t, state)[1] + self.m2 * acceleration * self.touching
            pull = 2 * p["damping"] * w * s["q_rate"] + w**2 * s["q"]
            out[6:8] = [s["q_rate"], p["gain"] * push - pull]
        if "obstacle_mode" in self.e:
            out[8:10] = [s["b_rate"], obstacle_pull(self.e["obstacle_mode"], *self.place(y, v), s)]
        if "base_motion" in self.e:
            ratio = self.e["base_motion"]["mass_ratio"]
            shaken = -frame_hold(self.e["base_motion"], s) - ratio * acceleration
            out[10:12] = [s["X_rate"], shaken / (1 + ratio)]
        return out

    def place(self, y, v):
        """Displacement and velocity of the obstacle at the place of contact."""
        return (y - self.gap, v) if self.touching else (0.0, 0.0)

    def rk4(self, t, h):
        def ahead(slope, by):
            return [x + by * rate for x, rate in zip(self.state, slope, strict=True)]

        k1 = self.slope(t, self.state)
        k2 = self.slope(t + h / 2, ahead(k1, h / 2))
        k3 = self.slope(t + h / 2, ahead(k2, h / 2))
        k4 = self.slope(t + h, ahead(k3, h))
        mean = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        return ahead(mean, h)

    def conditions(self, t, state):
        """Everything that switches a force on or off."""
        y, v = state[:2]
        out = [y >= self.gap, v > 0]
        if "structural_damping" in self.e:
            out.append(y > 0)
        for effect, key, place in KINKS:
            if effect in self.e:
                gap = self.gap if key == "depth" else 0.0
                out.append(y > gap + place * self.e[effect][key])
        if "knock" in self.e:
            p = self.e["knock"]
            out += [t > p["time"], t > p["time"] + p["width"]]
        if self.stuck:
            out.append(abs(self.sums(t, state)[0]) <= dry_level(self.e, y, 0.0, self.touching))
        elif self.one_sided and self.touching:
            out.append(self.reaction(t, state) <= -self.pull)
        return out

    def advance(self, t, h):
        """A step of h; events on the way."""
        while h > 0:
            now, taken, after = self.conditions(t, self.state), h, self.rk4(t, h)
            if self.conditions(t + h, after) != now:
                low, high = 0.0, h
                for _ in range(40):
                    middle = (low + high) / 2
                    same = self.conditions(t + middle, self.rk4(t, middle)) == now
                    low, high = (middle, high) if same else (low, middle)
                taken, after = high, self.rk4(t, high)
            old, self.state = self.state, after
            t, h = t + taken, h - taken
            self.events(t, old)

    def events(self, t, old):
        y, v = self.state[:2]
        if self.touching:
            self.released = self.one_sided and v < 0 and self.reaction(t, self.state) <= -self.pull
            if self.released or (not self.one_sided and y < self.gap):
                self.touching = False
                self.gap += self.step
        if self.released and y < self.gap:
            self.released = False
        elif not self.touching and not self.released and y >= self.gap:
            self.touching = True
            ratio = self.e.get("base_motion", {}).get("mass_ratio", 0.0)
            mass = self.rig.mass / (1 + ratio)
            self.state[1] *= mass / (mass + self.m2)
            self.state[1] *= self.e.get("obstacle_restitution", {}).get("coefficient", 1.0)
            lost = mass * (v - self.state[1])
            self.state[11] += ratio * lost / self.rig.mass
            self.state[7] += self.e.get("second_mode", {}).get("gain", 0.0) * lost
        level = dry_level(self.e, y, 0.0, self.touching)
        if self.stuck:
            self.stuck = abs(self.sums(t, self.state)[0]) <= level
        elif level and old[1] * v <= 0:
            at_rest = [y, 0.0, *self.state[2:]]
            if abs(self.sums(t, at_rest)[0]) <= level:
                self.stuck, self.state = True, at_rest

    def reaction(self, t, state):
        return self.sums(t, state)[1] + self.m2 * self.slope(t, state)[1]

    def run(self, duration, h):
        count = round(duration / h)
        out = np.empty(count)
        for i in range(count):
            out[i] = self.state[0] + self.state[6]
            self.advance(i * h, h)
        return out
