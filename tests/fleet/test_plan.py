"""The file of a fleet: what it may say, and the message where it says something else."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayesimpact.errors import InputError
from bayesimpact.fleet.plan import load_plan

GOOD = """name = "summer"
command = "fit"
[[campaign]]
folder = "b"
date = 2026-05-08
temperature_c = 21
[[campaign]]
folder = "a"
name = "first"
date = 2026-05-01T12:00:00+02:00
operator = "M"
"""


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "fleet.toml"
    file.write_text(text)
    return file


def test_sessions_by_date_with_their_conditions(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, GOOD))
    assert (plan.name, plan.command, plan.quick) == ("summer", "fit", True)
    first, second = plan.sessions
    assert first.name == "first" and second.name == "b"
    assert second.day is not None and first.day is not None
    assert second.day - first.day == pytest.approx(7.0 - 10.0 / 24.0)
    assert dict(first.conditions) == {"operator": "M"}
    assert dict(second.conditions) == {"temperature_c": 21.0}
    assert first.folder == tmp_path / "a"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"fit"', '"guess"'), r'key command: found the text "guess"; accepted: "fit"'),
        (('name = "summer"\n', ""), "key name: found nothing"),
        (("temperature_c = 21", "temperature_c = [1]"), r"campaign 1 \(b\), key temperature_c"),
        (("date = 2026-05-08", 'date = "May"'), r"key date: found the text \"May\""),
        (('name = "first"', 'name = "b"'), 'campaign 2, key name: found "b" again'),
        (('folder = "b"\n', ""), "campaign 1, key folder: found nothing"),
        (('command = "fit"', "workers = 3"), "key workers: found an unknown key"),
        (('"summer"', '"summer'), "found .*; accepted: a TOML file"),
    ],
)
def test_what_is_refused(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_plan(written(tmp_path, GOOD.replace(*change)))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_plan(tmp_path / "none.toml")
