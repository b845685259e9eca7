"""How long a diagnosis may compute: one budget for all of its searches and stages."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

# s of computing from the first search of physics on, set by hand: no fit begins later; an answer
# that says so is worth more than none. Not of the clock: what else a machine does must not change
# an answer.
PATIENCE = 150.0
# s of a search's time that are kept for what its answer is compared with (each needed effect left
# out, with a residual force), set by hand: a search that used up all of it could name nothing.
COMPARISONS = 45.0
# Times as long as it takes to score what a model lacks, that are kept for them too: a forced run of
# 10,000 samples, scored in 7 s, took 150 s and was not done. No more than this share of the budget.
LOOKS, MOST_KEPT = 25.0, 0.6
# s that must be left for another search, set by hand: about what half of the strong campaigns take
# in all (tests/benchmarks/strong.json). One that begins with less would mostly end by its limit.
ANOTHER = COMPARISONS + 30.0


@dataclass(frozen=True)
class Budget:
    """Seconds of computing from one reading of a clock on.

    Attributes
    ----------
    clock : s, whatever it began at
    begun : its reading when the budget began
    seconds : that may be used
    """

    clock: Callable[[], float]
    begun: float
    seconds: float = PATIENCE

    @property
    def left(self) -> float:
        """Seconds that may still be used; negative once they are up."""
        return self.begun + self.seconds - self.clock()

    def may_go_on(self) -> bool:
        """Whether another fit may begin."""
        return self.left > 0.0

    def may_search_on(self, look: float = 0.0, more: float = 0.0) -> bool:
        """Whether another fit of a search may begin: time to compare its answer is kept.

        look : s that it takes to score what a model lacks
        more : s that what begins will take
        """
        return self.left - more > max(COMPARISONS, min(LOOKS * look, MOST_KEPT * self.seconds))

    def may_compare_on(self, look: float = 0.0) -> bool:
        """Whether another fit that an answer is compared with may begin: where models take long to
        be scored (`look`, s), also when the time is up, for an answer without tells nothing.
        """
        return self.left > -min(LOOKS * look, MOST_KEPT * self.seconds)

    def may_search_again(self) -> bool:
        """Whether another search may begin: with too little left it would compare too little."""
        return self.left >= ANOTHER


def begin(clock: Callable[[], float] = time.process_time, seconds: float = PATIENCE) -> Budget:
    """A budget that begins now."""
    return Budget(clock, clock(), seconds)
