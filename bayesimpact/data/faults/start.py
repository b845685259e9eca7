"""`recording_start`: rest before the release, or a hand that still moves the mass."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import norm

from bayesimpact.data.faults.fault import FALSE_ALARM, Array, Fault, amount, start_fault
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.high_pass import as_it_came
from bayesimpact.data.hum import find_hum
from bayesimpact.data.period import crossing_period, noise_level
from bayesimpact.data.quantity import order_of
from bayesimpact.data.recording import Recording

BAND = 5.0  # standard deviations of the noise, or two steps, about the first reading
LEAST_BAND = 0.01  # of the amplitude: noise behind a filter does not show in differences, and a
# free motion takes 2 % of a period to leave this band
# Times as long as a free motion stays in that band after a turning point; one that begins just
# before it 1 + sqrt(2) times
NATURAL = 3.0
COARSE = 2  # samples more: the first reading counts before, and the one that left the band, after
SHORTEST = 0.08  # of a period
FEWEST = 3  # samples, whose median is the reading at rest: no more of them would be no rest
LATE = 1.1  # of a period: a free decay is largest before
PERIODS = 1.0  # of a hum, over which it is fitted first
WIDE = 11  # samples of a running median: spikes of five do not show in it
NARROW = 1 / 8  # of a period, at most: a wider one bends the motion
UNCROSSED = 0.75  # of a period: a free motion passes its rest within half a period
GROWTH = 1.3  # largest excursion over what came before it, on either side
WINDOW = 1 / 25  # of a period, in which a speed is told; two samples at least
RELEASES = np.linspace(0.5, 0.95, 10)  # of a stretch that keeps to the band
LIKELIER = 1.0  # nats: of a dozen samples hardly more is to be had
DRIFT = 0.2  # of the band: a parabola through it takes a quarter in the first half of the time
FOLLOWING = 0.75  # of a period after a stretch, in which any motion is an oscillation, nearly
ENOUGH = 8  # samples, twice as many as its parameters
TEMPOS = np.geomspace(0.3, 1.4, 12)  # times the frequency that crossings tell; noise adds crossings
DAMPINGS = (0.0, 0.03, 0.1, 0.3)  # ratios
SLOW = 1 / 3  # of a linear free motion's speed: those of a pendulum to 160 degrees are above half


def find_start(recording: Recording) -> list[Fault]:
    """The sample from which on the motion can be a free decay, where that is not the first one.

    Rest: the readings keep to the first one for longer than a free motion can about a turning
    point, sqrt(2 b / A) of a radian for a band b and an amplitude A, do not move on meanwhile, and
    are not what the motion after them came from (`_is_free`, nor is a hand told within the noise);
    where the motion is largest soon after, and by far, the decay begins there. Hand: the
    largest excursion comes late and exceeds what came before on its side, or the first turning
    point is reached from a speed with which a free motion would not get there; the free decay
    begins where that is left.
    """
    if recording.used is not None and not recording.used[:3].all():
        return []
    quiet = as_it_came(recording).samples
    hum = find_hum(quiet, 1.0)
    if hum is not None:
        quiet = quiet - hum.readings(np.arange(quiet.size, dtype=np.float64))
    period = crossing_period(quiet, 1.0)
    if period is None:
        return []
    half = int(min(WIDE, NARROW * period) - 1) // 2
    x = median_filter(quiet, 2 * max(half, 0) + 1, mode="nearest")  # blind to spikes
    noise, step = noise_level(quiet), reading_step(recording.samples)
    rest_reading = float(np.median(x[x.size // 2 :]))
    largest = peak = int(np.argmax(np.abs(x - rest_reading)))
    height = abs(float(x[peak] - rest_reading))
    band = max(BAND * noise, 2.0 * step, LEAST_BAND * height)
    natural = np.sqrt(2.0 * band / max(height, band)) * period / (2 * np.pi)
    least = max(NATURAL * natural + COARSE, SHORTEST * period, FEWEST)
    moves = order_of(recording.quantity) > 0 and _moves(quiet, band)
    hand = _grown(x - rest_reading, peak, period, band)
    if not hand:
        peak = _pushed(x - rest_reading, band, period)
        hand = peak > 0
    rest = _leaves(x, peak if hand else 0, band, None if hum is None else hum.frequency)
    if not hand and (
        moves or rest <= least or _moves_on(quiet[:rest], max(noise, step / np.sqrt(12)), band)
    ):
        return []
    if not hand and _is_free(quiet, rest, period):
        return []
    soon = not hand and largest < rest + LATE * period and order_of(recording.quantity) == 0
    moved = soon and _is_moved(x - rest_reading, rest, band)
    first = max(rest, peak if hand else largest) if hand or moved else rest
    if first > 0.7 * x.size:
        return []
    kind = "the motion is not yet free" if hand else "at rest"
    kind = "at rest, then moved" if moved else kind
    words = f"{kind} {{time}}; released from {amount(float(x[first]), recording.unit)}"
    return [start_fault(recording, first, first / max(least, 1.0), 1.0, words)]


def _is_moved(centred: Array, rest: int, band: float) -> bool:
    """Whether what follows a rest is larger than where that ends by far: a hand, or a blow, moved
    the mass first.
    """
    begun = float(np.abs(centred[rest - 1 : rest + 1]).max(initial=0.0))
    return bool(np.abs(centred).max() > GROWTH * begun + band)


def _moves_on(x: Array, noise: float, band: float) -> bool:
    """Whether readings that keep to a band move on through it from the first one, as about a
    turning point that a force holds up, where a rest would last for half of the time and longer.

    A rest may creep, but what follows it begins at once: a line with a parabola from an instant on.
    """
    rest = x[: x.size // 2 + 1]
    if rest.size < FEWEST + 1:
        return False
    t = np.linspace(-0.5, 0.5, rest.size)
    change = float(t @ rest / (t @ t))
    residual_sd = max(noise, float(np.sqrt(_left(t[:, None], rest) / (rest.size - 2))))
    error = residual_sd / float(np.sqrt(t @ t))
    if abs(change) < max(DRIFT * band, float(norm.isf(0.5 * FALSE_ALARM)) * error):
        return False
    t = np.linspace(0.0, 1.0, x.size)
    released = [np.column_stack([t, np.clip(t - begin, 0.0, None) ** 2]) for begin in RELEASES]
    even = _left(np.column_stack([t, t**2, t**3]), x)
    rests = min(_left(columns, x) for columns in released)
    return bool(0.5 * x.size * np.log(max(rests, 1e-300) / max(even, 1e-300)) > LIKELIER)


def _is_free(x: Array, rest: int, period: float) -> bool:
    """Whether the motion that follows a stretch, continued backwards, explains its readings as well
    as a rest does: where the band holds much of the motion, readings keep to it without a rest.

    The motion as a damped oscillation, over what follows nearly to the next turn.
    """
    end = min(x.size, rest + max(round(FOLLOWING * period), ENOUGH))
    t, still = np.arange(float(end)), float(np.sum((x[:rest] - x[:rest].mean()) ** 2))
    free = rests = np.inf
    for cycles in TEMPOS / period:
        for damping in DAMPINGS:
            wave = np.exp((-damping + 1j) * 2 * np.pi * cycles * (t - rest))
            columns = np.column_stack([wave.real, wave.imag])
            free = min(free, _left(columns, x[:end]))
            rests = min(rests, still + _left(columns[rest:], x[rest:end]))
    return bool(0.5 * end * np.log(max(free, 1e-300) / max(rests, 1e-300)) < LIKELIER)


def _left(columns: Array, x: Array) -> float:
    """Sum of squares that columns (n, k) and a constant leave of x (n,)."""
    design = np.column_stack([np.ones(x.size), columns])
    return float(np.sum((x - design @ np.linalg.lstsq(design, x, rcond=None)[0]) ** 2))


def _moves(x: Array, band: float) -> bool:
    """Whether the first readings of a speed or an acceleration are not those of a rest.

    At rest either is none, and over a motion that begins and ends near rest its mean is none.
    """
    return bool(abs(np.median(x[:FEWEST]) - x.mean()) > band)


def _leaves(x: Array, first: int, band: float, hum: float | None) -> int:
    """First sample from `first` on that leaves a band about the reading there, for good.

    What is left of a hum (its frequency in cycles per sample) is fitted beside the reading, over
    all that was at rest so far.
    """
    if hum is None:
        return first + _outside(x[first:] - float(np.median(x[first : first + FEWEST])), band)
    angle = 2 * np.pi * hum * np.arange(x.size - first)
    columns = np.column_stack([np.ones(angle.size), np.cos(angle), np.sin(angle)])
    size, longer = 0, int(np.ceil(PERIODS / hum))
    while longer > size and longer < angle.size:
        size = longer
        found = np.linalg.lstsq(columns[:size], x[first : first + size], rcond=None)[0]
        longer = _outside(x[first:] - columns @ found, band)
    return first + longer


def _outside(x: Array, band: float) -> int:
    """First of two samples in a row that are outside of the band; all of them without any."""
    outside = np.abs(x) > band
    twice = outside[:-1] & outside[1:]
    return int(np.argmax(twice)) if twice.any() else int(x.size)


def _grown(centred: Array, peak: int, period: float, band: float) -> bool:
    """Whether the largest excursion was reached by a pull, or exceeds all that came before it.

    A pull: longer than a free motion takes, the rest was not passed on the way.
    """
    if peak < LATE * period:
        return False
    side = np.sign(centred[peak])
    height = abs(centred[peak])
    way = side * centred[int(peak - UNCROSSED * period) : peak]
    if way.min() > -0.02 * height:
        return True
    before = np.abs(
        centred[: max(int(peak - 0.25 * period), 1)]
    )  # a free oscillation has two sides
    return bool(height > GROWTH * float(before.max()) + band)


def _pushed(centred: Array, band: float, period: float) -> int:
    """Sample of the first turning point, where the way out to it was begun too slowly for a free
    motion; 0 where it was not.

    A free motion of amplitude A passes A cos(phase), and its phase goes on by 2 pi in a period.
    """
    count = max(2, round(WINDOW * period))
    way = np.sign(centred[0]) * centred[: int(period / 2)]
    turn = int(np.argmax(way))
    height = float(way[turn])
    if turn <= count or way[: turn + 1].min() <= 0.0:
        return 0
    phase = np.arccos(way[: turn + 1] / height)
    free = 2 * np.pi * count / period
    told = height * (np.cos(phase[:-count] - free) - np.cos(phase[:-count])) > band
    gone = phase[:-count] - phase[count:]
    return turn if bool(np.any(gone[told] < SLOW * free)) else 0
