# SPDX-License-Identifier: Apache-2.0
"""A physics engine in Python touches a real hand: the client of the Tendon haptics server.

    import tendon

    with tendon.Client("127.0.0.1:47100", tendon.Config(name="spring", rate_hz=200)) as client:
        client.drive(lambda hand: [-500 * x for x in hand.position])

`Client` waits; `tendon.aio.Client` is the same for asyncio; `ForceClient` is the whole behaviour without socket and
clock, for a loop of your own. `tendon.worker.run(answer)` is all of a program that a front asks. SI units, device base
frame; a force is what the device exerts **on the hand**.
"""

from . import aio, cli, worker
from .client import Client
from .deadband import ForceDeadband
from .force_client import Config, ForceClient, Phase, Stats
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

__all__ = [
    "ChannelDescription",
    "ChannelRule",
    "Client",
    "Code",
    "Config",
    "Contact",
    "Delays",
    "DeviceDescription",
    "DeviceReport",
    "DeviceState",
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
    "Reason",
    "RefusedForGood",
    "Role",
    "Safety",
    "SetStateDeadband",
    "Stats",
    "Touch",
    "Turning",
    "Vibration",
    "Welcome",
    "aio",
    "cli",
    "read_key",
    "worker",
]
