"""What `bayesimpact check` says: what was read, and what will be estimated."""

from __future__ import annotations

import numpy as np

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.faults.start import GROWTH
from bayesimpact.data.gaps import shown_period
from bayesimpact.data.recording import Recording
from bayesimpact.data.text_table import text_table
from bayesimpact.inference.noise.estimate import unfiltered_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.parameters import build_layout
from bayesimpact.model.units import quantity

BARS = "▁▂▃▄▅▆▇█"
COLUMNS = 40
# of an input, lost between its samples: an error that a gain cannot take up; a sine loses as much
# with 18 samples a period
WEAKENED = 0.01
LEFT = 2.0  # periods: after a release at least


def measured_noise(campaign: Campaign) -> Noise | None:
    """Noise as the recordings alone show it, whatever is stated; None where a filter hides it."""
    if campaign.measurement.smoothing is not None:
        return None
    first = campaign.recordings[0].quantity
    return unfiltered_noise([r for r in campaign.recordings if r.quantity == first])


def campaign_text(campaign: Campaign, noise: Noise | None) -> str:
    """Recordings, measuring chain, unknowns and priors, as lines for a terminal.

    `noise` is what `measured_noise` found.
    """
    angle = campaign.angular
    quantities = dict.fromkeys(r.quantity.replace("_", " ") for r in campaign.recordings)
    stop = f"stop, cases {', '.join(campaign.cases)}" if campaign.stop else "no stop"
    if SECOND_STOP in campaign.declared:
        stop = f"a stop on either side, cases {', '.join(campaign.cases)}"
    blocks = [
        f"{campaign.name}\n"
        f"{'inertia' if angle else 'mass'} {campaign.mass:g} {'kg m2' if angle else 'kg'}, {stop}, "
        f"recordings of {' and '.join(quantities)}, data {campaign.sha256[:12]}",
        _recordings_block(campaign),
        _chain_block(campaign, noise),
        _unknowns_block(campaign),
    ]
    if campaign.beams:
        rows = [f"  case {c}: {b.stiffness:.5g} N/m" for c, b in campaign.beams.items()]
        blocks.append("\n".join(["k2 from beam theory (3 E I / l^3)", *rows]))
    return "\n\n".join(blocks)


def campaign_warnings(campaign: Campaign, noise: Noise | None) -> list[str]:
    """What a user should know before trusting a fit of these recordings, their faults set aside."""
    warnings = list(campaign.doubts)
    stated = campaign.measurement.noise
    if stated is not None and noise is not None and not 1 / 1.5 < noise.level / stated < 1.5:
        warnings.append(
            f"noise is stated as {stated:.3g}, the recordings show about {noise.level:.3g} "
            f"{campaign.recordings[0].unit}"
        )
    smoothing = campaign.measurement.smoothing
    if smoothing is not None and smoothing.declared_window > smoothing.window:
        warnings.append(
            f"smoothing window {smoothing.declared_window} is even and taken as "
            f"{smoothing.window}, as MATLAB's smooth does"
        )
    for recording in campaign.recordings:
        found = _recording_warnings(recording, stop=campaign.stop)
        warnings += [f"{recording.name}: {text}" for text in found]
    return warnings


def _recording_warnings(recording: Recording, *, stop: bool) -> list[str]:
    period = shown_period(recording)
    assert period is not None  # load_campaign refuses recordings without one
    warnings = []
    per_period = period / recording.interval
    if per_period < 20:
        poorly = "contacts are" if stop else "what changes within one is"
        warnings.append(f"only {per_period:.0f} samples per period: {poorly} seen poorly")
    given = recording.input
    if given is not None and not given.band_limited and given.weakened > WEAKENED:
        warnings.append(
            f"lines between the samples of its input lose {100 * given.weakened:.2g} % of it: if "
            'it passed an anti-aliasing filter, set hold = "band_limited" in input'
        )
    if recording.duration < 5 * period:
        warnings.append(f"only {recording.duration / period:.1f} periods: damping is seen poorly")
    rest = np.median(recording.samples[recording.samples.size // 2 :])
    way = np.abs(recording.samples - rest)
    largest = int(np.argmax(way))
    late = largest * recording.interval
    grown = way[largest] > GROWTH * way[: int(per_period) + 1].max()  # by no beat of two modes
    if late > period and grown and recording.input is None:
        if late < recording.duration - LEFT * period:
            action = (
                "if the recording begins before the release, "
                f"set start_s = {recording.start + late:.6g}"
            )
        else:
            action = "the motion grows, as if something drove it"
        warnings.append(
            f"the largest excursion comes {late:.3g} s after the first sample: {action}"
        )
    return warnings


def _recordings_block(campaign: Campaign) -> str:
    units = list(dict.fromkeys(_shown(r)[1] for r in campaign.recordings))
    head = ["recording", "case", "samples", "Hz", "start s", "length s", "period s"]
    rows = [[*head, f"rest {' or '.join(units)}", "first", "largest", "decay"]]
    for r in campaign.recordings:
        scale, _ = _shown(r)
        period = shown_period(r)
        rest = _rest(r)
        shown = [rest, r.samples[0] - rest, np.abs(r.samples - rest).max()]
        numbers = [1 / r.interval, r.start, r.duration, period, *(x * scale for x in shown)]
        row = [r.name, r.case or "-", str(r.samples.size), *(f"{x:.4g}" for x in numbers)]
        rows.append([*row, envelope_bars(r)])
    remark = "(first and largest are counted from rest, the median of the readings)"
    scaled = [f"unit of {words}" for words in campaign.scaled]
    return "\n".join([*text_table(rows, left=(0, -1)), remark, *_inputs(campaign), *scaled])


def _rest(recording: Recording) -> float:
    """Reading about which a recording oscillates."""
    return float(np.median(recording.samples))


def _inputs(campaign: Campaign) -> list[str]:
    """A line per measured input."""
    lines = []
    for r in campaign.recordings:
        if r.input is not None:
            gain = "gain free" if r.input.free else "gain 1"
            unit = {"force_N": "N", "base_m": "m", "base_m_s2": "m/s2"}[r.input.kind]
            low, high = r.input.samples.min(), r.input.samples.max()
            lines.append(
                f"input of {r.name}: {r.input.label}, {low:.4g} to {high:.4g} {unit}, {gain}"
            )
    return lines


def _shown(recording: Recording) -> tuple[float, str]:
    """Factor and unit in which a terminal shows readings."""
    known = {"angle": (180 / np.pi, "deg"), "displacement": (1e3, "mm"), "velocity": (1e3, "mm/s")}
    return known.get(recording.quantity, (1.0, recording.unit))


def envelope_bars(recording: Recording) -> str:
    """Largest excursion in equal spans of time of a period or more, as a row of bars."""
    excursion = np.abs(recording.samples - _rest(recording))
    period = shown_period(recording) or recording.duration
    count = min(COLUMNS, max(1, int(recording.duration / period)))
    spans = np.array_split(excursion, count)
    heights = np.array([span.max() for span in spans]) / excursion.max()
    return "".join(BARS[int(h)] for h in np.ceil(heights * len(BARS)).clip(1) - 1)


def _chain_block(campaign: Campaign, noise: Noise | None) -> str:
    measurement, unit = campaign.measurement, campaign.recordings[0].unit
    levels = []
    if noise is not None:
        levels.append(f"{quantity(noise.level, unit)}, {noise.kind} (from the recordings alone)")
    if measurement.noise is not None:
        levels.append(f"{quantity(measurement.noise, unit)} (stated)")
    level = "; ".join(levels) or "estimated before the fit"
    smoothing = measurement.smoothing
    if smoothing is None:
        filtered = "none stated"
    elif smoothing.kind == "lag":
        filtered = f"first-order lag, time constant {smoothing.time_constant:g} s"
    else:
        filtered = f"Savitzky-Golay, window {smoothing.window} samples, order {smoothing.polyorder}"
    sds = {"mass": measurement.mass_sd, "clock": measurement.clock_sd, "gain": measurement.gain_sd}
    stated = ", ".join(f"{name} {sd:.3g}" for name, sd in sds.items() if sd) or "none stated"
    passed = [f"{r.name} {r.high_pass:g} Hz" for r in campaign.recordings if r.high_pass]
    lines = "\n".join(
        [
            "measuring chain",
            f"  raw noise             {level}",
            f"  smoothing             {filtered}",
            *([f"  high-pass             {', '.join(passed)}"] if passed else []),
            f"  relative uncertainty  {stated}",
        ]
    )
    return lines.replace("\N{NO-BREAK SPACE}", " ")  # terminals break lines where they like


def _unknowns_block(campaign: Campaign) -> str:
    parameters = build_layout(campaign).parameters
    families: dict[tuple[str, str], list[str]] = {}
    for parameter in parameters:
        key = (parameter.name.partition("[")[0], parameter.unit)
        families.setdefault(key, []).append(parameter.name)
    lines = [f"will be estimated: {len(parameters)} parameters"]
    for (_, unit), names in families.items():
        shown = ", ".join(names) if len(names) <= 4 else f"{names[0]} .. {names[-1]} ({len(names)})"
        lines.append(f"  {shown}  {unit}")
    lines.append("priors")
    for name, table in campaign.priors.items():
        values = ", ".join(f"{k} = {v:g}" for k, v in table.items() if k != "distribution")
        lines.append(f"  {name}: {table['distribution']}, {values}")
    lines.append("  wide defaults for " + ("the others" if campaign.priors else "all"))
    return "\n".join(lines)
