#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render corduroy: ridges along x that push the hand into the grooves between them."""
import sys
from math import cos, pi, sin

from tendon import DeviceState, Touch, cli

parser = cli.parser("texture", __doc__)
parser.add_argument("--pitch-mm", type=cli.at_least(0.5), default=4, help="Distance between ridges, mm [%(default)s]")
parser.add_argument("--force-n", type=cli.number(), default=0.8, help="Force at the flank of a ridge, N [%(default)s]")
options = parser.parse_args()


def corduroy(hand: DeviceState) -> Touch:
    per_metre = 2 * pi / (options.pitch_mm / 1000)
    phase = per_metre * hand.position[0]  # 0 in the middle of a groove
    stiffness = options.force_n * per_metre * cos(phase)  # negative on a ridge: unstable equilibrium
    return Touch(force=(-options.force_n * sin(phase), 0, 0), stiffness=(stiffness, 0, 0))


sys.exit(cli.run(options, physics=corduroy))
