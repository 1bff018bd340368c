# SPDX-License-Identifier: Apache-2.0
"""Deadbands that omit indistinguishable forces and predictable states (SESSION.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, dist, hypot, sin

from .expect import expect
from .messages import ZERO, DeviceState, Quat, SetStateDeadband, Vec3


@dataclass(frozen=True, kw_only=True)
class ForceDeadband:
    """Omits a force, with its torque and grip force, unless it differs from the last one sent by more than max(share
    · its norm, floor), or that one was sent `longest_silence_s` ago (Weber's law; Hinterseer et al., IEEE TSP
    56(2), 2008)."""

    share: float = 0.10
    """0 … 1. The just noticeable difference of force is 7 to 15 %."""
    floor: float = 0.05
    """N. Smaller changes are omitted, but only for the longest silence."""
    longest_silence_s: float = 0.02
    """This limits how long an old force is rendered by the device after a packet loss."""

    def __post_init__(self) -> None:
        expect(0 <= self.share <= 1, "deadband.share", self.share, "0 to 1")
        expect(self.floor >= 0, "deadband.floor", self.floor, "0 or more")
        expect(self.longest_silence_s > 0, "deadband.longest_silence_s", self.longest_silence_s, "more than 0")


HANDLE_LEVER = 0.05
"""The distance from the center to the end of a handle, m. It is used to convert the floor of a force (N) to that of a
torque (N·m)."""


class Deadband:
    """The force deadband of one session, including torques and grip forces."""

    def __init__(self, config: ForceDeadband) -> None:
        self._config = config
        self._silence_ns = round(config.longest_silence_s * 1e9)
        self._sent: tuple[int, Vec3, Vec3 | None, float | None] | None = None

    def passes(self, now: int, force: Vec3, torque: Vec3 | None = None, grip_force: float | None = None) -> bool:
        """Returns True if one of the three values must be sent, or if it has appeared or disappeared. In this case, all
        of them are recorded as sent."""
        if self._sent is not None and now - self._sent[0] < self._silence_ns:
            _, force_before, torque_before, grip_before = self._sent
            same_parts = (torque is None, grip_force is None) == (torque_before is None, grip_before is None)
            floor = self._config.floor
            if (
                same_parts
                and self._alike(force, force_before, floor)
                and self._alike(torque or ZERO, torque_before or ZERO, floor * HANDLE_LEVER)
                and self._alike((grip_force or 0.0,), (grip_before or 0.0,), floor)
            ):
                return False
        self._sent = (now, force, torque, grip_force)
        return True

    def _alike(self, value: Sequence[float], before: Sequence[float], floor: float) -> bool:
        return dist(value, before) <= max(self._config.share * hypot(*before), floor)


def predict(sent: DeviceState, later_ns: int, haptic_period_ns: int) -> DeviceState:
    """Predicts the device state `later_ns` after `sent` with constant velocities of position, rotation and gripper,
    in whole haptic periods."""
    periods = max(later_ns // haptic_period_ns, 0)
    time_s = periods * haptic_period_ns / 1e9
    x, y, z = (at + speed * time_s for at, speed in zip(sent.position, sent.velocity))
    turning, grip = sent.turning, sent.grip
    if turning is not None and periods > 0:
        turning = replace(turning, orientation=_turned(turning.orientation, turning.angular_velocity, time_s))
    if grip is not None:
        grip = replace(grip, opening=grip.opening + grip.velocity * time_s)
    return replace(
        sent,
        tick=sent.tick + periods,
        sampled_ns=sent.sampled_ns + periods * haptic_period_ns,
        position=(x, y, z),
        turning=turning,
        grip=grip,
    )


def _turned(q: Quat, angular_velocity: Vec3, time_s: float) -> Quat:
    """Rotates q with a constant angular velocity and normalizes it."""
    speed = hypot(*angular_velocity)
    half = speed * time_s / 2
    s = sin(half) / speed if speed > 0 else 0.0
    a, (b, c, d) = cos(half), (s * v for v in angular_velocity)
    w, x, y, z = q
    turned = (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
    length = hypot(*turned)
    return (turned[0] / length, turned[1] / length, turned[2] / length, turned[3] / length)


def check_state_deadband(asked: SetStateDeadband) -> None:
    """Raises ValueError if no server would accept this deadband."""
    if asked.max_silence_us == 0:
        return
    expect(0 <= asked.share <= 0.5, "state_deadband.share", asked.share, "0 to 0.5")
    expect(0 <= asked.floor <= 0.1, "state_deadband.floor", asked.floor, "0 to 0.1 m/s")
    silence = asked.max_silence_us
    expect(1000 <= silence <= 20_000, "state_deadband.max_silence_us", silence, "0, or 1000 to 20000")
