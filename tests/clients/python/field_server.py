# SPDX-License-Identifier: Apache-2.0
"""A server that receives fields, without I/O: the receiver of protocol/field/receiver.h, and a device at 50 Hz."""

from __future__ import annotations

import hashlib
import random
from dataclasses import dataclass, field, replace

from stand_in import StandIn
from world import MS, PERFECT, Weather, World

from tendon import Code, Config, DeviceState, FieldState, ForceClient, Mode
from tendon.messages import Control, DropField, FieldBrick, FieldPose, FieldStatus, ForceCommand, LeaseLost, OfferField, UseField
from tendon.messages import TakeLease

HEAD, ENTRY = 50, 23
PERIOD = 50 * MS
READY_PERIOD = 1000 * MS


class Server(StandIn):
    """Handles the events after each datagram, because a session only keeps the newest brick."""

    taken = staticmethod(lambda: None)

    def receive(self, now: int, datagram: bytes) -> None:
        super().receive(now, datagram)
        self.taken()


@dataclass
class Offer:
    size: int
    manifest: bytes = b""
    ready: bool = False
    due: int = 0

    def hashes(self) -> list[bytes]:
        m = self.manifest
        count = int.from_bytes(m[46:48], "little") if len(m) >= HEAD else 0
        entries = range(HEAD, min(HEAD + count * ENTRY, len(m) - ENTRY + 1), ENTRY)
        return [m[at + 7 : at + ENTRY] for at in entries]


@dataclass
class Receiver:
    """Receives the fields of one session. The store contains the bricks of all sessions."""

    store: dict[bytes, bytes]
    offers: dict[bytes, Offer] = field(default_factory=dict)

    def offer(self, now: int, part: OfferField) -> None:
        one = self.offers.setdefault(part.field, Offer(part.size))
        assert part.offset <= len(one.manifest), "parts are in order"
        one.manifest = one.manifest[: part.offset] + part.part + one.manifest[part.offset + len(part.part) :]
        if len(one.manifest) == one.size:
            assert hashlib.blake2b(one.manifest, digest_size=32).digest() == part.field

    def brick(self, brick: FieldBrick) -> None:
        assert hashlib.blake2b(brick.weights, digest_size=16).digest() == brick.hash
        if any(brick.hash in offer.hashes() for offer in self.offers.values()):
            self.store[brick.hash] = brick.weights

    def statuses(self, now: int) -> list[FieldStatus]:
        told = []
        for name, offer in self.offers.items():
            if offer.due > now:
                continue
            missing = sum(1 << i for i, one in enumerate(offer.hashes()) if one not in self.store)
            missing |= (len(offer.manifest) < offer.size) << 1023
            offer.ready = missing == 0
            offer.due = now + (READY_PERIOD if offer.ready else PERIOD)
            told.append(FieldStatus(name, missing.to_bytes(128, "little").rstrip(b"\0")))
        return told

    def due(self) -> float:
        return min((offer.due for offer in self.offers.values()), default=float("inf"))


class FieldStage:
    """A client with fields, and its server. The next UseField requests are answered with the entries of `refusals`."""

    def __init__(self, store: dict[bytes, bytes], weather: Weather = PERFECT, seed: int = 1, features=("local-model", "fields")):
        self.client = ForceClient(Config(name="engine", fields=True), World.START, random.Random(seed).randbytes)
        self.server = Server()
        self.server.taken = self._take_events
        self.server.features = features
        self.world = World(self.client, self.server, weather, seed)
        self.store = store
        self.receiver = Receiver(store)
        self.refusals: list[tuple[Code, str]] = []
        self.refused_parts: tuple[Code, str] | None = None
        self.uses: list[UseField] = []
        self.used_at: list[int] = []
        self.drops: list[bytes] = []
        self.poses: list[FieldPose] = []
        self.forces: list[ForceCommand] = []
        self.seen: list[DeviceState] = []
        self.bricks = 0
        self.snatch = False  # another client takes the lease once
        self.rendered = 0
        self.each_state = lambda hand: None
        self._session = None
        self._next_state = World.START

    def run(self, length: int) -> None:
        self.world.run(length, self._each_turn)

    def run_until(self, done, length: int = 20_000 * MS) -> bool:
        for _ in range(length // (10 * MS)):
            if done():
                return True
            self.run(10 * MS)
        return False

    @property
    def is_ready(self) -> bool:
        return any(offer.ready for offer in self.receiver.offers.values())

    def _take_events(self) -> None:
        session = self.server.session
        if session is not self._session:  # a new session has no offers
            self._session, self.receiver, self.rendered = session, Receiver(self.store), 0
        while session is not None and (event := session.next_event()) is not None:
            if isinstance(event, FieldBrick):
                self.bricks += 1
                self.receiver.brick(event)
            elif isinstance(event, FieldPose):
                self.poses.append(event)
            elif isinstance(event, ForceCommand):
                self.forces.append(event)
            elif isinstance(event, Control):
                session.answer(event.id, *self._answer(event.request))

    def _each_turn(self):
        self._take_events()
        now, session = self.world.now, self.server.session
        if session is not None:
            for status in self.receiver.statuses(self.world.at_z):
                session.send(status)
            if self.snatch:
                self.snatch = False
                session.request(LeaseLost(0, 0, "another"))
            if now >= self._next_state:
                tick = 1 + (now - World.START) // MS
                self._next_state = now + 20 * MS
                zero = (0.0, 0.0, 0.0)
                state = DeviceState(tick, self.world.at_z, zero, zero, zero, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE)
                session.send(replace(state, field=FieldState(self.rendered) if self.rendered else None))
        while (hand := self.client.next_state(now)) is not None:
            self.seen.append(hand)
            self.each_state(hand)
        due = float("inf") if session is None else min(self._next_state, self.receiver.due() - self.world.OFFSET)
        return min(due, self.client.next_state_due())

    def _answer(self, request):
        if isinstance(request, OfferField):
            if self.refused_parts:
                return self.refused_parts
            self.receiver.offer(self.world.at_z, request)
        elif isinstance(request, UseField):
            self.uses.append(request)
            self.used_at.append(self.world.now)
            if self.refusals:
                return self.refusals.pop(0)
            assert self.receiver.offers[request.field].ready
            self.rendered = request.generation
        elif isinstance(request, DropField):
            self.drops.append(request.field)
            self.receiver.offers.pop(request.field, None)
        elif isinstance(request, TakeLease):
            return Code.OK, ""
        return Code.OK, ""
