# SPDX-License-Identifier: Apache-2.0
"""Tests the forces of the rendering examples, with and without a server."""

from __future__ import annotations

import contextlib
import runpy
import sys
from collections.abc import Callable, Iterable
from math import cos, hypot, pi, sin
from typing import Any

import pytest
from processes import EXAMPLES, Server, example, scene, summary_of
from tendon import DeviceState, Mode, Touch, cli

Physics = Callable[[DeviceState], Touch]
RENDERING = [
    "friction_surface",
    "magnet",
    "maze",
    "texture",
    "two_hands",
    "viscous_field",
    "virtual_fixture",
    "virtual_wall",
]


@pytest.fixture
def physics_of(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Physics]:
    """Returns the physics function of an example for the given arguments."""

    def load(name: str, *arguments: str) -> Physics:
        taken: list[Any] = []
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        monkeypatch.setattr(cli, "run", lambda options, physics: taken.append(physics) or 0)
        with pytest.raises(SystemExit):
            runpy.run_path(str(EXAMPLES / f"{name}.py"))
        (physics,) = taken
        return physics

    return load


def hand(position: Iterable[float], velocity: Iterable[float] = (0, 0, 0)) -> DeviceState:
    x, y, z = position
    u, v, w = velocity
    return DeviceState(1, 0, (x, y, z), (u, v, w), (0, 0, 0), 0, 8, 0, 0, 0, Mode.ACTIVE)


def work(physics: Physics, path: list[tuple[float, float, float]]) -> float:
    """Returns the work on the hand along this path, J."""
    total, before = 0.0, path[0]
    for at in path[1:]:
        middle = [(a + b) / 2 for a, b in zip(before, at)]
        total += sum(f * (b - a) for f, a, b in zip(physics(hand(middle)).force, before, at))
        before = at
    return total


def line(*corners: tuple[float, float, float], steps: int = 400) -> list[tuple[float, float, float]]:
    path = [corners[0]]
    for a, b in zip(corners, corners[1:]):
        path += [tuple(p + (q - p) * i / steps for p, q in zip(a, b)) for i in range(1, steps + 1)]  # type: ignore[misc]
    return path


@pytest.mark.parametrize("arguments", [("magnet",), ("texture",), ("virtual_fixture", "plane")])
def test_the_stiffness_that_is_sent_is_the_forces_slope(physics_of, arguments):
    physics = physics_of(*arguments)
    for at in ((0.001, 0.002, -0.003), (-0.007, 0.004, 0.001), (0.0123, -0.02, 0.03)):
        stiffness = physics(hand(at)).stiffness
        rows = stiffness if hasattr(stiffness[0], "__len__") else [[k * (i == j) for j in range(3)] for i, k in enumerate(stiffness)]
        for j in range(3):
            step = 1e-7
            more, less = ([c + s * (i == j) for i, c in enumerate(at)] for s in (step, -step))
            for i, (f, g) in enumerate(zip(physics(hand(more)).force, physics(hand(less)).force)):
                assert rows[i][j] == pytest.approx(-(f - g) / (2 * step), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize(
    "arguments",
    [("magnet",), ("texture",), ("virtual_fixture", "line"), ("virtual_fixture", "plane"), ("virtual_fixture", "cone")],
)
def test_a_round_trip_in_a_field_gives_no_energy(physics_of, arguments):
    corners = [(0.004, 0.001, 0.002), (-0.01, 0.02, 0.004), (0.013, -0.012, -0.02), (0.004, 0.001, 0.002)]
    assert work(physics_of(*arguments), line(*corners, steps=4000)) == pytest.approx(0, abs=1e-6)


def test_the_magnet_draws_in_and_most_at_its_reach(physics_of):
    magnet = physics_of("magnet", "--reach-mm", "8")
    pulls = [-magnet(hand((x / 1000, 0, 0))).force[0] for x in range(1, 30)]
    assert min(pulls) > 0
    assert pulls.index(max(pulls)) == 7


def test_honey_only_takes_energy(physics_of):
    honey = physics_of("viscous_field")
    velocity = (0.1, -0.2, 0.05)
    assert sum(f * v for f, v in zip(honey(hand((0, 0, 0), velocity)).force, velocity)) == pytest.approx(-5 * 0.0525)


def test_corduroy_repeats_with_its_pitch(physics_of):
    corduroy = physics_of("texture", "--pitch-mm", "4")
    for x in (0.0003, 0.0011, 0.0027):
        assert corduroy(hand((x, 0, 0))).force[0] == pytest.approx(corduroy(hand((x + 0.004, 0, 0))).force[0])
    assert corduroy(hand((0.001, 0, 0))).force[0] == pytest.approx(-0.8)


def test_the_table_carries_and_slips_at_coulombs_limit(physics_of):
    table = physics_of("friction_surface")
    normal = table(hand((0, 0, 0))).force[1]
    assert normal == pytest.approx(2)
    assert table(hand((0.0001, 0, 0))).force[0] == pytest.approx(-0.05)  # sticks like a spring of 500 N/m
    for i in range(100):
        force = table(hand((0.0001 * i, 0, 0.0002 * i))).force
        assert hypot(force[0], force[2]) <= 0.5 * normal * (1 + 1e-12)
    assert hypot(force[0], force[2]) == pytest.approx(0.5 * normal)
    assert force[0] / force[2] == pytest.approx(0.5, rel=1e-3)
    assert table(hand((0, 0.003, 0))).force == (0, 0, 0)


def test_rubbing_the_table_only_takes_energy(physics_of):
    table = physics_of("friction_surface")
    there_and_back = line((0, 0, 0), (0.02, 0, 0), (0, 0, 0.01), (0, 0, 0))
    assert work(table, there_and_back) < -0.02


@pytest.mark.parametrize("shape", ["line", "plane", "cone"])
def test_a_fixture_leads_back_to_its_nearest_point_and_lets_go_there(physics_of, shape):
    fixture = physics_of("virtual_fixture", shape)
    for at in ((0.02, 0.01, -0.01), (-0.01, -0.02, 0.002), (0.003, 0.04, 0.001)):
        force = fixture(hand(at)).force
        back = [c + f / 400 for c, f in zip(at, force)]
        assert max(map(abs, fixture(hand(back)).force)) < 1e-9
        near = [c + 0.3 * f / 400 for c, f in zip(at, force)]
        assert fixture(hand(near)).force == pytest.approx([0.7 * f for f in force])
    assert list(fixture(hand((0, 0, 0))).force) == pytest.approx([0, 0, 0])


def test_the_maze_lets_through_its_rooms_and_not_through_its_walls(physics_of):
    maze = physics_of("maze")
    for at in line((0, 0, 0), (-0.008, 0, 0), (-0.008, 0.008, 0), (-0.024, 0.008, 0), (-0.024, -0.008, 0)):
        assert maze(hand(at)).force[:2] == [0, 0], at
    maze = physics_of("maze")
    for x in range(1, 27):  # keeps moving right, against the wall at 12 mm
        force = maze(hand((0.001 * x, 0, 0))).force
        assert force[0] == pytest.approx(-1200 * max(0.0, 0.001 * x - 0.012)), x


def test_a_hand_that_slides_along_a_wall_meets_the_next_one(physics_of):
    maze = physics_of("maze")
    for at in line((0, 0, 0), (0.008, 0, 0), (0.008, 0.0125, 0), (0.027, 0.0125, 0)):
        force = maze(hand(at)).force
    assert force[:2] == [0, pytest.approx(-0.6)]  # 0.5 mm inside the wall at 12 mm
    for at in line((0.027, 0.0125, 0), (0.03, 0.0125, 0), (0.03, -0.008, 0)):
        force = maze(hand(at)).force
    assert force[:2] == [pytest.approx(-2.4), 0]  # 2 mm inside the wall at 28 mm, and along it
    for at in line((0.03, -0.008, 0), (0.03, 0, 0), (0.016, 0, 0)):
        force = maze(hand(at)).force
    assert force[0] == pytest.approx(1200 * 0.004)  # from the right into the block at the center


def test_a_full_turn_around_the_magnet_costs_nothing(physics_of):
    ring = [(0.01 * cos(2 * pi * i / 2000), 0.01 * sin(2 * pi * i / 2000), 0.002) for i in range(2001)]
    assert work(physics_of("magnet"), ring) == pytest.approx(0, abs=1e-9)


def test_the_rod_pulls_both_hands_with_one_force_along_itself(physics_of):
    rod = physics_of("two_hands", "--stiffness-n-per-m", "400", "--length-mm", "200")
    assert rod["left"](hand((0, 0, 0))).force == (0, 0, 0)  # the other hand does not hold the rod yet
    assert rod["right"](hand((0, 0, 0))).force == pytest.approx([0, 0, 0], abs=1e-9)
    pulled = rod["right"](hand((0.01, 0, 0))).force
    assert pulled == pytest.approx([-4, 0, 0])  # 10 mm too long
    assert rod["left"](hand((0, 0, 0))).force == pytest.approx([4, 0, 0])
    askew = rod["left"](hand((0, 0.03, -0.02))).force
    assert rod["right"](hand((0.01, 0, 0))).force == pytest.approx([-f for f in askew])
    assert [f / askew[0] for f in askew] == pytest.approx([1, -0.03 / 0.21, 0.02 / 0.21])


def test_the_rods_stiffness_is_its_forces_slope(physics_of):
    rod = physics_of("two_hands")
    rod["left"](hand((0.004, -0.01, 0.007)))
    at, step = (0.02, 0.013, -0.004), 1e-7
    rows = rod["right"](hand(at)).stiffness
    for j in range(3):
        more, less = ([c + s * (i == j) for i, c in enumerate(at)] for s in (step, -step))
        for i, (f, g) in enumerate(zip(rod["right"](hand(more)).force, rod["right"](hand(less)).force)):
            assert rows[i][j] == pytest.approx(-(f - g) / (2 * step), rel=1e-4, abs=1e-3)


def test_a_hand_feels_each_example_through_a_server(tmp_path):
    """All examples run concurrently, each with its own device."""
    names = [name for name in RENDERING if name != "two_hands"]  # needs two devices; tested in test_examples_in_cpp.py
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(Server(tmp_path, scenes={name: scene("right") for name in names}))
        engines = {}
        for name in names:
            shape = ["line"] if name == "virtual_fixture" else []
            where = ["--server", server.address, "--device", name, "--rate-hz", "100"]
            engines[name] = stack.enter_context(example(tmp_path, name, *shape, *where, "--duration-s", "1", "--json"))
        for name, engine in engines.items():
            engine.wait_for_line('"summary"')
            assert summary_of(engine)["summary"]["forces"] > 20, name
