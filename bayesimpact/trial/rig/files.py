"""Files of a simulated campaign: the folder that `load_campaign` reads, and what it conceals."""

from __future__ import annotations

from bayesimpact.data.write import write_campaign

TRUTH_FILE = "truth.json"
"""What a bundled campaign conceals, beside its recordings."""

__all__ = ["TRUTH_FILE", "write_campaign"]
