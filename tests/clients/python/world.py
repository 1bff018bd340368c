# SPDX-License-Identifier: Apache-2.0
"""Simulates a client, a server and a bad network in virtual time. The time is always advanced to the next event."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from tendon.messages import NEVER, Instant

MS = 1_000_000
SECOND = 1000 * MS


@dataclass
class Weather:
    """The delay, jitter and loss of the network in one direction."""

    delay: int = 20 * MS
    jitter: int = 10 * MS  # uniform in [0, jitter), so datagrams are reordered
    loss: float = 0.05
    duplicate: float = 0.05


PERFECT = Weather(1 * MS, 0, 0, 0)


class End(Protocol):
    def receive(self, now: int, datagram: bytes) -> None: ...

    def tick(self, now: int) -> None: ...

    def next_datagram(self, now: int) -> bytes | None: ...

    def next_turn(self) -> Instant: ...


class Direction:
    def __init__(self, weather: Weather, seed: str) -> None:
        self.weather = weather
        self.delivered: list[bytes] = []
        self._random = random.Random(seed)
        self._in_flight: list[tuple[int, int, bytes]] = []
        self._order = 0

    def send(self, now: int, datagram: bytes) -> None:
        weather = self.weather
        copies = 0 if self._random.random() < weather.loss else 2 if self._random.random() < weather.duplicate else 1
        for _ in range(copies):
            arrival = now + weather.delay + int(self._random.random() * weather.jitter)
            self._order += 1
            heapq.heappush(self._in_flight, (arrival, self._order, datagram))

    def next_arrival(self) -> Instant:
        return self._in_flight[0][0] if self._in_flight else NEVER

    def receive(self, now: int) -> bytes | None:
        if self.next_arrival() > now:
            return None
        datagram = heapq.heappop(self._in_flight)[2]
        self.delivered.append(datagram)
        return datagram


class World:
    """A is the client, and Z is the server, whose clock has an offset. If the seed is the same, the run is the same."""

    OFFSET = 1234 * 3600 * SECOND + 56789
    START = 100 * SECOND

    def __init__(self, a: End, z: End, weather: Weather, seed: int) -> None:
        self.now = self.START
        self.a, self.z = a, z
        self.there = Direction(weather, f"there {seed}")
        self.back = Direction(weather, f"back {seed}")

    def run(self, length: int, each_turn: Callable[[], Instant]) -> None:
        """`each_turn` runs the users of both peers and returns when it must be called again."""
        end = self.now + length
        while True:
            due = self._turn(each_turn)
            if due > end:
                break
            self.now = max(self.now, int(due))
        self.now = end

    @property
    def at_z(self) -> int:
        return self.now + self.OFFSET

    def _turn(self, each_turn: Callable[[], Instant]) -> Instant:
        while (datagram := self.back.receive(self.now)) is not None:
            self.a.receive(self.now, datagram)
        while (datagram := self.there.receive(self.now)) is not None:
            self.z.receive(self.at_z, datagram)
        self.a.tick(self.now)
        self.z.tick(self.at_z)
        due = each_turn()
        while (datagram := self.a.next_datagram(self.now)) is not None:
            self.there.send(self.now, datagram)
        while (datagram := self.z.next_datagram(self.at_z)) is not None:
            self.back.send(self.now, datagram)
        arrivals = min(self.there.next_arrival(), self.back.next_arrival())
        return min(due, self.a.next_turn(), self.z.next_turn() - self.OFFSET, arrivals)
