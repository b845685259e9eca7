"""The notebooks of examples/: kept with small outputs, and run here in a quick form."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

pytestmark = pytest.mark.long

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
LARGEST = 500_000  # bytes
PATIENCE = 600  # s per cell: a first run compiles the simulator

QUICK = {
    "from_files_to_posterior": "SEARCH, EFFECTIVE_DRAWS = False, 100",
    "what_is_missing": 'SEARCHED = ("contact_damping_speed", "gap_wear")',
    "an_effect_of_your_own": 'SEARCHED = ("coulomb_friction", "spring_cubic")',
    "a_forced_test": "SECONDS, EFFECTIVE_DRAWS = 2.0, 100",
}
"""What takes the place of a notebook's parameters."""


def numbers(name: str, expression: str) -> dict[str, Any]:
    """Run a notebook with its quick parameters; what an expression is worth at its end."""
    notebook = nbformat.read(EXAMPLES / f"{name}.ipynb", as_version=4)
    (place,) = (
        i for i, cell in enumerate(notebook.cells) if "parameters" in cell.metadata.get("tags", ())
    )
    notebook.cells[place].source = QUICK[name]
    last = f"import json\nprint(json.dumps({expression}))"
    notebook.cells.append(nbformat.v4.new_code_cell(last))
    folder = {"metadata": {"path": str(EXAMPLES)}}
    NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources=folder).execute()
    content: dict[str, Any] = json.loads(notebook.cells[-1].outputs[-1].text)
    return content


def test_every_notebook_is_run_here() -> None:
    assert {file.stem for file in NOTEBOOKS} == set(QUICK)


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_kept_as_it_ran(file: Path) -> None:
    """From top to bottom, without an error, with its figures, and small."""
    cells = nbformat.read(file, as_version=4).cells
    code = [cell for cell in cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    kinds = [(o.output_type, *o.get("data", {})) for cell in code for o in cell.outputs]
    assert not any(kind[0] == "error" for kind in kinds)
    assert not any(o.get("name") == "stderr" for cell in code for o in cell.outputs)
    assert any("image/png" in kind for kind in kinds)
    assert file.stat().st_size < LARGEST
    assert str(EXAMPLES.parent) not in file.read_text()


def test_from_files_to_a_posterior() -> None:
    """Seven parameters within 3.3 standard deviations: all would be in 99.3 % of campaigns."""
    off = numbers("from_files_to_posterior", 'table["off, sd"].to_dict()')
    assert len(off) == 7
    assert all(abs(z) < 3.3 for z in off.values())


def test_what_is_missing() -> None:
    found = numbers(
        "what_is_missing",
        '{"named": sorted(e.id for e in diagnosis.effects), "control": control.verdict,'
        ' "off": table["after, sd"].abs().max(), "before": table["before, sd"].abs().max()}',
    )
    assert found["named"] == ["contact_damping_speed", "gap_wear"]
    assert found["control"] == "adequate"
    assert found["off"] < 4 < found["before"]


def test_an_effect_of_your_own() -> None:
    found = numbers(
        "an_effect_of_your_own",
        '{"without": without.verdict, "found": [e.id for e in found.effects],'
        ' "sizes": [found.intervals.quantiles(n) for n in rows]}',
    )
    assert found["without"] == "unknown" and found["found"] == ["magnetic_detent"]
    for true, (low, _, high) in zip((12.0, 1.5e-3), found["sizes"], strict=True):
        assert low - (high - low) < true < high + (high - low)


def test_a_forced_test() -> None:
    found = numbers("a_forced_test", '{"off": table["off, sd"].to_dict(), "usual": usual}')
    assert len(found["off"]) == 5 and all(abs(z) < 3.3 for z in found["off"].values())
    assert found["usual"] < 0.005
