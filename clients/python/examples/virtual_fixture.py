#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a virtual fixture: the hand is free along a line, in a plane or inside a cone, and is pulled back otherwise."""
import sys
from math import hypot, tan

from tendon import DeviceState, Touch, cli

parser = cli.parser("virtual_fixture", __doc__)
parser.add_argument("shape", choices=("line", "plane", "cone"), help="Along y; y = 0; or from the origin along +y")
parser.add_argument("--stiffness-n-per-m", type=cli.number(), default=400, help="Stiffness of the pull back, N/m [%(default)s]")
options = parser.parse_args()
SLOPE = tan(0.35)  # of the cone: its radius over its height


def fixture(hand: DeviceState) -> Touch:
    x, y, z = hand.position
    k, away = options.stiffness_n_per_m, hypot(x, z)
    if options.shape == "plane":
        return Touch(force=(0, -k * y, 0), stiffness=(0, k, 0))
    if options.shape == "line" or y <= -away * SLOPE:  # nothing of the cone is nearer than its axis, or its tip
        rise = 0 if options.shape == "line" else y
        return Touch(force=(-k * x, -k * rise, -k * z))
    out = (away - SLOPE * y) / (1 + SLOPE**2)  # along the cone's normal, which is (1, −slope) in radius and height
    if out <= 0:
        return Touch()
    return Touch(force=(-k * out * x / away, k * out * SLOPE, -k * out * z / away))


sys.exit(cli.run(options, physics=fixture))
