"""A bar for the sampler's progress, in terminals and notebooks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bayesimpact.inference.sample import Progress


@contextmanager
def progress_bar(shown: bool | None = None) -> Iterator[Callable[[Progress], None]]:
    """A bar of the sampler's kept steps on standard error; the block gets its callback.

    `shown` None: only where standard error is a terminal, or in a notebook.
    """
    from tqdm.auto import tqdm

    bar = tqdm(unit=" steps", disable=None if shown is None else not shown, leave=False)

    def tell(where: Progress) -> None:
        bar.total, bar.n = where.max_steps, where.steps
        effective = "" if where.ess is None else f", {where.ess:.0f} effective draws"
        bar.set_description(f"sampling{', burn-in' if where.burning else effective}")

    try:
        yield tell
    finally:
        bar.close()
