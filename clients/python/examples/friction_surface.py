#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a table with Coulomb friction, which uses a bristle that slips at the friction limit (Dahl's model)."""
import sys
from math import hypot

from tendon import DeviceState, Touch, cli

parser = cli.parser("friction_surface", __doc__)
parser.add_argument("--height-mm", type=cli.at_least(-100), default=2, help="Height of the table along y, mm [%(default)s]")
parser.add_argument("--friction", type=cli.number(), default=0.5, help="Coefficient of friction [%(default)s]")
options = parser.parse_args()
TABLE, BRISTLE = 1000, 500  # N/m
foot: list[float] = []  # end point of the bristle on the table; empty: no contact


def table(hand: DeviceState) -> Touch:
    x, y, z = hand.position
    depth = options.height_mm / 1000 - y
    if depth <= 0:
        foot.clear()
        return Touch()
    bend = (x - foot[0], z - foot[1]) if foot else (0.0, 0.0)
    slip = min(1.0, options.friction * TABLE * depth / BRISTLE / (hypot(*bend) or 1.0))
    foot[:] = (x - slip * bend[0], z - slip * bend[1])  # slides so that the force stays at the limit
    return Touch(force=(-BRISTLE * slip * bend[0], TABLE * depth, -BRISTLE * slip * bend[1]))


sys.exit(cli.run(options, physics=table))
