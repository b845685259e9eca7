"""A sampling command killed with SIGKILL in the middle, then resumed, ends as if undisturbed.

The long run, at every write and at random moments, is `python tests/benchmarks/kills.py`.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from kills import killed_and_resumed, run, state, unfinished
from small_rig import PLAIN, PLAIN_RELEASES, record

from bayesimpact.trial.rig.files import write_campaign

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], Path, int]:
    folder, out = tmp_path_factory.mktemp("campaign"), tmp_path_factory.mktemp("undisturbed")
    plain = record(seed=3, rig=PLAIN, releases=PLAIN_RELEASES[:1], duration=1.0)
    write_campaign(folder, plain)
    arguments = ["sample", str(folder), "--quiet"]
    code, said = run([*arguments, "--out", str(out)])
    assert code in (0, 3), said
    return arguments, out, int(said.split()[-1])


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_killed_at_a_write(
    undisturbed: tuple[list[str], Path, int], share: float, tmp_path: Path
) -> None:
    """Once while a block is written, once while the results are."""
    arguments, out, writes = undisturbed
    assert writes > 10
    assert killed_and_resumed(arguments, tmp_path, write=round(share * writes))
    assert state(tmp_path) == state(out)
    assert unfinished(tmp_path) == []
