"""Units: what a parameter's unit says about mass, clock and gain, and how numbers are written.

A campaign measures displacement on a probe of unknown gain, against a clock of unknown rate, of a
body whose mass it is told. Scaling any of these three leaves every recording as it was, so a
parameter's error is fixed by its dimensions alone: kg^a s^b m^c shifts by a times the mass' error,
b times the clock's, c times the gain's. Angles translate: rad for m, kg m2 for kg.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, log10, sqrt

_BASE = {
    "N": (1.0, -2.0, 1.0),
    "kg": (1.0, 0.0, 0.0),
    "s": (0.0, 1.0, 0.0),
    "Hz": (0.0, -1.0, 0.0),
    "m": (0.0, 0.0, 1.0),
    "rad": (0.0, 0.0, 0.0),
    "1": (0.0, 0.0, 0.0),
    "-": (0.0, 0.0, 0.0),
}
_LEAST = {"N": 0.01, "rad": 0.1}  # smaller sizes get a prefix
_REMARK = re.compile(r" (?:per|at) ")
_SYMBOL = re.compile(r"([A-Za-z]+|1|-)(-?(?:\d+(?:\.\d+)?)?)")
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PREFIXES = {-9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
MINUS = "\N{MINUS SIGN}"
THIN = "\N{NARROW NO-BREAK SPACE}"


@dataclass(frozen=True)
class Dimensions:
    """Exponents of mass, time and length (inertia, time and angle for angles)."""

    mass: float
    time: float
    length: float

    def relative_sd(self, mass_sd: float, clock_sd: float, gain_sd: float) -> float:
        """Relative standard uncertainty from those of mass, clock and gain (independent)."""
        parts = (self.mass * mass_sd, self.time * clock_sd, self.length * gain_sd)
        return sqrt(sum(p * p for p in parts))


def dimensions(unit: str, *, angle: bool = False) -> Dimensions:
    """Dimensions of a unit such as "N s2/m2"; ValueError for a symbol that is not known.

    Words after "per" and "at" are ignored ("m per impact" is a length, "N at 1 m/s" a force). With
    `angle`, "N m" is a torque, "kg m2" an inertia and "rad" the displacement.
    """
    text = _REMARK.split(unit)[0]
    if angle:
        text = text.replace("kg m2", "kg").replace("N m", "N").replace("rad", "m")
    total, sign = [0.0, 0.0, 0.0], 1.0
    for part in text.split("/"):
        for symbol in part.replace("(", " ").replace(")", " ").split():
            match = _SYMBOL.fullmatch(symbol)
            if match is None or match[1] not in _BASE:
                raise ValueError(f"unit {unit!r}: {symbol!r} is not one of {', '.join(_BASE)}")
            power = sign * float(match[2] or 1)
            total = [t + power * b for t, b in zip(total, _BASE[match[1]], strict=True)]
        sign = -1.0
    return Dimensions(*total)


def per_mass_unit(unit: str, *, angle: bool = False) -> str:
    """Unit of a parameter over the mass, "1/s2" for "N/m"; "" where it does not scale so."""
    d = dimensions(unit, angle=angle)
    if d.mass != 1:
        return ""
    powers = [("rad" if angle else "m", d.length), ("s", d.time)]
    top = " ".join(_powered(symbol, p) for symbol, p in powers if p > 0)
    bottom = " ".join(_powered(symbol, -p) for symbol, p in powers if p < 0)
    if " " in bottom:
        bottom = f"({bottom})"
    remark = unit[unit.index(" at ") :] if " at " in unit else ""
    return (f"{top or '1'}/{bottom}" if bottom else top or "1") + remark


def _powered(symbol: str, power: float) -> str:
    return symbol if power == 1 else f"{symbol}{power:g}"


@dataclass(frozen=True)
class Display:
    """How a quantity is shown: multiply by `scale`, write `unit`."""

    scale: float
    unit: str


def display(unit: str, size: float) -> Display:
    """How a quantity of about this size (SI) is shown.

    Lengths and speeds in mm or, below 30 um, in um; masses below 0.1 kg in g or mg; forces (and
    N/m, N s/m, ...) and angles with the SI prefix they need; all others in their SI unit.
    """
    first = re.split(r"[ /]", unit, maxsplit=1)[0]
    tail = unit[len(first) :]
    size = size if isfinite(size) else 0.0
    if first == "m":
        return Display(1e6, "um" + tail) if 0 < size < 3e-5 else Display(1e3, "mm" + tail)
    if first == "kg" and 0 < size < 0.1:
        return Display(1e6, "mg" + tail) if size < 1e-4 else Display(1e3, "g" + tail)
    if first in ("N", "rad") and size > 0 and not _LEAST[first] <= size < 1e5:
        power = max(-9, min(9, 3 * floor(log10(size) / 3)))
        return Display(10.0**-power, _PREFIXES[power] + unit)
    return Display(1.0, unit)


_READINGS = {"displacement": Display(1e3, "mm"), "velocity": Display(1e3, "mm/s")}


def reading(quantity: str, unit: str) -> Display:
    """How readings of a quantity are shown: mm, mm/s, all others in their SI `unit`."""
    return _READINGS.get(quantity, Display(1.0, unit))


def readable(unit: str, size: float) -> Display:
    """`display`, with a power of ten where no prefix brings `size` near one."""
    shown = display(unit, size)
    if not isfinite(size) or size <= 0 or 1e-3 <= size * shown.scale < 1e5:
        return shown
    power = floor(log10(size))
    ten = f"× 10{str(power).translate(_SUPERSCRIPT)}"
    return Display(10.0**-power, ten if unit in ("-", "1", "") else f"{ten} {unit}")


def typeset(unit: str) -> str:
    """A unit for print: "N s2/m2" becomes "N s²/m²", "N s1.5" "N s^1.5" for there is no raised dot;
    with spaces that do not break.
    """
    if unit in ("-", "1", ""):
        return ""
    powers = re.sub(r"(?<=[A-Za-z])(?=-?\d+\.\d)", "^", unit)
    raised = re.sub(r"(?<=[A-Za-z])-?\d+", lambda m: m[0].translate(_SUPERSCRIPT), powers)
    raised = re.sub(r"^u(?=[A-Za-z])", "µ", raised)
    return raised.replace(" ", "\N{NO-BREAK SPACE}")


def decimals(half_width: float, digits: int | None = None) -> int:
    """Decimals that show `digits` significant digits of a half-width; may be negative.

    Without `digits` the rule of the Particle Data Group (Review of Particle Physics, Introduction,
    section 5.3): two where the leading ones are 10 to 35, else one.
    """
    if not isfinite(half_width) or half_width <= 0:
        return 3
    size = floor(log10(half_width))
    if digits is None:
        digits = 2 if half_width < 3.55 * 10.0**size else 1
        if half_width >= 9.5 * 10.0**size:  # rounds up to 10, which has two
            return -size
    place = digits - 1 - size
    # 0.0996 would be rounded to 0.10, with one digit too many.
    return place - 1 if round(half_width, place) >= 10.0 ** (digits - place) else place


def number(value: float, places: int) -> str:
    """A number with a given number of decimals, a true minus sign and thousands set apart."""
    if not isfinite(value):
        return "–" if value != value else ("∞" if value > 0 else f"{MINUS}∞")
    places = min(places, 12)
    text = f"{abs(round(value, places)):.{max(places, 0)}f}"
    whole, _, fraction = text.partition(".")
    if len(whole) > 4:
        whole = f"{int(whole):,}".replace(",", THIN)
    text = whole + (f".{fraction}" if fraction else "")
    negative = value < 0 and any(c in "123456789" for c in text)
    return f"{MINUS}{text}" if negative else text


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits; powers of ten outside 0.001 to 100000."""
    if value == 0 or not isfinite(value):
        return number(value, 0)
    size = floor(log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 < size < 5:
        return number(value, digits - 1 - size)
    exponent = str(size).translate(_SUPERSCRIPT)
    return f"{number(value / 10.0**size, digits - 1)}{THIN}×{THIN}10{exponent}"


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A size with its unit, with a power of ten where no prefix helps: "3.3 × 10⁻⁴ 1/s"."""
    shown = readable(unit, abs(value))
    text = f"{significant(value * shown.scale, digits)} {typeset(shown.unit)}"
    return text.rstrip().replace(" ", "\N{NO-BREAK SPACE}")


def span(low: float, high: float, scale: float, places: int) -> str:
    """Both ends of an interval."""
    return f"{number(low * scale, places)} to {number(high * scale, places)}"


def without_zero(places: int, *values: float) -> int:
    """Decimals, up to two more than asked for, with which no value is rounded to zero."""
    for more in range(3):
        if all(number(x, places + more).strip(f"{MINUS}0.") for x in values if x):
            return places + more
    return places  # it is next to nothing


def span_of(ends: Sequence[float], unit: str) -> str:
    """A range with its unit."""
    low, high = ends
    shown = readable(unit, max(abs(low), abs(high)))
    places = decimals((high - low) * shown.scale, 2)
    places = without_zero(places, low * shown.scale, high * shown.scale)
    return f"{span(low, high, shown.scale, places)} {typeset(shown.unit)}".rstrip()


def signed(value: float, places: int) -> str:
    """A number with its sign."""
    text = number(value, places)
    return text if text.startswith(MINUS) else f"+{text}"


def percent(part: float) -> str:
    """A change as a share with its sign: "−0.17 %"; two digits, below a hundredth of a % one."""
    if part == 0 or not isfinite(part):
        return f"{number(100 * part, 0)}\N{NO-BREAK SPACE}%"
    sign, size = MINUS if part < 0 else "+", 100 * abs(part)
    # 0.0008 % beside 0.092 % can be compared at a glance, 7.7 × 10⁻⁴ % cannot
    text = number(size, 4) if 5e-5 <= size < 1e-3 else significant(size, 2)
    return f"{sign}{text}\N{NO-BREAK SPACE}%"


def chi2(value: float) -> str:
    """A reduced χ²: three decimals, fewer where it is far from 1."""
    return number(value, 3) if abs(value) < 10 else significant(value, 3)


_HYPHEN = re.compile(r"(?<![\w-])-(?=\d)")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|[numkM]?(?:m|N|s|g|rad)\b|µ[mNs]|Hz\b|kg\b))")


def bound(text: str) -> str:
    """A sentence for print: true minus signs, and no line ends between a number and its unit."""
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", _HYPHEN.sub(MINUS, text))


def p_words(p: float) -> str:
    """A p-value in a sentence: "p = 0.35", "p < 0.001"."""
    return f"p {p_value(p)}" if p < 0.001 else f"p = {p_value(p)}"


def two_digits(value: float, unit: str = "") -> str:
    """A size in a sentence, with its unit where one is given: "3.2 mN", "0.11"."""
    text = quantity(value, unit, 2) if unit else significant(value, 2)
    return text.replace("\N{NO-BREAK SPACE}", " ")


def p_value(p: float) -> str:
    """A p-value for a table."""
    if not isfinite(p):
        return "–"
    return "< 0.001" if p < 0.001 else number(p, 3 if p < 0.1 else 2)
