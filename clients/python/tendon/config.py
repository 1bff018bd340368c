# SPDX-License-Identifier: Apache-2.0
"""The configuration and the statistics of a client."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from . import limits
from .cipher import names_of, usable_suites
from .codec import Suite
from .deadband import ForceDeadband, check_state_deadband
from .expect import expect
from .messages import Code, LinkStats, Role, SetStateDeadband
from .noise import KEY_SIZE

MIN_RATE_HZ = 1e-3
MAX_RATE_HZ = 1e5


@dataclass(frozen=True, kw_only=True)
class Config:
    """Configuration of a client. Raises ValueError "FIELD = VALUE: expected …" if a value is invalid."""

    name: str = "guest"
    """This name is used in the log of the server. It has at most 64 bytes."""
    role: Role = Role.CONTROLLER
    """A controller receives states and sends forces, one per channel. An observer only receives."""
    device: str = ""
    """The name of the device, which has at most 24 bytes. If it is empty, this is the first one of the server."""
    channel: str = ""
    """The name of the channel of the device, which has at most 24 bytes. If it is empty, this is the first one."""
    take_lease: bool = False
    """If another controller has the lease of the channel, this client keeps asking for it. It sends the request again
    when the server reports that the lease may have ended."""
    key: bytes | None = field(default=None, repr=False)
    """32 bytes shared with the server (`read_key`). If there is a key, all traffic is encrypted. Without a key,
    servers accept only local clients."""
    suites: tuple[Suite, ...] = usable_suites()
    """Cipher suites offered for an encrypted session. The server selects one."""
    rate_hz: float = 0
    """The number of states that are returned per second. A state is returned at each multiple of 1/rate_hz, or when a
    new one is available after that. If this is delayed by a full period, the schedule is restarted, and the missed
    states are not returned later. If it is 0, every new state is returned."""
    state_hz: int = 0
    """The number of states per second that is requested from the server. If it is 0, this is the default of the
    server."""
    valid_for_s: float = 0
    """How long after its arrival the server may use a force; at most 10 s. 0: derived from the period T between
    forces, which is the requested period or, if the engine is slower, the time between the states that the last
    two forces answer:

        T         = max(1 / rate_hz, min(Δtick / loop_hz, 0.1))      if rate_hz = 0: the second term
        valid_for = max(3 T, 0.02)                           with a deadband: T ≥ its longest silence
    """
    deadband: ForceDeadband | None = None
    """Omit forces that a human cannot distinguish from the last one sent. None: every force is sent."""
    state_deadband: SetStateDeadband | None = None
    """The server omits states that can be predicted by the client. If rate_hz = r > 0, states are returned at multiples
    of 1/r as predicted for that time, including tick and sampling time. Ticks always increase. A state is not predicted
    for longer than max_silence_us. If rate_hz = 0, only received states are returned. None: all states are
    requested."""
    diagnostics: bool = False
    """For observers: requests the forces of the engines before limiting (`DeviceState.force_wanted`), and reports on
    the loop of the device and its engines once per second. Servers that do not support this feature omit them."""
    joints: bool = False
    """Requests the joints of the device (`DeviceState.joints`, `HandleDescription.joints`): 16 bytes per joint and
    state."""
    outputs: bool = False
    """Requests access to the outputs of the device (`HandleDescription.outputs`: lamps, vibration). Required for
    `set_output`."""
    fields: bool = False
    """Requests that the server can render a field (`use`, `pose`, `truth`; tendon.connect sets this)."""
    ways: tuple[str, ...] = ()
    """The names of the methods that are used by this engine to compute forces. `Touch.way` is an index into this list,
    starting at 1. Observers and recordings receive the names. There can be at most 8 different names, and each of them
    has 1 to 24 bytes."""
    patience_s: float = 2.0
    """The time to wait for an answer in an attempt."""
    retry_min_s: float = 0.1
    """The time to wait before the first retry. It is doubled after each attempt."""
    retry_max_s: float = 2.0
    """The upper limit of the time before a retry. When a session receives its first state, this time is reset."""

    def __post_init__(self) -> None:
        def expect_at_most(most: int, text: str, field: str) -> None:
            size = len(text.encode(errors="replace"))
            expect(size <= most, f"{field}.size", size, f"at most {most} bytes")

        expect_at_most(limits.MAX_NAME, self.name, "name")
        expect_at_most(limits.MAX_LABEL, self.device, "device")
        expect_at_most(limits.MAX_LABEL, self.channel, "channel")
        expect(len(self.ways) <= limits.MAX_WAYS, "ways.size", len(self.ways), f"at most {limits.MAX_WAYS} names")
        for i, way in enumerate(self.ways):
            expect(way != "", f"ways[{i}].size", 0, "at least 1 byte")
            expect_at_most(limits.MAX_LABEL, way, f"ways[{i}]")
            expect(way not in self.ways[:i], f"ways[{i}]", way, "unique names")
        if self.key is not None:
            expect(len(self.key) == KEY_SIZE, "key.size", len(self.key), f"{KEY_SIZE} bytes")
        usable = bool(self.suites) and set(self.suites) <= set(usable_suites())
        expect(usable, "suites", names_of(self.suites), f"some of {names_of(usable_suites())}")
        rate_possible = self.rate_hz == 0 or MIN_RATE_HZ <= self.rate_hz <= MAX_RATE_HZ
        expect(rate_possible, "rate_hz", self.rate_hz, "0, or 0.001 to 100000")
        expect(0 <= self.state_hz <= limits.MAX_LOOP_HZ, "state_hz", self.state_hz, "0 to 1000000")
        expect(0 <= self.valid_for_s <= 10, "valid_for_s", self.valid_for_s, "0 to 10")
        if self.state_deadband:
            check_state_deadband(self.state_deadband)
        observes = self.role is Role.OBSERVER
        expect(not self.diagnostics or observes, "diagnostics", True, "False: only observers can use diagnostics")
        expect(self.patience_s > 0, "patience_s", self.patience_s, "more than 0")
        expect(self.retry_min_s > 0, "retry_min_s", self.retry_min_s, "more than 0")
        expect(self.retry_max_s >= self.retry_min_s, "retry_max_s", self.retry_max_s, "at least retry_min_s")


class Phase(Enum):
    GREETING = "greeting"  # waiting for an answer to the handshake
    OPEN = "open"  # session open
    UNANSWERED = "unanswered"  # the server did not answer; waiting before the next attempt
    REFUSED = "refused"  # the server refused the client; waiting before the next attempt
    LOST = "lost"  # the session ended; waiting before the next attempt
    STOPPED = "stopped"  # final: stop() was called, or another program replaced this client (Code.REPLACED)


@dataclass
class Stats:
    phase: Phase = Phase.GREETING
    code: Code = Code.OK  # why the last attempt or session ended, with the message of the server
    reason: str = ""
    link: LinkStats = field(default_factory=LinkStats)  # for the current session or the last one
    attempts: int = 0
    sessions: int = 0  # attempts that the server accepted
    states: int = 0  # received states
    states_predicted: int = 0  # predicted states that were returned
    states_skipped: int = 0  # received states that a newer one replaced before they were due
    forces: int = 0
    forces_unusable: int = 0  # forces not sent: not finite, out of bounds, or for an unknown state
    unusable: str = ""  # reason for the newest unusable force; empty: none
    left_out: str = ""  # which part of this session's forces is not sent, and why; empty: none
    forces_alike: int = 0  # forces not sent because they are within the deadband
    lease_lost_to: str = ""  # name of the client that took over the channel; empty: none
