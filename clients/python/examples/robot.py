#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot follows the hand at half its way and feels a table 40 mm below its start; it is engaged when it starts."""
import sys
import time

from tendon import DeviceState, Touch, cli
from tendon.teleop import Follower, FollowerConfig, Pose, ToolContact

options = cli.parser("robot", __doc__, rate_hz=500).parse_args()
follow = Follower(FollowerConfig(scale=0.5, engage_by="call", speed=0.25, rate_hz=options.rate_hz or 1000))
tool = [0.4, 0.0, 0.04]  # m: put your robot's pose, motion and force sensor in the places of these three


def move(target: Pose | None) -> None:
    tool[:] = tool if target is None else target.position  # None: the robot holds its place


def step(hand: DeviceState) -> Touch | None:
    started = follow.phase == 1 and not follow.engage()
    move(follow.target(hand, Pose(tool), time.monotonic_ns()))
    if started:
        follow.engage()  # the act; never again after a loss
    table = ToolContact((0, 0, max(0.0, -2000 * tool[2])), stiffness=2000, normal=(0, 0, 1))
    return follow.touch(table)


sys.exit(cli.run(options, physics=step, on_silence=lambda now: move(follow.silence(now))))
