"""Saved runs that something happened to: every fault is named, nothing wrong is resumed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sampling import Interrupted, assert_same, interrupt, small

from bayesimpact.data.lock import locked
from bayesimpact.errors import InputError

KEPT = 3  # two rounds of burn-in come first


def block(folder: Path, index: int) -> Path:
    return folder / f"block-{index:06d}.npz"


def truncated(folder: Path, other: Path) -> None:
    file = block(folder, KEPT)
    file.write_bytes(file.read_bytes()[:200])


def empty(folder: Path, other: Path) -> None:
    block(folder, KEPT).write_bytes(b"")


def flipped(folder: Path, other: Path) -> None:
    """One bit in the middle of the largest array."""
    file = block(folder, KEPT)
    data = bytearray(file.read_bytes())
    data[data.index(b"draws.npy") + 400] ^= 4
    file.write_bytes(bytes(data))


def missing(folder: Path, other: Path) -> None:
    block(folder, KEPT).unlink()


def foreign(folder: Path, other: Path) -> None:
    shutil.copy(block(other, KEPT), block(folder, KEPT))


def misplaced(folder: Path, other: Path) -> None:
    """A block of the burn-in where a kept one belongs."""
    shutil.copy(block(folder, 1), block(folder, KEPT))


def anonymous(folder: Path, other: Path) -> None:
    """A block as earlier versions wrote it, without identity."""
    with np.load(block(folder, KEPT)) as content:
        arrays = {name: content[name] for name in content.files if name not in ("run", "place")}
    with open(block(folder, KEPT), "wb") as stream:
        np.savez(stream, **arrays)


def a_folder(folder: Path, other: Path) -> None:
    block(folder, KEPT).unlink()
    block(folder, KEPT).mkdir()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (truncated, "damaged"),
        (empty, "damaged"),
        (flipped, "damaged"),
        (missing, "is missing"),
        (foreign, "of another run"),
        (misplaced, "block 1 of the run"),
        (anonymous, "of another run"),
    ],
)
def test_a_block_that_is_wrong_is_named_and_sampled_anew(fault, words, tmp_path, uninterrupted):
    folder, other = tmp_path / "chain", tmp_path / "other"
    small(Interrupted(), folder=folder)
    small(Interrupted(), folder=other, seed=6)
    fault(folder, other)
    said: list[str] = []
    chains = small(Interrupted(), folder=folder, resume=True, tell=said.append)
    assert_same(chains, uninterrupted)
    assert len(said) == 1 and "block-000003" in said[0] and words in said[0], said
    again: list[str] = []
    function = Interrupted()
    assert_same(small(function, folder=folder, resume=True, tell=again.append), uninterrupted)
    assert again == [] and function.calls == 2


def test_a_folder_in_a_blocks_place_is_refused(tmp_path):
    small(Interrupted(), folder=tmp_path)
    a_folder(tmp_path, tmp_path)
    with pytest.raises((InputError, OSError)):
        small(Interrupted(), folder=tmp_path, resume=True)


@pytest.mark.parametrize(
    "content", [b"", b"not a zip", b"PK\x05\x06" + 18 * b"\x00"], ids=["empty", "text", "no arrays"]
)
def test_a_start_of_the_wrong_kind_is_refused(content, tmp_path):
    small(Interrupted(), folder=tmp_path, max_steps=20)
    (tmp_path / "start.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"start\.npz"):
        small(Interrupted(), folder=tmp_path, resume=True)


def test_a_start_of_another_size_is_refused(tmp_path):
    small(Interrupted(), folder=tmp_path, max_steps=20)
    with np.load(tmp_path / "start.npz") as content:
        arrays = {name: content[name] for name in content.files}
    with open(tmp_path / "start.npz", "wb") as stream:
        np.savez(stream, **{**arrays, "mode": arrays["mode"][:1]})
    with pytest.raises(InputError, match="no mode of this size"):
        small(Interrupted(), folder=tmp_path, resume=True)


def test_what_differs_is_named(tmp_path):
    small(Interrupted(), folder=tmp_path, max_steps=20, fingerprint={"data": "1", "version": "a"})
    with pytest.raises(InputError, match="version = 'a'"):
        small(
            Interrupted(),
            folder=tmp_path,
            resume=True,
            fingerprint={"data": "1", "version": "b"},
        )


def test_a_second_run_in_the_folder_is_refused_and_harms_nothing(tmp_path, uninterrupted):
    def second(progress):
        if progress.steps == 40:
            with pytest.raises(InputError, match=f"another run.*process {os.getpid()}"):
                small(Interrupted(), folder=tmp_path, seed=9)

    assert_same(small(Interrupted(), folder=tmp_path, progress=second), uninterrupted)


HOLD = """
import os, signal, sys
from pathlib import Path
from bayesimpact.data.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_lock_ends_with_its_process_however_that_ends(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"held\n"
        with pytest.raises(InputError, match=f"process {holder.pid}"), locked(tmp_path):
            pass
        holder.kill()
        holder.wait()
    with locked(tmp_path):
        pass


def test_interrupted_runs_leave_no_lock(tmp_path, uninterrupted):
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(150, interrupt), folder=tmp_path)
    assert_same(small(Interrupted(), folder=tmp_path, resume=True), uninterrupted)
