# SPDX-License-Identifier: Apache-2.0
"""Base of the blocking and the asyncio client: a ForceClient with its socket and log messages."""

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
from .expect import expect
from .force_client import ForceClient
from .field import Field
from .messages import (
    Code,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    HandleDescription,
    LampColour,
    LinkReport,
    PeerReport,
    Quat,
    Touch,
    Vec3,
    Vibration,
    Welcome,
)
from .upload import Motion

log = logging.getLogger("tendon")


def visible(text: str) -> str:
    """Escapes control characters (C0, DEL, C1) in the text of a peer as \\n, \\t or \\xNN, so that it cannot start a
    new line or move the cursor in a log or terminal."""
    known = {"\n": "\\n", "\t": "\\t"}
    return re.sub(r"[\x00-\x1f\x7f-\x9f]", lambda c: known.get(c[0], f"\\x{ord(c[0]):02x}"), text)


def _make_visible(record: logging.LogRecord) -> bool:
    record.msg, record.args = visible(record.getMessage()), None
    return True


log.addFilter(_make_visible)

MAX_DATAGRAMS = 256
"""The maximum number of datagrams read in one turn, so that a flood cannot prevent sending. A server at 1 kHz sends
256 datagrams in a quarter of a second, the longest silence before it stops the device."""

_MAX_ERRORS = 64
"""The maximum number of errors skipped when reading a datagram."""

_KEEP_TRYING = (Code.BUSY, Code.SHUTDOWN)


class RefusedForGood(ConnectionError):
    """The server refused the connection permanently."""

    def __init__(self, sentence: str, code: Code) -> None:
        super().__init__(visible(sentence))
        self.code = code


def parse_address(text: str) -> tuple[str, int]:
    """Parses 127.0.0.1:47100, [::1]:47100 or name:47100. Raises ValueError."""
    host, colon, port = text.rpartition(":")
    bracketed = host.startswith("[") and host.endswith("]")
    if not colon or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
        raise ValueError(f'expected HOST:PORT like 127.0.0.1:47100 or [::1]:47100, got "{text}"')
    if not host or (":" in host and not bracketed):
        raise ValueError(f'expected HOST:PORT like 127.0.0.1:47100 or [::1]:47100, got "{text}"')
    return (host[1:-1] if bracketed else host, int(port))


_MAX_UNIX_PATH = 107
"""Size limit of a socket address in bytes."""


def unix_path(server: str) -> str | None:
    """Returns the path of "unix:/run/tendon.sock", the Unix socket of a server on this machine, or None for other
    names. Raises ValueError if the path is too long."""
    if not server.startswith("unix:"):
        return None
    path = server.removeprefix("unix:")
    if not 0 < len(os.fsencode(path)) <= _MAX_UNIX_PATH or "\0" in path:
        raise ValueError(f'expected unix:PATH with a path of 1 to {_MAX_UNIX_PATH} bytes, like unix:/run/tendon.sock, got "{server}"')
    return path


class Guest:
    """`turn(now)` does all the work that is due. Not thread-safe."""

    def __init__(self, server: str, config: Config, now: int, clock: Callable[[], int] = time.monotonic_ns) -> None:
        """Raises ValueError if `server` is neither HOST:PORT nor unix:PATH, and OSError if the host is unknown or
        unreachable. Resolves a host name, which may block. The name is resolved again, in a separate thread,
        before each further attempt."""
        self.server = server
        self._place = _look_up(server)[0]
        self.socket = _connected(self.server, self._place)
        self.moved: Callable[[socket.socket, socket.socket], None] = lambda old, new: None
        """Called after the socket is replaced, before the old one is closed."""
        self._found: list[Place] = []
        self._waited = False
        self.core = ForceClient(config, now)
        self.clock = clock
        self._doubt = "is tendond running there" + (", and does it know our key" if config.key else "")
        self._said = ""
        self._said_unusable = ""
        self._said_left_out = ""
        self._said_field = ""
        self._told: LinkReport | None = None
        self._seen_phase: Phase | None = None
        self._seen_reason = ""

    def turn(self, now: int) -> None:
        """Receives, does the work that is due, and sends."""
        self.tend(self.take(now))

    def take(self, now: int) -> int:
        """The first half of a turn: receives datagrams and returns the time. The newest state should be answered before
        the other half."""
        for _ in range(MAX_DATAGRAMS):
            datagram = self._receive()
            if datagram is None:
                break
            # The datagram may have arrived after the turn began.
            now = max(now, self.clock())
            self.core.receive(now, datagram)
        return now

    def tend(self, now: int) -> None:
        """The second half of a turn."""
        self.core.tick(now)
        self.flush(now)
        self._follow_the_name()
        self._say()

    def flush(self, now: int) -> None:
        while (datagram := self.core.next_datagram(now)) is not None:
            try:
                self.socket.send(datagram)
            except OSError:
                pass  # the datagram is lost

    def send(self, hand: DeviceState, touch: Touch | Sequence[float]) -> None:
        """Answers a state with a force or a Touch."""
        self.core.send(hand, touch if isinstance(touch, Touch) else Touch(touch))

    def end(self, now: int) -> None:
        """Sends a Bye and closes the socket."""
        self.core.stop(now)
        self.flush(now)
        self.socket.close()

    def raise_if_refused(self) -> None:
        if self.core.phase not in (Phase.REFUSED, Phase.STOPPED):
            return
        stats = self.core.stats
        if stats.phase is Phase.REFUSED and stats.code not in _KEEP_TRYING:
            raise RefusedForGood(f"{self.server} refused the connection: {stats.reason}", stats.code)
        if stats.phase is Phase.STOPPED and stats.code is Code.REPLACED:
            raise RefusedForGood(f"{self.server} has ended the session: {stats.reason}", stats.code)

    def _follow_the_name(self) -> None:
        """Resolves the name again between two attempts, because the server may have a new address. If the current
        address did not answer, the next one is tried."""
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
        # The path of a Unix socket may belong to a new server.
        if place == self._place and unix_path(self.server) is None:
            return
        try:
            new = _connected(self.server, place)
        except OSError:
            return  # unreachable; keep the current socket
        old, self.socket, self._place = self.socket, new, place
        self.moved(old, new)
        old.close()

    def _receive(self) -> bytes | None:
        for _ in range(_MAX_ERRORS):
            try:
                # This is one more byte than the limit, so that it is possible to detect a datagram that is too large.
                return self.socket.recv(limits.MAX_DATAGRAM + 1)
            except BlockingIOError:
                return None
            except OSError:
                pass  # an ICMP error: no server is listening, or no route
        return None

    def _say(self) -> None:
        """Logs changes. Called in each turn, so the common case only compares values."""
        report, stats = self.core.report, self.core.live_stats
        if report is not self._told and report is not None:
            self._told = report
            if report.words:
                log.warning("report of the server: %s", report.words)
        if stats.unusable != self._said_unusable and stats.unusable:
            self._said_unusable = stats.unusable
            log.warning("a force was not sent: %s", stats.unusable)
        if stats.left_out != self._said_left_out and stats.left_out:
            self._said_left_out = stats.left_out
            log.warning("not sent with a force: %s", stats.left_out)
        refused = self.core.fields.refused
        if refused != self._said_field:
            self._said_field = refused
            if refused:
                log.warning("the field is not used: %s", refused)
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
            return f"no answer from {self.server}; {self._doubt}? Retrying"
        if phase is Phase.REFUSED:
            return f"{self.server} refused the connection: {self.core.live_stats.reason}"
        if phase is Phase.LOST:
            return f"lost {self.server}: {self.core.live_stats.reason}"
        return ""


class AnyClient:
    """Base of the blocking and the asyncio client: sends forces and requests, and returns received descriptions."""

    def __init__(self, server: str, config: Config = Config()) -> None:
        """`server` is HOST:PORT with a name or address as HOST. Raises ValueError or OSError if the host is unknown.
        The server may start later."""
        self._guest = Guest(server, config, time.monotonic_ns())
        self._first_none_ns: int | None = None  # in the server's clock
        self._may_lack_return = True  # until a force was returned or the warning was logged

    def send(self, hand: DeviceState, touch: Touch | Sequence[float]) -> None:
        """Sends the answer to a state immediately: a force in N on the hand, or a Touch."""
        self._guest.send(hand, touch)
        self._guest.flush(time.monotonic_ns())

    def answer(self, hand: DeviceState, touch: Touch | Sequence[float] | None) -> None:
        """Sends the result of an engine for this state. If it is None, no force is sent. If the engine returns only
        None for one second, a warning is logged once, because its `return` statement may be missing."""
        if touch is not None:
            self._may_lack_return = False
            self.send(hand, touch)
        elif self._may_lack_return:
            if self._first_none_ns is None:
                self._first_none_ns = hand.sampled_ns
            if hand.sampled_ns - self._first_none_ns >= 1_000_000_000:
                self._may_lack_return = False
                log.warning("the engine has returned None for 1 s, so no force is sent; check for a missing `return`")

    def use(self, field: Field | None) -> None:
        """Asks the server to render a field in the channel. Bricks that are missing on the server are uploaded while states
        are requested. If the client reconnects, this is repeated. If only the materials have changed, no bricks are
        sent. If `field` is None, the server stops rendering the current field. Requires `Config.fields`, which is set by
        tendon.connect. If the server refuses the field, `field_refused` contains the reason."""
        expect(self._guest.core.config.fields, "fields", False, "Config(fields=True), as by tendon.connect")
        self._guest.core.fields.use(None if field is None else field.describe())
        self._guest.turn(time.monotonic_ns())

    def pose(
        self,
        position: Sequence[float],
        turn: Sequence[float],
        twist: Sequence[float] = (0.0,) * 6,
        ahead_s: float = 0,
    ) -> bool:
        """Sends the predicted pose of the object at `ahead_s` from now, in the base frame of the device. `position` is in
        m, `turn` is a quaternion (w, x, y, z), and `twist` contains the velocity (m/s) and the angular velocity (rad/s).
        If possible, the engine should predict the pose for the time of its arrival, which is half a round trip later,
        because the server only extrapolates it for 50 ms. Returns False if there is no session, or if the server does
        not support fields. Raises ValueError if a value is larger than 10 m, 10 m/s or 100 rad/s."""
        now = time.monotonic_ns()
        x, y, z, *angular = (float(value) for value in twist)
        motion = Motion(_three(position), _four(turn), (x, y, z), _three(angular))
        sent = self._guest.core.fields.move(now, motion, round(ahead_s * 1e9))
        self._guest.flush(now)
        return sent

    def truth(self, hand: DeviceState, force: Touch | Sequence[float]) -> bool:
        """Sends the true force in N for a state. It is not rendered, but the server uses it to correct the field. Returns
        False if the state does not contain a field."""
        sent = self._guest.core.truth(hand, force if isinstance(force, Touch) else Touch(force))
        self._guest.flush(time.monotonic_ns())
        return sent

    @property
    def field_refused(self) -> str:
        """The reason why the server has refused the field. Empty if it was not refused."""
        return self._guest.core.fields.refused

    def rearm(self) -> bool:
        """Asks the server to clear a latched fault of its device. Returns False if there is no session."""
        return self._ask(self._guest.core.rearm)

    def disarm(self) -> bool:
        """Asks the server to disable all forces until a client rearms. Returns False if there is no session."""
        return self._ask(self._guest.core.disarm)

    def engage(self) -> bool:
        """Engages a coupling, at the server of the leader. Returns False if there is no session."""
        return self._ask(self._guest.core.engage)

    def disengage(self) -> bool:
        """Disengages a coupling, at either server. Returns False if there is no session."""
        return self._ask(self._guest.core.disengage)

    def set_scale(self, position_scale: float, force_scale: float) -> bool:
        """Sets the scales of the coupling at the server of the leader. The coupling must not be engaged unless its
        clutch is held. Returns False if there is no session."""
        return self._ask(lambda: self._guest.core.set_scale(position_scale, force_scale))

    def set_share(self, channel: int, share: float) -> bool:
        """Sets the weight, 0 … 1, of the leader on that channel if several leaders share one follower. Must be sent
        to the server of the follower. Returns False if there is no session."""
        return self._ask(lambda: self._guest.core.set_share(channel, share))

    def set_output(self, output: int, setting: LampColour | Vibration) -> bool:
        """Sets an indicator lamp or starts a vibration pulse (`handle.outputs`; requires `Config.outputs`). Returns
        False if there is no session or it does not support outputs."""
        return self._ask(lambda: self._guest.core.set_output(output, setting))

    def take_lease(self) -> bool:
        """Requests the lease of the channel. The request is repeated if the lease is lost before the answer arrives.
        `holds` contains the result. Returns False if there is no session."""
        return self._ask(self._guest.core.take_lease)

    def give_lease(self) -> bool:
        """Releases the lease and stops requesting it. Returns False if there is no session."""
        return self._ask(self._guest.core.give_lease)

    @property
    def stats(self) -> Stats:
        return self._guest.core.stats

    @property
    def welcome(self) -> Welcome | None:
        """Description of the server in the newest session. None before the first."""
        return self._guest.core.welcome

    @property
    def description(self) -> DeviceDescription | None:
        """Description of the device. None until it arrives; it is only requested if a device or channel is named."""
        return self._guest.core.description

    @property
    def handle(self) -> HandleDescription | None:
        """Orientation of the device relative to the operator, names of the buttons, and other properties of the
        handle. None until it arrives, and always if the server does not support FEATURE_HANDLE."""
        return self._guest.core.handle

    @property
    def holds(self) -> bool:
        """Whether this client holds the channel. Otherwise a controller receives no states."""
        return self._guest.core.holds

    @property
    def report(self) -> LinkReport | None:
        """The newest report on the received forces. It is sent once per second if there are any. None before the
        first."""
        return self._guest.core.report

    @property
    def device_report(self) -> DeviceReport | None:
        """Newest report on the loop of the device, once per second. None before the first. Requires
        Config.diagnostics."""
        return self._guest.core.device_report

    @property
    def peer_reports(self) -> dict[int, PeerReport]:
        """The newest report on the engine of each channel. If the engine leaves, the report is not removed. Requires
        Config.diagnostics."""
        return self._guest.core.peer_reports

    def _ask(self, request: Callable[[], bool]) -> bool:
        asked = request()
        self._guest.flush(time.monotonic_ns())
        return asked


def _three(values: Sequence[float]) -> Vec3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _four(values: Sequence[float]) -> Quat:
    w, x, y, z = (float(value) for value in values)
    return (w, x, y, z)


Place = tuple[int, int, Any]
"""A server address: family, protocol and address."""


def _is_numeric(server: str) -> bool:
    try:
        ipaddress.ip_address(parse_address(server)[0])
    except ValueError:
        return False
    return True


def _look_up(server: str) -> list[Place]:
    """Returns the addresses of a server in order of preference. Raises OSError with the name of the host."""
    if (path := unix_path(server)) is not None:
        return [(socket.AF_UNIX, 0, path)]
    host, port = parse_address(server)
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not a valid host name"
        raise OSError(f"cannot find {host}: {why}") from None
    return [(family, protocol, address) for family, _, protocol, _, address in found]


def _connected(server: str, place: Place) -> socket.socket:
    """Creates a socket with an ephemeral port, or a Unix socket with an autobind address. It is connected, so that
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
