# SPDX-License-Identifier: Apache-2.0
"""Addresses, and what a socket may report."""

import errno

import pytest

from tendon import Client, Config, Phase, aio
from tendon.guest import Guest, parse_address


@pytest.mark.parametrize(
    "text, address",
    [
        ("127.0.0.1:47100", ("127.0.0.1", 47100)),
        ("[::1]:1", ("::1", 1)),
        ("haptics.local:65535", ("haptics.local", 65535)),
    ],
)
def test_an_address_is_host_and_port(text, address):
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["", "127.0.0.1", ":47100", "::1:47100", "a:0", "a:65536", "a:-1", "a:4 7", "a:٣"])
def test_anything_else_is_told_what_is_expected(text):
    with pytest.raises(ValueError, match="expected HOST:PORT"):
        parse_address(text)


class Socket:
    """A socket whose next receptions and sendings are these."""

    def __init__(self, *received):
        self.received = list(received)
        self.sent = []

    def recv(self, size):
        what = self.received.pop(0) if self.received else BlockingIOError()
        if isinstance(what, OSError):
            raise what
        return what[:size]

    def send(self, datagram):
        self.sent.append(datagram)
        raise OSError(errno.ENETUNREACH, "Network is unreachable")

    def close(self):
        pass


def guest(*received):
    it = Guest("127.0.0.1:9", Config(), 0, clock=lambda: 0)
    it.socket.close()
    it.socket = Socket(*received)
    return it


def test_reports_that_nobody_is_there_are_passed_over():
    reports = [ConnectionRefusedError(), OSError(errno.EHOSTUNREACH, "No route to host"), b"nonsense", OSError(errno.ENETDOWN, "")]
    it = guest(*reports)
    it.turn(0)
    assert it.socket.received == []
    assert (it.core.phase, len(it.socket.sent)) == (Phase.GREETING, 1)


def test_a_flood_of_reports_does_not_keep_it_from_sending():
    it = guest(*[OSError(errno.EHOSTUNREACH, "No route to host")] * 100_000)
    it.turn(0)
    assert len(it.socket.sent) == 1


def test_what_a_turn_finds_late_it_does_not_take_for_as_old_as_its_beginning(monkeypatch):
    """A process that loses its processor in the middle of a turn: the round trip would look short by as much."""
    it = guest(b"one", b"two")
    times = iter([2, 9])
    it.clock = lambda: next(times)
    taken = []
    monkeypatch.setattr(it.core, "receive", lambda now, datagram: taken.append((now, datagram)))
    monkeypatch.setattr(it.core, "tick", lambda now: taken.append((now, None)))
    it.turn(3)
    assert taken == [(3, b"one"), (9, b"two"), (9, None)]


@pytest.mark.parametrize("kind", [Client, aio.Client])
@pytest.mark.parametrize("order", ["rearm", "disarm", "take_lease", "give_lease"])
def test_what_a_client_asks_for_leaves_at_once(kind, order, monkeypatch):
    client = kind("127.0.0.1:9")
    client._guest.socket.close()
    done = []
    monkeypatch.setattr(client._guest.core, order, lambda: done.append(order) or True)
    monkeypatch.setattr(client._guest, "flush", lambda now: done.append("flush"))
    assert getattr(client, order)()
    assert done == [order, "flush"]


@pytest.mark.parametrize("kind", [Client, aio.Client])
@pytest.mark.parametrize("what", ["holds", "description"])
def test_a_client_tells_what_its_core_knows(kind, what):
    client = kind("127.0.0.1:9")
    client._guest.socket.close()
    known = object()
    setattr(client._guest.core, what, known)
    assert getattr(client, what) is known
