"""One job in shares on several threads: compiled work lets go of Python's lock while it runs.

Threads of Python, not numba's: nothing is compiled twice. Waking one up takes about 0.1 ms, so this
is for jobs of milliseconds; the likelihood's batches (`batch`) have numba's.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache

import numba
from threadpoolctl import threadpool_limits

SHARES_PER_THREAD = 4  # shares differ in cost


def available() -> int:
    """Threads that numba's settings (NUMBA_NUM_THREADS, `numba.set_num_threads`) allow."""
    return int(numba.get_num_threads())


@contextmanager
def linear_algebra_alone() -> Iterator[None]:
    """While it lasts, NumPy's and SciPy's linear algebra runs on the thread that calls it.

    Its own threads gain nothing on matrices of tens of columns, and those of OpenBLAS keep a core
    busy while they wait for more, which `in_shares` could use.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield


def in_shares(work: Callable[[int, int], None], size: int) -> None:
    """Call work(first, end) for spans that cover range(size), this thread among the workers.

    Which spans there are depends on the number of threads: the numbers may not depend on them.
    Raises what `work` raises.
    """
    threads = min(available(), size)
    shares = min(SHARES_PER_THREAD * threads, size)
    left = iter(range(shares))

    def take() -> None:
        for share in left:
            work(share * size // shares, (share + 1) * size // shares)

    helpers = [_pool(os.getpid(), threads).submit(take) for _ in range(threads - 1)]
    try:
        take()
    finally:  # a helper that has not begun has nothing left to do
        started = [helper for helper in helpers if not helper.cancel()]
        errors = [helper.exception() for helper in started]
    for error in filter(None, errors):
        raise error


@cache
def _pool(process: int, threads: int) -> ThreadPoolExecutor:
    """The helpers of a process: a fork does not inherit its parent's threads."""
    return ThreadPoolExecutor(threads, thread_name_prefix="bayesimpact")
