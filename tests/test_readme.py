"""The README's example of campaign.toml is accepted, every line of it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from campaigns import csv, write

from bayesimpact.data.read import load_campaign
from bayesimpact.data.schema import CampaignTable, parse_campaign

README = (Path(__file__).resolve().parents[1] / "README.md").read_text()
(EXAMPLE,) = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)


def test_example_loads_as_it_stands(tmp_path: Path) -> None:
    folder = write(tmp_path, EXAMPLE, case1_a=csv())
    assert load_campaign(folder).cases == ("1",)


def test_every_commented_line_is_accepted_and_no_key_is_missing() -> None:
    text = re.sub(r"^# (?=[\[\w\"])", "", EXAMPLE, flags=re.MULTILINE)
    savgol, lag = re.findall(r"^smoothing = .*$", text, re.MULTILINE)
    for left_out in (savgol, lag):
        table = parse_campaign(tomllib.loads(text.replace(left_out, "")), "README")
        assert table.model_fields_set == set(CampaignTable.model_fields)
        recording = table.recording[0]
        assert recording.model_fields_set == set(type(recording).model_fields)
        assert "smoothing" in table.measurement.model_fields_set
    assert len(table.priors) == 5
