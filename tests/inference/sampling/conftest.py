"""One run that nobody interrupts."""

from __future__ import annotations

import pytest
from sampling import Interrupted, small


@pytest.fixture(scope="module")
def uninterrupted():
    return small(Interrupted())
