#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Render a viscous field: the force is proportional to the speed of the hand."""
import sys

from tendon import DeviceState, Touch, cli

parser = cli.parser("viscous_field", __doc__)
parser.add_argument("--damping-n-s-per-m", type=cli.number(), default=5, help="Damping of the field, N·s/m [%(default)s]")
options = parser.parse_args()


def honey(hand: DeviceState) -> Touch:
    return Touch(force=[-options.damping_n_s_per_m * v for v in hand.velocity])


sys.exit(cli.run(options, physics=honey))
