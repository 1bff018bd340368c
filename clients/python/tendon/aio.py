# SPDX-License-Identifier: Apache-2.0
"""The asyncio client. The event loop keeps the session alive while your coroutine computes or waits."""

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
    """A client of a Tendon server like tendon.Client, for event loops that can watch sockets (SelectorEventLoop on
    Windows):

        async with aio.Client("127.0.0.1:47100", Config(name="spring")) as client:
            async for hand in client.states():
                client.send(hand, force)

    The session stays alive as long as the event loop runs. Only one task at a time may request states. The
    constructor resolves the host name and blocks meanwhile.
    """

    def __init__(self, server: str, config: Config = Config()) -> None:
        super().__init__(server, config)
        self._guest.moved = self._watch_another
        self._timer: asyncio.TimerHandle | None = None
        self._waiter: asyncio.Future[None] | None = None
        self._timer_due: Instant = NEVER
        self._wake_at: Instant = NEVER

    async def states(self, duration_s: float | None = None) -> AsyncIterator[DeviceState]:
        """Yields the newest state, at Config.rate_hz or when a new one is available. Older states are skipped. If
        `duration_s` is not None, it ends after this time. Raises RefusedForGood."""
        guest, core = self._guest, self._guest.core
        now = time.monotonic_ns()
        end = NEVER if duration_s is None else now + duration_s * 1e9
        while now < end:
            now = guest.take(now)
            state = core.next_state(now)
            if state is not None:
                yield state  # the caller answers before the client does anything else
                guest.tend(time.monotonic_ns())
                await asyncio.sleep(0)  # give other tasks a turn even if states arrive fast
            else:
                guest.tend(now)
                guest.raise_if_refused()
                await self._wait_until(min(core.next_state_due(), end))
            now = time.monotonic_ns()

    async def drive(self, physics: Physics, duration_s: float | None = None) -> None:
        """Answers each state with the result of `physics`. Raises RefusedForGood, and exceptions of `physics`."""
        async for hand in self.states(duration_s):
            self.answer(hand, await physics(hand))

    async def __aenter__(self) -> Client:
        asyncio.get_running_loop().add_reader(self._guest.socket, self._turn)
        self._turn()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Sends a Bye, so that the server does not have to wait for a timeout."""
        asyncio.get_running_loop().remove_reader(self._guest.socket)
        if self._timer is not None:
            self._timer.cancel()
        self._guest.end(time.monotonic_ns())

    def _watch_another(self, old: socket.socket, new: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(old)
        loop.add_reader(new, self._turn)

    def _turn(self) -> None:
        """Handles received datagrams and due work. If a task waits for a state, wakes that task instead."""
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)
            return
        self._guest.turn(time.monotonic_ns())
        self._set_timer()

    async def _wait_until(self, instant: Instant) -> None:
        """Waits until `instant` or until there is an event."""
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
        """Sets the timer for the next turn. If there is a timer that expires earlier, it is not changed, because it
        will set the next one."""
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
