"""What reports show of recordings that are no displacements: units, impacts, archives."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from synthetic import make_results

from bayesimpact.model.units import display
from bayesimpact.report.codec import decode, encode
from bayesimpact.report.cycles import contact_onsets, contacts, stop_level
from bayesimpact.report.explorer import explorer_data
from bayesimpact.report.figures.style import position, response, response_word
from bayesimpact.report.results import Results
from bayesimpact.report.tables import recording_views, residual_unit

W = 2 * np.pi * 6.4


def made_accelerations() -> Results:
    """The synthetic results with -w^2 y in place of every reading y, to which it belongs."""
    plain = make_results(2)
    recordings = tuple(
        replace(
            r,
            samples=-(W**2) * r.samples,
            predicted=-(W**2) * r.predicted,
            sigma=W**2 * r.sigma,
            noise_rms=W**2 * r.noise_rms,
            quantity="acceleration",
            displacement=r.predicted,
        )
        for r in plain.recordings
    )
    noise = replace(plain.noise, level=W**2 * plain.noise.level)
    return replace(plain, quantity="acceleration", recordings=recordings, noise=noise)


def test_units_are_those_of_the_reading_and_of_the_motion() -> None:
    results = made_accelerations()
    assert (results.unit, results.length, results.angular) == ("m/s2", "m", False)
    assert response(results).unit == "m/s2" and position(results).unit == "mm"
    assert response_word(results) == "acceleration"
    assert residual_unit(results).startswith("mm/s")
    shown = display("m/s2", results.rms)
    largest = float(np.abs(results.recordings[0].samples).max())
    (first, _) = recording_views(results)
    assert float(first["largest"]) == pytest.approx(largest, rel=5e-3)
    rms = results.recordings[0].rms * shown.scale
    assert float(first["rms"].replace("\N{MINUS SIGN}", "-")) == pytest.approx(rms, rel=5e-3)


def test_impacts_are_those_of_the_motion_not_of_the_reading() -> None:
    results, plain = made_accelerations(), make_results(2)
    for here, there in zip(results.recordings, plain.recordings, strict=True):
        assert stop_level(results, here) is None  # no acceleration is that of the gap
        motion, gap = contacts(results, here)
        assert gap == pytest.approx(1.1e-3)
        expected = contact_onsets(there.predicted, 1.1e-3)
        assert expected.size > 2
        np.testing.assert_array_equal(contact_onsets(motion, gap), expected)
    (item, _) = json.loads(explorer_data(results))["recordings"]
    assert item["level"] is None and item["impacts"] == expected.tolist()
    assert item["words"][0] == "acceleration" and item["words"][1] == "m/s²"


def test_several_quantities_are_shown_each_in_its_unit() -> None:
    results, plain = made_accelerations(), make_results(2)
    second = replace(results.recordings[1], scale=W**2)
    mixed = replace(plain, recordings=(plain.recordings[0], second))
    assert [response(mixed, r).unit for r in mixed.recordings] == ["mm", "m/s2"]
    assert mixed.rms == pytest.approx(plain.rms, rel=1e-12)  # others count by their noise
    assert mixed.share == pytest.approx(plain.share, rel=1e-12)


def test_an_archive_keeps_what_was_read() -> None:
    results = made_accelerations()
    again = decode(Results, *encode(results))
    assert [r.quantity for r in again.recordings] == ["acceleration"] * 2
    np.testing.assert_array_equal(
        again.recordings[0].displacement, results.recordings[0].displacement
    )
