#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Upload a part, which the server renders at the rate of the device, so that the delay of this program is not felt."""
from tendon import Field, Sphere, cli, connect

parser = cli.parser("field", __doc__, rate_hz=30)
parser.add_argument("--mesh", metavar="FILE", help="Closed surface in mm, .stl or .obj. Default: a ball of 15 mm at x > 0")
parser.add_argument("--spacing-mm", type=cli.number(0.25, 8), default=1, help="Between samples of the mesh, mm [%(default)s]")
parser.add_argument("--stiffness-n-per-m", type=cli.at_least(1), default=500, help="Stiffness of the part, N/m [%(default)s]")
parser.add_argument("--friction", type=cli.number(0, 2), default=0.3, help="Friction coefficient [%(default)s]")
options = parser.parse_args()

part = Field.from_primitives(Sphere((0.015, 0, 0), 0.015))
if options.mesh:
    part = Field.from_mesh(options.mesh, options.spacing_mm)
part.material("steel", options.stiffness_n_per_m, options.friction)

settings = {"device": options.device, "channel": options.channel, "take_lease": options.take_lease}
with connect(options.server, options.key, rate_hz=options.rate_hz, **settings) as hand:
    hand.use(part)
    for state in hand.states(options.duration_s or None):
        hand.pose(position=(0, 0, 0), turn=(1, 0, 0, 0))
        if options.json and state.field:
            print(f'{{"depth_mm":{1000 * state.field.depth:.3f}}}')
