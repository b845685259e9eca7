"""Commands that are killed with SIGKILL, at the n-th write or after some time, and resumed."""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.report.archive_arviz import read_posterior

# Kills its process in place of the n-th renaming of a finished file: what was written is there in
# full under another name, or not at all. n = 0: never; at the end it says how many there were.
AT_A_WRITE = """
import os, signal, sys
rename, count, fatal = os.replace, 0, int(sys.argv[1])
def counted(source, target, **more):
    global count
    if "__pycache__" not in os.fspath(target):
        count += 1
        if count == fatal:
            os.kill(os.getpid(), signal.SIGKILL)
    rename(source, target, **more)
os.replace = counted
from bayesimpact.cli import main
try:
    main(sys.argv[2:])
finally:
    print(count)
"""
_VARIES = ("date", "command", "versions")  # of fit.json: not the same in two runs


def run(arguments: list[str], *, write: int = 0, seconds: float | None = None) -> tuple[int, str]:
    """Exit code and output of a command; killed at a write or after some seconds."""
    command = [sys.executable, "-P", "-c", AT_A_WRITE, str(write), *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            out, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            out, _ = process.communicate()
        return process.returncode, out


def killed_and_resumed(
    arguments: list[str], out: Path, *, write: int = 0, seconds: float | None = None
) -> bool:
    """Run into `out` with one kill, then resume to the end -> whether the kill met the run.

    Raises
    ------
    RuntimeError : the resumed run did not end well
    """
    code, _ = run([*arguments, "--out", str(out)], write=write, seconds=seconds)
    if code != -signal.SIGKILL and code not in (0, 3):
        raise RuntimeError(f"exit {code} before any kill")
    again, said = run([*arguments, "--out", str(out), "--resume"])
    if again not in (0, 3):
        raise RuntimeError(f"exit {again} when resumed: {said[-2000:]}")
    return code == -signal.SIGKILL


def state(out: Path) -> dict[str, Any]:
    """What must be the same, bit for bit, however often a run was killed: digests by name."""
    found = {}
    for file in sorted(out.glob("chain/**/*.npz")):
        with np.load(file, allow_pickle=False) as content:
            parts = b"".join(name.encode() + content[name].tobytes() for name in content.files)
        found[str(file.relative_to(out))] = hashlib.sha256(parts).hexdigest()
    told = json.loads((out / "fit.json").read_text())
    kept = {key: value for key, value in told.items() if key not in _VARIES}
    found["fit.json"] = hashlib.sha256(json.dumps(kept).encode()).hexdigest()
    draws = read_posterior(out / "posterior.nc").groups["posterior"]
    parts = b"".join(name.encode() + v.values.tobytes() for name, v in sorted(draws.items()))
    found["posterior"] = hashlib.sha256(parts).hexdigest()
    left = [f.name for f in out.rglob("*") if f.name.endswith(".unfinished")]
    return {**found, "unfinished": left}
