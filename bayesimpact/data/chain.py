"""The measuring chain: [measurement] of campaign.toml, checked against the recordings."""

from __future__ import annotations

import math

from bayesimpact.data.campaign import Measurement, Smoothing
from bayesimpact.data.quantity import Quantity
from bayesimpact.data.recording import Recording
from bayesimpact.data.schema import CampaignTable, LagTable, MeasurementTable, UnfilteredTable
from bayesimpact.errors import InputError


def measurement_of(where: str, table: CampaignTable, recordings: list[Recording]) -> Measurement:
    """The [measurement] of a campaign of these recordings.

    Raises
    ------
    InputError
        for a noise level in a unit that is not theirs, and a filter that does not fit them; `where`
        names the file.
    """
    given = table.measurement
    return Measurement(
        noise=_noise(f"{where}, [measurement]", given, recordings),
        smoothing=_smoothing(f"{where}, [measurement], smoothing", given, recordings),
        mass_sd=table.mass_uncertainty_kg / table.mass_kg,
        clock_sd=given.clock_uncertainty_ppm * 1e-6,
        gain_sd=given.gain_uncertainty_percent * 1e-2,
        unfiltered=isinstance(given.smoothing, UnfilteredTable),
    )


def _noise(where: str, given: MeasurementTable, recordings: list[Recording]) -> float | None:
    scales: dict[Quantity, dict[str, float]] = {
        "displacement": {"noise_um": 1e-6},
        "angle": {"noise_mrad": 1e-3, "noise_deg": math.pi / 180.0},
    }
    levels = {key: getattr(given, key) for keys in scales.values() for key in keys}
    other = next((r.quantity for r in recordings if r.quantity not in scales), None)
    quantity = other or recordings[0].quantity
    levels = {key: level for key, level in levels.items() if level is not None}
    accepted = " or ".join(scales.get(quantity, ())) or "no noise level: it is estimated"
    if len(levels) > 1:
        raise InputError(f"{where}, key {list(levels)[1]}", " and ".join(levels), accepted)
    for key, level in levels.items():
        if key not in scales.get(quantity, ()):
            raise InputError(
                f"{where}, key {key}", f"a noise level for recordings of {quantity}", accepted
            )
        return float(level * scales[quantity][key])
    return None


def _smoothing(
    where: str, given: MeasurementTable, recordings: list[Recording]
) -> Smoothing | None:
    table = given.smoothing
    if table is None or isinstance(table, UnfilteredTable):
        return None
    if isinstance(table, LagTable):
        return Smoothing(kind="lag", time_constant=table.time_constant_s)
    window = table.window - 1 + table.window % 2
    shortest = min(recording.samples.size for recording in recordings)
    if window > shortest:
        raise InputError(
            f"{where}, key window",
            f"{table.window} samples",
            f"at most {shortest}, the shortest recording",
        )
    if table.polyorder >= window:
        raise InputError(
            f"{where}, key polyorder",
            f"{table.polyorder}",
            f"a whole number below {window}, the window",
        )
    return Smoothing(
        kind="savgol", window=window, polyorder=table.polyorder, declared_window=table.window
    )
