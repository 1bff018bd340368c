# SPDX-License-Identifier: Apache-2.0
"""A session that can be used by clients and servers (SESSION.md). This is a state machine, whose inputs are bytes and
times, and whose outputs are bytes and events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

from . import codec, limits
from .cipher import Cipher, Forged, OldKey, Plain
from .codec import DatagramType, Echo, Header, Suite
from .messages import (
    NEVER,
    Bye,
    Code,
    Control,
    ControlAck,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    FieldBrick,
    FieldPose,
    FieldStatus,
    ForceCommand,
    HandleDescription,
    Frame,
    Instant,
    LinkReport,
    LinkStats,
    PeerReport,
    PortState,
    Request,
)
from .replay_window import ReplayWindow
from .requests import IncomingRequests, OutgoingRequests
from .round_trip import RoundTrip

KEEP_ALIVE_NS = 50_000_000
"""Maximum time between two sent datagrams, so that a server stops after 250 ms only if five in a row are lost."""
TIMEOUT_NS = 2_000_000_000
"""The session is closed if the peer is silent for this time, which is longer than Wi-Fi roaming."""
MIN_RESEND_NS = 20_000_000
"""A request is repeated after max(this, SRTT + 4 RTTVAR)."""


@dataclass(frozen=True, slots=True)
class Closed:
    """The end of the session by a Bye of the peer. Code.TIMED_OUT: the peer was silent. Code.EXPIRED: maximum age
    reached."""

    code: Code
    reason: str


Event = Union[
    DeviceState,
    ForceCommand,
    LinkReport,
    DeviceReport,
    PeerReport,
    PortState,
    FieldBrick,
    FieldStatus,
    FieldPose,
    Control,
    ControlAck,
    Closed,
]
"""A Control is a received request that must be answered. A ControlAck is the answer to a sent request."""


def _stream(report: DeviceReport | PeerReport) -> tuple[int, int]:
    """Device and channel; −1 for the device itself."""
    return (report.device, report.channel if isinstance(report, PeerReport) else -1)


def _end(port: PortState) -> tuple[int, int, bool]:
    return (port.device, port.channel, port.of_peer)


class Session:
    """It does no I/O and does not use a clock, threads or random numbers.

    Call `receive` for each datagram and `tick` when `next_turn()` is due, then call `next_event` and
    `next_datagram` until they are empty. `now` must not decrease.

    All queues are bounded: one state, one force, one brick, one report, one port state (for each device, channel and
    end), one pose and one status of a field, and limits.REQUEST_WINDOW requests in each direction. If a newer value
    arrives before a value is taken, it replaces it.
    """

    def __init__(self, connection_id: int, opened: int, cipher: Cipher | None = None) -> None:
        """`opened` is the time of the end of the handshake. The first datagram is due immediately."""
        self.open = True
        self.stats = LinkStats()
        self._connection_id = connection_id
        self._opened = opened
        self.latest = opened  # newest value of `now`
        self._cipher = cipher or Plain()
        self._expires = NEVER if self._cipher.suite is Suite.PLAIN else opened + limits.LIFE_NS
        self._room = limits.MAX_DATAGRAM - codec.HEADER_SIZE - self._cipher.overhead
        # Out.
        self._next_packet = 0
        self._last_sent: int | None = None
        self._state_to_send: DeviceState | None = None
        self._force_to_send: ForceCommand | None = None
        self._report_to_send: LinkReport | None = None
        self._diagnoses_to_send: dict[tuple[int, int], DeviceReport | PeerReport] = {}
        self._ports_to_send: dict[tuple[int, int, bool], PortState] = {}  # by device, channel and end
        self._poses_to_send: dict[tuple[int, int], FieldPose] = {}  # by device and channel
        self._statuses_to_send: dict[bytes, FieldStatus] = {}  # by field
        self._brick_to_send: FieldBrick | None = None
        self._asked = OutgoingRequests()
        self._bye: Bye | None = None
        self._byes_left = 0
        # In.
        self._last_heard = opened
        self._seen = ReplayWindow()
        self._newest_number = -1  # of the accepted datagrams, with its T1 and T2
        self._newest_sent_ns = 0
        self._newest_received_ns = 0
        self._newest_tick: dict[int, int] = {}  # by device
        self._newest_sequence: dict[tuple[int, int], int] = {}  # by device and channel
        self._newest_report = 0
        self._newest_diagnosis: dict[tuple[int, int], int] = {}  # by _stream
        self._newest_port: dict[tuple[int, int, bool], tuple[int, int]] = {}  # epoch and sequence, by the same key
        self._newest_pose: dict[tuple[int, int], int] = {}  # by device and channel
        self._newest_echoed = -1  # newest sent packet that the peer has echoed
        self._answering = IncomingRequests()
        self._round_trip = RoundTrip()
        self.has_events = False
        """Whether next_event() may return an event."""
        self._state_arrived: DeviceState | None = None
        self._force_arrived: ForceCommand | None = None
        self._report_arrived: LinkReport | None = None
        self._diagnoses_arrived: dict[tuple[int, int], DeviceReport | PeerReport] = {}
        self._ports_arrived: dict[tuple[int, int, bool], PortState] = {}
        self._poses_arrived: dict[tuple[int, int], FieldPose] = {}
        self._statuses_arrived: dict[bytes, FieldStatus] = {}
        self._brick_arrived: FieldBrick | None = None
        self._closed: Closed | None = None

    # ---- In ----

    def receive(self, now: int, datagram: bytes) -> None:
        """Handles a datagram. Datagrams are counted and dropped if they are malformed or belong to another session."""
        self.latest = now
        if not self.open:
            return
        header = codec.decode_header(datagram)
        if header is not None and header.type is not DatagramType.DATA:
            self.stats.duplicated += 1  # a late duplicate of the handshake
            return
        if (
            header is None
            or header.connection_id != self._connection_id
            or header.suite is not self._cipher.suite
            or header.packet_number >= limits.PACKET_NUMBERS
        ):
            self.stats.malformed += 1
            return
        number = header.packet_number
        if self._seen.contains(number):
            self.stats.duplicated += 1
            return
        clear, sealed = datagram[: codec.HEADER_SIZE], datagram[codec.HEADER_SIZE :]
        try:
            body = self._cipher.open(now, header.epoch, number, clear, sealed)
        except Forged:
            self.stats.forged += 1
            return
        except OldKey:
            self.stats.old_key += 1
            return
        content = codec.read_data(body)
        if content is None:
            self.stats.malformed += 1
            if self._cipher.suite is not Suite.PLAIN:
                self._seen.insert(number)  # only if authentic: in suite 0, a damaged copy must not block the original
            return
        self._accept(now, number, content)

    def send(
        self,
        frame: (
            DeviceState | ForceCommand | LinkReport | DeviceReport | PeerReport | PortState | FieldBrick | FieldStatus | FieldPose
        ),
    ) -> None:
        """Queues a frame, replacing an unsent one of the same kind."""
        if isinstance(frame, ForceCommand):
            self._force_to_send = frame
        elif isinstance(frame, LinkReport):
            self._report_to_send = frame
        elif isinstance(frame, (DeviceReport, PeerReport)):
            self._diagnoses_to_send[_stream(frame)] = frame
        elif isinstance(frame, PortState):
            self._ports_to_send[_end(frame)] = frame
        elif isinstance(frame, FieldPose):
            self._poses_to_send[frame.device, frame.channel] = frame
        elif isinstance(frame, FieldStatus):
            self._statuses_to_send[frame.field] = frame
        elif isinstance(frame, FieldBrick):
            self._brick_to_send = frame
        else:
            self._state_to_send = frame

    def request(self, request: Request) -> int | None:
        """Queues a reliable request and returns its id, or None if limits.REQUEST_WINDOW requests are pending."""
        return self._asked.add(request)

    def answer(
        self,
        number: int,
        code: Code,
        detail: str,
        wait_ms: int = 0,
        device: DeviceDescription | None = None,
        handle: HandleDescription | None = None,
    ) -> None:
        """Answers a received Control. Each must be answered. Ids without a pending request are ignored."""
        self._answering.answer(ControlAck(number, code, detail, wait_ms, device, handle))

    def close(self, code: Code, reason: str) -> None:
        """Sends a Bye and closes. Unsent frames are dropped. No Closed event follows."""
        if self.open:
            self.open = False
            self._bye = Bye(code, reason)
            self._byes_left = limits.BYES

    def tick(self, now: int) -> None:
        """Checks the timeout of the peer and the age of the session."""
        self.latest = now
        if not self.open:
            return
        if now - self._last_heard >= TIMEOUT_NS:
            self.open = False
            self._closed = Closed(Code.TIMED_OUT, f"nothing received for {TIMEOUT_NS // 1_000_000} ms")
            self.has_events = True
        elif now >= self._expires or self.stats.forged >= limits.MAX_FORGED:
            self._closed = Closed(Code.EXPIRED, "the session has reached its maximum age")
            self.has_events = True
            self.close(self._closed.code, self._closed.reason)

    # ---- Out ----

    def next_datagram(self, now: int) -> bytes | None:
        """Returns the next datagram that should be sent, or None if there is none."""
        self.latest = now
        if self._byes_left > 0 and self._bye is not None:
            self._byes_left -= 1
            return self._seal(now, self._head(now) + codec.write_frame(self._bye))
        if not self.open or not self._something_to_say(now):
            return None
        return self._seal(now, self._fill(now))

    def next_event(self) -> Event | None:
        """Returns the next event. Closed is the last one."""
        event: Event | None = self._answering.next() or self._asked.next_answer()
        if event is None:
            event, self._force_arrived = self._force_arrived, None
        if event is None and self._ports_arrived:
            event = self._ports_arrived.pop(min(self._ports_arrived))
        if event is None:
            event, self._report_arrived = self._report_arrived, None
        if event is None and self._diagnoses_arrived:
            event = self._diagnoses_arrived.pop(min(self._diagnoses_arrived))
        if event is None:
            event, self._state_arrived = self._state_arrived, None
        if event is None and self._poses_arrived:
            event = self._poses_arrived.pop(min(self._poses_arrived))
        if event is None and self._statuses_arrived:
            event = self._statuses_arrived.pop(min(self._statuses_arrived))
        if event is None:
            event, self._brick_arrived = self._brick_arrived, None
        if event is None:
            event, self._closed = self._closed, None
            self.has_events = event is not None
        return event

    def peer_time(self, now: int) -> int | None:
        """Returns the time of the peer's clock at `now`. Returns None if no datagram has been received. If the delays of the
        two directions are different, the error is half of the difference."""
        if self._newest_number < 0:
            return None
        return self._newest_sent_ns + (now - self._newest_received_ns) + self._round_trip.smoothed // 2

    def next_turn(self) -> Instant:
        """Returns when `tick` and `next_datagram` are due. The time is not in the future if there is something to
        send."""
        if not self.open:
            return self.latest if self._byes_left > 0 else NEVER
        if self._last_sent is None or self._something_to_say(self.latest):
            return self.latest
        silence = self._last_heard + TIMEOUT_NS
        return min(silence, self._expires, self._last_sent + KEEP_ALIVE_NS, self._asked.next_due())

    # ---- Inside ----

    def _accept(self, now: int, number: int, content: codec.DataContent) -> None:
        stats = self.stats
        stats.datagrams_received += 1
        stats.invalid += content.invalid
        self._last_heard = now
        newest = number > self._seen.highest
        self._seen.insert(number)
        stats.lost = self._seen.missing()
        if newest:
            self._newest_number = number
            self._newest_sent_ns = content.sent_ns
            self._newest_received_ns = now
        else:
            stats.reordered += 1
        if content.echo is not None:
            self._observe(now, content.sent_ns, content.echo)
        for frame in content.frames:
            self._take(frame, newest)
            self.has_events = True

    def _take(self, frame: Frame, newest: bool) -> None:
        if isinstance(frame, DeviceState):
            if frame.tick <= self._newest_tick.get(frame.device, -1):
                self.stats.stale += 1
                return
            self._newest_tick[frame.device] = frame.tick
            self._state_arrived = frame
        elif isinstance(frame, ForceCommand):
            channel = (frame.device, frame.channel)
            if frame.sequence <= self._newest_sequence.get(channel, -1):
                self.stats.stale += 1
                return
            self._newest_sequence[channel] = frame.sequence
            self._force_arrived = frame
        elif isinstance(frame, LinkReport):
            if frame.number <= self._newest_report:
                self.stats.stale += 1
                return
            self._newest_report = frame.number
            self._report_arrived = frame
        elif isinstance(frame, (DeviceReport, PeerReport)):
            stream = _stream(frame)
            number = frame.link.number if isinstance(frame, PeerReport) else frame.number
            if number <= self._newest_diagnosis.get(stream, 0):
                self.stats.stale += 1
                return
            self._newest_diagnosis[stream] = number
            self._diagnoses_arrived[stream] = frame
        elif isinstance(frame, PortState):
            end, age = _end(frame), (frame.epoch, frame.sequence)
            if age <= self._newest_port.get(end, (0, 0)):
                self.stats.stale += 1
                return
            self._newest_port[end] = age
            self._ports_arrived[end] = frame
        elif isinstance(frame, FieldPose):
            channel = (frame.device, frame.channel)
            if frame.sequence <= self._newest_pose.get(channel, 0):
                self.stats.stale += 1
                return
            self._newest_pose[channel] = frame.sequence
            self._poses_arrived[channel] = frame
        elif isinstance(frame, FieldStatus):
            if newest:
                self._statuses_arrived[frame.field] = frame
            else:
                self.stats.stale += 1
        elif isinstance(frame, FieldBrick):
            self._brick_arrived = frame
        elif isinstance(frame, Control):
            self.stats.invalid += not self._answering.take(frame)
        elif isinstance(frame, ControlAck):
            self.stats.invalid += not self._asked.acknowledge(frame)
        else:
            self.open = False
            self._closed = Closed(frame.code, frame.reason)

    def _observe(self, now: int, sent_ns: int, told: Echo) -> None:
        possible = (
            told.packet_number < self._next_packet
            and self._opened <= told.sent_ns <= now
            and sent_ns >= told.received_ns
        )
        if not possible:
            self.stats.invalid += 1
            return
        self._count_lost_outgoing(told)
        sample = (now - told.sent_ns) - (sent_ns - told.received_ns)
        if sample < 0:  # possible if the clock rates differ and the peer held the echo for long
            return
        self._round_trip.observe(sample)
        self.stats.round_trip_ns = self._round_trip.newest
        self.stats.smoothed_round_trip_ns = self._round_trip.smoothed
        self.stats.round_trip_variation_ns = self._round_trip.variation

    def _count_lost_outgoing(self, told: Echo) -> None:
        since = told.packet_number - self._newest_echoed
        if since <= 0:
            return
        # The ack vector covers the echoed packet and at most 32 before it.
        before = min(since - 1, 32)
        self.stats.lost_outgoing += before - (told.received_mask & ((1 << before) - 1)).bit_count()
        self._newest_echoed = told.packet_number

    def _something_to_say(self, now: int) -> bool:
        return (
            self._force_to_send is not None
            or self._state_to_send is not None
            or self._report_to_send is not None
            or bool(self._diagnoses_to_send)
            or bool(self._ports_to_send)
            or bool(self._poses_to_send)
            or bool(self._statuses_to_send)
            or self._brick_to_send is not None
            or self._last_sent is None
            or now - self._last_sent >= KEEP_ALIVE_NS
            or self._asked.next_due() <= now
            or bool(self._answering.due())
        )

    def _head(self, now: int) -> bytes:
        echo = None
        if self._newest_number >= 0:
            mask = self._seen.mask_before(self._newest_number)
            echo = Echo(self._newest_sent_ns, self._newest_received_ns, self._newest_number, mask)
        return codec.write_data_head(now, echo)

    def _fill(self, now: int) -> bytes:
        """Writes as many frames as possible, the most time-critical ones first. The next datagram contains the
        others."""
        body = bytearray(self._head(now))

        def add(frame: Frame) -> bool:
            piece = codec.write_frame(frame)
            fits = len(body) + len(piece) <= self._room
            if fits:
                body.extend(piece)
            return fits

        if self._state_to_send is not None and add(self._state_to_send):
            self._state_to_send = None
        while self._ports_to_send and add(self._ports_to_send[min(self._ports_to_send)]):
            del self._ports_to_send[min(self._ports_to_send)]
        if self._force_to_send is not None and add(self._force_to_send):
            self._force_to_send = None
        while self._poses_to_send and add(self._poses_to_send[min(self._poses_to_send)]):
            del self._poses_to_send[min(self._poses_to_send)]
        for ack in self._answering.due():
            if not add(ack):
                break
            self._answering.sent(ack.id)
        timeout = self._round_trip.timeout(MIN_RESEND_NS)
        for control in self._asked.due(now):
            if not add(control):
                break
            self._asked.sent(control.id, now, timeout)
        if self._report_to_send is not None and add(self._report_to_send):
            self._report_to_send = None
        while self._diagnoses_to_send and add(self._diagnoses_to_send[min(self._diagnoses_to_send)]):
            del self._diagnoses_to_send[min(self._diagnoses_to_send)]
        while self._statuses_to_send and add(self._statuses_to_send[min(self._statuses_to_send)]):
            del self._statuses_to_send[min(self._statuses_to_send)]
        if self._brick_to_send is not None and add(self._brick_to_send):
            self._brick_to_send = None
        return bytes(body)

    def _seal(self, now: int, body: bytes) -> bytes:
        number = self._next_packet
        header = codec.encode_header(
            Header(DatagramType.DATA, self._cipher.suite, self._cipher.next_epoch(now), self._connection_id, number)
        )
        self._next_packet += 1
        self.stats.datagrams_sent += 1
        self._last_sent = now
        return header + self._cipher.seal(number, header, body)
