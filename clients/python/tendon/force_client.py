# SPDX-License-Identifier: Apache-2.0
"""A guest at a Tendon server, sans I/O: says Hello, keeps the session alive, hands out the newest device
state, sends the force that comes back, and begins again when the server is gone.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

from . import limits
from .answer import Answer, read_touch
from .codec import is_request
from .config import Config, Phase, Stats
from .deadband import Deadband, foretell
from .handshake import ClientHandshake
from .messages import (
    FEATURE_CHANNELS,
    FEATURE_DIAGNOSTICS,
    FEATURE_HANDLE,
    FEATURE_JOINTS,
    FEATURE_LOCAL_MODEL,
    FEATURE_OUTPUTS,
    FEATURE_WAYS,
    NEVER,
    Claim,
    Code,
    Control,
    ControlAck,
    Describe,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    Disarm,
    Disengage,
    Engage,
    ForceCommand,
    GiveLease,
    Grant,
    HandleDescription,
    Hello,
    Instant,
    LampColour,
    LeaseLost,
    LinkReport,
    PeerReport,
    Rearm,
    Refused,
    Role,
    SetOutput,
    SetScale,
    SetShare,
    SetStateRate,
    TakeLease,
    Torque,
    Touch,
    Vibration,
    Welcome,
)
from .noise import KEY_SIZE
from .session import Closed, Session

# See Config.valid_for_s.
_VALID_PERIODS = 3
_MIN_VALID_FOR_NS = 20_000_000
_MAX_OBSERVED_PERIOD_NS = 100_000_000

_ASK_LEASE_AGAIN_NS = 50_000_000
"""Shortest time between two requests for a lease that may be over: its holder renews it all the time."""


_WAITING = (Phase.UNANSWERED, Phase.REFUSED, Phase.LOST)


class ForceClient:
    """Use: `receive` what arrives; then, and whenever `next_turn()` is due, `tick`, and send what
    `next_datagram` gives until it is None. When `next_state` gives a state, `send` the answer of the physics.

    Instants are nanoseconds of a monotonic clock; `now` never goes back.
    """

    def __init__(self, config: Config, now: int, random: Callable[[int], bytes] = os.urandom) -> None:
        """`random(n)`: n bytes from a cryptographic source. The first Hello is due at once."""
        self.welcome: Welcome | None = None
        """The server's description of itself and its device at the opening of the newest session."""
        self.description: DeviceDescription | None = None
        """Description of the device, once we have named a device or a channel and the server has answered."""
        self.handle: HandleDescription | None = None
        """What its handle is and can do, once the server has answered; None for good when it does not know that."""
        self.holds = False
        """Whether the channel takes our forces. While it does not, a controller is handed no states."""
        self.report: LinkReport | None = None
        """The server's newest report on our forces in the present session; one comes each second while forces come."""
        self.device_report: DeviceReport | None = None
        """With Config.diagnostics, the newest report on the device's loop in the present session."""
        self.peer_reports: dict[int, PeerReport] = {}
        """With Config.diagnostics, the newest report on the engine of each channel, even one that has gone."""
        self.config = config
        self._random = random
        self._period = _ns(1 / config.rate_hz) if config.rate_hz > 0 else 0
        self._stats = Stats()
        self._handshake: ClientHandshake | None = None
        self._session: Session | None = None
        self._ended: Session | None = None  # the previous session while it still has a Bye to send
        self._place = Grant(config.role)  # the numbers of our device and channel
        self._asked_lease: int | None = None  # the request that waits for its answer
        self._ask_lease: Instant = NEVER  # when to ask (again)
        self._give_up = now  # end of the present attempt's patience
        self._retry = now  # when the next attempt begins
        self._back_off = _ns(config.retry_min_s)  # wait before the attempt after that
        self._unseen: DeviceState | None = None  # newest state that was not handed out
        self._pressed = 0  # buttons held in any of the states since the one that was handed out
        self._newest: DeviceState | None = None  # newest state, handed out or not
        self._newest_arrived = now
        self._seen_tick = 0  # newest tick handed out
        self._deadband_request: int | None = None  # the request for the deadband of states
        self._foretell = False  # the server leaves states out
        self._deadband: Deadband | None = None
        self._next_call = now
        self._sequence = 0  # sequence number of the newest force
        self._answered_tick = 0  # the tick it answers
        self._greet(now)

    # ---- In ----

    def receive(self, now: int, datagram: bytes) -> None:
        """Takes any bytes from the server's address."""
        if self._handshake is not None:
            self._handshake.receive(now, datagram)
            self._settle(now)
        elif self._session is not None:
            self._session.receive(now, datagram)
            self._take_events(now)

    def tick(self, now: int) -> None:
        """Does everything that is due at `now`."""
        if self._session is not None:
            self._session.tick(now)
            self._take_events(now)
            if self._asked_lease is None and now >= self._ask_lease and not self.take_lease():
                self._ask_lease = now + _ASK_LEASE_AGAIN_NS
        elif self._handshake is not None:
            if now >= self._give_up:
                self._end(now, Phase.UNANSWERED, Code.TIMED_OUT, "no answer")
        elif self.phase in _WAITING and now >= self._retry:
            self._greet(now)

    def _objection(self, hand: DeviceState, answer: Answer) -> str:
        """Why an answer cannot be used; empty when it can."""
        if not 0 < hand.tick <= max(self._seen_tick, self._newest.tick if self._newest else 0):
            return f"it answers tick {hand.tick}, which has not come"
        return answer.objection()

    def _of_handle(self, hand: DeviceState, answer: Answer) -> tuple[Torque | None, float | None]:
        """Torque and grip force of an answer, as far as they can be sent."""
        if not answer.asks_for_handle:
            return None, None
        if self.welcome is None or FEATURE_HANDLE not in self.welcome.features:
            self._stats.left_out = "torque and grip force: the server does not know them"
            return None, None
        if answer.angular_stiffness is not None and hand.turning is None:
            self._stats.left_out = "angular stiffness: the device does not measure its orientation"
        return answer.turning(hand.turning), answer.grip_force

    def send(self, hand: DeviceState, touch: Touch) -> None:
        """Answers a state. An answer with a number that is not finite or out of bounds, or to a state that did not
        come in this session, is counted and not sent (`stats.unusable` says why); the server then treats this client
        as late. While another client holds the channel, nothing is sent. Raises ValueError when an answer has a wrong
        shape, PermissionError for an observer.

        Take a fresh `now` before the next call: the datagram's time stamp must not be older than the physics' work.
        """
        if self.config.role is not Role.CONTROLLER:
            raise PermissionError("an observer sends no force: role=Role.CONTROLLER")
        answer = read_touch(touch)
        session = self._session
        if session is None or self.welcome is None or not self.holds:
            return
        objection = self._objection(hand, answer)
        if objection:
            self._stats.forces_unusable += 1
            self._stats.unusable = objection
            return
        torque, grip_force = self._of_handle(hand, answer)
        alike = self._deadband is not None and not self._deadband.passes(
            session.latest, answer.force, None if torque is None else torque.torque, grip_force
        )
        if alike and not answer.topology_changed:
            self._stats.forces_alike += 1
            return
        model = answer.local_model(hand.position) if FEATURE_LOCAL_MODEL in self.welcome.features else None
        valid_for_us = self._valid_for_us(hand.tick, self.welcome.loop_hz)
        self._sequence += 1
        self._answered_tick = hand.tick
        session.send(
            ForceCommand(
                self._sequence,
                hand.tick,
                answer.force,
                valid_for_us,
                model,
                self._place.device,
                self._place.channel,
                topology_changed=answer.topology_changed,
                error=answer.error,
                torque=torque,
                grip_force=grip_force,
                way=self._way(answer),
            )
        )
        self._stats.forces += 1

    def _way(self, answer: Answer) -> int:
        if not 0 <= answer.way <= len(self.config.ways):
            self._stats.left_out = "the way of answering: Config.ways has none of its number"
            return 0
        return answer.way if self.welcome and FEATURE_WAYS in self.welcome.features else 0

    def rearm(self) -> bool:
        """Asks the server to clear a latched fault, and to take a disarm back. False when there is no session,
        or too many requests are open. Controllers only: the server refuses an observer."""
        return self._session is not None and self._session.request(Rearm(self._place.device)) is not None

    def disarm(self) -> bool:
        """Asks the server for no force, from the device's next step on, until somebody rearms. False as for rearm()."""
        return self._session is not None and self._session.request(Disarm(self._place.device)) is not None

    def engage(self) -> bool:
        """The operator's act of a coupling, at the leader's server ([teleoperation]). False as for rearm()."""
        return self._session is not None and self._session.request(Engage(self._place.device)) is not None

    def disengage(self) -> bool:
        """The end of that, at either end's server. False as for rearm()."""
        return self._session is not None and self._session.request(Disengage(self._place.device)) is not None

    def set_scale(self, position_scale: float, force_scale: float) -> bool:
        """The scales of the coupling from now on, at the leader's server, while it is not engaged or its clutch is
        held. False as for rearm(); ValueError beyond 0.01 … 100."""
        wanted = SetScale(self._place.device, position_scale, force_scale)
        if not is_request(wanted):
            raise ValueError(f"set_scale({position_scale}, {force_scale}): expected two scales, each 0.01 … 100")
        return self._session is not None and self._session.request(wanted) is not None

    def set_share(self, channel: int, share: float) -> bool:
        """How much the leader of that channel of our device counts among several, at the follower's server.
        False as for rearm(); ValueError when it is out of its bounds."""
        wanted = SetShare(self._place.device, channel, share)
        if not is_request(wanted):
            raise ValueError(f"set_share({channel}, {share}): expected a channel 0 … 7 and a share 0 … 1")
        return self._session is not None and self._session.request(wanted) is not None

    def set_output(self, output: int, setting: LampColour | Vibration) -> bool:
        """Sets a lamp of the device, or starts a pulse of vibration (`handle.outputs`). For whoever `holds`. False as
        for rearm(), and without `Config.outputs`; ValueError when the setting is out of its bounds."""
        wanted = SetOutput(self._place.device, output, setting)
        if not is_request(wanted):
            raise ValueError(
                f"set_output({output}, {setting}): expected output 0 … 7, rgb 0 … 0xFFFFFF, amplitude 0 … 1, "
                "frequency 0 or 20 … 1000 Hz, duration_ms 0 … 10000"
            )
        return (
            self.welcome is not None
            and FEATURE_OUTPUTS in self.welcome.features
            and self._session is not None
            and self._session.request(wanted) is not None
        )

    def take_lease(self) -> bool:
        """Asks for the channel's lease, and once more when it is lost before the answer; `holds` tells the result.
        False as for rearm()."""
        wanted = TakeLease(self._place.device, self._place.channel)
        asked = None if self._session is None else self._session.request(wanted)
        if asked is None:
            return False
        self._asked_lease = asked
        return True

    def give_lease(self) -> bool:
        """Gives the lease up, and stops asking for it. False as for rearm()."""
        self._ask_lease = NEVER
        given = GiveLease(self._place.device, self._place.channel)
        if self._session is None or self._session.request(given) is None:
            return False
        self._asked_lease = None  # any answer is older than this release
        self.holds = False
        return True

    def stop(self, now: int) -> None:
        """Ends for good. `next_datagram` then gives the Byes, so that the server need not wait for a timeout."""
        if self.phase is Phase.STOPPED:
            return
        if self._session is not None:
            self._session.close(Code.OK, f"{self.config.name} stops")
        self._end(now, Phase.STOPPED, Code.OK, "stopped")

    # ---- Out ----

    def next_datagram(self, now: int) -> bytes | None:
        """The next datagram to send; None = nothing to send now."""
        if self._ended is not None:
            bye = self._ended.next_datagram(now)
            if bye is not None:
                return bye
            self._ended = None
        if self._session is not None:
            return self._session.next_datagram(now)
        return None if self._handshake is None else self._handshake.next_datagram(now)

    def next_state(self, now: int) -> DeviceState | None:
        """The newest state, if it is due and was not handed out before."""
        if now < self._next_call or self._waits_for_lease():
            return None
        state = self._foretold(now) if self._foretell else self._unseen
        if state is None:
            return None
        self._unseen = None
        if self._pressed & ~state.buttons:
            state = replace(state, buttons=state.buttons | self._pressed)
        self._pressed = 0
        self._seen_tick = state.tick
        self._next_call += self._period
        if self._next_call <= now:
            self._next_call = now + self._period
        return state

    def next_turn(self) -> Instant:
        """When `tick` and `next_datagram` are due next at the latest."""
        if self._ended is not None:
            return self._ended.next_turn()
        if self._session is not None:
            ask = NEVER if self._asked_lease is not None else self._ask_lease
            return min(self._session.next_turn(), ask)
        if self._handshake is not None:
            return min(self._give_up, self._handshake.next_turn())
        return self._retry if self.phase in _WAITING else NEVER

    def next_state_due(self) -> Instant:
        """When `next_state` gives a state; NEVER until another state has come in, or the channel is ours."""
        if self._waits_for_lease():
            return NEVER
        if not self._foretell:
            return NEVER if self._unseen is None else self._next_call
        if self._newest is None:
            return NEVER
        ahead = max(self._seen_tick + 1 - self._newest.tick, 0)  # the first tick that was not handed out
        due = max(self._next_call, self._newest_arrived + ahead * self._haptic_period())
        return due if due - self._newest_arrived <= self._silence_ns() else NEVER

    @property
    def phase(self) -> Phase:
        return self._stats.phase

    @property
    def stats(self) -> Stats:
        """A copy."""
        link = self._stats.link if self._session is None else self._session.stats
        return replace(self._stats, link=replace(link))

    @property
    def live_stats(self) -> Stats:
        """The statistics themselves, to look at now and not to keep or change; their `link` is not up to date."""
        return self._stats

    # ---- Inside ----

    def _claims(self) -> tuple[Claim, ...]:
        config = self.config
        named = config.device or config.channel
        return (Claim(config.role, config.device, config.channel),) if named else ()

    def _waits_for_lease(self) -> bool:
        return self.config.role is Role.CONTROLLER and not self.holds

    def _greet(self, now: int) -> None:
        features: tuple[str, ...] = (FEATURE_LOCAL_MODEL, FEATURE_CHANNELS, FEATURE_HANDLE)
        if self.config.joints:
            features += (FEATURE_JOINTS,)
        if self.config.outputs:
            features += (FEATURE_OUTPUTS,)
        if self.config.diagnostics:
            features += (FEATURE_DIAGNOSTICS,)
        if self.config.ways:
            features += (FEATURE_WAYS,)
        hello = Hello(self.config.role, self.config.name, features, claims=self._claims(), ways=self.config.ways)
        key = self.config.key
        ephemeral = b"" if key is None else self._random(KEY_SIZE)
        self._handshake = ClientHandshake(
            hello, self._random(16), now, key=key, ephemeral=ephemeral, suites=self.config.suites
        )
        self._give_up = now + _ns(self.config.patience_s)
        self._stats.phase = Phase.GREETING
        self._stats.attempts += 1

    def _settle(self, now: int) -> None:
        """Acts on the server's answer once it has come."""
        outcome = None if self._handshake is None else self._handshake.outcome
        if outcome is None:
            return
        if isinstance(outcome, Refused):
            self._end(now, Phase.REFUSED, outcome.code, outcome.detail)
            return
        grants = outcome.welcome.grants
        if self._claims() and len(grants) != 1:
            sentence = "that server has one device, with one channel: name none"
            self._end(now, Phase.REFUSED, Code.UNSUPPORTED, sentence)
            return
        self._handshake = None
        self.welcome = outcome.welcome
        self._place = grants[0] if grants else Grant(outcome.welcome.role)
        self.holds = self._place.role is Role.CONTROLLER
        self._asked_lease = None
        self._ask_lease = now if self.config.take_lease and self._waits_for_lease() else NEVER
        self._stats.lease_lost_to = ""
        self._stats.left_out = ""
        self.description = None
        self.handle = None
        self._session = Session(outcome.connection_id, now, outcome.cipher)
        if self._claims():
            self._session.request(Describe(self._place.device))
        if FEATURE_HANDLE in outcome.welcome.features:
            self._session.request(Describe(self._place.device, handle=True))
        if self.config.state_hz > 0:
            self._session.request(SetStateRate(self.config.state_hz, self._place.device))
        asked = self.config.state_deadband
        self._deadband_request = self._session.request(asked) if asked else None
        self._foretell = False
        self._seen_tick = 0
        self.report = self.device_report = None
        self.peer_reports = {}
        # This session has not received what another session was sent.
        self._deadband = Deadband(self.config.deadband) if self.config.deadband else None
        self._sequence = 0
        self._stats.phase = Phase.OPEN
        self._stats.sessions += 1

    def _end(self, now: int, phase: Phase, code: Code, reason: str) -> None:
        if self._session is not None:
            self._stats.link = self._session.stats
        self._stats.phase = phase
        self._stats.code = code
        self._stats.reason = reason
        self._handshake = None
        self._ended, self._session = self._session, None
        self.holds = False
        self._unseen = self._newest = None
        self._pressed = 0
        self._retry = now + self._back_off
        self._back_off = min(2 * self._back_off, _ns(self.config.retry_max_s))

    def _take_events(self, now: int) -> None:
        while self._session is not None and self._session.has_events and (event := self._session.next_event()) is not None:
            if isinstance(event, DeviceState):
                self._stats.states += 1
                self._stats.states_skipped += self._unseen is not None
                self._unseen = self._newest = event
                # A press of the time when the channel was not ours was another engine's.
                self._pressed = event.buttons | (0 if self._waits_for_lease() else self._pressed)
                self._newest_arrived = now
                self._back_off = _ns(self.config.retry_min_s)
            elif isinstance(event, LinkReport):
                self.report = event
            elif isinstance(event, DeviceReport):
                self.device_report = event
            elif isinstance(event, PeerReport):
                self.peer_reports[event.channel] = event
            elif isinstance(event, ControlAck):
                self._take_answer(now, event)
            elif isinstance(event, Control):
                self._take_request(now, self._session, event)
            elif isinstance(event, Closed):
                taken_over = event.code is Code.REPLACED  # two programs with one key would replace each other for ever
                self._end(now, Phase.STOPPED if taken_over else Phase.LOST, event.code, event.reason)

    def _take_answer(self, now: int, answer: ControlAck) -> None:
        if answer.device is not None:
            self.description = answer.device
        if answer.handle is not None:
            self.handle = answer.handle
        if answer.id == self._deadband_request:
            self._foretell = answer.code is Code.OK and self._period > 0 and self._silence_ns() > 0
        if answer.id != self._asked_lease:
            return
        self._asked_lease = None
        self._ask_lease = NEVER
        if answer.code is not Code.UNSUPPORTED:  # otherwise the server knows no leases
            self.holds = answer.code is Code.OK
        if self.holds:
            self._stats.lease_lost_to = ""
        elif self.config.take_lease and answer.code is Code.BUSY:
            self._ask_lease = now + max(1_000_000 * answer.wait_ms, _ASK_LEASE_AGAIN_NS)

    def _take_request(self, now: int, session: Session, asked: Control) -> None:
        lost = asked.request
        if not isinstance(lost, LeaseLost):
            session.answer(asked.id, Code.UNSUPPORTED, "that is a client's to ask")
            return
        session.answer(asked.id, Code.OK, "")
        if (lost.device, lost.channel) != (self._place.device, self._place.channel):
            return
        self.holds = False
        self._stats.lease_lost_to = lost.to
        # A request still in flight may cross this message. One sent now is answered after it.
        if self._asked_lease is not None and self.take_lease():
            return
        if self.config.take_lease:
            self._ask_lease = now + _ASK_LEASE_AGAIN_NS

    def _haptic_period(self) -> int:
        return _ns(1 / self.welcome.loop_hz) if self.welcome else 0

    def _silence_ns(self) -> int:
        return 1000 * self.config.state_deadband.max_silence_us if self.config.state_deadband else 0

    def _foretold(self, now: int) -> DeviceState | None:
        """The state predicted for now; None when nothing is new, or nothing has come for too long."""
        newest, age = self._newest, now - self._newest_arrived
        if newest is None or age > self._silence_ns():
            return None
        state = foretell(newest, age, self._haptic_period())
        if state.tick <= self._seen_tick:  # the state before it spent less time on its way
            return None
        self._stats.states_foretold += state.tick > newest.tick
        return state

    def _valid_for_us(self, tick: int, loop_hz: int) -> int:
        valid_for = _ns(self.config.valid_for_s)
        if valid_for == 0:
            period = self._period
            if self._sequence > 0:
                period = max(period, min(_ns((tick - self._answered_tick) / loop_hz), _MAX_OBSERVED_PERIOD_NS))
            if self.config.deadband:
                period = max(period, _ns(self.config.deadband.longest_silence_s))
            valid_for = max(_VALID_PERIODS * period, _MIN_VALID_FOR_NS)
        return min(-(-valid_for // 1000), limits.MAX_VALID_FOR_US)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)
