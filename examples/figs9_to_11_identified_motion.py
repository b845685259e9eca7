"""Figs 9 to 11: does the identified model follow the recordings in time?

Recorded and fitted displacement of all nine recordings, one figure per beam, and what is left over.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from drawing import COLOURS, arguments, of_case, panels, paper_campaign, save, styled

import bayesimpact as bi


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    campaign = paper_campaign()
    fit = bi.fit(campaign, rng=np.random.default_rng(0), search=not options.quick).fit
    rows = {recording.name: r for r, recording in enumerate(campaign.recordings)}
    numbers = {}
    for number, case in zip((9, 10, 11), campaign.cases, strict=True):
        figure, axes = panels(3, 2, (11.0, 6.0))
        for j, recording in enumerate(of_case(campaign, case)):
            fitted = fit.predicted[rows[recording.name]]
            left = recording.samples - fitted
            rms = float(np.sqrt(np.mean(left**2)))
            numbers[recording.name] = rms
            print(f"Fig. {number}, {recording.name}: residual {1e6 * rms:.2f} um rms")
            whole, rest = axes[2 * j], axes[2 * j + 1]
            whole.plot(
                recording.times[::8], 1e3 * recording.samples[::8], ".", ms=2.5,
                color=COLOURS[case], label="recorded, every eighth sample",
            )  # fmt: skip
            whole.plot(recording.times, 1e3 * fitted, lw=0.6, color="#000000", label="fitted")
            whole.set_ylabel("displacement (mm)")
            rest.plot(recording.times, 1e6 * left, lw=0.3, color="#000000")
            rest.set_ylim(-28, 28)
            rest.set_ylabel("residual (um)")
            whole.set_title(recording.name)
            rest.set_title(f"{1e6 * rms:.2f} um rms")
            for axis in (whole, rest):
                axis.set_xlim(0, recording.duration)
        axes[0].set_ylim(-7, 6.5)
        axes[0].legend(loc="upper right", ncols=2)
        for axis in axes[4:]:
            axis.set_xlabel("time (s)")
        save(figure, options.out, f"fig{number}_identified_motion")
    return numbers


if __name__ == "__main__":
    main()
