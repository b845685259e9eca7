"""The face of the package: one argument for randomness, names that lead somewhere."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest

import bayesimpact as bi
from bayesimpact.errors import InputError
from bayesimpact.inference.randomness import generator


def test_version() -> None:
    assert bi.__version__ == version("bayesimpact")


def test_python_m_is_the_command() -> None:
    command = [sys.executable, "-m", "bayesimpact", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"bayesimpact, version {version('bayesimpact')}"


def test_seed_and_rng_are_the_same_randomness() -> None:
    expected = np.random.default_rng(7).random(3)
    assert np.array_equal(generator(7, None).random(3), expected)
    assert np.array_equal(generator(None, 7).random(3), expected)
    assert np.array_equal(generator(None, np.random.default_rng(7)).random(3), expected)
    assert np.array_equal(generator(None, None).random(3), np.random.default_rng(0).random(3))


@pytest.mark.parametrize(
    ("seed", "rng"), [(1, 1), (-1, None), (0.5, None), (None, "x"), (True, None)]
)
def test_bad_randomness_is_refused(seed: object, rng: object) -> None:
    with pytest.raises(InputError, match=r"^(seed|rng)"):
        generator(seed, rng)  # type: ignore[arg-type]
