"""The API reference shows every public name with its words."""

from __future__ import annotations

from pathlib import Path

import pytest
import reference

import bayesimpact


def test_every_public_name_is_documented(tmp_path: Path) -> None:
    pytest.importorskip("pdoc")
    reference.main(str(tmp_path))
    page = (tmp_path / "bayesimpact.html").read_text(encoding="utf-8")
    assert all(f'id="{name}"' in page for name in bayesimpact.__all__)
    assert "Campaign.from_arrays" in page and "evenly spaced unless" in page
