"""Strange campaigns through whole commands.

    python tests/benchmarks/strange_campaigns.py [COMMAND...]

Every campaign of tests/strange.py, which the door lets in, is given to COMMAND (`fit`; also
`diagnose --quick`, which takes minutes where the misfit is large): it has to end in a report, with
exit code 0 or 3. Exit codes, what was said and seconds go to strange_campaigns.json; a run that is
interrupted keeps those that it has.
"""

from __future__ import annotations

import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from record import keep

sys.path.insert(0, str(Path(__file__).parents[1]))
from strange import STRANGE
from test_strange import written

from bayesimpact.cli import main
from bayesimpact.console import INTERRUPTED


def run(command: list[str]) -> dict[str, Any]:
    """How each of the campaigns ended."""
    endings: dict[str, Any] = {}
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as name:
        for number, (kind, made) in enumerate(STRANGE.items()):
            out = Path(name) / f"out{number}"
            folder = written(Path(name) / f"campaign{number}", made())
            began = time.perf_counter()
            arguments = [*command, str(folder), "--out", str(out), "--quiet"]
            result = CliRunner().invoke(main, arguments)
            if result.exit_code == INTERRUPTED:
                break
            said = result.stderr.strip()
            if result.exc_info is not None and result.exc_info[0] is not SystemExit:
                said = "".join(traceback.format_exception(*result.exc_info))[-2000:]
            ending = {"exit": result.exit_code, "report": (out / "report.html").exists(),
                      "seconds": round(time.perf_counter() - began, 1), "said": said}  # fmt: skip
            endings[kind] = ending
            sys.stderr.write(f"{kind}: {ending}\n")
    codes = Counter(str(e["exit"]) for e in endings.values())
    good = sum(e["report"] and e["exit"] in (0, 3) for e in endings.values())
    return {"command": " ".join(command), "asked": len(STRANGE), "campaigns": len(endings),
            "reports": good, "exit_codes": dict(codes), "endings": endings}  # fmt: skip


if __name__ == "__main__":
    keep(__file__, run(sys.argv[1:] or ["fit"]))
