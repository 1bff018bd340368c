# SPDX-License-Identifier: Apache-2.0
"""Shared by the blocking and the asyncio client: a ForceClient, its socket, and a log of what happens to it."""

from __future__ import annotations

import logging
import ipaddress
import os
import re
import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from . import limits
from .config import Config, Phase, Stats
from .force_client import ForceClient
from .messages import (
    Code,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    HandleDescription,
    LampColour,
    LinkReport,
    PeerReport,
    Touch,
    Vibration,
    Welcome,
)

log = logging.getLogger("tendon")


def visible(text: str) -> str:
    """Escapes the words of a peer for a log or a terminal, so that they cannot start a line or move the cursor: control
    characters (C0, DEL, C1) become \\n, \\t or \\xNN."""
    known = {"\n": "\\n", "\t": "\\t"}
    return re.sub(r"[\x00-\x1f\x7f-\x9f]", lambda c: known.get(c[0], f"\\x{ord(c[0]):02x}"), text)


def _make_visible(record: logging.LogRecord) -> bool:
    record.msg, record.args = visible(record.getMessage()), None
    return True


log.addFilter(_make_visible)

MAX_DATAGRAMS = 256
"""Most datagrams taken from the socket in one turn: a flood must not keep us from sending. A 1 kHz server sends this
many in a quarter of a second, the longest silence before it stops the device."""

_MAX_ERRORS = 64
"""Most error reports passed over in search of one datagram: a flood of them must not keep us from sending either."""

_KEEP_TRYING = (Code.BUSY, Code.SHUTDOWN)


class RefusedForGood(ConnectionError):
    """The server refuses, and another attempt would not change that."""

    def __init__(self, sentence: str, code: Code) -> None:
        super().__init__(visible(sentence))
        self.code = code


def parse_address(text: str) -> tuple[str, int]:
    """127.0.0.1:47100, [::1]:47100, name:47100. Raises ValueError."""
    host, colon, port = text.rpartition(":")
    bracketed = host.startswith("[") and host.endswith("]")
    if not colon or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise ValueError(f'expected HOST:PORT, got "{text}"')
    if not host or (":" in host and not bracketed):
        raise ValueError(f'expected HOST:PORT, [IPv6]:PORT for an IPv6 address, got "{text}"')
    return (host[1:-1] if bracketed else host, int(port))


_MAX_UNIX_PATH = 107
"""Bytes; the system has room for no more in a socket's address."""


def unix_path(server: str) -> str | None:
    """The file of "unix:/run/tendon.sock", a server's Unix socket on this machine; None for all else. Raises ValueError
    for a path that no socket can have."""
    if not server.startswith("unix:"):
        return None
    path = server.removeprefix("unix:")
    if not 0 < len(os.fsencode(path)) <= _MAX_UNIX_PATH or "\0" in path:
        raise ValueError(f'expected unix:PATH with a path of 1 to {_MAX_UNIX_PATH} bytes, got "{server}"')
    return path


class Guest:
    """`turn(now)` does everything that is due. Only one thread or event loop may use a guest at a time."""

    def __init__(self, server: str, config: Config, now: int, clock: Callable[[], int] = time.monotonic_ns) -> None:
        """Raises ValueError when `server` is neither HOST:PORT nor unix:PATH, OSError when there is no such host or the system cannot
        reach it. A host name is looked up here, which may wait, and again, in a thread of its own, before each further
        attempt."""
        self.server = server
        self._place = _look_up(server)[0]
        self.socket = _connected(self.server, self._place)
        self.moved: Callable[[socket.socket, socket.socket], None] = lambda old, new: None
        """Called when the socket has been replaced, before the old one is closed."""
        self._found: list[Place] = []
        self._waited = False
        self.core = ForceClient(config, now)
        self.clock = clock
        self._doubt = "is tendond running there" + (", and does it know our key" if config.key else "")
        self._said = ""
        self._said_unusable = ""
        self._said_left_out = ""
        self._told: LinkReport | None = None
        self._seen_phase: Phase | None = None
        self._seen_reason = ""

    def turn(self, now: int) -> None:
        """Takes what has come in, does what is due, sends what is to be sent."""
        self.tend(self.take(now))

    def take(self, now: int) -> int:
        """The first half of a turn: takes what has come in, and gives the time at which that was. A state that is waited
        for is answered before the other half."""
        for _ in range(MAX_DATAGRAMS):
            datagram = self._receive()
            if datagram is None:
                break
            # The datagram may have come since the turn began, so its time of arrival is taken now.
            now = max(now, self.clock())
            self.core.receive(now, datagram)
        return now

    def tend(self, now: int) -> None:
        """The other half."""
        self.core.tick(now)
        self.flush(now)
        self._follow_the_name()
        self._say()

    def flush(self, now: int) -> None:
        while (datagram := self.core.next_datagram(now)) is not None:
            try:
                self.socket.send(datagram)
            except OSError:
                pass  # the datagram counts as lost, as on the network

    def send(self, hand: DeviceState, touch: Touch | Sequence[float]) -> None:
        """Answers a state: a force alone, or a Touch with the stiffness too."""
        self.core.send(hand, touch if isinstance(touch, Touch) else Touch(touch))

    def end(self, now: int) -> None:
        """Says Bye and closes the socket."""
        self.core.stop(now)
        self.flush(now)
        self.socket.close()

    def raise_if_refused(self) -> None:
        if self.core.phase not in (Phase.REFUSED, Phase.STOPPED):
            return
        stats = self.core.stats
        if stats.phase is Phase.REFUSED and stats.code not in _KEEP_TRYING:
            raise RefusedForGood(f"{self.server} refuses: {stats.reason}", stats.code)
        if stats.phase is Phase.STOPPED and stats.code is Code.REPLACED:
            raise RefusedForGood(f"{self.server} has ended this: {stats.reason}", stats.code)

    def _follow_the_name(self) -> None:
        """Between two attempts the name is looked up again: the server may have another address by now. Where nobody
        answered at one address, the next one of the name is tried."""
        phase = self.core.phase
        waits = phase in (Phase.UNANSWERED, Phase.REFUSED, Phase.LOST)
        if waits and not self._waited and not _is_numeric(self.server):
            threading.Thread(target=self._look_up_again, name="tendon-look-up", daemon=True).start()
        self._waited = waits
        if self._found and phase is not Phase.OPEN:
            found, self._found = self._found, []
            self._move_to(found)

    def _look_up_again(self) -> None:
        try:
            self._found = _look_up(self.server)
        except OSError as error:
            log.warning("%s; trying %s", error, self._place[2][0])

    def _move_to(self, found: list[Place]) -> None:
        silent = self.core.phase is Phase.UNANSWERED
        place = self._place
        if place not in found:
            place = found[0]
        elif silent:
            place = found[(found.index(place) + 1) % len(found)]
        # The same file may be another server's socket by now.
        if place == self._place and unix_path(self.server) is None:
            return
        try:
            new = _connected(self.server, place)
        except OSError:
            return  # the address cannot be reached: the present socket stays
        old, self.socket, self._place = self.socket, new, place
        self.moved(old, new)
        old.close()

    def _receive(self) -> bytes | None:
        for _ in range(_MAX_ERRORS):
            try:
                # One byte more than the largest datagram: one that is too large stays too large after the cut.
                return self.socket.recv(limits.MAX_DATAGRAM + 1)
            except BlockingIOError:
                return None
            except OSError:
                pass  # an ICMP error: no server listens, or no route. Each error is reported once
        return None

    def _say(self) -> None:
        """Says what is new. Each turn asks, so what is not new costs comparisons only."""
        report, stats = self.core.report, self.core.live_stats
        if report is not self._told and report is not None:
            self._told = report
            if report.words:
                log.warning("the server says: %s", report.words)
        if stats.unusable != self._said_unusable and stats.unusable:
            self._said_unusable = stats.unusable
            log.warning("a force is not sent: %s", stats.unusable)
        if stats.left_out != self._said_left_out and stats.left_out:
            self._said_left_out = stats.left_out
            log.warning("not sent with a force: %s", stats.left_out)
        if stats.phase is self._seen_phase and stats.reason == self._seen_reason:
            return
        self._seen_phase, self._seen_reason = stats.phase, stats.reason
        sentence = self._sentence()
        if sentence and sentence != self._said:
            self._said = sentence
            log.log(logging.INFO if stats.phase is Phase.OPEN else logging.WARNING, sentence)

    def _sentence(self) -> str:
        phase, welcome = self.core.phase, self.core.welcome
        if phase is Phase.OPEN and welcome is not None:
            return f"connected to {welcome.device_name} at {self.server} ({welcome.server}, {welcome.loop_hz} Hz)"
        if phase is Phase.UNANSWERED:
            return f"no answer from {self.server}; {self._doubt}? Trying on"
        if phase is Phase.REFUSED:
            return f"{self.server} refuses: {self.core.live_stats.reason}"
        if phase is Phase.LOST:
            return f"lost {self.server}: {self.core.live_stats.reason}"
        return ""


class AnyClient:
    """Base of the blocking and the asyncio client: sends forces and requests, and tells what is known of the guest."""

    def __init__(self, server: str, config: Config = Config()) -> None:
        """`server`: HOST:PORT, HOST a name or an address. Raises ValueError or OSError, with the host's name, when
        there is no such host; nobody need listen there yet."""
        self._guest = Guest(server, config, time.monotonic_ns())
        self._first_none_ns: int | None = None  # on the server's clock
        self._may_lack_return = True  # until a force has come, or the log has said so

    def send(self, hand: DeviceState, touch: Touch | Sequence[float]) -> None:
        """Sends the answer to a state at once: a force in N on the hand, or a Touch with the stiffness too."""
        self._guest.send(hand, touch)
        self._guest.flush(time.monotonic_ns())

    def answer(self, hand: DeviceState, touch: Touch | Sequence[float] | None) -> None:
        """Sends the force that an engine returned for this state. If it returned None, nothing is sent. If it only returned
        None for a second, a warning is logged once, because its `return` statement may be missing."""
        if touch is not None:
            self._may_lack_return = False
            self.send(hand, touch)
        elif self._may_lack_return:
            if self._first_none_ns is None:
                self._first_none_ns = hand.sampled_ns
            if hand.sampled_ns - self._first_none_ns >= 1_000_000_000:
                self._may_lack_return = False
                log.warning("the engine has returned None for 1 s, so no force is sent: is its `return` missing?")

    def rearm(self) -> bool:
        """Asks the server to clear a latched fault of its device. False when there is no session to ask in."""
        return self._ask(self._guest.core.rearm)

    def disarm(self) -> bool:
        """Asks the server for no force of its device until somebody rearms. False when there is no session."""
        return self._ask(self._guest.core.disarm)

    def engage(self) -> bool:
        """The operator's act of a coupling, at the leader's server. False when there is no session."""
        return self._ask(self._guest.core.engage)

    def disengage(self) -> bool:
        """The end of that, at either end's server. False when there is no session."""
        return self._ask(self._guest.core.disengage)

    def set_scale(self, position_scale: float, force_scale: float) -> bool:
        """The scales of the coupling from now on, at the leader's server, while it is not engaged or its clutch is
        held. False when there is no session."""
        return self._ask(lambda: self._guest.core.set_scale(position_scale, force_scale))

    def set_share(self, channel: int, share: float) -> bool:
        """How much the leader of that channel of the device counts among several, at the follower's server: 0 … 1.
        False when there is no session."""
        return self._ask(lambda: self._guest.core.set_share(channel, share))

    def set_output(self, output: int, setting: LampColour | Vibration) -> bool:
        """Sets a lamp of the device, or starts a pulse of vibration (`handle.outputs`, asked for with
        `Config.outputs`). False when there is no session to ask in, or it does not know outputs."""
        return self._ask(lambda: self._guest.core.set_output(output, setting))

    def take_lease(self) -> bool:
        """Asks for the channel's lease, and once more when it is lost before the answer; `holds` tells the result.
        False when there is no session."""
        return self._ask(self._guest.core.take_lease)

    def give_lease(self) -> bool:
        """Gives the lease up, and stops asking for it. False when there is no session."""
        return self._ask(self._guest.core.give_lease)

    @property
    def stats(self) -> Stats:
        return self._guest.core.stats

    @property
    def welcome(self) -> Welcome | None:
        """The server's description of itself and its device at the opening of the newest session; None before that."""
        return self._guest.core.welcome

    @property
    def description(self) -> DeviceDescription | None:
        """Description of the device, once we have named a device or a channel and the server has answered."""
        return self._guest.core.description

    @property
    def handle(self) -> HandleDescription | None:
        """How the device lies before the operator, its buttons' names, and what else its handle can do, once the server has
        answered. None for good when the server does not know FEATURE_HANDLE."""
        return self._guest.core.handle

    @property
    def holds(self) -> bool:
        """Whether the channel takes our forces. While it does not, a controller is handed no states."""
        return self._guest.core.holds

    @property
    def report(self) -> LinkReport | None:
        """The server's newest report on our forces, once a second while they come; None before the first."""
        return self._guest.core.report

    @property
    def device_report(self) -> DeviceReport | None:
        """With Config.diagnostics, the newest report on the device's loop, once a second; None before the first."""
        return self._guest.core.device_report

    @property
    def peer_reports(self) -> dict[int, PeerReport]:
        """With Config.diagnostics, the newest report on the engine of each channel, even one that has gone."""
        return self._guest.core.peer_reports

    def _ask(self, request: Callable[[], bool]) -> bool:
        asked = request()
        self._guest.flush(time.monotonic_ns())
        return asked


Place = tuple[int, int, Any]
"""A server's address as the system gives it: family, protocol and address."""


def _is_numeric(server: str) -> bool:
    try:
        ipaddress.ip_address(parse_address(server)[0])
    except ValueError:
        return False
    return True


def _look_up(server: str) -> list[Place]:
    """The addresses of a server's name, the one to prefer first. Raises OSError with the host's name."""
    if (path := unix_path(server)) is not None:
        return [(socket.AF_UNIX, 0, path)]
    host, port = parse_address(server)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "that is no host name"
        raise OSError(f"cannot find {host}: {why}") from None
    return [(family, protocol, address) for family, _, protocol, _, address in found]


def _connected(server: str, place: Place) -> socket.socket:
    """A socket on a port that the system chooses, or, to a Unix socket, with a name that it chooses. It is connected, so
    the kernel drops datagrams from other senders."""
    family, protocol, address = place
    connected = socket.socket(family, socket.SOCK_DGRAM, protocol)
    try:
        connected.setblocking(False)
        if family == getattr(socket, "AF_UNIX", None):
            connected.bind("")
        connected.connect(address)
    except OSError as error:
        connected.close()
        raise OSError(f"cannot reach {server}: {error.strerror}") from None
    return connected
