# SPDX-License-Identifier: Apache-2.0
"""Teleoperation of a robot by the hand at a Tendon server, with force feedback.

    follow = Follower(FollowerConfig(scale=0.5, clutch_button=1))

    def move(target):                                        # None: the robot must hold its pose
        robot.hold() if target is None else robot.go_to(target)

    def step(hand):
        move(follow.target(hand, robot.pose(), time.monotonic_ns()))
        return follow.touch(robot.contact())

    with tendon.Client(server, tendon.Config(name="robot", rate_hz=500)) as client:
        client.drive(step, on_silence=lambda now: move(follow.silence(now)))

With positions p, orientations q, the hand l (leader), the tool f (follower), and 0 for the values at the time of
engaging:

    p_f = p_f0 + s_x R M (p_l − p_l0)        q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0        M selects the coupled axes
    F_l = s_f M Rᵀ F_f                       τ_l = s_f / s_x Rᵀ τ_f               K_l = s_f s_x M Rᵀ K_f R M

so the power at the hand is s_f / s_x times the power at the tool. There are equivalent implementations in C++ and
TypeScript; tests/clients/follower_cases.json checks all three.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from .expect import expect
from .messages import Contact, DeviceState, Mat3, Mode, Quat, Reason, Touch, Vec3

log = logging.getLogger("tendon")

_SMOOTHING_NS = 1e9  # time constant of the delay filter
_LONGEST_STEP_NS = 100_000_000  # after a pause of the robot program, the target does not jump

NO_CONTACT = "the robot measures no contact force: the hand feels nothing"
BAD_POSE = "the robot's pose is not finite: disengaged"


class Following(IntEnum):
    ALONE = 1  # no state has arrived
    COUPLED = 2  # states arrive; the robot stands still until the operator engages
    ENGAGED = 4  # the robot follows the hand
    CLUTCHED = 5  # the hand moves freely and the robot holds its pose
    LOST = 6  # states stopped; the operator must engage again


class Pose(NamedTuple):
    """Pose of the tool, or its target, in the frame of the robot."""

    position: Sequence[float]  # m
    orientation: Sequence[float] | None = None  # unit quaternion w, x, y, z; None: only the position is controlled
    grip: float | None = None  # opening of the gripper, m or rad; None: no gripper


class ToolContact(NamedTuple):
    """Force of the environment on the tool, in the frame of the robot. For example, a table exerts an upward force."""

    force: Sequence[float]  # N
    torque: Sequence[float] | None = None  # N·m, about the position of the tool
    stiffness: float | None = None  # N/m, > 0, of the surface along its normal, if known
    normal: Sequence[float] | None = None  # points from the surface to the tool; None: along the force
    grip_force: float | None = None  # N, on the fingers; > 0 opens them


@dataclass(frozen=True, kw_only=True)
class FollowerConfig:
    """Mapping from the hand to the tool. Raises ValueError "FIELD = VALUE: expected …" for invalid values."""

    scale: float = 1.0  # s_x, motion of the follower / motion of the leader, 0.01 … 100
    force_scale: float = 1.0  # s_f, force on the leader / force on the follower, 0.01 … 100
    rotation: Quat = (1.0, 0.0, 0.0, 0.0)  # R, from the device base frame to the robot frame; norm 1 ± 1e-3
    axes: str = "xyz"  # coupled axes of the device; the others move freely without force
    clutch_button: int | None = None  # 0 … 31, clutched while pressed. None: only engage() and disengage()
    toggle: bool = False  # each press switches between engaged and clutched
    engage_by: str = "button"  # "button": pressing and releasing the clutch (toggle: pressing it); "call": engage()
    speed: float = 0.25  # m/s, 0.001 … 10, maximum speed of the target
    spin: float = 2.0  # rad/s, 0.01 … 100, maximum angular speed of the target
    ramp_s: float = 0.3  # 0 … 10, duration of the force ramp after engaging
    grip_ratio: float = 1.0  # opening of the robot's gripper / opening of the hand's gripper, 0.001 … 1000
    grip_speed: float = 0.1  # m/s or rad/s, 0.001 … 100, maximum speed of the gripper
    rate_hz: float = 500.0  # rate at which `target` is called, 1 … 100000

    def __post_init__(self) -> None:
        def between(least: float, most: float, **fields: float) -> None:
            for name, value in fields.items():
                expect(least <= value <= most, name, f"{value:g}", f"{least:g} to {most:g}")

        between(0.01, 100, scale=self.scale, force_scale=self.force_scale)
        length = math.sqrt(sum(c * c for c in self.rotation))
        expect(len(self.rotation) == 4 and abs(length - 1) <= 1e-3, "rotation", f"of length {length:g}", "a unit quaternion")
        known = self.axes != "" and self.axes in ("x", "y", "z", "xy", "xz", "yz", "xyz")
        expect(known, "axes", f'"{self.axes}"', 'one or more of the letters "xyz", in this order')
        if self.clutch_button is not None:
            between(0, 31, clutch_button=self.clutch_button)
        expect(self.engage_by in ("button", "call"), "engage_by", f'"{self.engage_by}"', '"button" or "call"')
        by_button = self.engage_by == "button" and self.clutch_button is None
        expect(not by_button, "engage_by", '"button"', '"call" without clutch_button')
        expect(not (self.toggle and self.clutch_button is None), "toggle", "true", "false without clutch_button")
        between(0.001, 10, speed=self.speed)
        between(0.01, 100, spin=self.spin)
        between(0, 10, ramp_s=self.ramp_s)
        between(0.001, 1000, grip_ratio=self.grip_ratio)
        between(0.001, 100, grip_speed=self.grip_speed)
        between(1, 100000, rate_hz=self.rate_hz)


class Follower:
    """Position mapping, clutch and reaction to loss of connection. This class does not use clocks, threads or
    sockets.

    The robot does not move until the operator engages with the button or with engage(). The offset is defined by
    the poses at that time, so that the robot does not move when it is engaged or when the clutch is released. The
    reaction to missing states depends on the age of the newest state beyond the smoothed delay, where v is three
    periods, at least 20 ms:

        v             the target stops
        v + 20 ms     None: the robot must hold its pose
        v + 250 ms    lost: new states couple again, but the operator must engage again

    Absolute times of the two clocks are never compared. The coupling ends if the device has a fault or is
    disarmed, or if a pose is not finite.
    """

    def __init__(self, config: FollowerConfig) -> None:
        self._config = config
        self._scale, self._force_scale = config.scale, config.force_scale
        self._turn = _unit(config.rotation)
        self._phase = Following.ALONE
        self._words = ""
        self._asked = False  # engage() was called
        self._held = True  # button in the newest state; initially True, so that a press counts only after a release
        self._tick = 0
        self._sampled = 0  # ns, of the newest state
        self._base: int | None = None  # ns, delay of the first state, including the offset of the clocks
        self._usual = 0.0  # ns, smoothed delay, relative to _base
        self._now = 0  # ns
        self._gain_from = 0  # ns, start of the force ramp
        self._waits = False  # target() has returned None since the last target
        self._hand0: tuple[Vec3, Quat | None] = ((0.0, 0.0, 0.0), None)
        self._pose0 = Pose((0.0, 0.0, 0.0))
        self._target = self._pose0
        self._late_ns = max(round(3e9 / config.rate_hz), 20_000_000)  # v

    @property
    def phase(self) -> Following:
        return self._phase

    @property
    def words(self) -> str:
        """Newest message for the operator. Each message is logged once."""
        return self._words

    def engage(self) -> bool:
        """Engages at the next state. Returns False and does nothing unless the phase is COUPLED."""
        self._asked = self._phase is Following.COUPLED
        return self._asked

    def disengage(self) -> None:
        """Stops the robot until the operator engages again."""
        self._asked = False
        if self._phase in (Following.ENGAGED, Following.CLUTCHED):
            self._phase = Following.COUPLED

    def set_scale(self, scale: float, force_scale: float) -> bool:
        """Has no effect and returns False while the robot follows. Raises ValueError if a scale is out of bounds."""
        FollowerConfig(scale=scale, force_scale=force_scale, engage_by="call")
        if self._phase is Following.ENGAGED:
            return False
        self._scale, self._force_scale = float(scale), float(force_scale)
        return True

    def target(self, hand: DeviceState, pose: Pose, now_ns: int) -> Pose | None:
        """Returns the next target of the tool, which moves at most at `speed`, or None if the robot must hold its
        pose. `pose` is the current pose of the tool. `now_ns` is the arrival time of the state, from any monotonic
        clock."""
        elapsed = self._advance(now_ns)
        if hand.tick < self._tick:
            self._lose()  # the server has been replaced or restarted
        age = self._take(hand)
        if age > self._late_ns + 250_000_000:
            self._lose()
        fresh = self._phase is not Following.LOST and age <= self._late_ns
        if not _finite(pose):
            self.disengage()
            self._say(BAD_POSE)
        else:
            self._act(hand, pose, fresh)
        if self._phase is not Following.ENGAGED or age > self._late_ns + 20_000_000:
            self._waits = True
            return None
        if self._waits:
            self._waits, self._target, elapsed = False, pose, 0
        if fresh:
            self._approach(hand, elapsed / 1e9)
        return self._target

    def silence(self, now_ns: int) -> Pose | None:
        """This must be called every few milliseconds if no state arrives. At first, it returns the last target. Later,
        it returns None."""
        self._advance(now_ns)
        if self._phase is not Following.ENGAGED or self._age() > self._late_ns + 20_000_000:
            self._waits = True
            return None
        return self._target

    def touch(self, contact: ToolContact | None) -> Touch | None:
        """Returns the force on the hand for a contact of the tool; the force is zero while the robot does not follow.
        Returns None, which is not sent, if `contact` is None, because a zero force would look like a measurement."""
        if contact is None:
            self._say(NO_CONTACT)
            return None
        if self._phase is not Following.ENGAGED:
            return Touch()
        ramp_ns = self._config.ramp_s * 1e9
        gain = self._force_scale * (min((self._now - self._gain_from) / ramp_ns, 1.0) if ramp_ns > 0 else 1.0)
        back = _inverse(self._turn)
        lever = gain / self._scale
        force = _times(gain, self._masked(_rotated(back, contact.force)))
        torque = None if contact.torque is None else _times(lever, _rotated(back, contact.torque))
        grip = None if contact.grip_force is None else lever * self._config.grip_ratio * contact.grip_force
        stiffness, surface = self._surface(contact, back, gain)
        return Touch(force, stiffness, contact=surface, torque=torque, grip_force=grip)

    def _surface(self, contact: ToolContact, back: Quat, gain: float) -> tuple[Mat3 | None, Contact | None]:
        """Transforms stiffness and surface to the units of the hand, if both are known."""
        k, normal = contact.stiffness, contact.force if contact.normal is None else contact.normal
        length = math.hypot(*normal)
        if k is None or not k > 0 or not 0 < length < math.inf:
            return None, None
        n = _rotated(back, _times(1 / length, normal))
        m = self._masked(n)
        stiffness = gain * self._scale * k
        a, b, c = (_times(stiffness * along, m) for along in m)
        depth = sum(f * e for f, e in zip(contact.force, normal)) / length / (k * self._scale)
        return (a, b, c), Contact(n, -depth) if self._config.axes == "xyz" else None

    def _advance(self, now_ns: int) -> int:
        """Advances the time. Returns the elapsed time in ns, at most _LONGEST_STEP_NS."""
        elapsed, self._now = max(now_ns - self._now, 0), max(now_ns, self._now)
        if self._base is not None and self._age() > self._late_ns + 250_000_000:
            self._lose()
        return min(elapsed, _LONGEST_STEP_NS)

    def _age(self) -> float:
        """Age of the newest state beyond the smoothed delay, ns."""
        return 0.0 if self._base is None else (self._now - self._sampled - self._base) - self._usual

    def _take(self, hand: DeviceState) -> float:
        """Records a new state and returns its age on arrival. The first state after a silence defines the base of the
        delay."""
        if self._base is None:
            self._base, self._usual = self._now - hand.sampled_ns, 0.0
            self._sampled = hand.sampled_ns
            self._phase = Following.COUPLED
            self._asked, self._held = False, True
        period = max(hand.sampled_ns - self._sampled, 0)
        self._tick, self._sampled = hand.tick, hand.sampled_ns
        age = self._age()
        self._usual += min(period / _SMOOTHING_NS, 1.0) * age
        return age

    def _lose(self) -> None:
        self._phase, self._base, self._asked = Following.LOST, None, False
        self._tick = 0

    def _act(self, hand: DeviceState, pose: Pose, fresh: bool) -> None:
        """Handles the clutch button and engage()."""
        config = self._config
        button = config.clutch_button
        held = button is not None and bool(hand.buttons >> button & 1)
        pressed = held and not self._held
        self._held = held
        if hand.mode is Mode.FAULT or hand.reasons & (Reason.FAULT | Reason.DISARMED):
            self.disengage()
            return
        if not fresh:
            return
        asked, self._asked = self._asked, False
        phase = self._phase
        if phase is Following.COUPLED:
            if asked:
                self._begin(hand, pose)
            elif pressed and config.engage_by == "button":
                self._phase = Following.CLUTCHED
                if config.toggle:
                    self._begin(hand, pose)
        elif phase is Following.ENGAGED and pressed:
            self._phase = Following.CLUTCHED
        elif phase is Following.CLUTCHED and (pressed if config.toggle else not held):
            self._begin(hand, pose)

    def _begin(self, hand: DeviceState, pose: Pose) -> None:
        """Engages. The offset is chosen so that the target is the current pose."""
        self._phase, self._gain_from = Following.ENGAGED, self._now
        self._hand0 = (hand.position, hand.turning.orientation if hand.turning else None)
        self._pose0 = pose
        self._waits = True

    def _approach(self, hand: DeviceState, seconds: float) -> None:
        """Moves the target toward the pose of the hand within the speed limits."""
        config, last = self._config, self._target
        moved = self._masked([a - b for a, b in zip(hand.position, self._hand0[0])])
        wanted = [a + b for a, b in zip(self._pose0.position, _times(self._scale, _rotated(self._turn, moved)))]
        way = [a - b for a, b in zip(wanted, last.position)]
        share = _share(math.hypot(*way), config.speed * seconds)
        position = tuple(a + share * b for a, b in zip(last.position, way))
        orientation = last.orientation
        start, turning = self._hand0[1], hand.turning
        if start is not None and turning is not None and orientation is not None and self._pose0.orientation is not None:
            turned = _product(turning.orientation, _inverse(start))
            turned = _product(_product(self._turn, turned), _inverse(self._turn))
            w, *axis = _product(_product(turned, self._pose0.orientation), _inverse(orientation))
            sine = math.hypot(*axis)
            angle = 2 * math.atan2(sine, abs(w))
            part = _share(angle, config.spin * seconds) * angle / 2
            along = 0.0 if sine == 0 else math.copysign(math.sin(part) / sine, w)
            orientation = _unit(_product((math.cos(part), *_times(along, axis)), orientation))
        grip = last.grip
        if grip is not None and hand.grip is not None:
            way_to_go = config.grip_ratio * hand.grip.opening - grip
            grip += _share(abs(way_to_go), config.grip_speed * seconds) * way_to_go
        self._target = Pose(position, orientation, grip)

    def _masked(self, v: Sequence[float]) -> Vec3:
        x, y, z = (c if axis in self._config.axes else 0.0 for axis, c in zip("xyz", v))
        return (x, y, z)

    def _say(self, words: str) -> None:
        if words != self._words:
            self._words = words
            log.warning("%s", words)


def _finite(pose: Pose) -> bool:
    numbers = [*pose.position, *(pose.orientation or ()), *(() if pose.grip is None else (pose.grip,))]
    return all(map(math.isfinite, numbers))


def _share(whole: float, most: float) -> float:
    """Returns the factor that limits a displacement of length `whole` to `most`."""
    return 1.0 if whole <= most else most / whole


def _times(factor: float, v: Sequence[float]) -> Vec3:
    x, y, z = v
    return (factor * x, factor * y, factor * z)


def _product(a: Sequence[float], b: Sequence[float]) -> Quat:
    (p, i, j, k), (w, x, y, z) = a, b
    return (
        p * w - i * x - j * y - k * z,
        p * x + i * w + j * z - k * y,
        p * y - i * z + j * w + k * x,
        p * z + i * y - j * x + k * w,
    )


def _inverse(q: Sequence[float]) -> Quat:
    w, x, y, z = q
    return (w, -x, -y, -z)


def _rotated(q: Quat, v: Sequence[float]) -> Vec3:
    _, x, y, z = _product(_product(q, (0.0, *v)), _inverse(q))
    return (x, y, z)


def _unit(q: Sequence[float]) -> Quat:
    length = math.sqrt(sum(c * c for c in q))
    w, x, y, z = (c / length for c in q)
    return (w, x, y, z)
