# SPDX-License-Identifier: Apache-2.0
"""Runs the loops of typical clients of the service against tendon-bridge inverse and a real tendond.

The loops read and write the same data as those clients, with the same library (python3-websockets), but contain none
of their code.
"""

from __future__ import annotations

import asyncio
import json
import signal
import sys
import threading
import time
from pathlib import Path

import pytest
import websockets

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "python"))

from processes import PROGRAMS, Process, Server  # noqa: E402


class Bridge(Process):
    """tendon-bridge inverse on a free port."""

    def __init__(self, folder: Path, server: str, *more: str) -> None:
        program = PROGRAMS / "tendon-bridge"
        arguments = ["inverse", "--server", server, "--listen", "127.0.0.1:0", "--duration-s", "120", "--json", *more]
        super().__init__(folder, [program, *arguments])
        self.uri = "ws://" + json.loads(self.wait_for_line('"listening"'))["address"]
        self.wait_for_line("connected to")


class ArmAndGrip:
    """Follows the device class of Isaac Lab. A thread reads a message, copies the values, sends a force and sleeps. The
    constructor waits up to 5 s for an arm and a grip.
    """

    def __init__(self, uri: str, hz: float = 200.0) -> None:
        self._uri, self._hz = uri, hz
        self._lock = threading.Lock()
        self._running = True
        self._connected = False
        self.position: tuple[float, ...] = (0.0, 0.0, 0.0)
        self.quaternion: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)
        self.force = {"x": 0.0, "y": 0.0, "z": 0.0}
        self.applied = 0.0
        self.received = 0
        self._thread = threading.Thread(target=lambda: asyncio.run(self._loop()))
        self._thread.start()
        end = time.monotonic() + 5
        while time.monotonic() < end and not self._connected:
            time.sleep(0.05)
        if not self._connected:
            self.close()
            raise RuntimeError("no arm and grip within 5 s")

    def close(self) -> None:
        self._running = False
        self._thread.join()

    async def _loop(self) -> None:
        async with websockets.connect(self._uri, ping_interval=None, ping_timeout=None) as socket:
            device = None
            while self._running:
                try:
                    data = json.loads(await asyncio.wait_for(socket.recv(), timeout=1.0))
                except asyncio.TimeoutError:
                    continue
                self.received += 1
                arms, grips = data.get("inverse3", []), data.get("wireless_verse_grip", [])
                arm, grip = arms[0] if arms else {}, grips[0] if grips else {}
                device = device or arm.get("device_id")
                place = arm.get("state", {}).get("cursor_position", {})
                held = grip.get("state", {})
                with self._lock:
                    if place:
                        self.position = tuple(place.get(axis, 0.0) for axis in "xyz")
                        self.applied = arm["state"]["current_cursor_force"]["z"]
                    if "state" in grip:
                        turned = held.get("orientation", {})
                        if turned:
                            self.quaternion = tuple(turned.get(axis, 0.0) for axis in "xyzw")
                self._connected = bool(place) and "state" in grip
                if device is not None:
                    commands = {"set_cursor_force": {"values": dict(self.force)}}
                    await socket.send(json.dumps({"inverse3": [{"device_id": device, "commands": commands}]}))
                await asyncio.sleep(1 / self._hz)


def until(what: str, holds) -> None:
    end = time.monotonic() + 30
    while not holds():
        if time.monotonic() > end:
            pytest.fail("never came to be: " + what)
        time.sleep(0.005)


def test_a_device_class_that_wants_arm_and_grip_is_served_by_a_falcon(tmp_path):
    with Server(tmp_path) as server, Bridge(tmp_path, server.address) as bridge:
        device = ArmAndGrip(bridge.uri)
        try:
            assert device.quaternion == (0.0, 0.0, 0.0, 1.0), "nothing measures its orientation"
            seen: set[float] = set()
            until("the hand moves", lambda: seen.add(device.position[0]) or len(seen) > 20)
            assert all(abs(x) < 0.03 for x in seen), "± 15 mm along x"
            assert device.applied == 0
            device.force = {"x": 0.0, "y": 0.0, "z": 0.5}
            until("the hand feels it", lambda: device.applied > 0.3)
            device.force = {"x": 0.0, "y": 0.0, "z": 0.0}
            until("the hand feels nothing", lambda: device.applied == 0)
            assert device.received > 20
        finally:
            device.close()


async def steps_until_nothing(uri: str, act) -> int:
    """Waits for a force and calls `act`. Returns the number of haptic steps until the force is zero."""
    async with websockets.connect(uri) as socket:
        first = json.loads(await socket.recv())
        device = first["inverse3"][0]["device_id"]
        end = time.monotonic() + 30
        probe = json.dumps({"inverse3": [{"device_id": device, "commands": {"probe_position": {}}}]})

        async def look() -> tuple[float, int]:
            # The bridge can be connected before the first state of the device has arrived.
            while True:
                await socket.send(probe)
                news = json.loads(await socket.recv())
                if "state" in news["inverse3"][0]:
                    break
                assert time.monotonic() < end, "the device tells no state"
                await asyncio.sleep(0.002)
            return news["inverse3"][0]["state"]["current_cursor_force"]["z"], news["tendon"]["devices"][0]["tick"]

        while (await look())[0] < 0.3:
            assert time.monotonic() < end, "nobody pushes"
            await asyncio.sleep(0.002)
        _, before = await look()
        act()
        while True:
            force, tick = await look()
            if force == 0:
                return tick - before
            assert time.monotonic() < end, "the force stays on"
            await asyncio.sleep(0.002)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_is_killed_or_frozen_with_force_on_is_let_go(tmp_path, number):
    """The force is valid for 100 ms, and then fades within 250 ms. The limit of half a second allows for pauses of the
    machine.
    """
    with Server(tmp_path) as server, Bridge(tmp_path, server.address) as bridge:
        command = ["/usr/bin/python3", HERE / "old_program.py", bridge.uri, "0.5", "500"]
        with Process(tmp_path, command) as program:
            steps = asyncio.run(steps_until_nothing(bridge.uri, lambda: program._process.send_signal(number)))
            print(f"{signal.Signals(number).name}: {steps} steps of 1 ms")
            assert steps <= 350 + 500
            program._process.send_signal(signal.SIGKILL)


def test_a_server_that_dies_and_comes_back_is_found_again(tmp_path):
    async def watch(uri: str, wanted: bool) -> None:
        async with websockets.connect(uri) as socket:
            device = json.loads(await socket.recv())["inverse3"][0]["device_id"]
            force = {"set_cursor_force": {"vector": {"x": 0, "y": 0, "z": 0.5}}}
            message = json.dumps({"inverse3": [{"device_id": device, "commands": force}]})
            end = time.monotonic() + 30
            while True:
                await socket.send(message)
                news = json.loads(await socket.recv())
                arm, ours = news["inverse3"][0], news["tendon"]["devices"][0]
                assert ours["connected"] == ("state" in arm) == arm["status"]["ready"]
                if not wanted and not ours["connected"]:
                    return
                if wanted and ours["connected"] and arm["state"]["current_cursor_force"]["z"] > 0.3:
                    return
                assert time.monotonic() < end, f"never {wanted}"
                await asyncio.sleep(0.005)

    with Server(tmp_path) as server:
        address = server.address
        with Bridge(tmp_path, address) as bridge:
            asyncio.run(watch(bridge.uri, True))
            server.stop(signal.SIGKILL)
            asyncio.run(watch(bridge.uri, False))
            bridge.wait_for_line("lost " + address)
            with Server(tmp_path, listen=address):
                asyncio.run(watch(bridge.uri, True))
