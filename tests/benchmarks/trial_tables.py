"""The evidence page's tables of blind trials."""

from __future__ import annotations

from benchmarks.tables import HERE, grid, stored

from bayesimpact.trial.score.summary import rate, rate_in_groups

NOISES = {"white": "white", "ar1": "AR(1)", "smoothed": "smoothed by a declared filter"}


def share(row: dict) -> str:
    """A rate with its interval."""
    low, high = row["interval"]
    return f"{row['hits']} of {row['of']} ({100 * low:.0f} to {100 * high:.0f} %)"


KINDS = {
    "control": "nothing concealed: called adequate",
    "single": "one effect: named",
    "pair": "two effects: both named",
    "outside": "a force outside the catalogue: called unknown",
}


def blind_table(name: str) -> str:
    """Blind trials: what the diagnosis said of what was concealed."""
    t = stored(name)
    low, high = t["settings"]["strength"]
    rows = [(words, share(t["right"][kind])) for kind, words in KINDS.items() if kind in t["right"]]
    rows += [
        ("a wrong name given with confidence, all of these", share(t["confident_wrong_names"])),
        ("right place", share(t["place"])),
        ("sizes inside their 90 % interval, where named", share(t["sizes_inside"])),
    ]
    first, last = t["seeds"]
    sizes = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    noises = len(t["by_noise"])
    foot = (
        f"{t['trials']} trials, seeds {first} to {last}; sizes of {sizes} detection "
        f"limits (a limit is five standard errors); {len(t['by_rig_kind'])} rigs, "
        f"{noises} kind{'s' * (noises > 1)} of noise; "
        f"median {t['seconds']['median']:.0f} s a diagnosis. "
        f"In brackets: 95 % interval. Commit {t['commit'][:7]}, {t['date']}."
    )
    return grid(("concealed", "answers"), rows, foot)


SINGLES = (
    ("singles_5",),
    ("singles_5_again", "singles_5_more"),
    ("singles_paper",),
    ("singles_paper_again",),
    ("singles_2",),
)


def together(rates: list[dict]) -> str:
    """The rate of several runs, with its interval."""
    if len(rates) == 1:
        return share(rates[0])
    return share(rate(sum(r["hits"] for r in rates), sum(r["of"] for r in rates)))


def sizes_inside(runs: list[dict]) -> str:
    """Sizes in their intervals; of several runs, those of one trial err together."""
    if len(runs) == 1:
        return share(runs[0]["sizes_inside"])
    found = [answer["sizes_inside"] for run in runs for answer in run["answers"]]
    return share(rate_in_groups([[True] * hits + [False] * (of - hits) for hits, of in found]))


def single_table() -> str:
    """Blind trials of one effect of fixed size each."""
    rows, feet = [], []
    for names in SINGLES:
        runs = [stored(name) for name in names]
        settings = runs[0]["settings"]
        assert all(run["settings"] == settings for run in runs)
        rig_kinds = settings["rig_kinds"]
        said = [answer["outcome"] for run in runs for answer in run["answers"]]
        wrong = [run["confident_wrong_names"] for run in runs]
        missed = said.count("missed")
        undecided = len(said) - said.count("named") - sum(w["hits"] for w in wrong) - missed
        rows.append(
            (
                f"{settings['strength'][0]:g} limits",
                f"{len(rig_kinds)} rigs" if len(rig_kinds) > 1 else f"the {rig_kinds[0]}'s",
                together([run["right"]["single"] for run in runs]),
                f"{undecided}",
                f"{missed}",
                together(wrong),
                together([run["place"] for run in runs]),
                sizes_inside(runs),
            )
        )
        feet.append(
            " and ".join(
                f"seeds {t['seeds'][0]} to {t['seeds'][1]}, commit {t['commit'][:7]}, {t['date']}"
                for t in runs
            )
        )
    head = (
        "size",
        "rig",
        "named",
        "undecided",
        "missed",
        "wrong name",
        "right place",
        "sizes inside",
    )
    return grid(head, rows, f"In brackets: 95 % interval. Runs: {'; '.join(feet)}.")


def trial_coverage_table() -> str:
    """Intervals before and after naming."""
    t = stored("trials")["coverage"]
    rows = [
        (name, share(t["concealed"][name]["before"]), share(t["named"][name]["after"]))
        for name in ("c1", "k1", "c2", "g", "k2")
    ]
    head = ("90 % intervals that hold the truth", "base model, something concealed", "after naming")
    return grid(head, rows, "From the same trials.")


def controls_table() -> str:
    """False alarms."""
    t = stored("controls")
    said = [(row["noise"], row["outcome"]) for row in t["answers"]]
    rows = [
        (words, f"{sum(s == (noise, 'quiet') for s in said)} of "
                f"{sum(kind == noise for kind, _ in said)}")
        for noise, words in NOISES.items()
    ]  # fmt: skip
    first, last = t["seeds"]
    foot = (
        f"All: {share(t['right']['control'])}; {len(t['by_rig_kind'])} rigs, seeds {first} to "
        f"{last}, commit {t['commit'][:7]}, {t['date']}. In brackets: 95 % interval."
    )
    return grid(("nothing missing, noise", "called adequate"), rows, foot)


def strong_table() -> str:
    """Several strong effects at once: what was said, and what holds whatever was said."""
    if not (HERE / "strong.json").exists():
        return "No run is stored yet."
    t = stored("strong")
    low, high = t["settings"]["misfit"]
    every = t["answers"]
    rows = [
        (words, share(t["right"][kind]))
        for kind, words in (
            ("several", "all in the catalogue: all named, and no other"),
            ("several_outside", "a force outside it as well: `partly` or `unknown`"),
        )
        if kind in t["right"]
    ]
    rows += [
        ("a wrong name, under `named` or `partly`", share(t["confident_wrong_names"])),
        ("`named` where something is left out", share(t["overconfident"])),
        ("fit worse after than before", share(t["worse"])),
        ("crashes, report and figures included", share(t["crashes"])),
    ]
    rows += [
        (f"90 % intervals of base parameters hold the truth, {verdict}", share(found))
        for verdict, found in t["inside_by_verdict"].items()
    ]
    first, last = t["seeds"]
    chosen = t["selection"]
    thrown = "; ".join(f"{n} because {why}" for why, n in chosen["thrown_away"].items())
    foot = (
        f"{len(every)} trials, seeds {first} to {last}: two to four effects, base misfit "
        f"{low:g} to {high:g} times the noise (median {chosen['misfit'][1]:.0f}), "
        f"{len(t['by_rig_kind'])} rigs; {chosen['resting']} begin before the release. "
        f"{chosen['kept']} of {chosen['draws']} draws were kept; thrown away: "
        f"{thrown or 'none'}. {how_long(t)} In brackets: "
        f"95 % interval. Commit {t['commit'][:7]}, {t['date']}."
    )
    return grid(("several effects at once", "trials or intervals"), rows, foot)


def how_long(t: dict) -> str:
    """Of the processor, for a diagnosis; where these were not counted, of the clock."""
    own = t.get("processor_seconds", {})
    if not own.get("count"):
        return f"Median {t['seconds']['median']:.0f} s a diagnosis by the clock."
    return (
        f"Median {own['median']:.0f} s of the processor a diagnosis, report included, upper "
        f"quartile {own['quartiles'][1]:.0f} s, largest {own['largest']:.0f} s."
    )


def next_table() -> str:
    """Ambiguous campaigns with one recording more: the one proposed, or a repeat."""
    if not (HERE / "next_recording.json").exists():
        return "No run is stored yet."
    t = stored("next_recording")
    rows = []
    for arm, words in (("next", "the first proposal"), ("repeat", "the best repeat")):
        found = t[arm]
        rows.append(
            (
                words,
                share(rate(found["settled"], t["ambiguous"])),
                str(found["right"]),
                f"{found['expected']:.1f}",
            )
        )
    s, k2 = t["slope"], t["narrowing"]
    foot = (
        f"{t['ambiguous']} ambiguous of {t['trials']} trials, seeds {t['seeds'][0]} to "
        f"{t['seeds'][1]}. ln odds obtained for the planted effect over its rivals against those "
        f"foretold: slope {s['value']:.2f} ± {s['se']:.2f} ({s['pairs']} pairs, "
        f"{s['beyond']} with more foretold than counts left out). Narrowing of k2, obtained over "
        f"foretold: median {k2['median']:.2f} of {k2['intervals']} intervals. Commit "
        f"{(t['commit'] or '?')[:7]}, {t['date']}."
    )
    return grid(("recorded next", "named then", "rightly", "foretold"), rows, foot)
