#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the time from a state to the force that answers it, from socket to socket on loopback. Each of the clients
is connected to the same stand-in server, which sends states at 1 kHz. The floor is a program in the same language that
answers each datagram with a datagram of the same size and does nothing else. `to_floor` is the median of a client
divided by that of its floor. `answered` is the share of states that were answered, and `core_share` is the CPU time of
the client, including its start, as a share of one core."""

from __future__ import annotations

import argparse
import json
import os
import resource
import select
import socket
import subprocess
import sys
import time
from pathlib import Path

from conftest import ROOT
from processes import EXAMPLES, PROGRAMS
from stand_in import StandIn

from tendon.messages import DeviceState, ForceCommand, Mode

PERIOD_NS = 1_000_000
PYTHON_FLOOR, NODE_FLOOR = "floor in Python", "floor in Node"
TYPESCRIPT_WALL = ROOT / "clients" / "typescript" / "dist" / "examples" / "virtual_wall.js"
ZERO = (0.0, 0.0, 0.0)


STATE_BYTES, FORCE_BYTES = 189, 81
FLOOR = f"""
import socket, sys, time
host, port = sys.argv[sys.argv.index("--server") + 1].rsplit(":", 1)
end = time.monotonic() + float(sys.argv[sys.argv.index("--duration-s") + 1])
wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
wire.connect((host, int(port)))
wire.settimeout(1)
wire.send(bytes({FORCE_BYTES}))
while time.monotonic() < end:
    wire.send(wire.recv(1201)[:{FORCE_BYTES}])
"""
"""The first 8 bytes are the tick."""
FLOOR_IN_NODE = f"""
const socket = require("node:dgram").createSocket("udp4");
const after = (name) => process.argv[process.argv.indexOf(name) + 1];
const [host, port] = after("--server").split(":");
socket.on("message", (datagram) => socket.send(datagram.subarray(0, {FORCE_BYTES}), () => {{}}));
socket.connect(Number(port), host, () => socket.send(Buffer.alloc({FORCE_BYTES})));
setTimeout(() => process.exit(0), 1000 * Number(after("--duration-s")));
"""


class Floor:
    """The server for the floor. It has no session."""

    def __init__(self) -> None:
        self._state = b""

    def receive(self, now: int, datagram: bytes) -> int | None:
        return int.from_bytes(datagram[:8], "little") or None

    def give(self, tick: int, now: int) -> bool:
        self._state = tick.to_bytes(8, "little").ljust(STATE_BYTES, b"\0")
        return True

    def next_datagram(self, now: int) -> bytes | None:
        datagram, self._state = self._state, b""
        return datagram or None


class Server:
    """The server for a client."""

    def __init__(self, key: bytes | None) -> None:
        self._server = StandIn(key)

    def receive(self, now: int, datagram: bytes) -> int | None:
        """Returns the tick that the datagram answers, if any."""
        server = self._server
        server.receive(now, datagram)
        answered = None
        while server.session is not None and (event := server.session.next_event()) is not None:
            if isinstance(event, ForceCommand):
                answered = event.based_on_tick
        return answered

    def give(self, tick: int, now: int) -> bool:
        session = self._server.session
        if session is None or not session.open:
            return False
        inside = (1e-3, 0.0, 0.0)
        session.send(DeviceState(tick, now, inside, ZERO, ZERO, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE))
        return True

    def next_datagram(self, now: int) -> bytes | None:
        self._server.tick(now)
        return self._server.next_datagram(now)


def serve(program: list[str], server: Floor | Server, seconds: float) -> tuple[int, list[int]]:
    """Returns the number of states sent and the turnaround of each answered state, ns."""
    peer = None
    sent: dict[int, int] = {}
    turnarounds: list[int] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.bind(("127.0.0.1", 0))
        wire.setblocking(False)
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python")}
        address = f"127.0.0.1:{wire.getsockname()[1]}"
        arguments = ["--server", address, "--rate-hz", "0", "--duration-s", str(seconds)]
        with subprocess.Popen([*program, *arguments], env=environment, stderr=subprocess.DEVNULL) as client:
            tick, due = 0, time.monotonic_ns()
            while client.poll() is None:
                select.select([wire], [], [], max(0, due - time.monotonic_ns()) / 1e9)
                while True:
                    try:
                        datagram, peer = wire.recvfrom(1201)
                    except BlockingIOError:
                        break
                    now = time.monotonic_ns()
                    answered = server.receive(now, datagram)
                    if answered in sent:
                        turnarounds.append(now - sent.pop(answered))
                now = time.monotonic_ns()
                if peer is not None and now >= due:
                    due = max(due + PERIOD_NS, now)
                    given = server.give(tick + 1, now)
                    tick += given
                while peer is not None and (answer := server.next_datagram(time.monotonic_ns())) is not None:
                    sent.setdefault(tick, time.monotonic_ns())
                    wire.sendto(answer, peer)
    return tick, turnarounds


def percentile(values: list[int], share: float) -> float:
    return sorted(values)[int(share * (len(values) - 1))] / 1e3


def main() -> int:
    line = argparse.ArgumentParser(description=__doc__, epilog="Example: turnaround.py --seconds 10 --rounds 3")
    line.add_argument("--seconds", type=float, default=10, help="For each client and round [%(default)s]")
    line.add_argument("--rounds", type=int, default=3, help="[%(default)s]")
    line.add_argument("--programs", type=Path, default=PROGRAMS, metavar="FOLDER", help="[%(default)s]")
    line.add_argument("--json", action="store_true", help="Print JSON on stdout, one object per client")
    options = line.parse_args()

    key = bytes((7 * i * i + 3) % 256 for i in range(32))
    key_file = Path(os.environ.get("TMPDIR", "/tmp")) / f"turnaround-{os.getpid()}.key"
    key_file.touch(mode=0o600)
    key_file.write_text(f"controller {key.hex()}\n", encoding="utf-8")
    wall = [sys.executable, str(EXAMPLES / "virtual_wall.py")]
    asynchronous = [sys.executable, str(Path(__file__).parent / "turnaround_aio.py")]
    clients: dict[str, tuple[list[str], bytes | None, str]] = {
        PYTHON_FLOOR: ([sys.executable, "-c", FLOOR], None, PYTHON_FLOOR),
        "C++": ([str(options.programs / "virtual_wall")], None, PYTHON_FLOOR),
        "Python": (wall, None, PYTHON_FLOOR),
        "Python, sealed": ([*wall, "--key", str(key_file)], key, PYTHON_FLOOR),
        "Python, asyncio": (asynchronous, None, PYTHON_FLOOR),
    }
    if TYPESCRIPT_WALL.exists():
        node = ["node", str(TYPESCRIPT_WALL)]
        clients[NODE_FLOOR] = (["node", "-e", FLOOR_IN_NODE, "--"], None, NODE_FLOOR)
        clients["TypeScript"] = (node, None, NODE_FLOOR)
        clients["TypeScript, sealed"] = ([*node, "--key", str(key_file)], key, NODE_FLOOR)
    else:
        print(f"turnaround: no row of TypeScript: {TYPESCRIPT_WALL} is not built (npm run build there)", file=sys.stderr)
    states = dict.fromkeys(clients, 0)
    core_s = dict.fromkeys(clients, 0.0)
    turnarounds: dict[str, list[int]] = {name: [] for name in clients}
    try:
        for _ in range(options.rounds):
            for name, (program, secret, floor) in clients.items():
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                server = Floor() if name == floor else Server(secret)
                given, took = serve(program, server, options.seconds)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                core_s[name] += after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
                states[name] += given
                turnarounds[name] += took
    finally:
        key_file.unlink()
    for name, took in turnarounds.items():
        if not took:
            print(f"turnaround: {name} has answered nothing", file=sys.stderr)
            return 1
        row = {
            "client": name,
            "states": states[name],
            "answered": round(len(took) / states[name], 4),
            "core_share": round(core_s[name] / options.seconds / options.rounds, 3),
            "p50_us": round(percentile(took, 0.5), 1),
            "to_floor": round(percentile(took, 0.5) / percentile(turnarounds[clients[name][2]], 0.5), 2),
            "p99_us": round(percentile(took, 0.99), 1),
        }
        print(json.dumps(row) if options.json else "  ".join(f"{word} {value}" for word, value in row.items()), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
