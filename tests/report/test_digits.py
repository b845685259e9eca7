"""One number has the same digits on the page, in LaTeX, in figures and in notebooks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from diagnosed import diagnosed, estimate
from matplotlib.figure import Figure

from bayesimpact.report.diagnosis.change_view import change_row
from bayesimpact.report.digits import digits, places
from bayesimpact.report.figures.corner import corner_figure
from bayesimpact.report.latex import latex_tables
from bayesimpact.report.results import Results
from bayesimpact.report.tables import parameter_views


@pytest.mark.parametrize(
    ("half", "other", "told"),
    [
        (1.85e-5, None, "0.148131 (0.148113 to 0.148150) N s/m"),
        (1.85e-5, 4e-5, "0.14813 (0.14811 to 0.14815) N s/m"),
        (1.85e-5, 4e-3, "0.148131 (0.148113 to 0.148150) N s/m"),  # of another order
        (4e-5, 1.85e-5, "0.14813 (0.14809 to 0.14817) N s/m"),
    ],
)
def test_the_widest_interval_of_its_order_decides(
    half: float, other: float | None, told: str
) -> None:
    one = estimate(0.148131, half, "N s/m")
    others = [] if other is None else [estimate(0.14799, other, "N s/m")]
    shown = digits("N s/m", one["median"], one["ci90"], others)
    assert shown.estimate(one["median"], one["ci90"]).replace("\N{NO-BREAK SPACE}", " ") == told


def test_seven_digits_only_where_the_interval_needs_them() -> None:
    assert places(1607.4672, (1607.4572, 1607.4772)) == 2
    assert places(1607.4672, (1607.4662, 1607.4682)) == 3
    assert places(107.4672, (107.4572, 107.4772)) == 3


def test_one_unit_where_a_prefix_would_change_from_one_to_the_other() -> None:
    small, large = estimate(9.0e-3, 1e-4, "N"), estimate(1.1e-2, 1e-4, "N")
    units = {
        digits("N", x["median"], x["ci90"], [y]).unit for x, y in ((small, large), (large, small))
    }
    assert units == {"N"}


def with_wider_base() -> tuple[Results, dict[str, Any]]:
    """A diagnosis whose base model has the wider interval of k1 (by itself k1 had one digit more)
    and whose extended model is that of the table.
    """
    results = diagnosed()
    row = results.row("k1")
    half = 0.5 * (row.ci90[1] - row.ci90[0])
    after = {"unit": row.unit, "median": row.median, "ci90": list(row.ci90)}
    both = {"k1": estimate(row.median + 1.0, 9 * half, row.unit)}
    told = {**(results.diagnosis or {}), "parameters": {"before": both, "after": {"k1": after}}}
    return replace(results, diagnosis=told), after


def test_every_place_tells_a_parameter_with_the_same_digits() -> None:
    results, after = with_wider_base()
    alone = digits(after["unit"], after["median"], after["ci90"])
    (view,) = parameter_views(results, (results.row("k1"),))
    assert view.median != alone.value(after["median"]), "the case tells nothing"
    told = f"{view.median} ({view.interval})"
    change = change_row("k1", results.diagnosis["parameters"]["before"]["k1"], after)  # type: ignore[index]
    assert str(change["after"]).startswith(told)
    tables = latex_tables(results)
    assert tables.count(f"& {view.median} & {view.interval} & N/m") == 2  # alone, and after
    assert f"<td>{view.median}</td>" in results._repr_html_()
    assert view.median in corner_title(results)


def corner_title(results: Results) -> str:
    draws = results.draws
    assert draws is not None
    figure = corner_figure(
        draws,
        estimates={r.name: (r.median, *r.ci90) for r in results.rows},
        shown={r.name: results.digits(r) for r in results.rows},
    )
    assert isinstance(figure, Figure)
    return " ".join(axis.get_title(loc="left") for axis in figure.axes)


def test_a_large_ratio_to_the_mass_is_written_with_a_power_of_ten() -> None:
    row = replace(diagnosed().row("k1"), ratio=(3.423e8, 3.409e8, 3.436e8), ratio_unit="1/(m2 s2)")
    (view,) = parameter_views(diagnosed(), (row,))
    assert (view.ratio, view.ratio_interval) == ("3.423", "3.409 to 3.436")
    assert view.ratio_unit.replace("\xa0", " ") == "× 10⁸ 1/(m² s²)"
