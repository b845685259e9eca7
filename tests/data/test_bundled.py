"""The bundled campaigns are found from anywhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError


def test_found_and_loads_from_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    campaign = load_campaign(bundled_campaign())
    assert len(campaign.recordings) == 9
    assert len(campaign.cases) == 3


@pytest.mark.parametrize("name", ["nothing", "", "..", "../data/paper"])
def test_unknown_name_lists_the_known_ones(name: str) -> None:
    with pytest.raises(InputError, match=r"accepted: .*paper"):
        bundled_campaign(name)
