# SPDX-License-Identifier: Apache-2.0
"""The reliable part of a session: requests arrive exactly once and in order, and each gets its answer.

The answer is the acknowledgement. The answerer keeps its last 16 answers and repeats one whenever its
request comes again. That is enough: the requester has at most 16 requests open, so when request n + 16
arrives, the answer to n has.
"""

from __future__ import annotations

from dataclasses import dataclass

from .limits import REQUEST_WINDOW
from .messages import NEVER, Code, Control, ControlAck, Instant, Request

_MAX_WAIT = 1_000_000_000  # ns; waits double up to this, even where the round trip is longer


@dataclass(slots=True)
class _Asked:
    control: Control
    due: Instant = -NEVER
    times_sent: int = 0
    answer: ControlAck | None = None


class OutgoingRequests:
    """The asking end."""

    def __init__(self) -> None:
        self._open: dict[int, _Asked] = {}  # in the order of the ids
        self._next = 1

    def add(self, request: Request) -> int | None:
        """Queues a request and returns its id; None when as many as the window holds are open."""
        if len(self._open) == REQUEST_WINDOW:
            return None
        number = self._next
        self._next += 1
        self._open[number] = _Asked(Control(number, request))
        return number

    def due(self, now: int) -> list[Control]:
        """The requests to be sent (again) now."""
        return [asked.control for asked in self._open.values() if asked.answer is None and asked.due <= now]

    def sent(self, number: int, now: int, timeout: int) -> None:
        """The request is due again after `timeout`, doubled for every earlier transmission."""
        asked = self._open[number]
        asked.due = now + min(timeout << min(asked.times_sent, 32), _MAX_WAIT)
        asked.times_sent += 1

    def next_due(self) -> Instant:
        return min((asked.due for asked in self._open.values() if asked.answer is None), default=NEVER)

    def acknowledge(self, ack: ControlAck) -> bool:
        """False when the answer belongs to no request."""
        asked = self._open.get(ack.id)
        if asked is None:
            return ack.id < self._next  # repeated, or never asked
        if asked.times_sent == 0:
            return False
        if asked.answer is None:
            asked.answer = ack
        return True

    def next_answer(self) -> ControlAck | None:
        """The next answer, in the order of the requests."""
        for number, asked in self._open.items():
            if asked.answer is not None:
                del self._open[number]
            return asked.answer
        return None


class IncomingRequests:
    """The answering end."""

    def __init__(self) -> None:
        self._next = 1  # the next request to hand out
        self._arrived: dict[int, Control] = {}
        self._taken: set[int] = set()
        self._answers: dict[int, ControlAck] = {}
        self._due: dict[int, None] = {}  # ids of answers to be sent, in the order they became due

    def take(self, control: Control) -> bool:
        """Takes a request in any order. False when the id is one that a correct peer cannot use yet."""
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
        """The next request, exactly once and in order. This also answers requests that are unknown or invalid."""
        while (control := self._arrived.pop(self._next, None)) is not None:
            self._next += 1
            self._taken.add(control.id)
            if control.request is not None:
                return control
            if control.invalid:
                self.answer(ControlAck(control.id, Code.INVALID, f"{control.invalid} is out of bounds"))
            else:
                self.answer(ControlAck(control.id, Code.UNSUPPORTED, "this version does not know that request"))
        return None

    def answer(self, ack: ControlAck) -> None:
        """Answers a request that `next` returned; any other id is ignored."""
        if ack.id not in self._taken:
            return
        self._taken.remove(ack.id)
        self._answers[ack.id] = ack
        self._answers.pop(ack.id - REQUEST_WINDOW, None)
        self._due[ack.id] = None

    def due(self) -> list[ControlAck]:
        """The answers to be sent now."""
        return [self._answers[number] for number in self._due if number in self._answers]

    def sent(self, number: int) -> None:
        self._due.pop(number, None)
