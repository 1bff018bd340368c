# SPDX-License-Identifier: Apache-2.0
"""old_program.py URI NEWTONS HZ: pushes the hand up with the code of the service's tutorials and their client library.

It sends bytes instead of text, because some programs use a fast JSON library that does this.
"""

from __future__ import annotations

import asyncio
import json
import sys

import websockets


async def main(uri: str, newtons: float, hz: float) -> None:
    async with websockets.connect(uri) as socket:
        first = json.loads(await socket.recv())
        device = first["inverse3"][0]["device_id"]
        message = {
            "session": {"configure": {"profile": {"name": "lab.example:old-program"}}},
            "inverse3": [
                {"device_id": device, "commands": {"set_cursor_force": {"vector": {"x": 0, "y": 0, "z": newtons}}}}
            ],
        }
        while True:
            await socket.send(json.dumps(message).encode())
            state = json.loads(await socket.recv())["inverse3"][0]["state"]
            print(state["cursor_position"], state["current_cursor_force"], flush=True)
            message.pop("session", None)
            await asyncio.sleep(1 / hz)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3])))
