# SPDX-License-Identifier: Apache-2.0
"""What need not be sent: forces that a hand cannot tell apart, and states that their receiver can foretell (SESSION.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import dist, hypot

from .messages import DeviceState, SetStateDeadband, Vec3


@dataclass(frozen=True, kw_only=True)
class ForceDeadband:
    """Leaves out a force unless it differs from the last one sent by more than max(share · its norm, floor), or that one was
    sent `longest_silence_s` ago (Weber's law; Hinterseer et al., IEEE TSP 56(2), 2008)."""

    share: float = 0.10
    """0 … 1; the just noticeable difference of force is 7 to 15 %."""
    floor: float = 0.05
    """N: below it everything counts as nothing."""
    longest_silence_s: float = 0.02
    """So that a force that was lost does not stay wrong."""

    def __post_init__(self) -> None:
        if not 0 <= self.share <= 1:
            raise ValueError("deadband: share: expected 0 to 1")
        if not self.floor >= 0:
            raise ValueError("deadband: floor: must not be negative")
        if not self.longest_silence_s > 0:
            raise ValueError("deadband: longest_silence_s: must be above zero")


class Deadband:
    """Of one session."""

    def __init__(self, config: ForceDeadband) -> None:
        self._config = config
        self._silence_ns = round(config.longest_silence_s * 1e9)
        self._sent: tuple[int, Vec3] | None = None

    def passes(self, now: int, value: Vec3) -> bool:
        """Whether `value` is worth sending; if so it counts as sent."""
        if self._sent is not None and now - self._sent[0] < self._silence_ns:
            before = self._sent[1]
            if dist(value, before) <= max(self._config.share * hypot(*before), self._config.floor):
                return False
        self._sent = (now, value)
        return True


def foretell(sent: DeviceState, later_ns: int, haptic_period_ns: int) -> DeviceState:
    """Where the device is `later_ns` after `sent`, on the line that it was on, in whole haptic periods."""
    periods = max(later_ns // haptic_period_ns, 0)
    time_s = periods * haptic_period_ns / 1e9
    x, y, z = (at + speed * time_s for at, speed in zip(sent.position, sent.velocity))
    return replace(
        sent, tick=sent.tick + periods, sampled_ns=sent.sampled_ns + periods * haptic_period_ns, position=(x, y, z)
    )


def objection(asked: SetStateDeadband) -> str:
    """What a server will not grant; empty when it will."""
    if asked.max_silence_us == 0:
        return ""
    if not 0 <= asked.share <= 0.5:
        return "share: expected 0 to 0.5"
    if not 0 <= asked.floor <= 0.1:
        return "floor: expected 0 to 0.1 m/s"
    if not 1000 <= asked.max_silence_us <= 20_000:
        return "max_silence_us: expected 0, or 1000 to 20000"
    return ""
