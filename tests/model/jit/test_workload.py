"""What is simulated as a clock: the same readings for the same work."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.extend import campaign_scales, extend
from bayesimpact.inference.identify import identify
from bayesimpact.model.jit.workload import PER_CALL, PER_SAMPLE, count, workload_counted

diagnose_module: Any = importlib.import_module("bayesimpact.diagnosis.diagnose")


def test_a_clock_counts_what_is_simulated_while_it_runs() -> None:
    count(10**9, "general")
    with workload_counted() as outer:
        count(100, "general")
        with workload_counted() as inner:
            count(50, "derivatives")
        count(100, "general")
    count(10**9, "general")
    own = PER_CALL + 50 * PER_SAMPLE["derivatives"]
    assert inner() == pytest.approx(own)
    assert outer() == pytest.approx(own + 2 * (PER_CALL + 100 * PER_SAMPLE["general"]))


@pytest.mark.parametrize("effects", [(), (BY_ID["quadratic_drag"],)])
def test_every_way_to_simulate_counts(effects: tuple[Any, ...]) -> None:
    """By the closed form and by the general law, with derivatives and without."""
    campaign = small_rig.record(5, duration=0.5)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    density = extend(fit, effects, campaign_scales(fit)) if effects else fit.density
    theta = np.concatenate([fit.mode, np.zeros(density.priors.lower.size - fit.mode.size)])
    steps = np.full(theta.size, 1e-6) if effects else None
    likelihood = density.likelihood
    for work in (density.oscillator.predict, lambda x: likelihood.linearise(x, steps)):
        with workload_counted() as first:
            work(theta)
        with workload_counted() as second:
            work(theta)
        assert first() == second() >= PER_CALL


def test_other_work_of_the_machine_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seconds of the processor, of this diagnosis, count only where they are far more than what is
    simulated takes.
    """
    seconds = iter([1000.0, 1000.0, 1100.0, 1600.0])
    monkeypatch.setattr(diagnose_module.time, "process_time", lambda: next(seconds))
    readings: list[float] = []

    def run(*arguments: Any) -> None:
        clock = arguments[-1]
        readings.append(clock())
        count(round(90.0 / PER_SAMPLE["general"]), "general")
        readings.extend([clock(), clock()])

    monkeypatch.setattr(diagnose_module, "_diagnosed", run)
    diagnose_module.diagnose(None, rng=np.random.default_rng(0))
    assert readings == pytest.approx([0.0, 90.0, 300.0], abs=0.1)
