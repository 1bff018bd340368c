# SPDX-License-Identifier: Apache-2.0
"""The blocking client."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Union

from .config import Config
from .expect import expect
from .guest import AnyClient
from .keys import read_key
from .messages import NEVER, DeviceState, Touch

Physics = Callable[[DeviceState], Union[Touch, Sequence[float], None]]
"""The physics engine is a function from the device state to a force (and a stiffness). If it returns None, no force is
sent."""


class Client(AnyClient):
    """A client of a Tendon server:

        with Client("127.0.0.1:47100", Config(name="spring")) as client:
            client.drive(lambda hand: [-500 * x for x in hand.position])

    or, with your own loop,

            for hand in client.states():
                client.send(hand, force)

    The client reconnects if the server starts later or is restarted, and logs changes of the connection to the
    logger "tendon". It keeps the session alive only while states are requested: the server closes the session if
    an engine computes for 2 s between two states. `tendon.aio` does not have this limit.
    """

    def states(
        self,
        duration_s: float | None = None,
        on_silence: Callable[[int], object] | None = None,
        silence_s: float = 0.01,
    ) -> Iterator[DeviceState]:
        """Yields the newest state, at Config.rate_hz or when a new one is available. Older states are skipped. If
        `duration_s` is not None, it ends after this time. If no state has arrived for `silence_s`, it calls
        `on_silence` with time.monotonic_ns(). This is also done before the first state. Use it to stop everything that
        must not continue without an operator. Raises RefusedForGood, and exceptions of `on_silence`."""
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
                yield state  # the caller answers before the client does anything else
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
        """Answers each state with the result of `physics`. For the other arguments, see states(). Raises
        RefusedForGood, and exceptions of `physics`."""
        for hand in self.states(duration_s, on_silence, silence_s):
            self.answer(hand, physics(hand))

    def close(self) -> None:
        """Sends a Bye, so that the server does not have to wait for a timeout."""
        self._guest.end(time.monotonic_ns())

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def connect(server: str, key: str | Path | bytes | None = None, **settings: Any) -> Client:
    """Creates a client with Config(fields=True). `key` can be a key or the path of a key file. For the other settings, see
    Config.

        with tendon.connect("lab:47100", channel="peg", key="peg.key") as hand:
            hand.use(field)
    """
    secret = key if key is None or isinstance(key, bytes) else read_key(key)
    return Client(server, Config(key=secret, fields=True, **settings))
