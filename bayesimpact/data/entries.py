"""The recordings of a campaign.toml: file name patterns filled in, and a name for each."""

from __future__ import annotations

import re
from pathlib import Path

from bayesimpact.data.schema import CampaignTable, RecordingTable
from bayesimpact.errors import InputError

_PATTERN = re.compile(r"[*?]")
_UNUSABLE = re.compile(r"[\[\]/\\\x00-\x1f]+")


def filled_in(table: CampaignTable, folder: Path, where: str) -> CampaignTable:
    """The same table with one entry per file, and names that tell entries of one file apart.

    A name is the file's without its ending; where several recordings come from one file, followed
    by what differs: column or channel, block, start.

    Raises
    ------
    InputError
        for a pattern that fits no file.
    """
    entries: list[RecordingTable] = []
    for number, entry in enumerate(table.recording, 1):
        entries += _files(entry, folder, f"{where}, recording {number} ({entry.file}), key file")
    shared = {e.file for e in entries if sum(e.file == other.file for other in entries) > 1}
    named = [
        entry.model_copy(
            update={"name": _name(entry, [e for e in entries if e.file == entry.file])}
        )
        if entry.file in shared and entry.name is None
        else entry
        for entry in entries
    ]
    return table.model_copy(update={"recording": named})


def _files(entry: RecordingTable, folder: Path, where: str) -> list[RecordingTable]:
    if not _PATTERN.search(entry.file) or (folder / entry.file).exists():
        return [entry]
    pattern = Path(entry.file)
    base = Path(pattern.anchor) if pattern.is_absolute() else folder
    relative = pattern.relative_to(pattern.anchor) if pattern.is_absolute() else pattern
    try:
        paths = sorted(base.glob(relative.as_posix()), key=_natural)
    except (ValueError, OSError) as error:
        raise InputError(where, f"a pattern that is none ({error})", "a file name") from None
    if not paths:
        raise InputError(where, f"no file of this pattern in {folder}", "a pattern of files there")
    if entry.name is not None and len(paths) > 1:
        found = f'name = "{entry.name}" for {len(paths)} files'
        raise InputError(where, found, "a pattern without a name, or a file")
    names = [p.as_posix() if pattern.is_absolute() else _relative(p, folder) for p in paths]
    return [entry.model_copy(update={"file": name}) for name in names]


def _relative(path: Path, folder: Path) -> str:
    try:
        return path.relative_to(folder).as_posix()
    except ValueError:
        return path.as_posix()


def _natural(path: Path) -> list[tuple[int, str]]:
    """run2 before run10."""
    return [(int(p), "") if p.isdigit() else (-1, p) for p in re.split(r"(\d+)", path.as_posix())]


def _name(entry: RecordingTable, together: list[RecordingTable]) -> str:
    parts = [Path(entry.file).stem]
    for key in ("column", "channel", "block"):
        if len({getattr(other, key) for other in together}) > 1 and getattr(entry, key) is not None:
            parts.append(str(getattr(entry, key)))
    if len({other.start_s for other in together}) > 1 and entry.start_s is not None:
        parts.append(f"{entry.start_s:g}s")
    return _UNUSABLE.sub("_", "-".join(parts)).strip()
