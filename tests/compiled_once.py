"""The two large simulators are compiled once, not by every worker of pytest-xdist at once.

Each takes most of a minute, and a worker that meets it while another compiles it starts anew. Here
every second worker begins with the other one, and the rest is read from numba's cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
import small_rig
from effect_rigs import BY_ID

from bayesimpact.inference.identify import identify
from bayesimpact.model.exact import batch
from bayesimpact.model.general import loop as general
from bayesimpact.model.oscillator import build_oscillator


@contextmanager
def _alone(file: str) -> Iterator[None]:
    """Alone among the processes that ask for this file; on a system without such locks, at once."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with open(file) as handle:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _base_model() -> None:
    with _alone(batch.__file__):
        campaign = small_rig.record(duration=0.3)
        identify(campaign, rng=np.random.default_rng(0), search=False)


def _effects() -> None:
    with _alone(general.__file__):
        oscillator = build_oscillator(small_rig.record(duration=0.3), [BY_ID["spring_cubic"]])
        values = small_rig.true_values() | {"spring_cubic.stiffness": 1e6}
        oscillator.predict(small_rig.vector(oscillator.layout, values))


def compile_once(worker: str) -> None:
    """Have both ready in a worker, by its name (gw0, gw1, ...)."""
    parts = [_base_model, _effects]
    for part in parts if int(worker.removeprefix("gw")) % 2 else parts[::-1]:
        part()
