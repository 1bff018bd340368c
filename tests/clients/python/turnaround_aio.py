# SPDX-License-Identifier: Apache-2.0
"""The wall of virtual_wall.py in an asyncio event loop, for turnaround.py."""

from __future__ import annotations

import asyncio
import sys

from tendon import Config, aio
from tendon.messages import DeviceState, Touch

STIFFNESS = 500.0


async def wall(hand: DeviceState) -> Touch:
    return Touch(force=(-STIFFNESS * max(hand.position[0], 0.0), 0.0, 0.0))


async def main() -> None:
    async with aio.Client(sys.argv[sys.argv.index("--server") + 1], Config(name="wall")) as client:
        await client.drive(wall, float(sys.argv[sys.argv.index("--duration-s") + 1]))


asyncio.run(main())
