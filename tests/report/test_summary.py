"""Estimates as a table in lab units, and short representations."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import make_results

import bayesimpact as bi
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.report.archive import save_results


def test_summary_in_lab_units() -> None:
    table = bi.summary(make_results(2, 2))
    assert list(table.columns) == ["estimate", "low", "high", "unit", "meaning"]
    gap, stiffness = table.loc["g"], table.loc["k2[2]"]
    assert gap.unit == "mm" and gap.estimate == pytest.approx(1.1)
    assert gap.high - gap.low == pytest.approx(2 * 1.6449 * 3.4e-5, rel=1e-3)
    assert stiffness.unit == "N/m" and stiffness.estimate == pytest.approx(5350.156 / 2)


def test_open_reads_what_was_saved(tmp_path) -> None:
    results = make_results(1, 1)
    save_results(results, tmp_path)
    assert np.array_equal(bi.open(tmp_path).draws.values, results.draws.values)


def test_representations_are_one_short_line() -> None:
    recording = Recording("a", "1", np.zeros(6000), 1e-3)
    campaign = Campaign("rig", 0.5, (recording,) * 9)
    assert repr(recording) == "<Recording 'a', case 1: 6000 samples at 1000 Hz>"
    assert repr(campaign) == "<Campaign 'rig': 9 recordings, cases 1>"
