#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A maze in the x-y plane: each wall pushes back through the face by which the hand came in."""
import sys

from tendon import DeviceState, Touch, cli

options = cli.parser("maze", __doc__).parse_args()
MAZE = ["#########", "#   #   #", "# #   # #", "#   #   #", "#########"]  # the middle cell is at the origin
CELL, STIFFNESS = 0.008, 1200  # m, N/m
rooms = [(i, j) for j, row in enumerate(MAZE) for i, cell in enumerate(row) if cell == " "]
room = [len(MAZE[0]) // 2, len(MAZE) // 2]


def maze(hand: DeviceState) -> Touch:
    at = (hand.position[0] / CELL + len(MAZE[0]) / 2, len(MAZE) / 2 - hand.position[1] / CELL)  # in cells
    here = (int(at[0] // 1), int(at[1] // 1))
    if here in rooms and abs(here[0] - room[0]) + abs(here[1] - room[1]) <= 1:
        room[:] = here  # only into the next room, and not through a wall
    force = [0.0, 0.0, -200 * hand.position[2]]
    for axis, sign in ((0, 1), (1, -1)):
        for side in (-1, 1):
            behind = (room[0] + side, room[1]) if axis == 0 else (room[0], room[1] + side)
            depth = side * (at[axis] - room[axis] - 0.5) - 0.5
            if behind not in rooms and depth > 0:
                force[axis] -= sign * side * STIFFNESS * CELL * depth
    return Touch(force=force)


sys.exit(cli.run(options, physics=maze))
