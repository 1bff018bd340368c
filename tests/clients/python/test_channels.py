# SPDX-License-Identifier: Apache-2.0
"""Tests the devices, channels and leases of a client."""

from __future__ import annotations

from math import inf, nan

import pytest
from stage import DESCRIPTION, HANDLE, KEPT, Stage
from world import MS, SECOND

from tendon import Code, Config, LampColour, Phase, Role, Touch, Vibration
from tendon.messages import (
    Claim,
    Describe,
    Disarm,
    Disengage,
    Engage,
    GiveLease,
    Grant,
    LeaseLost,
    Rearm,
    SetOutput,
    SetScale,
    SetShare,
    SetStateRate,
    TakeLease,
)

OURS = Grant(Role.CONTROLLER, 1, 2)
ANOTHERS = Grant(Role.OBSERVER, 1, 2)  # another client holds the channel


def named(grant: Grant = OURS, **changes) -> Stage:
    """Returns a client that claims a device and a channel and receives `grant`."""
    stage = Stage(Config(**{"device": "right", "channel": "tool", **changes}))
    stage.server.grants = (grant,)
    return stage


def leases(stage: Stage) -> list[int]:
    """Returns the times at which the client asked for the lease."""
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
    assert hello.features == ("local-model", "channels", "handle")


def test_joints_are_asked_for_by_those_who_want_them():
    stage = Stage(Config(joints=True))
    stage.run(100 * MS)
    assert stage.server.hellos[0].features == ("local-model", "channels", "handle", "joints")


def test_outputs_are_set_by_those_who_asked_for_them():
    stage = named(outputs=True)
    stage.server.features = ("local-model", "outputs")
    stage.run(100 * MS)
    assert "outputs" in stage.server.hellos[0].features
    client = stage.client
    wanted = [(1, LampColour(0xFF)), (2, Vibration(0.5, 200.0, 40))]
    assert all(client.set_output(*one) for one in wanted)
    stage.run(100 * MS)
    sent = [control.request for control in stage.requests if isinstance(control.request, SetOutput)]
    assert sent == [SetOutput(1, *one) for one in wanted]
    for output, setting in [(8, LampColour(1)), (0, LampColour(0x1000000)), (0, Vibration(1.5)), (0, Vibration(1.0, 10.0))]:
        with pytest.raises(ValueError, match="set_output"):
            client.set_output(output, setting)
    plain = named()
    plain.run(100 * MS)
    assert not plain.client.set_output(0, LampColour(1)), "it did not ask for outputs"


def test_scales_and_shares_are_asked_for_within_their_bounds():
    stage = named()
    client = stage.client
    assert not client.set_scale(1, 1) and not client.set_share(0, 0), "there is no session to ask in"
    stage.run(100 * MS)
    assert client.set_scale(0.01, 100.0) and client.set_share(7, 0.0) and client.set_share(0, 1.0)
    stage.run(100 * MS)
    sent = [control.request for control in stage.requests if isinstance(control.request, (SetScale, SetShare))]
    assert sent == [SetScale(1, 0.01, 100.0), SetShare(1, 7, 0.0), SetShare(1, 0, 1.0)]
    for scales in [(0.0099, 1.0), (1.0, 100.1), (nan, 1.0)]:
        with pytest.raises(ValueError, match="set_scale"):
            client.set_scale(*scales)
    for share in [(8, 0.5), (-1, 0.5), (0, -0.001), (0, 1.001), (0, nan)]:
        with pytest.raises(ValueError, match="set_share"):
            client.set_share(*share)


def test_forces_orders_leases_and_rates_name_the_granted_place():
    stage = named(state_hz=250)
    stage.run(100 * MS)
    client = stage.client
    for ask in (client.rearm, client.disarm, client.engage, client.disengage, client.take_lease, client.give_lease):
        assert ask()
    stage.run(100 * MS)
    asked = [control.request for control in stage.requests]
    orders = [Rearm(1), Disarm(1), Engage(1), Disengage(1)]
    assert asked == [Describe(1), SetStateRate(250, 1), *orders, TakeLease(1, 2), GiveLease(1, 2)]
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
    assert stats.reason == "this server has one device with one channel: omit their names"
    assert stage.seen == []


def test_the_description_of_a_named_device_is_that_of_the_session():
    stage = named()
    assert stage.client.description is None
    stage.run(100 * MS)
    assert stage.client.description == DESCRIPTION
    stage.grant = Code.UNSUPPORTED
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(400 * MS)
    assert stage.client.phase is Phase.OPEN
    assert stage.client.description is None


def test_the_handle_is_described_where_the_server_knows_that_feature():
    for features, known in ((("local-model", "handle"), HANDLE), (("local-model",), None)):
        stage = Stage(Config())
        stage.server.features = features
        stage.run(100 * MS)
        assert stage.client.handle == known
        assert [control.request for control in stage.requests] == ([Describe(0, handle=True)] if known else [])
        assert stage.client.description is None
        stage.grant = Code.UNSUPPORTED
        stage.server.session.close(Code.SHUTDOWN, "")
        stage.run(400 * MS)
        assert (stage.client.phase, stage.client.handle) == (Phase.OPEN, None)


def test_no_state_is_handed_out_while_another_holds_the_channel():
    stage = named(ANOTHERS)
    stage.run(400 * MS)
    stats = stage.client.stats
    assert (stage.seen, stage.forces, leases(stage)) == ([], [], [])
    assert stats.phase is Phase.OPEN and stats.states > 350
    assert not stage.client.holds and stage.client.next_state_due() == inf
    assert stage.client.take_lease()
    stage.run(100 * MS)
    assert stage.client.holds
    assert len(stage.seen) > 90 and len(stage.forces) > 90
    assert len(leases(stage)) == 1


def test_predicted_states_wait_for_the_lease_too():
    stage = named(ANOTHERS, rate_hz=500, state_deadband=KEPT)
    stage.run(500 * MS)
    assert (stage.seen, stage.client.stats.states_predicted) == ([], 0)


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
    once.run(400 * MS)
    assert len(leases(once)) == 1
    denied = named(ANOTHERS, take_lease=True)
    denied.grant = Code.DENIED
    denied.run(400 * MS)
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
    stage.client.send(seen[-1], Touch((1, 0, 0)))  # like an engine that was still computing
    stage.run(400 * MS)
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
    assert (answer.code, answer.detail) == (Code.UNSUPPORTED, "only a client can send this request")


def test_a_lease_given_up_does_not_come_back_by_an_older_answer():
    stage = named(take_lease=True)
    stage.run(100 * MS)
    assert stage.client.take_lease(), "ours already: the server says OK"
    assert stage.client.give_lease()
    seen = list(stage.seen)
    stage.run(400 * MS)
    assert not stage.client.holds
    assert stage.seen == seen
    assert len(leases(stage)) == 1


@pytest.mark.parametrize("once_more", [Code.BUSY, Code.OK])
def test_a_lease_won_and_lost_before_either_is_heard_is_lost(once_more):
    stage = named(ANOTHERS)
    stage.run(100 * MS)
    stage.lease_answers, stage.snatches = [Code.OK, once_more], 1
    assert stage.client.take_lease()
    stage.run(400 * MS)
    ours = once_more is Code.OK
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (ours, "" if ours else "another")
    assert len(leases(stage)) == 2, "it has asked again, once"


def test_a_server_that_knows_no_leases_leaves_it_the_channel_that_it_has():
    stage = Stage(Config())
    stage.run(100 * MS)
    stage.grant = Code.UNSUPPORTED
    assert stage.client.take_lease()
    stage.run(400 * MS)
    assert stage.client.holds and len(stage.forces) > 450


def test_who_waits_for_a_lease_and_gives_it_up_asks_no_more():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(200 * MS)
    asked = len(leases(stage))
    assert stage.client.give_lease()
    stage.run(400 * MS)
    assert len(leases(stage)) == asked


def test_a_turn_is_due_when_the_lease_is_to_be_asked_for_again():
    stage = named(ANOTHERS, take_lease=True)
    stage.grant = Code.BUSY
    stage.run(30 * MS)
    stage.client.rearm()  # this delays the keep-alive
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
    stage.run(400 * MS)
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
    stage.run(400 * MS)
    assert (stage.client.holds, stage.client.stats.lease_lost_to) == (True, "")
    assert (stage.forces[-1].device, stage.forces[-1].channel) == (0, 1)
    asked = len(stage.requests)
    stage.run(400 * MS)
    assert len(stage.requests) == asked


def test_without_a_session_no_lease_is_held_asked_for_or_given():
    stage = named()
    assert not (stage.client.holds or stage.client.take_lease() or stage.client.give_lease())
    stage.run(100 * MS)
    stage.server.session.close(Code.SHUTDOWN, "")
    stage.run(50 * MS)
    assert stage.client.phase is Phase.LOST
    assert not (stage.client.holds or stage.client.take_lease() or stage.client.give_lease())
