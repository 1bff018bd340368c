# SPDX-License-Identifier: Apache-2.0
"""Python client of the Tendon haptics server.

    import tendon

    with tendon.Client("127.0.0.1:47100", tendon.Config(name="spring", rate_hz=200)) as client:
        client.drive(lambda hand: [-500 * x for x in hand.position])

`Client` blocks, `tendon.aio.Client` is for asyncio, and `ForceClient` contains the protocol without socket and
clock, for use in your own event loop. `tendon.worker.run(answer)` implements a worker. SI units, device base
frame; forces act **on the hand**.
"""

import sys as _sys
from pathlib import Path as _Path

try:
    import google.protobuf as _protobuf
    import nacl.bindings as _nacl
except ImportError as _missing:
    raise ImportError(
        f"tendon requires the packages protobuf and PyNaCl, which this Python ({_sys.executable}) does not have: "
        f"{_missing}. "
        "Either use those of Debian: `apt install python3-protobuf python3-nacl`, and run your program with "
        "/usr/bin/python3. Or install them in a virtual environment: "
        f"`python3 -m venv venv && venv/bin/pip install {_Path(__file__).resolve().parents[1]}`, "
        "and run your program with venv/bin/python3."
    ) from None
del _protobuf, _nacl

from . import aio, cli, worker
from .client import Client, connect
from .config import Config, Phase, Stats
from .deadband import ForceDeadband
from .field import DepthTable, Field
from .force_client import ForceClient
from .guest import RefusedForGood
from .keys import read_key
from .messages import (
    ChannelDescription,
    ChannelRule,
    Code,
    Contact,
    Delays,
    DeviceDescription,
    DeviceReport,
    DeviceState,
    FieldState,
    ForceTable,
    Grip,
    Hand,
    HandleDescription,
    Joints,
    LampColour,
    LinkReport,
    LinkStats,
    Mode,
    OutputDescription,
    OutputKind,
    PeerReport,
    Reason,
    Role,
    Safety,
    SetStateDeadband,
    Touch,
    Turning,
    Vibration,
    Welcome,
)
from .shape import Box, Capsule, Plane, Sphere

__all__ = [
    "Box",
    "Capsule",
    "ChannelDescription",
    "ChannelRule",
    "Client",
    "Code",
    "Config",
    "Contact",
    "Delays",
    "DepthTable",
    "DeviceDescription",
    "DeviceReport",
    "DeviceState",
    "Field",
    "FieldState",
    "ForceClient",
    "ForceDeadband",
    "ForceTable",
    "Grip",
    "Hand",
    "HandleDescription",
    "Joints",
    "LampColour",
    "LinkReport",
    "LinkStats",
    "Mode",
    "OutputDescription",
    "OutputKind",
    "PeerReport",
    "Phase",
    "Plane",
    "Reason",
    "RefusedForGood",
    "Role",
    "Safety",
    "SetStateDeadband",
    "Sphere",
    "Stats",
    "Touch",
    "Turning",
    "Vibration",
    "Welcome",
    "aio",
    "cli",
    "connect",
    "read_key",
    "worker",
]
