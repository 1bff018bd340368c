# SPDX-License-Identifier: Apache-2.0
"""The rendering examples in C++ must agree with those in Python for the same states, options and errors."""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest
from conftest import ROOT
from processes import EXAMPLES, PROGRAMS, Process, Server, said_by_example, scene
from tendon import Touch
from test_rendering_examples import RENDERING, Physics, hand, physics_of  # noqa: F401

IN_CPP = ROOT / "clients" / "cpp" / "examples"
TEST_PROGRAMS = Path(os.environ.get("TENDON_TEST_PROGRAMS", ROOT / "build" / "release" / "tests"))
MOST_LINES = 30

Hand = tuple[str, tuple[float, ...], tuple[float, ...]]
"""Device, position in m, velocity in m/s."""


def built(program: Path) -> Path:
    if not program.exists():
        pytest.skip(f"{program} is not built; TENDON_PROGRAMS and TENDON_TEST_PROGRAMS name other folders")
    return program


def wandering(devices: list[str], seed: int) -> Iterator[Hand]:
    """Yields hands that move within the workspace of the examples: |x|, |y| ≤ 35 mm and |z| ≤ 10 mm."""
    dice = random.Random(seed)
    at = {device: (0.0, 0.0, 0.0) for device in devices}
    for _ in range(150):
        aim = {device: (dice.uniform(-0.035, 0.035), dice.uniform(-0.035, 0.035), dice.uniform(-0.01, 0.01)) for device in devices}
        for device in random.Random(seed).choices(devices, k=20):
            step = tuple((b - a) * 0.1 for a, b in zip(at[device], aim[device]))
            at[device] = tuple(a + s for a, s in zip(at[device], step))  # type: ignore[assignment]
            yield device, at[device], tuple(1000 * s for s in step)


def flat(touch: Touch) -> list[float]:
    """Returns the force and, if it is sent, the nine elements of the stiffness."""
    stiffness = touch.stiffness
    if stiffness is None:
        return list(touch.force)
    if not hasattr(stiffness[0], "__len__"):
        return [*touch.force, *(stiffness[i] * (i == j) for i in range(3) for j in range(3))]
    return [*touch.force, *(k for row in stiffness for k in row)]


def in_cpp(name: str, arguments: tuple[str, ...], hands: list[Hand]) -> list[list[float]]:
    lines = "".join(f"{device} {' '.join(map(repr, (*x, *v)))}\n" for device, x, v in hands)
    command = [built(TEST_PROGRAMS / "touch_lines"), name, *arguments]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=60, check=True)
    return [[float(word) for word in line.split()] for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    "name, arguments",
    [
        ("friction_surface", ()),
        ("friction_surface", ("--height-mm", "-3", "--friction", "0.9")),
        ("magnet", ()),
        ("magnet", ("--stiffness-n-per-m", "150", "--reach-mm", "5")),
        ("maze", ()),
        ("texture", ()),
        ("texture", ("--pitch-mm", "3", "--force-n", "0.3")),
        ("two_hands", ()),
        ("two_hands", ("--stiffness-n-per-m", "900", "--length-mm", "180")),
        ("virtual_fixture", ("line",)),
        ("virtual_fixture", ("plane",)),
        ("virtual_fixture", ("cone", "--stiffness-n-per-m", "250")),
        ("virtual_wall", ()),
        ("virtual_wall", ("--local-model", "--stiffness-n-per-m", "800")),
        ("viscous_field", ()),
        ("viscous_field", ("--damping-n-s-per-m", "12")),
    ],
)
def test_cpp_answers_as_python_does(physics_of: Callable[..., Physics], name, arguments):  # noqa: F811
    physics = physics_of(name, *arguments)
    by_device = physics if isinstance(physics, dict) else {"any": physics}
    hands = list(wandering(sorted(by_device), seed=7))
    python = [flat(by_device[device](hand(x, v))) for device, x, v in hands]  # type: ignore[arg-type]
    assert sum(any(touch[:3]) for touch in python) > 300, "too few of these hands feel anything"
    for here, ours, theirs in zip(hands, python, in_cpp(name, arguments, hands), strict=True):
        assert theirs == pytest.approx(ours, rel=1e-9, abs=1e-9), here


@pytest.mark.parametrize("name", RENDERING)
def test_both_languages_have_the_same_options(name):
    def options(help_text: str) -> set[str]:
        # Only the C++ examples can wait without sleeping, or mark datagrams.
        return set(re.findall(r"--[a-z][a-z-]*", help_text)) - {"--version", "--busy", "--dscp"}

    cpp = subprocess.run([built(PROGRAMS / name), "--help"], capture_output=True, text=True, timeout=60, check=True)
    code, python, _ = said_by_example(name, "--help")
    assert code == 0 and options(cpp.stdout) == options(python)


@pytest.mark.parametrize(
    "name, wrong",
    [
        ("magnet", ("--reach-mm", "0")),
        ("texture", ("--pitch-mm", "0.4")),
        ("texture", ("--force-n", "-1")),
        ("friction_surface", ("--height-mm", "-101")),
        ("two_hands", ("--length-mm", "0")),
        ("viscous_field", ("--damping-n-s-per-m", "nan")),
        ("virtual_fixture", ("circle",)),
        ("virtual_fixture", ()),
    ],
)
def test_both_languages_refuse_the_same_mistakes_with_two(tmp_path, name, wrong):
    with Process(tmp_path, [built(PROGRAMS / name), *wrong, "--duration-s", "1"]) as program:
        assert program.wait() == 2, program.said
    code, _, err = said_by_example(name, *wrong, "--duration-s", "1")
    assert code == 2, err


@pytest.mark.parametrize("source", sorted(IN_CPP.glob("*.cc")), ids=lambda path: path.name)
def test_a_cpp_example_has_at_most_30_lines_of_code(source):
    lines = [line.strip() for line in source.read_text(encoding="utf-8").splitlines()]
    code = [line for line in lines if line and not line.startswith("//")]
    assert len(code) <= MOST_LINES


def test_the_gallery_shows_each_example_with_a_command_in_both_languages():
    page = (ROOT / "clients" / "examples" / "README.md").read_text(encoding="utf-8")
    for name in RENDERING:
        picture = ROOT / "clients" / "examples" / f"{name}.png"
        assert 0 < picture.stat().st_size <= 40_000, "too large for a page with many"
        (row,) = (line for line in page.splitlines() if f'<img src="{name}.png"' in line)
        commands = re.findall(r"`([^`]+)`", row.partition("<br>")[2])
        python = "/usr/bin/python3 clients/python/examples/"
        in_python = [word.replace("build/release/bin/", python) for word in commands[:1]]
        assert commands == [commands[0], in_python[0].replace(name, f"{name}.py")]
    # Workers are excluded, because they need a server to start them.
    guests = {path.stem for path in EXAMPLES.glob("*.py") if "worker.run(" not in path.read_text()}
    assert {path.stem for path in IN_CPP.glob("*.cc")} == guests - {"field"}  # only Python uploads fields
    assert {path.stem for path in IN_CPP.glob("*.cc")} == {*RENDERING, "echo_motion", "robot"}


def test_the_quickstart_shows_the_wall_in_each_language_word_for_word():
    page = (ROOT / "clients" / "QUICKSTART.md").read_text(encoding="utf-8")
    for fence, name in (("cpp", "cpp"), ("python", "python"), ("ts", "typescript")):
        (block,) = re.findall(rf"^```{fence}\n(.*?)^```", page, re.M | re.S)
        (source,) = (ROOT / "clients" / name / "examples").glob("virtual_wall.*")
        code = source.read_text(encoding="utf-8")
        assert block == re.sub(r"\A(#!.*\n)?(//|#) SPDX.*\n", "", code), source


@pytest.fixture
def draw(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Runs clients/examples/draw for 1.8 s. Returns the exit code."""
    loader = SourceFileLoader("draw", str(ROOT / "clients" / "examples" / "draw"))
    module = module_from_spec(spec_from_loader("draw", loader))  # type: ignore[arg-type]
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setitem(sys.modules, "draw", module)  # required by dataclasses
    loader.exec_module(module)

    def run(name: str, *options: str | Path) -> int:
        monkeypatch.setattr(module.PICTURES[name], "seconds", 1.8)
        monkeypatch.setattr(sys, "argv", ["draw", name, "--attempts", "1", *map(str, options)])
        return module.main()

    return run


@pytest.mark.skipif(shutil.which("gnuplot") is None, reason="no gnuplot: apt-get install gnuplot-nox")
@pytest.mark.parametrize("name, options", [("viscous_field", []), ("two_hands", ["--python"])])
def test_draw_draws_what_a_hand_felt(draw, tmp_path, name, options):
    built(PROGRAMS / "tendond")
    assert draw(name, *options, "--programs", PROGRAMS, "--out", tmp_path) == 0
    assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(shutil.which("gnuplot") is None, reason="no gnuplot: apt-get install gnuplot-nox")
def test_draw_fails_when_the_hand_has_felt_nothing(draw, tmp_path):
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "tendond").symlink_to(built(PROGRAMS / "tendond").resolve())
    (programs / "viscous_field").symlink_to("/bin/true")
    with pytest.raises(SystemExit, match="0 with a force"):
        draw("viscous_field", "--programs", programs, "--out", tmp_path)
    assert not (tmp_path / "viscous_field.png").exists()


def test_a_hand_feels_each_cpp_example_through_a_server(tmp_path):
    """All examples run concurrently, each with its own device."""
    names = sorted(set(RENDERING) - {"two_hands"})
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(Server(tmp_path, scenes={name: scene("right") for name in names}))
        engines = []
        for name in names:
            shape = ["line"] if name == "virtual_fixture" else []
            program = [built(PROGRAMS / name), *shape, "--server", server.address, "--device", name]
            engines.append(stack.enter_context(Process(tmp_path, [*program, "--duration-s", "0.5", "--json"])))
        for engine in engines:
            assert engine.wait() == 0, engine.said


@pytest.mark.parametrize("command", [["cpp"], ["python"]], ids=["C++", "Python"])
def test_two_hands_feel_each_other_through_one_rod(tmp_path, command):
    """The left hand rests. The right one moves by ± 10 mm along the rod, so both are pushed and pulled."""
    program = [built(PROGRAMS / "two_hands")] if command == ["cpp"] else [sys.executable, EXAMPLES / "two_hands.py"]
    echo = [sys.executable, EXAMPLES / "echo_motion.py", "--json", "--rate-hz", "0"]
    still = scene("left").replace("amplitude_mm = 15", "amplitude_mm = 0")
    assert still != scene("left")
    with Server(tmp_path, scenes={"left": still, "right": scene("right")}) as server:
        with Process(tmp_path, [*program, "--server", server.address]) as engine:
            for _ in range(2):
                engine.wait_for_line("connected to")
            for device in ("left", "right"):
                with Process(tmp_path, [*echo, "--server", server.address, "--device", device, "--duration-s", "30"]) as look:
                    least, most = 0.0, 0.0
                    while least > -0.5 or most < 0.5:  # one period of 1.25 s
                        wanted = json.loads(look.wait_for_line('{"tick"'))["force_wanted_n"]
                        least, most = (of([here, *wanted[:1]]) for of, here in ((min, least), (max, most)))
