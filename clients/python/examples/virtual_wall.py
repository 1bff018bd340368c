#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a wall at x = 0 that pushes the hand out along -x."""
import sys

from tendon import DeviceState, Touch, cli

parser = cli.parser("virtual_wall", __doc__, rate_hz=100)
parser.add_argument("--stiffness-n-per-m", type=cli.number(), default=2000, help="Stiffness of the wall, N/m [%(default)s]")
parser.add_argument("--local-model", action="store_true", help="Also send the stiffness, for use between two answers")
options = parser.parse_args()


def wall(hand: DeviceState) -> Touch:
    depth, stiffness = hand.position[0], options.stiffness_n_per_m
    if depth <= 0:
        return Touch()
    return Touch(force=(-stiffness * depth, 0, 0), stiffness=(stiffness, 0, 0) if options.local_model else None)


sys.exit(cli.run(options, physics=wall))
