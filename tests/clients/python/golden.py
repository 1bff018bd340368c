# SPDX-License-Identifier: Apache-2.0
"""Reads the golden datagrams in protocol/vectors/golden.md."""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[3] / "protocol" / "vectors" / "golden.md"


def golden_datagrams(page: str) -> dict[str, bytes]:
    """Returns the bytes by name. `00 x9` means nine zeros, and a semicolon is the beginning of a comment."""
    datagrams = {}
    for name, block in re.findall(r"^```golden (\S+)\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        datagram = bytearray()
        for line in block.splitlines():
            for word in line.partition(";")[0].split():
                if word.startswith("x"):
                    datagram += datagram[-1:] * (int(word[1:]) - 1)
                else:
                    datagram += bytes.fromhex(word)
        datagrams[name] = bytes(datagram)
    return datagrams
