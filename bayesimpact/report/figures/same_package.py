"""A second process that runs the very package that this process runs, and nothing beside the data.

The package is loaded from its own place, whichever way this process came to it (an installed one,
PYTHONPATH, the folder of a checkout); libraries from this process's module path without the
working folder. So `-I`: PYTHONPATH and the user's settings have had their effect on that path.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

_START = """
import json, sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
place, sys.path[:], sys.argv[:] = json.loads(sys.argv[1])
spec = spec_from_file_location("bayesimpact", place)
sys.modules["bayesimpact"] = module_from_spec(spec)
spec.loader.exec_module(sys.modules["bayesimpact"])
import_module(sys.argv[0]).main()
"""


def command(module: str, *arguments: str) -> list[str]:
    """What starts Python to call `main()` of a module of this package with these arguments."""
    place = str(Path(sys.modules["bayesimpact"].__file__ or "").absolute())
    told = json.dumps([place, _module_path(), [module, *arguments]])
    return [sys.executable, "-I", "-c", _START, told]


def _module_path() -> list[str]:
    """This process's module path without the working folder and what is relative to it."""
    here = Path.cwd().resolve()
    return [e for e in sys.path if Path(e).is_absolute() and Path(e).resolve() != here]
