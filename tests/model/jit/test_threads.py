"""Shares of one job: everything once, whatever the threads, and never a thread waiting forever."""

from __future__ import annotations

import multiprocessing
import threading
import time

import numba
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from bayesimpact.model.jit.threads import available, in_shares, linear_algebra_alone


@pytest.fixture
def two_threads():
    before = numba.get_num_threads()
    numba.set_num_threads(min(2, numba.config.NUMBA_NUM_THREADS))
    yield
    numba.set_num_threads(before)


def counted(size: int) -> np.ndarray:
    counts = np.zeros(size, dtype=int)

    def work(first: int, end: int) -> None:
        counts[first:end] += 1

    in_shares(work, size)
    return counts


@pytest.mark.parametrize("size", [0, 1, 2, 7, 8, 9, 1000])
def test_every_item_is_done_once(size):
    np.testing.assert_array_equal(counted(size), 1)


def test_one_thread_does_without_helpers(two_threads):
    numba.set_num_threads(1)
    assert available() == 1
    names = set()
    in_shares(lambda first, end: names.add(threading.current_thread().name), 50)
    assert names == {threading.current_thread().name}


def test_helpers_take_their_part(two_threads):
    if available() < 2:
        pytest.skip("one thread only")
    names = set()

    def work(first: int, end: int) -> None:
        names.add(threading.current_thread().name)
        time.sleep(0.02)

    in_shares(work, 8)
    assert len(names) == 2


@pytest.mark.parametrize("bad", [0, 7])
def test_an_error_in_any_share_is_raised(bad):
    def work(first: int, end: int) -> None:
        time.sleep(0.005)
        if first <= bad < end:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_shares(work, 8)


def test_shares_within_shares_and_callers_beside_each_other():
    total = []

    def inner(first: int, end: int) -> None:
        in_shares(lambda a, b: total.append(b - a), end - first)

    callers = [threading.Thread(target=in_shares, args=(inner, 40)) for _ in range(6)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(timeout=30)
    assert not any(caller.is_alive() for caller in callers)
    assert sum(total) == 6 * 40


def _child(queue) -> None:
    queue.put(int(counted(100).sum()))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # a fork of a process with threads
def test_a_forked_process_has_helpers_of_its_own():
    counted(100)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_child, args=(queue,))
    child.start()
    try:
        assert queue.get(timeout=30) == 100
    finally:
        child.join(timeout=30)
        child.kill()


def test_linear_algebra_runs_on_one_thread_for_a_while():
    def threads() -> set[int]:
        return {int(x["num_threads"]) for x in threadpool_info() if x["user_api"] == "blas"}

    @linear_algebra_alone()
    def inside() -> set[int]:
        return threads()

    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert before and inside() == {1}
        assert threads() == before
