"""A strong trial from the draw to the score, report and figures included; a report that fails."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayesimpact.trial.draw.settings import strong_settings
from bayesimpact.trial.run import blind
from bayesimpact.trial.run import trials as run
from bayesimpact.trial.run.stamp import stamped
from bayesimpact.trial.run.trials import run_trials
from bayesimpact.trial.score.table import summary_text

pytestmark = pytest.mark.long

SETTINGS = strong_settings(
    kinds=("several",),
    effects=("pendulum_sine", "coulomb_friction", "quadratic_drag"),
    rig_kinds=("one_pendulum",),
    rest=0.0,
    search=False,
    report=True,
)


@pytest.mark.usefixtures("coarse_figures")
def test_a_strong_trial_from_draw_to_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    whole = blind.diagnose_campaign

    def watched(campaign: object, out: Path, **how: object) -> object:
        found = whole(campaign, out, **how)  # type: ignore[arg-type]
        written.extend(f.name for f in out.rglob("*") if f.is_file())
        return found

    monkeypatch.setattr(blind, "diagnose_campaign", watched)
    (result,) = run_trials(SETTINGS, [0], tmp_path)
    assert "failed" not in result, result.get("failed")
    assert {"diagnosis.json", "report.html"} < set(written)
    assert any(name.endswith(".png") or name.endswith(".svg") for name in written)
    assert result["score"]["outcome"] != "missed"
    assert (tmp_path / "log.txt").read_text().startswith("0 several | one_pendulum, encoder")
    assert "1 trials, 0 failed" in summary_text(stamped([result], SETTINGS, [0]))


def test_a_report_that_fails_is_a_crash(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object, **named: object) -> None:
        raise KeyError("g")

    files = run.draw_job(SETTINGS, 0)["files"]
    monkeypatch.setattr(blind, "diagnose_campaign", broken)
    assert "KeyError: 'g'" in run.answer_job(files, False, True)["failed"]
