"""report.pdf: the page as an installed Chromium prints it; no dependency of the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from bayesimpact.data.files import atomic
from bayesimpact.errors import BayesimpactError, InputError

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
    *("chrome", "msedge", "microsoft-edge"),
)
PATIENCE = 300  # s


def print_page(page: Path, path: Path) -> None:
    """Print an HTML file on A4 into a PDF file.

    Raises
    ------
    InputError : no such browser is on the PATH
    BayesimpactError : the browser did not print
    """
    browser = next((found for found in map(shutil.which, BROWSERS) if found), None)
    if browser is None:
        raise InputError(
            "--pdf", "no browser to print with", f"one on PATH of {', '.join(BROWSERS)}"
        )
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        atomic(path) as temporary,
    ):
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer"]
        options += [f"--user-data-dir={profile}", f"--print-to-pdf={temporary}"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            options.append("--no-sandbox")  # root has none
        command = [browser, *options, page.resolve().as_uri()]
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise BayesimpactError(f"{path}: {browser} did not print ({error})") from None
        if done.returncode or not temporary.stat().st_size:
            raise BayesimpactError(f"{path}: {browser} did not print (exit {done.returncode})")
