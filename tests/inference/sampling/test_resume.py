"""Interrupted, killed and resumed runs equal uninterrupted ones, bit for bit."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from sampling import Interrupted, assert_same, interrupt, small

import bayesimpact.data.files as files
import bayesimpact.inference.sampling.run as run_module
from bayesimpact.errors import InputError
from bayesimpact.inference.sampling.sample import sample_posterior


def count_calls():
    function = Interrupted()
    small(function)
    return function.calls


@pytest.mark.parametrize("share", [0.02, 0.2, 0.4, 0.55, 0.7, 0.85, 0.99])
def test_interrupted_anywhere_and_resumed(share, tmp_path, uninterrupted, capfd):
    at = int(share * count_calls())
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(at, interrupt), folder=tmp_path)
    chains = small(Interrupted(), folder=tmp_path, resume=True)
    assert_same(chains, uninterrupted)
    assert capfd.readouterr() == ("", "")


def test_interrupted_twice_and_between_blocks(tmp_path, uninterrupted):
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(150, interrupt), folder=tmp_path)

    def stop(progress):
        if progress.steps == 60:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(), folder=tmp_path, resume=True, progress=stop)
    assert_same(small(Interrupted(), folder=tmp_path, resume=True), uninterrupted)


def test_killed_while_writing(tmp_path, monkeypatch, uninterrupted):
    """The file that was being written is not there, or not renamed yet."""
    rename, renamed = os.replace, []

    def killed(source, destination):
        renamed.append(destination)
        if len(renamed) == 5:
            raise KeyboardInterrupt
        rename(source, destination)

    monkeypatch.setattr(files.os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(), folder=tmp_path)
    monkeypatch.undo()
    assert len(list(tmp_path.glob("*.npz"))) == 4
    assert_same(small(Interrupted(), folder=tmp_path, resume=True), uninterrupted)


KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from sampling import Interrupted, small
small(Interrupted({call}, lambda: os.kill(os.getpid(), signal.SIGKILL)), folder=Path({folder!r}))
"""


@pytest.mark.parametrize(("share", "threads"), [(0.3, 1), (0.8, 2)])
def test_killed_process_with_another_number_of_threads(share, threads, tmp_path, uninterrupted):
    call = int(share * count_calls())
    tests = os.path.dirname(__file__)
    script = KILLED.format(tests=tests, call=call, folder=str(tmp_path))
    environment = {
        **os.environ,
        "OPENBLAS_NUM_THREADS": str(threads),
        "OMP_NUM_THREADS": str(threads),
    }
    done = subprocess.run([sys.executable, "-c", script], env=environment, check=False)
    assert done.returncode == -signal.SIGKILL
    assert_same(small(Interrupted(), folder=tmp_path, resume=True), uninterrupted)


def test_resuming_with_nothing_saved_starts(tmp_path, uninterrupted):
    assert_same(small(Interrupted(), folder=tmp_path / "new", resume=True), uninterrupted)


def test_resuming_a_finished_run_computes_nothing_new(tmp_path, uninterrupted):
    small(Interrupted(), folder=tmp_path)
    function = Interrupted()
    assert_same(small(function, folder=tmp_path, resume=True), uninterrupted)
    assert function.calls == 2  # the check that the walkers still have their values


def test_starting_anew_forgets_the_saved_run(tmp_path, uninterrupted):
    small(Interrupted(), folder=tmp_path, seed=9, max_steps=200)
    assert_same(small(Interrupted(), folder=tmp_path), uninterrupted)
    assert_same(small(Interrupted(), folder=tmp_path, resume=True), uninterrupted)


def test_more_steps_later_equals_more_steps_at_once(tmp_path):
    early = small(Interrupted(), folder=tmp_path, max_steps=40)
    assert not early.converged
    later = small(Interrupted(), folder=tmp_path, max_steps=200, resume=True)
    assert_same(later, small(Interrupted(), max_steps=200))


def test_thinning_bounds_memory_and_survives_resuming(tmp_path, monkeypatch):
    monkeypatch.setattr(run_module, "STORED_STEPS", 30)
    whole = small(Interrupted(), max_steps=160)
    assert whole.thin == 8
    assert whole.draws.shape[1] + whole.discarded // 8 == 20
    assert whole.convergence.steps == 160 - whole.discarded
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(330, interrupt), folder=tmp_path, max_steps=160)
    assert_same(small(Interrupted(), folder=tmp_path, max_steps=160, resume=True), whole)


def test_thinned_draws_are_every_other_of_the_full_ones(monkeypatch):
    full = small(Interrupted())
    monkeypatch.setattr(run_module, "STORED_STEPS", 60)
    thinned = small(Interrupted())
    assert (full.discarded, full.thin, thinned.thin) == (0, 1, 2)
    kept = full.draws[:, thinned.discarded + 1 :: 2]  # steps are counted from 1
    np.testing.assert_array_equal(thinned.draws, kept)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"fingerprint": "other data"}, "fingerprint = 'some data'"),
        ({"seed": 6}, "seed = 5"),
        ({"walkers": 12}, "walkers = 10"),
        ({"block": 10}, "block = 20"),
        ({"ensembles": 3}, "ensembles = 2"),
        ({"upper": np.full(3, 10.0)}, "upper"),
    ],
)
def test_resuming_with_other_settings_is_refused(options, words, tmp_path):
    saved = {"folder": tmp_path, "fingerprint": "some data", "max_steps": 20}
    small(Interrupted(), **saved)
    with pytest.raises(InputError, match=words):
        small(Interrupted(), **{**saved, **options}, resume=True)


def test_resuming_another_posterior_is_refused(tmp_path):
    small(Interrupted(), folder=tmp_path, max_steps=20)
    with pytest.raises(InputError, match="other values now"):
        small(lambda x: Interrupted()(x) + 0.01, folder=tmp_path, max_steps=20, resume=True)
    with pytest.raises(InputError, match="standard deviations away"):
        sample_posterior(
            Interrupted(),
            np.full(3, 1.5),
            np.eye(3),
            seed=5,
            walkers=10,
            block=20,
            folder=tmp_path,
            resume=True,
        )


def test_last_bits_of_mode_and_covariance_do_not_matter_on_resuming(tmp_path, uninterrupted):
    with pytest.raises(KeyboardInterrupt):
        small(Interrupted(200, interrupt), folder=tmp_path)
    chains = sample_posterior(
        Interrupted(),
        np.nextafter(np.ones(3), 2.0),
        np.eye(3) * (1.0 + 1e-15),
        seed=5,
        walkers=10,
        block=20,
        max_steps=120,
        target_ess=1e9,
        folder=tmp_path,
        resume=True,
    )
    assert_same(chains, uninterrupted)


def test_saved_files_hold_no_pickles(tmp_path):
    small(Interrupted(), folder=tmp_path, max_steps=20)
    paths = list(tmp_path.glob("*.npz"))
    assert len(paths) == 4  # start, two rounds of burn-in, one block
    for path in paths:
        with np.load(path, allow_pickle=False) as content:
            assert all(not content[name].dtype.hasobject for name in content.files)
