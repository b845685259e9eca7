"""Fleets of small campaigns: plain oscillators, one recording of half a second a day."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path

from small_rig import PLAIN, PLAIN_RELEASES, record

from bayesimpact.trial.rig.files import write_campaign

FIRST = date(2026, 1, 1)


def write_fleet(root: Path, days: int, command: str = "fit") -> Path:
    """Write the campaigns and the fleet's file; the file."""
    lines = [f'name = "{days} days"', f'command = "{command}"']
    for day in range(days):
        campaign = record(seed=day, rig=PLAIN, releases=PLAIN_RELEASES[:1], duration=0.5)
        write_campaign(root / f"day{day}", campaign)
        when = (FIRST + timedelta(day)).isoformat()
        lines += ["[[campaign]]", f'folder = "day{day}"', f"date = {when}"]
    file = root / "fleet.toml"
    file.write_text("\n".join(lines) + "\n")
    return file
