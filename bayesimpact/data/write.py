"""Writes a campaign as the folder that `load_campaign` reads: campaign.toml and one CSV each."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from bayesimpact.data.campaign import SECOND_STOP, Beam, Campaign, Measurement, Smoothing
from bayesimpact.data.gaps import excluded, runs
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.data.toml_text import one_line, toml
from bayesimpact.errors import InputError

INPUT_COLUMN = "input"
LONGEST = 200  # bytes of a recording's name that becomes a file's; file systems allow 255 in all
_UNUSABLE = re.compile(r'[*?:<>|"\\]')  # patterns, and what some file systems refuse


def write_campaign(
    folder: Path, campaign: Campaign, *, decimals: int | None = 6, comment: str = ""
) -> None:
    """Write `campaign` into `folder`, which is made when missing; files of the same names go.

    Parameters
    ----------
    decimals : of a millimetre (or of a milliradian) in the recordings; None: every digit, in SI, as
        always for velocities and accelerations
    comment : first lines of campaign.toml, without the #
    """
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [f"# {one_line(note)}" for note in campaign.notes]
    lines += [f"name = {toml(campaign.name)}", f"mass_kg = {toml(float(campaign.mass))}"]
    if campaign.measurement.mass_sd:
        sd = float(campaign.measurement.mass_sd * campaign.mass)
        lines.append(f"mass_uncertainty_kg = {toml(sd)}")
    stop = "two-sided" if SECOND_STOP in campaign.declared else campaign.stop
    lines.append(f"stop = {toml(stop)}")
    if campaign.keep_faults:
        lines.append('faults = "keep"')
    for number, recording in enumerate(campaign.recordings, 1):
        file = _file_name(recording.name, number)
        lines += ["", "[[recording]]", *_named(recording.name, file)]
        if campaign.stop:
            lines.append(f"case = {toml(recording.case)}")
        if recording.motion_name:
            lines.append(f"motion = {toml(recording.motion_name)}")
        if recording.free_gain:
            lines.append('gain = "free"')
        if recording.high_pass:
            lines.append(f"high_pass_hz = {toml(float(recording.high_pass))}")
        if recording.input is not None:
            lines.append(f"input = {toml(_input(recording.input))}")
        if recording.used is not None:
            lines.append(excluded(recording, runs(~recording.used)))
        (folder / file).write_text(_csv(recording, decimals), encoding="utf-8", newline="\n")
    for number, (name, reason) in enumerate(campaign.skipped.items(), len(campaign.recordings) + 1):
        lines += ["", "[[recording]]", *_named(name, _file_name(name, number))]
        lines.append(f"skip = {toml(reason)}")
    lines += _measurement(campaign.measurement, campaign.recordings[0].quantity)
    if campaign.priors:
        lines += ["", "[priors]"]
        lines += [f"{toml(k)} = {toml(table)}" for k, table in campaign.priors.items()]
    for case, beam in campaign.beams.items():
        lines += ["", f"[beam.{toml(case)}]", *_beam(beam)]
    text = "\n".join(lines) + "\n"
    (folder / "campaign.toml").write_text(text, encoding="utf-8", newline="\n")


def _file_name(name: str, number: int) -> str:
    """The recording's name as a file's, or a number where no file may be called so."""
    plain = name.isprintable() and not _UNUSABLE.search(name) and len(name.encode()) <= LONGEST
    return f"{name}.csv" if plain else f"recording-{number}.csv"


def _named(name: str, file: str) -> list[str]:
    own = [] if Path(file).stem == name else [f"name = {toml(name)}"]
    return [f"file = {toml(file)}", *own]


def _csv(recording: Recording, decimals: int | None) -> str:
    times = recording.start + recording.times
    if decimals is None or recording.order > 0:
        header = f"time_s,{recording.quantity}_{recording.unit.replace('/', '_')}"
        columns = [list(map(repr, x.tolist())) for x in (times, recording.samples)]
    else:
        scale, places = (1.0, decimals + 3) if recording.angular else (1e3, decimals)
        header = "time_s,angle_rad" if recording.angular else "time_s,displacement_mm"
        columns = [[f"{t:.12g}" for t in times.tolist()]]
        columns.append([f"{x * scale:.{places}f}" for x in recording.samples.tolist()])
    if recording.input is not None:
        header += f",{INPUT_COLUMN}"
        columns.append(list(map(repr, recording.input.samples.tolist())))
    return "\n".join([header, *map(",".join, zip(*columns, strict=True))]) + "\n"


def _input(given: Input) -> dict[str, Any]:
    free = {"gain": "free"} if given.free else {}
    hold = {"hold": "first_order"} if given.lines_stated else {}
    hold = {"hold": "band_limited"} if given.band_limited else hold
    absolute = {"absolute": True} if given.absolute else {}
    return {"column": INPUT_COLUMN, "kind": given.kind, **free, **hold, **absolute}


def _measurement(known: Measurement, quantity: str) -> list[str]:
    lines = []
    if known.noise is not None:
        unit = "um" if quantity == "displacement" else "mrad"
        scale = 1e6 if quantity == "displacement" else 1e3
        lines.append(f"noise_{unit} = {_short(known.noise * scale)}")
    if known.unfiltered:
        lines.append('smoothing = "none"')
    if known.smoothing is not None:
        lines.append(f"smoothing = {toml(_smoothing(known.smoothing))}")
    if known.clock_sd:
        lines.append(f"clock_uncertainty_ppm = {_short(known.clock_sd * 1e6)}")
    if known.gain_sd:
        lines.append(f"gain_uncertainty_percent = {_short(known.gain_sd * 100)}")
    return ["", "[measurement]", *lines] if lines else []


def _smoothing(smoothing: Smoothing) -> dict[str, Any]:
    if smoothing.kind == "lag":
        return {"kind": "lag", "time_constant_s": smoothing.time_constant}
    return {
        "kind": "savgol",
        "window": smoothing.declared_window or smoothing.window,
        "polyorder": smoothing.polyorder,
    }


def save_campaign(campaign: Campaign, folder: Path, *, overwrite: bool) -> Path:
    """`Campaign.save`."""
    file = folder / "campaign.toml"
    if file.exists() and not overwrite:
        raise InputError(str(file), "a campaign already", "a new folder, or overwrite=True")
    try:
        write_campaign(folder, campaign, decimals=None)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(str(folder), reason, "a folder that can be written") from None
    return file


def _beam(beam: Beam) -> list[str]:
    return [
        f"length_mm = {_short(beam.length * 1e3)}",
        f"width_mm = {_short(beam.width * 1e3)}",
        f"thickness_mm = {_short(beam.thickness * 1e3)}",
        f"youngs_modulus_mpa = {_short(beam.youngs_modulus * 1e-6)}",
    ]


def _short(value: float) -> str:
    """A number without the rounding dirt of a change of units."""
    return repr(float(f"{value:.14g}"))
