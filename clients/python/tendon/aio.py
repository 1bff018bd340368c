# SPDX-License-Identifier: Apache-2.0
"""The asyncio client: the session lives in the event loop while your coroutine computes or waits."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from types import TracebackType
from typing import Union

from .config import Config
from .guest import AnyClient
from .messages import NEVER, DeviceState, Instant, Touch

Physics = Callable[[DeviceState], Awaitable[Union[Touch, Sequence[float], None]]]


class Client(AnyClient):
    """A guest at a Tendon server, as tendon.Client, in an event loop that can watch sockets (on Windows
    asyncio's SelectorEventLoop):

        async with aio.Client("127.0.0.1:47100", Config(name="spring")) as client:
            async for hand in client.states():
                client.send(hand, force)

    The session stays alive as long as the event loop runs. Only one task at a time may ask for states. The
    constructor looks the host name up, and blocks meanwhile.
    """

    def __init__(self, server: str, config: Config = Config()) -> None:
        super().__init__(server, config)
        self._guest.moved = self._watch_another
        self._timer: asyncio.TimerHandle | None = None
        self._waiter: asyncio.Future[None] | None = None
        self._timer_due: Instant = NEVER
        self._wake_at: Instant = NEVER

    async def states(self, duration_s: float | None = None) -> AsyncIterator[DeviceState]:
        """The newest state, at Config.rate_hz or as soon after as there is a new one; older ones are skipped.
        Ends after `duration_s`, or never. Raises RefusedForGood."""
        guest, core = self._guest, self._guest.core
        now = time.monotonic_ns()
        end = NEVER if duration_s is None else now + duration_s * 1e9
        while now < end:
            now = guest.take(now)
            state = core.next_state(now)
            if state is not None:
                yield state  # is answered before anything else is done
                guest.tend(time.monotonic_ns())
                await asyncio.sleep(0)  # the other tasks get their turn, however fast states come
            else:
                guest.tend(now)
                guest.raise_if_refused()
                await self._wait_until(min(core.next_state_due(), end))
            now = time.monotonic_ns()

    async def drive(self, physics: Physics, duration_s: float | None = None) -> None:
        """Answers every state with the result of `physics`. Raises RefusedForGood, and whatever `physics` raises."""
        async for hand in self.states(duration_s):
            self.answer(hand, await physics(hand))

    async def __aenter__(self) -> Client:
        asyncio.get_running_loop().add_reader(self._guest.socket, self._turn)
        self._turn()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Says Bye, so that the server need not wait for a timeout."""
        asyncio.get_running_loop().remove_reader(self._guest.socket)
        if self._timer is not None:
            self._timer.cancel()
        self._guest.end(time.monotonic_ns())

    def _watch_another(self, old: socket.socket, new: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(old)
        loop.add_reader(new, self._turn)

    def _turn(self) -> None:
        """Runs when something has come in or is due. A task that waits for a state is woken, and does the rest."""
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)
            return
        self._guest.turn(time.monotonic_ns())
        self._set_timer()

    async def _wait_until(self, instant: Instant) -> None:
        """Waits until `instant`, or until something happens."""
        self._wake_at = instant
        self._waiter = asyncio.get_running_loop().create_future()
        self._set_timer()
        try:
            await self._waiter
        finally:
            self._waiter = None
            self._wake_at = NEVER
            if self._timer is None:  # this task may never wait again
                self._set_timer()

    def _set_timer(self) -> None:
        """Before the next turn is due. A timer that ends sooner stays: it asks again."""
        due = min(self._guest.core.next_turn(), self._wake_at)
        if self._timer is not None:
            if self._timer_due <= due:
                return
            self._timer.cancel()
        self._timer = None
        if due != NEVER:
            delay_s = max(due - time.monotonic_ns(), 0) / 1e9
            self._timer = asyncio.get_running_loop().call_later(delay_s, self._on_timer)
            self._timer_due = due

    def _on_timer(self) -> None:
        self._timer = None
        self._turn()
