"""Prediction takes an answer only if it is the first crossing; else the general search does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bayesimpact.model.exact import events, return_time_prediction
from bayesimpact.model.exact.blocks import Sink
from bayesimpact.model.exact.flow import advance, impulse_response
from bayesimpact.model.exact.normalized import NormalizedParameters
from bayesimpact.model.exact.tables import prepare, response_tables

# rates per interval: flight of 157 samples per period, contact of 57, gap 1.1 mm
FLIGHT, CONTACT = (1e-6, 0.0016), (1e-3, 0.012)
GAP = 1.1e-3
REST = GAP * (1 - FLIGHT[1] / CONTACT[1])
MOTION = NormalizedParameters(*FLIGHT, *CONTACT, REST, GAP, 0.0, 0.0, 0.0, 0.0)


def predicted(v, guess, limit, contact=False):
    """Predict from the stop with a made-up expectation of the first stretch."""
    mine = response_tables()
    prepare(mine, 0, *FLIGHT, 0.0, False)
    prepare(mine, 1, *CONTACT, 0.0, False)
    mine.history[:] = 0.0
    mine.history[int(contact), 0], mine.history[int(contact), 4] = guess, 1.0
    nothing, found = np.empty(0), np.zeros((limit, 2))
    sink = Sink(nothing, nothing, nothing, found, 0, 1.0)
    *_, count, _ = return_time_prediction.return_time_prediction(
        mine, sink, MOTION, 100_000, limit, contact, 0.0, v, 0, 0
    )
    return found[:count]


def truth(v, contact=False):
    b, K = CONTACT if contact else FLIGHT
    sign, rest = (-1, REST) if contact else (1, 0.0)
    u = GAP - rest
    wait, speed = events.next_crossing(b, K, sign * u, sign * v, sign * u, 1e4)
    return wait, sign * speed


@pytest.mark.parametrize("off", [0.0, 0.3, -2.0, 9.0, -9.0])
def test_guesses_near_and_far_lead_to_the_crossing(off):
    wait, speed = truth(-2e-4)
    found = predicted(-2e-4, wait + off, 1)
    assert len(found) == 1
    np.testing.assert_allclose(found[0], (wait, speed), rtol=1e-13)


def test_contact():
    wait, speed = truth(2e-4, contact=True)
    found = predicted(2e-4, wait + 0.4, 1, contact=True)
    np.testing.assert_allclose(found[0], (wait, speed), rtol=1e-13)


def test_a_later_crossing_is_not_taken():
    wait, _ = truth(-2e-4)
    later = wait + 2 * math.pi / math.sqrt(FLIGHT[1])
    # it is there: the undisturbed flight rises through the gap once more
    z, v = advance(*FLIGHT, GAP, -2e-4, *impulse_response(*FLIGHT, later))
    assert abs(z - GAP) < 1e-3 * GAP and v > 0
    assert len(predicted(-2e-4, later, 1)) == 0


@pytest.mark.parametrize("guess", [math.nan, math.inf, 1e300, 0.49, 1e5])
def test_nonsense_is_left_to_the_general_search(guess):
    found = predicted(-2e-4, guess, 1)
    if len(found):
        np.testing.assert_allclose(found[0], truth(-2e-4), rtol=1e-13)


def test_stretches_follow_each_other():
    found = predicted(-2e-4, truth(-2e-4)[0], 12)
    assert len(found) == 12
    t, v, contact = 0.0, -2e-4, False
    for time, speed in found:
        wait, expected = truth(v, contact)
        assert time == pytest.approx(t + wait, rel=1e-14)
        assert speed == pytest.approx(expected, rel=1e-12)
        t, v, contact = time, speed, not contact
