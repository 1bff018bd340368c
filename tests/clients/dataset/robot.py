# SPDX-License-Identifier: Apache-2.0
"""A robot that follows the hand over a table at half scale, and records how it moves."""
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "clients" / "python"))

from tendon import DeviceState, Touch, cli
from tendon.demonstration import Demonstration
from tendon.teleop import Follower, FollowerConfig, Pose, ToolContact

parser = cli.parser("robot", __doc__, rate_hz=200)
parser.add_argument("--demonstration", required=True)
options = parser.parse_args()
UP = (0.5**0.5, 0.5**0.5, 0, 0)  # the device's y axis and the robot's z axis point up
follow = Follower(FollowerConfig(scale=0.5, rotation=UP, clutch_button=0, rate_hz=options.rate_hz))
tool = [0.4, 0.0, 0.02]  # m


def move(target: Pose | None) -> None:
    tool[:] = tool if target is None else target.position


def step(hand: DeviceState) -> Touch | None:
    pose = Pose(list(tool))
    target = follow.target(hand, pose, time.monotonic_ns())
    contact = ToolContact((0, 0, max(0.0, -300 * tool[2])))
    demonstration.add(hand, pose, target, follow.phase, contact)
    move(target)
    return follow.touch(contact)


with Demonstration(options.demonstration) as demonstration:
    status = cli.run(options, physics=step, on_silence=lambda now: move(follow.silence(now)))
sys.exit(status)
