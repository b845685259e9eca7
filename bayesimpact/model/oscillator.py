"""A campaign under a model: from parameter vectors to what the probe would have read.

Without added forces the exact closed-form simulator runs; with them the general one. Either way the
chain of measurement (sensor effects, rest offset, smoothing) follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.short_repr import short_repr
from bayesimpact.model import measurement
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.exact.arguments import Inputs
from bayesimpact.model.law_table import LAW_COLUMNS, law_row
from bayesimpact.model.motions import general_motions, motions
from bayesimpact.model.parameters import (
    BASE_SLOTS,
    GAIN,
    HIGH_PASS_STATE,
    SLOTS,
    WITHOUT,
    Layout,
    build_layout,
    declared_effects,
    instance_name,
)

Array = NDArray[np.float64]
_OFFSET = SLOTS.index("offset")


@dataclass(frozen=True, eq=False)
class Oscillator:
    """The base oscillator of a campaign, with any number of effects added.

    Attributes
    ----------
    campaign, effects : what is simulated: the effects come beside those that the campaign declares
    layout : names of the unknowns and where they enter
    smoothing : filter of the measuring chain through which simulations pass, or None
    """

    campaign: Campaign
    effects: tuple[Effect, ...]
    layout: Layout
    smoothing: Smoothing | None = None

    __repr__ = short_repr

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: addresses of compiled laws mean nothing in another process."""
        return {name: value for name, value in self.__dict__.items() if name != "laws"}

    @cached_property
    def acting(self) -> tuple[Effect, ...]:
        """All effects: those that the campaign declares, then the added ones."""
        return (*declared_effects(self.campaign), *self.effects)

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Samples of every recording, (R,)."""
        return np.array([r.samples.size for r in self.campaign.recordings], dtype=np.int64)

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First sample of every recording in the concatenated samples, (R,)."""
        return np.concatenate([[0], np.cumsum(self.counts)[:-1]]).astype(np.int64)

    @cached_property
    def intervals(self) -> Array:
        """Sampling intervals, (R,), s."""
        return np.array([r.interval for r in self.campaign.recordings])

    @cached_property
    def orders(self) -> NDArray[np.int64]:
        """Which time derivative of the displacement every recording holds, (R,)."""
        return np.array([r.order for r in self.campaign.recordings], dtype=np.int64)

    @cached_property
    def reads_displacements(self) -> bool:
        """True when every recording says where the oscillator is."""
        return all(r.is_displacement for r in self.campaign.recordings)

    @cached_property
    def samples(self) -> Array:
        """All recordings one after another, (N,), each in its own SI unit."""
        return np.concatenate([r.samples for r in self.campaign.recordings])

    @cached_property
    def inputs(self) -> Inputs | None:
        """Measured inputs for a gain of 1; None when no recording has any."""
        recordings = self.campaign.recordings
        if all(r.input is None for r in recordings):
            return None
        parts, starts, total = [], [], 0
        for r in recordings:
            starts.append(-1 if r.input is None else total)
            if r.input is not None:
                parts.append(r.input.waves(self.campaign.mass, r.interval, r.order))
                total += r.samples.size
        return Inputs(np.concatenate(parts, axis=1), np.array(starts, dtype=np.int64))

    @cached_property
    def is_whole(self) -> bool:
        """True when no sample of any recording is set aside."""
        return all(r.used is None for r in self.campaign.recordings)

    @cached_property
    def laws(self) -> NDArray[np.int64]:
        """Table of force laws for the general simulator, (L, LAW_COLUMNS)."""
        rows, first = [], len(SLOTS)
        for effect in self.acting:
            if effect.law is not None:
                own = [first + i for i, p in enumerate(effect.parameters) if p.initial]
                rows.append(law_row(effect.law, first, *own))
                first += len(effect.parameters)
        return np.array(rows, dtype=np.int64).reshape(-1, LAW_COLUMNS)

    @cached_property
    def is_base(self) -> bool:
        """True when every recording is a base oscillator (with parameters of its own, perhaps)."""
        added = slice(len(BASE_SLOTS), len(SLOTS))
        idle = np.array([WITHOUT.get(slot, 0.0) for slot in SLOTS[added]])
        return (
            self.laws.shape[0] == 0
            and bool(np.all(self.layout.columns[:, added] < 0))
            and bool(np.all(self.layout.constants[:, added] == idle))
        )

    @cached_property
    def sensors(self) -> tuple[tuple[Effect, NDArray[np.int64]], ...]:
        """Effects of the probe with the (R, n_p) positions of their parameters in theta."""
        found = []
        for effect in self.acting:
            if effect.observe is not None:
                rows = [
                    [
                        self.layout.index(
                            instance_name(
                                effect,
                                p,
                                {"campaign": None, "case": r.case, "recording": r.name}[p.scope],
                            )
                        )
                        for p in effect.parameters
                    ]
                    for r in self.campaign.recordings
                ]
                found.append((effect, np.array(rows, dtype=np.int64)))
        return tuple(found)

    @cached_property
    def gains(self) -> NDArray[np.int64]:
        """Position in theta of every probe's gain, (R,); -1 where it is 1."""
        return self._positions(GAIN)

    @cached_property
    def high_pass_states(self) -> NDArray[np.int64]:
        """Position in theta of what every recording's high-pass had settled on, (R,); -1 for none.

        Whose corner that is: `Recording.high_pass`.
        """
        return self._positions(HIGH_PASS_STATE)

    def _positions(self, nuisance: str) -> NDArray[np.int64]:
        """Positions in theta of a nuisance that not every recording has, (R,), or -1."""
        positions = {name: i for i, name in enumerate(self.layout.names)}
        names = [f"{nuisance}[{r.name}]" for r in self.campaign.recordings]
        return np.array([positions.get(name, -1) for name in names], dtype=np.int64)

    def settled_on(self, r: int, theta: Array) -> float:
        """What the high-pass of recording `r` had settled on for parameters (d,); 0 without one."""
        own = self.high_pass_states[r]
        return float(theta[own]) if own >= 0 else 0.0

    def recording_columns(self, r: int) -> NDArray[np.int64]:
        """Positions in theta of everything that recording `r` depends on, sorted, (k,)."""
        used = [self.layout.columns[r][self.layout.columns[r] >= 0]]
        used += [positions[r] for _, positions in self.sensors]
        used += [own[r : r + 1] for own in (self.gains, self.high_pass_states) if own[r] >= 0]
        return np.unique(np.concatenate(used))

    @property
    def is_plain(self) -> bool:
        """True when predictions are the base simulator's plus the offset, and nothing else."""
        nuisances = np.concatenate([self.gains, self.high_pass_states])
        measured = not self.sensors and self.smoothing is None and bool(np.all(nuisances < 0))
        return self.is_base and measured

    def predict(self, theta: Array) -> tuple[Array, ...]:
        """What the probe would read: per recording (..., n_r), for parameter vectors (..., d).

        Inadmissible parameters give NaN throughout the recordings concerned.
        """
        flat = theta.reshape(-1, theta.shape[-1])
        recordings = np.arange(self.counts.size)
        motions = self.motions_of(np.tile(recordings, flat.shape[0]), self.layout.slots(flat))
        rows = motions.reshape(flat.shape[0], recordings.size, -1)
        predicted = [
            self.read(r, rows[:, r, : self.counts[r]], flat) for r in range(recordings.size)
        ]
        return tuple(p.reshape(*theta.shape[:-1], p.shape[-1]) for p in predicted)

    def predict_recording(self, r: int, theta: Array) -> Array:
        """Readings of recording `r`, (B, n), for parameter vectors (B, d).

        What moves as the first one does, and differs in the measurement alone, is simulated once.
        """
        q = self.layout.slots_of(r, theta)
        other = (np.delete(q, _OFFSET, axis=1) != np.delete(q[0], _OFFSET)).any(axis=1)
        simulated = np.concatenate([[0], np.flatnonzero(other)])
        motions = self.motions_of(np.full(simulated.size, r), q[simulated])
        return self.read(r, motions[np.where(other, np.cumsum(other), 0)], theta)

    def predict_restarted(self, r: int, theta: Array, restarts: Array) -> Array:
        """Readings of recording `r`, (B, n), for parameter vectors (B, d), of a motion that begins
        anew where `restarts` (m, 3) say, see `integrate_many`.
        """
        q = self.layout.slots_of(r, theta)
        rows = np.full(q.shape[0], r)
        motions = general_motions(
            q, self.campaign.mass, self.counts[rows], self.intervals[rows], self.laws,
            self.orders[rows], None if self.inputs is None else self.inputs.of(rows),
            [restarts] * rows.size,
        )  # fmt: skip
        return self.read(r, motions, theta)

    def read(self, r: int, motion: Array, theta: Array) -> Array:
        """Gain, sensor, high-pass, rest offset and filter on true displacements (or their time
        derivatives, as the probe reads them), (B, n), of recording `r`.

        What effects of the probe add to what it sees is summed: a set of them has no order.
        """
        if self.gains[r] >= 0:
            motion = motion * theta[:, self.gains[r], None]
        interval = float(self.intervals[r])
        times: Array = np.arange(motion.shape[1], dtype=np.float64) * interval
        seen = motion
        for effect, positions in self.sensors:
            assert effect.observe is not None
            seen = seen + (effect.observe(motion, times, theta[:, positions[r]]) - motion)
        if self.high_pass_states[r] >= 0:
            corner = self.campaign.recordings[r].high_pass
            state = theta[:, self.high_pass_states[r], None]
            passed = measurement.high_passed(seen, corner, interval)
            seen = passed - state * measurement.remembered(corner, interval, times.size)
        reading = seen + self.layout.offsets(r, theta)[:, None]
        return measurement.smooth(reading, self.smoothing, interval)

    def displacements(self, theta: Array) -> tuple[Array, ...]:
        """True displacements of all recordings, (n_r,), m, for one parameter vector (d,)."""
        recordings = np.arange(self.counts.size)
        rows = self.motions_of(recordings, self.layout.slots(theta), np.zeros_like(recordings))
        return tuple(row[:n] for row, n in zip(rows, self.counts, strict=True))

    def motions_of(
        self,
        recordings: NDArray[np.int64],
        slots: Array,
        orders: NDArray[np.int64] | None = None,
    ) -> Array:
        """True motions, a row per recording index and slot vector; NaN where it fails.

        What the recording's probe reads of them: displacements, m, or derivatives, a base's motion
        counted in where it reads the absolute one. `orders` asks for others, relative to the base.
        """
        q = np.ascontiguousarray(slots.reshape(recordings.size, -1))
        inputs = None if self.inputs is None else self.inputs.of(recordings)
        if orders is None:
            orders = self.orders[recordings]
        elif inputs is not None:
            inputs = inputs.of_motion()
        counts, intervals = self.counts[recordings], self.intervals[recordings]
        if self.is_base:
            base = np.ascontiguousarray(q[:, : len(BASE_SLOTS)])
            return motions(base, self.campaign.mass, counts, intervals, orders, inputs)
        return general_motions(q, self.campaign.mass, counts, intervals, self.laws, orders, inputs)


def build_oscillator(
    campaign: Campaign,
    effects: Sequence[Effect] = (),
    *,
    smoothing: Smoothing | None = None,
    sigma_per_recording: bool = False,
) -> Oscillator:
    """The oscillator of a campaign; `smoothing` None takes what campaign.toml declares."""
    layout = build_layout(campaign, effects, sigma_per_recording=sigma_per_recording)
    return Oscillator(campaign, tuple(effects), layout, smoothing or campaign.measurement.smoothing)
