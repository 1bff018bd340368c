# SPDX-License-Identifier: Apache-2.0
"""Round-trip time and retransmission timeout (RFC 6298)."""


class RoundTrip:
    """All times are in nanoseconds."""

    FIRST_TIMEOUT = 100_000_000
    """Timeout before the first sample. The peer is known to be available after the handshake."""

    def __init__(self) -> None:
        self.newest = 0
        self.smoothed = 0
        self.variation = 0
        self._known = False

    def observe(self, sample: int) -> None:
        self.newest = sample
        if self._known:
            error = sample - self.smoothed
            self.variation += (abs(error) - self.variation) // 4
            self.smoothed += error // 8
        else:
            self.smoothed = sample
            self.variation = sample // 2
            self._known = True

    def timeout(self, minimum: int) -> int:
        return max(minimum, self.smoothed + 4 * self.variation if self._known else self.FIRST_TIMEOUT)
