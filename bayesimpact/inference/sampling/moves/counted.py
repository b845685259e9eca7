"""A move that counts its proposals and acceptances."""

from __future__ import annotations

from typing import Any

import numpy as np
from emcee.moves.move import Move
from numpy.typing import NDArray


class Counted(Move):  # type: ignore[misc]
    """Passes everything on to another move and keeps the tally.

    emcee counts acceptances per walker, not per move; how well the independence proposal fits is
    what decides its share.

    Attributes
    ----------
    name : of the move, for reports
    proposed, accepted : walkers so far
    """

    def __init__(self, name: str, move: Move) -> None:
        self.name = name
        self.move = move
        self.proposed = 0
        self.accepted = 0

    def propose(self, model: Any, state: Any) -> tuple[Any, NDArray[np.bool_]]:
        """See `emcee.moves.Move`."""
        state, accepted = self.move.propose(model, state)
        self.proposed += accepted.size
        self.accepted += int(accepted.sum())
        return state, accepted
