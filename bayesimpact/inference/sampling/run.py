"""A sampling run in progress: burn-in rounds, then kept blocks with frozen proposals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.sampling.ensemble import (
    DrawBlock,
    Snapshot,
    WhitenedDensity,
    acceptance,
    adapt,
    advance,
    pack,
    unpack,
)
from bayesimpact.inference.sampling.moves import MOVE_NAMES

Array = NDArray[np.float64]

STORED_STEPS = 1000  # per ensemble; beyond, every other stored step is dropped
# Rounds of burn-in: how many are enough depends on how often the independence proposals of the last
# one were accepted in the ensemble that accepts least.
_FEW_ROUNDS, _GOOD = 2, 0.7
_ROUNDS = 3
_MOST_ROUNDS, _POOR = 7, 0.15


class Trace:
    """Kept draws of all ensembles, thinned by powers of two so that memory stays bounded.

    Which steps are stored depends on the number of steps alone, not on how it came about.
    """

    def __init__(self) -> None:
        self.steps = 0
        self.thin = 1
        self.parts: list[tuple[NDArray[np.int64], Array, Array]] = []

    def add(self, numbers: NDArray[np.int64], draws: Array, values: Array, steps: int) -> None:
        """Step numbers (n,), draws (E, n, W, d), log posteriors (E, n, W); steps they end at."""
        self.steps = steps
        thin = self.thin
        while steps // self.thin > STORED_STEPS:
            self.thin *= 2
        self.parts.append((numbers, draws, values))
        first = 0 if self.thin > thin else len(self.parts) - 1
        for k in range(first, len(self.parts)):
            numbers, draws, values = self.parts[k]
            stored = numbers % self.thin == 0
            if not stored.all():
                self.parts[k] = (numbers[stored], draws[:, stored], values[:, stored])

    def arrays(self) -> tuple[Array, Array]:
        """(E, stored, W, d) draws and (E, stored, W) log posteriors."""
        return (
            np.concatenate([part[1] for part in self.parts], axis=1),
            np.concatenate([part[2] for part in self.parts], axis=1),
        )


class Run:
    """A run in progress: the snapshots, what is kept so far, and the block counter."""

    def __init__(self, target: WhitenedDensity, snapshots: list[Snapshot], block: int) -> None:
        self.target = target
        self.snapshots = snapshots
        self.block = block
        self.index = 0
        self.rounds = 0
        self.burn_in = 0
        self.burning = True
        self.trace = Trace()
        self.tally = np.zeros((len(snapshots), len(MOVE_NAMES), 2), dtype=np.int64)

    def next_block(self) -> dict[str, NDArray[Any]]:
        """Advances all ensembles by one block; returns what has to be saved of it."""
        steps = self._round_length() if self.burning else self.block
        moved = [advance(snapshot, self.target, steps) for snapshot in self.snapshots]
        stretches = [stretch for _, stretch in moved]
        self.snapshots = [snapshot for snapshot, _ in moved]
        tally = np.stack([stretch.tally for stretch in stretches])
        if self.burning:
            self.snapshots = [
                adapt(snapshot, stretch)
                for snapshot, stretch in zip(self.snapshots, stretches, strict=True)
            ]
            content: dict[str, NDArray[Any]] = {"burn_in": np.array(steps)}
        else:
            content = self._keep(stretches)
        content |= {"tally": tally, **pack(self.snapshots)}
        self._count(content)
        return content

    def load(self, content: dict[str, NDArray[Any]]) -> None:
        """Takes a saved block as if it had just been run."""
        self.snapshots = unpack(content)
        if "numbers" in content:
            self.trace.add(
                content["numbers"],
                content["draws"],
                content["log_posterior"],
                int(content["steps"]),
            )
        self._count(content)

    def _keep(self, stretches: list[DrawBlock]) -> dict[str, NDArray[Any]]:
        before = self.trace.steps
        numbers = np.arange(before + 1, before + len(stretches[0].draws) + 1)
        draws = np.stack([stretch.draws for stretch in stretches])
        values = np.stack([stretch.log_posterior for stretch in stretches])
        self.trace.add(numbers, draws, values, int(numbers[-1]))
        names = ("numbers", "draws", "log_posterior")
        content = dict(zip(names, self.trace.parts[-1], strict=True))
        return content | {"steps": np.array(self.trace.steps)}

    def _count(self, content: dict[str, NDArray[Any]]) -> None:
        self.index += 1
        if not self.burning:
            self.tally += content["tally"]
            return
        self.rounds += 1
        self.burn_in += int(content["burn_in"])
        accepted = min(acceptance(tally) for tally in content["tally"])
        enough = _ROUNDS
        if accepted >= _GOOD:
            enough = _FEW_ROUNDS
        elif accepted < _POOR:
            enough = _MOST_ROUNDS
        self.burning = self.rounds < enough

    def _round_length(self) -> int:
        if self.rounds < _FEW_ROUNDS:
            return self.block // 2
        return self.block << (self.rounds - _FEW_ROUNDS)

    def due(self) -> bool:
        """Is it time to look? After 1, 2, 3, ... then every fifth part more blocks."""
        blocks, look = self.trace.steps // self.block, 1
        while look < blocks:
            look = max(look + 1, int(1.2 * look))
        return not self.burning and look == blocks
