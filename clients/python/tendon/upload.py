# SPDX-License-Identifier: Apache-2.0
"""Sends a field to a server, and asks the server to use it. These are state machines, whose inputs are times and the
messages of the session."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .expect import expect
from .limits import UNIT_TOLERANCE
from .messages import (
    NEVER,
    Code,
    ControlAck,
    DropField,
    FieldBrick,
    FieldDepthTable,
    FieldFixture,
    FieldMaterial,
    FieldPose,
    FieldStatus,
    Grant,
    Instant,
    OfferField,
    Quat,
    Role,
    UseField,
    Vec3,
)
from .session import Session

MAX_PART = 1000
"""Bytes of a manifest in one request, so that it fits into a datagram."""

_BRICK_BYTES = 1024
_JITTER_NS = 10_000_000  # of a status, beyond the round trip
_ASK_AGAIN_NS = 50_000_000
_POSE_PERIOD_NS = 4_000_000  # the limit of a server is 250 poses per second
_MOST_PARTS = 12  # of limits.REQUEST_WINDOW, so that other requests do not have to wait


@dataclass(frozen=True)
class Description:
    """A field as it is sent."""

    name: bytes  # BLAKE2b-256 of the manifest
    manifest: bytes
    bricks: tuple[FieldBrick, ...]  # in the order of the manifest
    materials: tuple[FieldMaterial, ...]
    fixtures: tuple[FieldFixture, ...]
    tables: tuple[FieldDepthTable, ...] = ()


class BrickPace:
    """Limits the rate of bricks (the generic cell rate algorithm of ATM, ITU-T I.371)."""

    def __init__(self, bytes_per_s: float, burst_ns: int) -> None:
        """Up to `burst_ns` can be sent at once after a pause."""
        expect(1 <= bytes_per_s <= 1e9, "bytes_per_s", bytes_per_s, "1 to 1e9")
        expect(burst_ns >= 0, "burst_ns", burst_ns, "0 or more")
        self._interval = round(1e9 * _BRICK_BYTES / bytes_per_s)
        self._burst = burst_ns
        self.next = 0

    def passes(self, now: int) -> bool:
        """Returns False if the rate is exceeded."""
        if self.next > now:
            return False
        self.next = max(self.next, now - self._burst) + self._interval
        return True


class FieldSender:
    """Uploads a field. It sends the manifest, waits for a status, and sends the missing bricks at a limited rate. If a
    brick was sent more than a round trip before a status and is still missing, it is lost and has the highest priority.
    If the server already has all bricks, only the manifest is sent."""

    def __init__(
        self,
        field: Description,
        bytes_per_s: float = 500e3,
        burst_ns: int = 33_000_000,  # sufficient for a loop of 30 Hz
        silence_ns: int = 2_000_000_000,
    ) -> None:
        """If no status is received for `silence_ns`, the manifest is sent again, because the server may have dropped it."""
        expect(silence_ns > 0, "silence_ns", silence_ns, "more than 0")
        self.field = field
        self.complete = False
        """Whether the server has all bricks according to the newest status."""
        self.sent = 0
        """The number of sent bricks, including repetitions."""
        self._silence = silence_ns
        self._offered = 0  # bytes of the manifest
        self._heard: int | None = None  # time of the newest status
        self._sent_at: list[Instant] = [-NEVER] * len(field.bricks)
        self._queue: list[int] = []  # to be sent before the next status, the last one first
        self._pace = BrickPace(bytes_per_s, burst_ns)

    def next_part(self, now: int) -> OfferField | None:
        """Returns the next part of the manifest, or None if all parts were sent. Call part_sent() if the request was added
        to the session."""
        if self._heard is None:
            self._heard = now
        manifest = self.field.manifest
        if self._offered == len(manifest) and not self.complete and now - self._heard >= self._silence:
            self._offered = 0
            self._heard = now
        part = manifest[self._offered : self._offered + MAX_PART]
        return OfferField(self.field.name, len(manifest), self._offered, part) if part else None

    def part_sent(self) -> None:
        self._offered = min(self._offered + MAX_PART, len(self.field.manifest))

    def take(self, now: int, status: FieldStatus, round_trip: int) -> bool:
        """`round_trip` is the smoothed round trip of the session. Returns False if this is the status of another
        field."""
        if status.field != self.field.name:
            return False
        self._heard = now
        self.complete = not any(status.missing)
        arrived_before = now - round_trip - round_trip // 8 - _JITTER_NS
        bits = int.from_bytes(status.missing, "little")
        missing = [i for i, sent in enumerate(self._sent_at) if bits >> i & 1 and sent < arrived_before]
        fresh = [i for i in missing if self._sent_at[i] == -NEVER]
        lost = sorted((i for i in missing if self._sent_at[i] != -NEVER), key=lambda i: self._sent_at[i])
        self._queue = [*lost, *fresh][::-1]
        return True

    def next_brick(self, now: int) -> FieldBrick | None:
        """Returns the next brick if it is due."""
        if not self._queue or not self._pace.passes(now):
            return None
        i = self._queue.pop()
        self._sent_at[i] = now
        self.sent += 1
        return self.field.bricks[i]

    def due(self) -> Instant:
        """Returns when next_part() and next_brick() must be called next, if no status is received before."""
        if self._offered < len(self.field.manifest) or self._heard is None:
            return 0
        if self.complete:
            return NEVER
        again = self._heard + self._silence
        return min(again, self._pace.next) if self._queue else again


@dataclass(frozen=True)
class Motion:
    """A pose of an object and its velocities, in the base frame of the device."""

    position: Vec3
    turn: Quat
    velocity: Vec3
    angular_velocity: Vec3

    def __post_init__(self) -> None:
        for name, most, unit in _MOST:
            length = math.hypot(*getattr(self, name))
            expect(length <= most, f"pose.{name}", length, f"at most {most} {unit}")
        length = math.hypot(*self.turn)
        expect(abs(length - 1) <= UNIT_TOLERANCE, "pose.turn", self.turn, "a quaternion (w, x, y, z) of length 1")


_MOST = (("position", 10, "m"), ("velocity", 10, "m/s"), ("angular_velocity", 100, "rad/s"))
"""The bounds of a server (core/field/field_pose.h)."""


class FieldUser:
    """Uploads the field of a client in each session, asks the server to use it in the channel, and sends poses. When the
    server accepts a new field, the previous one is dropped."""

    def __init__(self) -> None:
        self._field: Description | None = None
        self._session: Session | None = None
        self._sender: FieldSender | None = None
        self.closed()

    def opened(self, session: Session, place: Grant) -> None:
        """Must be called at the start of a session, if the server supports fields."""
        self.closed()
        self._session, self._place = session, place
        if self._field is not None:
            self._sender = FieldSender(self._field)

    def closed(self, refused: str = "") -> None:
        self.refused = refused
        """The reason why the server has refused the field. Empty if it was not refused."""
        self._session = None
        self._place = Grant(Role.CONTROLLER)
        self._sender = None
        self._old: list[bytes] = []  # names to be dropped
        self._parts: set[int] = set()  # ids of pending requests
        self._use: int | None = None  # id of the newest UseField
        self._uses: dict[int, bytes] = {}  # fields of the pending ones
        self._in_use = b""  # the field of the last one that was accepted
        self._asked = False  # for the use of the newest field
        self._ask_at = 0
        self._holds = False
        self._is_full = False  # too many requests are pending
        self._generation = 0  # of the newest UseField
        self._pose: FieldPose | None = None
        self._pose_due = 0
        self._poses = 0

    def use(self, field: Description | None) -> None:
        """Sets the field. If only the materials or fixtures have changed, no bricks are sent."""
        self._field = field
        if self._session is None:
            return
        self.refused = ""
        self._asked, self._use = False, None
        self._parts.clear()  # ignore the answers
        if field is not None and self._sender is not None and self._sender.field.name == field.name:
            self._sender.field = field
            return
        if self._sender is not None:
            self._old.append(self._sender.field.name)
        self._sender = None if field is None else FieldSender(field)
        if field is not None and field.name in self._old:
            self._old.remove(field.name)

    def move(self, now: int, motion: Motion, ahead_ns: int) -> bool:
        """Sends the predicted pose at `ahead_ns` after `now`. If the rate is higher than the limit of the server, poses are
        skipped, but the newest one is always sent. Returns False if there is no session, or if the server does not
        support fields."""
        at = None if self._session is None else self._session.peer_time(now)
        if self._session is None or at is None:
            return False
        self._pose = FieldPose(
            self._place.device, self._place.channel, self._poses + 1, at + ahead_ns,
            motion.position, motion.turn, motion.velocity, motion.angular_velocity,
        )  # fmt: skip
        self._send_pose(now)
        return True

    def lost_lease(self) -> None:
        """Must be called if the lease is lost. The server then stops rendering the field until the next UseField request."""
        self._asked = False

    def tick(self, now: int, holds: bool) -> None:
        session, sender = self._session, self._sender
        if session is None:
            return
        self._holds, self._is_full = holds, False
        self._send_pose(now)
        kept = () if sender is None else (self._in_use, *self._uses.values())
        for name in [name for name in self._old if name not in kept]:
            if session.request(DropField(name)) is not None:
                self._old.remove(name)
        while sender and not self.refused and len(self._parts) < _MOST_PARTS and (part := sender.next_part(now)):
            number = session.request(part)
            if number is None:
                self._is_full = True
                break
            sender.part_sent()
            self._parts.add(number)
        if sender and sender.complete and holds and not self._asked and not self.refused and now >= self._ask_at:
            field, place = sender.field, self._place
            self._use = session.request(
                UseField(
                    *(place.device, place.channel, self._generation + 1, field.name),
                    *(field.materials, field.fixtures, field.tables),
                )
            )
            if self._use is None:
                self._is_full = True
            else:
                self._generation += 1
                self._asked = True
                self._uses[self._use] = field.name

    def has_brick(self, now: int) -> bool:
        """Queues the next brick in the session if it is due."""
        brick = self._sender.next_brick(now) if self._sender and not self.refused else None
        if brick is not None and self._session is not None:
            self._session.send(brick)
        return brick is not None

    def take_status(self, now: int, status: FieldStatus) -> None:
        sender, session = self._sender, self._session
        if session is None or sender is None or not sender.take(now, status, session.stats.smoothed_round_trip_ns):
            return
        if self.refused and not sender.complete:
            self.refused, self._asked = "", False  # the server has removed bricks after the last status

    def take_answer(self, now: int, answer: ControlAck) -> None:
        is_newest = answer.id == self._use
        ours = is_newest or answer.id in self._parts
        self._parts.discard(answer.id)
        used = self._uses.pop(answer.id, None)
        if used is not None and answer.code is Code.OK:
            self._in_use = used
        elif is_newest and answer.code is Code.BUSY:
            self._asked = False
            self._ask_at = now + max(1_000_000 * answer.wait_ms, _ASK_AGAIN_NS)
        elif ours and answer.code is not Code.OK:
            self.refused = answer.detail or answer.code.name

    def due(self) -> Instant:
        """Returns when tick() and has_brick() must be called next."""
        pose = NEVER if self._pose is None else self._pose_due
        sender = self._sender
        if sender is None or self.refused:
            return pose
        if sender.complete:
            return min(pose, self._ask_at if self._holds and not self._asked and not self._is_full else NEVER)
        if self._is_full or len(self._parts) >= _MOST_PARTS:
            return pose
        return min(pose, sender.due())

    def _send_pose(self, now: int) -> None:
        if self._session is not None and self._pose is not None and now >= self._pose_due:
            self._session.send(self._pose)
            self._pose, self._pose_due = None, now + _POSE_PERIOD_NS
            self._poses += 1
