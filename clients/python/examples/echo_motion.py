#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Print the motion of the hand, the force on it, and the round-trip time of the network."""
import json
import sys

from tendon import DeviceState, LinkStats, cli

options = cli.parser("echo_motion", __doc__, rate_hz=10).parse_args()


def show(hand: DeviceState, link: LinkStats) -> None:
    x, f, ms = hand.position, hand.force_applied, link.smoothed_round_trip_ns / 1e6
    if options.json:
        line = {"tick": hand.tick, "position_m": x, "force_n": f, "force_wanted_n": hand.force_wanted, "round_trip_ms": ms}
        print(json.dumps(line), flush=True)
    else:
        position, force = ("{:+.4f} {:+.4f} {:+.4f}".format(*x), "{:+.2f} {:+.2f} {:+.2f}".format(*f))
        print(f"tick {hand.tick}   position {position} m   force {force} N   round trip {ms:.1f} ms", flush=True)


sys.exit(cli.run(options, watch=show))
