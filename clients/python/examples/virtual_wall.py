#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A wall at x = 0 that pushes the hand back out along -x."""
import sys

from tendon import DeviceState, Touch, cli

parser = cli.parser("virtual_wall", __doc__, rate_hz=100)
parser.add_argument("--stiffness-n-per-m", type=cli.number(), default=2000, help="How hard the wall is [%(default)s]")
parser.add_argument("--local-model", action="store_true", help="Send the stiffness too: the device follows the hand")
options = parser.parse_args()


def wall(hand: DeviceState) -> Touch:
    depth, stiffness = hand.position[0], options.stiffness_n_per_m
    if depth <= 0:
        return Touch()
    return Touch(force=(-stiffness * depth, 0, 0), stiffness=(stiffness, 0, 0) if options.local_model else None)


sys.exit(cli.run(options, physics=wall))
