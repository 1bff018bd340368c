# SPDX-License-Identifier: Apache-2.0
"""What a guest does, against a stand-in server over virtual networks: the behaviour of clients/cpp/force_client.h."""

from __future__ import annotations

import random
from dataclasses import replace
from math import inf, nan

import pytest
from stand_in import StandIn
from test_wire_md import DEVICE_REPORT, PEER_REPORT, REPORT
from world import MS, PERFECT, SECOND, Weather, World

from tendon import (
    ChannelDescription,
    ChannelRule,
    Code,
    Config,
    Contact,
    DeviceDescription,
    ForceClient,
    ForceDeadband,
    ForceTable,
    Mode,
    Phase,
    Role,
    SetStateDeadband,
    Touch,
)
from tendon.codec import (
    AnswerDatagram,
    DatagramType,
    RetryDatagram,
    Suite,
    decode_header,
    decode_hello,
    encode_answer,
    encode_retry,
    write_answer,
)
from tendon.handshake import ClientHandshake
from tendon.messages import (
    Claim,
    Control,
    ControlAck,
    Describe,
    DeviceState,
    Disarm,
    ForceCommand,
    GiveLease,
    Grant,
    Hello,
    LeaseLost,
    LocalModel,
    Rearm,
    Refused,
    SetStateRate,
    TakeLease,
)

KEY = bytes(range(32))
ZERO = (0.0, 0.0, 0.0)
DESCRIPTION = DeviceDescription(
    device=1,
    name="right",
    model="stand-in",
    position_dof=3,
    force_dof=3,
    workspace=None,
    max_force=8.0,
    continuous_force=0.0,
    max_stiffness=0.0,
    position_resolution=0.0,
    loop_hz=1000,
    channels=(
        ChannelDescription("tissue", ChannelRule.SUM),
        ChannelDescription("needle", ChannelRule.SUM),
        ChannelDescription("tool", ChannelRule.PRIORITY, 500, "wall"),
    ),
)


class Stage:
    """A guest whose physics is a wall at x = 0, and a device whose hand is 1 mm inside it, at 1 kHz."""

    def __init__(self, config: Config, server: StandIn | None = None, weather: Weather = PERFECT, seed: int = 1):
        self.client = ForceClient(config, World.START, random.Random(seed).randbytes)
        self.server = server or StandIn()
        self.world = World(self.client, self.server, weather, seed)
        self.touch = lambda hand: Touch((-2000 * hand.position[0], 0, 0))
        self.seen: list[DeviceState] = []
        self.seen_at: list[int] = []
        self.forces: list[ForceCommand] = []
        self.requests: list[Control] = []
        self.requested_at: list[int] = []
        self.answers: list[ControlAck] = []  # to what the server has asked
        self.grant = Code.OK
        self.wait_ms = 0  # said with each answer
        self.lease_answers: list[Code] = []  # to TakeLease, in this order; then `grant`
        self.snatches = 0  # so many leases are another one's as soon as they are given
        self.speed = 0.0  # m/s
        self.every = 1  # ms from one state to the next that is sent
        self._next_state = World.START

    def run(self, length: int) -> None:
        self.world.run(length, self._each_turn)

    def _each_turn(self):
        now = self.world.now
        session = self.server.session
        while session is not None and (event := session.next_event()) is not None:
            if isinstance(event, ForceCommand):
                self.forces.append(event)
            elif isinstance(event, Control):
                self.requests.append(event)
                self.requested_at.append(now)
                asks_lease = isinstance(event.request, TakeLease)
                code = self.lease_answers.pop(0) if asks_lease and self.lease_answers else self.grant
                described = isinstance(event.request, Describe) and code is Code.OK
                session.answer(event.id, code, "", self.wait_ms, DESCRIPTION if described else None)
                if asks_lease and code is Code.OK and self.snatches > 0:
                    self.snatches -= 1
                    session.request(LeaseLost(1, 2, "another"))
            elif isinstance(event, ControlAck):
                self.answers.append(event)
        if now >= self._next_state:
            tick = (now - World.START) // MS
            self._next_state = World.START + (tick + 1) * MS
            if session is not None and tick % self.every == 0:
                position = (1e-3 + 1e-3 * self.speed * tick, 0.0, 0.0)
                velocity = (self.speed, 0.0, 0.0)
                session.send(DeviceState(tick, now, position, velocity, ZERO, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE))
        while (hand := self.client.next_state(now)) is not None:
            self.seen.append(hand)
            self.seen_at.append(now)
            if self.touch is not None:
                self.client.send(hand, self.touch(hand))
        device = self._next_state if session is not None and session.open and not self.server.deaf else inf
        return min(device, self.client.next_state_due())


@pytest.mark.parametrize("key", [None, KEY], ids=["plain", "noise"])
@pytest.mark.parametrize("seed", range(5))
def test_a_wall_is_felt_over_a_bad_network_in_either_suite(seed, key):
    weather = Weather(5 * MS, 10 * MS, loss=0.2, duplicate=0.2)
    stage = Stage(Config(name="wall", key=key, rate_hz=100), StandIn(key), weather, seed)
    stage.run(3 * SECOND)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.welcome.device_name == "stand-in"
    assert len(stage.forces) > 100
    assert {force.force for force in stage.forces} == {(-2.0, 0.0, 0.0)}
    sequences = [force.sequence for force in stage.forces]
    assert sequences == sorted(set(sequences))
    assert [hello.name for hello in stage.server.hellos] == ["wall"], "a Hello that comes twice is one attempt"


def test_with_a_key_nothing_but_the_hellos_frame_is_readable():
    stage = Stage(Config(name="a name that must not show", key=KEY), StandIn(KEY))
    stage.run(1 * SECOND)
    sent = stage.world.there.delivered
    assert len(sent) > 100
    assert all(b"must not show" not in datagram for datagram in sent)
    assert {decode_header(datagram).suite for datagram in sent} == {1}


@pytest.mark.parametrize("key", [None, bytes(32)], ids=["no key", "another key"])
def test_a_server_with_another_key_is_one_that_does_not_answer(key):
    stage = Stage(Config(key=KEY), StandIn(key))
    stage.run(2500 * MS)
    assert stage.client.stats.reason == "no answer"
    assert stage.client.stats.sessions == 0


def test_an_attempt_says_hello_every_100_ms_with_one_random():
    stage = Stage(Config(key=KEY), StandIn(KEY))
    stage.server.deaf = True
    stage.run(1 * SECOND)
    hellos = [decode_hello(datagram) for datagram in stage.world.there.delivered]
    assert len(hellos) == 10
    assert len({hello.random for hello in hellos}) == len({hello.body for hello in hellos}) == 1


def test_only_the_first_retry_is_answered_at_once_with_the_last_cookie():
    handshake = ClientHandshake(Hello(Role.OBSERVER), bytes(16), 0)
    assert decode_hello(handshake.next_datagram(0)).cookie == bytes(16)
    for cookie in (b"a" * 16, b"b" * 16):
        handshake.receive(MS, encode_retry(RetryDatagram(bytes(16), cookie)))
        sent = handshake.next_datagram(MS)
        assert (sent is not None) == (cookie == b"a" * 16)
    assert handshake.next_datagram(100 * MS) is None
    assert decode_hello(handshake.next_datagram(101 * MS)).cookie == b"b" * 16


def test_a_retry_and_an_answer_of_another_attempt_are_ignored():
    handshake = ClientHandshake(Hello(Role.OBSERVER), bytes(16), 0)
    handshake.next_datagram(0)
    handshake.receive(1, encode_retry(RetryDatagram(b"other attempt...", b"a" * 16)))
    refused = write_answer(Refused(Code.BUSY))
    handshake.receive(1, encode_answer(AnswerDatagram(b"other attempt...", refused)))
    handshake.receive(1, encode_answer(AnswerDatagram(bytes(16), refused, suite=Suite.NOISE)))
    assert handshake.outcome is None and handshake.next_turn() == 100 * MS


def test_attempts_are_given_up_after_2_s_and_wait_twice_as_long_each_time():
    stage = Stage(Config())
    stage.server.deaf = True
    stage.run(30 * SECOND)
    hellos = [decode_hello(datagram).random for datagram in stage.world.there.delivered]
    assert stage.client.stats.attempts == len(set(hellos))
    # 2 s each, and between them 0.1, 0.2, 0.4, 0.8, 1.6, 2, 2 … s.
    assert stage.client.stats.attempts == 10


def test_a_restarted_server_is_found_and_the_sequence_begins_anew():
    stage = Stage(Config(rate_hz=100))
    stage.run(1 * SECOND)
    stage.server.session.close(Code.SHUTDOWN, "SIGTERM")
    stage.run(50 * MS)
    assert (stage.client.phase, stage.client.stats.reason) == (Phase.LOST, "SIGTERM")
    stage.forces.clear()
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.stats.sessions == 2
    assert stage.forces[0].sequence == 1


def test_whose_place_another_program_has_taken_does_not_come_back():
    stage = Stage(Config())
    stage.run(1 * SECOND)
    stage.server.session.close(Code.REPLACED, "taken over")
    stage.run(10 * SECOND)
    stats = stage.client.stats
    assert (stats.phase, stats.code, stats.attempts) == (Phase.STOPPED, Code.REPLACED, 1)


def test_a_sealed_session_of_a_day_says_bye_and_shakes_hands_again(monkeypatch):
    monkeypatch.setattr("tendon.limits.LIFE_NS", 3 * SECOND)
    stage = Stage(Config(key=KEY), StandIn(KEY))
    stage.run(1 * SECOND)
    first = stage.server.session
    stage.run(2500 * MS)
    assert not first.open
    assert stage.client.phase is Phase.OPEN
    assert stage.client.stats.sessions == 2


def test_silence_of_the_server_ends_the_session_and_a_new_attempt_follows():
    stage = Stage(Config())
    stage.run(1 * SECOND)
    stage.server.deaf = True
    stage.run(2050 * MS)
    assert (stage.client.phase, stage.client.stats.code) == (Phase.LOST, Code.TIMED_OUT)
    stage.server.deaf = False
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN


def test_a_refused_guest_asks_again_and_tells_the_servers_words():
    stage = Stage(Config())
    stage.server.refusal = Refused(Code.BUSY, "one controller")
    stage.run(500 * MS)
    stats = stage.client.stats
    assert (stats.phase, stats.code, stats.reason) == (Phase.REFUSED, Code.BUSY, "one controller")
    stage.server.refusal = None
    stage.run(3 * SECOND)
    assert stage.client.phase is Phase.OPEN


def test_an_answer_with_a_version_that_was_not_offered_is_ignored():
    stage = Stage(Config())
    stage.server.version = 2
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.GREETING


def test_states_are_handed_out_on_the_grid_of_the_rate():
    stage = Stage(Config(rate_hz=100))
    stage.run(2 * SECOND)
    stats = stage.client.stats
    ticks = [hand.tick for hand in stage.seen[1:]]  # the first one comes when it comes
    assert {later - earlier for earlier, later in zip(ticks, ticks[1:])} == {10}
    assert stats.states == len(stage.seen) + stats.states_skipped + (stage.client.next_state_due() != inf)


def test_after_a_pause_the_grid_starts_anew_and_nothing_is_caught_up():
    stage = Stage(Config(rate_hz=100))
    stage.run(500 * MS)
    stage._next_state += 55 * MS  # the device pauses
    stage.run(500 * MS)
    apart = [later - earlier for earlier, later in zip(stage.seen_at[1:], stage.seen_at[2:])]
    assert len([pause for pause in apart if pause > 40 * MS]) == 1
    assert set(apart) == {10 * MS, max(apart)}


def test_with_rate_0_every_state_is_handed_out_once():
    stage = Stage(Config())
    stage.run(1 * SECOND)
    ticks = [hand.tick for hand in stage.seen]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks))) and len(ticks) > 900


@pytest.mark.parametrize(
    "config, valid_for_us",
    [
        (Config(rate_hz=100), 30_000),
        (Config(rate_hz=1000), 20_000),
        (Config(rate_hz=20), 150_000),
        (Config(), 20_000),
        (Config(valid_for_s=0.5), 500_000),
    ],
)
def test_a_force_is_valid_for_three_periods_and_at_least_20_ms(config, valid_for_us):
    stage = Stage(config)
    stage.run(1 * SECOND)
    assert {force.valid_for_us for force in stage.forces} == {valid_for_us}


def test_a_force_names_the_tick_it_answers():
    stage = Stage(Config(rate_hz=50))
    stage.run(1 * SECOND)
    assert [force.based_on_tick for force in stage.forces] == [hand.tick for hand in stage.seen][: len(stage.forces)]


@pytest.mark.parametrize(
    "stiffness, matrix",
    [
        (5, ((5, 0, 0), (0, 5, 0), (0, 0, 5))),
        ((1, 2, 3), ((1, 0, 0), (0, 2, 0), (0, 0, 3))),
        ([[1, 2, 3], [4, 5, 6], [7, 8, 9]], ((1, 2, 3), (4, 5, 6), (7, 8, 9))),
    ],
)
def test_the_local_model_travels_in_all_its_forms(stiffness, matrix):
    stage = Stage(Config())
    stage.touch = lambda hand: Touch((0, 0, 0), stiffness)
    stage.run(200 * MS)
    assert {force.model.stiffness for force in stage.forces} == {matrix}
    assert {force.model.at for force in stage.forces} == {(1e-3, 0.0, 0.0)}


def test_numpy_arrays_will_do():
    numpy = pytest.importorskip("numpy")
    stage = Stage(Config())
    stage.touch = lambda hand: Touch(-500 * numpy.array(hand.position), 500 * numpy.eye(3))
    stage.run(200 * MS)
    assert {force.force for force in stage.forces} == {(-0.5, 0.0, 0.0)}


def test_all_that_the_engine_knows_travels():
    contact = Contact((0.0, 0.0, 1.0), -1e-3, ForceTable(-1e-3, 1e-3, (0.0, 1.0, 3.0)))
    stage = Stage(Config())
    stage.touch = lambda hand: Touch((0, 0, 1), None, 3e-3, contact, topology_changed=True, error=0.02)
    stage.run(200 * MS)
    force = stage.forces[-1]
    nothing = (0.0, 0.0, 0.0)
    assert force.model == LocalModel((1e-3, 0.0, 0.0), (nothing, nothing, nothing), 3e-3, contact)
    assert (force.topology_changed, force.error) == (True, 0.02)


def test_without_the_servers_consent_no_local_model_is_sent():
    stage = Stage(Config())
    stage.server.features = ()
    stage.touch = lambda hand: Touch((0, 0, 0), 100)
    stage.run(200 * MS)
    assert {force.model for force in stage.forces} == {None}


UNUSABLE = [
    Touch((nan, 0, 0)),
    Touch((0, inf, 0)),
    Touch((0, 0, 0), 2e12),
    Touch((0, 0, 0), 1, valid_radius=-1e-3),
    Touch((0, 0, 0), error=nan),
    Touch((0, 0, 0), contact=Contact((0, 0, 2), 0)),
    Touch((0, 0, 0), contact=Contact((0, 0, 1), nan)),
    Touch((0, 0, 0), contact=Contact((0, 0, 1), 0, ForceTable(0, 0, (0, 1)))),
    Touch((0, 0, 0), contact=Contact((0, 0, 1), 0, ForceTable(0, 1, (0,)))),
    Touch((0, 0, 0), contact=Contact((0, 0, 1), 0, ForceTable(0, 1, 17 * (0,)))),
    Touch((0, 0, 0), contact=Contact((0, 0, 1), 0, ForceTable(0, 1, (0, nan)))),
]


@pytest.mark.parametrize("touch", UNUSABLE)
def test_a_force_that_is_not_usable_is_counted_and_not_sent(touch):
    stage = Stage(Config(rate_hz=100))
    stage.touch = lambda hand: touch
    stage.run(1 * SECOND)
    assert stage.forces == []
    assert stage.client.stats.forces_unusable == len(stage.seen) > 50
    finite = all(abs(component) < inf for component in touch.force)  # NaN is not
    assert ("the force is not finite" in stage.client.stats.unusable) is not finite


def test_an_answer_to_a_state_that_did_not_come_is_not_sent():
    stage = Stage(Config(rate_hz=100))
    stage.run(SECOND // 2)
    sent = len(stage.forces)
    hand = replace(stage.seen[-1], tick=stage.seen[-1].tick + 1000)
    stage.client.send(hand, Touch((1, 0, 0)))
    assert stage.client.stats.unusable == f"it answers tick {hand.tick}, which has not come"
    stage.client.send(stage.seen[-1], Touch((0, -2e12, 0)))
    assert stage.client.stats.unusable == "the force is beyond 1e+12 N"
    assert stage.client.stats.forces_unusable == 2
    assert len(stage.forces) == sent


@pytest.mark.parametrize("touch", [Touch((1, 2)), Touch((1, 2, 3), (1, 2)), Touch(7), Touch(("a", 0, 0))])
def test_a_force_of_a_wrong_shape_is_an_error_in_the_callers_program(touch):
    stage = Stage(Config())
    stage.touch = lambda hand: touch
    with pytest.raises(ValueError, match="expected a (force|stiffness)"):
        stage.run(1 * SECOND)


def test_diagnostics_are_the_newest_reports_of_the_session():
    stage = Stage(Config(role=Role.OBSERVER, diagnostics=True))
    stage.touch = None
    stage.run(100 * MS)
    assert "diagnostics" in stage.server.hellos[0].features
    assert stage.client.device_report is None
    stage.server.session.send(DEVICE_REPORT)
    stage.server.session.send(PEER_REPORT)
    stage.server.session.send(replace(PEER_REPORT, channel=0, name="guidance"))
    stage.run(100 * MS)
    assert stage.client.device_report == DEVICE_REPORT
    assert {channel: peer.name for channel, peer in stage.client.peer_reports.items()} == {0: "guidance", 1: "wall"}
    stage.server.session.send(replace(DEVICE_REPORT, number=6))  # older than 7
    stage.server.session.send(replace(PEER_REPORT, link=replace(REPORT, number=4)))
    stage.run(100 * MS)
    assert stage.client.device_report == DEVICE_REPORT
    assert stage.client.peer_reports[1].link.number == 4
    assert stage.client.stats.link.stale == 1
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.device_report is None
    assert stage.client.peer_reports == {}


def test_a_controller_does_not_ask_for_diagnostics():
    with pytest.raises(ValueError, match="diagnostics: for observers only"):
        Config(diagnostics=True)


def test_an_observer_sees_states_and_cannot_send():
    stage = Stage(Config(role=Role.OBSERVER))
    stage.touch = None
    stage.run(200 * MS)
    assert len(stage.seen) > 100
    assert stage.server.hellos[0].role is Role.OBSERVER
    with pytest.raises(PermissionError):
        stage.client.send(stage.seen[0], Touch())


def test_a_wanted_state_rate_and_rearm_arrive_as_requests():
    stage = Stage(Config(state_hz=250))
    assert not stage.client.rearm(), "there is no session yet"
    stage.run(500 * MS)
    assert stage.client.rearm()
    stage.run(500 * MS)
    assert stage.client.disarm()
    stage.run(500 * MS)
    assert [control.request for control in stage.requests] == [SetStateRate(250), Rearm(), Disarm()]


def test_stop_says_bye_and_is_for_good():
    stage = Stage(Config(name="wall"))
    stage.run(1 * SECOND)
    stage.client.stop(stage.world.now)
    stage.run(5 * SECOND)
    assert stage.client.phase is Phase.STOPPED
    assert stage.client.stats.attempts == 1
    last = stage.world.there.delivered[-1]
    assert decode_header(last).type is DatagramType.DATA
    assert not stage.server.session.open


@pytest.mark.parametrize(
    "changes, word",
    [
        ({"name": 65 * "n"}, "name"),
        ({"device": 25 * "d"}, "device"),
        ({"channel": 12 * "ä" + "x"}, "channel"),
        ({"key": bytes(31)}, "key"),
        ({"rate_hz": -1}, "rate_hz"),
        ({"rate_hz": nan}, "rate_hz"),
        ({"state_hz": 2_000_000}, "state_hz"),
        ({"valid_for_s": 11}, "valid_for_s"),
        ({"patience_s": 0}, "patience_s"),
        ({"retry_min_s": 0}, "retry_min_s"),
        ({"retry_max_s": 0.01}, "retry_max_s"),
    ],
)
def test_an_impossible_setting_is_named(changes, word):
    with pytest.raises(ValueError, match=word):
        Config(**changes)


def test_a_key_does_not_show_in_what_is_printed():
    assert "key" not in repr(Config(key=KEY))


# ---- What need not be sent, and what the server says of it ----

KEPT = SetStateDeadband(share=0.1, floor=1e-3, max_silence_us=20_000)


def sparse(every: int) -> Stage:
    """A hand that moves at 0.1 m/s, of which the server sends one state in `every`."""
    stage = Stage(Config(rate_hz=500, state_deadband=KEPT))
    stage.every = every
    stage.speed = 0.1
    return stage


def test_states_that_were_left_out_are_foretold_at_the_callbacks_rate():
    stage = sparse(10)
    stage.run(1 * SECOND)
    assert [control.request for control in stage.requests] == [KEPT]
    stats = stage.client.stats
    assert stats.states < 110
    assert stats.states_foretold > 300
    assert len(stage.seen) > 450
    ticks = [hand.tick for hand in stage.seen]
    assert all(before < after for before, after in zip(ticks, ticks[1:]))
    for hand in stage.seen:
        assert hand.position[0] == pytest.approx(1e-3 + 1e-4 * hand.tick, abs=1e-12)
        assert hand.sampled_ns == World.START + hand.tick * MS
    assert {force.based_on_tick for force in stage.forces} <= set(ticks)


def test_nothing_is_foretold_beyond_the_longest_silence():
    stage = sparse(200)
    stage.run(1 * SECOND)
    assert 5 * 8 < len(stage.seen) < 5 * 12 + 2  # 20 ms of every 200


def test_no_state_is_predicted_for_a_server_without_deadbands():
    stage = Stage(Config(rate_hz=500, state_deadband=KEPT))
    stage.grant = Code.UNSUPPORTED
    stage.run(1 * SECOND)
    assert stage.client.stats.states > 900
    assert stage.client.stats.states_foretold == 0


@pytest.mark.parametrize(
    "asked, wrong",
    [
        (SetStateDeadband(0.51), "share"),
        (SetStateDeadband(nan), "share"),
        (SetStateDeadband(0.1, -1e-3), "floor"),
        (SetStateDeadband(0.1, 0.2), "floor"),
        (SetStateDeadband(0.1, 1e-3, 999), "max_silence_us"),
        (SetStateDeadband(0.1, 1e-3, 20_001), "max_silence_us"),
    ],
)
def test_a_deadband_that_no_server_grants_is_refused_here(asked, wrong):
    with pytest.raises(ValueError, match=f"state_deadband: {wrong}"):
        Config(state_deadband=asked)


def test_forces_that_feel_alike_are_left_out_up_to_the_silence():
    stage = Stage(Config(deadband=ForceDeadband()))
    stage.touch = lambda hand: Touch((1.0, 0.0, 0.0) if hand.tick < 500 else (1.2, 0.0, 0.0))
    stage.run(1 * SECOND)
    stats = stage.client.stats
    assert stats.forces + stats.forces_alike == len(stage.seen)
    assert 45 < stats.forces < 60
    changed = [force for force in stage.forces if force.based_on_tick == 500]
    assert len(changed) == 1, "at once"
    assert {force.valid_for_us for force in stage.forces[1:]} == {60_000}


def test_the_report_on_our_forces_is_that_of_the_session():
    stage = Stage(Config())
    stage.run(100 * MS)
    assert stage.client.report is None
    stage.server.session.send(REPORT)
    stage.run(100 * MS)
    assert stage.client.report == REPORT
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.report is None


# ---- Devices, channels and leases ----

OURS = Grant(Role.CONTROLLER, 1, 2)
ANOTHERS = Grant(Role.OBSERVER, 1, 2)  # to a controller's claim: for now another one holds the channel


def named(grant: Grant = OURS, **changes) -> Stage:
    """A guest that names its device and its channel, welcomed with `grant`."""
    stage = Stage(Config(**{"device": "right", "channel": "tool", **changes}))
    stage.server.grants = (grant,)
    return stage


def leases(stage: Stage) -> list[int]:
    """When the lease was asked for."""
    return [at for at, control in zip(stage.requested_at, stage.requests) if control.request == TakeLease(1, 2)]


@pytest.mark.parametrize(
    "names, claims",
    [
        ({}, ()),
        ({"device": "right"}, (Claim(Role.CONTROLLER, "right", ""),)),
        ({"channel": "tool"}, (Claim(Role.CONTROLLER, "", "tool"),)),
        ({"device": "right", "role": Role.OBSERVER}, (Claim(Role.OBSERVER, "right", ""),)),
    ],
)
def test_named_places_are_claimed_in_every_hello(names, claims):
    stage = Stage(Config(**names))
    stage.run(100 * MS)
    (hello,) = stage.server.hellos
    assert hello.claims == claims
    assert hello.features == ("local-model", "channels")


def test_forces_orders_leases_and_rates_name_the_granted_place():
    stage = named(state_hz=250)
    stage.run(100 * MS)
    for ask in (stage.client.rearm, stage.client.disarm, stage.client.take_lease, stage.client.give_lease):
        assert ask()
    stage.run(100 * MS)
    asked = [control.request for control in stage.requests]
    assert asked == [Describe(1), SetStateRate(250, 1), Rearm(1), Disarm(1), TakeLease(1, 2), GiveLease(1, 2)]
    assert {(force.device, force.channel) for force in stage.forces} == {(1, 2)}


def test_without_a_name_it_is_the_first_channel_of_the_first_device():
    stage = Stage(Config(take_lease=True))
    stage.run(100 * MS)
    assert stage.client.holds, "the Welcome says so by its role"
    assert {(force.device, force.channel) for force in stage.forces} == {(0, 0)}
    assert stage.requests == []
    assert stage.client.description is None


def test_a_lease_may_be_lost_without_a_name_too():
    stage = Stage(Config())
    stage.run(100 * MS)
    stage.server.session.request(LeaseLost(0, 0, "another"))
    stage.run(100 * MS)
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (False, "another")


@pytest.mark.parametrize("grants", [(), (OURS, OURS)], ids=["none", "two"])
def test_a_server_that_does_not_grant_what_was_named_is_left(grants):
    stage = named()
    stage.server.grants = grants
    stage.run(50 * MS)
    stats = stage.client.stats
    assert (stats.phase, stats.code, stats.sessions) == (Phase.REFUSED, Code.UNSUPPORTED, 0)
    assert stats.reason == "that server has one device, with one channel: name none"
    assert stage.seen == []


def test_the_description_of_a_named_device_is_that_of_the_session():
    stage = named()
    assert stage.client.description is None
    stage.run(100 * MS)
    assert stage.client.description == DESCRIPTION
    stage.grant = Code.UNSUPPORTED
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.description is None


def test_no_state_is_handed_out_while_another_holds_the_channel():
    stage = named(ANOTHERS)
    stage.run(1 * SECOND)
    stats = stage.client.stats
    assert (stage.seen, stage.forces, leases(stage)) == ([], [], [])
    assert stats.phase is Phase.OPEN and stats.states > 900
    assert not stage.client.holds and stage.client.next_state_due() == inf
    assert stage.client.take_lease()
    stage.run(100 * MS)
    assert stage.client.holds
    assert len(stage.seen) > 90 and len(stage.forces) > 90
    assert len(leases(stage)) == 1


def test_foretold_states_wait_for_the_lease_too():
    stage = named(ANOTHERS, rate_hz=500, state_deadband=KEPT)
    stage.run(500 * MS)
    assert (stage.seen, stage.client.stats.states_foretold) == ([], 0)


def test_an_observer_has_no_use_for_a_lease():
    stage = named(Grant(Role.OBSERVER, 1, 0), role=Role.OBSERVER, take_lease=True)
    stage.touch = None
    stage.run(200 * MS)
    assert len(stage.seen) > 100
    assert leases(stage) == []


@pytest.mark.parametrize("wait_ms, apart", [(200, 200 * MS), (0, 50 * MS)])
def test_a_held_lease_is_asked_for_until_it_is_ours(wait_ms, apart):
    stage = named(ANOTHERS, take_lease=True)
    stage.grant, stage.wait_ms = Code.BUSY, wait_ms
    stage.run(1 * SECOND)
    asked = leases(stage)
    pauses = [later - earlier for earlier, later in zip(asked, asked[1:])]
    assert len(pauses) >= 4
    assert all(apart <= pause <= apart + 10 * MS for pause in pauses)
    assert stage.seen == []
    stage.grant = Code.OK
    stage.run(1 * SECOND)
    assert stage.client.holds and len(stage.forces) > 500
    assert len(leases(stage)) == len(asked) + 1


def test_a_lease_is_asked_for_once_unless_the_config_says_otherwise():
    once = named(ANOTHERS)
    once.grant = Code.BUSY
    once.run(100 * MS)
    once.client.take_lease()
    once.run(1 * SECOND)
    assert len(leases(once)) == 1
    denied = named(ANOTHERS, take_lease=True)
    denied.grant = Code.DENIED
    denied.run(1 * SECOND)
    assert len(leases(denied)) == 1


def test_while_sixteen_requests_are_open_the_lease_waits_for_its_turn():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(20 * MS)
    stage.server.deaf = True
    while stage.client.rearm():
        pass
    assert not stage.client.take_lease()
    stage.run(500 * MS)
    stage.server.deaf = False
    stage.grant = Code.OK
    stage.run(1500 * MS)
    assert stage.client.holds


def test_who_has_lost_the_lease_is_told_to_whom_and_sends_nothing_more():
    stage = named()
    stage.run(100 * MS)
    stage.server.session.request(LeaseLost(1, 2, "another"))
    stage.run(10 * MS)
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (False, "another")
    assert [answer.code for answer in stage.answers] == [Code.OK]
    seen, forces = list(stage.seen), list(stage.forces)
    stage.client.send(seen[-1], Touch((1, 0, 0)))  # of an engine that was still computing
    stage.run(1 * SECOND)
    assert (stage.seen, stage.forces) == (seen, forces)
    assert stage.client.phase is Phase.OPEN
    assert leases(stage) == []


def test_a_lost_lease_is_asked_for_again_and_then_its_loss_forgotten():
    stage = named(take_lease=True)
    stage.run(100 * MS)
    lost_at = stage.world.now
    stage.server.session.request(LeaseLost(1, 2, "another"))
    stage.run(30 * MS)
    assert leases(stage) == [], "the other one has only just come"
    stage.run(100 * MS)
    (asked,) = leases(stage)
    assert 50 * MS <= asked - lost_at < 60 * MS
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (True, "")


@pytest.mark.parametrize("place", [(0, 2), (1, 0)])
def test_the_loss_of_another_place_is_none(place):
    stage = named()
    stage.run(100 * MS)
    stage.server.session.request(LeaseLost(*place, "another"))
    stage.run(100 * MS)
    assert [answer.code for answer in stage.answers] == [Code.OK]
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (True, "")


def test_what_a_server_cannot_ask_is_answered_so():
    stage = Stage(Config())
    stage.run(100 * MS)
    stage.server.session.request(Rearm())
    stage.run(100 * MS)
    (answer,) = stage.answers
    assert (answer.code, answer.detail) == (Code.UNSUPPORTED, "that is a client's to ask")


def test_a_lease_given_up_does_not_come_back_by_an_older_answer():
    stage = named(take_lease=True)
    stage.run(100 * MS)
    assert stage.client.take_lease(), "ours already: the server says OK"
    assert stage.client.give_lease()
    seen = list(stage.seen)
    stage.run(1 * SECOND)
    assert not stage.client.holds
    assert stage.seen == seen
    assert len(leases(stage)) == 1


@pytest.mark.parametrize("once_more", [Code.BUSY, Code.OK])
def test_a_lease_won_and_lost_before_either_is_heard_is_lost(once_more):
    stage = named(ANOTHERS)
    stage.run(100 * MS)
    stage.lease_answers, stage.snatches = [Code.OK, once_more], 1
    assert stage.client.take_lease()
    stage.run(1 * SECOND)
    ours = once_more is Code.OK
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (ours, "" if ours else "another")
    assert len(leases(stage)) == 2, "it has asked again, once"


def test_a_server_that_knows_no_leases_leaves_it_the_channel_that_it_has():
    stage = Stage(Config())
    stage.run(100 * MS)
    stage.grant = Code.UNSUPPORTED
    assert stage.client.take_lease()
    stage.run(1 * SECOND)
    assert stage.client.holds and len(stage.forces) > 900


def test_who_waits_for_a_lease_and_gives_it_up_asks_no_more():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(200 * MS)
    asked = len(leases(stage))
    assert stage.client.give_lease()
    stage.run(1 * SECOND)
    assert len(leases(stage)) == asked


def test_a_turn_is_due_when_the_lease_is_to_be_asked_for_again():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(30 * MS)
    stage.client.rearm()  # the keep-alive is later then
    stage.run(10 * MS)
    (asked,) = leases(stage)
    assert stage.client.next_turn() == asked + 51 * MS, "50 ms after the answer, which was on its way for 1 ms"


def test_a_lease_unanswered_in_one_session_is_asked_for_in_the_next():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(100 * MS)
    stage.client.take_lease()
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.grant = Code.OK
    stage.run(1 * SECOND)
    assert stage.client.holds
    assert stage.client.stats.sessions == 2


def test_a_new_session_has_its_own_place_and_nothing_of_the_old_one():
    stage = named(take_lease=True)
    stage.grant = Code.BUSY
    stage.run(100 * MS)
    stage.server.session.request(LeaseLost(1, 2, "another"))
    stage.run(100 * MS)
    assert not stage.client.holds
    stage.server.grants = (Grant(Role.CONTROLLER, 0, 1),)
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(1 * SECOND)
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (True, "")
    assert (stage.forces[-1].device, stage.forces[-1].channel) == (0, 1)
    asked = len(stage.requests)
    stage.run(1 * SECOND)
    assert len(stage.requests) == asked


def test_without_a_session_no_lease_is_held_asked_for_or_given():
    stage = named()
    assert not (stage.client.holds or stage.client.take_lease() or stage.client.give_lease())
    stage.run(100 * MS)
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(50 * MS)
    assert stage.client.phase is Phase.LOST
    assert not (stage.client.holds or stage.client.take_lease() or stage.client.give_lease())
