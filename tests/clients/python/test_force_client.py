# SPDX-License-Identifier: Apache-2.0
"""Tests the client with a stand-in server on virtual networks, as specified in clients/cpp/force_client.h."""

from __future__ import annotations

import re
from dataclasses import replace
from math import inf, nan

import pytest
from stage import KEPT, KEY, Stage
from stand_in import StandIn
from test_golden import DEVICE_REPORT, PEER_REPORT, REPORT
from world import MS, SECOND, Weather, World

from tendon import (
    Code,
    Config,
    Contact,
    ForceDeadband,
    ForceTable,
    Phase,
    Role,
    SetStateDeadband,
    Touch,
    aes,
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
from tendon.messages import Disarm, Hello, LocalModel, Rearm, Refused, SetStateRate


@pytest.mark.parametrize("key", [None, KEY], ids=["plain", "noise"])
@pytest.mark.parametrize("seed", range(2))
def test_a_wall_is_felt_over_a_bad_network_in_either_suite(seed, key):
    weather = Weather(5 * MS, 10 * MS, loss=0.2, duplicate=0.2)
    stage = Stage(Config(name="wall", key=key, rate_hz=100), StandIn(key), weather, seed)
    stage.run(1500 * MS)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.welcome.device_name == "stand-in"
    assert len(stage.forces) > 100
    assert {force.force for force in stage.forces} == {(-2.0, 0.0, 0.0)}
    sequences = [force.sequence for force in stage.forces]
    assert sequences == sorted(set(sequences))
    assert [hello.name for hello in stage.server.hellos] == ["wall"], "a Hello that comes twice is one attempt"


def test_with_a_key_nothing_but_the_hellos_frame_is_readable():
    stage = Stage(Config(name="a name that must not show", key=KEY), StandIn(KEY))
    stage.run(200 * MS)
    sent = stage.world.there.delivered
    assert len(sent) > 100
    assert all(b"must not show" not in datagram for datagram in sent)
    assert {decode_header(datagram).suite for datagram in sent} == {1}


OLD, BOTH, AES_ONLY = (Suite.NOISE,), (Suite.AES_GCM, Suite.NOISE), (Suite.AES_GCM,)


@pytest.mark.skipif(not aes.AVAILABLE, reason="python3-cryptography is missing")
@pytest.mark.parametrize(
    "ours, theirs, agreed",
    [(BOTH, BOTH, 2), (BOTH, OLD, 1), (OLD, BOTH, 1), (OLD, OLD, 1), (AES_ONLY, BOTH, 2), (BOTH, AES_ONLY, 2)],
    ids=["both", "old server", "old client", "both old", "client forbids suite 1", "server forbids suite 1"],
)
def test_the_suite_is_the_fastest_that_both_have(ours, theirs, agreed):
    stage = Stage(Config(key=KEY, suites=ours), StandIn(KEY, theirs))
    stage.run(200 * MS)
    assert stage.client.phase is Phase.OPEN
    assert len(stage.forces) > 100
    headers = [decode_header(datagram) for datagram in stage.world.there.delivered]
    assert {header.suite for header in headers if header.type is DatagramType.DATA} == {agreed}
    assert {header.suite for header in headers if header.type is DatagramType.HELLO} == {1}


@pytest.mark.skipif(not aes.AVAILABLE, reason="python3-cryptography is missing")
def test_a_server_that_has_none_of_our_suites_is_one_that_refuses():
    stage = Stage(Config(key=KEY, suites=AES_ONLY), StandIn(KEY, OLD))
    stage.run(200 * MS)
    assert stage.client.phase is Phase.REFUSED
    assert stage.client.stats.code is Code.UNSUPPORTED
    assert stage.client.stats.reason == "no common cipher suite: the server uses chacha20-poly1305, this client only accepts aes-256-gcm"


def test_a_suite_that_was_not_offered_is_not_taken():
    server = StandIn(KEY, OLD)
    server.features = ("aes-256-gcm", *server.features)
    stage = Stage(Config(key=KEY, suites=OLD), server)
    stage.run(200 * MS)
    assert stage.client.phase is Phase.OPEN
    assert len(stage.forces) > 100


@pytest.mark.parametrize("suites", [(), (Suite.PLAIN,)], ids=["none", "one that does not seal"])
def test_suites_that_cannot_be_are_refused(suites):
    with pytest.raises(ValueError, match="suites = .*: expected some of"):
        Config(key=KEY, suites=suites)


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
    # The attempts take 2 s each and are separated by 0.1, 0.2, 0.4, 0.8, 1.6, 2, 2 … s.
    assert stage.client.stats.attempts == 10


def test_a_restarted_server_is_found_and_the_sequence_begins_anew():
    stage = Stage(Config(rate_hz=100))
    stage.run(200 * MS)
    stage.server.session.close(Code.SHUTDOWN, "SIGTERM")
    stage.run(50 * MS)
    assert (stage.client.phase, stage.client.stats.reason) == (Phase.LOST, "SIGTERM")
    stage.forces.clear()
    stage.run(300 * MS)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.stats.sessions == 2
    assert stage.forces[0].sequence == 1


def test_whose_place_another_program_has_taken_does_not_come_back():
    stage = Stage(Config())
    stage.run(200 * MS)
    stage.server.session.close(Code.REPLACED, "taken over")
    stage.run(10 * SECOND)
    stats = stage.client.stats
    assert (stats.phase, stats.code, stats.attempts) == (Phase.STOPPED, Code.REPLACED, 1)


def test_a_sealed_session_of_a_day_says_bye_and_shakes_hands_again(monkeypatch):
    monkeypatch.setattr("tendon.limits.LIFE_NS", 1 * SECOND)
    stage = Stage(Config(key=KEY), StandIn(KEY))
    stage.run(300 * MS)
    first = stage.server.session
    stage.run(900 * MS)
    assert not first.open
    assert stage.client.phase is Phase.OPEN
    assert stage.client.stats.sessions == 2


def test_silence_of_the_server_ends_the_session_and_a_new_attempt_follows():
    stage = Stage(Config())
    stage.run(200 * MS)
    stage.server.deaf = True
    stage.run(2050 * MS)
    assert (stage.client.phase, stage.client.stats.code) == (Phase.LOST, Code.TIMED_OUT)
    stage.server.deaf = False
    stage.run(500 * MS)
    assert stage.client.phase is Phase.OPEN


def test_a_refused_guest_asks_again_and_tells_the_servers_words():
    stage = Stage(Config())
    stage.server.refusal = Refused(Code.BUSY, "one controller")
    stage.run(250 * MS)
    stats = stage.client.stats
    assert (stats.phase, stats.code, stats.reason) == (Phase.REFUSED, Code.BUSY, "one controller")
    stage.server.refusal = None
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.OPEN


def test_an_answer_with_a_version_that_was_not_offered_is_ignored():
    stage = Stage(Config())
    stage.server.version = 2
    stage.run(1 * SECOND)
    assert stage.client.phase is Phase.GREETING


def test_states_are_handed_out_on_the_grid_of_the_rate():
    stage = Stage(Config(rate_hz=100))
    stage.run(500 * MS)
    stats = stage.client.stats
    ticks = [hand.tick for hand in stage.seen[1:]]  # the first state is not on the grid
    assert {later - earlier for earlier, later in zip(ticks, ticks[1:])} == {10}
    assert stats.states == len(stage.seen) + stats.states_skipped + (stage.client.next_state_due() != inf)


def test_a_press_in_a_state_that_is_skipped_is_in_the_next_one_that_is_not():
    stage = Stage(Config(rate_hz=20))
    stage.press_every = 100
    stage.run(2 * SECOND)
    assert len(stage.seen) > 35
    assert sum(hand.buttons == 2 for hand in stage.seen) == pytest.approx(20, abs=1)


def test_after_a_pause_the_grid_starts_anew_and_nothing_is_caught_up():
    stage = Stage(Config(rate_hz=100))
    stage.run(300 * MS)
    stage._next_state += 55 * MS
    stage.run(300 * MS)
    apart = [later - earlier for earlier, later in zip(stage.seen_at[1:], stage.seen_at[2:])]
    assert len([pause for pause in apart if pause > 40 * MS]) == 1
    assert set(apart) == {10 * MS, max(apart)}


def test_with_rate_0_every_state_is_handed_out_once():
    stage = Stage(Config())
    stage.run(500 * MS)
    ticks = [hand.tick for hand in stage.seen]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks))) and len(ticks) > 450


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
    stage.run(300 * MS)
    assert {force.valid_for_us for force in stage.forces} == {valid_for_us}


def test_a_force_names_the_tick_it_answers():
    stage = Stage(Config(rate_hz=50))
    stage.run(300 * MS)
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


@pytest.mark.parametrize(
    ("way", "agreed", "sent", "left_out"),
    [
        (2, True, 2, ""),
        (0, True, 0, ""),
        (2, False, 0, ""),
        (3, True, 0, "the solver path: its number is not in Config.ways"),
        (-1, True, 0, "the solver path: its number is not in Config.ways"),
    ],
)
def test_a_force_says_which_of_its_engines_ways_it_was(way, agreed, sent, left_out):
    stage = Stage(Config(ways=("tabulated", "near")))
    stage.server.features = ("local-model", "ways") if agreed else ("local-model",)
    stage.touch = lambda hand: Touch((0, 0, 1), way=way)
    stage.run(200 * MS)
    assert stage.server.hellos[0].ways == ("tabulated", "near")
    assert "ways" in stage.server.hellos[0].features
    assert {force.way for force in stage.forces} == {sent}
    assert stage.client.stats.left_out == left_out


@pytest.mark.parametrize(
    ("ways", "words"),
    [
        (9 * ("x",), "ways.size = 9: expected at most 8 names"),
        (("near", ""), "ways[1].size = 0: expected at least 1 byte"),
        ((25 * "x",), "ways[0].size = 25: expected at most 24 bytes"),
        (("near", "near"), "ways[1] = near: expected unique names"),
    ],
)
def test_impossible_names_of_ways_are_refused(ways, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        Config(ways=ways)


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
    stage.run(300 * MS)
    assert stage.forces == []
    assert stage.client.stats.forces_unusable == len(stage.seen) > 15
    finite = all(abs(component) < inf for component in touch.force)  # false for NaN
    assert ("the force is not finite" in stage.client.stats.unusable) is not finite


def test_an_answer_to_a_state_that_did_not_come_is_not_sent():
    stage = Stage(Config(rate_hz=100))
    stage.run(200 * MS)
    sent = len(stage.forces)
    hand = replace(stage.seen[-1], tick=stage.seen[-1].tick + 1000)
    stage.client.send(hand, Touch((1, 0, 0)))
    assert stage.client.stats.unusable == f"it answers tick {hand.tick}, which was not received in this session"
    stage.client.send(stage.seen[-1], Touch((0, -2e12, 0)))
    assert stage.client.stats.unusable == "the force exceeds 1e12 N"
    assert stage.client.stats.forces_unusable == 2
    assert len(stage.forces) == sent


def test_a_state_that_was_kept_over_a_reconnect_is_not_answered():
    stage = Stage(Config(rate_hz=100))
    stage.run(200 * MS)
    kept = stage.seen[-1]
    stage.server.session.close(Code.SHUTDOWN, "SIGTERM")
    stage.run(300 * MS)
    assert stage.client.stats.sessions == 2
    sent = len(stage.forces)
    stage.client.send(kept, Touch((1, 0, 0)))
    stage.run(20 * MS)
    assert stage.client.stats.unusable == f"it answers tick {kept.tick}, which was not received in this session"
    assert [force.based_on_tick for force in stage.forces[sent:]] == [hand.tick for hand in stage.seen[-2:]]


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
    stage.server.session.send(replace(DEVICE_REPORT, number=6))
    stage.server.session.send(replace(PEER_REPORT, link=replace(REPORT, number=4)))
    stage.run(100 * MS)
    assert stage.client.device_report == DEVICE_REPORT
    assert stage.client.peer_reports[1].link.number == 4
    assert stage.client.stats.link.stale == 1
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(300 * MS)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.device_report is None
    assert stage.client.peer_reports == {}


def test_a_controller_does_not_ask_for_diagnostics():
    with pytest.raises(ValueError, match="only observers can use diagnostics"):
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
    stage.run(100 * MS)
    assert stage.client.rearm()
    stage.run(100 * MS)
    assert stage.client.disarm()
    stage.run(100 * MS)
    assert [control.request for control in stage.requests] == [SetStateRate(250), Rearm(), Disarm()]


def test_stop_says_bye_and_is_for_good():
    stage = Stage(Config(name="wall"))
    stage.run(200 * MS)
    stage.client.stop(stage.world.now)
    stage.run(5 * SECOND)
    assert stage.client.phase is Phase.STOPPED
    assert stage.client.stats.attempts == 1
    last = stage.world.there.delivered[-1]
    assert decode_header(last).type is DatagramType.DATA
    assert not stage.server.session.open


@pytest.mark.parametrize(
    "changes, sentence",
    [
        ({"name": 65 * "n"}, "name.size = 65: expected at most 64 bytes"),
        ({"device": 25 * "d"}, "device.size = 25: expected at most 24 bytes"),
        ({"channel": 12 * "ä" + "x"}, "channel.size = 25: expected at most 24 bytes"),
        ({"key": bytes(31)}, "key.size = 31: expected 32 bytes"),
        ({"rate_hz": -1}, "rate_hz = -1: expected 0, or 0.001 to 100000"),
        ({"rate_hz": nan}, "rate_hz = nan: expected 0, or 0.001 to 100000"),
        ({"state_hz": 2_000_000}, "state_hz = 2000000: expected 0 to 1000000"),
        ({"valid_for_s": 11}, "valid_for_s = 11: expected 0 to 10"),
        ({"patience_s": 0}, "patience_s = 0: expected more than 0"),
        ({"retry_min_s": 0}, "retry_min_s = 0: expected more than 0"),
        ({"retry_max_s": 0.01}, "retry_max_s = 0.01: expected at least retry_min_s"),
    ],
)
def test_an_impossible_setting_is_refused_with_field_value_and_expectation(changes, sentence):
    with pytest.raises(ValueError) as refused:
        Config(**changes)
    assert str(refused.value) == sentence


def test_a_key_does_not_show_in_what_is_printed():
    assert "key" not in repr(Config(key=KEY))


# ---- Deadbands, and the report on forces ----


def sparse(every: int) -> Stage:
    """Returns a stage with a hand that moves at 0.1 m/s. The server sends one state in `every`."""
    stage = Stage(Config(rate_hz=500, state_deadband=KEPT))
    stage.every = every
    stage.speed = 0.1
    return stage


def test_states_that_were_left_out_are_predicted_at_the_callbacks_rate():
    stage = sparse(10)
    stage.run(1 * SECOND)
    assert [control.request for control in stage.requests] == [KEPT]
    stats = stage.client.stats
    assert stats.states < 110
    assert stats.states_predicted > 300
    assert len(stage.seen) > 450
    ticks = [hand.tick for hand in stage.seen]
    assert all(before < after for before, after in zip(ticks, ticks[1:]))
    for hand in stage.seen:
        assert hand.position[0] == pytest.approx(1e-3 + 1e-4 * hand.tick, abs=1e-12)
        assert hand.sampled_ns == World.START + hand.tick * MS
    assert {force.based_on_tick for force in stage.forces} <= set(ticks)


def test_nothing_is_predicted_beyond_the_longest_silence():
    stage = sparse(200)
    stage.run(1 * SECOND)
    assert 5 * 8 < len(stage.seen) < 5 * 12 + 2  # 20 ms of each 200 ms


def test_no_state_is_predicted_for_a_server_without_deadbands():
    stage = Stage(Config(rate_hz=500, state_deadband=KEPT))
    stage.grant = Code.UNSUPPORTED
    stage.run(500 * MS)
    assert stage.client.stats.states > 450
    assert stage.client.stats.states_predicted == 0


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
    with pytest.raises(ValueError, match=f"^state_deadband.{wrong} = .*: expected 0"):
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
    stage.run(300 * MS)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.report is None
