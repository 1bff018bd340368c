# SPDX-License-Identifier: Apache-2.0
"""Tests the client with a real tendond on loopback."""

from __future__ import annotations

import asyncio
import json
import signal
import socket
import subprocess

import pytest
from processes import Server, example, scene, summary_of, tendond

from tendon import Client, Config, DeviceState, Phase, RefusedForGood, Role, Touch, aio, read_key

STIFFNESS = 2000

LEASED = '[[channel]]\nname = "tissue"\nlease_ms = 300\n[network]\ncontroller_timeout_ms = 60000\n'
"""If a client sends no force for 0.3 s, it loses the channel to the next client that asks for it. Its session times out
after one minute."""


def wall(hand: DeviceState) -> Touch:
    return Touch((-STIFFNESS * max(hand.position[0], 0), 0, 0), (STIFFNESS, 0, 0))


def felt(hand: DeviceState) -> bool:
    """Returns whether the device reports an applied force."""
    return hand.force_applied[0] < -0.5


def test_a_wall_of_the_blocking_client_is_felt(tmp_path):
    with Server(tmp_path) as server:
        with Client(server.address, Config(name="wall", rate_hz=200)) as client:
            for hand in client.states(30):
                client.send(hand, wall(hand))
                if felt(hand):
                    break
            else:
                pytest.fail("nothing was felt")
            forces = client.stats.forces
            assert client.welcome.loop_hz == 1000
            assert client.stats.link.smoothed_round_trip_ns > 0
        assert server.end()["forces"] >= forces - 1


def test_a_socket_file_leads_to_its_server_and_to_the_next_one_there(tmp_path):
    near = {"scene": scene("demo") + '\n[network]\nunix = "near.sock"\n'}
    with Server(tmp_path, scenes=near) as first:
        with Client(f"unix:{tmp_path / 'near.sock'}", Config(name="wall", rate_hz=200)) as client:
            hands = client.states(30)
            assert next(hands).tick > 0
            first.stop(signal.SIGKILL)
            with Server(tmp_path, scenes=near):
                for hand in hands:
                    client.send(hand, wall(hand))
                    if client.stats.sessions == 2 and felt(hand):
                        break
                else:
                    pytest.fail("the second server was not found")


@pytest.mark.parametrize("path", ["", "x" * 108])
def test_a_socket_file_needs_a_path_that_a_socket_can_have(path):
    with pytest.raises(ValueError, match="expected unix:PATH with a path of 1 to 107 bytes"):
        Client(f"unix:{path}", Config(name="wall"))


def test_a_wall_of_the_asyncio_client_is_felt_while_other_tasks_run(tmp_path):
    async def main(address):
        turns = 0

        async def neighbour():
            nonlocal turns
            while True:
                turns += 1
                await asyncio.sleep(0)

        async def physics(hand):
            await asyncio.sleep(0)
            if felt(hand):
                done.set()
            return wall(hand)

        done = asyncio.Event()
        async with aio.Client(address, Config(name="wall")) as client:
            tasks = [asyncio.create_task(neighbour()), asyncio.create_task(client.drive(physics, 30))]
            await asyncio.wait_for(done.wait(), 30)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            return turns, client.stats.forces

    with Server(tmp_path) as server:
        turns, forces = asyncio.run(main(server.address))
        assert turns > 0
        assert server.end()["forces"] >= forces - 1


def test_the_asyncio_session_is_kept_alive_while_nobody_asks_for_states(tmp_path):
    async def main(address):
        async with aio.Client(address, Config(role=Role.OBSERVER)) as client:
            async for _ in client.states(30):
                break
            before = client.stats.link.datagrams_sent
            while client.stats.link.datagrams_sent < before + 10 and client.stats.phase is Phase.OPEN:
                await asyncio.sleep(0.01)
            return client.stats

    with Server(tmp_path) as server:
        stats = asyncio.run(asyncio.wait_for(main(server.address), 30))
        assert (stats.phase, stats.sessions) == (Phase.OPEN, 1)


def test_an_observer_looks_on_beside_a_controller(tmp_path):
    with Server(tmp_path) as server, example(tmp_path, "virtual_wall", "--server", server.address) as engine:
        engine.wait_for_line("connected")
        with Client(server.address, Config(role=Role.OBSERVER, rate_hz=100)) as client:
            assert any(felt(hand) for hand in client.states(30))
            with pytest.raises(PermissionError):
                client.send(next(client.states(30)), Touch())


def test_an_observer_sees_the_button_knows_its_name_and_which_way_is_up(tmp_path):
    demo = scene("demo").replace("[device.hand]", "[device.hand]\nbutton_after_ms = 700")
    turned = demo.replace("[device]", '[device]\naxes = "right=-y up=z user=-x"')
    with Server(tmp_path, scenes={"device": turned}) as server:
        with Client(server.address, Config(role=Role.OBSERVER)) as client:
            seen = []
            for hand in client.states(30):
                seen.append(hand.buttons)
                if hand.buttons:
                    break
            assert set(seen[:-1]) == {0}
            assert seen[-1] == 1
            about = client.handle
            assert about is not None
            assert tuple(about.buttons) == ("button",)
            assert about.operator_from_device is not None
            w, x, y, z = about.operator_from_device
            assert (abs(w), x / w, y / w, z / w) == (0.5, -1, 1, 1)


def test_a_second_controller_waits_and_takes_over_when_the_first_leaves(tmp_path):
    with Server(tmp_path) as server, example(tmp_path, "virtual_wall", "--server", server.address) as first:
        first.wait_for_line("connected")
        with example(tmp_path, "virtual_wall", "--server", server.address) as second:
            second.wait_for_line("refused")
            assert first.stop(signal.SIGINT) == 0
            second.wait_for_line("connected")
            assert second.stop() == 0


def test_a_server_that_is_killed_and_started_again_is_found_again(tmp_path):
    with Server(tmp_path) as server:
        address = server.address
        guest = example(tmp_path, "virtual_wall", "--server", address, "--json")
        guest.wait_for_line("connected")
        server.stop(signal.SIGKILL)
    with guest, Server(tmp_path, listen=address):
        guest.wait_for_line("lost")
        guest.wait_for_line("connected")
        assert guest.stop() == 0
        assert summary_of(guest)["summary"]["sessions"] == 2


def test_what_the_physics_raises_comes_out_after_a_bye(tmp_path):
    def broken(hand):
        raise ZeroDivisionError

    with Server(tmp_path) as server:
        with pytest.raises(ZeroDivisionError):
            with Client(server.address) as client:
                client.drive(broken, 30)
        server.wait_for_line("has left")


def test_echo_motion_prints_json_lines_and_a_summary(tmp_path):
    with Server(tmp_path) as server, example(
        tmp_path, "echo_motion", "--server", server.address, "--json", "--duration-s", "0.3"
    ) as echo:
        line = json.loads(echo.wait_for_line('"tick"'))
        assert {"tick", "position_m", "force_n", "force_wanted_n", "round_trip_ms"} == set(line)
        assert echo.wait() == 0
        assert summary_of(echo)["summary"]["states"] > 0


def test_an_observer_with_json_is_told_of_the_loop_and_of_the_engine(tmp_path):
    with Server(tmp_path) as server, example(tmp_path, "virtual_wall", "--server", server.address), example(
        tmp_path, "echo_motion", "--server", server.address, "--json", "--duration-s", "60"
    ) as echo:
        while True:  # the first report may precede the engine
            device = json.loads(echo.wait_for_line('{"device":'))["device"]
            assert sum(device["lateness_us_log2"]) == device["steps"] > 0
            assert device["safety"] == "unguarded"
            peer = json.loads(echo.wait_for_line('{"peer":'))["peer"]
            assert peer["name"] == "virtual_wall" and not peer["forces_refused"]
            wanted = json.loads(echo.wait_for_line('"tick"'))["force_wanted_n"]
            assert len(wanted) == 3
            if peer["link"]["forces"] > 0 and peer["link"]["round_trip_ms"] is not None:
                break
        assert echo.stop() == 0


def test_an_engine_drives_the_device_that_it_names_and_no_other(tmp_path):
    with Server(tmp_path, scenes={name: scene(name) for name in ("left", "right")}) as server:
        with example(tmp_path, "virtual_wall", "--server", server.address, "--device", "right") as engine:
            engine.wait_for_line("connected")
            with Client(server.address, Config(role=Role.OBSERVER, device="right")) as observer:
                assert any(felt(hand) and observer.description is not None for hand in observer.states(30))
                assert (observer.description.name, observer.description.channels[0].holder) == ("right", "virtual_wall")
            assert engine.stop() == 0
        left, right = (device["channels"][0]["forces"] for device in server.end()["devices"])
        assert left == 0 < right


def test_a_device_that_is_not_there_is_refused_for_good(tmp_path):
    with Server(tmp_path) as server:
        with example(tmp_path, "virtual_wall", "--server", server.address, "--device", "none") as engine:
            engine.wait_for_line("refused")
            assert engine.wait() == 1


def test_a_hanging_engine_loses_its_lease_is_told_and_takes_it_back(tmp_path):
    def waits_until(client, has_come_true):
        """Runs the client until the condition is true."""
        for _ in range(300):
            list(client.states(0.1))
            if has_come_true():
                return True
        return False

    with Server(tmp_path, scenes={"device": scene("left") + LEASED}) as server:
        first = Client(server.address, Config(name="first", channel="tissue"))
        second = Client(server.address, Config(name="second", channel="tissue", take_lease=True))
        with first, second:
            assert next(first.states(30)) and first.holds
            # `first` stops answering here.
            for hand in second.states(30):
                second.send(hand, wall(hand))
                if felt(hand):
                    break
            assert second.holds
            server.wait_for_line("takes device/tissue from")
            assert waits_until(first, lambda: not first.holds)
            assert first.stats.lease_lost_to == "second"
            assert second.give_lease() and not second.holds
            assert first.take_lease() and waits_until(first, lambda: first.holds)
            assert (first.stats.sessions, first.stats.lease_lost_to) == (1, "")
        end = server.end()
        assert (end["devices"][0]["channels"][0]["handovers"], end["replaced"], end["welcomed"]) == (1, 0, 2)


def test_an_example_takes_the_lease_of_the_channel_it_is_told(tmp_path):
    with Server(tmp_path, scenes={"device": scene("left") + LEASED}) as server:
        with Client(server.address, Config(channel="tissue")) as first:
            assert next(first.states(30))
            with example(
                tmp_path, "virtual_wall", "--server", server.address, "--channel", "tissue", "--take-lease"
            ) as second:
                server.wait_for_line("takes device/tissue from")
                assert second.stop() == 0


def test_without_a_server_an_example_says_so_and_leaves_with_1(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
        silent.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        with example(tmp_path, "virtual_wall", "--server", address) as guest:
            guest.wait_for_line(f"no answer from {address}")
            assert guest.stop() == 1


def test_a_key_that_is_not_there_is_said_and_leaves_with_1(tmp_path):
    with example(tmp_path, "virtual_wall", "--key", "no.key") as guest:
        assert guest.wait() == 1
        assert "no.key" in guest.said[-1] and "Traceback" not in "".join(guest.said)


# ---- With keys ----


@pytest.fixture
def keys(tmp_path):
    """A folder with wall.key and screen.key, which is an observer's."""
    folder = tmp_path / "keys"
    folder.mkdir()
    for words in (["wall"], ["screen", "--observer"]):
        subprocess.run([tendond(), "keygen", *words], cwd=folder, check=True, capture_output=True)
    return folder


def test_a_wall_is_felt_through_a_sealed_session(tmp_path, keys):
    config = Config(name="wall", key=read_key(keys / "wall.key"), rate_hz=200)
    with Server(tmp_path, keys=keys) as server:
        with Client(server.address, config) as client:
            for hand in client.states(30):
                client.send(hand, wall(hand))
                if felt(hand):
                    break
            else:
                pytest.fail("nothing was felt")
            assert (client.stats.link.forged, client.stats.link.malformed) == (0, 0)
        assert server.end()["forces"] > 0


def test_an_example_takes_a_key_file(tmp_path, keys):
    with Server(tmp_path, keys=keys) as server:
        with example(tmp_path, "echo_motion", "--server", server.address, "--key", keys / "screen.key") as echo:
            echo.wait_for_line("tick")
            assert echo.stop() == 0


def test_with_another_key_there_is_no_answer_and_without_one_a_sentence(tmp_path, keys):
    with Server(tmp_path, keys=keys) as server:
        stranger = Config(key=bytes(range(100, 132)), patience_s=0.5)
        with Client(server.address, stranger) as client:
            assert list(client.states(1)) == []
            assert client.stats.sessions == 0
        with Client(server.address) as client, pytest.raises(RefusedForGood, match="key"):
            next(client.states(30))


def test_an_observers_key_does_not_control(tmp_path, keys):
    with Server(tmp_path, keys=keys) as server:
        with Client(server.address, Config(key=read_key(keys / "screen.key"))) as client:
            with pytest.raises(RefusedForGood):
                next(client.states(30))


def test_another_program_with_the_same_key_takes_the_place_for_good(tmp_path, keys):
    config = Config(key=read_key(keys / "wall.key"))
    with Server(tmp_path, keys=keys) as server:
        with Client(server.address, config) as first, Client(server.address, config) as second:
            assert next(first.states(30)) and next(second.states(30))
            with pytest.raises(RefusedForGood):
                for _ in first.states(30):
                    pass
            assert next(second.states(30))
