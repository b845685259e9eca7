"""Bars for what takes long, in terminals and notebooks: steps, refits, and compiling."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from bayesimpact.inference.sampling.sample import Progress
from bayesimpact.model.jit.compiled import compilation_announced


class Refit(str):
    """What a search fits next, in words, and how many refits there have been with it."""

    number: int

    def __new__(cls, words: str, number: int) -> Refit:
        """Words that can be told as any others."""
        made = super().__new__(cls, words)
        made.number = number
        return made


@contextmanager
def progress_bar(shown: bool | None = None) -> Iterator[Callable[[Progress], None]]:
    """A bar of the sampler's kept steps on standard error; the block gets its callback.

    `shown` None: only where standard error is a terminal, or in a notebook.
    """
    bar = _bar(" steps", shown)

    def tell(where: Progress) -> None:
        bar.total, bar.n = where.max_steps, where.steps
        effective = "" if where.ess is None else f", {where.ess:.0f} effective draws"
        bar.set_description(f"sampling{', burn-in' if where.burning else effective}")

    try:
        yield tell
    finally:
        bar.close()


@contextmanager
def refit_bar(
    say: Callable[[str], None], shown: bool | None = None
) -> Iterator[Callable[[str], None]]:
    """What a diagnosis tells goes to `say`, but for its refits, which a bar counts and names.

    How many there will be nobody knows beforehand, so the bar has no end. `shown` as above; where
    no bar is shown, refits are told to `say` too.
    """
    bar = _bar(" refits", shown)

    def tell(words: str) -> None:
        if isinstance(words, Refit) and not bar.disable:
            bar.n = words.number
            bar.set_description_str(words)
        else:
            say(words)

    try:
        yield tell
    finally:
        bar.close()


@contextmanager
def compilation_shown(shown: bool | None = None, after: float = 1.0) -> Iterator[None]:
    """A line while something must be compiled for longer than `after` seconds; `shown` as above.

    The first call in a new installation compiles for a minute, which would else pass in silence.
    """
    bars: list[Any] = []

    def say(words: str) -> None:
        if bars:  # the end of what the last line told
            bars.pop().close()
        else:
            bars.append(_bar("", shown, bar_format="{desc}"))
            bars[0].set_description_str(words)

    with compilation_announced(say, after):
        try:
            yield
        finally:
            for bar in bars:
                bar.close()


def _bar(unit: str, shown: bool | None, **form: Any) -> Any:
    with warnings.catch_warnings():  # that a notebook could have finer bars
        warnings.simplefilter("ignore")
        from tqdm.auto import tqdm
    return tqdm(unit=unit, disable=None if shown is None else not shown, leave=False, **form)
