# SPDX-License-Identifier: Apache-2.0
"""Runs the cases in tests/clients/follower_cases.json. The C++ and TypeScript clients run the same cases."""

from __future__ import annotations

import json
import logging
import math
from pathlib import Path
from typing import Any

import pytest

from tendon import Client, Config, DeviceState, Grip, Mode, Turning
from tendon.messages import ZERO
from tendon.teleop import Follower, FollowerConfig, Pose, ToolContact

SUITE = json.loads((Path(__file__).resolve().parents[1] / "follower_cases.json").read_text())


def config(given: dict[str, Any]) -> FollowerConfig:
    return FollowerConfig(**{k: math.nan if v == "nan" else tuple(v) if isinstance(v, list) else v for k, v in given.items()})


def near(value: Any, expected: Any) -> None:
    assert value == pytest.approx(expected, abs=1e-9)


def pose_of(now: dict[str, Any]) -> Pose:
    return Pose([float(x) for x in now["pose"]], now.get("turned"), now.get("grip"))


def hand_of(now: dict[str, Any], step: dict[str, Any]) -> DeviceState:
    sampled = step.get("sampled", now["at"] - 50)
    turning = Turning(tuple(now["turn"])) if "turn" in now else None
    grip = Grip(now["opening"]) if "opening" in now else None
    return DeviceState(
        step.get("tick", sampled + 1000), sampled * 1_000_000, tuple(now["hand"]), ZERO, ZERO, 0.0, math.inf,
        now.get("reasons", 0), 0, 0, Mode(now.get("mode", 2)), buttons=now.get("buttons", 0), turning=turning, grip=grip,
    )  # fmt: skip


def check(follow: Follower, step: dict[str, Any], now: dict[str, Any]) -> None:
    if "set_scale" in step:
        assert follow.set_scale(*step["set_scale"]) == step["changed"]
    if "engage" in step:
        follow.engage()
    at = now["at"] * 1_000_000
    target = follow.silence(at) if "silence" in step else follow.target(hand_of(now, step), pose_of(now), at)
    assert follow.phase == step["phase"]
    if step["target"] is None:
        assert target is None
    else:
        assert target is not None
        near(target.position, step["target"])
        if "target_turned" in step:
            near(target.orientation, step["target_turned"])
        if "target_grip" in step:
            near(target.grip, step["target_grip"])
    if "touch" in step:
        given = step["touch"]
        check_felt(follow.touch(None if given is None else ToolContact(**given)), step["feels"])
    if "words" in step:
        assert follow.words == step["words"]


def check_felt(touch: Any, feels: dict[str, Any] | None) -> None:
    if feels is None:
        assert touch is None
        return
    near(touch.force, feels["force"])
    assert (touch.stiffness is None) == ("stiffness" not in feels)
    for row, expected in zip(touch.stiffness or (), feels.get("stiffness", ())):
        near(row, expected)
    assert (touch.contact is None) == ("gap" not in feels)
    if touch.contact:
        near(touch.contact.normal, feels["normal"])
        near(touch.contact.gap, feels["gap"])
    assert (touch.torque is None) == ("torque" not in feels)
    if touch.torque is not None:
        near(touch.torque, feels["torque"])
    near(touch.grip_force or 0.0, feels.get("grip_force", 0.0))


@pytest.mark.parametrize("case", SUITE["cases"], ids=lambda case: case["name"])
def test_the_follower_answers_as_the_shared_cases_say(case):
    follow, now = Follower(config(case["config"])), {}
    for step in case["steps"]:
        now.update(step)
        check(follow, step, now)


@pytest.mark.parametrize("case", SUITE["refused"], ids=lambda case: case["what"])
def test_an_impossible_config_is_refused_with_the_field(case):
    with pytest.raises(ValueError) as refusal:
        config(case["config"])
    assert str(refusal.value) == case["what"]


def test_an_impossible_scale_is_refused():
    with pytest.raises(ValueError, match="scale = 1000: expected 0.01 to 100"):
        Follower(FollowerConfig(engage_by="call")).set_scale(1000, 1)


def test_engaging_before_the_first_state_is_refused():
    assert not Follower(FollowerConfig(engage_by="call")).engage()


def test_that_nothing_is_measured_is_logged_once(caplog):
    follow = Follower(FollowerConfig(engage_by="call"))
    with caplog.at_level(logging.WARNING, "tendon"):
        assert [follow.touch(None) for _ in range(3)] == [None, None, None]
    assert caplog.messages == ["the robot measures no contact force: the hand feels nothing"]


def test_drive_calls_on_silence_while_no_server_answers():
    heard: list[int] = []
    with Client("127.0.0.1:9", Config(name="robot")) as client:
        client.drive(lambda hand: None, 0.2, heard.append, silence_s=0.02)
    assert 3 <= len(heard) <= 10
    assert all(later - sooner >= 19_000_000 for sooner, later in zip(heard, heard[1:]))


def test_a_silence_of_no_length_is_refused():
    with Client("127.0.0.1:9") as client, pytest.raises(ValueError, match="silence_s = 0: expected 0.001 to 10"):
        client.drive(lambda hand: None, 0.1, print, silence_s=0)
