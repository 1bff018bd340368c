# SPDX-License-Identifier: Apache-2.0
"""Tests tendon-bridge vrpn with real sockets and vrpn_client.py, which only uses VRPN.md."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import time
from pathlib import Path

import pytest
from vrpn_client import COOKIE, UDP, Client, description, field, message, messages_in, plane
from vrpn_stage import BUTTON, PROGRAMS, ROOT, Program, bridge, server

if not (PROGRAMS / "tendon-bridge").exists():
    pytest.skip("tendon-bridge is not built", allow_module_level=True)

FORCE = "vrpn_ForceDevice Force"
POSE = "vrpn_Tracker Pos_Quat"


class Stage:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.server = server(folder)
        self.bridge = bridge(folder, self.server.address())
        self.address = self.bridge.address()
        self.bridge.wait_for("connected to")


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    it = Stage(tmp_path_factory.mktemp("vrpn"))
    with it.server, it.bridge:
        yield it
        assert it.bridge.process.poll() is None, it.bridge.err.read_text()


def test_the_golden_messages_are_what_this_client_says_and_reads():
    page = (ROOT / "clients" / "bridge" / "vrpn" / "GOLDEN.md").read_text(encoding="utf-8")
    golden = {}
    for name, block in re.findall(r"^```golden (\S+)\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        golden[name] = bytes.fromhex(" ".join(line.partition(";")[0] for line in block.splitlines()))
    assert golden["cookie"] == COOKIE
    assert golden["hello"] == b"127.0.0.1 40000\0"

    def said(sender, type_, payload):
        return message(sender, type_, payload, stamp=1700000000.25, sequence=7)

    assert golden["sender-description"] == said(0, -1, description("Phantom0"))
    assert golden["udp-description"] == said(40001, UDP, b"127.0.0.1\0")
    values = {"origin": (0.01, 0.02, 0.03), "force": (1, -2, 3), "radius": 0.25}
    assert golden["force-field"] == said(0, 13, field(jacobian=(-100, 0, 0, 0, -200, 0, 5, 0, -300), **values))
    assert golden["plane"] == said(0, 14, plane((0, 2, 0, 0.02), 0.8, 0.001, 0.25, 0.5, index=1, cycles=4))
    for name, data in golden.items():
        if name not in ("cookie", "hello"):
            ((_, _, stamp, _, end),) = messages_in(data)
            assert (stamp, end) == (1700000000.25, len(data)), name


@pytest.mark.parametrize("by_hello", [True, False], ids=["hello", "tcp"])
@pytest.mark.parametrize("udp", [True, False], ids=["datagrams", "stream"])
def test_poses_come_and_forces_are_felt_by_every_way(stage, by_hello, udp):
    with Client(stage.address, by_hello=by_hello, udp=udp) as client:
        assert client.their_cookie == COOKIE
        end = time.monotonic() + 30
        force = (0.0, 0.0, 0.0)
        while abs(force[1] - 0.7) > 1e-3:
            assert time.monotonic() < end, force
            client.force_field(force=(0, 0.7, 0))
            force = client.wait(FORCE)
        pose = client.wait(POSE, lambda pose: pose[3] > 1e-3)
        assert abs(pose[2]) < 1e-3 and abs(pose[4]) < 1e-3, pose
        assert pose[5:9] == (0, 0, 0, 1)
        while udp and client.by_datagram == 0:  # poses sent earlier by the stream are read first
            assert time.monotonic() < end
            client.wait(POSE)
        assert (client.by_datagram > 0) == udp
        assert len(client.wait("vrpn_Analog Channel")) == 4
        assert len(client.wait("vrpn_Tracker Velocity")) == 10


def test_nothing_is_dialled_that_the_hello_names(stage):
    """The text names 127.0.0.2, but the datagram comes from 127.0.0.1."""
    other = socket.create_server(("127.0.0.2", 0))
    other.settimeout(0.2)  # a connection would arrive before that of `ours`
    ours = socket.create_server(("127.0.0.1", other.getsockname()[1]))
    ours.settimeout(30)
    lob = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    host, _, port = stage.address.rpartition(":")
    lob.sendto(f"127.0.0.2 {other.getsockname()[1]}\0".encode(), (host, int(port)))
    with ours.accept()[0]:
        pass
    with pytest.raises(TimeoutError):
        other.accept()


def test_a_hello_to_a_port_where_nobody_answers_keeps_nobody_waiting(stage):
    closed = socket.create_server(("127.0.0.1", 0))
    port = closed.getsockname()[1]
    closed.close()
    host, _, server_port = stage.address.rpartition(":")
    lob = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with Client(stage.address) as client:
        client.wait(POSE)
        before = stage.bridge.counts()
        for text in (f"a {port}\0", "a 22\0", "nonsense", "", "a -1\0", "a 99999\0"):
            for _ in range(5):
                lob.sendto(text.encode(), (host, int(server_port)))
        after = stage.bridge.counts()
        client.wait(POSE)
    assert after["reports"] - before["reports"] >= 0.9 * (after["states"] - before["states"])


def test_the_seventeenth_program_finds_no_place_until_one_leaves(stage):
    clients = [Client(stage.address, by_hello=False) for _ in range(16)]
    try:
        for client in clients:
            client.wait(POSE)
        host, _, port = stage.address.rpartition(":")
        with socket.create_connection((host, int(port)), timeout=30) as one_more:
            assert one_more.recv(100) == b""
        stage.bridge.wait_for("16 is the maximum number of clients")
        clients.pop().close()
        end = time.monotonic() + 30
        while True:
            try:
                clients.append(Client(stage.address, by_hello=False))
                break
            except OSError:
                assert time.monotonic() < end
        clients[-1].wait(POSE)
    finally:
        for client in clients:
            client.close()
        while stage.bridge.counts()["clients"] > 0:
            pass


@pytest.fixture(scope="module")
def silent(stage):
    """A connection that sends nothing. The server's timeout of 3 s runs during the next test."""
    host, _, port = stage.address.rpartition(":")
    with socket.create_connection((host, int(port)), timeout=30) as connection:
        yield connection


def test_a_program_that_never_reads_is_dropped_and_nobody_notices(stage, silent):
    with Client(stage.address, by_hello=False) as deaf, Client(stage.address) as client:
        end = time.monotonic() + 30
        while "it does not read its data" not in stage.bridge.err.read_text():
            assert time.monotonic() < end
            client.read()
            client.inbox.clear()
        assert deaf.wait_closed()
        client.wait(POSE)


def test_who_says_nothing_is_dropped(stage, silent):
    while silent.recv(100):
        pass
    stage.bridge.wait_for("did not send the VRPN handshake")


def processor_time_s(program: Program) -> float:
    fields = Path(f"/proc/{program.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_every_state_is_one_report_and_nobody_waits_busily(stage):
    with Client(stage.address) as client:
        client.wait(POSE)
        before = stage.bridge.counts()
        start, busy = time.monotonic(), processor_time_s(stage.bridge)
        after = stage.bridge.counts()
        taken, busy = time.monotonic() - start, processor_time_s(stage.bridge) - busy
    assert taken > 0.5 and busy < 0.3 * taken  # measured: 0.03; 1 for a loop that does not sleep
    reports = after["reports"] - before["reports"]
    # The counts are printed between the two.
    assert abs(reports - (after["states"] - before["states"])) <= 2
    assert reports > 500


@pytest.mark.parametrize("udp", [True, False], ids=["datagrams", "stream"])
def test_a_program_without_a_pause_is_felt_by_its_newest_field(stage, udp):
    with Client(stage.address, udp=udp) as client:
        client.wait(POSE)
        before = stage.bridge.counts()
        size, end = stage.bridge.size(), time.monotonic() + 30
        n = 0
        while stage.bridge.size() <= size:  # the counts then only include this loop
            assert time.monotonic() < end
            for _ in range(20):
                n += 1
                client.force_field(force=(0, 0.1 + 1e-7 * n, 0))
            client.read(0)
            client.inbox.clear()
        after = stage.bridge.last_counts()
        last = 0.1 + 1e-7 * n
        while True:  # repeated, because a datagram may be lost
            client.force_field(force=(0, last, 0))
            if abs(client.wait(FORCE)[1] - last) < 1e-6:
                break
    states = after["states"] - before["states"]
    # If several states arrive at once, only the newest is reported.
    assert 0.8 * states < after["reports"] - before["reports"] <= states + 2
    assert after["skipped"] > before["skipped"]
    assert after["forces"] - before["forces"] < 7 * states


def test_a_button_is_told_and_a_server_that_comes_back_is_found(tmp_path):
    with server(tmp_path, BUTTON) as first:
        address = first.address()
        with bridge(tmp_path, address) as between, Client(between.address()) as client:
            assert client.wait("vrpn_Button Change")[0] == 0
            first.stop()
            assert "lost" in client.wait_for_text()
            with server(tmp_path, BUTTON, listen=address):
                assert client.wait(POSE)
                assert client.wait("vrpn_Button Change", lambda change: change == (0, 1))
                assert client.wait("vrpn_Button Change", lambda change: change == (0, 0))


def test_beyond_this_machine_it_listens_only_when_that_is_meant(tmp_path):
    refused = subprocess.run(
        [PROGRAMS / "tendon-bridge", "vrpn", "--listen", "0.0.0.0:0"], capture_output=True, text=True, timeout=30
    )
    assert refused.returncode == 1
    assert "anyone who can reach this port can move the motors" in refused.stderr
    with Program(
        tmp_path, "tendon-bridge", "vrpn", "--listen", "0.0.0.0:0", "--anybody", "--duration-s", "60"
    ) as meant:
        meant.wait_for("anyone who can reach this port can move the motors")
