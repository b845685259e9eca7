"""Fig. 15: what makes the stiffness that is read off the backbone accurate?

Accuracy is the reading over the true k2; the gap is 1 mm throughout. Soft beams, as in the paper:
(a) k1 and k2; (b) k1 and the release; (c) the mass and k2; (d) both dampings.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from drawing import MASS, arguments, panels, save, styled
from matplotlib.axes import Axes
from releases import read_stiffness

BASE = {"mass": MASS, "c1": 0.148, "k1": 60.0, "c2": 2.085, "g": 1e-3, "k2": 35.0, "release": 0.02}

#: (title, name, label and range across, name, label and range upwards, the factor of the labels)
MAPS: tuple[tuple[str, tuple[str, str, Any, float], tuple[str, str, Any, float]], ...] = (
    (
        "(a) release 20 mm",
        ("k2", "k2 (N/m)", (20.0, 100.0), 1.0),
        ("k1", "k1 (N/m)", (20.0, 100.0), 1.0),
    ),
    (
        "(b) k2 = 35 N/m",
        ("release", "release (mm)", (5e-3, 40e-3), 1e3),
        ("k1", "k1 (N/m)", (20.0, 100.0), 1.0),
    ),
    (
        "(c) k1 = 60 N/m, release 20 mm",
        ("k2", "k2 (N/m)", (20.0, 100.0), 1.0),
        ("mass", "mass (kg)", (0.2, 1.0), 1.0),
    ),
    (
        "(d) k1 = 60, k2 = 35 N/m, release 20 mm",
        ("c1", "c1 (N s/m)", (0.0, 1.0), 1.0),
        ("c2", "c2 (N s/m)", (0.0, 4.0), 1.0),
    ),
)


def accuracy(**changed: float) -> float:
    """Reading over the true k2."""
    values = BASE | changed
    return read_stiffness(**values) / values["k2"]


def draw(axis: Axes, title: str, across: Any, upwards: Any, points: int) -> Any:
    """One map of the accuracy."""
    x, y = (np.linspace(*side[2], points) for side in (across, upwards))
    table = np.array([[accuracy(**{across[0]: a, upwards[0]: b}) for a in x] for b in y])
    levels = np.arange(0.3, 1.001, 0.05)
    shades = axis.contourf(
        across[3] * x, upwards[3] * y, table, levels=levels, cmap="viridis", extend="min"
    )
    lines = axis.contour(
        across[3] * x, upwards[3] * y, table, levels=[0.6, 0.7, 0.8, 0.85, 0.9], colors="white",
        linewidths=0.7,
    )  # fmt: skip
    axis.clabel(lines, fmt=lambda v: f"{100 * v:.0f} %", fontsize=7)
    axis.set_title(title)
    axis.set_xlabel(across[1])
    axis.set_ylabel(upwards[1])
    return shades


@styled
def main(argv: Sequence[str] | None = None) -> dict[str, float]:
    options = arguments(__doc__ or "", argv)
    figure, axes = panels(2, 2, (9.0, 7.0))
    points = 6 if options.quick else 25
    for axis, (title, across, upwards) in zip(axes, MAPS, strict=True):
        shades = draw(axis, title, across, upwards, points)
    figure.colorbar(shades, ax=axes, label="stiffness read off / true", shrink=0.8)
    save(figure, options.out, "fig15_estimation_accuracy")
    numbers = {
        "k1 = 100, release 20 mm": accuracy(k1=100.0),
        "k1 = 100, release 40 mm": accuracy(k1=100.0, release=0.04),
        "k1 = 20, release 20 mm": accuracy(k1=20.0),
        "mass 0.2 kg, k2 = 20": accuracy(mass=0.2, k2=20.0),
        "mass 0.2 kg, k2 = 100": accuracy(mass=0.2, k2=100.0),
        "mass 1 kg, k2 = 20": accuracy(mass=1.0, k2=20.0),
        "mass 1 kg, k2 = 100": accuracy(mass=1.0, k2=100.0),
        "c1 = 1": accuracy(c1=1.0),
        "c2 = 4": accuracy(c2=4.0),
        "c1 = c2 = 0": accuracy(c1=0.0, c2=0.0),
    }
    for name, value in numbers.items():
        print(f"{name:26} {100 * value:5.1f} %")
    return numbers


if __name__ == "__main__":
    main()
