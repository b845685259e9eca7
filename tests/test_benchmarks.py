"""What the benchmarks rest on: peers that solve the same problem, records, slopes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks import (
    bundled,
    driven,
    driven_trials,
    figures,
    loops,
    next_recording,
    peers,
    readme,
    record,
    samplers,
    sampling,
    scaling,
)
from benchmarks.kernel import campaign, check
from benchmarks.record import stored
from benchmarks.sampling import Sampled

from bayesimpact.data.read import load_campaign
from bayesimpact.trial.draw.one_trial import draw

BENCHMARKS = Path(record.__file__).parent
MEASURED = ("added", "kernel", "loops", "peers", "samplers", "scaling", "startup")


@pytest.fixture(scope="module")
def problem() -> bundled.Problem:
    return bundled.problem()


@pytest.mark.long
def test_the_kernels_subjects_agree() -> None:
    check(*campaign(3, 500))


@pytest.mark.long
@pytest.mark.parametrize("recording", range(9))
def test_the_plain_recurrence_is_exact(recording: int) -> None:
    given = bundled.problem(recording)
    assert peers.error(peers.plain(given), given.exact()) < 1e-13


@pytest.mark.parametrize("name", peers.PEERS)
def test_a_peer_solves_the_same_problem(name: str, problem: bundled.Problem) -> None:
    """Looser tolerances are worse, and some tolerance is good enough."""
    module, library, method = peers.PEERS[name]
    pytest.importorskip(library)
    solver = __import__(f"benchmarks.{module}", fromlist=["solver"]).solver
    reference = problem.exact()
    loose, tight = (peers.error(solver(problem, method, t), reference) for t in (1e-7, 1e-12))
    assert tight <= peers.ACCURACY < loose


def test_the_fastest_of_the_accurate_is_chosen() -> None:
    def point(error: float, seconds: float) -> dict[str, float]:
        return {"error_m": error, "seconds": seconds}

    points = [point(1e-8, 1.0), point(9e-10, 3.0), point(1e-12, 2.0)]
    assert peers.fastest(points) == points[2]
    assert peers.fastest(points[:1]) is None


def test_the_gradient_for_nuts() -> None:
    """Value as the package has it; derivatives as differences have them."""
    fit = bundled.fit()
    both = sampling.with_gradient(fit)
    theta = fit.mode + 0.3 * fit.sd
    value, gradient = both(theta)
    assert value == pytest.approx(float(fit.density(theta)[0]), abs=1e-6)
    steps = np.diag(1e-3 * fit.sd)
    slopes = (fit.density(theta + steps) - fit.density(theta - steps)) / 2e-3
    np.testing.assert_allclose(gradient * fit.sd, slopes, atol=1e-4 * np.abs(slopes).max())


def sampled(shift: float = 0.0, stretch: float = 1.0) -> Sampled:
    rng = np.random.default_rng(0)
    draws = shift + stretch * rng.standard_normal((2, 50, 20, 3))
    return Sampled(*sampling.moments(draws), 2.0, 1, 4000, 60.0)


def test_moments_of_independent_draws() -> None:
    found = sampled()
    np.testing.assert_allclose(found.ess, 2000, rtol=0.25)
    np.testing.assert_allclose(found.mean_error, 1 / np.sqrt(2000), rtol=0.2)
    np.testing.assert_allclose(found.sd_error, 1 / np.sqrt(4000), rtol=0.2)


@pytest.mark.parametrize("wrong", [{"shift": 0.2}, {"stretch": 0.85}])
def test_a_sampler_that_disagrees_has_no_rate(wrong: dict[str, float]) -> None:
    good, bad = sampled(), sampled(**wrong)
    row = samplers.row(good, good, good)
    assert row["agrees"] and row["long_enough"]
    assert row["ess_per_s"] == pytest.approx(good.ess.min() / 2)
    row = samplers.row(bad, good, good)
    assert not row["agrees"] and row["ess_per_s"] is None and row["ours_over_this"] is None


def test_undamped_impacts() -> None:
    """Twice the time, twice the impacts; the plain recurrence finds the same motion."""
    (_, _, few), (q, rest, many) = (scaling.undamped(dt, True) for dt in (0.25e-3, 0.5e-3))
    assert abs(many - 2 * few) <= 1
    scaling.agrees(q, rest)
    assert scaling.undamped(0.5e-3, False)[2] == 0


def test_a_busy_machine_is_noticed() -> None:
    found = record.others(0.05)
    assert found is None or found >= 0.0
    result = {"machine": "M", "commit": "c", "date": "d"}
    assert "busy" not in readme.measured(result | {"others": 0.1}) + readme.measured(result)
    assert "1.3 of the cores busy" in readme.measured(result | {"others": 1.3})


def test_slope_and_rounds() -> None:
    assert record.slope([1, 10, 100], [3, 300, 30000]) == pytest.approx(2)
    calls = []
    taken = record.rounds({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3, 2)
    assert "".join(calls) == "ab" + 3 * "aabb"
    assert all(t.shape == (3,) and np.isfinite(t).all() for t in taken.values())


def test_a_record_says_where_it_comes_from(tmp_path: Path) -> None:
    record.keep(str(tmp_path / "some.py"), {"answer": 1.5}, ("numpy", "no_such_library"))
    content = json.loads((tmp_path / "some.json").read_text())
    assert tuple(content)[: len(record.FIELDS)] == record.FIELDS and content["answer"] == 1.5
    assert content["versions"] == {"numpy": np.__version__, "no_such_library": None}


@pytest.mark.parametrize("name", MEASURED)
def test_stored_results_say_where_they_come_from(name: str) -> None:
    content = readme.stored(name)
    assert all(content[field] for field in record.FIELDS)


def test_stored_peers_are_as_accurate_as_claimed() -> None:
    content = readme.stored("peers")
    errors = [row["error_m"] for name, row in content["peers"].items() if name != "ours"]
    assert max(errors) <= content["accuracy_m"] == 1e-9


def test_added_effects_are_as_accurate_as_claimed() -> None:
    content = readme.stored("added")
    assert max(row["halving_m"] for row in content["effects"].values()) < 1e-9


def test_stored_trials_are_counted_right() -> None:
    content = readme.stored("trials")
    rows = content["answers"]
    assert len(rows) == content["trials"] - len(content["failed"])
    right = {"control": "quiet", "single": "named", "pair": "named", "outside": "unknown outside"}
    for kind, outcome in right.items():
        of = [row for row in rows if row["kind"] == kind]
        hits = sum(row["outcome"] == outcome for row in of)
        assert (content["right"][kind]["hits"], content["right"][kind]["of"]) == (hits, len(of))
    wrong = sum(row["outcome"] == "wrong name" for row in rows)
    assert content["confident_wrong_names"]["hits"] == wrong
    for row in rows:
        if row["outcome"] == "named":
            assert set(row["named"].split(" + ")) == set(row["planted"])


ROWS = {
    "peers": lambda content: content["peers"],
    "added": lambda content: [e.replace("_", " ") for e in content["effects"]],
    "samplers": lambda content: [n for n, row in content["samplers"].items() if row["agrees"]],
    "trials": lambda content: [e.replace("_", " ") for e in content["settings"]["effects"]],
    "detection_power": lambda content: [e.replace("_", " ") for e in content["effects"]],
    "limits": lambda content: ["one over square root"],
}


@pytest.mark.parametrize("name", figures.FIGURES)
def test_figures_show_every_row(name: str) -> None:
    content = readme.stored(figures.STORES.get(name, name))
    figure = figures.FIGURES[name](content)
    legends = [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
    texts = [t.get_text() for a in figure.axes for t in a.get_yticklabels()]
    texts += [t.get_text() for legend in legends for t in legend.get_texts()]
    texts += [a.get_title(loc="left") for a in figure.axes]
    rows = ROWS[name](content)
    assert all(any(text.startswith(row) for text in texts) for row in rows)


@pytest.mark.long
def test_timed_diagnoses_are_of_nine_recordings_of_6000_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drawn without the force, whose size takes four simulations of them all to find."""
    monkeypatch.setattr(loops, "draw", lambda s, seed: draw(replace(s, kinds=("control",)), seed))
    for folder in (*loops.BUNDLED.values(), loops.outside("friction_pad", tmp_path / "outside")):
        counts = [r.samples.size for r in load_campaign(folder).recordings]
        assert len(counts) == 9 and min(counts) >= 6000


def test_a_timed_diagnosis_says_the_same_every_time() -> None:
    runs = [(30.0, 50.0, "unknown"), (33.0, 52.0, "unknown"), (31.0, 51.0, "unknown")]
    found = loops.summary(runs)
    assert (found["s"], found["slowest_s"], found["processor_s"]) == (31.0, 33.0, 51.0)
    with pytest.raises(AssertionError):
        loops.summary([*runs, (30.0, 50.0, "named")])


def test_a_long_driven_recording_is_timed_at_its_mode() -> None:
    found = driven.measure(4096, count=1, repeats=1)
    for key in ("stop", "no_stop"):
        assert all(found[key][time] > 0.0 for time in ("mode_s", "driven_us", "floor_us"))


def test_what_a_run_has_finished_is_not_made_again(tmp_path):
    file = tmp_path / "7.json"
    made = []

    def make():
        made.append(file.exists())
        return {"seed": 7}

    assert stored(file, make) == stored(file, make) == {"seed": 7}
    assert made == [False] and [f.name for f in tmp_path.iterdir()] == ["7.json"]


def test_driven_trials_are_counted() -> None:
    rows = [
        {"seed": 3, "kind": "noise", "truth": None, "verdict": "adequate", "named": []},
        {"seed": 4, "kind": "sweep", "truth": None, "verdict": "named", "named": ["spring_cubic"]},
        {"seed": 5, "kind": "sweep", "truth": "spring_cubic", "verdict": "named",
         "named": ["spring_cubic"], "inside": True},
        {"seed": 6, "kind": "noise", "truth": "spring_cubic", "verdict": "ambiguous", "named": []},
        {"seed": 7, "kind": "noise", "truth": "spring_cubic", "verdict": "named",
         "named": ["quadratic_drag"]},
    ]  # fmt: skip
    found = driven_trials.summary(rows)
    counts = {k: (v["hits"], v["of"]) for k, v in found["kinds"]["all"].items()}
    assert counts == {"adequate": (1, 2), "named": (1, 3), "wrong": (2, 5), "inside": (1, 1)}
    assert found["kinds"]["noise"]["named"]["of"] == 2 and found["seeds"] == [3, 7]


def test_a_limit_of_a_driven_rig_is_the_spread_of_refits() -> None:
    """The standard error of a planted size, against the sizes that fits of other noise find."""
    id = "spring_cubic"
    hidden = driven_trials.HIDDEN[id]
    rig = driven_trials.driven_rig(0, "displacement", kind="noise")
    gap = rig.truth["g"]
    size = hidden.nominal({**rig.truth, "mass": rig.campaign.mass, "k2": rig.truth["k2[1]"]})
    rig = driven_trials.driven_rig(
        0, "displacement", driven_trials.law(hidden, size, gap), kind="noise"
    )
    expected = driven_trials.standard_error(rig, id, size)
    (effect,) = (e for e in driven_trials.EFFECTS if e.id == id)
    (recording,) = rig.campaign.recordings
    made = driven_trials.build_oscillator(rig.campaign, [effect])
    names = made.layout.names
    truth = {**rig.truth, f"{id}.{hidden.parameter}": size, "sigma": rig.noise}
    theta = np.array([truth[name] for name in names])
    (clean,) = made.predict(theta)
    steps = 1e-5 * np.maximum(np.abs(theta), [1e-3 if n[:2] in ("y0", "v0") else 0 for n in names])
    likelihood = driven_trials.Likelihood(made, driven_trials.Noise())
    (part,) = likelihood.linearise(theta, steps)
    rng, found = np.random.default_rng(0), []
    scale = np.linalg.norm(part.jacobian, axis=0)
    for _ in range(400):  # least squares in the linear range
        drawn = rig.noise * rng.standard_normal(recording.samples.size)
        found.append(np.linalg.lstsq(part.jacobian / scale, drawn, rcond=None)[0] / scale)
    at = list(part.columns).index(made.layout.index(f"{id}.{hidden.parameter}"))
    assert np.std(np.array(found)[:, at]) == pytest.approx(expected, rel=0.15)
    assert np.std(recording.samples - clean) == pytest.approx(rig.noise, rel=0.1)


def proposed(after: list[float | None], verdict: str, named: list[str]) -> dict:
    """One arm: of three rivals the second was planted; it led by 1 and -2 nats."""
    odds = [[0.0, 9.0, 9.0], [4.0, 0.0, 8.0], [9.0, 9.0, 0.0]]
    return {
        "odds": odds, "chance": 0.75, "verdict": verdict, "effects": named, "after": after,
        "halves": {"k2[1]": [2.0, 1.0, 1.0]},
    }  # fmt: skip


def test_what_proposals_settled_is_counted() -> None:
    row = {
        "seed": 7, "verdict": "ambiguous", "truth": "b", "ids": [["a"], ["b"], []],
        "lo": [3.0, 4.0, 6.0],
        "arms": {
            "next": proposed([1.0, 7.0, None], "named", ["b"]),
            "repeat": proposed([3.0, 6.0, 0.0], "named", ["a"]),
        },
    }  # fmt: skip
    rows = [{"seed": 5, "verdict": "named", "truth": "a"}, row]
    pairs = next_recording.pairs([row])
    assert pairs.tolist() == [[4.0, 5.0], [4.0, 2.0], [8.0, 8.0]]
    found = next_recording.summary(rows)
    assert (found["trials"], found["ambiguous"], found["seeds"]) == (2, 1, [5, 7])
    assert found["next"] == {"settled": 1, "right": 1, "expected": 0.75}
    assert found["repeat"]["settled"] == 1 and found["repeat"]["right"] == 0
    assert found["narrowing"] == {"median": pytest.approx(1.0), "intervals": 2}
    assert found["slope"]["value"] == pytest.approx((5 + 2 + 8) / (4 + 4 + 8))
