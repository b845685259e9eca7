"""What `import bayesimpact as bi` offers: the main steps with few arguments.

Randomness is one argument everywhere: `seed=` an integer, or `rng=` a NumPy generator; seed 0 where
neither is given, so that the same call gives the same result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis import loop
from bayesimpact.found import Diagnosis, Identification, Posterior
from bayesimpact.inference import identify as identification
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.progress import compilation_shown, progress_bar, refit_bar
from bayesimpact.inference.randomness import Random, generator
from bayesimpact.inference.search import Generation

if TYPE_CHECKING:
    from bayesimpact.model.effects import Effect
    from bayesimpact.report.results import Results


def fit(
    campaign: Campaign,
    *,
    seed: int | None = None,
    rng: Random = None,
    search: bool = True,
    evaluations: int | None = None,
    noise: Noise | None = None,
    sigma_per_recording: bool = False,
    known: Mapping[str, float] | None = None,
    callback: Callable[[Generation], None] | None = None,
) -> Identification:
    """Mode of the base model's posterior for a campaign, nothing given.

    Parameters
    ----------
    campaign : of `bi.load`
    seed, rng : randomness; see the module
    search : False leaves the global search for the mode out
    evaluations : of that search; None: as many as its dimension asks for
    noise : None estimates it from the recordings
    sigma_per_recording : a noise level of its own for every recording
    known : values of parameters from which to begin, where the campaign declares effects
    callback : called after every generation of the global search

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    with compilation_shown():
        return Identification.of(
            identify(
                campaign,
                rng=generator(seed, rng),
                search=search,
                evaluations=evaluations,
                noise=noise,
                sigma_per_recording=sigma_per_recording,
                known=known,
                callback=callback,
            )
        )


def sample(
    found: identification.Identification | loop.Diagnosis | Fit,
    *,
    seed: int | None = None,
    rng: Random = None,
    folder: Path | str | None = None,
    resume: bool = False,
    progress: bool | None = None,
    walkers: int | None = None,
    ensembles: int = 2,
    max_steps: int = 20_000,
    target_ess: float = 2000.0,
) -> Posterior:
    """Posterior around a mode, by emcee.

    Parameters
    ----------
    found : what `bi.fit` or `bi.diagnose` returned (of a diagnosis, the extended model)
    seed, rng : randomness; see the module
    folder, resume : where the chain is kept, and whether to go on with it
    progress : show a bar; None: when standard error is a terminal
    walkers : of every ensemble, an even number; None: as many as the parameters ask for
    ensembles : independent ones, two or more
    max_steps : allowance of steps of every ensemble
    target_ess : effective sample size demanded of every parameter
    """
    from bayesimpact.inference import posterior

    mode = found.after if isinstance(found, loop.Diagnosis) else found
    mode = mode.fit if isinstance(mode, identification.Identification) else mode
    source = generator(seed, rng)
    number = seed or 0 if rng is None else int(source.integers(2**31))
    place = None if folder is None else Path(folder)
    with compilation_shown(progress), progress_bar(progress) as callback:
        drawn = posterior.sample(
            mode,
            seed=number,
            folder=place,
            resume=resume,
            callback=callback,
            walkers=walkers,
            ensembles=ensembles,
            max_steps=max_steps,
            target_ess=target_ess,
        )
    return Posterior.of(drawn)


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
        found = diagnosed(
            campaign, rng=generator(seed, rng), effects=chosen, search=search, progress=tell
        )
    return Diagnosis.of(found)


def open_results(folder: Path | str) -> Results:
    """What a command or `bi.save` wrote into a folder; InputError when it holds no results."""
    from bayesimpact.report.archive import load_results

    return load_results(folder)
