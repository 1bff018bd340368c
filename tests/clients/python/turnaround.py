#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a state handed to the socket to the force that answers it, decoded: C++ and Python virtual_wall by turns, on loopback,
against the same stand-in server, which gives states at 1 kHz. What the stand-in itself costs is in both. `answered` is the
share of the states that got a force of their own, `core_share` how much of one processor core the client took, its start included."""

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
ZERO = (0.0, 0.0, 0.0)


def serve(program: list[str], key: bytes | None, seconds: float) -> tuple[int, list[int]]:
    """States sent, and the turnaround of each that was answered, ns."""
    server = StandIn(key)
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
                now = time.monotonic_ns()
                select.select([wire], [], [], max(0, due - now) / 1e9)
                while True:
                    try:
                        datagram, peer = wire.recvfrom(1201)
                    except BlockingIOError:
                        break
                    now = time.monotonic_ns()
                    server.receive(now, datagram)
                    while server.session is not None and (event := server.session.next_event()) is not None:
                        if isinstance(event, ForceCommand) and event.based_on_tick in sent:
                            turnarounds.append(now - sent.pop(event.based_on_tick))
                now = time.monotonic_ns()
                server.tick(now)
                if now >= due:
                    due = max(due + PERIOD_NS, now)
                    if server.session is not None and server.session.open:
                        tick += 1
                        inside = (1e-3, 0.0, 0.0)
                        server.session.send(DeviceState(tick, now, inside, ZERO, ZERO, 0.0, 8.0, 0, 0, 0, Mode.ACTIVE))
                        sent[tick] = time.monotonic_ns()
                while peer is not None and (answer := server.next_datagram(time.monotonic_ns())) is not None:
                    wire.sendto(answer, peer)
    return tick, turnarounds


def percentile(values: list[int], share: float) -> float:
    return sorted(values)[int(share * (len(values) - 1))] / 1e3


def main() -> int:
    line = argparse.ArgumentParser(description=__doc__, epilog="Example: turnaround.py --seconds 10 --rounds 3")
    line.add_argument("--seconds", type=float, default=10, help="For each client and round [%(default)s]")
    line.add_argument("--rounds", type=int, default=3, help="[%(default)s]")
    line.add_argument("--programs", type=Path, default=PROGRAMS, metavar="FOLDER", help="[%(default)s]")
    line.add_argument("--json", action="store_true", help="One JSON object per client on stdout")
    options = line.parse_args()

    key = bytes((7 * i * i + 3) % 256 for i in range(32))
    key_file = Path(os.environ.get("TMPDIR", "/tmp")) / f"turnaround-{os.getpid()}.key"
    key_file.touch(mode=0o600)
    key_file.write_text(f"controller {key.hex()}\n", encoding="utf-8")
    wall = [sys.executable, str(EXAMPLES / "virtual_wall.py")]
    clients: dict[str, tuple[list[str], bytes | None]] = {
        "C++": ([str(options.programs / "virtual_wall")], None),
        "Python": (wall, None),
        "Python, sealed": ([*wall, "--key", str(key_file)], key),
    }
    states = dict.fromkeys(clients, 0)
    core_s = dict.fromkeys(clients, 0.0)
    turnarounds: dict[str, list[int]] = {name: [] for name in clients}
    try:
        for _ in range(options.rounds):
            for name, (program, secret) in clients.items():
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                given, took = serve(program, secret, options.seconds)
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
            "p99_us": round(percentile(took, 0.99), 1),
        }
        print(json.dumps(row) if options.json else "  ".join(f"{word} {value}" for word, value in row.items()), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
