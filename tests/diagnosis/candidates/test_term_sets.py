"""Sets of terms of a linear problem, against plain least squares."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.candidates.term_sets import EffectColumns, TermSets

DRAG, CUBIC, QUINTIC, HUM = (
    "quadratic_drag", "spring_cubic", "spring_quintic", "sensor_hum",
)  # fmt: skip
ROWS = 80


@pytest.fixture(scope="module")
def problem() -> tuple[TermSets, dict[str, np.ndarray], np.ndarray]:
    """A made-up problem, its terms' columns, and those of every set."""
    rng = np.random.default_rng(0)
    base = rng.standard_normal((ROWS, 2))
    cubic = rng.standard_normal((ROWS, 1))
    quintic = cubic + 0.2 * rng.standard_normal((ROWS, 1)) + base[:, :1]
    columns = {
        DRAG: rng.standard_normal((ROWS, 1)),
        CUBIC: cubic,
        QUINTIC: quintic,
        HUM: rng.standard_normal((ROWS, 2)) + 0.3 * cubic,
    }
    names = {i: tuple(f"{i}.{k}" for k in range(c.shape[1])) for i, c in columns.items()}
    terms = [
        EffectColumns(BY_ID[i], {}, names[i], (1e3 * c,), (False,) * c.shape[1])
        for i, c in columns.items()
    ]
    target = base @ [1.0, -2.0] + (3.0 * columns[DRAG] + 2.0 * cubic)[:, 0]
    target += 0.1 * rng.standard_normal(ROWS)
    return TermSets(terms, ("a", "b"), base, target, ROWS, 1.0), columns, base


def test_likeness_is_the_share_that_another_effect_explains(problem) -> None:
    found, columns, base = problem
    shares = found.likeness([DRAG], CUBIC)
    held = np.column_stack([base, columns[DRAG]])

    def beside(x: np.ndarray) -> np.ndarray:
        return x - held @ np.linalg.lstsq(held, x, rcond=None)[0]

    own = beside(columns[CUBIC])[:, 0]
    for name in (QUINTIC, HUM):
        other = beside(columns[name])
        left = own - other @ np.linalg.lstsq(other, own, rcond=None)[0]
        assert shares[name] == pytest.approx(1.0 - left @ left / (own @ own), abs=1e-6)
    assert shares[QUINTIC] > 0.9 > 0.5 > shares[HUM]
    assert set(shares) == {QUINTIC, HUM}
    assert found.likeness([DRAG], "coulomb_friction") == {}
