"""Work for the processes of a Dask cluster: one of this machine, or any by its address.

Workers get what they need by value and return what they found, so a cluster needs no shared disk.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Key = Any  # of a job: whatever the caller tells jobs apart by
Job = tuple[Any, ...]

THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
AHEAD = 3  # jobs per worker that wait in the cluster
UNWATCHED = {  # samples of stacks and locks: nobody looks, and they took a tenth of the time
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
}


def one_thread_each() -> None:
    """Linear algebra on one thread: sums then round alike everywhere. Before NumPy loads."""
    for name in THREADS[1:]:
        os.environ[name] = "1"


@contextmanager
def safe_path() -> Iterator[None]:
    """Processes started meanwhile do not have the working folder on their path."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        del os.environ["PYTHONSAFEPATH"]
        if before is not None:
            os.environ["PYTHONSAFEPATH"] = before


Distribute = Callable[[Callable[..., Any], Iterator[tuple[Key, Job]]], Iterator[tuple[Key, Any]]]


@contextmanager
def executor(workers: int, scheduler: str | None) -> Iterator[Distribute]:
    """A way to run jobs (key, arguments) -> (key, result), as they finish."""
    if scheduler is None and workers <= 1:
        yield here
        return
    import dask
    import distributed

    make: Any = distributed.Client  # its signatures carry no types
    local: Any = distributed.LocalCluster

    if scheduler is not None:
        with make(scheduler) as client:
            yield _on(client)
        return
    one = dict.fromkeys(THREADS, "1")
    with (
        dask.config.set(UNWATCHED),
        safe_path(),  # a worker that was lost is started again
        local(
            n_workers=workers, threads_per_worker=1, dashboard_address="127.0.0.1:0", env=one
        ) as cluster,
        make(cluster) as client,
    ):
        yield _on(client)


def here(
    function: Callable[..., Any], jobs: Iterator[tuple[Key, Job]]
) -> Iterator[tuple[Key, Any]]:
    """Jobs one after another, in this process."""
    for key, arguments in jobs:
        yield key, function(*arguments)


def _on(client: Any) -> Distribute:
    import distributed

    completed: Any = distributed.as_completed

    def distribute(
        function: Callable[..., Any], jobs: Iterator[tuple[Key, Job]]
    ) -> Iterator[tuple[Key, Any]]:
        waiting: dict[Any, Key] = {}
        done: Any = completed()
        room = AHEAD * max(1, len(client.scheduler_info()["workers"]))

        def more() -> None:
            while len(waiting) < room:
                job = next(jobs, None)
                if job is None:
                    return
                future = client.submit(function, *job[1], pure=False)
                waiting[future] = job[0]
                done.add(future)

        more()
        while waiting:
            future = next(done)
            key = waiting.pop(future)
            result = future.result() if future.status == "finished" else _lost(future)
            more()
            yield key, result

    return distribute


def _lost(future: Any) -> dict[str, str]:
    """A job whose worker died (out of memory, say)."""
    return {"failed": f"the worker was lost: {future.exception()!r}"}
