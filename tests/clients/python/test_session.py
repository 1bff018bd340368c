# SPDX-License-Identifier: Apache-2.0
"""Tests the guarantees of SESSION.md over good and bad networks with fixed seeds."""

from __future__ import annotations

import random

import pytest
from world import MS, PERFECT, SECOND, Weather, World

from tendon import codec, limits
from tendon.cipher import Plain, Sealed
from tendon.messages import (
    NEVER,
    Code,
    Control,
    ControlAck,
    DeviceState,
    Disarm,
    ForceCommand,
    Mode,
    PortPhase,
    PortState,
    Rearm,
    SetStateRate,
)
from tendon.replay_window import ReplayWindow
from tendon.requests import IncomingRequests, OutgoingRequests
from tendon.round_trip import RoundTrip
from tendon.session import Closed, Session

SEEDS = range(4)


def state(tick: int) -> DeviceState:
    zero = (0.0, 0.0, 0.0)
    return DeviceState(tick, tick * MS, (tick * 1e-6, 0.0, 0.0), zero, zero, 0.0, 1.0, 0, 0, 0, Mode.IDLE)


def ciphers(suite: str):
    if suite == "plain":
        return Plain(), Plain()
    return Sealed(bytes(32), b"\1" * 32, World.START), Sealed(b"\1" * 32, bytes(32), World.START + World.OFFSET)


def world(weather: Weather, seed: int = 1, suite: str = "plain") -> World:
    ours, theirs = ciphers(suite)
    a = Session(7, World.START, ours)
    z = Session(7, World.START + World.OFFSET, theirs)
    return World(a, z, weather, seed)


def drain(session: Session) -> list:
    events = []
    while (event := session.next_event()) is not None:
        events.append(event)
    return events


# ---- Realistic networks ----


@pytest.mark.parametrize("suite", ["plain", "sealed"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_bad_network_keeps_states_newer_and_requests_in_order(seed, suite):
    dice = random.Random(seed)
    weather = Weather(dice.randrange(60 * MS), dice.randrange(50 * MS), dice.random() * 0.4, dice.random() * 0.3)
    it = world(weather, seed, suite)
    ticks: list[int] = []
    asked: list[int] = []
    handed_out: list[int] = []
    answered: list[ControlAck] = []
    tick = 0

    def each_turn():
        nonlocal tick
        for event in drain(it.a):
            if isinstance(event, DeviceState):
                ticks.append(event.tick)
            elif isinstance(event, ControlAck):
                answered.append(event)
            else:
                pytest.fail(f"{event}")
        for event in drain(it.z):
            assert isinstance(event, Control)
            handed_out.append(event.id)
            it.z.answer(event.id, Code.OK, f"answer {event.id}")
        if it.now >= World.START + tick * 5 * MS:
            tick += 1
            it.z.send(state(tick))
            if tick <= 300 and tick % 10 == 0:
                number = it.a.request(SetStateRate(tick))
                if number is not None:
                    asked.append(number)
        return World.START + tick * 5 * MS

    it.run(3 * SECOND, each_turn)
    while len(answered) < len(asked) and it.now < World.START + 10 * SECOND:
        it.run(500 * MS, each_turn)
    assert it.a.open and it.z.open
    assert ticks == sorted(set(ticks)) and len(ticks) > 200
    assert len(asked) > 16
    assert handed_out == asked
    assert answered == [ControlAck(number, Code.OK, f"answer {number}") for number in asked]
    stats = it.a.stats
    taken = stats.datagrams_received + stats.duplicated
    assert taken == len(it.back.delivered)
    assert stats.malformed == stats.forged == stats.old_key == stats.invalid == 0
    assert weather.delay * 2 <= stats.smoothed_round_trip_ns <= 2 * (weather.delay + weather.jitter) + 1


def test_the_same_seed_gives_the_same_world():
    def bytes_of(seed):
        it = world(Weather(), seed)
        it.run(2 * SECOND, lambda: NEVER)
        return it.there.delivered, it.back.delivered

    assert bytes_of(3) == bytes_of(3)
    assert bytes_of(3) != bytes_of(4)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_damage_done_to_a_sealed_datagram_is_believed(seed):
    """One of the sessions receives each datagram twice: first a damaged copy and then the original."""
    dice = random.Random(seed)
    it = world(PERFECT, seed, "sealed")
    genuine = it.a.receive

    def receive(now, datagram):
        damaged = bytearray(datagram)
        damaged[dice.randrange(len(damaged))] ^= 1 << dice.randrange(8)
        genuine(now, bytes(damaged))
        genuine(now, datagram)

    it.a.receive = receive
    it.run(5 * SECOND, lambda: NEVER)
    stats = it.a.stats
    assert stats.datagrams_received == len(it.back.delivered)
    dropped = stats.malformed + stats.duplicated + stats.forged + stats.old_key
    assert dropped == len(it.back.delivered)
    assert stats.forged > 0


# ---- Single rules ----


def test_a_quiet_session_says_something_every_50_ms():
    it = world(PERFECT)
    it.run(1 * SECOND, lambda: NEVER)
    assert len(it.there.delivered) == len(it.back.delivered) == 20


def test_silence_of_2_s_ends_the_session():
    session = Session(7, 0)
    session.tick(2 * SECOND - 1)
    assert session.open
    session.tick(2 * SECOND)
    assert not session.open
    assert session.next_event() == Closed(Code.TIMED_OUT, "nothing received for 2000 ms")
    assert session.next_event() is None
    assert session.next_turn() == NEVER


def test_a_replay_is_no_sign_of_life():
    ours, theirs = Session(7, 0), Session(7, 0)
    datagram = theirs.next_datagram(0)
    for now in range(0, 2 * SECOND, 100 * MS):
        ours.receive(now, datagram)
    ours.tick(2 * SECOND)
    assert not ours.open
    assert ours.stats.duplicated == 19


def test_a_sealed_session_ends_after_24_h_and_says_so():
    ours = Session(7, 0, Sealed(bytes(32), b"\1" * 32, 0))
    theirs = Session(7, limits.LIFE_NS - 1, Sealed(b"\1" * 32, bytes(32), 0))
    now = limits.LIFE_NS
    ours.receive(now - 1, theirs.next_datagram(now - 1))
    ours.tick(now - 1)
    assert ours.open and ours.next_turn() == now - 1
    ours.tick(now)
    assert ours.next_event() == Closed(Code.EXPIRED, "the session has reached its maximum age")
    byes = []
    while (datagram := ours.next_datagram(now)) is not None:
        byes.append(datagram)
    assert len(byes) == 3


def test_an_authentic_datagram_that_is_malformed_uses_up_its_number():
    ours, theirs = ciphers("sealed")
    session = Session(7, World.START, ours)
    header = codec.encode_header(codec.Header(codec.DatagramType.DATA, codec.Suite.NOISE, connection_id=7))
    datagram = header + theirs.seal(0, header, b"not protobuf")
    session.receive(World.START, datagram)
    session.receive(World.START, datagram)
    assert (session.stats.malformed, session.stats.duplicated) == (1, 1)


def test_an_authentic_datagram_that_is_malformed_is_not_echoed():
    ours, theirs = ciphers("sealed")
    session = Session(7, World.START, ours)

    def hear(number: int, body: bytes) -> None:
        header = codec.encode_header(codec.Header(codec.DatagramType.DATA, codec.Suite.NOISE, 0, 7, number))
        session.receive(World.START, header + theirs.seal(number, header, body))

    def echo():
        datagram = session.next_datagram(World.START + 50 * MS * (1 + session.stats.datagrams_sent))
        header = codec.decode_header(datagram)
        opener = ciphers("sealed")[1]
        body = opener.open(0, 0, header.packet_number, datagram[: codec.HEADER_SIZE], datagram[codec.HEADER_SIZE :])
        return codec.read_data(body).echo

    hear(0, b"not protobuf")
    assert echo() is None
    hear(1, codec.write_data_head(5, None))
    hear(2, b"not protobuf")
    told = echo()
    assert (told.packet_number, told.sent_ns) == (1, 5)


def test_in_the_clear_a_damaged_copy_does_not_shut_out_the_good_one():
    ours, theirs = Session(7, 0), Session(7, 0)
    good = theirs.next_datagram(0)
    ours.receive(1, good[:-1])
    ours.receive(2, good)
    assert (ours.stats.malformed, ours.stats.datagrams_received) == (1, 1)


def test_a_bye_is_said_three_times_and_told_once():
    ours, theirs = Session(7, 0), Session(7, 0)
    ours.close(Code.OK, "enough")
    byes = [ours.next_datagram(0) for _ in range(3)]
    assert ours.next_datagram(0) is None and ours.next_turn() == NEVER
    for bye in byes:
        theirs.receive(1, bye)
    assert drain(theirs) == [Closed(Code.OK, "enough")]
    assert theirs.stats.datagrams_received == 1


def test_the_newest_force_replaces_the_one_that_has_not_left():
    ours, theirs = Session(7, 0), Session(7, 0)
    for sequence in (1, 2, 3):
        ours.send(ForceCommand(sequence, 1, (0.0, 0.0, 0.0), 1))
    theirs.receive(1, ours.next_datagram(0))
    assert drain(theirs) == [ForceCommand(3, 1, (0.0, 0.0, 0.0), 1)]
    assert ours.next_datagram(0) is None


def test_a_state_that_is_not_newer_is_stale():
    ours, theirs = Session(7, 0), Session(7, 0)
    theirs.send(state(5))
    newer = theirs.next_datagram(0)
    theirs.send(state(5))
    same = theirs.next_datagram(0)
    ours.receive(1, newer)
    ours.receive(1, same)
    assert ours.stats.stale == 1
    assert drain(ours) == [state(5)]


def test_what_overtakes_is_counted_as_lost_until_the_other_comes():
    ours, theirs = Session(7, 0), Session(7, 0)
    first, second = theirs.next_datagram(0), theirs.next_datagram(50 * MS)
    ours.receive(50 * MS, second)
    assert (ours.stats.lost, ours.stats.reordered) == (1, 0)
    ours.receive(51 * MS, first)
    assert (ours.stats.lost, ours.stats.reordered) == (0, 1)


def test_what_the_peer_has_not_seen_is_counted():
    ours, theirs = Session(7, 0), Session(7, 0)
    sent = [ours.next_datagram(i * 50 * MS) for i in range(4)]
    theirs.receive(200 * MS, sent[0])
    theirs.receive(200 * MS, sent[3])
    ours.receive(201 * MS, theirs.next_datagram(200 * MS))
    assert ours.stats.lost_outgoing == 2


def impossible_echoes():
    yield "of a packet we never sent", codec.Echo(10, 10, 5)
    yield "of a time before the session", codec.Echo(5, 10, 0)
    yield "of a time to come", codec.Echo(SECOND, 10, 0)
    yield "that was sent before it arrived", codec.Echo(20, 21, 0)


@pytest.mark.parametrize("echo", [pytest.param(echo, id=what) for what, echo in impossible_echoes()])
def test_an_impossible_echo_is_invalid(echo):
    ours = Session(7, 10)
    ours.next_datagram(20)
    header = codec.Header(codec.DatagramType.DATA, connection_id=7)
    ours.receive(30, codec.encode_header(header) + codec.write_data_head(20, echo))
    assert (ours.stats.datagrams_received, ours.stats.invalid, ours.stats.round_trip_ns) == (1, 1, 0)


@pytest.mark.parametrize(
    "header",
    [
        codec.Header(codec.DatagramType.DATA, connection_id=8),
        codec.Header(codec.DatagramType.DATA, codec.Suite.NOISE, connection_id=7),
        codec.Header(codec.DatagramType.DATA, connection_id=7, packet_number=2**60),
    ],
    ids=["connection id", "suite", "packet number"],
)
def test_a_foreign_datagram_is_malformed(header):
    session = Session(7, 0)
    session.receive(1, codec.encode_header(header) + codec.write_data_head(1, None))
    assert session.stats.malformed == 1


def test_a_late_copy_of_the_handshake_counts_as_duplicated():
    session = Session(7, 0)
    session.receive(1, codec.encode_retry(codec.RetryDatagram(bytes(16), bytes(16))))
    assert session.stats.duplicated == 1


def test_what_does_not_fit_into_one_datagram_goes_into_the_next():
    ours, theirs = Session(7, 0), Session(7, 0)
    for _ in range(16):
        ours.request(Rearm())
    assert ours.request(Rearm()) is None
    theirs.receive(0, ours.next_datagram(0))
    for event in drain(theirs):
        theirs.answer(event.id, Code.DENIED, 200 * "x")
    sizes = []
    while (datagram := theirs.next_datagram(0)) is not None:
        sizes.append(len(datagram))
        ours.receive(0, datagram)
    assert len(sizes) == 2 and max(sizes) <= 1200
    assert [event.id for event in drain(ours)] == list(range(1, 17))
    assert ours.request(Rearm()) == 17


def test_the_two_ends_of_a_coupling_are_streams_of_their_own():
    ours, theirs = Session(7, 0), Session(7, 0)

    def arrived(*ports: PortState) -> list:
        for port in ports:
            theirs.send(port)
        while (datagram := theirs.next_datagram(0)) is not None:
            ours.receive(0, datagram)
        return drain(ours)

    def port(epoch: int, of_peer: bool) -> PortState:
        return PortState(1, 1, epoch, 1, 0, 0, 0, 0, PortPhase.ENGAGED, of_peer=of_peer)

    assert arrived(port(9, True), port(5, False)) == [port(5, False), port(9, True)]
    assert ours.stats.stale == 0
    assert arrived(port(4, False)) == [] and ours.stats.stale == 1


def test_a_request_is_repeated_at_doubling_intervals_up_to_1_s():
    requests = OutgoingRequests()
    requests.add(Rearm())
    now, intervals = 0, []
    for _ in range(6):
        requests.sent(1, now, 100 * MS)
        intervals.append((requests.next_due() - now) // MS)
        now = requests.next_due()
    assert intervals == [100, 200, 400, 800, 1000, 1000]


def test_requests_come_in_order_and_unknown_ones_are_unsupported():
    requests = IncomingRequests()
    assert requests.take(Control(3, Rearm())) and requests.next() is None
    assert requests.take(Control(2, None)) and requests.take(Control(1, Rearm()))
    assert [requests.next(), requests.next(), requests.next()] == [Control(1, Rearm()), Control(3, Rearm()), None]
    assert [(ack.id, ack.code) for ack in requests.due()] == [(2, Code.UNSUPPORTED)]
    assert not requests.take(Control(20, Rearm())), "beyond the window"
    assert not requests.take(Control(17, Rearm())), "1 is not answered yet"
    requests.answer(ControlAck(1, Code.OK))
    assert requests.take(Control(17, Rearm()))


def test_a_request_out_of_bounds_is_answered_and_the_next_is_delivered():
    requests = IncomingRequests()
    assert requests.take(Control(1, None, "position_scale")) and requests.take(Control(2, Disarm()))
    assert [requests.next(), requests.next()] == [Control(2, Disarm()), None]
    assert requests.due() == [ControlAck(1, Code.INVALID, "position_scale is out of bounds")]


def test_the_answer_goes_out_again_when_the_request_comes_again():
    requests = IncomingRequests()
    requests.take(Control(1, Rearm()))
    requests.next()
    requests.answer(ControlAck(1, Code.OK, "yes"))
    requests.sent(1)
    assert requests.due() == []
    requests.take(Control(1, Rearm()))
    assert requests.next() is None
    assert requests.due() == [ControlAck(1, Code.OK, "yes")]


def test_round_trips_are_smoothed_as_in_rfc_6298():
    round_trip = RoundTrip()
    assert round_trip.timeout(20 * MS) == 100 * MS
    round_trip.observe(80 * MS)
    assert (round_trip.smoothed, round_trip.variation) == (80 * MS, 40 * MS)
    round_trip.observe(160 * MS)
    assert (round_trip.smoothed, round_trip.variation) == (90 * MS, 50 * MS)
    assert round_trip.timeout(20 * MS) == 290 * MS


@pytest.mark.parametrize("seed", SEEDS)
def test_the_replay_window_is_a_set_with_a_horizon(seed):
    dice = random.Random(seed)
    window, model = ReplayWindow(), set()
    for _ in range(2000):
        jump = dice.choice((1, 1, 1, 2, 70, 3000)) if dice.random() < 0.5 else -dice.randrange(2200)
        number = max(0, window.highest + jump)
        expected = number in model or max(model, default=-1) - number >= ReplayWindow.REMEMBERED
        assert window.contains(number) == expected
        if not expected:
            window.insert(number)
            model.add(number)
        mask = sum(1 << i for i in range(32) if window.highest - 1 - i in model)
        assert (window.highest, window.mask_before(window.highest)) == (max(model), mask)
    assert window.missing() == max(model) + 1 - len(model)
