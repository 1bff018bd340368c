# SPDX-License-Identifier: Apache-2.0
"""Deadbands drop forces that a hand cannot tell apart, and states that their receiver can predict (SESSION.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import dist, hypot

from .expect import expect
from .messages import DeviceState, SetStateDeadband, Vec3


@dataclass(frozen=True, kw_only=True)
class ForceDeadband:
    """Leaves out a force unless it differs from the last one sent by more than max(share · its norm, floor), or that one was
    sent `longest_silence_s` ago (Weber's law; Hinterseer et al., IEEE TSP 56(2), 2008)."""

    share: float = 0.10
    """0 … 1; the just noticeable difference of force is 7 to 15 %."""
    floor: float = 0.05
    """N: a smaller change is left out until the longest silence."""
    longest_silence_s: float = 0.02
    """Bounds how long the device renders an old force after a loss."""

    def __post_init__(self) -> None:
        expect(0 <= self.share <= 1, "deadband.share", self.share, "0 to 1")
        expect(self.floor >= 0, "deadband.floor", self.floor, "0 or more")
        expect(self.longest_silence_s > 0, "deadband.longest_silence_s", self.longest_silence_s, "more than 0")


class Deadband:
    """The deadband of forces in one session."""

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
    """The device's position `later_ns` after `sent` at constant velocity, in whole haptic periods."""
    periods = max(later_ns // haptic_period_ns, 0)
    time_s = periods * haptic_period_ns / 1e9
    x, y, z = (at + speed * time_s for at, speed in zip(sent.position, sent.velocity))
    return replace(
        sent, tick=sent.tick + periods, sampled_ns=sent.sampled_ns + periods * haptic_period_ns, position=(x, y, z)
    )


def check_state_deadband(asked: SetStateDeadband) -> None:
    """Raises ValueError when no server grants this deadband."""
    if asked.max_silence_us == 0:
        return
    expect(0 <= asked.share <= 0.5, "state_deadband.share", asked.share, "0 to 0.5")
    expect(0 <= asked.floor <= 0.1, "state_deadband.floor", asked.floor, "0 to 0.1 m/s")
    silence = asked.max_silence_us
    expect(1000 <= silence <= 20_000, "state_deadband.max_silence_us", silence, "0, or 1000 to 20000")
