# SPDX-License-Identifier: Apache-2.0
"""Tests the orientation, the torque and the gripper of a handle."""

from __future__ import annotations

from dataclasses import replace
from math import acos, cos, inf, nan, sin

import pytest
from stage import Stage
from world import MS, SECOND

from tendon import Config, ForceDeadband, Grip, Mode, Touch, Turning
from tendon.deadband import Deadband, predict
from tendon.messages import ZERO, DeviceState, RotationModel, Torque

TURNING = Turning((0.6, 0.8, 0.0, 0.0), (0.0, 1.0, 0.0))
TORQUE = (0.0, 0.0, 0.1)
TOUCH = Touch((-1, 0, 0), torque=TORQUE, angular_stiffness=0.2, grip_force=-1.5)
STIFFNESS = ((0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2))


def stage(touch: Touch, features: tuple[str, ...], turning: Turning | None = None) -> Stage:
    made = Stage(Config(rate_hz=100))
    made.server.features = features
    made.turning = turning
    made.touch = lambda hand: touch
    made.run(1 * SECOND)
    return made


def test_torque_angular_stiffness_and_grip_force_travel_with_the_force():
    shown = stage(TOUCH, ("handle",), TURNING)
    assert len(shown.forces) > 50
    for force in shown.forces:
        assert force.torque == Torque(TORQUE, RotationModel(TURNING.orientation, STIFFNESS))
        assert force.grip_force == -1.5
        assert force.model is None
    assert {hand.turning for hand in shown.seen} == {TURNING}
    assert shown.client.stats.left_out == ""


@pytest.mark.parametrize("knows", [False, True])
def test_what_cannot_be_sent_is_said_and_the_force_is_sent(knows):
    shown = stage(TOUCH, ("handle",) if knows else ("local-model",))
    assert len(shown.forces) > 50
    for force in shown.forces:
        assert force.torque == (Torque(TORQUE) if knows else None)
        assert force.grip_force == (-1.5 if knows else None)
    assert shown.client.stats.left_out == (
        "angular stiffness: the device does not measure its orientation"
        if knows
        else "torque and grip force: the server does not support them"
    )


@pytest.mark.parametrize(
    "touch, why",
    [
        (Touch(torque=(nan, 0, 0)), "the torque is not finite (NaN or infinity)"),
        (Touch(torque=(0, -2e12, 0)), "the torque exceeds 1e12 N·m"),
        (Touch(angular_stiffness=inf), "its angular stiffness is not finite, or out of the bounds in WIRE.md"),
        (Touch(grip_force=nan), "the grip force is not finite, or exceeds 1e12 N"),
    ],
)
def test_an_answer_that_is_not_usable_is_not_sent(touch, why):
    shown = stage(touch, ("handle",), TURNING)
    assert shown.forces == []
    assert shown.client.stats.unusable == why


def test_a_deadband_leaves_out_no_torque_that_a_hand_can_tell():
    deadband, now = Deadband(ForceDeadband()), iter(range(0, 19 * MS, MS))

    def passes(x, torque=None, grip=None):
        return deadband.passes(next(now), (x, 0.0, 0.0), None if torque is None else (0.0, torque, 0.0), grip)

    assert [passes(1), passes(1, 0.001), passes(1.09, 0.003), passes(1, 0.004)] == [True, True, False, True]
    assert [passes(1, 0.004, 0), passes(1, 0.004, 0.04), passes(1, 0.004, 0.06)] == [True, False, True]
    assert [passes(1, None, 0.06), passes(1, None, 0.06)] == [True, False]


def test_a_state_is_predicted_with_the_velocities_of_rotation_and_gripper():
    sent = DeviceState(100, 0, ZERO, ZERO, ZERO, 0.0, inf, 0, 0, 0, Mode.ACTIVE)
    sent = replace(sent, turning=Turning((1.0009, 0.0, 0.0, 0.0), (0.0, 0.0, 2.0)), grip=Grip(0.5, -3.0))
    later = predict(sent, 10 * MS, MS)
    assert later.turning.orientation == pytest.approx((cos(0.01), 0, 0, sin(0.01)), abs=1e-12)
    assert later.turning.angular_velocity == sent.turning.angular_velocity
    assert later.grip == Grip(pytest.approx(0.47), -3.0)
    assert predict(sent, 0, MS).turning == sent.turning
    about = Turning((0.6, 0.0, 0.8, 0.0), (0.0, 2.0, 0.0))
    turned = predict(replace(sent, turning=about), 10 * MS, MS).turning.orientation
    assert turned[0] == pytest.approx(cos(acos(0.6) + 0.01), abs=1e-12)  # the angle grows
