"""The recorded cases of tests/cases: read from their files, diagnosed, and answered as stored."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from effect_rigs import BY_ID

import bayesimpact as bi

CASES = sorted(f.parent for f in (Path(__file__).parent / "cases").glob("*/answer.json"))

pytestmark = pytest.mark.usefixtures("catalogue_alone")


@pytest.mark.parametrize("folder", CASES, ids=lambda folder: folder.name)
def test_a_case_has_its_answer(folder: Path) -> None:
    answer = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
    effects = tuple(BY_ID[i] for i in answer["effects"])
    found = bi.diagnose(bi.load(folder), seed=0, effects=effects, search=False)
    assert found.verdict == answer["verdict"]
    assert sorted(e.id for e in found.effects) == answer["named"]
    faults = found.corrected.faults if found.corrected else ()
    assert [[f.id, f.recording] for f in faults] == answer["faults"]
    fit = found.after
    off = {n: (fit.value(n) - x) / fit.sd[fit.names.index(n)] for n, x in answer["truth"].items()}
    assert max(map(abs, off.values())) < 4.0, off
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)
