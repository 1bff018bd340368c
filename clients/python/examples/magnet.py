#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a magnet at the origin, which attracts the hand within its reach and holds it there."""
import sys
from math import exp

from tendon import DeviceState, Touch, cli

parser = cli.parser("magnet", __doc__)
parser.add_argument("--stiffness-n-per-m", type=cli.number(), default=300, help="Stiffness at the magnet, N/m [%(default)s]")
parser.add_argument("--reach-mm", type=cli.at_least(1), default=8, help="Distance of the maximum force, mm [%(default)s]")
options = parser.parse_args()


def magnet(hand: DeviceState) -> Touch:
    x, reach = hand.position, options.reach_mm / 1000
    # F = −k x exp(−x²/2r²): the pull is strongest at the distance r. The stiffness is −∂F/∂x.
    k = options.stiffness_n_per_m * exp(-sum(c * c for c in x) / (2 * reach**2))
    rows = [[k * ((i == j) - x[i] * x[j] / reach**2) for j in range(3)] for i in range(3)]
    return Touch(force=[-k * c for c in x], stiffness=rows)


sys.exit(cli.run(options, physics=magnet))
