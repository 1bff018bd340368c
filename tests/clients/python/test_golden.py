# SPDX-License-Identifier: Apache-2.0
"""Checks that the client writes and reads the golden datagrams in protocol/vectors/golden.md."""

from dataclasses import replace
from math import inf, nan

import pytest
from golden import PAGE, golden_datagrams

from tendon import codec
from tendon.codec import AnswerDatagram, DatagramType, Echo, Header, HelloDatagram, RetryDatagram
from tendon.messages import (
    Bye,
    Code,
    Contact,
    Control,
    ControlAck,
    Delays,
    DeviceReport,
    DeviceState,
    ForceCommand,
    ForceTable,
    Grip,
    Hand,
    HandleDescription,
    Joints,
    LampColour,
    Couple,
    CouplingMethod,
    Disengage,
    Engage,
    Hello,
    LinkReport,
    LocalModel,
    Mode,
    OutputDescription,
    OutputKind,
    PeerReport,
    PortGrip,
    PortPhase,
    PortRole,
    PortState,
    PortSurface,
    PortTurn,
    RateControl,
    Refused,
    Role,
    RotationModel,
    Safety,
    SetOutput,
    SetScale,
    SetShare,
    SetStateDeadband,
    SetStateRate,
    Torque,
    Turning,
    Vibration,
    Welcome,
)

GOLDEN = golden_datagrams(PAGE.read_text(encoding="utf-8"))
RANDOM = bytes(range(0xA0, 0xB0))
COOKIE = bytes(range(0xC0, 0xD0))
ID = 0x11223344
TX_TIME = 1_000_100_000
ECHO = Echo(sent_ns=5_000_000, received_ns=999_000_000, packet_number=3, received_mask=5)

HELLO = Hello(Role.CONTROLLER, "wall", ("local-model",))
WELCOME = Welcome(1, ("local-model",), Role.CONTROLLER, "simulated", 8.0, 0.0, 1000, 2000, "tendond")
REFUSED = Refused(Code.BUSY, "one controller", 1, 1)
STATE = DeviceState(
    tick=1000,
    sampled_ns=1_000_000_000,
    position=(0.01, 0.0, -0.02),
    velocity=(0.5, 0.0, 0.0),
    force_applied=(-2.0, 0.0, 0.0),
    energy=0.25,
    permitted_force=8.0,
    reasons=3,
    force_sequence=99,
    force_age_ns=1_500_000,
    mode=Mode.ACTIVE,
)
WALL = ((2000.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
FORCE = ForceCommand(100, 1000, (-2.0, 0.0, 0.0), 20_000, LocalModel((0.01, 0.0, 0.0), WALL))
FORCE_WITH_ALL = ForceCommand(
    101,
    1000,
    (-2.0, 0.0, 0.0),
    20_000,
    LocalModel(
        (0.01, 0.0, 0.0), WALL, 0.0025, Contact((-1.0, 0.0, 0.0), -0.002, ForceTable(-0.002, 0.001, (0.0, 0.75, 2.0, 3.5)))
    ),
    topology_changed=True,
    error=0.125,
)
REPORT = LinkReport(
    number=3,
    until_ns=1_000_000_000,
    span_ns=1_000_000_000,
    forces=97,
    late_server=0,
    late_network=2,
    late_engine=1,
    worst_late_ns=75_000_000,
    longest_gap_ns=90_000_000,
    round_trip=Delays(41_000_000, 131_000_000),
    to_server=Delays(20_500_000, 110_000_000),
    to_client=Delays(20_500_000, 22_000_000),
    clock_offset_ns=-5_000_000,
    clock_drift_ppm=16.0,
    clock_error_ns=250_000,
    received=3000,
    lost=12,
    reordered=1,
    duplicated=0,
    words="forces were late 3 times, by up to 75 ms: the network (round trip 131 ms, usually 41 ms)",
)
STATE_BUTTONS = replace(STATE, buttons=0b1001)
STATE_HANDLE = replace(
    STATE,
    buttons=1,
    turning=Turning((0.6, 0.0, 0.8, 0.0), (0.0, 1.5, 0.0)),
    torque_applied=(0.0, -0.0625, 0.0),
    grip=Grip(0.25, -0.5),
    grip_applied=0.75,
    hand_force=(1.5, 0.0, -0.25),
)
FORCE_TORQUE = replace(
    FORCE,
    sequence=102,
    torque=Torque(
        (0.0, -0.0625, 0.0), RotationModel((0.6, 0.0, 0.8, 0.0), ((0.0, 0.0, 0.0), (0.0, 0.25, 0.0), (0.0, 0.0, 0.0)))
    ),
    grip_force=0.75,
)
HANDLE = HandleDescription(
    device=1,
    operator_from_device=(0.5, -0.5, 0.5, 0.5),
    buttons=("right", "forward", "centre", "left"),
    orientation_measured=True,
    max_torque=0.125,
    gripper_open=0.5,
    max_gripper_force=8.0,
    group="arms",
    hand=Hand.RIGHT,
)
STATE_JOINTS = replace(STATE, joints=Joints((0.5, -0.25, 1.5), (0.125, 0.0, -2.0)))
PULSE = Vibration(0.5, 200.0, 40)
OUTPUTS = HandleDescription(
    1, outputs=(OutputDescription("ring", OutputKind.LAMP), OutputDescription("tip", OutputKind.VIBRATION))
)
NAMED_JOINTS = HandleDescription(1, joints=("turntable", "upper arm", "forearm"))
WALL = ((800.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
STATE_WANTED = replace(STATE, force_wanted=(-8.0, 0.0, 0.5), stiffness_wanted=WALL)
DEVICE_REPORT = DeviceReport(
    number=7,
    until_ns=1_000_000_000,
    span_ns=1_000_000_000,
    device=1,
    steps=990,
    missed=10,
    overruns=2,
    unseen=1,
    lateness=(3, 0, 0, 0, 0, 0, 981, 0, 0, 0, 0, 0, 0, 3),
    safety=Safety.FAULT,
    fault="the handle was faster than a hand",
    degraded="the log thread does not follow",
)
PEER_REPORT = PeerReport(device=1, channel=1, name="wall", state_one_in=4, forces_refused=True, link=REPORT)
PORT = PortState(
    device=1,
    channel=1,
    epoch=5,
    sequence=1000,
    answers_epoch=3,
    answers=960,
    time_ns=1_000_000_000,
    round_trip_ns=40_000_000,
    phase=PortPhase.ENGAGED,
    engagement=2,
    buttons=2,
    position=(0.01, 0.0, -0.02),
    velocity=(0.5, 0.0, 0.0),
    force=(-0.75, 0.0, 0.0),
    account=0.125,
    need=0.0625,
    given=1.5,
    taken=0.5,
)
PORT_CONTACT = replace(PORT, contact_force=(-2.0, 0.0, 0.5), account=-0.25, need=0.0, given=0.0, taken=0.0)
PORT_MODEL = replace(
    PORT_CONTACT,
    wave_integral=(0.25, 0.0, -1.0),
    wave_energy=0.5,
    surface=PortSurface(normal=(0.0, 0.6, 0.8), offset=-0.125, stiffness=500.0),
)
PORT_ALL = replace(
    PORT_MODEL,
    phase=PortPhase.ALIGNING,
    turn=PortTurn(turn=(0.6, 0.0, 0.8, 0.0), angular_velocity=(0.0, 0.25, 0.0), torque=(0.0, -0.5, 0.0)),
    grip=PortGrip(opening=0.0625, velocity=-0.125, force=2.0, account=-0.25, need=0.5, given=0.75, taken=1.25),
    energy_in=3.5,
    share=0.25,
    position_scale=0.5,
    force_scale=2.0,
    of_peer=True,
)
COUPLE = Couple(
    device=1,
    channel=1,
    role=PortRole.FOLLOWER,
    method=CouplingMethod.POSITION_FORCE,
    position_scale=0.5,
    force_scale=2.0,
    rotation=(0.6, 0.0, 0.8, 0.0),
    axes=5,
    stiffness=400.0,
    mutual_damping=2.0,
    damping=4.0,
    adapt_to_delay=True,
    purse=True,
    period_us=1000,
)
COUPLE_ALL = replace(
    COUPLE,
    method=CouplingMethod.RATE,
    absolute=True,
    turn_stiffness=0.5,
    turn_damping=0.0625,
    grip_stiffness=200.0,
    grip_damping=1.5,
    drift_rate=0.25,
    rate=RateControl(dead_zone=0.125, gain=2.5, max_speed=0.75),
)
FRAMES = {
    "port": (71, None, [PORT]),
    "port-contact": (72, None, [PORT_CONTACT]),
    "port-model": (90, None, [PORT_MODEL]),
    "port-all": (91, None, [PORT_ALL]),
    "control-couple-all": (92, None, [Control(20, COUPLE_ALL)]),
    "control-set-scale": (93, None, [Control(21, SetScale(1, 0.25, 4.0))]),
    "control-set-share": (94, None, [Control(22, SetShare(1, 1, 0.75))]),
    "control-couple": (73, None, [Control(15, COUPLE)]),
    "control-engage": (74, None, [Control(16, Engage(1))]),
    "control-disengage": (75, None, [Control(17, Disengage(1))]),
    "control-set-output-lamp": (76, None, [Control(18, SetOutput(1, 0, LampColour(0xFF8000)))]),
    "control-set-output-vibration": (77, None, [Control(19, SetOutput(1, 1, PULSE))]),
    "control-ack-outputs": (78, None, [ControlAck(14, Code.OK, handle=OUTPUTS)]),
    "keep-alive": (0, None, []),
    "state": (42, ECHO, [STATE]),
    "force": (43, ECHO, [FORCE]),
    "force-with-all": (59, None, [FORCE_WITH_ALL]),
    "control": (44, None, [Control(7, SetStateRate(500))]),
    "control-ack": (45, None, [ControlAck(7, Code.OK, "500 Hz")]),
    "bye": (46, None, [Bye(Code.SHUTDOWN, "SIGTERM")]),
    "report": (57, None, [REPORT]),
    "state-wanted": (60, None, [STATE_WANTED]),
    "state-buttons": (64, None, [STATE_BUTTONS]),
    "state-handle": (67, None, [STATE_HANDLE]),
    "state-joints": (69, None, [STATE_JOINTS]),
    "control-ack-joints": (70, None, [ControlAck(14, Code.OK, handle=NAMED_JOINTS)]),
    "force-torque": (68, None, [FORCE_TORQUE]),
    "control-ack-handle": (66, None, [ControlAck(14, Code.OK, handle=HANDLE)]),
    "device-report": (61, None, [DEVICE_REPORT]),
    "peer-report": (62, None, [PEER_REPORT]),
    "peer-report-way": (97, None, [replace(PEER_REPORT, error=0.125, way="near")]),
    "force-way": (96, None, [replace(FORCE, sequence=102, model=None, error=0.125, way=2)]),
    "state-deadband": (58, None, [Control(9, SetStateDeadband(0.1, 0.001, 20_000))]),
}


HANDSHAKE = {"hello", "retry", "welcome", "refused"}


@pytest.mark.parametrize("name", sorted(GOLDEN.keys() - {"state-columns"}))
def test_every_golden_datagram_is_read_and_written_again_to_the_bit(name):
    golden = GOLDEN[name]
    header = codec.decode_header(golden)
    if header.type is DatagramType.DATA:
        content = codec.read_data(golden[codec.HEADER_SIZE :])
        assert content.invalid == 0
        pieces = [codec.write_frame(frame) for frame in content.frames]
        again = codec.encode_header(header) + codec.write_data_head(content.sent_ns, content.echo) + b"".join(pieces)
    elif header.type is DatagramType.HELLO:
        hello = codec.decode_hello(golden)
        body = codec.write_hello(codec.read_hello(hello.body))
        again = codec.encode_hello(HelloDatagram(hello.random, body, hello.cookie))
    elif header.type is DatagramType.RETRY:
        again = codec.encode_retry(codec.decode_retry(golden))
    else:
        answer = codec.decode_answer(golden)
        body = codec.write_answer(codec.read_answer(answer.body))
        again = codec.encode_answer(AnswerDatagram(answer.random, body, answer.connection_id))
    assert again == golden


def test_states_in_columns_are_read_one_by_one_and_not_written():
    third = replace(
        STATE,
        device=2,
        position=(0.03, -0.01, 0.02),
        velocity=(0.0, 0.25, -0.5),
        force_applied=(0.0, 0.0, 0.5),
        energy=0.125,
        permitted_force=inf,
        force_sequence=100,
        mode=Mode.HOLDING,
        buttons=1,
    )
    content = codec.read_data(GOLDEN["state-columns"][codec.HEADER_SIZE :])
    assert content == codec.DataContent(TX_TIME, None, [replace(STATE, channel=1), third], invalid=0)


def test_every_golden_datagram_known_here_is_on_the_page():
    assert set(GOLDEN) >= HANDSHAKE | set(FRAMES)


def test_hello_is_written_and_read_as_the_page_has_it():
    datagram = HelloDatagram(RANDOM, codec.write_hello(HELLO))
    assert codec.encode_hello(datagram) == GOLDEN["hello"]
    assert codec.decode_hello(GOLDEN["hello"]) == datagram
    assert codec.read_hello(datagram.body) == HELLO


def test_retry_is_written_and_read_as_the_page_has_it():
    assert codec.encode_retry(RetryDatagram(RANDOM, COOKIE)) == GOLDEN["retry"]
    assert codec.decode_retry(GOLDEN["retry"]) == RetryDatagram(RANDOM, COOKIE)


@pytest.mark.parametrize("name, answer, connection_id", [("welcome", WELCOME, ID), ("refused", REFUSED, 0)])
def test_answers_are_written_and_read_as_the_page_has_them(name, answer, connection_id):
    datagram = AnswerDatagram(RANDOM, codec.write_answer(answer), connection_id)
    assert codec.encode_answer(datagram) == GOLDEN[name]
    assert codec.decode_answer(GOLDEN[name]) == datagram
    assert codec.read_answer(datagram.body) == answer


@pytest.mark.parametrize("name", FRAMES)
def test_data_is_written_and_read_as_the_page_has_it(name):
    number, echo, frames = FRAMES[name]
    header = Header(DatagramType.DATA, connection_id=ID, packet_number=number)
    body = codec.write_data_head(TX_TIME, echo) + b"".join(map(codec.write_frame, frames))
    assert codec.encode_header(header) + body == GOLDEN[name]

    assert codec.decode_header(GOLDEN[name]) == header
    content = codec.read_data(GOLDEN[name][codec.HEADER_SIZE :])
    assert content == codec.DataContent(TX_TIME, echo, frames, invalid=0)


@pytest.mark.parametrize(
    "at, value",
    [(0, 0x55), (1, 0x23), (1, 0x15), (1, 0x10), (2, 1), (3, 3)],
    ids=["magic", "version", "type", "type 0", "epoch of plain", "suite"],
)
def test_a_header_that_the_page_does_not_know_is_refused(at, value):
    datagram = bytearray(GOLDEN["state"])
    datagram[at] = value
    assert codec.decode_header(bytes(datagram)) is None


def test_a_datagram_of_1200_bytes_is_read_and_none_of_1201():
    assert codec.decode_header(GOLDEN["state"].ljust(1200, b"\0")) is not None
    assert codec.decode_header(GOLDEN["state"].ljust(1201, b"\0")) is None


def out_of_bounds():
    """Yields frames in which one value is out of bounds. The key is the name of the violation."""

    def state(**changes):
        values = {name: getattr(STATE, name) for name in DeviceState.__slots__}
        return DeviceState(**{**values, **changes})

    def force(**changes):
        values = {name: getattr(FORCE, name) for name in ForceCommand.__slots__}
        return ForceCommand(**{**values, **changes})

    def with_all(**changes):
        return force(model=replace(FORCE_WITH_ALL.model, **changes))

    yield "position", state(position=(1.1e12, 0.0, 0.0))
    yield "velocity NaN", state(velocity=(0.0, nan, 0.0))
    yield "force infinite", state(force_applied=(0.0, 0.0, float("-inf")))
    yield "joint not a number", state(joints=Joints((nan,), (0.0,)))
    yield "velocity of a joint infinite", state(joints=Joints((0.0,), (inf,)))
    yield "nine joints", state(joints=Joints((0.0,) * 9, (0.0,) * 8))
    yield "energy NaN", state(energy=nan)
    yield "permitted force negative", state(permitted_force=-1.0)
    yield "permitted force NaN", state(permitted_force=nan)
    yield "sampled", state(sampled_ns=2**60 + 1)
    yield "force age", state(force_age_ns=2**60 + 1)
    yield "mode 0", state(mode=0)
    yield "mode 7", state(mode=7)
    yield "wanted NaN", state(force_wanted=(0.0, nan, 0.0))
    yield "stiffness wanted NaN", state(stiffness_wanted=((nan, 0.0, 0.0), WALL[1], WALL[2]))
    yield "sequence 0", force(sequence=0)
    yield "force NaN", force(force=(nan, 0.0, 0.0))
    yield "valid for nothing", force(valid_for_us=0)
    yield "valid for too long", force(valid_for_us=10_000_001)
    yield "stiffness", force(model=LocalModel((0.0, 0.0, 0.0), ((2e12, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))))
    yield "radius", with_all(valid_radius=-1.0)
    yield "radius NaN", with_all(valid_radius=nan)
    yield "no normal", with_all(contact=Contact((0.0, 0.0, 0.0), 0.0))
    yield "gap", with_all(contact=Contact((1.0, 0.0, 0.0), nan))
    yield "table of one", with_all(contact=Contact((1.0, 0.0, 0.0), 0.0, ForceTable(0.0, 1.0, (1.0,))))
    yield "table of 17", with_all(contact=Contact((1.0, 0.0, 0.0), 0.0, ForceTable(0.0, 1.0, 17 * (1.0,))))
    yield "table without a step", with_all(contact=Contact((1.0, 0.0, 0.0), 0.0, ForceTable(0.0, 0.0, (1.0, 2.0))))
    yield "table NaN", with_all(contact=Contact((1.0, 0.0, 0.0), 0.0, ForceTable(0.0, 1.0, (1.0, nan))))
    yield "error", force(error=-0.1)
    yield "a ninth way", force(way=9)
    yield "device report 0", replace(DEVICE_REPORT, number=0)
    yield "its time", replace(DEVICE_REPORT, until_ns=2**60 + 1)
    yield "its span", replace(DEVICE_REPORT, span_ns=2**60 + 1)
    yield "device 16", replace(DEVICE_REPORT, device=16)
    yield "more late steps than steps", replace(DEVICE_REPORT, steps=986)
    yield "more overruns than steps", replace(DEVICE_REPORT, overruns=991)
    yield "more unseen than steps", replace(DEVICE_REPORT, unseen=991)
    yield "25 buckets", replace(DEVICE_REPORT, lateness=25 * (1,))
    yield "safety 0", replace(DEVICE_REPORT, safety=0)
    yield "safety 9", replace(DEVICE_REPORT, safety=9)
    yield "peer of device 16", replace(PEER_REPORT, device=16)
    yield "channel 8", replace(PEER_REPORT, channel=8)
    yield "one in none", replace(PEER_REPORT, state_one_in=0)
    yield "one in 1001", replace(PEER_REPORT, state_one_in=1001)
    yield "peer report 0", replace(PEER_REPORT, link=replace(REPORT, number=0))
    yield "error of an engine", replace(PEER_REPORT, error=-0.1)
    yield "error of an engine NaN", replace(PEER_REPORT, error=nan)
    yield "port of device 16", replace(PORT, device=16)
    yield "port of channel 8", replace(PORT, channel=8)
    yield "epoch 0", replace(PORT, epoch=0)
    yield "port 0", replace(PORT, sequence=0)
    yield "time of a port", replace(PORT, time_ns=2**60 + 1)
    yield "round trip of more than 10 s", replace(PORT, round_trip_ns=10_000_000_001)
    yield "phase 0", replace(PORT, phase=0)
    yield "phase 8", replace(PORT, phase=8)
    yield "contact NaN", replace(PORT, contact_force=(0.0, nan, 0.0))
    yield "account", replace(PORT, account=-1000.1)
    yield "account NaN", replace(PORT, account=nan)
    yield "need", replace(PORT, need=-0.1)
    yield "given", replace(PORT, given=1e6 + 1)
    yield "taken", replace(PORT, taken=-0.1)
    yield "role 0", Control(1, replace(COUPLE, role=0))
    yield "a turn that is no rotation", replace(PORT, turn=PortTurn((0.602, 0.0, 0.8, 0.0)))
    yield "angular velocity NaN", replace(PORT, turn=PortTurn((0.6, 0.0, 0.8, 0.0), (nan, 0.0, 0.0)))
    yield "torque infinite", replace(PORT, turn=PortTurn((0.6, 0.0, 0.8, 0.0), torque=(0.0, inf, 0.0)))
    yield "opening NaN", replace(PORT, grip=PortGrip(opening=nan))
    yield "velocity of the grip infinite", replace(PORT, grip=PortGrip(velocity=inf))
    yield "grip force", replace(PORT, grip=PortGrip(force=1.1e12))
    yield "account of the grip", replace(PORT, grip=PortGrip(account=1000.1))
    yield "need of the grip", replace(PORT, grip=PortGrip(need=-0.1))
    yield "given by the grip", replace(PORT, grip=PortGrip(given=1e6 + 1))
    yield "taken by the grip", replace(PORT, grip=PortGrip(taken=-0.1))
    yield "energy in", replace(PORT, energy_in=-0.1)
    yield "share below zero", replace(PORT, share=-0.001)
    yield "share above one", replace(PORT, share=1.001)
    yield "a port's scale below a hundredth", replace(PORT, position_scale=0.0099)
    yield "a port's scale above a hundred", replace(PORT, force_scale=100.1)
    yield "a port's scale NaN", replace(PORT, force_scale=nan)
    yield "method 8", Control(1, replace(COUPLE, method=8))
    yield "turn stiffness", Control(1, replace(COUPLE, turn_stiffness=-0.1))
    yield "turn damping", Control(1, replace(COUPLE, turn_damping=inf))
    yield "grip stiffness", Control(1, replace(COUPLE, grip_stiffness=nan))
    yield "grip damping", Control(1, replace(COUPLE, grip_damping=-0.1))
    yield "drift rate", Control(1, replace(COUPLE, drift_rate=1.1e12))
    yield "dead zone", Control(1, replace(COUPLE_ALL, rate=RateControl(-0.1, 1.0, 1.0)))
    yield "no gain", Control(1, replace(COUPLE_ALL, rate=RateControl(0.0, 0.0, 1.0)))
    yield "no speed", Control(1, replace(COUPLE_ALL, rate=RateControl(0.0, 1.0, 0.0)))
    yield "scales of device 16", Control(1, SetScale(16, 1.0, 1.0))
    yield "scale of the moves", Control(1, SetScale(1, 0.0099, 1.0))
    yield "scale of the forces", Control(1, SetScale(1, 1.0, nan))
    yield "share on device 16", Control(1, SetShare(16, 1, 0.5))
    yield "share on channel 8", Control(1, SetShare(1, 8, 0.5))
    yield "share of more than the whole", Control(1, SetShare(1, 1, 1.001))
    yield "a scale below a hundredth", Control(1, replace(COUPLE, position_scale=0.0099))
    yield "a scale above a hundred", Control(1, replace(COUPLE, force_scale=100.1))
    yield "a rotation that is none", Control(1, replace(COUPLE, rotation=(0.602, 0.0, 0.8, 0.0)))
    yield "no axis", Control(1, replace(COUPLE, axes=0))
    yield "a fourth axis", Control(1, replace(COUPLE, axes=8))
    yield "stiffness below zero", Control(1, replace(COUPLE, stiffness=-1.0))
    yield "no period", Control(1, replace(COUPLE, period_us=0))
    yield "engage device 16", Control(1, Engage(16))
    yield "disengage device 16", Control(1, Disengage(16))
    yield "output 8", Control(1, SetOutput(1, 8, LampColour(1)))
    yield "a colour of more than three bytes", Control(1, SetOutput(1, 0, LampColour(0x1000000)))
    yield "amplitude above 1", Control(1, SetOutput(1, 1, replace(PULSE, amplitude=1.01)))
    yield "amplitude below 0", Control(1, SetOutput(1, 1, replace(PULSE, amplitude=-0.01)))
    yield "amplitude NaN", Control(1, SetOutput(1, 1, replace(PULSE, amplitude=nan)))
    yield "a frequency below 20", Control(1, SetOutput(1, 1, replace(PULSE, frequency=19.9)))
    yield "a frequency above 1000", Control(1, SetOutput(1, 1, replace(PULSE, frequency=1001.0)))
    yield "a pulse of more than 10 s", Control(1, SetOutput(1, 1, replace(PULSE, duration_ms=10_001)))
    yield "an output of no kind", ControlAck(1, Code.OK, handle=replace(OUTPUTS, outputs=(OutputDescription("x", 0),)))
    yield "request 0", Control(0, SetStateRate(1))
    yield "answer to 0", ControlAck(0, Code.OK)
    yield "code 0", ControlAck(1, 0)
    yield "unknown code", Bye(99)


@pytest.mark.parametrize("frame", [pytest.param(frame, id=what) for what, frame in out_of_bounds()])
def test_a_value_out_of_bounds_drops_its_frame_and_no_other(frame):
    body = codec.write_data_head(1, None) + codec.write_frame(frame) + codec.write_frame(Bye(Code.OK))
    content = codec.read_data(body)
    assert (content.invalid, content.frames[-1]) == (1, Bye(Code.OK))
    if not isinstance(frame, (Control, ControlAck)) or frame.id == 0:
        assert content.frames[:-1] == []
    elif isinstance(frame, Control):  # a request must be answered
        [control] = content.frames[:-1]
        assert (control.id, control.request, control.invalid != "") == (frame.id, None, True)
    else:
        assert [(ack.id, ack.code, ack.handle) for ack in content.frames[:-1]] == [(frame.id, Code.INVALID, None)]


def test_no_bound_on_the_force_is_infinity():
    values = {name: getattr(STATE, name) for name in DeviceState.__slots__}
    unbounded = DeviceState(**{**values, "permitted_force": float("inf")})
    assert codec.read_data(codec.write_data_head(1, None) + codec.write_frame(unbounded)).frames == [unbounded]


def test_64_frames_are_read_and_65_are_malformed():
    empty = b"\x1a\x00"  # a frame type of a future version
    assert codec.read_data(codec.write_data_head(1, None) + 64 * empty) == codec.DataContent(1, None, [], 0)
    assert codec.read_data(codec.write_data_head(1, None) + 65 * empty) is None


def test_a_tag_whose_lower_32_bits_are_field_0_is_malformed():
    head = codec.write_data_head(1, None)
    assert codec.read_data(head + b"\x80\x80\x80\x80\x10\x00") is None
    assert codec.read_data(head + b"\x80\x00\x00") is None


def test_texts_are_cut_to_their_bounds_at_a_character():
    answer = codec.read_answer(codec.write_answer(Refused(Code.BUSY, 127 * "a" + "ä" + "b")))
    assert answer == Refused(Code.BUSY, 127 * "a")
    hello = codec.read_hello(codec.write_hello(Hello(Role.OBSERVER, "a\ud800b", tuple(20 * ["f" * 40]))))
    assert hello == Hello(Role.OBSERVER, "a", tuple(16 * ["f" * 32]))


def test_a_text_that_is_not_utf_8_makes_the_datagram_malformed():
    assert codec.read_data(GOLDEN["bye"][16:].replace(b"SIGTERM", b"SIG\xffERM")) is None
