# SPDX-License-Identifier: Apache-2.0
"""Remembers received packet numbers, so that each packet is accepted only once."""


class ReplayWindow:
    """Call `contains` before using a packet, and `insert` after it was authenticated, so that a forged packet cannot
    consume the number of a real one.
    """

    REMEMBERED = 1984
    """Size of the window behind the newest number. Older numbers are treated as received."""

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
        """Returns a bit mask in which bit i is set if (number − 1 − i) was inserted."""
        return self._seen >> self.highest - number + 1 & 0xFFFFFFFF

    def missing(self) -> int:
        """Returns the number of missing packets from 0 to the highest number."""
        return self.highest + 1 - self._count
