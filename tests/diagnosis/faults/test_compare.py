"""One recording that disagrees with the others: which it is, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults import compare
from bayesimpact.diagnosis.faults.alone import SharedModel, fit_alone
from bayesimpact.diagnosis.faults.compare import Compared, base_failed, compare_recordings
from bayesimpact.diagnosis.faults.correct import _words
from bayesimpact.diagnosis.faults.together import Hypothesis, Weighed
from bayesimpact.inference.identify import identify
from bayesimpact.trial.bundle import PAPER_RIG, paper_releases
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Rig, record

SECONDS = 2.0
ODD = 3  # case2_a among case1_a, 1_b, 1_c, 2_a, 2_b, 3_a
Change = Callable[[Recording], Recording]


@pytest.fixture(scope="module")
def paper() -> Campaign:
    campaign = load_campaign(bundled_campaign("paper")).truncated(SECONDS)
    chosen = tuple(campaign.recordings[i] for i in (0, 1, 2, 3, 4, 6))
    return replace(campaign, recordings=chosen)


def changed(campaign: Campaign, change: Change, *numbers: int) -> Campaign:
    recordings = list(campaign.recordings)
    for number in numbers or (ODD,):
        recordings[number] = change(recordings[number])
    return replace(campaign, recordings=tuple(recordings))


def compared(campaign: Campaign) -> tuple[Compared, ...]:
    found = identify(campaign, rng=np.random.default_rng(0), search=False)
    return compare_recordings(found.fit, SharedModel(found.noise))


def only(campaign: Campaign) -> Compared:
    found = compared(campaign)
    assert [f.fault.recording for f in found] == ["case2_a"]
    assert found[0].after < 1.05 < found[0].before
    return found[0]


def scaled(by: float) -> Change:
    return lambda r: replace(r, samples=r.samples * by)


def test_recordings_that_agree_have_no_fault(paper: Campaign) -> None:
    assert compared(paper) == ()


def test_a_gain(paper: Campaign) -> None:
    found = only(changed(paper, scaled(1.05)))
    assert found.fault.id == "recording_gain"
    assert found.fault.size == pytest.approx(5.0, abs=0.1)
    factor = float(found.fault.remedy.removeprefix("scale = "))
    assert factor == pytest.approx(1 / 1.05, rel=1e-3)
    assert "gap of its own" in found.fault.statement
    samples = found.campaign.recordings[ODD].samples
    np.testing.assert_allclose(samples, paper.recordings[ODD].samples, rtol=1e-3)


def test_a_unit(paper: Campaign) -> None:
    found = only(changed(paper, scaled(1e3)))
    assert (found.fault.id, found.fault.remedy) == ("recording_gain", "scale = 0.001")


def test_errors_of_a_recording_alone_do_not_depend_on_its_unit(paper: Campaign) -> None:
    """Its noise is as many times larger as its motion: the noise that its fit leaves tells."""
    noise = identify(paper, rng=np.random.default_rng(0), search=False).noise
    one, other = (
        fit_alone(paper, scaled(by)(paper.recordings[ODD]), SharedModel(noise)) for by in (1.0, 1e3)
    )
    assert one is not None and other is not None
    first, second = (np.sqrt(np.diag(a.covariance)) for a in (one, other))
    np.testing.assert_allclose(first, second, rtol=0.1)


def test_a_clock(paper: Campaign) -> None:
    found = only(changed(paper, lambda r: replace(r, interval=r.interval * 1.005)))
    assert found.fault.id == "recording_clock"
    ratio = float(found.fault.remedy.removeprefix("clock_ratio = "))
    assert ratio == pytest.approx(1 / 1.005, abs=3e-4)


def test_a_wrong_label(paper: Campaign) -> None:
    found = only(changed(paper, lambda r: replace(r, case="3")))
    assert (found.fault.id, found.fault.remedy) == ("recording_case", 'case = "2"')
    assert found.campaign.recordings[ODD].case == "2"


@pytest.mark.parametrize("numbers", [(0, ODD)])
def test_reversed_signs(paper: Campaign, numbers: tuple[int, ...]) -> None:
    found = compared(changed(paper, scaled(-1.0), *numbers))
    names = [paper.recordings[i].name for i in numbers]
    assert [(f.fault.id, f.fault.recording) for f in found] == [
        ("recording_reversed", n) for n in names
    ]
    assert found[-1].after < 1.05
    assert {f.fault.remedy for f in found} == {"invert = true"}


def test_a_stop_on_the_other_side_of_all(paper: Campaign) -> None:
    campaign = changed(paper, scaled(-1.0), *range(6))
    identification = identify(campaign, rng=np.random.default_rng(0), search=False)
    assert base_failed(identification.fit)
    found = compare_recordings(identification.fit, SharedModel(identification.noise))
    assert len(found) == 6
    assert all("stop lies on the negative side" in f.fault.statement for f in found)
    right = identify(found[-1].campaign, rng=np.random.default_rng(0), search=False)
    assert not base_failed(right.fit)


def from_rig(rig: Rig, number: int) -> Change:
    rng = np.random.default_rng(7)
    release = paper_releases(rng)[number]
    samples = record(rig, release, {}, MeasuringChain(5e-6), rate=1000.0, duration=SECONDS, rng=rng)
    return lambda r: replace(r, samples=samples)


@pytest.mark.parametrize(("what", "by"), [("k1", 1.008), ("k2", 1.05)])
def test_another_rig(paper: Campaign, what: str, by: float) -> None:
    k2 = {**PAPER_RIG.k2, "2": by * PAPER_RIG.k2["2"]}
    rig = replace(PAPER_RIG, **({"k2": k2} if what == "k2" else {what: by * PAPER_RIG.k1}))
    (found,) = compared(changed(paper, from_rig(rig, ODD)))
    assert found.after < 1.05 < found.before
    name = found.fault.recording
    # two recordings tell of one stop: which of them is the other one is a toss
    assert name in (("case2_a", "case2_b") if what == "k2" else ("case2_a",))
    assert found.fault.id == "recording_other_rig"
    assert f"its {what} is" in found.fault.statement
    share = by if name == "case2_a" else 1 / by
    assert found.fault.size == pytest.approx(100 * (share - 1), rel=0.05)
    assert name not in [r.name for r in found.campaign.recordings]


def test_a_sensor_that_was_put_on_is_a_mass_and_no_clock(paper: Campaign) -> None:
    """All parameters over the mass are less: stiffnesses as under a clock, dampings twice that."""
    rig = replace(PAPER_RIG, mass=1.02 * PAPER_RIG.mass)
    found = only(changed(paper, from_rig(rig, ODD)))
    assert found.fault.id == "recording_other_rig"
    assert "its mass is +2.0" in found.fault.statement
    assert found.fault.size == pytest.approx(2.0, abs=0.1)
    assert "case2_a" not in [r.name for r in found.campaign.recordings]


def test_two_of_six_from_other_rigs(paper: Campaign) -> None:
    """A third of the recordings as they were given, not of those that are left."""
    softer, stiffer = (replace(PAPER_RIG, k1=by * PAPER_RIG.k1) for by in (0.97, 1.03))
    both = changed(changed(paper, from_rig(softer, ODD), ODD), from_rig(stiffer, 1), 1)
    found = compared(both)
    assert {f.fault.recording for f in found} == {"case2_a", "case1_b"}
    assert {f.fault.id for f in found} == {"recording_other_rig"}


@pytest.mark.parametrize("count", [2, -3])
def test_samples_missing_at_a_turning_point(paper: Campaign, count: int) -> None:
    """The motion hardly moves there: no jump, but all that follows is out of phase."""
    x = paper.recordings[ODD].samples
    middle = x.size // 3
    turn = middle + int(np.argmin(x[middle : middle + 60]))  # the turning point away from the stop
    moved = np.concatenate([x[:turn], x[turn + count :]])
    found = only(changed(paper, lambda r: replace(r, samples=moved)))
    assert (found.fault.id, found.fault.size) == ("recording_slip", abs(count))
    assert ("lost" in found.fault.statement) == (count > 0)
    place = paper.recordings[ODD].start + turn * paper.recordings[ODD].interval
    assert found.fault.start_s - 0.003 <= place <= found.fault.end_s + 0.003
    corrected = found.campaign.recordings[ODD]
    assert corrected.samples.size == pytest.approx(max(turn, x.size - turn), abs=12)


@pytest.mark.parametrize(("own", "together", "first", "others"), [
    ((50.0, 90.0, 55.0), (100.0, 200.0, 90.0), [1], [2, 0]),  # the worst one stands for all
    ((50.0, 90.0, 65.0), (100.0, 200.0, 90.0), [1, 2], [0]),  # and those nearly as bad
    ((50.0, 300.0, 60.0), (100.0, 400.0, 90.0), [1], [2, 0]),  # worse than the others
    ((50.0, 90.0, 60.0), (250.0, 200.0, 300.0), [2, 0], [1]),  # not together with them
    ((3.0, 90.0, 2.0), (5.0, 100.0, 4.0), [1], []),  # those that fit are in no doubt
    ((3.0, 2.0, 2.0), (5.0, 9.0, 4.0), [], []),
])  # fmt: skip
def test_which_recordings_the_other_sign_is_tried_of_first(
    paper: Campaign, own: tuple[float, ...], together: tuple[float, ...],
    first: list[int], others: list[int],
) -> None:  # fmt: skip
    campaign = replace(paper, recordings=paper.recordings[:3])
    names = [r.name for r in campaign.recordings]
    alone = {n: SimpleNamespace(reduced_chi2=x) for n, x in zip(names, own, strict=True)}
    noise, sizes = SimpleNamespace(level=2.0), np.full(3, 10.0)
    density = SimpleNamespace(likelihood=SimpleNamespace(noise=noise, sizes=sizes))
    fit = SimpleNamespace(sums=40.0 * np.array(together), density=density)
    assert compare._doubted(campaign, alone, fit) == (first, others)


def test_a_difference_has_the_digits_of_its_error() -> None:
    gain = Weighed(Hypothesis("recording_gain", 0), 0.0, value=np.log(1.0199), sd=1.5e-4)
    clock = Weighed(Hypothesis("recording_clock", 0), 0.0, value=np.log(0.998), sd=6.1e-6)
    assert "+1.990 % ± 0.015 % off" in _words(gain)[0]
    assert "\N{MINUS SIGN}0.20000 % ± 0.00061 % off" in _words(clock)[0]
