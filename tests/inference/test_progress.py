"""The sampler's bar: quiet where nobody looks, and always closed."""

from __future__ import annotations

import pytest

from bayesimpact.inference.progress import progress_bar
from bayesimpact.inference.sample import Progress

WHERE = Progress(burning=False, steps=50, max_steps=200, tau=3.0, ess=1234.4)


def test_it_tells_steps_and_effective_draws(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar(True) as tell:
        tell(WHERE)
    told = capsys.readouterr()
    assert "1234 effective draws" in told.err and "50/200" in told.err and told.out == ""


@pytest.mark.parametrize("shown", [False, None])
def test_it_is_quiet_where_there_is_no_terminal(
    shown: bool | None, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar(shown) as tell:
        tell(WHERE)
    assert capsys.readouterr().err == ""
