"""Moves for narrow, strongly correlated, nearly Gaussian posteriors.

All are unbiased by test (`tests/inference/sampling/test_moves.py`). Not used, because emcee 3.1.6
ships them wrong: `DESnookerMove` (samples another distribution) and `GaussianMove` with a full
covariance (gives all walkers the same step).
"""

from __future__ import annotations

from emcee.moves import DEMove, StretchMove

from bayesimpact.inference.sampling.moves.counted import Counted
from bayesimpact.inference.sampling.moves.crank_nicolson import CrankNicolsonMove
from bayesimpact.inference.sampling.moves.independence import IndependenceMove
from bayesimpact.inference.sampling.moves.mixture import (
    FIRST_WEIGHTS,
    SHAPES,
    Frame,
    Mixture,
    log_student,
)

__all__ = [
    "FIRST_WEIGHTS",
    "MOVE_NAMES",
    "SHAPES",
    "Counted",
    "CrankNicolsonMove",
    "Frame",
    "IndependenceMove",
    "Mixture",
    "log_student",
    "move_set",
]

MOVE_NAMES = ("independence", "crank_nicolson", "de", "de_jump", "stretch")

# How the steps that are not independence proposals are shared out. Differential evolution (ter
# Braak 2006; Nelson et al. 2014) with gamma = 1 jumps between separate modes; the stretch move
# (Goodman & Weare 2010) is the fallback that assumes least.
_LOCAL_SHARES = (0.4, 0.35, 0.15, 0.1)


def move_set(mixture: Mixture, share: float) -> list[tuple[Counted, float]]:
    """The mixture of moves: emcee picks one of them for all walkers at every step.

    Parameters
    ----------
    mixture : the independence proposal; its last frame is the reference of the local steps
    share : share of independence proposals, in (0, 1)

    Returns
    -------
    (move, probability) in the order of `MOVE_NAMES`, for `emcee.EnsembleSampler(moves=...)`
    """
    moves = (
        IndependenceMove(mixture),
        CrankNicolsonMove(mixture.frames[-1]),
        DEMove(),
        DEMove(gamma0=1.0),
        StretchMove(),
    )
    shares = (share, *((1.0 - share) * local for local in _LOCAL_SHARES))
    return [
        (Counted(name, move), weight)
        for name, move, weight in zip(MOVE_NAMES, moves, shares, strict=True)
    ]
