# SPDX-License-Identifier: Apache-2.0
"""The blocking client: one thread, which waits for states."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Union

from .expect import expect
from .guest import AnyClient
from .messages import NEVER, DeviceState, Touch

Physics = Callable[[DeviceState], Union[Touch, Sequence[float], None]]
"""The physics engine as a function: device state in, force (and stiffness) out. None: it knows none, and nothing is sent."""


class Client(AnyClient):
    """A guest at a Tendon server:

        with Client("127.0.0.1:47100", Config(name="spring")) as client:
            client.drive(lambda hand: [-500 * x for x in hand.position])

    or, with the loop in your hands,

            for hand in client.states():
                client.send(hand, force)

    The server may start later or be restarted: the client reconnects, with a back-off, and logs what
    happens ("tendon" of `logging`). It keeps the session alive only while it is asked for states: the server
    takes an engine that computes for 2 s between two states for dead. (`tendon.aio` has no such limit.)
    """

    def states(
        self,
        duration_s: float | None = None,
        on_silence: Callable[[int], object] | None = None,
        silence_s: float = 0.01,
    ) -> Iterator[DeviceState]:
        """The newest state, at Config.rate_hz or as soon after as there is a new one; older ones are skipped.
        Ends after `duration_s`, or never. `on_silence(now)` is called whenever `silence_s` has passed without a state
        to hand out, also before the first, with time.monotonic_ns(): what must not go on without a hand stops there.
        Raises RefusedForGood, and whatever `on_silence` raises."""
        expect(0.001 <= silence_s <= 10, "silence_s", silence_s, "0.001 to 10")
        guest, core = self._guest, self._guest.core
        silence_ns = NEVER if on_silence is None else silence_s * 1e9
        now = time.monotonic_ns()
        end = NEVER if duration_s is None else now + duration_s * 1e9
        quiet = now + silence_ns
        while now < end:
            now = guest.take(now)
            state = core.next_state(now)
            if state is not None:
                yield state  # is answered before anything else is done
                guest.tend(time.monotonic_ns())
            else:
                guest.tend(now)
                guest.raise_if_refused()
                if on_silence is None or now < quiet:
                    wait_s = (min(core.next_turn(), core.next_state_due(), end, quiet) - now) / 1e9
                    select.select([guest.socket], [], [], max(wait_s, 0))
                    now = time.monotonic_ns()
                    continue
                on_silence(now)
            now = time.monotonic_ns()
            quiet = now + silence_ns

    def drive(
        self,
        physics: Physics,
        duration_s: float | None = None,
        on_silence: Callable[[int], object] | None = None,
        silence_s: float = 0.01,
    ) -> None:
        """Answers every state with the result of `physics`; the rest as for states(). Raises RefusedForGood, and
        whatever `physics` raises."""
        for hand in self.states(duration_s, on_silence, silence_s):
            self.answer(hand, physics(hand))

    def close(self) -> None:
        """Says Bye, so that the server need not wait for a timeout."""
        self._guest.end(time.monotonic_ns())

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
