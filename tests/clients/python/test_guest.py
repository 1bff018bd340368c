# SPDX-License-Identifier: Apache-2.0
"""Tests addresses, name resolution and socket errors."""

import asyncio
import errno
import socket
import threading
from types import SimpleNamespace

import pytest

from tendon import Client, Code, Config, Field, Phase, Sphere, aio, connect
from tendon.guest import Guest, RefusedForGood, log, parse_address
from tendon.upload import Motion


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
    """A socket with scripted results."""

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


def test_a_datagram_found_late_in_a_turn_is_not_taken_for_older(monkeypatch):
    """If the process is preempted within a turn, the round trip must not be too short because of an old receive
    time."""
    it = guest(b"one", b"two")
    times = iter([2, 9])
    it.clock = lambda: next(times)
    taken = []
    monkeypatch.setattr(it.core, "receive", lambda now, datagram: taken.append((now, datagram)))
    monkeypatch.setattr(it.core, "tick", lambda now: taken.append((now, None)))
    it.turn(3)
    assert taken == [(3, b"one"), (9, b"two"), (9, None)]


@pytest.mark.parametrize("kind", [Client, aio.Client])
@pytest.mark.parametrize(
    "order, values",
    [
        *((order, ()) for order in ("rearm", "disarm", "engage", "disengage", "take_lease", "give_lease")),
        ("set_scale", (0.5, 2.0)),
        ("set_share", (1, 0.25)),
    ],
)
def test_what_a_client_asks_for_leaves_at_once(kind, order, values, monkeypatch):
    client = kind("127.0.0.1:9")
    client._guest.socket.close()
    done = []
    monkeypatch.setattr(client._guest.core, order, lambda *said: done.append((order, said)) or True)
    monkeypatch.setattr(client._guest, "flush", lambda now: done.append("flush"))
    assert getattr(client, order)(*values)
    assert done == [(order, values), "flush"]


@pytest.mark.parametrize("kind", [Client, aio.Client])
def test_poses_and_truths_leave_at_once_and_a_field_is_described(kind, monkeypatch):
    client = kind("127.0.0.1:9", Config(fields=True))
    client._guest.socket.close()
    done = []
    core = client._guest.core
    monkeypatch.setattr(core.fields, "use", lambda told: done.append(told and told.name))
    monkeypatch.setattr(core.fields, "move", lambda now, motion, ahead: done.append((motion, ahead)) or True)
    monkeypatch.setattr(core, "truth", lambda hand, touch: done.append(touch.force) or True)
    monkeypatch.setattr(client._guest, "flush", lambda now: done.append("flush"))
    field = Field.from_primitives(Sphere())
    client.use(field)
    assert client.pose((1, 2, 3), (1, 0, 0, 0), (4, 5, 6, 7, 8, 9), ahead_s=0.3)
    assert client.truth(None, (1, 2, 3))
    client.use(None)
    motion = Motion((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0))
    name = field.describe().name
    assert done == [name, "flush", (motion, 300_000_000), "flush", (1, 2, 3), "flush", None, "flush"]
    client._guest.core.fields.refused = "too stiff"
    assert client.field_refused == "too stiff"


def test_connect_reads_a_key_and_asks_for_fields(tmp_path):
    digits = "bc795700d5499e7507c56d6b31e4ecb5f7869bc746395172bfa650b552994153"
    (tmp_path / "peg.key").write_text(f"controller {digits}\n")
    (tmp_path / "peg.key").chmod(0o600)
    for key, expected in ((tmp_path / "peg.key", bytes.fromhex(digits)), (bytes(32), bytes(32)), (None, None)):
        with connect("127.0.0.1:9", channel="peg", key=key) as client:
            config = client._guest.core.config
            assert (config.key, config.fields, config.channel) == (expected, True, "peg")


def test_a_client_without_the_feature_says_how_to_get_it():
    with Client("127.0.0.1:9") as client:
        with pytest.raises(ValueError, match=r"fields = False: expected Config\(fields=True\), as by tendon.connect"):
            client.use(Field.from_primitives(Sphere()))


@pytest.mark.parametrize("kind", [Client, aio.Client])
@pytest.mark.parametrize("what", ["holds", "description"])
def test_a_client_tells_what_its_core_knows(kind, what):
    client = kind("127.0.0.1:9")
    client._guest.socket.close()
    known = object()
    setattr(client._guest.core, what, known)
    assert getattr(client, what) is known


@pytest.mark.parametrize("kind", [Client, aio.Client])
def test_a_host_that_is_not_there_is_named(kind):
    with pytest.raises(OSError, match=r"^cannot find haptics\.invalid: "):
        kind("haptics.invalid:47100")


def test_a_name_is_looked_up():
    client = Client("localhost:9")
    assert client._guest.socket.getpeername()[0] in ("127.0.0.1", "::1")
    client._guest.socket.close()


def place(host):
    return (socket.AF_INET, 0, (host, 9))


def looked_up(monkeypatch, *answers):
    """Replaces the look-up of names. Each call returns the next answer, or raises it if it is an OSError."""
    answers = list(answers)
    done = threading.Event()

    def look_up(server):
        done.set()
        answer = answers.pop(0)
        if isinstance(answer, OSError):
            raise answer
        return answer

    monkeypatch.setattr("tendon.guest._look_up", look_up)
    monkeypatch.setattr("tendon.guest.threading.Thread", lambda target, name, daemon: SimpleNamespace(start=target))
    return done


def peer_after_an_attempt(it, now):
    """Returns the address to which the client sends after the attempt that began at `now` has failed."""
    it.turn(now + int(Config().patience_s * 1e9))
    assert it.core.phase is Phase.UNANSWERED
    it.turn(now + int(Config().patience_s * 1e9))
    return it.socket.getpeername()[0]


def test_where_nobody_answers_the_next_address_of_the_name_is_tried(monkeypatch):
    both = [place("127.0.0.1"), place("127.0.0.2")]
    looked_up(monkeypatch, both, both)
    it = Guest("haptics.lab:9", Config(), 0, clock=lambda: 0)
    moves = []
    it.moved = lambda old, new: moves.append((old.fileno() >= 0, new is it.socket))
    assert it.socket.getpeername()[0] == "127.0.0.1"
    assert peer_after_an_attempt(it, 0) == "127.0.0.2"
    assert moves == [(True, True)], "the old socket is open until it is not watched any more"
    it.socket.close()


def test_a_server_that_has_moved_is_followed(monkeypatch):
    looked_up(monkeypatch, [place("127.0.0.1")], [place("127.0.0.3")])
    it = Guest("haptics.lab:9", Config(), 0, clock=lambda: 0)
    assert peer_after_an_attempt(it, 0) == "127.0.0.3"
    it.socket.close()


def test_a_name_that_is_gone_leaves_the_address_that_it_had(monkeypatch, caplog):
    looked_up(monkeypatch, [place("127.0.0.1")], OSError("cannot find haptics.lab: gone"))
    it = Guest("haptics.lab:9", Config(), 0, clock=lambda: 0)
    assert peer_after_an_attempt(it, 0) == "127.0.0.1"
    assert "cannot find haptics.lab: gone; trying 127.0.0.1" in caplog.text
    it.socket.close()


def test_an_address_is_never_looked_up_again(monkeypatch):
    looked = looked_up(monkeypatch, [place("127.0.0.1")])
    it = Guest("127.0.0.1:9", Config(), 0, clock=lambda: 0)
    looked.clear()
    assert peer_after_an_attempt(it, 0) == "127.0.0.1"
    assert not looked.is_set()
    it.socket.close()


def answered(client, answers):
    """Passes the client's answers to states 10 ms apart."""
    for i, touch in enumerate(answers):
        client.answer(SimpleNamespace(sampled_ns=5_000_000_000 + 10_000_000 * i), touch)


def test_an_engine_that_only_returns_none_is_told_so_once(caplog):
    with Client("127.0.0.1:9") as client:
        answered(client, [None] * 100)
        assert caplog.messages == []
        answered(client, [None] * 300)
    assert caplog.messages == [
        "the engine has returned None for 1 s, so no force is sent; check for a missing `return`"
    ]


def test_an_engine_that_has_once_returned_a_force_may_return_none(caplog, monkeypatch):
    with Client("127.0.0.1:9") as client:
        sent = []
        monkeypatch.setattr(client, "send", lambda hand, touch: sent.append(touch))
        answered(client, [None] * 50 + [(1, 0, 0)] + [None] * 500)
    assert caplog.messages == [] and sent == [(1, 0, 0)]


def test_the_event_loop_watches_the_socket_of_the_new_address():
    async def move():
        async with aio.Client("127.0.0.1:9") as client:
            loop, guest_ = asyncio.get_running_loop(), client._guest
            old = guest_.socket
            guest_._move_to([place("127.0.0.2")])
            assert guest_.socket is not old
            assert loop.remove_reader(guest_.socket), "it was watched"
            loop.add_reader(guest_.socket, client._turn)

    asyncio.run(move())


def test_the_words_of_a_peer_cannot_forge_a_line_or_move_the_cursor(caplog):
    log.warning("report of the server: %s", "fine\n12:00 tendond: no limits\x1b[2J\x7f\x9b1A")
    assert caplog.messages == ["report of the server: fine\\n12:00 tendond: no limits\\x1b[2J\\x7f\\x9b1A"]
    refused = RefusedForGood("127.0.0.1:47100 refused the connection: \x1b]0;owned\x07\tä", Code.UNSUPPORTED)
    assert str(refused) == "127.0.0.1:47100 refused the connection: \\x1b]0;owned\\x07\\tä"
