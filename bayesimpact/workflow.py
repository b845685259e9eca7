"""What the commands do, as functions: from a campaign to a folder of results."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import set_aside
from bayesimpact.data.files import write_text
from bayesimpact.data.strict_json import strict
from bayesimpact.design.document import next_document
from bayesimpact.design.hypotheses import Rivalry, rivalry
from bayesimpact.design.rank import proposals
from bayesimpact.design.store import rivals_content, rivals_from
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.parametric_bootstrap import parametric_bootstrap
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.posterior import Posterior, sample
from bayesimpact.inference.progress import progress_bar, refit_bar
from bayesimpact.model.effects import EFFECTS, SEARCHED
from bayesimpact.model.effects.effect import Effect
from bayesimpact.report.archive import load_results
from bayesimpact.report.build import ReportContext, results_from_fit, versions
from bayesimpact.report.diagnosis.arrays import diagnosis_arrays
from bayesimpact.report.diagnosis.document import document
from bayesimpact.report.diagnosis.formula_entries import EFFECT_FILE, found_file
from bayesimpact.report.diagnosis.next_words import sentence
from bayesimpact.report.figures.save import reason
from bayesimpact.report.results import Results
from bayesimpact.report.write import Written, write_posterior, write_results

DIAGNOSIS_FILE = "diagnosis.json"
NEXT_FILE = "next.json"
KEPT_APART = ("hypotheses", "next")  # of a diagnosis: in the results, not in diagnosis.json
CHAIN_FOLDER = "chain"
MAX_STEPS = 20_000
LEARNED_STEPS = 300  # of a model with a learned force, whose many coefficients may mix slowly

Say = Callable[[str], None]


def silent(message: str) -> None:
    """Say nothing."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a command made.

    Attributes
    ----------
    results : everything the report shows
    converged : False when the search or the sampler did not
    diagnosis : the content of diagnosis.json, where there is one
    failed : parts of the report that could not be made, with their reasons
    """

    results: Results
    converged: bool
    diagnosis: dict[str, Any] | None = None
    failed: Mapping[str, str] = field(default_factory=dict)


def without_faults(campaign: Campaign, say: Say = silent) -> Campaign:
    """The campaign without the faults found in its recordings; each is told."""
    cleaned, faults = set_aside(campaign)
    for fault in faults:
        verb = "noticed" if fault.action == "notice" or campaign.keep_faults else "set aside"
        say(f"{verb}: {fault.recording}: {fault.statement} ({fault.id})")
    return cleaned


def fit_campaign(
    campaign: Campaign, out: Path, *, seed: int = 0, command: str = "", say: Say = silent
) -> Outcome:
    """Mode of the base model: fit.json, figures and report in `out`."""
    began = time.perf_counter()
    campaign = without_faults(campaign, say)
    say("searching the mode")
    identification = identify(campaign, rng=np.random.default_rng(seed))
    seconds = time.perf_counter() - began
    say("writing the report")
    context = ReportContext(command, seconds, seed)
    made = write_results(results_from_fit(identification, context), out)
    return Outcome(made.results, identification.fit.converged, failed=made.failed)


def sample_campaign(
    campaign: Campaign,
    out: Path,
    *,
    seed: int = 0,
    resume: bool = False,
    command: str = "",
    say: Say = silent,
    bar: bool | None = False,
) -> Outcome:
    """Posterior of the base model: posterior.nc, figures and report in `out`; the chain is kept in
    `out`/chain. `bar`: show the sampler's progress; None where standard error is a terminal.
    """
    began = time.perf_counter()
    campaign = without_faults(campaign, say)
    say("searching the mode")
    identification = identify(campaign, rng=np.random.default_rng(seed))
    posterior = sampled(identification, seed, out / CHAIN_FOLDER, resume, say, bar)
    seconds = time.perf_counter() - began
    say("writing the report")
    context = ReportContext(command, seconds)
    made = write_posterior(posterior, identification, out, context=context)
    converged = identification.fit.converged and posterior.chains.converged
    return Outcome(made.results, converged, failed=made.failed)


def sampled(
    identification: Identification,
    seed: int,
    folder: Path | None,
    resume: bool,
    say: Say,
    bar: bool | None = False,
) -> Posterior:
    """Posterior around the mode of an identification, with progress in words."""
    say("sampling the posterior")
    with progress_bar(bar) as callback:
        return sample(
            identification.fit,
            seed=seed,
            folder=folder,
            resume=resume,
            tell=say,
            callback=callback,
        )


def diagnose_campaign(
    campaign: Campaign,
    out: Path,
    *,
    seed: int = 0,
    quick: bool = False,
    certify: int = 0,
    resume: bool = False,
    effects: Sequence[Effect] = SEARCHED,
    command: str = "",
    say: Say = silent,
    bar: bool | None = False,
) -> Outcome:
    """The whole loop: diagnosis.json, posterior.nc, figures and report in `out`; the chains of both
    models are kept in `out`/chain.

    `effects`: what is looked for. `certify`: how often the loop is repeated on simulated campaigns
    of this design. `resume`: go on with the chains that `out` holds; the search, which has no
    randomness of its own, is repeated. `bar`: as in `sample_campaign`, of refits too.
    """
    began = time.perf_counter()
    rng = np.random.default_rng(seed)
    with refit_bar(say, bar) as tell:
        diagnosis = diagnose(campaign, rng=rng, search=not quick, effects=effects, progress=tell)
    before = after = None
    if not quick:
        say("sampling both models")
        chains = out / CHAIN_FOLDER
        with progress_bar(bar) as callback:
            kept: dict[str, Any] = {"seed": seed, "resume": resume, "tell": say}
            kept["callback"] = callback
            before = after = sample(diagnosis.before, folder=chains / "before", **kept)
            if diagnosis.after is not diagnosis.before:
                allowed = LEARNED_STEPS if diagnosis.verdict == "unknown" else MAX_STEPS
                after = sample(diagnosis.after, folder=chains / "after", max_steps=allowed, **kept)
    certified = None
    if certify:
        again = np.random.default_rng([seed, 1])
        with refit_bar(say, bar) as tell:
            certified = parametric_bootstrap(
                diagnosis, certify, rng=again, effects=effects, progress=tell
            )
    content = document(
        diagnosis,
        seed=seed,
        seconds=time.perf_counter() - began,
        versions=versions(),
        draws_before=None if before is None else before.draws,
        draws_after=None if after is None else after.draws,
        certified=certified,
    )
    say("writing the report")
    made = write_diagnosis(diagnosis, content, before, after, out, seed, command)
    sure = all(p is None or p.chains.converged for p in (before, after))
    return Outcome(made.results, diagnosis.after.converged and sure, content, made.failed)


def write_diagnosis(
    diagnosis: Diagnosis,
    content: dict[str, Any],
    before: Posterior | None,
    after: Posterior | None,
    out: Path,
    seed: int,
    command: str,
) -> Written:
    """diagnosis.json, results, figures and report of a diagnosis, sampled or not, in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    plain = strict(content)
    write_text(out / DIAGNOSIS_FILE, json.dumps(plain, indent=1))
    if diagnosis.formulas is not None:
        write_text(out / EFFECT_FILE, found_file(diagnosis.formulas))
    failed = {}
    try:
        arrays = diagnosis_arrays(diagnosis)
    except Exception as error:
        arrays, failed["arrays of the diagnosis' figures"] = {}, reason(error)
    try:
        kept, models = rivals_content(rivalry(diagnosis))
        arrays, plain = arrays | models, plain | {"hypotheses": strict(kept)}
    except Exception as error:
        failed["models for `bayesimpact next`"] = reason(error)
    context = ReportContext(command, float(content["seconds"]), seed, plain, arrays)
    if after is None:
        final = replace(diagnosis.identification, fit=diagnosis.after, search=None)
        return write_results(results_from_fit(final, context), out, failed)
    found = diagnosis.identification
    return write_posterior(after, found, out, before=before, context=context, failed=failed)


def next_recording(
    folder: Path, *, seed: int = 0, effects: Sequence[Effect] = (), say: Say = silent
) -> tuple[dict[str, Any], Written]:
    """Which recording would settle what a diagnosis left open: next.json, and the report anew.

    Parameters
    ----------
    folder : what `diagnose_campaign` wrote
    effects : of one's own, as for the diagnosis

    Returns
    -------
    The content of next.json, and what the folder holds now.

    Raises
    ------
    InputError : the folder holds no diagnosis, or its models have effects that are not known
    """
    results = load_results(folder)
    diagnosis = dict(results.diagnosis or {})
    rivals = _rivals(folder, results, (*EFFECTS, *effects))
    found = proposals(rivals, rng=np.random.default_rng(seed), progress=say)
    content = next_document(rivals, found, seed)
    content["sentence"] = sentence(content)
    old = (diagnosis.get("next") or {}).get("sentence", "")
    summary = str(diagnosis["summary"]).removesuffix(old).rstrip()
    diagnosis |= {"summary": f"{summary} {content['sentence']}".rstrip(), "next": strict(content)}
    say("writing the report")
    write_text(folder / NEXT_FILE, json.dumps(diagnosis["next"], indent=1))
    told = {k: v for k, v in diagnosis.items() if k not in KEPT_APART}
    write_text(folder / DIAGNOSIS_FILE, json.dumps(told, indent=1))
    return content, write_results(replace(results, diagnosis=diagnosis), folder)


def _rivals(folder: Path, results: Results, effects: Sequence[Effect]) -> Rivalry:
    """The models that the diagnosis of a folder left open."""
    accepted = "a folder that this version of `bayesimpact diagnose --out DIR` wrote"
    if results.diagnosis is None:
        raise InputError(str(folder), "results without a diagnosis", accepted)
    if "hypotheses" not in results.diagnosis:
        raise InputError(str(folder), "a diagnosis without its models", accepted)
    kept, arrays = results.diagnosis["hypotheses"], results.diagnosis_arrays
    try:
        return rivals_from(results.diagnosis["verdict"], kept, arrays, effects)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(str(folder), f"models that cannot be read ({error})", accepted) from None
