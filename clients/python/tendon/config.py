# SPDX-License-Identifier: Apache-2.0
"""The configuration and the statistics of a guest."""

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
    """How a guest behaves. Raises ValueError "FIELD = VALUE: expected …" when a value is impossible."""

    name: str = "guest"
    """For the server's log; at most 64 bytes."""
    role: Role = Role.CONTROLLER
    """A controller sees states and sends forces, one per channel; an observer looks on."""
    device: str = ""
    """Name of the device, on a server with several; empty: the first one. At most 24 bytes."""
    channel: str = ""
    """Name of the device's channel, likewise."""
    take_lease: bool = False
    """When another controller holds the channel's lease: keep asking until we have it. We ask again when the server
    says that the lease may be over."""
    key: bytes | None = field(default=None, repr=False)
    """32 bytes that the server knows too (`read_key`): all is sealed. None: plain, which servers accept on loopback
    only."""
    suites: tuple[Suite, ...] = usable_suites()
    """With a key: by which of them the session may be sealed; the server chooses."""
    rate_hz: float = 0
    """States handed out per second: at multiples of 1/rate_hz, or as soon after as there is a new one; after
    a delay of a whole period the grid starts anew, it never catches up. 0 = every new state, once."""
    state_hz: int = 0
    """States per second to ask the server for; 0 = what the server gives by itself."""
    valid_for_s: float = 0
    """How long the server may take a force as fresh, counted from its arrival; at most 10. 0 = derived from
    the period T at which forces really leave, that is the asked one or, when the physics is slower, the time
    between the states of the last two forces:

        T         = max(1 / rate_hz, min(Δtick / loop_hz, 0.1))      with rate_hz = 0: the second term
        valid_for = max(3 T, 0.02)                           with a deadband: T ≥ its longest silence
    """
    deadband: ForceDeadband | None = None
    """A force that a hand cannot tell from the last one sent is not sent. None: every force is sent."""
    state_deadband: SetStateDeadband | None = None
    """The server leaves out states that we can predict. With rate_hz = r, states are handed out at multiples of 1/r as
    predicted for that instant, tick and sampling time included. No tick comes twice, none is older than the one before,
    and nothing is predicted for longer than max_silence_us. With rate_hz = 0, only the states that come are handed out.
    None: we ask for every state."""
    diagnostics: bool = False
    """For an observer: ask for the forces that the engines want (`DeviceState.force_wanted`), and once a second for
    reports on the device's loop and its engines. A server that does not know this feature leaves them out."""
    joints: bool = False
    """Ask for the joints of the device (`DeviceState.joints`, `HandleDescription.joints`): 16 bytes each in every
    state."""
    outputs: bool = False
    """Ask for the outputs of the device (`HandleDescription.outputs`: lamps, vibration), to set them with
    `set_output`."""
    ways: tuple[str, ...] = ()
    """Names of the ways in which this engine answers, which `Touch.way` counts from 1: observers are told, and a
    recording holds, by which a force was made. At most 8, each of 1 to 24 bytes, no two alike."""
    patience_s: float = 2.0
    """How long one attempt waits for an answer to its Hellos."""
    retry_min_s: float = 0.1
    """First wait before the next attempt; then twice as long each time …"""
    retry_max_s: float = 2.0
    """… up to this. The first state of a session resets it."""

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
            expect(way not in self.ways[:i], f"ways[{i}]", way, "no name twice")
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
        expect(not self.diagnostics or observes, "diagnostics", True, "False: they are for observers only")
        expect(self.patience_s > 0, "patience_s", self.patience_s, "more than 0")
        expect(self.retry_min_s > 0, "retry_min_s", self.retry_min_s, "more than 0")
        expect(self.retry_max_s >= self.retry_min_s, "retry_max_s", self.retry_max_s, "at least retry_min_s")


class Phase(Enum):
    GREETING = "greeting"  # an attempt is under way
    OPEN = "open"  # states come in, forces go out
    UNANSWERED = "unanswered"  # nobody answered; waiting for the next attempt
    REFUSED = "refused"  # the server said no; waiting for the next attempt
    LOST = "lost"  # the session has ended; waiting for the next attempt
    STOPPED = "stopped"  # stop() was called, or another program has our place (Code.REPLACED); for good


@dataclass
class Stats:
    phase: Phase = Phase.GREETING
    code: Code = Code.OK  # why the last attempt or session ended: the server's words where it had any
    reason: str = ""
    link: LinkStats = field(default_factory=LinkStats)  # of the present session, or of the last one
    attempts: int = 0
    sessions: int = 0  # of these, answered with a Welcome
    states: int = 0  # states that came in
    states_foretold: int = 0  # predicted and handed out
    states_skipped: int = 0  # states that came in and were replaced by a newer one before they were due
    forces: int = 0  # forces sent
    forces_unusable: int = 0  # forces not sent: not finite, out of bounds, or to a state that did not come
    unusable: str = ""  # what was wrong with the newest of them; empty: none
    left_out: str = ""  # what of the present session's answers is not sent, and why; empty: nothing
    forces_alike: int = 0  # forces not sent: a hand could not tell them from the one before
    lease_lost_to: str = ""  # name of the client that has taken the channel from us; empty: nobody
