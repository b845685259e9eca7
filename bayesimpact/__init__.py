"""Bayesian identification of impacting systems, and a diagnosis of what a model leaves out.

    import bayesimpact as bi
    campaign = bi.load("data/paper")
    found = bi.fit(campaign)
    posterior = bi.sample(found)
    bi.corner(posterior)

Importing the package imports nothing heavy; each name is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bayesimpact.api import diagnose as diagnose
    from bayesimpact.api import fit as fit
    from bayesimpact.api import open_results as open
    from bayesimpact.api import sample as sample
    from bayesimpact.data.campaign import Campaign as Campaign
    from bayesimpact.data.read import load_campaign as load
    from bayesimpact.data.recording import Recording as Recording
    from bayesimpact.found import Diagnosis as Diagnosis
    from bayesimpact.found import Identification as Identification
    from bayesimpact.found import Posterior as Posterior
    from bayesimpact.found import save as save
    from bayesimpact.found import summary as summary
    from bayesimpact.model.effects import EFFECTS as EFFECTS
    from bayesimpact.model.effects import SEARCHED as SEARCHED
    from bayesimpact.model.effects import Effect as Effect
    from bayesimpact.model.experiment import simulate as simulate
    from bayesimpact.report.check_figure import plot as plot
    from bayesimpact.report.notebook import corner as corner
    from bayesimpact.response.backbone import backbone as backbone

_NAMES = {
    "Campaign": ("bayesimpact.data.campaign", "Campaign"),
    "Recording": ("bayesimpact.data.recording", "Recording"),
    "load": ("bayesimpact.data.read", "load_campaign"),
    "simulate": ("bayesimpact.model.experiment", "simulate"),
    "backbone": ("bayesimpact.response.backbone", "backbone"),
    "fit": ("bayesimpact.api", "fit"),
    "sample": ("bayesimpact.api", "sample"),
    "summary": ("bayesimpact.found", "summary"),
    "save": ("bayesimpact.found", "save"),
    "open": ("bayesimpact.api", "open_results"),
    "plot": ("bayesimpact.report.check_figure", "plot"),
    "corner": ("bayesimpact.report.notebook", "corner"),
    "diagnose": ("bayesimpact.api", "diagnose"),
    "Identification": ("bayesimpact.found", "Identification"),
    "Posterior": ("bayesimpact.found", "Posterior"),
    "Diagnosis": ("bayesimpact.found", "Diagnosis"),
    "EFFECTS": ("bayesimpact.model.effects", "EFFECTS"),
    "SEARCHED": ("bayesimpact.model.effects", "SEARCHED"),
    "Effect": ("bayesimpact.model.effects", "Effect"),
}

__all__ = [
    "EFFECTS",
    "SEARCHED",
    "Campaign",
    "Diagnosis",
    "Effect",
    "Identification",
    "Posterior",
    "Recording",
    "backbone",
    "corner",
    "diagnose",
    "fit",
    "load",
    "open",
    "plot",
    "sample",
    "save",
    "simulate",
    "summary",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return version("bayesimpact")
    if name not in _NAMES:
        raise AttributeError(f"module 'bayesimpact' has no attribute {name!r}")
    module, attribute = _NAMES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
