# SPDX-License-Identifier: Apache-2.0
"""Key files, created by `tendond keygen` and shared by client and server."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

_DIGITS = re.compile("[0-9a-fA-F]{64}")
_FEWEST_DIFFERENT = 18


def read_key(file: Path | str) -> bytes:
    """Returns the 32 bytes in a key file. The file contains one line with `controller` or `observer` and 64 hexadecimal
    digits. A line is ignored if it is empty or if it begins with #.

    Raises ValueError, with a message that does not contain the key, if the file is not a key file or the key is
    weak; OSError if it is unreadable or not a regular file; PermissionError if other users may read it.
    """
    if not stat.S_ISREG(os.stat(file).st_mode):  # check before opening, because opening a pipe would block
        raise OSError(f"cannot read key file {file}: it is not a regular file")
    with open(file, encoding="utf-8-sig") as text:
        if os.name == "posix" and os.fstat(text.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise PermissionError(
                f"{file}: other users can read or write this key; run `chmod 600` on it, and create a new key if others "
                "may have read it"
            )
        lines = [line.split() for line in text if line.strip() and not line.lstrip().startswith("#")]
    match lines:
        case [["controller" | "observer", digits]] if _DIGITS.fullmatch(digits):
            key = bytes.fromhex(digits)
        case _:
            raise ValueError(f"{file}: expected one line, `controller` or `observer` and 64 hexadecimal digits")
    if _weak(key):
        raise ValueError(f"{file}: the key is weak; create one with `tendond keygen NAME`")
    return key


def _weak(key: bytes) -> bool:
    """Returns True if a key repeats a few bytes, counts up, or is typed text. The probability that a random key is
    rejected is less than one in 10⁹."""
    steps = {(after - before) % 256 for before, after in zip(key, key[1:])}
    return min(len(set(key)), len(steps)) < _FEWEST_DIFFERENT or all(0x20 <= byte < 0x7F for byte in key)
