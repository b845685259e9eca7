"""What can go wrong, as types: everything raised on purpose is a `BayesimpactError`."""

from __future__ import annotations


class BayesimpactError(Exception):
    """Base of every error that the package raises on purpose."""


class InputError(BayesimpactError, ValueError):
    """Something handed in cannot be used; the command line turns it into exit code 2.

    Parameters
    ----------
    where : the file, line, key or argument at fault
    found : what was found there
    accepted : what would have been accepted
    """

    def __init__(self, where: str, found: str, accepted: str) -> None:
        super().__init__(f"{where}: found {found}; accepted: {accepted}")
        self.where = where
        self.found = found
        self.accepted = accepted


class SimulationError(BayesimpactError, RuntimeError):
    """A simulation ended with a failure code (see `bayesimpact.model.simulate.CODES`)."""
