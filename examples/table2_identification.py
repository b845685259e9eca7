"""Table 2: which parameters does the fit of the nine bundled recordings give?

Search by differential evolution with the Metropolis criterion, then a least-squares polish with
exact derivatives. The recordings were simulated at the values of Table 2, so these are the truth.
`--quick` leaves out the global search and starts the polish from the initial estimates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from drawing import (
    BLACK,
    COLOURS,
    GREY,
    K2,
    TABLE_2,
    arguments,
    panels,
    paper_campaign,
    save,
    styled,
)

import bayesimpact as bi

UNITS = {"c1": "N s/m", "k1": "N/m", "c2": "N s/m", "g": "m"}


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    campaign = paper_campaign()
    found = bi.fit(campaign, rng=np.random.default_rng(0), search=not options.quick)
    published = TABLE_2 | {f"k2[{case}]": value for case, value in K2.items()}
    beams = {f"k2[{case}]": beam.stiffness for case, beam in campaign.beams.items()}
    sd = dict(zip(found.fit.names, found.fit.sd, strict=True))
    numbers, away = {}, {}
    print(
        "parameter  unit      fitted        95 % interval                 Table 2     beam theory"
    )
    for name, true in published.items():
        value, half = found.fit.value(name), 1.96 * float(sd[name])
        numbers[name], away[name] = value, (value - true) / float(sd[name])
        theory = f"{beams[name]:11.1f}" if name in beams else ""
        print(
            f"{name:9}  {UNITS.get(name, 'N/m'):6}  {value:12.7g}  [{value - half:12.7g},"
            f" {value + half:12.7g}]  {true:10.7g}  {theory}"
        )
    print(f"reduced chi2 {found.fit.reduced_chi2:.4f}")
    if not options.quick:
        print(f"search and initial estimates end at one mode: {'yes' if found.agree else 'no'}")

    figure, (axis,) = panels(1, 1, (5.5, 3.2))
    for place, (name, z) in enumerate(away.items()):
        colour = COLOURS[name[3]] if name in beams else BLACK
        axis.errorbar(place, z, 1.96, fmt="o", color=colour, ms=5, capsize=3, lw=1.2)
    axis.axhline(0.0, color=GREY, lw=0.7, ls=":")
    axis.set_xticks(range(len(away)), list(away))
    axis.set_ylabel("fitted less Table 2\n(standard deviations), 95 % bars")
    axis.set_ylim(-5, 5)
    save(figure, options.out, "table2_identification")
    return numbers | {f"z {name}": z for name, z in away.items()}


if __name__ == "__main__":
    main()
