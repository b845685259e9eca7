"""Results as every reader of JSON takes them: no NaN, no infinity, no types of NumPy's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def strict(content: Any) -> Any:
    """Content as strict JSON has it: arrays as lists, NumPy's numbers as plain ones, and null for
    those that are not finite.
    """
    if isinstance(content, Mapping):
        return {str(k): strict(v) for k, v in content.items()}
    if isinstance(content, np.ndarray | np.generic):
        content = content.tolist()
    if isinstance(content, list | tuple):
        return [strict(v) for v in content]
    return None if isinstance(content, float) and not np.isfinite(content) else content
