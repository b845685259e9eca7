"""What a number, a name or a file of a campaign may be: ranges in which all sums stay finite.

The physical ranges are far beyond any oscillator in a laboratory or outside: masses from a cell to
a ship, times from a nanosecond to thirty thousand years, motions from a femtometre to a thousand
kilometres. Inside them no product that the package forms leaves what a double holds: the largest
are the fourth powers of the ratio of two lengths, 1e84, and stiffnesses m (2 pi / T)^2 up to
4e28 N/m.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError

MASS = (1e-15, 1e12)  # kg, or kg m2
RATE = (1e-9, 1e9)  # Hz
TIME = 1e12  # s, on either side of zero
INTERVAL = (1e-9, 1e9)  # s
READING = 1e6  # m or rad, on either side of zero
MOTION = 1e-15  # m or rad from the lowest to the highest reading, at least
PRIOR = 1e30  # SI, on either side of zero
WINDOW = 1_000_000  # samples
ORDER = 20  # of a Savitzky-Golay filter
NAME_LENGTH = 200  # characters of a title, a case or a column
FILE_LENGTH = 1000  # characters of a path; each folder and file 255 bytes, as file systems allow
TOML_BYTES = 4 * 2**20
TOML_LINE = 20_000  # characters: the time that a key of n dotted parts takes goes with n squared
TABLE_BYTES = 2**30

# Control characters, line and paragraph separators, and marks that turn the direction of writing:
# in a terminal or a page they show something else than what is there.
UNSEEN = r"\p{Cc}\p{Zl}\p{Zp}\u{202A}-\u{202E}\u{2066}-\u{2069}"


def regular_file(path: Path, where: str, most: int) -> int:
    """Size of a file, bytes; refused when it is none, or too large to be what it should be.

    Raises
    ------
    InputError : a folder, a device, a pipe, nothing at all, or more than `most` bytes
    """
    try:
        found = os.stat(path)
    except FileNotFoundError:
        raise InputError(where, f"no such file at {path}", "a readable file") from None
    except (OSError, ValueError) as error:
        words = (getattr(error, "strerror", None) or str(error)).lower()
        raise InputError(where, f"{words} at {path}", "a readable file") from None
    if stat.S_ISDIR(found.st_mode):
        raise InputError(where, f"a folder at {path}", "a readable file")
    if not stat.S_ISREG(found.st_mode):
        raise InputError(where, f"a device or a pipe at {path}", "a regular file")
    if found.st_size > most:
        size = f"{found.st_size / 2**20:.0f} MiB at {path}"
        raise InputError(where, size, f"at most {most / 2**20:.0f} MiB")
    return found.st_size


def inside(path: Path, folders: Sequence[Path], where: str) -> None:
    """Refuse a path that leaves the campaign's folder, the first, and others given beside it.

    Raises
    ------
    InputError
    """
    try:
        end = path.resolve()
        outside = not any(end.is_relative_to(folder.resolve()) for folder in folders)
    except (OSError, ValueError, RuntimeError):
        return  # what is wrong with it is said when it is opened
    if outside:
        accepted = f"a file inside {folders[0]}, or inside a folder given with --data"
        raise InputError(where, f"a path that leads out of the campaign's folder, {end}", accepted)


def check_readings(samples: NDArray[np.float64], unit: str, where: str) -> None:
    """Refuse readings (n,), m or rad, of a size that no probe reads.

    Raises
    ------
    InputError : too large, or all the same within `MOTION`
    """
    largest = float(np.max(np.abs(samples)))
    if largest > READING:
        raise InputError(
            where, f"a reading of {largest:.3g} {unit}", f"at most {READING:g} {unit}: see the unit"
        )
    extent = float(np.ptp(samples))
    if 0.0 < extent < MOTION:
        found = f"readings that differ by {extent:.3g} {unit} at most"
        raise InputError(where, found, f"a motion of {MOTION:g} {unit} or more: see the unit")


def check_interval(interval: float, where: str) -> None:
    """Refuse a sampling interval, s, that no clock keeps.

    Raises
    ------
    InputError
    """
    if not INTERVAL[0] <= interval <= INTERVAL[1]:
        accepted = f"{INTERVAL[0]:g} s to {INTERVAL[1]:g} s"
        raise InputError(where, f"samples {interval:.3g} s apart", accepted)
