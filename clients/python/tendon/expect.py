# SPDX-License-Identifier: Apache-2.0
"""Error messages for invalid values."""

from __future__ import annotations


def expect(holds: bool, field: str, value: object, expected: str) -> None:
    """Raises ValueError "FIELD = VALUE: expected …" unless `holds`."""
    if not holds:
        raise ValueError(f"{field} = {value}: expected {expected}")
