# SPDX-License-Identifier: Apache-2.0
"""Measures round trips over UDP with 200 bytes in one direction and 64 in the other, like a state and a force.

    echo.py serve PORT
    echo.py ask ROUNDS HOST:PORT…     prints the round trip (µs) of each way, and its ratio to the first one

In each round, it measures 100 round trips to each address. The result is the lowest median of all rounds, because the
other rounds have been disturbed by other programs on the machine.
"""

from __future__ import annotations

import socket
import statistics
import sys
import time


def serve(port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        end.bind(("0.0.0.0", port))
        while True:
            data, peer = end.recvfrom(2048)
            end.sendto(data[:64], peer)


def median_us(end: socket.socket) -> float:
    times = []
    for _ in range(100):
        began = time.perf_counter()
        end.send(bytes(200))
        try:
            end.recv(2048)
        except TimeoutError:
            continue
        times.append((time.perf_counter() - began) * 1e6)
        time.sleep(0.0005)
    if len(times) < 50:
        sys.exit(f"echo.py: {end.getpeername()}: {100 - len(times)} of 100 packets were lost")
    return statistics.median(times)


def ask(rounds: int, addresses: list[str]) -> None:
    ends = []
    for address in addresses:
        host, port = address.rsplit(":", 1)
        end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        end.connect((host, int(port)))
        end.settimeout(0.5)
        ends.append(end)
    for end in ends:  # the first packets open the NATs and the tunnel
        median_us(end)
    table = [[median_us(end) for end in ends] for _ in range(rounds)]
    best = [min(row[i] for row in table) for i in range(len(ends))]
    for address, time_us in zip(addresses, best):
        print(f"{address} {time_us:.0f} {time_us / best[0]:.2f}")


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(int(sys.argv[2]))
    else:
        ask(int(sys.argv[2]), sys.argv[3:])
