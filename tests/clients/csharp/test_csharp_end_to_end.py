# SPDX-License-Identifier: Apache-2.0
"""Runs the C# programs under mono with a real tendond. TENDON_CSHARP is the folder of the compiled programs."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest
from processes import PROGRAMS, Process, Server, scene, tendond

from tendon import Client, Config, Mode, Role

pytestmark = pytest.mark.skipif(
    shutil.which("mono") is None or "TENDON_CSHARP" not in os.environ, reason="no mono, or TENDON_CSHARP is not set"
)


def program(folder: Path, name: str, *words: str | Path) -> Process:
    return Process(folder, ["mono", Path(os.environ["TENDON_CSHARP"]) / f"{name}.exe", *words])


def hand(folder: Path, server: str, *words: str | Path) -> Process:
    """A TendonHand with a wall of 1000 N/m at x = 0, in a loop of 50 Hz."""
    return program(folder, "hand", "--server", server, *words)


def summary(process: Process) -> dict[str, Any]:
    assert process.wait() == 0
    return dict(json.loads(process.said[-1]))


def keygen(folder: Path, name: str) -> Path:
    folder.mkdir(exist_ok=True)
    key = folder / f"{name}.key"
    subprocess.run([tendond(), "keygen", name, "--out", key], check=True, capture_output=True)
    return key


def far_wall(folder: Path, limiter: bool, *words: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """A hand presses 6 times into a wall of 1000 N/m, whose engine is 20 ms away in each direction. Returns what the
    engine felt, and the report on the recording."""
    recording = folder / "run.mcap"
    text = scene("demo").replace('path = "demo.mcap"', f'path = "{recording}"')
    if not limiter:
        text = text.replace('kind = "aol+"', 'kind = "none"').replace('preset = "feel"', "")
    with Server(folder, scenes={"demo": text}) as server:
        options = ["--listen", "127.0.0.1:0", "--to", server.address, "--profile", "delay=20ms", "--json"]
        with Process(folder, [PROGRAMS / "tendon-inject", *options]) as network:
            far = json.loads(network.wait_for_line('"listen"'))["listen"]
            with hand(folder, far, "--seconds", "12", "--valid-for", "0.1", *words) as wall:
                felt = summary(wall)
        server.end()
    report = json.loads(subprocess.check_output([PROGRAMS / "tendon-report", recording, "--json"]))
    names = ("limiter_on", "least_energy_j", "energy_given_out_j", "peak_force_n", "forces_per_s")
    print(felt, {name: report[name] for name in names})
    assert felt["touches"] > 200
    assert felt["most_force_n"] > 0.5, "the wall was not felt"
    assert report["limiter_on"] is limiter
    return felt, report


def test_a_wall_with_stiffness_at_50_hz_and_20_ms_away_gives_out_no_energy(tmp_path):
    _, report = far_wall(tmp_path, True)
    assert report["energy_given_out_j"] == 0
    assert report["least_energy_j"] >= -1e-9


def test_the_same_wall_without_stiffness_and_limiter_gives_out_energy(tmp_path):
    _, report = far_wall(tmp_path, False, "--no-stiffness")
    assert report["energy_given_out_j"] > 1


def test_fixed_update_does_not_allocate(tmp_path):
    with Server(tmp_path) as server, hand(tmp_path, server.address, "--seconds", "6") as wall:
        felt = summary(wall)
        assert felt["measured"] > 50
        assert felt["allocated"] == 0, felt


def test_turns_of_the_blocking_client_do_not_allocate(tmp_path):
    with Server(tmp_path) as server, hand(tmp_path, server.address, "--turns", "5000") as client:
        felt = summary(client)
        assert felt["turns"] >= 1000
        # On a busy machine, forces are late, and the reports of the server say this in texts.
        assert felt["allocated"] < felt["turns"], felt


def test_a_paused_game_fades_its_force_and_feels_again(tmp_path):
    with Server(tmp_path) as server:
        with Client(server.address, Config(role=Role.OBSERVER)) as observer:
            with hand(tmp_path, server.address, "--seconds", "9", "--pause-at", "3", "--pause", "3") as wall:
                modes, since = [], 0
                for state in observer.states(30):
                    if not modes or modes[-1] is not state.mode:
                        # A busy machine can also be silent for a short time, but not for two seconds.
                        if modes and modes[-1] is Mode.SAFE_STOP and state.tick - since > 2000:
                            break
                        modes.append(state.mode)
                        since = state.tick
                    if state.mode is Mode.SAFE_STOP:
                        assert abs(state.force_applied[0]) < 1e-6
                assert summary(wall)["touches"] > 0
        assert state.mode is Mode.ACTIVE, modes
        assert modes[-2:] == [Mode.DECAYING, Mode.SAFE_STOP], modes
        assert Mode.ACTIVE in modes
        assert server.end()["welcomed"] == 2, "the session lives during the pause"


def test_a_disabled_hand_says_bye(tmp_path):
    with Server(tmp_path) as server, hand(tmp_path, server.address, "--seconds", "2") as wall:
        assert summary(wall)["touches"] > 0
        left = json.loads(server.wait_for_line('"left"'))
        assert left["why"] == "the component was disabled"


def test_a_hand_that_dies_lets_go_and_its_successor_is_welcomed(tmp_path):
    with Server(tmp_path) as server, Client(server.address, Config(role=Role.OBSERVER)) as observer:
        with hand(tmp_path, server.address, "--seconds", "20") as wall:
            for state in observer.states(30):
                if state.force_applied[0] < -0.5:
                    break
            wall.stop(signal.SIGKILL)
            for state in observer.states(5):
                if state.mode is Mode.SAFE_STOP:
                    break
        with hand(tmp_path, server.address, "--seconds", "6") as wall:
            assert summary(wall)["touches"] > 0


def test_an_exception_in_touch_is_logged_and_disables_the_component(tmp_path):
    with Server(tmp_path) as server, hand(tmp_path, server.address, "--seconds", "2", "--throw") as wall:
        felt = summary(wall)
        assert felt["touches"] == 1 and not felt["enabled"]
        assert "exception: a bug in the game\n" in wall.said


def test_a_key_is_used_and_a_wrong_one_is_a_clear_warning(tmp_path):
    key = keygen(tmp_path / "keys", "right")
    wrong = keygen(tmp_path / "others", "wrong")
    with Server(tmp_path, keys=tmp_path / "keys") as server:
        with hand(tmp_path, server.address, "--seconds", "3", "--key", key) as wall:
            assert summary(wall)["touches"] > 0
        with hand(tmp_path, server.address, "--seconds", "5", "--key", wrong) as wall:
            felt = summary(wall)
            expected = f"no answer from {server.address}: is tendond running there, and does it have this key?"
            assert felt["touches"] == 0 and felt["status"] == expected
            assert f"warning: Tendon: {expected}\n" in wall.said
        with hand(tmp_path, server.address, "--seconds", "2") as wall:
            felt = summary(wall)
            assert felt["touches"] == 0 and felt["status"].startswith("refused (Denied): "), felt


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("controller 00\n", "got 2 characters"),
        ("controller " + "00" * 32 + "\n", "the key is weak"),
        ("", "expected one line"),
    ],
)
def test_a_bad_key_file_is_named_with_the_reason(tmp_path, text, why):
    key = tmp_path / "bad.key"
    key.write_text(text)
    key.chmod(0o600)
    with hand(tmp_path, "127.0.0.1:9", "--seconds", "0.1", "--key", key) as wall:
        assert not summary(wall)["enabled"]
        assert any(str(key) in line and why in line for line in wall.said), wall.said


def test_a_key_file_that_others_can_read_is_refused(tmp_path):
    key = keygen(tmp_path, "open")
    key.chmod(0o644)
    with program(tmp_path, "virtual_wall", "--key", key) as wall:
        assert wall.wait() == 2
        assert "users other than its owner can read it" in wall.said[-1]


@pytest.mark.parametrize(
    "words",
    [["--server", "nowhere"], ["--server", "no-such-host.invalid:1"], ["--server"], ["--surprise", "1"], ["--rate", "x"]],
)
def test_wrong_options_are_one_line(tmp_path, words):
    with program(tmp_path, "virtual_wall", *words) as wall:
        assert wall.wait() == 2
        assert len(wall.said) == 1 and wall.said[0].startswith("virtual_wall: "), wall.said


def test_a_flooding_server_does_not_keep_the_hand_from_ending(tmp_path):
    """It answers the Hello with an endless stream of damaged datagrams."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        server.settimeout(10)
        with hand(tmp_path, "127.0.0.1:%d" % server.getsockname()[1], "--seconds", "3") as wall:
            _, client = server.recvfrom(2000)
            server.settimeout(0)
            for i in range(200_000):
                try:
                    server.sendto(os.urandom(16) + bytes([0x54, 0x14, 0, 0]) + os.urandom(40 + i % 1100), client)
                except OSError:
                    break
            felt = summary(wall)
            assert felt["touches"] == 0
