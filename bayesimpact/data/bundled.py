"""The campaigns that come with the package."""

from __future__ import annotations

from pathlib import Path

from bayesimpact.errors import InputError


def bundled_campaign(name: str = "paper") -> Path:
    """Folder of a bundled campaign.

    An installed package carries the folders of `data/` as `bayesimpact/bundled`; a checkout has
    them beside the package.

    Raises
    ------
    InputError
        when there is no campaign of that name.
    """
    package = Path(__file__).resolve().parents[1]
    folders = (package / "bundled", package.parent / "data")
    for folder in folders:
        if name and Path(name).name == name and (folder / name / "campaign.toml").is_file():
            return folder / name
    known = sorted({file.parent.name for f in folders for file in f.glob("*/campaign.toml")})
    raise InputError("bundled campaign", f'"{name}"', ", ".join(known) or "none is installed")
