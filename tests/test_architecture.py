"""The package's layout, as rules: who may import whom, who may print, how long a file may be."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bayesimpact"
LAYERS = (
    "errors",
    "data",
    "model",
    "response",
    "inference",
    "formula",
    "diagnosis",
    "design",
    "report",
    "workflow",
    "cluster",
    "found",
    "api",
    "console",
    "trial",
    "fleet",
    "cli",
    "__main__",
)
# rooms of one storey: each of a line imports none that stands behind it
ROOMS = (
    ("model.jit", "model.exact", "model.exact.sensitivities"),
    ("model.jit", "model.exact", "model.general", "model.linear_response"),
    ("inference.sampling", "inference.noise", "inference.initial"),
    ("diagnosis.score_test", "diagnosis.candidates", "diagnosis.selection"),
    ("diagnosis.refits", "diagnosis.candidates", "diagnosis.selection"),
    ("diagnosis.residual_force", "diagnosis.candidates", "diagnosis.selection"),
    ("diagnosis.selection", "diagnosis.formulas"),
    ("trial.rig", "trial.draw", "trial.score", "trial.run"),
)
FILES = sorted(PACKAGE.rglob("*.py"))


def module_name(file: Path) -> str:
    """Dotted name of a file of the package."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(file): ast.parse(file.read_text(), str(file)) for file in FILES}


def imported(module: str) -> Iterator[str]:
    """Every module that a module imports, wherever in the file."""
    for node in ast.walk(MODULES[module]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: a relative import"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield whole if whole in MODULES else str(node.module)


def layer(module: str) -> int | None:
    """Position in `LAYERS`; None for the package's own face."""
    parts = module.split(".")
    return LAYERS.index(parts[1]) if len(parts) > 1 else None


def test_every_module_has_a_layer() -> None:
    assert {name.split(".")[1] for name in MODULES if "." in name} <= set(LAYERS)


@pytest.mark.parametrize("module", [name for name in MODULES if "." in name])
def test_imports_run_one_way(module: str) -> None:
    own = layer(module)
    assert own is not None
    for name in imported(module):
        if name.split(".")[0] == "bayesimpact":
            other = layer(name)
            assert other is not None, f"{module} imports the package's face"
            assert other <= own, f"{module} imports {name}"


def room(module: str, among: tuple[str, ...]) -> str | None:
    """The innermost of some rooms that holds a module; None when none does."""
    holding = [one for one in among if module.startswith(f"bayesimpact.{one}.")]
    return max(holding, key=len, default=None)


@pytest.mark.parametrize("rooms", ROOMS, ids=lambda rooms: rooms[-1])
def test_rooms_import_one_way(rooms: tuple[str, ...]) -> None:
    seen = set()
    for module in MODULES:
        own = room(module, rooms)
        if own is None:
            continue
        seen.add(own)
        for name in imported(module):
            other = room(f"{name}.", rooms)
            behind = other is not None and rooms.index(other) > rooms.index(own)
            assert not behind, f"{module} imports {name}"
    assert seen == set(rooms)


def test_no_circle_of_imports() -> None:
    graph = {m: {n for n in imported(m) if n in MODULES and n != m} for m in MODULES}
    while graph:
        leaves = {m for m, needs in graph.items() if not needs & graph.keys()}
        assert leaves, f"a circle among {sorted(graph)}"
        graph = {m: needs for m, needs in graph.items() if m not in leaves}


def test_the_rig_shares_nothing_with_the_model() -> None:
    """The independent generator may use NumPy, SciPy, the records and itself."""
    allowed = ("numpy", "scipy", "bayesimpact.errors", "bayesimpact.data", "bayesimpact.trial.rig")
    rig = [name for name in MODULES if name.startswith("bayesimpact.trial.rig")]
    assert rig
    for module in rig:
        for name in imported(module):
            own = name.split(".")[0] in sys.stdlib_module_names
            assert own or name.startswith(allowed), f"{module} imports {name}"


@pytest.mark.parametrize(
    ("library", "home"), [("matplotlib", "bayesimpact.report"), ("numba", "bayesimpact.model")]
)
def test_library_has_one_home(library: str, home: str) -> None:
    users = [m for m in MODULES if any(n.split(".")[0] == library for n in imported(m))]
    assert users
    assert [m for m in users if not m.startswith(home)] == []


def test_only_the_command_line_prints() -> None:
    for module, syntax in MODULES.items():
        for node in ast.walk(syntax):
            if isinstance(node, ast.Name) and module != "bayesimpact.cli":
                assert node.id != "print", f"{module}, line {node.lineno}"
    printers = [m for m in MODULES if any(n.split(".")[0] == "click" for n in imported(m))]
    assert printers == [
        "bayesimpact.cli",
        "bayesimpact.console",
        "bayesimpact.fleet.command",
        "bayesimpact.trial.command",
    ]


def test_importing_the_package_is_light() -> None:
    script = "import sys, json, bayesimpact; print(json.dumps(sorted(sys.modules)))"
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    heavy = {"numba", "scipy", "matplotlib", "arviz", "emcee", "xarray", "pandas", "distributed"}
    assert not heavy & set(json.loads(result.stdout))


def test_no_file_is_long() -> None:
    files = [f for top in ("bayesimpact", "tests", "examples") for f in (ROOT / top).rglob("*.py")]
    lengths = {str(f.relative_to(ROOT)): len(f.read_text().splitlines()) for f in files}
    assert {name: n for name, n in lengths.items() if n > 400} == {}


def test_test_files_have_names_of_their_own() -> None:
    """pytest imports them by their bare name: the second of one name is not collected."""
    names = [file.name for file in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
