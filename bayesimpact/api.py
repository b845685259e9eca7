"""What `import bayesimpact as bi` offers: the main steps with few arguments.

Randomness is one argument everywhere: `seed=` an integer, or `rng=` a NumPy generator; seed 0 where
neither is given, so that the same call gives the same result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.errors import InputError
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.posterior import Posterior
from bayesimpact.inference.progress import compilation_shown, progress_bar, refit_bar

if TYPE_CHECKING:
    from pandas import DataFrame

    from bayesimpact.model.effects import Effect
    from bayesimpact.report.results import Results

Random = int | np.random.Generator | None


def generator(seed: int | None, rng: Random) -> np.random.Generator:
    """The random generator of `seed=` or `rng=`; InputError when both are given."""
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


def fit(
    campaign: Campaign, *, seed: int | None = None, rng: Random = None, **settings: Any
) -> Identification:
    """Mode of the base model's posterior for a campaign, nothing given.

    Parameters
    ----------
    campaign : of `bi.load`
    seed, rng : randomness; see the module
    settings : `search=False` leaves the global search out; others as in `inference.identify`

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    with compilation_shown():
        return identify(campaign, rng=generator(seed, rng), **settings)


def sample(
    found: Identification | Diagnosis | Fit,
    *,
    seed: int | None = None,
    rng: Random = None,
    folder: Path | str | None = None,
    resume: bool = False,
    progress: bool | None = None,
    **settings: Any,
) -> Posterior:
    """Posterior around a mode, by emcee.

    Parameters
    ----------
    found : what `bi.fit` or `bi.diagnose` returned (of a diagnosis, the extended model)
    seed, rng : randomness; see the module
    folder, resume : where the chain is kept, and whether to go on with it
    progress : show a bar; None: when standard error is a terminal
    settings : as in `inference.sample.sample_posterior`
    """
    from bayesimpact.inference import posterior

    mode = found.after if isinstance(found, Diagnosis) else found
    mode = mode.fit if isinstance(mode, Identification) else mode
    number = int(generator(seed, rng).integers(2**31)) if rng is not None else seed or 0
    place = None if folder is None else Path(folder)
    with compilation_shown(progress), progress_bar(progress) as callback:
        return posterior.sample(
            mode, seed=number, folder=place, resume=resume, callback=callback, **settings
        )


def diagnose(
    campaign: Campaign,
    *,
    seed: int | None = None,
    rng: Random = None,
    effects: Sequence[Effect] | Path | str | None = None,
    search: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """What the base model leaves out of a campaign.

    Parameters
    ----------
    campaign : of `bi.load`
    seed, rng : randomness; see the module
    effects : what to look for, as (*bi.SEARCHED, mine); or a file that defines effects of one's
        own, which is executed: they are looked for beside the catalogue. None: what the catalogue
        looks for by default, `bi.SEARCHED`
    search : False leaves the global search for the base model's mode out
    progress : called with every step in words; None: a bar counts the refits of the search where
        standard error is a terminal

    Raises
    ------
    InputError : an effect of one's own cannot be used; with the file, the line and the reason
    """
    from bayesimpact.diagnosis.diagnose import diagnose as diagnosed
    from bayesimpact.model.own_effects import catalogue_with, check_effects

    if effects is None or isinstance(effects, Path | str):
        chosen = catalogue_with(effects or ())
    else:
        chosen = tuple(effects)
        check_effects(chosen)
    shown = None if progress is None else False
    with compilation_shown(), refit_bar(progress or (lambda words: None), shown) as tell:
        return diagnosed(
            campaign, rng=generator(seed, rng), effects=chosen, search=search, progress=tell
        )


def summary(found: Identification | Posterior | Results | Diagnosis) -> DataFrame:
    """Estimates of every parameter in lab units, as a DataFrame indexed by name.

    Columns: estimate (median; mode of a fit), low and high (90 %), unit, meaning. Of a diagnosis:
    of the extended model, with the intervals of its report.
    """
    import pandas

    from bayesimpact.model.units import readable
    from bayesimpact.report.results import Results

    wider = found.intervals if isinstance(found, Diagnosis) else None
    if isinstance(found, Diagnosis):
        found = replace(found.identification, fit=found.after)
    results = found if isinstance(found, Results) else _results(found)
    rows = {}
    for row in results.rows:
        shown = readable(row.unit, abs(row.median))
        known = wider.quantiles(row.name) if wider and row.name in wider.names else None
        low, median, high = known or (row.ci90[0], row.median, row.ci90[1])
        values = (shown.scale * x for x in (median, low, high))
        rows[row.name] = (*values, shown.unit, row.meaning)
    columns = ["estimate", "low", "high", "unit", "meaning"]
    return pandas.DataFrame.from_dict(rows, orient="index", columns=columns)


def save(found: Identification | Posterior | Diagnosis, folder: Path | str) -> Path:
    """Write results, figures and report.html into a folder, made if absent; path of the page.

    The report is that of the commands (of a diagnosis: that of `diagnose --quick`).
    """
    from bayesimpact.report.write import REPORT_FILE, write_results

    out = Path(folder)
    if isinstance(found, Diagnosis):
        from bayesimpact.diagnosis.document import document
        from bayesimpact.report.build import versions
        from bayesimpact.workflow import write_diagnosis

        content = document(found, seed=0, seconds=float("nan"), versions=versions())
        write_diagnosis(found, content, None, None, out, 0, "")
    else:
        write_results(_results(found), out)
    return out / REPORT_FILE


def open_results(folder: Path | str) -> Results:
    """What a command or `bi.save` wrote into a folder; InputError when it holds no results."""
    from bayesimpact.report.archive import load_results

    return load_results(folder)


def _results(found: Identification | Posterior) -> Results:
    from bayesimpact.report.build import results_from_fit, results_from_posterior

    if isinstance(found, Posterior):
        return results_from_posterior(found)
    return results_from_fit(found)
