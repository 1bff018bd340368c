# SPDX-License-Identifier: Apache-2.0
"""Reliable requests of a session: they arrive exactly once and in order, and each is answered.

The answer is the acknowledgement. The receiver stores its last 16 answers and repeats an answer if the request is
repeated. This is sufficient because at most 16 requests are pending: when request n + 16 arrives, the answer to n
has been received.
"""

from __future__ import annotations

from dataclasses import dataclass

from .limits import REQUEST_WINDOW
from .messages import NEVER, Code, Control, ControlAck, Instant, Request

_MAX_WAIT = 1_000_000_000  # ns; upper limit of the exponential back-off


@dataclass(slots=True)
class _Asked:
    control: Control
    due: Instant = -NEVER
    times_sent: int = 0
    answer: ControlAck | None = None


class OutgoingRequests:
    """The requesting side."""

    def __init__(self) -> None:
        self._open: dict[int, _Asked] = {}  # in order of their ids
        self._next = 1

    def add(self, request: Request) -> int | None:
        """Queues a request. Returns the id of the request, or None if the window is full."""
        if len(self._open) == REQUEST_WINDOW:
            return None
        number = self._next
        self._next += 1
        self._open[number] = _Asked(Control(number, request))
        return number

    def due(self, now: int) -> list[Control]:
        """Returns the requests to send or repeat now."""
        return [asked.control for asked in self._open.values() if asked.answer is None and asked.due <= now]

    def sent(self, number: int, now: int, timeout: int) -> None:
        """Schedules a repetition after `timeout`, doubled for each previous transmission."""
        asked = self._open[number]
        asked.due = now + min(timeout << min(asked.times_sent, 32), _MAX_WAIT)
        asked.times_sent += 1

    def next_due(self) -> Instant:
        return min((asked.due for asked in self._open.values() if asked.answer is None), default=NEVER)

    def acknowledge(self, ack: ControlAck) -> bool:
        """Returns False if the answer does not belong to a request."""
        asked = self._open.get(ack.id)
        if asked is None:
            return ack.id < self._next  # True: repeated; False: never requested
        if asked.times_sent == 0:
            return False
        if asked.answer is None:
            asked.answer = ack
        return True

    def next_answer(self) -> ControlAck | None:
        """Returns the next answer in the order of the requests."""
        for number, asked in self._open.items():
            if asked.answer is not None:
                del self._open[number]
            return asked.answer
        return None


class IncomingRequests:
    """The answering side."""

    def __init__(self) -> None:
        self._next = 1  # the next request to return
        self._arrived: dict[int, Control] = {}
        self._taken: set[int] = set()
        self._answers: dict[int, ControlAck] = {}
        self._due: dict[int, None] = {}  # ids of answers to send, in order

    def take(self, control: Control) -> bool:
        """Accepts requests in any order. Returns False if a correct peer could not use this id yet."""
        number = control.id
        if number < self._next:
            if number in self._answers:
                self._due[number] = None
            return True
        if number - self._next >= REQUEST_WINDOW or number - REQUEST_WINDOW in self._taken:
            return False
        self._arrived.setdefault(number, control)
        return True

    def next(self) -> Control | None:
        """Returns the next request, exactly once and in order. Answers unknown or invalid requests itself."""
        while (control := self._arrived.pop(self._next, None)) is not None:
            self._next += 1
            self._taken.add(control.id)
            if control.request is not None:
                return control
            if control.invalid:
                self.answer(ControlAck(control.id, Code.INVALID, f"{control.invalid} is out of bounds"))
            else:
                self.answer(ControlAck(control.id, Code.UNSUPPORTED, "this version does not support this request"))
        return None

    def answer(self, ack: ControlAck) -> None:
        """Answers a request returned by `next`. Other ids are ignored."""
        if ack.id not in self._taken:
            return
        self._taken.remove(ack.id)
        self._answers[ack.id] = ack
        self._answers.pop(ack.id - REQUEST_WINDOW, None)
        self._due[ack.id] = None

    def due(self) -> list[ControlAck]:
        """Returns the answers to send now."""
        return [self._answers[number] for number in self._due if number in self._answers]

    def sent(self, number: int) -> None:
        self._due.pop(number, None)
