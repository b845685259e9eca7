"""One recording of a motion, free or driven: checked, immutable, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.input import Input
from bayesimpact.data.quantity import Quantity, is_angular, order_of, unit_of


@dataclass(frozen=True, eq=False)
class Recording:
    """Equally spaced samples of one free decay, or of one motion with a measured input.

    Attributes
    ----------
    name : file name without its ending; names the nuisance parameters `y0[name]`, ...
    case : the obstacle that was mounted; "" for a campaign without a stop
    samples : (n,) read-only, in the SI unit of `quantity`
    interval : sampling interval, s
    start : time of the first sample on the file's own clock, s
    quantity : what was measured
    used : (n,) read-only, False where a sample is set aside; None when all count. Samples that are
        set aside hold a smooth stand-in, for what needs a whole recording to start from; a longer
        mask is cut to the samples, so that a recording can be shortened at its end
    input : what drove the motion, cut to the samples in the same way; None for a free decay
    motion_name : of the motion of which this is one channel of several; "" where it is the only one
    free_gain : the probe's gain is an unknown near 1, `gain[name]`; else it is 1
    high_pass : corner of the first-order high-pass that the readings came through, Hz; 0 for none.
        What it had settled on at the first sample is an unknown, `high_pass_state[name]`
    """

    name: str
    case: str
    samples: NDArray[np.float64]
    interval: float
    start: float = 0.0
    quantity: Quantity = "displacement"
    used: NDArray[np.bool_] | None = None
    input: Input | None = None
    motion_name: str = ""
    free_gain: bool = False
    high_pass: float = 0.0

    def __repr__(self) -> str:
        """One line."""
        case = f", case {self.case}" if self.case else ""
        rate = f"{1 / self.interval:g} Hz"
        return f"<Recording {self.name!r}{case}: {self.samples.size} samples at {rate}>"

    def __post_init__(self) -> None:
        samples = np.array(self.samples, dtype=np.float64)
        samples.setflags(write=False)
        object.__setattr__(self, "samples", samples)
        if self.input is not None:
            if self.input.samples.size < samples.size:
                found = self.input.samples.size
                raise ValueError(f"{samples.size} samples, and an input of {found}")
            object.__setattr__(self, "input", self.input.part(0, samples.size))
        if self.used is None:
            return
        used = np.array(self.used, dtype=np.bool_)[: samples.size]
        if used.size < samples.size:
            raise ValueError(f"{samples.size} samples, and a mask for {used.size} of them")
        used.setflags(write=False)
        object.__setattr__(self, "used", None if used.all() else used)

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # unpickled arrays can be written

    def part(self, first: int, end: int) -> Recording:
        """Samples first..end-1, with all that belongs to them."""
        return replace(
            self,
            samples=self.samples[first:end],
            start=self.start + first * self.interval,
            used=None if self.used is None else self.used[first:end],
            input=None if self.input is None else self.input.part(first, end),
        )

    @property
    def times(self) -> NDArray[np.float64]:
        """Time since the first sample, (n,), s."""
        return np.arange(self.samples.size, dtype=np.float64) * self.interval

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float((self.samples.size - 1) * self.interval)

    @property
    def count(self) -> int:
        """Number of samples that count."""
        return self.samples.size if self.used is None else int(self.used.sum())

    @property
    def unit(self) -> str:
        """SI unit of the samples."""
        return unit_of(self.quantity)

    @property
    def order(self) -> int:
        """Which time derivative of the displacement (or angle) the samples are: 0, 1 or 2."""
        return order_of(self.quantity)

    @property
    def is_displacement(self) -> bool:
        """True when the samples are displacements as the model has them, relative to a base."""
        return self.order == 0 and not (self.input is not None and self.input.absolute)

    @property
    def angular(self) -> bool:
        """True when the motion is about an axis."""
        return is_angular(self.quantity)

    def motion(self, rate: float) -> float:
        """Peak-to-peak displacement of an oscillation of angular frequency `rate`, rad/s, m."""
        return float(np.ptp(self.samples)) / rate**self.order
