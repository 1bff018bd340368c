# SPDX-License-Identifier: Apache-2.0
"""Tests the upload and the use of fields, with the cases of tests/protocol/field/field_upload_test.cc."""

from __future__ import annotations

import random
from dataclasses import replace
from hashlib import blake2b

import pytest
from field_server import FieldStage
from world import MS, SECOND, Weather, World

from tendon import Code, DepthTable, DeviceState, Field, FieldState, Mode, Phase, Sphere, Touch
from tendon.field import Brick, Lattice
from tendon.messages import FieldPose, FieldStatus
from tendon.session import Session
from tendon.upload import BrickPace, FieldSender, Motion

FAR = Weather(95 * MS, 10 * MS, loss=0.05, duplicate=0.05)
CALM = Weather(100 * MS, 0, loss=0, duplicate=0)
AT_REST = Motion((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def brick(place, weights):
    return Brick(place, weights, blake2b(weights, digest_size=16).digest())


def random_field(count, seed):
    dice = random.Random(seed)
    places = [(n % 16, n // 16 % 8, n // 128) for n in range(count)]
    return Field(Lattice((0.0, 0.0, 0.0), 1e-3, (16, 8, 8)), [brick(place, dice.randbytes(1024)) for place in places])


def stored(store, field):
    return all(store.get(one.hash) == one.weights for one in field.bricks)


def uploaded(field, store, weather=CALM, seed=1):
    stage = FieldStage(store, weather, seed)
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: stage.rendered)
    return stage


# ---- The upload ----


@pytest.mark.parametrize("seed", range(3))
def test_a_field_is_ready_in_time_over_a_bad_network(seed):
    """1023 bricks are ready within 3.5 s in C++. The rate is the same, so 200 bricks need 0.4 s and three round trips."""
    field, store = random_field(200, 1), {}
    stage = uploaded(field, store, FAR, seed)
    assert stored(store, field)
    assert stage.used_at[0] - World.START < 2 * SECOND
    assert stage.client.fields._sender.sent < 1.25 * 200


def test_the_rate_is_that_of_the_config_and_no_brick_is_repeated_in_vain():
    field, store = random_field(300, 2), {}
    stage = uploaded(field, store)
    assert stage.bricks == stage.client.fields._sender.sent == 300
    assert stage.used_at[0] - World.START >= (300 - 17) * 1024 / 500e3 * SECOND, "17 bricks are one burst"


def test_a_restarted_engine_sends_nothing():
    field, store = random_field(100, 3), {}
    uploaded(field, store, FAR)
    again = uploaded(field, store, FAR, seed=2)
    assert (again.bricks, len(again.uses)) == (0, 1)


def test_an_engine_killed_half_way_sends_the_rest():
    field, store = random_field(200, 4), {}
    killed = FieldStage(store, CALM)
    killed.client.fields.use(field.describe())
    assert killed.run_until(lambda: len(store) >= 100)
    there = len(store)
    assert there < 200
    assert uploaded(field, store, seed=2).bricks == 200 - there
    assert stored(store, field)


def test_a_cut_sends_its_bricks_only():
    field, store = random_field(100, 5), {}
    stage = uploaded(field, store)
    whole = field.describe().name
    cut = [brick(one.place, bytes([one.weights[0] ^ 1]) + one.weights[1:]) for one in field.bricks[20:27]]
    field = Field(field.lattice, field.bricks[:20] + cut + field.bricks[27:-1])
    before = stage.bricks
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: stage.rendered == 2)
    assert stage.bricks - before == 7
    assert stored(store, field)
    assert stage.drops == []
    stage.run(500 * MS)
    assert stage.drops == [whole], "when the server has accepted the new one"


def test_a_server_that_has_forgotten_the_offer_is_offered_it_again():
    field, store = random_field(20, 6), {}
    stage = FieldStage(store, CALM)
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: len(store) >= 5)
    stage.receiver.offers.clear()
    assert stage.run_until(lambda: stage.rendered, 4 * SECOND)
    assert stored(store, field)


def test_a_brick_that_the_server_has_given_up_is_sent_again():
    field, store = random_field(20, 7), {}
    stage = uploaded(field, store)
    del store[field.bricks[3].hash]
    assert stage.run_until(lambda: len(store) == 20, 3 * SECOND)
    assert stage.bricks == 21


def test_a_lost_brick_is_sent_before_new_ones_and_one_on_its_way_is_not():
    told = random_field(4, 8).describe()
    sender = FieldSender(told, bytes_per_s=1e9)
    while sender.next_part(0):
        sender.part_sent()
    assert sender.next_brick(0) is None, "before a status"
    all_missing = FieldStatus(told.name, b"\x0f")
    assert sender.take(10 * MS, all_missing, 20 * MS)
    assert [sender.next_brick(10 * MS), sender.next_brick(12 * MS)] == list(told.bricks[:2])
    assert sender.take(40 * MS, all_missing, 20 * MS), "sent 30 and 28 ms ago; the round trip with its margin is 32.5 ms"
    assert sender.next_brick(40 * MS) == told.bricks[2]
    assert sender.take(43 * MS, all_missing, 20 * MS)
    assert [sender.next_brick(43 * MS), sender.next_brick(44 * MS)] == [told.bricks[0], told.bricks[3]]
    assert not sender.take(50 * MS, FieldStatus(bytes(32), b""), 20 * MS), "of another field"
    assert not sender.complete
    assert sender.take(50 * MS, FieldStatus(told.name, b""), 20 * MS)
    assert sender.complete and sender.next_brick(2 * SECOND) is None and sender.due() > 1e30


def test_a_config_that_cannot_work_is_refused():
    told = random_field(1, 1).describe()
    with pytest.raises(ValueError, match="bytes_per_s = 0"):
        FieldSender(told, bytes_per_s=0)
    with pytest.raises(ValueError, match="burst_ns = -1"):
        BrickPace(1e6, -1)
    with pytest.raises(ValueError, match="silence_ns = 0"):
        FieldSender(told, silence_ns=0)


# ---- The use ----


def test_a_field_is_used_with_its_materials_which_can_be_changed():
    field, store = random_field(3, 1), {}
    field.material("steel", stiffness=1500, friction=0.3, table=DepthTable(0.001, [-0.5]))
    field.fixture("point", (0, 0, 0.01), 200, most_force=2)
    stage = uploaded(field, store)
    field.material("steel", stiffness=700)
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: stage.rendered == 2)
    first, second = stage.uses
    assert (first.device, first.channel, first.generation, first.field) == (0, 0, 1, field.describe().name)
    assert [use.materials[0].stiffness for use in stage.uses] == [1500, 700]
    assert [use.fixtures[0].most_force for use in stage.uses] == [2, 2]
    assert [len(use.tables) for use in stage.uses] == [1, 0] and first.tables[0].force == (-0.5,)
    assert (second.generation, second.field, stage.bricks, stage.drops) == (2, first.field, 3, [])


def test_a_field_of_primitives_needs_no_bricks():
    stage = uploaded(Field.from_primitives(Sphere((0, 0, 0), 0.01)), {})
    assert (stage.bricks, stage.rendered) == (0, 1)


def test_a_new_session_offers_and_uses_the_field_again():
    field, store = random_field(10, 2), {}
    stage = uploaded(field, store)
    stage.server.session.close(Code.SHUTDOWN, "restart")
    assert stage.run_until(lambda: len(stage.uses) == 2)
    assert stage.client.stats.sessions == 2
    assert (stage.bricks, stage.uses[1].generation) == (10, 1)


def test_a_field_that_is_given_up_before_its_use_is_dropped_at_once():
    stage = uploaded(random_field(3, 1), {})
    fields = [random_field(40, seed) for seed in range(2, 6)]
    for field in fields:
        stage.client.fields.use(field.describe())
        stage.run(50 * MS)
        assert len(stage.receiver.offers) <= 3
    assert stage.run_until(lambda: stage.rendered == 2)
    stage.run(500 * MS)
    assert list(stage.receiver.offers) == [fields[-1].describe().name]


def test_no_field_stops_the_one_in_use():
    field = random_field(3, 3)
    stage = uploaded(field, {})
    stage.client.fields.use(None)
    assert stage.run_until(lambda: stage.drops)
    assert stage.drops == [field.describe().name]


def test_a_refused_field_is_named_and_not_sent_again():
    stage = FieldStage({}, CALM)
    stage.refusals = [(Code.INVALID, "field 0a1b2c3d…: stiffness = 2000: expected at most 1500 N/m")]
    field = random_field(3, 4)
    stage.client.fields.use(field.describe())
    stage.run(3 * SECOND)
    assert len(stage.uses) == 1
    assert stage.client.fields.refused == "field 0a1b2c3d…: stiffness = 2000: expected at most 1500 N/m"
    field.material("softer", stiffness=1000)
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: stage.rendered == 2)
    assert stage.client.fields.refused == ""


def test_a_refused_offer_ends_the_upload():
    stage = FieldStage({}, CALM)
    stage.refused_parts = (Code.BUSY, "offers = 4: expected at most 3")
    stage.client.fields.use(random_field(3, 4).describe())
    stage.run(5 * SECOND)
    assert stage.client.fields.refused == "offers = 4: expected at most 3"
    assert (stage.bricks, stage.uses) == (0, [])


def test_a_busy_server_is_asked_again():
    stage = FieldStage({}, CALM)
    stage.refusals = [(Code.BUSY, "")] * 2
    stage.client.fields.use(random_field(3, 5).describe())
    assert stage.run_until(lambda: stage.rendered)
    assert [use.generation for use in stage.uses] == [1, 2, 3]
    assert all(b - a >= 250 * MS for a, b in zip(stage.used_at, stage.used_at[1:])), "a round trip and 50 ms"


def test_bricks_that_are_missing_at_the_use_are_sent_again():
    field, store = random_field(3, 6), {}
    stage = FieldStage(store, CALM)
    stage.refusals = [(Code.INVALID, "brick 0a1b2c3d… is missing")]
    stage.client.fields.use(field.describe())
    assert stage.run_until(lambda: stage.uses)
    del store[field.bricks[1].hash]
    assert stage.run_until(lambda: stage.client.fields.refused)
    assert stage.run_until(lambda: stage.rendered == 2, 3 * SECOND)
    assert (stage.bricks, stage.client.fields.refused) == (4, "")


def test_a_refusal_of_the_previous_field_does_not_stop_the_next_one():
    stage = FieldStage({}, CALM)
    assert stage.run_until(lambda: stage.seen)
    stage.refused_parts = (Code.INVALID, "too many bricks")
    stage.client.fields.use(random_field(3, 7).describe())
    stage.run(150 * MS)
    stage.refused_parts = None
    stage.client.fields.use(random_field(3, 8).describe())
    assert stage.run_until(lambda: stage.rendered or stage.client.fields.refused, 3 * SECOND)
    assert stage.client.fields.refused == ""


def test_a_field_is_used_again_after_the_lease_was_lost():
    stage = uploaded(random_field(3, 6), {})
    stage.snatch = True
    assert stage.run_until(lambda: not stage.client.holds)
    stage.run(1 * SECOND)
    assert len(stage.uses) == 1, "not without the lease"
    assert stage.client.take_lease()
    assert stage.run_until(lambda: len(stage.uses) == 2)
    assert stage.uses[1].generation == 2


def test_an_old_server_is_told_to_the_user():
    stage = FieldStage({}, CALM, features=("local-model",))
    stage.client.fields.use(random_field(3, 7).describe())
    stage.run(1 * SECOND)
    assert stage.client.fields.refused == "the server does not support fields"
    assert stage.client.phase is Phase.OPEN and stage.bricks == 0
    assert not stage.client.fields.move(stage.world.now, AT_REST, 0)


# ---- Poses and truths ----


def test_an_older_pose_or_status_is_counted_and_dropped():
    client, server = Session(1, 0), Session(1, 0)
    datagrams = []
    for sequence in (1, 2):
        zero = (0.0, 0.0, 0.0)
        client.send(FieldPose(0, 0, sequence, 0, (0.1 * sequence, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), zero, zero))
        client.send(FieldStatus(bytes(32), bytes([sequence])))
        datagrams.append(client.next_datagram(sequence))
    for datagram in reversed(datagrams):
        server.receive(3, datagram)
    arrived = [event for event in iter(server.next_event, None)]
    assert [event.position[0] for event in arrived if isinstance(event, FieldPose)] == [0.2]
    assert [event.missing for event in arrived if isinstance(event, FieldStatus)] == [b"\2"]
    assert server.stats.stale == 2


def test_poses_are_for_the_clock_of_the_server_and_at_most_250_per_second():
    stage = uploaded(random_field(1, 8), {}, Weather(100 * MS, 0, loss=0, duplicate=0))
    sent = []

    def move(_):
        x = len(sent) / 1000
        moved = replace(AT_REST, position=(x, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
        assert stage.client.fields.move(stage.world.now, moved, 300 * MS)
        sent.append((stage.world.at_z + 300 * MS, x))

    stage.poses.clear()
    for _ in range(500):
        move(None)
        stage.run(1 * MS)
    stage.run(300 * MS)
    assert 120 <= len(stage.poses) <= 127
    assert [pose.sequence for pose in stage.poses] == list(range(1, len(stage.poses) + 1))
    last = stage.poses[-1]
    assert (last.device, last.channel, last.orientation, last.velocity) == (0, 0, (1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert last.position[0] == sent[-1][1], "the newest pose is not left out"
    times = dict((x, time) for time, x in sent)
    assert all(abs(pose.time_ns - times[pose.position[0]]) < 2 * MS for pose in stage.poses)


@pytest.mark.parametrize("change, said", [
    ({"position": (11.0, 0.0, 0.0)}, r"pose.position = 11.0: expected at most 10 m"),
    ({"position": (float("nan"), 0.0, 0.0)}, r"pose.position = nan"),
    ({"velocity": (0.0, 11.0, 0.0)}, r"pose.velocity = 11.0: expected at most 10 m/s"),
    ({"angular_velocity": (0.0, 0.0, 101.0)}, r"pose.angular_velocity = 101.0: expected at most 100 rad/s"),
    ({"turn": (1.0, 1.0, 0.0, 0.0)}, r"pose.turn = .*: expected a quaternion"),
])  # fmt: skip
def test_a_pose_out_of_bounds_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        replace(AT_REST, **change)


def test_a_truth_names_the_field_that_was_rendered_in_its_state():
    stage = uploaded(random_field(1, 9), {})
    answered = []

    def tell(hand: DeviceState):
        answered.append((hand.tick, stage.client.truth(hand, Touch((1.0, 2.0, 3.0))), hand.field))

    stage.each_state = tell
    stage.forces.clear()
    stage.run(1 * SECOND)
    told = [tick for tick, sent, _ in answered if sent]
    assert len(told) > 20
    assert all(sent == (field is not None) for _, sent, field in answered)
    assert [force.based_on_tick for force in stage.forces] == told[: len(stage.forces)]
    assert {(force.field, force.force, force.model) for force in stage.forces} == {(1, (1.0, 2.0, 3.0), None)}


def test_a_truth_without_a_field_or_with_nan_is_not_sent():
    stage = FieldStage({}, CALM)
    assert stage.run_until(lambda: stage.seen)
    hand = stage.seen[-1]
    assert not stage.client.truth(hand, Touch((1.0, 0.0, 0.0)))
    assert not stage.client.truth(replace(hand, field=FieldState(1)), Touch((float("nan"), 0.0, 0.0)))
    assert stage.client.stats.forces_unusable == 1
    zero = (0.0, 0.0, 0.0)
    unseen = DeviceState(10**9, 0, zero, zero, zero, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE, field=FieldState(1))
    assert not stage.client.truth(unseen, Touch(zero))
    stage.run(500 * MS)
    assert stage.forces == []
