# SPDX-License-Identifier: Apache-2.0
"""The plain client: one thread, which waits."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Union

from .force_client import Config, Stats
from .guest import Guest
from .messages import NEVER, DeviceDescription, DeviceReport, DeviceState, LinkReport, PeerReport, Touch, Welcome

Physics = Callable[[DeviceState], Union[Touch, Sequence[float]]]
"""The physics engine, seen from here: device state in, force (and stiffness) out."""


class Client:
    """A guest at a Tendon server:

        with Client("127.0.0.1:47100", Config(name="spring")) as client:
            client.drive(lambda hand: [-500 * x for x in hand.position])

    or, with the loop in your hands,

            for hand in client.states():
                client.send(hand, force)

    The server may start later or be restarted: the client finds it again, with a back-off, and logs what
    happens ("tendon" of `logging`). It keeps the session alive only while it is asked for states: an engine
    that computes for 2 s between two states is taken for dead. (`tendon.aio` has no such limit.)
    """

    def __init__(self, server: str, config: Config = Config()) -> None:
        """`server`: HOST:PORT. Raises ValueError or OSError when there is no such address; nobody need listen
        there yet."""
        self._guest = Guest(server, config, time.monotonic_ns())

    def states(self, duration_s: float | None = None) -> Iterator[DeviceState]:
        """The newest state, at Config.rate_hz or as soon after as there is a new one; older ones are skipped.
        Ends after `duration_s`, or never. Raises RefusedForGood."""
        guest, core = self._guest, self._guest.core
        now = time.monotonic_ns()
        end = NEVER if duration_s is None else now + duration_s * 1e9
        while now < end:
            guest.turn(now)
            guest.raise_if_refused()
            state = core.next_state(now)
            if state is not None:
                yield state
            else:
                wait_s = (min(core.next_turn(), core.next_state_due(), end) - now) / 1e9
                select.select([guest.socket], [], [], max(wait_s, 0))
            now = time.monotonic_ns()

    def send(self, hand: DeviceState, touch: Touch | Sequence[float]) -> None:
        """Sends at once what the hand is to feel there: a force in N on the hand, or a Touch with the stiffness too."""
        self._guest.send(hand, touch)
        self._guest.flush(time.monotonic_ns())

    def drive(self, physics: Physics, duration_s: float | None = None) -> None:
        """Answers every state with what `physics` makes of it. Raises RefusedForGood, and what `physics` raises."""
        for hand in self.states(duration_s):
            self.send(hand, physics(hand))

    def rearm(self) -> bool:
        """Asks the server to clear a latched fault of its device. False when there is no session to ask in."""
        asked = self._guest.core.rearm()
        self._guest.flush(time.monotonic_ns())
        return asked

    def disarm(self) -> bool:
        """Asks the server for no force of its device until somebody rearms. False when there is no session to ask in."""
        asked = self._guest.core.disarm()
        self._guest.flush(time.monotonic_ns())
        return asked

    def take_lease(self) -> bool:
        """Asks for the channel's lease, once; what became of it `holds` says. False when there is no session to ask in."""
        asked = self._guest.core.take_lease()
        self._guest.flush(time.monotonic_ns())
        return asked

    def give_lease(self) -> bool:
        """Gives it up, and asks for it no more. False when there is no session to do it in."""
        given = self._guest.core.give_lease()
        self._guest.flush(time.monotonic_ns())
        return given

    @property
    def stats(self) -> Stats:
        return self._guest.stats

    @property
    def welcome(self) -> Welcome | None:
        """What the server said of itself and its device when the newest session opened; None before that."""
        return self._guest.welcome

    @property
    def description(self) -> DeviceDescription | None:
        """What the device is and can do, when we have named a device or a channel and the server has answered."""
        return self._guest.description

    @property
    def holds(self) -> bool:
        """Whether the channel takes our forces. While it does not, a controller is handed no states."""
        return self._guest.holds

    @property
    def report(self) -> LinkReport | None:
        """The server's newest word on how our forces fare, once a second while they come; None before the first."""
        return self._guest.report

    @property
    def device_report(self) -> DeviceReport | None:
        """With Config.diagnostics, how the device's loop does, once a second; None before the first."""
        return self._guest.device_report

    @property
    def peer_reports(self) -> dict[int, PeerReport]:
        """With Config.diagnostics, how the engine of each channel does, or did last."""
        return self._guest.peer_reports

    def close(self) -> None:
        """Says Bye, so that the server need not wait for a timeout."""
        self._guest.end(time.monotonic_ns())

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
