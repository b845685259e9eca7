"""Which frequencies are the motion's own: what it passes through, not what its ends leak."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.score_test.own_band import (
    _moves_at,
    _overlaps,
    _passes_for_harmonic,
    _unforced,
    multiple_of,
    shakes_in_own_band,
)

INTERVAL, SAMPLES = 1.0 / 550.0, 242
LINE = 1.0 / (INTERVAL * SAMPLES)  # Hz that the duration resolves


def decay(first: float, last: float) -> Recording:
    """A decay whose frequency, Hz, changes steadily from `first` to `last`."""
    t = INTERVAL * np.arange(SAMPLES)
    phase = 2 * np.pi * (first * t + 0.5 * (last - first) * t**2 / t[-1])
    return Recording("struck", "", np.exp(-2.2 * t) * np.cos(phase), INTERVAL)


@pytest.mark.parametrize(
    ("lines", "own"), [(0.0, True), (1.0, True), (-1.0, True), (2.8, False), (-3.0, False)]
)
def test_a_motion_of_one_frequency_leaks_to_no_other(lines, own):
    """Cut off at both ends, its spectrum falls with 1 / f: to a tenth three lines away."""
    assert _moves_at(decay(19.8, 19.8), 19.8 + lines * LINE) is own


@pytest.mark.parametrize(("frequency", "own"), [(17.0, True), (20.0, True), (23.0, True),
                                                (11.0, False), (29.0, False)])  # fmt: skip
def test_frequencies_that_a_motion_passes_through_are_its_own(frequency, own):
    assert _moves_at(decay(24.0, 16.0), frequency) is own


@pytest.mark.parametrize(("rate", "times", "passes"), [(0.03, 2.0, True), (0.03, 3.02, True),
                                                       (0.03, 2.4, False), (0.5, 2.0, False),
                                                       (0.03, 1.0, False)])  # fmt: skip
def test_a_steady_line_at_a_multiple_is_a_harmonic_where_the_motion_hardly_decays(
    rate, times, passes
):
    """A filmed pendulum of eight cycles had a hum of twice its frequency."""
    t = np.arange(240) / 30.0
    motion = Recording("filmed", "", np.exp(-rate * t) * np.cos(2 * np.pi * 0.99 * t), 1.0 / 30.0)
    assert _passes_for_harmonic(motion, times * 0.99) is passes
    assert multiple_of(motion, times * 0.99) == (round(times) if times in (2.0, 3.02) else 0)


@pytest.mark.parametrize(("rate", "decay", "lines", "overlap"), [
    (1.0, 0.0, 0.9, True), (1.0, 0.0, 1.6, False), (12.0, 0.0, 1.6, True),
    (1.0, 12.0, 1.6, True), (12.0, 12.0, 3.5, False),
])  # fmt: skip
def test_lines_overlap_as_far_as_both_decay(rate, decay, lines, overlap):
    """A mode beside a motion of the same band cannot be told from a damping that changes."""
    t = INTERVAL * np.arange(SAMPLES)
    motion = Recording("a", "", np.exp(-rate * t) * np.cos(2 * np.pi * 30.0 * t), INTERVAL)
    assert _overlaps(motion, 30.0 + lines * LINE, decay, steady=decay == 0.0) is overlap


def test_what_a_steady_force_moves_is_not_the_motion_s_own():
    """A decay at 30 Hz, driven at 19.8 Hz; one that slides through 19.8 Hz; one that decays there.

    A steady sine may take the middle line of the last two off, not what is beside it.
    """
    t = INTERVAL * np.arange(SAMPLES)
    driven = Recording(
        "a", "", np.exp(-2.2 * t) * np.cos(60 * np.pi * t) + np.sin(2 * np.pi * 19.8 * t), INTERVAL
    )
    assert _moves_at(driven, 19.8) and not _moves_at(_unforced(driven, 19.8, True), 19.8)
    for own in (decay(24.0, 16.0), decay(19.8, 19.8)):
        assert _moves_at(_unforced(own, 19.8, True), 19.8)
    assert _unforced(driven, 19.8, False) is driven


def test_what_is_lost_at_once_does_not_say_how_long_a_motion_lasts():
    """A release against a stop: most is lost in the first impacts, the rest rings for seconds."""
    t = np.arange(6129) / 1000.0
    envelope = np.exp(-0.4 * t) * (0.25 + 0.75 * np.exp(-t / 0.03))
    motion = Recording("a", "", envelope * np.cos(2 * np.pi * 5.16 * t), 1e-3)
    assert not _overlaps(motion, 3.46, 0.0, steady=True)
    assert _overlaps(motion, 5.3, 0.0, steady=True)


@pytest.mark.parametrize(("apart", "refused"), [(0.0, True), (0.9, True), (1.1, False)])
def test_two_steady_lines_that_no_recording_tells_apart_are_none(apart, refused):
    """A hum and a force that nearly cancel have another amplitude in every recording: a stiffness
    that pulsates made both of 12 % of the motion, at one frequency.
    """
    lines = {"sensor_hum": 75.0, "harmonic_forcing": 75.0 + apart * LINE}
    oscillator = SimpleNamespace(
        campaign=SimpleNamespace(recordings=(decay(30.0, 30.0),)),
        acting=tuple(BY_ID[i] for i in lines),
    )
    values = {f"{i}.frequency": f for i, f in lines.items()}
    fit = SimpleNamespace(density=SimpleNamespace(oscillator=oscillator), value=values.get)
    assert shakes_in_own_band(fit, remains=False) is refused


@pytest.mark.parametrize("driven", [False, True])
def test_a_line_of_a_driven_recording_is_its_motion(driven: bool) -> None:
    """Of a free one a steady line beside the motion is a hum, and no motion."""
    t = INTERVAL * np.arange(2000)
    motion = np.exp(-0.5 * t) * np.cos(60 * np.pi * t) + 0.05 * np.cos(2 * np.pi * 71.0 * t)
    given = Input(np.zeros(t.size)) if driven else None
    assert _moves_at(Recording("a", "", motion, INTERVAL, input=given), 71.0) is driven


@pytest.mark.parametrize("line", ["sensor_hum", "harmonic_forcing"])
@pytest.mark.parametrize("size", [0.05, 0.2, 1.0, 3.0])
def test_a_line_far_from_the_motion_is_one_however_strong_it_is(line: str, size: float) -> None:
    """Where it is the strongest of all lines of a recording, it is not its own motion."""
    t = INTERVAL * np.arange(2000)
    samples = np.exp(-5.0 * t) * np.cos(60 * np.pi * t) + size * np.cos(100 * np.pi * t + 0.4)
    oscillator = SimpleNamespace(
        campaign=SimpleNamespace(recordings=(Recording("a", "", samples, INTERVAL),)),
        acting=(BY_ID[line],),
    )
    values = {f"{line}.frequency": 50.0}
    fit = SimpleNamespace(density=SimpleNamespace(oscillator=oscillator), value=values.get)
    assert not shakes_in_own_band(fit, remains=False)


@pytest.mark.parametrize("line", ["sensor_hum", "harmonic_forcing"])
@pytest.mark.parametrize(("apart", "refused"), [(0.5, True), (40.0, False)])
def test_a_line_that_beats_with_the_motion_is_none_where_both_are_one_line(
    line: str, apart: float, refused: bool
) -> None:
    """Nobody knows then which of the two the mass makes by itself: a spring that a shaker moved was
    named a hum, its own motion taken for the shaker's.
    """
    oscillator = SimpleNamespace(
        campaign=SimpleNamespace(recordings=(decay(30.0, 30.0),)), acting=(BY_ID[line],)
    )
    values = {f"{line}.frequency": 30.0 + apart * LINE}
    fit = SimpleNamespace(density=SimpleNamespace(oscillator=oscillator), value=values.get)
    assert shakes_in_own_band(fit, remains=False) is refused
