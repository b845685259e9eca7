"""Figs 12 and 13: does the model at the identified values move like the recordings?

Every recording is simulated at Table 2 with its own initial conditions (from its first samples) and
the same extractor runs on both: backbones (Fig. 12) and damping ratios by Eq. 5 (Fig. 13).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from drawing import COLOURS, K2, TABLE_2, arguments, of_case, panels, paper_campaign, save, styled

from bayesimpact.inference.initial.estimates import estimate
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.response.backbone import backbone


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    campaign = paper_campaign()
    start = estimate(campaign)
    figure, axes = panels(2, 3, (10.0, 6.0))
    frequency: list[np.ndarray] = []
    damping: list[np.ndarray] = []
    for column, case in enumerate(campaign.cases):
        upper, lower = axes[column], axes[3 + column]
        for recording in of_case(campaign, case):
            motion = simulate(
                mass=campaign.mass, **TABLE_2, k2=K2[case], y0=start.y0[recording.name],
                v0=start.v0[recording.name], interval=recording.interval, n=recording.samples.size,
            )  # fmt: skip
            own = backbone(recording.samples, recording.interval)
            model = backbone(motion.displacement, recording.interval, noise=own.noise)
            for a, b, dash in ((own.upper, model.upper, "-"), (own.lower, model.lower, "--")):
                dots = {"color": COLOURS[case], "marker": ".", "ms": 4, "ls": "none"}
                line = {"color": "#000000", "lw": 0.7, "ls": dash}
                upper.plot(a.frequency, 1e3 * a.amplitude, **dots)
                upper.plot(b.frequency, 1e3 * b.amplitude, **line)
                lower.plot(a.times, 100 * a.damping_ratio, **dots)
                lower.plot(b.times, 100 * b.damping_ratio, **line)
                k = min(a.times.size, b.times.size)
                frequency.append(a.frequency[:k] / b.frequency[:k] - 1)
                damping.append(a.damping_ratio[1:k] - b.damping_ratio[1:k])
        upper.set_title(f"case {case}")
        upper.set_xlim(6, 14.5)
        upper.set_xlabel("frequency (Hz)")
        lower.set_xlabel("time (s)")
        lower.set_ylim(0, 2.2)
    axes[0].plot([], [], ".", color=COLOURS["1"], label="recorded")
    axes[0].plot([], [], color="#000000", lw=0.7, label="simulated, upper")
    axes[0].plot([], [], color="#000000", lw=0.7, ls="--", label="simulated, lower")
    axes[0].legend()
    axes[0].set_ylabel("amplitude (mm)")
    axes[3].set_ylabel("damping ratio by Eq. 5 (%)")
    numbers = {
        "frequency_rms": float(np.sqrt(np.mean(np.concatenate(frequency) ** 2))),
        "damping_rms": float(np.sqrt(np.mean(np.concatenate(damping) ** 2))),
    }
    print(f"frequency: recorded and simulated differ by {100 * numbers['frequency_rms']:.3f} % rms")
    print(f"damping ratio: by {100 * numbers['damping_rms']:.4f} percentage points rms")
    save(figure, options.out, "figs12_and_13_simulated_backbones")
    return numbers


if __name__ == "__main__":
    main()
