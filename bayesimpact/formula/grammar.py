"""The grammar of formulas: a force is a sum of terms, a term a product of a few typed factors.

    term = size x t^drift x (where) x (power of a coordinate) x (power of the speed) x (fading)

A term knows its unit, its parity, what it does to energy, where it acts and how long it is to write
down. The number of nodes times the logarithm of the number of symbols is its description length
(Bartlett, Desmond and Ferreira 2023, IEEE Trans. Evol. Comput., Eq. 4: k log n); its constants are
paid for by the evidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.effects.effect import Energy, Regime
from bayesimpact.model.effects.power_damping import SLOW

Array = NDArray[np.float64]
Region = Literal["everywhere", "contact", "beyond", "bump", "box"]
REGIONS: tuple[Region, ...] = ("everywhere", "contact", "beyond", "bump", "box")

SYMBOLS = ("+", "*", "^", "abs", "sign", "exp", "step", "y", "v", "d", "t", "constant")
NODE = math.log(len(SYMBOLS))
"""Nats per node of a formula."""


@dataclass(frozen=True)
class Power:
    """|x|^exponent, with the sign of x where it is odd."""

    exponent: float
    odd: bool

    def __call__(self, x: Array) -> Array:
        """Values at x (n,)."""
        size = np.abs(x) ** self.exponent
        return size * np.sign(x) if self.odd else size

    @property
    def is_one(self) -> bool:
        """Whether it is no factor at all."""
        return self.exponent == 0.0 and not self.odd

    @property
    def is_plain(self) -> bool:
        """Whether x^exponent says it: an odd function of odd, or an even one of even exponent."""
        return self.exponent.is_integer() and self.odd == bool(self.exponent % 2)

    @property
    def nodes(self) -> int:
        """Symbols that it takes, the product with what stands before it among them."""
        if self.is_one:
            return 0
        raised = 0 if self.exponent in (0.0, 1.0) else 2
        return 2 + raised + (0 if self.is_plain else 1)

    def text(self, x: str, *, positive: bool = False) -> str:
        """In words of mathematics; without signs where x is positive."""
        if self.is_one:
            return ""
        n = f"{self.exponent:g}"
        if positive:
            return x if n == "1" else f"{x}^{n}"
        if self.exponent == 0.0:
            return f"sign({x})"
        if self.is_plain:
            return x if n == "1" else f"{x}^{n}"
        inner = x[1:-1] if x.startswith("(") else x
        if not self.odd:
            return f"|{inner}|" if n == "1" else f"|{inner}|^{n}"
        return f"|{inner}| {x}" if n == "2" else f"|{inner}|^{n} sign({inner})"


ONE = Power(0.0, False)


@dataclass(frozen=True)
class Term:
    """One term.

    Attributes
    ----------
    region : everywhere; in contact (the coordinate is the indentation beyond `place`); beyond
        `place` on one side (the coordinate is how far); a bump exp(-x^2 / width^2) about `place`;
        a box of half-width `width` about `place`
    position, speed : powers of the coordinate and of the velocity
    side : -1 or 1: the sign of the displacement at `place`
    place, width : m; 0 where the region has none
    fade : speed u, m/s, over which the term falls as exp(-|v| / u); 0 where it does not
    lorentzian : it falls as 1 / (1 + (v / u)^2) instead: the drag of an eddy-current brake
        (Wouterse 1991, IEE Proc. B 138:153), the Stribeck curve of Hess and Soom 1990, J. Tribol.
        112:147
    drift : 1 for a term that grows with time
    """

    region: Region
    position: Power = ONE
    speed: Power = ONE
    side: int = 1
    place: float = 0.0
    width: float = 0.0
    fade: float = 0.0
    drift: int = 0
    lorentzian: bool = False

    @property
    def kind(self) -> tuple[object, ...]:
        """The term without the numbers of its shape."""
        return (
            self.region, self.position, self.speed, self.side if self.place else 0,
            self.place > 0, self.fade > 0, self.drift, self.lorentzian,
        )  # fmt: skip

    @property
    def everywhere(self) -> Term:
        """What a bump, a box or a fading becomes where it is wide: the same force everywhere."""
        local = self.region in ("bump", "box") and self.position.is_one
        return Term("everywhere", self.position, self.speed) if local or self.fade > 0 else self

    @property
    def shapes(self) -> dict[str, float]:
        """Shape parameters by name."""
        own = {"place": self.place, "width": self.width, "fade": self.fade}
        return {name: value for name, value in own.items() if value > 0.0}

    @property
    def nodes(self) -> int:
        """Symbols in the term, its size and the plus before it among them."""
        where = {"everywhere": 0, "contact": 1, "beyond": 3, "bump": 7, "box": 5}[self.region]
        deeper = 2 if self.region == "contact" and self.place > 0 else 0
        fading = (6 if self.lorentzian else 4) if self.fade > 0 else 0
        return 2 + where + deeper + fading + 2 * self.drift + self.position.nodes + self.speed.nodes

    @property
    def length(self) -> float:
        """Description length, nats."""
        return NODE * self.nodes

    @property
    def regime(self) -> Regime:
        """Where it acts, as effects of the catalogue say it."""
        return "contact" if self.region == "contact" else "free"

    @property
    def energy(self) -> Energy:
        """What it does to mechanical energy where its size is positive."""
        if self.speed.is_one:
            return "either" if self.drift else "conserves"
        return "dissipates" if self.speed.odd and self.is_positive else "either"

    @property
    def is_positive(self) -> bool:
        """Whether its factor of the position never is below 0."""
        return not self.position.odd or self.region in ("contact", "beyond")

    @property
    def unit(self) -> str:
        """Unit of its size, for displacements."""
        length, time = self.position.exponent + self.speed.exponent, self.speed.exponent
        time -= self.drift
        over = f"/m{_raised(length)}" if length else ""
        if time < 0:
            return f"N{over}/s{_raised(-time)}"
        return f"N s{_raised(time)}{over}" if time else f"N{over}"

    def coordinate(self, y: Array, d: Array) -> Array:
        """The coordinate of its power of the position, m."""
        if self.region == "contact":
            return d - self.place
        if self.region == "beyond":
            return self.side * y - self.place
        return y - self.side * self.place

    def inside(self, x: Array, d: Array) -> Array:
        """Factor of the region at coordinates x (n,)."""
        if self.region == "contact":
            return np.asarray((d > 0) & (x > 0), dtype=np.float64)
        if self.region == "beyond":
            return np.asarray(x > 0, dtype=np.float64)
        if self.region == "bump":
            return np.asarray(np.exp(-((x / self.width) ** 2)))
        if self.region == "box":
            return np.asarray(np.abs(x) < self.width, dtype=np.float64)
        return np.ones_like(x)

    def of_position(self, y: Array, d: Array) -> Array:
        """Factors of the position, (n,)."""
        x = self.coordinate(y, d)
        return self.inside(x, d) * self.position(x)

    def of_speed(self, v: Array) -> Array:
        """Factors of the speed, (n,)."""
        fading = self._fading(v)
        m = self.speed.exponent
        if m.is_integer():
            return np.asarray(self.speed(v) * fading)
        return np.asarray((v * v + SLOW**2) ** (0.5 * (m - 1.0)) * v * fading)

    def _fading(self, v: Array) -> Array | float:
        if self.fade == 0.0:
            return 1.0
        if self.lorentzian:
            return 1.0 / (1.0 + (v / self.fade) ** 2)
        return np.asarray(np.exp(-np.abs(v) / self.fade))

    def force(self, y: Array, v: Array, d: Array, t: Array) -> Array:
        """Force per unit of size at displacements m, velocities, indentations, times (n,)."""
        return self.of_position(y, d) * self.of_speed(v) * t**self.drift

    def text(self, *, angle: bool = False, numbers: bool = True) -> str:
        """The term without its size, numbers of its shape in mm (mrad), or letters for them."""
        place, width, fade = "p", "w", "u"
        if numbers:
            unit = "mrad" if angle else "mm"
            place, width = (f"{_short(1e3 * x)} {unit}" for x in (self.place, self.width))
            fade = f"{_short(self.fade)} {'rad' if angle else 'm'}/s"
        x, before, after = self._where(place, width)
        position = self.position.text(x, positive=self.region in ("contact", "beyond"))
        speed = f"({fade})" if numbers else fade
        fading = f"/ (1 + (v/{speed})^2)" if self.lorentzian else f"exp(-|v|/({fade}))"
        fading = fading if self.fade else ""
        words = ["t" if self.drift else "", before, position, self.speed.text("v"), fading, after]
        return " ".join(w for w in words if w)

    def _where(self, place: str, width: str) -> tuple[str, str, str]:
        """The coordinate, and what stands before and after for the region."""
        if self.region == "everywhere":
            return "y", "", ""
        if self.region == "contact":
            if not self.place:
                return "d", "", "in contact"
            return f"(d - {place})", "", f"in contact where d > {place}"
        if self.region == "beyond":
            if self.side > 0:
                return f"(y - {place})", "", f"where y > {place}"
            return f"(-y - {place})", "", f"where y < -{place}"
        x = f"(y {'-' if self.side > 0 else '+'} {place})" if self.place else "y"
        if self.region == "box":
            return x, "", f"where |{x.strip('()')}| < {width}"
        return x, f"exp(-({x}/{width})^2)", ""


def _raised(exponent: float) -> str:
    return "" if exponent == 1.0 else f"{exponent:g}"


def _short(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"
