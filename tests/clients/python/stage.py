# SPDX-License-Identifier: Apache-2.0
"""A client, a stand-in server and a hand 1 mm inside a wall, on virtual time."""

from __future__ import annotations

import random
from dataclasses import replace
from math import inf

from stand_in import StandIn
from world import MS, PERFECT, Weather, World

from tendon import (
    ChannelDescription,
    ChannelRule,
    Code,
    Config,
    DeviceDescription,
    Hand,
    HandleDescription,
    ForceClient,
    Mode,
    SetStateDeadband,
    Touch,
    Turning,
)
from tendon.messages import (
    Control,
    ControlAck,
    Describe,
    DeviceState,
    ForceCommand,
    LeaseLost,
    TakeLease,
)

KEY = bytes(range(32))
ZERO = (0.0, 0.0, 0.0)
KEPT = SetStateDeadband(share=0.1, floor=1e-3, max_silence_us=20_000)
DESCRIPTION = DeviceDescription(
    device=1,
    name="right",
    model="stand-in",
    position_dof=3,
    force_dof=3,
    workspace=None,
    max_force=8.0,
    continuous_force=0.0,
    max_stiffness=0.0,
    position_resolution=0.0,
    loop_hz=1000,
    channels=(
        ChannelDescription("tissue", ChannelRule.SUM),
        ChannelDescription("needle", ChannelRule.SUM),
        ChannelDescription("tool", ChannelRule.PRIORITY, 500, "wall"),
    ),
)

HANDLE = HandleDescription(
    device=1,
    operator_from_device=(0.5, -0.5, 0.5, 0.5),
    buttons=("right", "forward", "centre", "left"),
    orientation_measured=True,
    max_torque=0.125,
    gripper_open=0.5,
    max_gripper_force=8.0,
    group="arms",
    hand=Hand.RIGHT,
)


class Stage:
    """A client whose physics is a wall at x = 0, and a device at 1 kHz whose hand is 1 mm inside it."""

    def __init__(self, config: Config, server: StandIn | None = None, weather: Weather = PERFECT, seed: int = 1):
        self.client = ForceClient(config, World.START, random.Random(seed).randbytes)
        self.server = server or StandIn()
        self.world = World(self.client, self.server, weather, seed)
        self.touch = lambda hand: Touch((-2000 * hand.position[0], 0, 0))
        self.seen: list[DeviceState] = []
        self.seen_at: list[int] = []
        self.forces: list[ForceCommand] = []
        self.requests: list[Control] = []
        self.requested_at: list[int] = []
        self.answers: list[ControlAck] = []  # to requests of the server
        self.grant = Code.OK
        self.wait_ms = 0
        self.lease_answers: list[Code] = []  # answers to TakeLease in order, then `grant`
        self.snatches = 0  # number of leases that another client takes at once
        self.speed = 0.0  # m/s
        self.turning: Turning | None = None
        self.press_every = 0  # button 1 is pressed in one of this many states; 0: never
        self.every = 1  # ms between the states that are sent
        self._next_state = World.START

    def run(self, length: int) -> None:
        self.world.run(length, self._each_turn)

    def _each_turn(self):
        now = self.world.now
        session = self.server.session
        while session is not None and (event := session.next_event()) is not None:
            if isinstance(event, ForceCommand):
                self.forces.append(event)
            elif isinstance(event, Control):
                self.requests.append(event)
                self.requested_at.append(now)
                asks_lease = isinstance(event.request, TakeLease)
                code = self.lease_answers.pop(0) if asks_lease and self.lease_answers else self.grant
                described = isinstance(event.request, Describe) and code is Code.OK
                of_handle = described and event.request.handle
                device, handle = (None, HANDLE) if of_handle else (DESCRIPTION, None)
                session.answer(event.id, code, "", self.wait_ms, device if described else None, handle)
                if asks_lease and code is Code.OK and self.snatches > 0:
                    self.snatches -= 1
                    session.request(LeaseLost(1, 2, "another"))
            elif isinstance(event, ControlAck):
                self.answers.append(event)
        if now >= self._next_state:
            tick = (now - World.START) // MS
            self._next_state = World.START + (tick + 1) * MS
            if session is not None and tick % self.every == 0:
                position = (1e-3 + 1e-3 * self.speed * tick, 0.0, 0.0)
                velocity = (self.speed, 0.0, 0.0)
                state = DeviceState(tick, now, position, velocity, ZERO, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE)
                pressed = self.press_every > 0 and tick % self.press_every == 0
                session.send(replace(state, turning=self.turning, buttons=2 if pressed else 0))
        while (hand := self.client.next_state(now)) is not None:
            self.seen.append(hand)
            self.seen_at.append(now)
            if self.touch is not None:
                self.client.send(hand, self.touch(hand))
        device = self._next_state if session is not None and session.open and not self.server.deaf else inf
        return min(device, self.client.next_state_due())
