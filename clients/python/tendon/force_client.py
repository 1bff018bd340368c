# SPDX-License-Identifier: Apache-2.0
"""A client of a Tendon server that does no I/O. It opens a session and keeps it alive, returns the newest device state,
sends the force that answers it, and reconnects after the session ends.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

from . import limits
from .answer import Answer, read_touch
from .codec import is_request
from .config import Config, Phase, Stats
from .deadband import Deadband, predict
from .handshake import ClientHandshake
from .messages import (
    FEATURE_CHANNELS,
    FEATURE_DIAGNOSTICS,
    FEATURE_FIELDS,
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
    FieldStatus,
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
from .upload import FieldUser

# The numbers are explained at Config.valid_for_s.
_VALID_PERIODS = 3
_MIN_VALID_FOR_NS = 20_000_000
_MAX_OBSERVED_PERIOD_NS = 100_000_000

_ASK_LEASE_AGAIN_NS = 50_000_000
"""There must be at least this time between two requests for a lease, because the current holder renews its lease
continuously."""


_WAITING = (Phase.UNANSWERED, Phase.REFUSED, Phase.LOST)


class ForceClient:
    """Call `receive` for each datagram that arrives. Then, and whenever `next_turn()` is due, call `tick` and send
    the results of `next_datagram` until it returns None. When `next_state` returns a state, `send` the answer of
    the engine.

    All times are in nanoseconds of a monotonic clock.
    """

    def __init__(self, config: Config, now: int, random: Callable[[int], bytes] = os.urandom) -> None:
        """`random(n)` must return n cryptographically secure bytes. The first Hello is due immediately."""
        self.welcome: Welcome | None = None
        """Description of the server in the newest session."""
        self.description: DeviceDescription | None = None
        """Description of the device. None until it arrives; it is only requested if a device or channel is named."""
        self.handle: HandleDescription | None = None
        """Description of the handle. None until it arrives, and always if the server does not support it."""
        self.holds = False
        """Whether this client holds the channel. Otherwise a controller receives no states."""
        self.report: LinkReport | None = None
        """Newest report on the received forces in this session. Sent once per second while forces arrive."""
        self.device_report: DeviceReport | None = None
        """Newest report on the loop of the device in this session. Requires Config.diagnostics."""
        self.peer_reports: dict[int, PeerReport] = {}
        """The newest report on the engine of each channel. If the engine leaves, the report is not removed. Requires
        Config.diagnostics."""
        self.fields = FieldUser()
        """The field of this client. Requires Config.fields."""
        self.config = config
        self._random = random
        self._period = _ns(1 / config.rate_hz) if config.rate_hz > 0 else 0
        self._stats = Stats()
        self._handshake: ClientHandshake | None = None
        self._session: Session | None = None
        self._ended: Session | None = None  # the previous session while its Bye is not sent
        self._place = Grant(config.role)  # indices of the device and channel
        self._asked_lease: int | None = None  # id of the pending lease request
        self._ask_lease: Instant = NEVER  # time of the next lease request
        self._give_up = now  # timeout of the current attempt
        self._retry = now  # start of the next attempt
        self._back_off = _ns(config.retry_min_s)  # time to wait after the next attempt
        self._unseen: DeviceState | None = None  # newest state that was not returned
        self._pressed = 0  # buttons pressed in any state since the last returned one
        self._newest: DeviceState | None = None  # newest state, returned or not
        self._newest_arrived = now
        self._first_tick: int | None = None  # of the first state in this session
        self._seen_tick = 0  # newest returned tick
        self._deadband_request: int | None = None  # id of the request for the state deadband
        self._predicts = False  # the server omits predictable states
        self._deadband: Deadband | None = None
        self._next_call = now
        self._sequence = 0  # of the newest force
        self._answered_tick = 0  # state tick that the newest force answers
        self._greet(now)

    # ---- In ----

    def receive(self, now: int, datagram: bytes) -> None:
        """Handles a datagram from the server's address, which may contain arbitrary bytes."""
        if self._handshake is not None:
            self._handshake.receive(now, datagram)
            self._settle(now)
        elif self._session is not None:
            self._session.receive(now, datagram)
            self._take_events(now)

    def tick(self, now: int) -> None:
        """Does all the work that is due at `now`."""
        if self._session is not None:
            self._session.tick(now)
            self._take_events(now)
            if self._asked_lease is None and now >= self._ask_lease and not self.take_lease():
                self._ask_lease = now + _ASK_LEASE_AGAIN_NS
            self.fields.tick(now, self.holds)
        elif self._handshake is not None:
            if now >= self._give_up:
                self._end(now, Phase.UNANSWERED, Code.TIMED_OUT, "no answer")
        elif self.phase in _WAITING and now >= self._retry:
            self._greet(now)

    def _objection(self, hand: DeviceState, answer: Answer) -> str:
        """Returns why an answer is unusable, or an empty string."""
        newest = max(self._seen_tick, self._newest.tick if self._newest else 0)
        if self._first_tick is None or not self._first_tick <= hand.tick <= newest:
            return f"it answers tick {hand.tick}, which was not received in this session"
        return answer.objection()

    def _of_handle(self, hand: DeviceState, answer: Answer) -> tuple[Torque | None, float | None]:
        """Returns the torque and grip force of an answer if the server and the device support them."""
        if not answer.asks_for_handle:
            return None, None
        if self.welcome is None or FEATURE_HANDLE not in self.welcome.features:
            self._stats.left_out = "torque and grip force: the server does not support them"
            return None, None
        if answer.angular_stiffness is not None and hand.turning is None:
            self._stats.left_out = "angular stiffness: the device does not measure its orientation"
        return answer.turning(hand.turning), answer.grip_force

    def send(self, hand: DeviceState, touch: Touch) -> None:
        """Answers a state. Answers that are not finite or out of bounds, or to a state of another session, are
        counted and not sent (`stats.unusable` contains the reason); the server then treats this client as late.
        Nothing is sent if another client has the channel. Raises ValueError if the answer has a wrong shape,
        PermissionError for an observer.

        Read the clock again before the next call, so that the time stamp of the datagram does not include the
        computation.
        """
        answer = self._usable(hand, touch)
        session = self._session
        if session is None or self.welcome is None or answer is None:
            return
        torque, grip_force = self._of_handle(hand, answer)
        alike = self._deadband is not None and not self._deadband.passes(
            session.latest, answer.force, None if torque is None else torque.torque, grip_force
        )
        if alike and not answer.topology_changed:
            self._stats.forces_alike += 1
            return
        model = answer.local_model(hand.position) if FEATURE_LOCAL_MODEL in self.welcome.features else None
        command = self._command(hand, answer)
        session.send(
            replace(
                command,
                model=model,
                topology_changed=answer.topology_changed,
                error=answer.error,
                torque=torque,
                grip_force=grip_force,
                way=self._way(answer),
            )
        )

    def truth(self, hand: DeviceState, touch: Touch) -> bool:
        """Sends the true force for a state, which the server uses to correct the field. Returns False if the state does not
        contain a field, or if the force cannot be sent (see send())."""
        answer = self._usable(hand, touch)
        if self._session is None or answer is None or hand.field is None:
            return False
        self._session.send(replace(self._command(hand, answer), field=hand.field.generation))
        return True

    def _usable(self, hand: DeviceState, touch: Touch) -> Answer | None:
        """Returns the answer, or None if it cannot be sent."""
        if self.config.role is not Role.CONTROLLER:
            raise PermissionError("an observer cannot send forces: expected role=Role.CONTROLLER")
        answer = read_touch(touch)
        if self._session is None or not self.holds:
            return None
        objection = self._objection(hand, answer)
        if objection:
            self._stats.forces_unusable += 1
            self._stats.unusable = objection
            return None
        return answer

    def _command(self, hand: DeviceState, answer: Answer) -> ForceCommand:
        """Returns the next force command. It only contains the force."""
        assert self.welcome is not None
        valid_for_us = self._valid_for_us(hand.tick, self.welcome.loop_hz)
        self._sequence += 1
        self._answered_tick = hand.tick
        self._stats.forces += 1
        place = self._place
        return ForceCommand(
            self._sequence, hand.tick, answer.force, valid_for_us, None, place.device, place.channel
        )

    def _way(self, answer: Answer) -> int:
        if not 0 <= answer.way <= len(self.config.ways):
            self._stats.left_out = "the solver path: its number is not in Config.ways"
            return 0
        return answer.way if self.welcome and FEATURE_WAYS in self.welcome.features else 0

    def rearm(self) -> bool:
        """Asks the server to clear a latched fault and to undo a disarm. Only for controllers. Returns False if there
        is no session or if too many requests are pending."""
        return self._session is not None and self._session.request(Rearm(self._place.device)) is not None

    def disarm(self) -> bool:
        """Asks the server to disable all forces until a client rearms. Returns False as rearm() does."""
        return self._session is not None and self._session.request(Disarm(self._place.device)) is not None

    def engage(self) -> bool:
        """Engages a coupling ([teleoperation]), at the server of the leader. Returns False as rearm() does."""
        return self._session is not None and self._session.request(Engage(self._place.device)) is not None

    def disengage(self) -> bool:
        """Disengages a coupling, at either server. Returns False as rearm() does."""
        return self._session is not None and self._session.request(Disengage(self._place.device)) is not None

    def set_scale(self, position_scale: float, force_scale: float) -> bool:
        """Sets the scales of the coupling at the server of the leader. The coupling must not be engaged unless its
        clutch is held. Returns False as rearm() does. Raises ValueError outside of 0.01 … 100."""
        wanted = SetScale(self._place.device, position_scale, force_scale)
        if not is_request(wanted):
            raise ValueError(f"set_scale({position_scale}, {force_scale}): expected two scales, each 0.01 … 100")
        return self._session is not None and self._session.request(wanted) is not None

    def set_share(self, channel: int, share: float) -> bool:
        """Sets the weight of the leader on that channel if several leaders share one follower, at the follower's
        server. Returns False as rearm() does. Raises ValueError if it is out of bounds."""
        wanted = SetShare(self._place.device, channel, share)
        if not is_request(wanted):
            raise ValueError(f"set_share({channel}, {share}): expected a channel 0 … 7 and a share 0 … 1")
        return self._session is not None and self._session.request(wanted) is not None

    def set_output(self, output: int, setting: LampColour | Vibration) -> bool:
        """Sets an indicator lamp or starts a vibration pulse (`handle.outputs`). Requires the channel (`holds`).
        Returns False as rearm() does, and if `Config.outputs` is not set. Raises ValueError if `setting` is out of
        bounds."""
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
        """Requests the lease of the channel. The request is repeated if the lease is lost before the answer arrives.
        `holds` contains the result. Returns False as rearm() does."""
        wanted = TakeLease(self._place.device, self._place.channel)
        asked = None if self._session is None else self._session.request(wanted)
        if asked is None:
            return False
        self._asked_lease = asked
        return True

    def give_lease(self) -> bool:
        """Releases the lease and stops requesting it. Returns False as rearm() does."""
        self._ask_lease = NEVER
        given = GiveLease(self._place.device, self._place.channel)
        if self._session is None or self._session.request(given) is None:
            return False
        self._asked_lease = None  # a later answer would be outdated
        self.holds = False
        self.fields.lost_lease()
        return True

    def stop(self, now: int) -> None:
        """Stops permanently. `next_datagram` then returns the Byes, so that the server does not have to wait for a
        timeout."""
        if self.phase is Phase.STOPPED:
            return
        if self._session is not None:
            self._session.close(Code.OK, f"{self.config.name} stops")
        self._end(now, Phase.STOPPED, Code.OK, "stopped")

    # ---- Out ----

    def next_datagram(self, now: int) -> bytes | None:
        """Returns the next datagram that should be sent, or None if there is none."""
        if self._ended is not None:
            bye = self._ended.next_datagram(now)
            if bye is not None:
                return bye
            self._ended = None
        if self._session is not None:
            datagram = self._session.next_datagram(now)
            if datagram is None and self.fields.has_brick(now):
                datagram = self._session.next_datagram(now)
            return datagram
        return None if self._handshake is None else self._handshake.next_datagram(now)

    def next_state(self, now: int) -> DeviceState | None:
        """Returns the newest state if it is due and was not returned before."""
        if now < self._next_call or self._waits_for_lease():
            return None
        state = self._predicted(now) if self._predicts else self._unseen
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
        """Returns when `tick` and `next_datagram` must be called next."""
        if self._ended is not None:
            return self._ended.next_turn()
        if self._session is not None:
            ask = NEVER if self._asked_lease is not None else self._ask_lease
            return min(self._session.next_turn(), ask, self.fields.due())
        if self._handshake is not None:
            return min(self._give_up, self._handshake.next_turn())
        return self._retry if self.phase in _WAITING else NEVER

    def next_state_due(self) -> Instant:
        """Returns when `next_state` will return a state. This is NEVER if there is no new state, or if the channel is
        not held."""
        if self._waits_for_lease():
            return NEVER
        if not self._predicts:
            return NEVER if self._unseen is None else self._next_call
        if self._newest is None:
            return NEVER
        ahead = max(self._seen_tick + 1 - self._newest.tick, 0)  # the first tick that has not been returned
        due = max(self._next_call, self._newest_arrived + ahead * self._haptic_period())
        return due if due - self._newest_arrived <= self._silence_ns() else NEVER

    @property
    def phase(self) -> Phase:
        return self._stats.phase

    @property
    def stats(self) -> Stats:
        """Returns a copy."""
        link = self._stats.link if self._session is None else self._session.stats
        return replace(self._stats, link=replace(link))

    @property
    def live_stats(self) -> Stats:
        """Returns the statistics without a copy. They must not be modified or kept. `link` is not updated."""
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
        if self.config.fields:
            features += (FEATURE_FIELDS,)
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
        """Handles the answer of the server, if it has arrived."""
        outcome = None if self._handshake is None else self._handshake.outcome
        if outcome is None:
            return
        if isinstance(outcome, Refused):
            self._end(now, Phase.REFUSED, outcome.code, outcome.detail)
            return
        grants = outcome.welcome.grants
        if self._claims() and len(grants) != 1:
            sentence = "this server has one device with one channel: omit their names"
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
        self._predicts = False
        self._first_tick = None
        self._seen_tick = 0
        self.report = self.device_report = None
        self.peer_reports = {}
        if FEATURE_FIELDS in outcome.welcome.features:
            self.fields.opened(self._session, self._place)
        elif self.config.fields:
            self.fields.closed("the server does not support fields")
        # The new session has not sent any force yet.
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
        self.fields.closed()
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
                if self._first_tick is None:
                    self._first_tick = event.tick
                # When the button was pressed, another engine had the channel.
                self._pressed = event.buttons | (0 if self._waits_for_lease() else self._pressed)
                self._newest_arrived = now
                self._back_off = _ns(self.config.retry_min_s)
            elif isinstance(event, FieldStatus):
                self.fields.take_status(now, event)
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
                taken_over = event.code is Code.REPLACED  # reconnecting would start a cycle of replacements
                self._end(now, Phase.STOPPED if taken_over else Phase.LOST, event.code, event.reason)

    def _take_answer(self, now: int, answer: ControlAck) -> None:
        if answer.device is not None:
            self.description = answer.device
        if answer.handle is not None:
            self.handle = answer.handle
        self.fields.take_answer(now, answer)
        if answer.id == self._deadband_request:
            self._predicts = answer.code is Code.OK and self._period > 0 and self._silence_ns() > 0
        if answer.id != self._asked_lease:
            return
        self._asked_lease = None
        self._ask_lease = NEVER
        if answer.code is not Code.UNSUPPORTED:  # otherwise the server does not support leases
            self.holds = answer.code is Code.OK
        if self.holds:
            self._stats.lease_lost_to = ""
        elif self.config.take_lease and answer.code is Code.BUSY:
            self._ask_lease = now + max(1_000_000 * answer.wait_ms, _ASK_LEASE_AGAIN_NS)

    def _take_request(self, now: int, session: Session, asked: Control) -> None:
        lost = asked.request
        if not isinstance(lost, LeaseLost):
            session.answer(asked.id, Code.UNSUPPORTED, "only a client can send this request")
            return
        session.answer(asked.id, Code.OK, "")
        if (lost.device, lost.channel) != (self._place.device, self._place.channel):
            return
        self.holds = False
        self.fields.lost_lease()
        self._stats.lease_lost_to = lost.to
        # A pending request may be older than this message, so send a new one.
        if self._asked_lease is not None and self.take_lease():
            return
        if self.config.take_lease:
            self._ask_lease = now + _ASK_LEASE_AGAIN_NS

    def _haptic_period(self) -> int:
        return _ns(1 / self.welcome.loop_hz) if self.welcome else 0

    def _silence_ns(self) -> int:
        return 1000 * self.config.state_deadband.max_silence_us if self.config.state_deadband else 0

    def _predicted(self, now: int) -> DeviceState | None:
        """Returns the state that is predicted for `now`. Returns None if there is nothing new, or if the last state is
        too old."""
        newest, age = self._newest, now - self._newest_arrived
        if newest is None or age > self._silence_ns():
            return None
        state = predict(newest, age, self._haptic_period())
        if state.tick <= self._seen_tick:  # the previous state had a shorter network delay
            return None
        self._stats.states_predicted += state.tick > newest.tick
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
