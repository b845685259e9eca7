"""The API reference as HTML: `python tests/reference.py OUT` (`pip install -e ".[docs]"`)."""

from __future__ import annotations

import sys
from pathlib import Path

import bayesimpact


def main(out: str) -> None:
    """Write the pages of all public names into the folder `out`."""
    import pdoc

    for name in bayesimpact.__all__:  # loaded when first used, and pdoc only sees what is there
        setattr(bayesimpact, name, getattr(bayesimpact, name))
    pdoc.render.configure(docformat="numpy", footer_text=f"version {bayesimpact.__version__}")
    pdoc.pdoc("bayesimpact", output_directory=Path(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
