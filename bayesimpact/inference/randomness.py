"""Randomness as the library's functions take it: one integer or one generator."""

from __future__ import annotations

import numpy as np

from bayesimpact.errors import InputError

Random = int | np.random.Generator | None


def generator(seed: int | None, rng: Random) -> np.random.Generator:
    """The random generator of `seed=` or `rng=`; seed 0 where neither is given. InputError when
    both are.
    """
    if seed is not None and rng is not None:
        raise InputError("seed and rng", "both", "one of the two")
    if isinstance(rng, np.random.Generator):
        return rng
    chosen = rng if rng is not None else seed if seed is not None else 0
    if isinstance(chosen, bool) or not isinstance(chosen, (int, np.integer)) or chosen < 0:
        raise InputError(
            "seed" if rng is None else "rng", repr(chosen), "an integer from 0, or a generator"
        )
    return np.random.default_rng(int(chosen))
