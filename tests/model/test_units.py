"""Units: what they say about mass, clock and gain; how numbers are written."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesimpact.inference.fit import Z90
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.parameters import Parameter, angular
from bayesimpact.model.units import (
    Dimensions,
    bound,
    decimals,
    dimensions,
    display,
    number,
    p_value,
    per_mass_unit,
    percent,
    quantity,
    readable,
    significant,
    span_of,
    typeset,
    without_zero,
)
from bayesimpact.report.results import MeasuringChainSummary
from bayesimpact.report.rows import scaling_unit, widened

BASE = {"m": "kg", "c1": "N s/m", "k1": "N/m", "c2": "N s/m", "g": "m", "k2": "N/m"}
VALUES = {"m": 0.503, "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.0}


def motion(p: dict[str, float], y0: float, times: np.ndarray) -> np.ndarray:
    """Displacement of the impact oscillator, by a generic integrator."""

    def rates(_: float, s: np.ndarray) -> list[float]:
        y, v = s
        contact = p["c2"] * v + p["k2"] * (y - p["g"]) if y > p["g"] else 0.0
        return [v, -(p["c1"] * v + p["k1"] * y + contact) / p["m"]]

    step = (times[1] - times[0]) / 4
    return solve_ivp(
        rates,
        (0, times[-1]),
        [y0, 0.0],
        "DOP853",
        times,
        rtol=1e-9,
        atol=1e-9 * abs(y0),
        max_step=step,
    ).y[0]


def test_dimensions_are_what_leaves_the_recordings_alone() -> None:
    """Another mass, clock and gain with parameters scaled by their dimensions: the same motion."""
    mass, clock, gain = 1.7, 0.6, 2.5
    scaled = {}
    for name, unit in BASE.items():
        d = dimensions(unit)
        scaled[name] = VALUES[name] * mass**d.mass * clock**d.time * gain**d.length
    times = np.linspace(0, 0.4, 81)
    plain = motion(VALUES, -6.5e-3, times)
    other = motion(scaled, -6.5e-3 * gain, times * clock)
    assert np.max(np.abs(other - gain * plain)) < 1e-5 * np.max(np.abs(plain))


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N s2/m2", (1, 0, -1)),
        ("N/m3", (1, -2, -2)),
        ("1/s", (0, -1, 0)),
        ("m per impact", (0, 0, 1)),
        ("Hz", (0, -1, 0)),
        ("-", (0, 0, 0)),
        ("kg", (1, 0, 0)),
    ],
)
def test_dimensions(unit: str, expected: tuple[int, int, int]) -> None:
    assert dimensions(unit) == Dimensions(*expected)
    turned = angular(unit)
    assert dimensions(turned, angle=True) == Dimensions(*expected), turned


def test_every_unit_of_the_catalogue_is_known() -> None:
    units = {p.unit for effect in EFFECTS for p in effect.parameters}
    assert units
    for unit in units:
        # Phases are in rad whatever was recorded; `rows` tells them by their name.
        assert unit == "rad" or dimensions(angular(unit), angle=True) == dimensions(unit)
        display(unit, 1e-4)


def test_a_phase_does_not_scale_with_the_gain() -> None:
    phase = Parameter("sensor_hum.phase[run 1]", "rad", "effect")
    assert dimensions(scaling_unit(phase), angle=True) == Dimensions(0, 0, 0)
    assert scaling_unit(Parameter("y0[run 1]", "rad", "nuisance")) == "rad"


def test_unknown_unit_is_refused() -> None:
    with pytest.raises(ValueError, match="furlong"):
        dimensions("furlong/s")


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N/m", "1/s2"),
        ("N s/m", "1/s"),
        ("N", "m/s2"),
        ("N/m3", "1/(m2 s2)"),
        ("m", ""),
        ("1/s", ""),
    ],
)
def test_unit_over_the_mass(unit: str, expected: str) -> None:
    assert per_mass_unit(unit) == expected


def test_uncertainty_of_mass_clock_and_gain_widens_by_dimensions() -> None:
    chain = MeasuringChainSummary("", mass_sd=1e-3, clock_sd=2e-4, gain_sd=5e-3)
    low, high = widened(800.0, (799.9, 800.2), "N/m", chain, angle=False)
    systematic = Z90 * 800 * np.hypot(1e-3, 2 * 2e-4)
    assert low == pytest.approx(800 - np.hypot(0.1, systematic))
    assert high == pytest.approx(800 + np.hypot(0.2, systematic))
    gap = widened(1.1e-3, (1.1e-3 - 1e-9, 1.1e-3 + 1e-9), "m", chain, angle=False)
    assert gap[1] - 1.1e-3 == pytest.approx(np.hypot(1e-9, Z90 * 1.1e-3 * 5e-3))
    assert widened(2.0, (1.0, 3.0), "N/m", MeasuringChainSummary("", 0, 0, 0), angle=False) == (
        1.0,
        3.0,
    )


@pytest.mark.parametrize(
    ("unit", "size", "scale", "shown"),
    [
        ("m", 1.1e-3, 1e3, "mm"),
        ("m", 5e-6, 1e6, "µm"),
        ("m/s", 0.2, 1e3, "mm/s"),
        ("N/m", 5350.0, 1.0, "N/m"),
        ("N s/m", 0.148, 1.0, "N s/m"),
        ("N", 1.6e-4, 1e6, "µN"),
        ("N/m3", 7e5, 1e-3, "kN/m³"),
        ("N s1.5/m1.5", 2.0, 1.0, "N s^1.5/m^1.5"),
        ("kg", 6.3e-5, 1e6, "mg"),
        ("rad", 4.7e-4, 1e6, "µrad"),
        ("rad", 0.5, 1.0, "rad"),
        ("1/m2", 26.0, 1.0, "1/m²"),
        ("-", 0.0, 1.0, ""),
    ],
)
def test_display(unit: str, size: float, scale: float, shown: str) -> None:
    found = display(unit, size)
    assert found.scale == pytest.approx(scale)
    assert typeset(found.unit).replace("\N{NO-BREAK SPACE}", " ") == shown


def test_power_of_ten_where_no_prefix_helps() -> None:
    shown = readable("1/s", 4.2e-5)
    assert 4.2e-5 * shown.scale == pytest.approx(4.2)
    assert typeset(shown.unit) == "×\N{NO-BREAK SPACE}10⁻⁵\N{NO-BREAK SPACE}1/s"
    assert quantity(3.34e-4, "-").replace("\N{NO-BREAK SPACE}", " ") == "3.34 × 10⁻⁴"


@pytest.mark.parametrize(
    ("half", "places"),
    [(0.354, 2), (0.36, 1), (0.0996, 2), (0.0949, 2), (1.2e-3, 4), (4.7e-3, 3), (12.0, 0),
     (1234.0, -2), (96.0, -1), (1.0, 1)],
)  # fmt: skip
def test_one_or_two_digits_of_uncertainty(half: float, places: int) -> None:
    assert decimals(half) == places


@pytest.mark.parametrize(("half", "places"), [(0.46, 2), (0.0996, 2), (0.0994, 3), (1234.0, -2)])
def test_two_digits_where_asked_for(half: float, places: int) -> None:
    assert decimals(half, 2) == places


def test_no_line_ends_between_a_number_and_its_unit() -> None:
    words = bound("the force reaches 0.003 N (0.026 % of the peak), by 3.1 µm in 4 recordings")
    assert words.count("\N{NO-BREAK SPACE}") == 3 and "4 recordings" in words


def test_no_end_of_an_interval_is_rounded_to_zero() -> None:
    assert span_of((0.447, 13.95), "N m s/rad").startswith("0.4 to 13.9")
    assert without_zero(0, 0.447, 13.9) == 1 and without_zero(0, 0.0, 13.9) == 0
    assert without_zero(0, 1e-9, 13.9) == 0  # that is next to nothing


def test_a_unit_may_say_at_what_it_holds() -> None:
    assert dimensions("N at 1 m/s") == dimensions("N")
    assert per_mass_unit("N at 1 m/s") == "m/s2 at 1 m/s"
    assert quantity(2.9e-3, "N at 1 m/s", 2).split() == ["2.9", "mN", "at", "1", "m/s"]


def test_a_sentence_has_true_minus_signs() -> None:
    assert bound("from -0.30 to 0.31, case-1 and 1-2") == (
        "from \N{MINUS SIGN}0.30 to 0.31, case-1 and 1-2"
    )


def test_changes_in_per_cent() -> None:
    assert percent(7.7e-6).split() == ["+0.0008", "%"]
    shown = [percent(x).replace("\N{NO-BREAK SPACE}", " ") for x in (-0.00173, 0.12, 0.0)]
    assert shown == ["\N{MINUS SIGN}0.17 %", "+12 %", "0 %"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (number(-0.0001, 3), "0.000"),
        (number(-1.25, 1), "\N{MINUS SIGN}1.2"),
        (number(5350.156, 1), "5350.2"),
        (number(123456.7, 0), "123\N{NARROW NO-BREAK SPACE}457"),
        (number(1234.0, -2), "1200"),
        (number(float("nan"), 2), "–"),
        (significant(0.01234), "0.0123"),
        (significant(99999.9), "1.00\u202f×\u202f10⁵"),
        (significant(1.6e-7, 2), "1.6\u202f×\u202f10⁻⁷"),
        (p_value(1e-9), "< 0.001"),
        (p_value(0.0523), "0.052"),
    ],
)
def test_numbers(text: str, expected: str) -> None:
    assert text == expected
