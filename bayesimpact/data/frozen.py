"""Read-only mappings to and from plain ones: pickle knows only the latter."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any


def thawed(value: Any) -> Any:
    """The same with every read-only mapping, however deep, as a `dict`."""
    if isinstance(value, MappingProxyType):
        return {key: thawed(item) for key, item in value.items()}
    return value


def frozen(value: Any) -> Any:
    """The same with every `dict`, however deep, as a read-only mapping."""
    if isinstance(value, dict):
        return MappingProxyType({key: frozen(item) for key, item in value.items()})
    return value


class Picklable:
    """Pickles a record whose attributes hold read-only mappings."""

    def __getstate__(self) -> dict[str, Any]:
        return {key: thawed(value) for key, value in self.__dict__.items()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({key: frozen(value) for key, value in state.items()})
