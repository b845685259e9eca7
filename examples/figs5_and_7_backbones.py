"""Figs 5 and 7: what do the backbones of the nine recordings tell of k1, g and the beams?

The lower branch is the free oscillator: k1 = m (2 pi f)^2. The upper one leaves it where the swings
reach the beam: that amplitude is the gap g. A stiffer beam has the lower upper backbone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from drawing import COLOURS, DASHES, GREY, arguments, of_case, panels, paper_campaign, save, styled

from bayesimpact.response.backbone import Backbone, backbone


def gap_of(curve: Backbone) -> float:
    """Upper amplitude at the knee, m: between the last swing that is 1 % faster and the next."""
    free = np.median(curve.lower.frequency)
    faster = np.flatnonzero(curve.upper.frequency > 1.01 * free)
    if faster.size == 0 or faster[-1] + 1 >= curve.upper.amplitude.size:
        return float("nan")
    return float(curve.upper.amplitude[faster[-1] : faster[-1] + 2].mean())


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    campaign = paper_campaign()
    curves = {r.name: backbone(r.samples, r.interval) for r in campaign.recordings}
    free = float(np.mean([np.mean(c.lower.frequency) for c in curves.values()]))
    numbers = {
        "lower_frequency_hz": free,
        "k1": campaign.mass * (2 * np.pi * free) ** 2,
        "g": float(np.nanmean([gap_of(c) for c in curves.values()])),
    }
    print(f"lower backbone {free:.3f} Hz (published 6.39)")
    print(f"k1 = {numbers['k1']:.2f} N/m (published 810.32 read off, 808.556 identified)")
    print(f"g  = {1e3 * numbers['g']:.2f} mm (published 1.1)")

    figure, axes = panels(1, 4, (12.0, 3.6), "xy")
    for axis, case in zip(axes, campaign.cases, strict=False):
        for dash, recording in zip(DASHES, of_case(campaign, case), strict=True):
            c = curves[recording.name]
            for target in (axis, axes[3]):
                style = {"color": COLOURS[case], "lw": 1.0, "marker": ".", "ms": 3}
                target.plot(c.upper.frequency, 1e3 * c.upper.amplitude, ls=dash, **style)
                target.plot(
                    c.lower.frequency, 1e3 * c.lower.amplitude, ls=dash, alpha=0.45, **style
                )
        highest = max(curves[r.name].upper.frequency.max() for r in of_case(campaign, case))
        numbers[f"highest_frequency_hz[{case}]"] = float(highest)
        axis.set_title(f"Fig. 5: case {case}, three releases")
    # At one frequency, the amplitude of the upper branch of every beam.
    for case in campaign.cases:
        c = curves[of_case(campaign, case)[0].name].upper
        order = np.argsort(c.frequency)
        at = float(np.interp(9.0, c.frequency[order], c.amplitude[order]))
        numbers[f"amplitude_at_9_hz[{case}]"] = at
        print(f"case {case}: upper amplitude at 9 Hz {1e3 * at:.3f} mm")
        axes[3].plot([], [], color=COLOURS[case], label=f"case {case}")
    axes[3].set_title("Fig. 7: all beams")
    axes[3].legend()
    for axis in axes:
        axis.axhline(1.1, color=GREY, lw=0.7, ls=":")
        axis.set_xlabel("frequency (Hz)")
    axes[0].set_ylabel("amplitude (mm)")
    axes[0].annotate("gap 1.1 mm", (14.2, 1.15), color="#5A5A5A", ha="right", fontsize=8)
    axes[0].annotate("lower", (6.6, 5.2), color="#444444", fontsize=8)
    axes[0].annotate("upper", (10.6, 2.6), color="#444444", fontsize=8)
    save(figure, options.out, "figs5_and_7_backbones")
    return numbers


if __name__ == "__main__":
    main()
