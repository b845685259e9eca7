"""Gauss-Newton step of initial states and rest readings, for many parameter vectors at once.

Every recording has its own three, so that the normal equations fall into blocks; channels of one
motion share the state, and their blocks are added up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

RIDGE = 1e-9  # of the scaled blocks, for what a recording does not tell


def nuisance_step(theta: Array, columns: Index, blocks: Array, right: Array) -> Array:
    """Theta (B, d) moved by one step.

    Parameters
    ----------
    columns : (R, 3) where the nuisances of every recording stand in theta
    blocks, right : (B, R, 3, 3) and (B, R, 3), J'J and J'r of every recording
    """
    places, at = np.unique(columns, return_inverse=True)
    if places.size < columns.size:
        blocks, right = _joined(places.size, at.reshape(columns.shape), blocks, right)
        columns = places[None]
    scale = np.sqrt(np.maximum(np.einsum("brii->bri", blocks), 1e-300))
    scaled = blocks / (scale[..., :, None] * scale[..., None, :])
    scaled = scaled + RIDGE * np.eye(columns.shape[1])
    move = np.linalg.solve(scaled, (right / scale)[..., None])[..., 0] / scale
    moved = theta.copy()
    moved[:, columns] += move
    return moved


def _joined(size: int, at: Index, blocks: Array, right: Array) -> tuple[Array, Array]:
    """The normal equations of all nuisances in one block, (B, 1, m, m) and (B, 1, m)."""
    matrix, vector = np.zeros((len(blocks), 1, size, size)), np.zeros((len(blocks), 1, size))
    for r, own in enumerate(at):
        matrix[:, 0, own[:, None], own] += blocks[:, r]
        vector[:, 0, own] += right[:, r]
    return matrix, vector
