"""The benchmark of coverage: what it draws, counts and keeps; and a short run of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import coverage

from bayesimpact.inference.identify import identify

pytestmark = pytest.mark.long

BASE = ("c1", "k1", "c2", "g", "k2[1]")
SENSORS: tuple[Any, ...] = ("velocity", "acceleration")


def test_the_three_probes_tell_as_much() -> None:
    """Of one obstacle's recordings; over all nine the ratios are the same within some per cent."""
    sds = {}
    for quantity in coverage.NOISE:
        campaign, _ = coverage.recorded(310000, quantity, recordings=3)
        fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
        sds[quantity] = np.array([fit.sd[fit.names.index(name)] for name in BASE])
    for quantity in SENSORS:
        ratio = np.exp(np.mean(np.log(sds[quantity] / sds["displacement"])))
        assert ratio == pytest.approx(1.0, abs=0.1), quantity


def test_intervals_hold_the_truth_and_a_run_goes_on_where_it_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = {"recordings": 2, "duration": 2.0}
    rows = [r for q in SENSORS for r in coverage.run(tmp_path, q, range(2), 1, **size)]
    found = [p for row in rows for p in row["parameters"].values()]
    assert len(found) == 2 * 2 * 12 and all(row["converged"] for row in rows)
    # correlated within a campaign: at nine in ten, three quarters are missed once in hundreds
    for way in coverage.WAYS:
        held = [p[way] for p in found if way in p]
        assert len(held) == {"normal": 48, "sampled": 24}[way] and np.mean(held) > 0.75
    assert np.abs([p["z"] for p in found]).max() < 4.0
    monkeypatch.setattr(coverage, "one", pytest.fail)  # all are there: none is run again
    assert coverage.run(tmp_path, "velocity", range(2)) == rows[:2]
    assert coverage.kept(tmp_path, "acceleration") == rows[2:]


def planted(seed: int, held: bool, z: float) -> dict[str, Any]:
    found = {"sampled": held, "normal": bool(abs(z) < coverage.QUANTILE), "z": z}
    names = ("k1", "k2[1]", "y0[a]", "y0[b]")
    return {
        "seed": seed, "converged": held, "recordings": 2, "duration_s": 6.0, "seconds": 1.0,
        "parameters": dict.fromkeys(names, found),
    }  # fmt: skip


def test_what_is_held_is_counted() -> None:
    rows = [planted(5, True, 1.0), planted(7, False, -2.0), planted(6, True, 1.7)]
    content = coverage.document(rows, "velocity")
    assert (content["seeds"], content["not_converged"]) == ([5, 7], [7])
    assert set(content["parameters"]) == {"k1", "k2[1]", "y0"}
    k1, y0 = content["parameters"]["k1"], content["parameters"]["y0"]
    assert (k1["sampled"]["rate"], k1["normal"]["rate"]) == (2 / 3, 1 / 3)
    assert (k1["sampled"]["of"], y0["sampled"]["of"]) == (3, 6)
    low, high = k1["sampled"]["interval"]
    assert low < 2 / 3 < high and k1["mean_of_z"] == pytest.approx(0.7 / 3)
    assert y0["sampled"]["interval"] == pytest.approx([low, high])  # both of a campaign err alike
    json.dumps(content)
