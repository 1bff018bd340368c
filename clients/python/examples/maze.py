#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a maze in the x-y plane. Each wall pushes the hand back through the face by which it entered."""
import sys

from tendon import DeviceState, Touch, cli

options = cli.parser("maze", __doc__).parse_args()
MAZE = ["#########", "#   #   #", "# #   # #", "#   #   #", "#########"]  # the middle cell is at the origin
CELL, STIFFNESS = 0.008, 1200  # m, N/m
room = [len(MAZE[0]) // 2, len(MAZE) // 2]  # the cell of the hand if the walls were rigid


def maze(hand: DeviceState) -> Touch:
    at = (hand.position[0] / CELL + len(MAZE[0]) / 2, len(MAZE) / 2 - hand.position[1] / CELL)  # in cells
    force = [0.0, 0.0, -200 * hand.position[2]]
    for axis, sign in ((0, 1), (1, -1)):
        from_middle = at[axis] - room[axis] - 0.5
        if abs(from_middle) <= 0.5:
            continue
        behind = list(room)
        behind[axis] += 1 if from_middle > 0 else -1
        if MAZE[behind[1]][behind[0]] == " ":
            room[:] = behind
        else:
            force[axis] = -sign * STIFFNESS * CELL * (from_middle - (behind[axis] - room[axis]) / 2)
    return Touch(force=force)


sys.exit(cli.run(options, physics=maze))
