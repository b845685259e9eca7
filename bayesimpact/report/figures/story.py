"""The finding in one picture: a cycle in which it shows, both models, and the force behind it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle as repeated

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import display, quantity, readable, significant
from bayesimpact.report.cycles import Cycle, before_predicted, contacts
from bayesimpact.report.diagnosis.effect_forces import effect_forces, shown_cycle
from bayesimpact.report.diagnosis.force_in_time import force_in_time
from bayesimpact.report.figures.force_map import force_unit
from bayesimpact.report.figures.style import (
    AFTER,
    BEFORE,
    BLACK,
    GREEN,
    GREY,
    PURPLE,
    SKY,
    Array,
    label,
    new_figure,
    response,
    response_word,
    styled,
)
from bayesimpact.report.results import Results

_CONTACT = "#ECECEC"
_PLAIN = 1000.0  # nats; beyond, odds say nothing that the residuals do not
_MARGIN = 0.25  # of the cycle, before it
_LINES = ((BLACK, "-"), (PURPLE, (0, (5, 2))), (GREEN, (0, (1, 1))))  # told apart in grey too


def story_figures(results: Results) -> Mapping[str, Figure]:
    """The picture of the first page; nothing where nothing was added to the base model."""
    before, cycle = before_predicted(results), shown_cycle(results)
    if before is None or cycle is None or (results.diagnosis or {}).get("verdict") == "adequate":
        return {}
    return {"story": _figure(results, cycle, before[cycle.recording])}


def best_gain(results: Results) -> str:
    """Recording and impact of the picture, in words."""
    cycle = shown_cycle(results)
    if cycle is None:
        return ""
    recording = results.recordings[cycle.recording]
    word = "cycle" if contacts(results, recording)[1] is None else "impact"
    return f"{recording.name}, {word} {cycle.number}"


@styled
def _figure(results: Results, cycle: Cycle, before: Array) -> Figure:
    recording = results.recordings[cycle.recording]
    first = max(0, cycle.first - round(_MARGIN * (cycle.last - cycle.first)))
    part = slice(first, cycle.last + 1)
    named = effect_forces(results, cycle.recording, part)
    left = None if named else force_in_time(results, cycle.recording, before)
    rows = 3 if named or left is not None else 2
    figure = new_figure(1.85 * rows + 0.6)
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    t = recording.times[part]
    for axis in panels:
        if cycle.leave > cycle.first:
            ends = recording.times[[cycle.first, cycle.leave]]
            axis.axvspan(*ends, color=_CONTACT, lw=0, zorder=0)
        axis.grid(axis="y")
    _motion(panels[0], results, t, recording.samples[part], before[part],
            recording.predicted[part])  # fmt: skip
    _difference(panels[1], results, t, recording.samples[part] - before[part],
                recording.predicted[part] - before[part])  # fmt: skip
    if named:
        _named(panels[2], results, t, named)
    elif left is not None:
        _unexplained(panels[2], results, t, left[0][part], left[1][part])
    panels[-1].set_xlabel(label("time since the first sample", "s"))
    panels[0].set_title(
        f"{best_gain(results)}: {_gain(results, cycle, before)}",
        loc="right",
    )
    panels[0].set_xlim(t[0], t[-1])
    return figure


def _gain(results: Results, cycle: Cycle, before: Array) -> str:
    """What the extended model gains in the cycle; where that is plain to see, as residuals."""
    if cycle.gain < _PLAIN:
        return f"the extended model gains {significant(cycle.gain, 2)} nats here"
    recording, part = results.recordings[cycle.recording], slice(cycle.first, cycle.last)
    sizes = [
        quantity(float(np.sqrt(np.mean((recording.samples - model)[part] ** 2))), recording.unit, 2)
        for model in (before, recording.predicted)
    ]
    return f"residual {sizes[0]} rms, with what was added {sizes[1]}"


def _legend(axis: Axes, columns: int = 4) -> None:
    """Above the panel, clear of the data, on the left: a narrow screen shows that side first."""
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.1)


def _motion(
    axis: Axes, results: Results, t: Array, samples: Array, before: Array, after: Array
) -> None:
    shown = response(results)
    axis.plot(t, samples * shown.scale, "o", mfc="none", mec=SKY, ms=5, label="recorded")
    axis.plot(t, before * shown.scale, color=BEFORE, lw=2.4, label="base model")
    axis.plot(t, after * shown.scale, color=AFTER, lw=1.0, label="with what was added")
    axis.set_ylabel(label(f"{response_word(results)}\n", shown.unit).replace("\n ", "\n"))
    _legend(axis)


def _difference(axis: Axes, results: Results, t: Array, samples: Array, after: Array) -> None:
    """Both relative to the base model: what was added has to pass through the recorded points."""
    shown = display(results.unit, float(np.sqrt(np.mean(samples**2))))
    axis.plot(t, samples * shown.scale, "o", color=SKY, ms=3.5, mew=0, label="recorded")
    width = max(3, 2 * (t.size // 24) + 1)
    mean = np.convolve(samples, np.full(width, 1 / width), "valid") * shown.scale
    inside = slice(width // 2, width // 2 + mean.size)
    axis.plot(t[inside], mean, color=GREY, lw=1.0, ls=(0, (4, 2)),
              label=f"recorded, mean of {width} samples")  # fmt: skip
    axis.plot(t, after * shown.scale, color=AFTER, lw=1.8, label="with what was added")
    axis.axhline(0.0, color=BEFORE, lw=1.8, label="base model")
    axis.set_ylabel(label("minus the base\nmodel", shown.unit))
    _legend(axis)


def _named(axis: Axes, results: Results, t: Array, forces: Mapping[str, Array]) -> None:
    """Where the named effects act: their forces at the values found."""
    size = max(float(np.max(np.abs(force))) for force in forces.values())
    unit = readable("N m" if results.angular else "N", size)
    for (title, force), (colour, dashes) in zip(forces.items(), repeated(_LINES), strict=False):
        axis.plot(t, force * unit.scale, color=colour, ls=dashes, lw=1.5, label=title)
    axis.axhline(0.0, color=GREY, lw=0.6)
    axis.set_ylabel(label("force of what\nwas named", unit.unit))
    _legend(axis, columns=2)


def _unexplained(axis: Axes, results: Results, t: Array, mean: Array, sd: Array) -> None:
    unit = force_unit(results, results.diagnosis_arrays)
    low, high = ((mean + sign * Z90 * sd) * unit.scale for sign in (-1, 1))
    axis.fill_between(t, low, high, color=BEFORE, alpha=0.3, lw=0, label="90 % band")
    axis.plot(t, mean * unit.scale, color=BEFORE, lw=1.4, label="posterior mean")
    axis.axhline(0.0, color=GREY, lw=0.6)
    axis.set_ylabel(label("unexplained\nforce", unit.unit))
    _legend(axis)
