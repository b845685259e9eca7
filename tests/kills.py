"""Commands that are killed with SIGKILL, at the n-th write or after some time, and resumed."""

from __future__ import annotations

import hashlib
import json
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray

# Kills its process in place of the n-th renaming of a finished file: what was written is there in
# full under another name, or not at all. n = 0: never; at the end it says how many there were.
# Of figures only the names are compared: each file is one pixel, for drawing them took a third.
AT_A_WRITE = """
import base64, os, signal, sys
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
from bayesimpact.data.files import atomic
from bayesimpact.report.figures import save
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5E"
    "rkJggg=="
)
def saved(name, figure, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for ending in ("png", "pdf"):
        with atomic(folder / f"{save.file_name(name)}.{ending}") as temporary:
            temporary.write_bytes(PIXEL)
    return PIXEL
save._saved = saved
try:
    main(sys.argv[2:])
finally:
    print(count)
"""
_VARIES = ("date", "command", "versions", "seconds", "commit")  # not the same in two runs
RESUME = ("--resume",)  # what `sample` and `diagnose` take; `fleet` and `trial` go on by themselves


def run(
    arguments: Sequence[str], *, write: int = 0, seconds: float | None = None
) -> tuple[int, str]:
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
    arguments: Sequence[str],
    out: Path,
    *,
    write: int = 0,
    seconds: float | None = None,
    resume: Sequence[str] = RESUME,
) -> bool:
    """Run into `out` with one kill, then resume to the end -> whether the kill met the run.

    Raises
    ------
    RuntimeError : the resumed run did not end well
    """
    code, _ = run([*arguments, "--out", str(out)], write=write, seconds=seconds)
    if code != -signal.SIGKILL and code not in (0, 3):
        raise RuntimeError(f"exit {code} before any kill")
    again, said = run([*arguments, "--out", str(out), *resume])
    if again not in (0, 3):
        raise RuntimeError(f"exit {again} when resumed: {said[-2000:]}")
    return code == -signal.SIGKILL


def state(out: Path) -> dict[str, str]:
    """What must be the same, bit for bit, however often a run was killed: digests by name.

    Of figures and pages, which bear dates, only that they are there. Hidden files are left out:
    the lock, and what is being written.
    """
    files = (f for f in sorted(out.rglob("*")) if f.is_file() and not f.name.startswith("."))
    return {str(f.relative_to(out)): hashlib.sha256(_content(f)).hexdigest() for f in files}


def unfinished(out: Path) -> list[str]:
    """Hidden files that are no lock: left by a killed process."""
    files = (f.name for f in out.rglob(".*") if f.is_file())
    return sorted(name for name in files if not name.endswith(".lock"))


def _content(file: Path) -> bytes:
    if file.suffix == ".npz":
        with np.load(file, allow_pickle=False) as content:
            return b"".join(name.encode() + content[name].tobytes() for name in content.files)
    if file.suffix == ".json":
        return json.dumps(_same(json.loads(file.read_text())), sort_keys=True).encode()
    if file.name == "posterior.nc":
        with xarray.open_dataset(file, group="posterior", engine="h5netcdf") as draws:
            names = sorted(map(str, draws.data_vars))
            return b"".join(name.encode() + draws[name].values.tobytes() for name in names)
    if file.name == "results.nc":
        with h5netcdf.File(file, "r") as content:
            arrays = {k: v[...] for k, v in content.variables.items() if k != "record"}
        return b"".join(name.encode() + arrays[name].tobytes() for name in sorted(arrays))
    if file.name == "log.txt":  # of trials: all of a line but its seconds
        return b"\n".join(line.rpartition(b"|")[0] for line in file.read_bytes().splitlines())
    return b"" if file.suffix in (".html", ".png", ".pdf", ".txt") else file.read_bytes()


def _same(value: Any) -> Any:
    """Content of a JSON file without what varies from run to run."""
    if isinstance(value, dict):
        return {key: _same(inner) for key, inner in value.items() if key not in _VARIES}
    return [_same(inner) for inner in value] if isinstance(value, list) else value
