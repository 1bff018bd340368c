# SPDX-License-Identifier: Apache-2.0
"""Checks a demonstration file byte by byte. tests/clients/dataset makes a dataset of the same file."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tendon import DeviceState, Mode
from tendon.demonstration import Demonstration
from tendon.messages import ZERO
from tendon.teleop import Follower, FollowerConfig, Pose, ToolContact

WRITTEN = Path(__file__).resolve().parents[1] / "demonstration.jsonl"


def hand(tick: int, x: float, buttons: int) -> DeviceState:
    return DeviceState(tick, tick * 10_000_000, (x, 0.0, 0.0), ZERO, ZERO, 0.0, math.inf, 0, 0, 0, Mode(2), buttons=buttons)


def write(path: Path) -> None:
    """Writes 3 s at 100 Hz. The phase is engaged from 0.5 s to 1.5 s, clutched until 2 s, and engaged until the end.
    The tool is always at its target.
    """
    follow = Follower(FollowerConfig(scale=0.5, clutch_button=0, rate_hz=100))
    tool = [0.25, 0.0, 0.125]
    with Demonstration(path) as demonstration:
        for tick in range(1, 301):
            held = 40 < tick <= 50 or 150 < tick <= 200
            state = hand(tick, tick / 4096, 1 if held else 0)
            pose = Pose(list(tool))
            target = follow.target(state, pose, state.sampled_ns + 5_000_000)
            contact = ToolContact((0.0, 0.0, tick / 64))
            demonstration.add(state, pose, target, follow.phase, contact)
            tool[:] = tool if target is None else target.position


def test_every_state_becomes_a_line(tmp_path: Path) -> None:
    path = tmp_path / "press.jsonl"
    write(path)
    assert path.read_text() == WRITTEN.read_text()


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "press.jsonl"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        Demonstration(path)
    assert path.read_text() == "mine"


def test_what_is_not_finite_or_not_measured_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "press.jsonl"
    follow = Follower(FollowerConfig(engage_by="call"))
    with Demonstration(path) as demonstration:
        demonstration.add(hand(1, 0.0, 0), Pose((math.nan, 0.0, 0.0)), None, follow.phase)
        demonstration.add(hand(2, 0.0, 0), Pose((1.0, 0.0, 0.0)), None, follow.phase)
    _, line = path.read_text().splitlines()
    assert line == '{"tick":2,"sampled_ns":20000000,"phase":"alone","position_m":[1.0,0.0,0.0],"target_m":null}'


def test_what_a_robot_with_six_axes_and_a_gripper_adds(tmp_path: Path) -> None:
    path = tmp_path / "press.jsonl"
    follow = Follower(FollowerConfig(engage_by="call"))
    pose, target = Pose((1, 0, 0), (1, 0, 0, 0), 0.5), Pose((2, 0, 0), (0, 1, 0, 0), 0.25)
    with Demonstration(path) as demonstration:
        demonstration.add(hand(1, 0.0, 0), pose._replace(grip=math.nan), target, follow.phase)
        demonstration.add(hand(2, 0.0, 0), pose, target, follow.phase, ToolContact((0, 0, 1), (0, 1, 0)), "policy")
    _, line = path.read_text().splitlines()
    assert line == (
        '{"tick":2,"sampled_ns":20000000,"phase":"alone","position_m":[1.0,0.0,0.0],"target_m":[2.0,0.0,0.0],'
        '"contact_n":[0.0,0.0,1.0],"contact_nm":[0.0,1.0,0.0],"orientation":[1.0,0.0,0.0,0.0],"grip":0.5,'
        '"target_orientation":[0.0,1.0,0.0,0.0],"target_grip":0.25,"sender":"policy"}'
    )
