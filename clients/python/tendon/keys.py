# SPDX-License-Identifier: Apache-2.0
"""Key files. `tendond keygen` writes them, and both ends of a conversation have the same one."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

_DIGITS = re.compile("[0-9a-fA-F]{64}")
_FEWEST_DIFFERENT = 18


def read_key(file: Path | str) -> bytes:
    """The 32 bytes in a key file: one line, `controller` or `observer` and 64 hexadecimal digits; empty lines and
    those that begin with # are comments.

    Raises ValueError with a sentence (never with the key) when it is no key file or the key is weak, OSError when it
    cannot be read or is a folder or a pipe, PermissionError when others may read it.
    """
    if not stat.S_ISREG(os.stat(file).st_mode):  # before it is opened: a pipe would wait for ever
        raise OSError(f"{file}: cannot read this key: it is not a regular file")
    with open(file, encoding="utf-8-sig") as text:
        if os.name == "posix" and os.fstat(text.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise PermissionError(f"{file}: others may read this key; chmod 600 {file}")
        lines = [line.split() for line in text if line.strip() and not line.lstrip().startswith("#")]
    match lines:
        case [["controller" | "observer", digits]] if _DIGITS.fullmatch(digits):
            key = bytes.fromhex(digits)
        case _:
            raise ValueError(f"{file}: expected one line, `controller` or `observer` and 64 hexadecimal digits")
    if _weak(key):
        raise ValueError(f"{file}: the key is weak; make one with `tendond keygen NAME`")
    return key


def _weak(key: bytes) -> bool:
    """Whether a key repeats a few bytes, counts up, or is typed text. Fewer than one in 10⁹ random keys are called
    weak."""
    steps = {(after - before) % 256 for before, after in zip(key, key[1:])}
    return min(len(set(key)), len(steps)) < _FEWEST_DIFFERENT or all(0x20 <= byte < 0x7F for byte in key)
