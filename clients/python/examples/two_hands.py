#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Connect the devices "left" and "right", 200 mm apart along x, by a rod: each hand feels the other."""
import sys
from math import dist

from tendon import DeviceState, Touch, cli

parser = cli.parser("two_hands", __doc__)
parser.add_argument("--stiffness-n-per-m", type=cli.number(), default=400, help="Stiffness of the rod, N/m [%(default)s]")
parser.add_argument("--length-mm", type=cli.at_least(1), default=200, help="Length of the rod at rest, mm [%(default)s]")
options = parser.parse_args()
ends: dict[str, list[float]] = {}  # of the rod, m, in the frame centered between the two devices


def rod(mine: str, other: str, device_x: float, hand: DeviceState) -> Touch:
    x, y, z = hand.position
    ends[mine] = [x + device_x, y, z]
    length = dist(ends[mine], ends.get(other, ends[mine]))
    if length == 0:  # the other hand does not hold it yet
        return Touch()
    n = [(a - b) / length for a, b in zip(ends[mine], ends[other])]
    k = options.stiffness_n_per_m
    tension = k * (length - options.length_mm / 1000)
    rows = [[k * a * b + tension / length * ((i == j) - a * b) for j, b in enumerate(n)] for i, a in enumerate(n)]
    return Touch(force=[-tension * c for c in n], stiffness=rows)


hands = {"left": lambda hand: rod("left", "right", -0.1, hand), "right": lambda hand: rod("right", "left", 0.1, hand)}
sys.exit(cli.run(options, physics=hands))
