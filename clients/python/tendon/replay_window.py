# SPDX-License-Identifier: Apache-2.0
"""Remembers which packet numbers have arrived, so that each packet is accepted once."""


class ReplayWindow:
    """Ask `contains` before using a packet, and `insert` it once it is authentic, so that a forged packet cannot
    use up the number of a real one.
    """

    REMEMBERED = 1984
    """Numbers behind the newest that are remembered; older ones count as seen."""

    _MASK = (1 << REMEMBERED) - 1

    def __init__(self) -> None:
        self.highest = -1
        self._seen = 0  # bit i: highest − i has been inserted
        self._count = 0

    def contains(self, number: int) -> bool:
        age = self.highest - number
        if age < 0:
            return False
        return age >= self.REMEMBERED or bool(self._seen >> age & 1)

    def insert(self, number: int) -> None:
        """`number` must not be contained."""
        ahead = number - self.highest
        if ahead > 0:
            self._seen = self._seen << ahead & self._MASK if ahead < self.REMEMBERED else 0
            self.highest = number
        self._seen |= 1 << self.highest - number
        self._count += 1

    def mask_before(self, number: int) -> int:
        """Bit i: (number − 1 − i) is known to have been inserted."""
        return self._seen >> self.highest - number + 1 & 0xFFFFFFFF

    def missing(self) -> int:
        """Numbers from 0 to the highest that were never inserted."""
        return self.highest + 1 - self._count
