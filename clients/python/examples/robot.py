#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Let a simulated robot follow the hand at half scale and touch a table. Button 0 engages it, and is its clutch."""
import sys
import time

from tendon import DeviceState, Touch, cli
from tendon.teleop import Follower, FollowerConfig, Pose, ToolContact

options = cli.parser("robot", __doc__, rate_hz=200).parse_args()
UP = (0.5**0.5, 0.5**0.5, 0, 0)  # y of the device points up, as z of the robot does
follow = Follower(FollowerConfig(scale=0.5, rotation=UP, clutch_button=0, rate_hz=options.rate_hz or 1000))
tool = [0.4, 0.0, 0.02]  # m: your robot's pose, motion and force sensor go into these three places


def move(target: Pose | None) -> None:
    tool[:] = tool if target is None else target.position  # None: the robot holds its pose


def step(hand: DeviceState) -> Touch | None:
    before = follow.phase
    move(follow.target(hand, Pose(list(tool)), time.monotonic_ns()))
    if follow.phase != before:
        print(follow.phase.name.lower(), flush=True)
    return follow.touch(ToolContact((0, 0, max(0.0, -300 * tool[2])), stiffness=300, normal=(0, 0, 1)))


sys.exit(cli.run(options, physics=step, on_silence=lambda now: move(follow.silence(now))))
