"""Seal the truth, show the campaign to somebody who does not know it, open the seal afterwards.

The diagnosis sees files of a campaign in a folder of their own and nothing else: no settings, no
truth. A truth is sealed by its SHA-256, which is published before the diagnosis begins.
"""

from __future__ import annotations

import hashlib
import json
import math
import tempfile
import time
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.data.strict_json import strict
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.errors import InputError
from bayesimpact.report.diagnosis.document import document
from bayesimpact.trial.rig.files import write_campaign
from bayesimpact.workflow import DIAGNOSIS_FILE, diagnose_campaign

REPORT_FILE = "report.html"
LIBRARIES = ("bayesimpact", "numpy", "scipy", "numba")


def sealed_text(truth: Mapping[str, Any]) -> str:
    """The truth as the text that is sealed."""
    return json.dumps(truth, indent=1, sort_keys=True, allow_nan=False) + "\n"


def seal(text: str) -> str:
    """SHA-256 of a sealed text."""
    return hashlib.sha256(text.encode()).hexdigest()


def open_seal(text: str, promised: str) -> dict[str, Any]:
    """The truth, when it is still the one that was sealed.

    Raises
    ------
    InputError : it is not
    """
    if seal(text) != promised:
        raise InputError("sealed truth", f"SHA-256 {seal(text)}", promised)
    truth: dict[str, Any] = json.loads(text)
    return truth


def campaign_files(campaign: Campaign, rounding: float) -> dict[str, str]:
    """A campaign as the texts of its files, with digits two decades below its `rounding` in m."""
    decimals = 6 if rounding <= 0 else max(6, math.ceil(-math.log10(rounding * 1e3)) + 2)
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(Path(folder), campaign, decimals=decimals)
        return {f.name: f.read_text(encoding="utf-8") for f in sorted(Path(folder).iterdir())}


def answer(files: Mapping[str, str], *, search: bool, report: bool = False) -> dict[str, Any]:
    """Diagnose a campaign given as files -> the content of its diagnosis.json.

    The diagnosis' own random numbers are seeded by the files, for the trial's seed is not shown.
    With `report` it goes the whole way of `bayesimpact diagnose`, with --quick unless `search`:
    figures and report are written, and diagnosis.json is read from the folder.
    """
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8", newline="\n")
        campaign = load_campaign(Path(folder))
    seed = int(seal("".join(files[name] for name in sorted(files)))[:8], 16)
    return _reported(campaign, seed, search) if report else _found(campaign, seed, search)


def _reported(campaign: Campaign, seed: int, search: bool) -> dict[str, Any]:
    """By the command's function, from the folder that it writes."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        diagnose_campaign(campaign, out, seed=seed, quick=not search, command="bayesimpact trial")
        if not (out / REPORT_FILE).stat().st_size:
            raise ValueError("the report is empty")
        text = (out / DIAGNOSIS_FILE).read_text(encoding="utf-8")
    result: dict[str, Any] = json.loads(text)
    return result


def _found(campaign: Campaign, seed: int, search: bool) -> dict[str, Any]:
    """By the library, without figures or report."""
    began = time.perf_counter()
    found = diagnose(campaign, rng=np.random.default_rng(seed), search=search)
    seconds = time.perf_counter() - began
    versions = {name: metadata.version(name) for name in LIBRARIES}
    content = document(found, seed=seed, seconds=seconds, versions=versions)
    result: dict[str, Any] = json.loads(json.dumps(strict(content)))
    return result
