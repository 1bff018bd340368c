# SPDX-License-Identifier: Apache-2.0
"""Measures the latency of tendon-bridge vrpn for states and forces, and the floor: `latency.py [--samples 2000]`.

This script is both the network between tendond and tendon-bridge and the VRPN program. It uses the receive times of the
kernel, so that the wake-ups of Python are not included:

* state: the time from sending a datagram to tendon-bridge until the pose arrives at the program
* force: the time from sending a force field to tendon-bridge, 0.5 ms after a state, until the datagram for tendond
* floor: the time from sending a datagram until it is sent back by a process that does nothing else

It also measures the processor time of tendon-bridge with one program at 1 kHz, and the latency of states while another
program sends 10 000 fields per second.
"""

from __future__ import annotations

import argparse
import os
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from vrpn_client import Client, host_and_port
from vrpn_stage import Program, bridge, server

SO_TIMESTAMPNS = 35
ECHO = """import socket
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 0))
print(s.getsockname()[1], flush=True)
while True:
    s.sendto(*s.recvfrom(2000))
"""


def stamped(one: socket.socket) -> tuple[bytes, tuple[str, int], int]:
    """Receives a datagram. Returns its bytes, its sender and the kernel's time stamp, ns."""
    data, ancillary, _, sender = one.recvmsg(2048, 64)
    for level, kind, value in ancillary:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS:
            seconds, ns = struct.unpack("qq", value[:16])
            return data, sender, seconds * 10**9 + ns
    raise OSError("the kernel gives no stamps")


def bound() -> socket.socket:
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    one.bind(("127.0.0.1", 0))
    return one


def show(name: str, ns: list[int]) -> None:
    ns.sort()
    p50, p99 = (ns[min(len(ns) - 1, int(len(ns) * q))] / 1000 for q in (0.5, 0.99))
    print(f"{name:34} p50 {p50:7.0f} µs   p99 {p99:7.0f} µs   worst {ns[-1] / 1000:7.0f} µs   n {len(ns)}", flush=True)


def floor(samples: int) -> list[int]:
    with subprocess.Popen([sys.executable, "-c", ECHO], stdout=subprocess.PIPE, text=True) as echo:
        assert echo.stdout is not None
        port = int(echo.stdout.readline())
        one = bound()
        took = []
        for _ in range(samples):
            time.sleep(0.001)
            start = time.time_ns()
            one.sendto(bytes(200), ("127.0.0.1", port))
            took.append(stamped(one)[2] - start)
        echo.kill()
    return took


class Network:
    """Forwards datagrams between tendon-bridge and tendond, with a socket for each session of tendon-bridge."""

    def __init__(self, target: str) -> None:
        self.target = host_and_port(target)
        self.face = bound()
        self.backs: dict[tuple[str, int], socket.socket] = {}
        self.address = "127.0.0.1:%d" % self.face.getsockname()[1]
        self.poses: list[int] = []
        self.forces: list[int] = []
        self.handed = 0  # ns, when a state was passed to tendon-bridge
        self.asked = 0  # ns, when a force field was sent to it

    def turn(self, client: Client | None, timeout: float) -> None:
        sockets = [self.face, *self.backs.values()]
        if client:
            sockets += [client.tcp, client.udp]
        for one in select.select(sockets, [], [], timeout)[0]:
            if one is self.face:
                data, sender, at = stamped(one)
                if sender not in self.backs:
                    self.backs[sender] = bound()
                if self.asked and len(data) > 100:
                    self.forces.append(at - self.asked)
                self.asked = 0
                self.backs[sender].sendto(data, self.target)
            elif client and one is client.udp:
                try:
                    _, _, at = stamped(one)
                except BlockingIOError:  # the client has read it together with its stream
                    continue
                if self.handed:
                    self.poses.append(at - self.handed)
                self.handed = 0
            elif client and one is client.tcp:
                client.read(0)
            else:
                data = one.recv(2048)
                sender = next(key for key, value in self.backs.items() if value is one)
                self.handed = time.time_ns()
                self.asked = 0
                self.face.sendto(data, sender)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=2000)
    samples = parser.parse_args().samples
    with tempfile.TemporaryDirectory() as name, server(Path(name)) as device:
        network = Network(device.address())
        with bridge(Path(name), network.address) as between:
            client = None
            end = time.monotonic() + 2
            while time.monotonic() < end:
                network.turn(None, 0.01)
            # The constructor blocks, so no datagram is forwarded meanwhile, which the sessions survive.
            client = Client(between.address())
            assert client.udp is not None
            client.udp.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            while not client.server_udp or not network.poses:
                network.turn(client, 0.01)
            network.poses.clear()
            measure_states(network, client, samples)
            show("state: in -> pose at the program", network.poses)
            n = 0
            network.forces.clear()
            while len(network.forces) < samples:
                while not network.handed:
                    network.turn(client, 0.01)
                half = time.time_ns() + 500_000
                while (left := half - time.time_ns()) > 0:  # sleeps, because the scheduler delays busy processes
                    network.turn(client, left / 1e9)
                n += 1
                network.asked = time.time_ns()
                client.force_field(force=(0, 0.5 + 1e-3 * (n % 2), 0))
                network.turn(client, 0.0004)
            show("force: field -> datagram out", network.forces)
            show("floor: a datagram and its echo", floor(samples))
            ticks = os.sysconf("SC_CLK_TCK")
            before = busy(between.process.pid)
            start = time.monotonic()
            while time.monotonic() < start + 10:
                network.turn(client, 0.01)
            share = (busy(between.process.pid) - before) / ticks / (time.monotonic() - start)
            print(f"processor time of tendon-bridge: {100 * share:.1f} % of one, 1 program, 1000 states/s", flush=True)
            flood(network, client, between, samples)
            client.close()


def measure_states(network: Network, client: Client, samples: int) -> None:
    network.poses.clear()
    while len(network.poses) < samples:
        network.turn(client, 0.01)


def busy(pid: int) -> int:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def flood(network: Network, client: Client, between: Program, samples: int) -> None:
    program = Path(__file__).parent / "vrpn_client.py"
    command = [sys.executable, program, between.address(), "press", "--rate-hz", "10000"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as other:
        for _ in range(2000):
            network.turn(client, 0.001)
        lines = between.out.read_text().splitlines()
        measure_states(network, client, samples)
        show("state, while fields pour in", network.poses)
        said = between.out.read_text().splitlines()[1:]
        rates = [int(line.partition('"messages":')[2].partition(",")[0]) for line in said]
        fields = max(b - a for a, b in zip(rates[len(lines) - 2 :], rates[len(lines) - 1 :]))
        print(f"  {fields} fields in a second", flush=True)
        other.kill()


if __name__ == "__main__":
    main()
