"""How much is simulated, as a clock that tells the same on every machine, whatever else that does.

A limit in seconds of a processor cuts a search short where a machine is slow or busy: the same
seed then has another answer. What a fit takes beside its simulations (their derivatives, linear
algebra) goes with their number and length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# s of one core with little beside it, by hand from seven searches (within a factor of two;
# tests/benchmarks/workload.py measures others): of a call that simulates, and of a sample of the
# closed form, with its derivatives, of the general law, and of a response by superposition
PER_CALL = 2.5e-3
PER_SAMPLE = {"closed form": 4e-8, "derivatives": 3e-7, "general": 1.2e-7, "response": 1e-8}


class Workload:
    """The seconds that simulations so far would have taken."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def add(self, samples: int, kind: str) -> None:
        """Count one call that simulates so many samples."""
        self.seconds += PER_CALL + PER_SAMPLE[kind] * samples


_counted: ContextVar[tuple[Workload, ...]] = ContextVar("workload", default=())


def count(samples: int, kind: str) -> None:
    """Tell all that count of a call that simulates."""
    for workload in _counted.get():
        workload.add(samples, kind)


@contextmanager
def workload_counted() -> Iterator[Callable[[], float]]:
    """A clock, s, of what is simulated in this context from now on."""
    own = Workload()
    token = _counted.set((*_counted.get(), own))
    try:
        yield lambda: own.seconds
    finally:
        _counted.reset(token)
