"""Table 1: how stiff are the three elastic beams by beam theory (Eq. 7)?

k_t = 3 E I / l^3 with I = b h^3 / 12, from the geometry in the bundled campaign.toml.
"""

from __future__ import annotations

from collections.abc import Sequence

from drawing import BLACK, COLOURS, K2, arguments, panels, paper_campaign, save, styled

PUBLISHED = {"1": 5276.3, "2": 4622.0, "3": 3000.8}


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    beams = paper_campaign().beams
    stiffness = {case: beam.stiffness for case, beam in beams.items()}
    print("case  l (mm)  h (mm)  b (mm)   k_t (N/m)  published  identified (Table 2)")
    for case, beam in beams.items():
        print(
            f"{case:>4}  {1e3 * beam.length:6.0f}  {1e3 * beam.thickness:6.2f}"
            f"  {1e3 * beam.width:6.0f}  {stiffness[case]:10.1f}  {PUBLISHED[case]:9.1f}"
            f"  {K2[case]:20.3f}"
        )
    figure, (axis,) = panels(1, 1, (4.5, 3.2))
    for place, case in enumerate(beams):
        axis.plot(place - 0.06, stiffness[case], "o", color=COLOURS[case], ms=7)
        axis.plot(place + 0.06, K2[case], "x", color=BLACK, ms=7, mew=1.6)
    axis.plot([], [], "o", color=BLACK, mfc="none", ms=7, label="beam theory, Eq. 7")
    axis.plot([], [], "x", color=BLACK, ms=7, mew=1.6, label="identified, Table 2")
    axis.set_xticks(range(len(beams)), [f"case {case}" for case in beams])
    axis.set_xlim(-0.5, len(beams) - 0.5)
    axis.set_ylim(0, 6000)
    axis.set_ylabel("stiffness of the beam (N/m)")
    axis.legend(loc="lower left")
    save(figure, options.out, "table1_beam_stiffness")
    return stiffness


if __name__ == "__main__":
    main()
