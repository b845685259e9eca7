"""Fig. 6: what does the damping ratio tell of c1?

Eq. 5 averages from the first extreme on, so the impacts of the beginning stay in it; the local
decrement is free of them as soon as the swings no longer reach the beam: c1 = 2 zeta sqrt(k1 m).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from drawing import (
    COLOURS,
    DASHES,
    GREY,
    TABLE_2,
    arguments,
    of_case,
    panels,
    paper_campaign,
    save,
    styled,
)

from bayesimpact.response.backbone import backbone


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    campaign = paper_campaign()
    figure, axes = panels(2, 3, (10.0, 5.6), "xy")
    tails: list[float] = []
    for column, case in enumerate(campaign.cases):
        for dash, recording in zip(DASHES, of_case(campaign, case), strict=True):
            for row, kind in enumerate(("reference", "local")):
                curve = backbone(recording.samples, recording.interval, damping=kind)
                for branch, alpha in ((curve.upper, 1.0), (curve.lower, 0.45)):
                    axes[3 * row + column].plot(
                        branch.times, 100 * branch.damping_ratio, ls=dash, lw=1.0, alpha=alpha,
                        color=COLOURS[case],
                    )  # fmt: skip
                if kind == "local":
                    free = curve.lower.amplitude < 1.05e-3
                    tails += list(curve.lower.damping_ratio[free & (curve.lower.times < 5.8)])
    ratio = float(np.nanmean(tails))
    error = float(np.nanstd(tails) / np.sqrt(np.isfinite(tails).sum()))
    c1 = 2 * ratio * np.sqrt(TABLE_2["k1"] * campaign.mass)
    print(f"free swings: zeta = {100 * ratio:.3f} +- {100 * error:.3f} % (published about 0.27)")
    print(f"c1 = {c1:.3f} N s/m (published 0.11 read off, 0.148 identified)")
    for axis, case in zip(axes, campaign.cases, strict=False):
        axis.set_title(f"case {case}")
    for axis in axes:
        axis.axhline(100 * ratio, color=GREY, lw=0.7, ls=":")
        axis.set_ylim(0, 2.2)
        axis.set_xlim(0, 6)
    axes[0].set_ylabel("damping ratio by Eq. 5 (%)")
    axes[3].set_ylabel("by local decrement (%)")
    for axis in axes[3:]:
        axis.set_xlabel("time (s)")
    axes[2].plot([], [], color="#444444", label="upper")
    axes[2].plot([], [], color="#444444", alpha=0.45, label="lower")
    axes[2].legend(loc="upper right")
    axes[3].annotate(
        f"free swings: {100 * ratio:.3f} %",
        (5.9, 0.05),
        ha="right",
        va="bottom",
        color=GREY,
    )
    save(figure, options.out, "fig6_damping_ratio")
    return {"damping_ratio": ratio, "standard_error": error, "c1": c1}


if __name__ == "__main__":
    main()
