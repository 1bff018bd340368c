# SPDX-License-Identifier: Apache-2.0
"""The client side of VRPN, written from clients/bridge/vrpn/VRPN.md alone. If it is run as a program, it behaves like
an old VRPN program:

    vrpn_client.py ADDRESS wall|plane|press|watch [--stiffness-n-per-m 1000] [--rate-hz 1000] [--tcp] [--name Phantom0]
"""

from __future__ import annotations

import argparse
import random
import select
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator

COOKIE = b"vrpn: ver. 07.38" + b"  0" + bytes(5)
SENDER, TYPE, UDP = -1, -2, -3
HEADER = struct.Struct(">IIIiiI")

Message = tuple[str, str, float, bytes]
"""Sender, type, stamp (s), payload."""


def padding(length: int) -> bytes:
    return bytes(-length % 8)


def message(sender: int, type_: int, payload: bytes = b"", stamp: float | None = None, sequence: int = 0) -> bytes:
    at = time.time() if stamp is None else stamp
    header = HEADER.pack(24 + len(payload), int(at), int(at % 1 * 1e6), sender, type_, sequence)
    return header + payload + padding(len(payload))


def description(text: str) -> bytes:
    name = text.encode() + b"\0"
    return struct.pack(">i", len(name)) + name


def field(origin=(0.0, 0.0, 0.0), force=(0.0, 0.0, 0.0), jacobian=(0.0,) * 9, radius=1.0) -> bytes:
    return struct.pack(">16f", *origin, *force, *jacobian, radius)


def plane(abcd, spring=1.0, damping=0.0, dynamic=0.0, static=0.0, index=0, cycles=1) -> bytes:
    return struct.pack(">8f2i", *abcd, spring, damping, dynamic, static, index, cycles)


def messages_in(data: bytes) -> Iterator[tuple[int, int, float, bytes, int]]:
    """Yields sender, type, stamp, payload, and the offset of the end of each message."""
    at = 0
    while len(data) - at >= 24:
        length, seconds, us, sender, type_, _ = HEADER.unpack_from(data, at)
        assert 24 <= length <= 24 + 64000, length
        end = at + length + len(padding(length))
        if end > len(data):
            return
        yield sender, type_, seconds + us * 1e-6, data[at + 24 : at + length], end
        at = end


def numbers_in(type_name: str, payload: bytes):
    """Decodes the payload of a server's message."""
    layouts = {
        "vrpn_Tracker Pos_Quat": ">2i7d",
        "vrpn_Tracker Velocity": ">2i8d",
        "vrpn_Button Change": ">2i",
        "vrpn_ForceDevice Force": ">3d",
    }
    if type_name == "vrpn_Analog Channel":
        (count,) = struct.unpack_from(">d", payload)
        return struct.unpack(f">{int(count)}d", payload[8:])
    return struct.unpack(layouts[type_name], payload)


def host_and_port(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    return host, int(port)


class Client:
    """A VRPN client. If `by_hello` is true, the server connects to the client."""

    TYPES = ("vrpn_ForceDevice Force_Field", "vrpn_ForceDevice Plane")

    def __init__(
        self,
        address: str,
        name: str = "Phantom0",
        by_hello: bool = True,
        udp: bool | None = None,
        seed: int = 1,
    ) -> None:
        self.server = host_and_port(address)
        self.name = name
        self.random = random.Random(seed)
        self.senders: dict[int, str] = {}
        self.types: dict[int, str] = {}
        self.ours: dict[str, int] = {}
        self.server_udp: tuple[str, int] | None = None
        self.stream = b""
        self.inbox: list[Message] = []
        self.by_datagram = 0
        self.closed = False
        self.tcp = self._be_called() if by_hello else socket.create_connection(self.server, timeout=10)
        self.tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.tcp.sendall(COOKIE)
        self.their_cookie = self._exactly(24)
        self.tcp.setblocking(False)
        self.udp: socket.socket | None = None
        if by_hello if udp is None else udp:
            self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.udp.bind((self.tcp.getsockname()[0], 0))
            self.udp.setblocking(False)
            self.send(self.udp.getsockname()[1], UDP, b"192.0.2.1\0")  # the server ignores the text
        self.describe(name)
        for one in self.TYPES:
            self.describe_type(one)

    def _be_called(self) -> socket.socket:
        listener = socket.create_server(("127.0.0.1", 0))
        listener.settimeout(0.2)
        lob = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        for _ in range(50):
            lob.sendto(f"127.0.0.1 {listener.getsockname()[1]}\0".encode(), self.server)
            try:
                return listener.accept()[0]
            except TimeoutError:
                continue
        raise TimeoutError("nobody called back")

    def _exactly(self, size: int) -> bytes:
        self.tcp.settimeout(10)
        data = b""
        while len(data) < size:
            more = self.tcp.recv(size - len(data))
            if not more:
                raise ConnectionError("closed")
            data += more
        return data

    def number(self, what: str) -> int:
        """Returns a new random number for a name."""
        taken = set(self.ours.values())
        number = next(n for n in iter(lambda: self.random.randrange(2000), None) if n not in taken)
        self.ours[what] = number
        return number

    def describe(self, sender: str) -> None:
        self.send(self.number("sender " + sender), SENDER, description(sender))

    def describe_type(self, name: str) -> None:
        self.send(self.number(name), TYPE, description(name))

    def send(self, sender: int, type_: int, payload: bytes = b"") -> None:
        self.send_bytes(message(sender, type_, payload))

    def send_bytes(self, data: bytes) -> None:
        self.tcp.setblocking(True)
        try:
            self.tcp.sendall(data)
        except OSError:
            self.closed = True
        finally:
            self.tcp.setblocking(False)

    def say(self, type_name: str, payload: bytes = b"", soon: bool = False) -> None:
        data = message(self.ours["sender " + self.name], self.ours[type_name], payload)
        if soon and self.udp and self.server_udp:
            self.udp.sendto(data, self.server_udp)
        else:
            self.send_bytes(data)

    def force_field(self, **values) -> None:
        self.say("vrpn_ForceDevice Force_Field", field(**values), soon=True)

    def force_plane(self, *values, **more) -> None:
        self.say("vrpn_ForceDevice Plane", plane(*values, **more))

    def read(self, timeout: float = 0.05) -> None:
        """Reads all data that has arrived into `inbox`."""
        ready, _, _ = select.select([one for one in (self.tcp, self.udp) if one], [], [], timeout)
        for one in ready:
            try:
                data = one.recv(65536)
            except OSError:
                self.closed = True
                return
            if one is self.udp:
                self.by_datagram += 1
                for sender, type_, stamp, payload, end in messages_in(data):
                    self._take(sender, type_, stamp, payload)
                assert end == len(data) <= 1472
            elif not data:
                self.closed = True
            else:
                self.stream += data
                end = 0
                for sender, type_, stamp, payload, end in messages_in(self.stream):
                    self._take(sender, type_, stamp, payload)
                self.stream = self.stream[end:]

    def _take(self, sender: int, type_: int, stamp: float, payload: bytes) -> None:
        if type_ in (SENDER, TYPE):
            (length,) = struct.unpack_from(">i", payload)
            assert length == len(payload) - 4 and payload[-1] == 0
            (self.senders if type_ == SENDER else self.types)[sender] = payload[4:-1].decode()
        elif type_ == UDP:
            self.server_udp = (self.tcp.getpeername()[0], sender)
        else:
            self.inbox.append((self.senders[sender], self.types[type_], stamp, payload))

    def wait(self, type_name: str, that: Callable[[tuple], bool] = lambda _: True, patience: float = 30.0):
        """Returns the next message of this type for which `that` is true. Earlier messages are discarded."""
        end = time.monotonic() + patience
        while time.monotonic() < end and not self.closed:
            while self.inbox:
                sender, name, _, payload = self.inbox.pop(0)
                if sender != self.name or name != type_name:
                    continue
                if type_name.startswith("vrpn_Base"):
                    return payload
                numbers = numbers_in(name, payload)
                if that(numbers):
                    return numbers
            self.read()
        raise AssertionError(f"{type_name} did not come" + ("; closed" if self.closed else ""))

    def wait_for_text(self) -> str:
        payload = self.wait("vrpn_Base text_message")
        return payload[8:].partition(b"\0")[0].decode()

    def wait_closed(self, patience: float = 30.0) -> bool:
        end = time.monotonic() + patience
        while time.monotonic() < end and not self.closed:
            self.read()
            self.inbox.clear()
        return self.closed

    def close(self) -> None:
        self.tcp.close()
        if self.udp:
            self.udp.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("address")
    parser.add_argument("what", choices=("wall", "plane", "press", "watch"))
    parser.add_argument("--stiffness-n-per-m", type=float, default=1000)
    parser.add_argument("--rate-hz", type=float, default=1000)
    parser.add_argument("--tcp", action="store_true")
    parser.add_argument("--name", default="Phantom0")
    options = parser.parse_args()
    with Client(options.address, options.name, by_hello=not options.tcp) as client:
        print("connected", flush=True)
        if options.what == "plane":
            client.force_plane((-1, 0, 0, 0), spring=options.stiffness_n_per_m / 1000)
        next_field = time.monotonic()
        while not client.closed:
            client.read(max(0.0, min(0.1, next_field - time.monotonic())))
            poses = [one for one in client.inbox if one[1] == "vrpn_Tracker Pos_Quat"]
            client.inbox.clear()
            if options.what == "press" and time.monotonic() >= next_field:
                next_field = max(next_field, time.monotonic() - 0.01) + 1 / options.rate_hz
                client.force_field(force=(-2, 0, 0))
            elif options.what == "wall" and poses and time.monotonic() >= next_field:
                next_field += 1 / options.rate_hz
                x = numbers_in(poses[-1][1], poses[-1][3])[2]
                client.force_field(force=(-options.stiffness_n_per_m * max(x, 0.0) or 1e-9, 0, 0))
    sys.exit(1)


if __name__ == "__main__":
    main()
