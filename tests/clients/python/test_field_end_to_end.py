# SPDX-License-Identifier: Apache-2.0
"""Uploads fields to a real tendond, whose hand presses into x > 0."""

from __future__ import annotations

import re
import subprocess
from types import SimpleNamespace

import pytest
from conftest import ROOT
from processes import PATIENCE_S, PROGRAMS, Process, Server, example, scene, tendond
from shapes import binary_stl, cube

import tendon

CHANNELS = '\n[[channel]]\nname = "peg"\n[[channel]]\nname = "free"\n[field]\nallow = ["peg"]\nmax_stiffness_n_per_m = 1500\n'
AT_REST = SimpleNamespace(position=(0, 0, 0), turn=(1, 0, 0, 0), twist=(0, 0, 0, 0, 0, 0))


class Felt(Exception):
    """The hand has felt the part, so the test can end."""


def code_on_the_page() -> str:
    page = (ROOT / "clients" / "python" / "README.md").read_text(encoding="utf-8")
    (code,) = (block for block in re.findall(r"^```python\n(.*?)^```", page, re.M | re.S) if "hand.truth(" in block)
    assert len(code.splitlines()) <= 12
    return code


@pytest.fixture
def keys(tmp_path):
    folder = tmp_path / "keys"
    folder.mkdir()
    subprocess.run([tendond(), "keygen", "peg"], cwd=folder, check=True, capture_output=True)
    return folder


def test_the_code_on_the_page_renders_a_part(tmp_path, keys, monkeypatch):
    (tmp_path / "part.stl").write_bytes(binary_stl(*cube(0.008, (0.008, 0.0, 0.0))))
    (tmp_path / "peg.key").write_bytes((keys / "peg.key").read_bytes())
    (tmp_path / "peg.key").chmod(0o600)
    monkeypatch.chdir(tmp_path)
    used = {"tendon": tendon, "model": AT_REST, "box": tendon.Box((0.012, 0, 0), (0.001, 0.02, 0.02))}
    forces, truths = [], []

    def force(position):
        state = used["state"]
        if state.field is not None:
            forces.append((state.force_applied[0], state.field.depth))
            truths.append(used["hand"].stats.forces)
        if len(forces) > 400 and min(forces)[0] < -0.5:
            raise Felt
        return (-1500 * max(position[0], 0), 0, 0)

    used["engine"] = SimpleNamespace(force=force)
    text = scene("demo") + CHANNELS + f'[network]\nkeys = "{keys}"\n'
    with Server(tmp_path, scenes={"scene": text}) as server:
        with pytest.raises(Felt):
            exec(code_on_the_page().replace("lab:47100", server.address), used)
        assert used["hand"].field_refused == ""
        assert truths[-1] > truths[0], "truths are sent while a field is rendered"
        force_n, depth = min(forces)
        assert 0.3e-3 < depth < 5e-3
        assert server.end()["forces"] > 0


def test_a_restarted_engine_is_felt_at_once_and_a_refused_field_says_why(tmp_path):
    with Server(tmp_path, scenes={"scene": scene("demo") + CHANNELS}) as server:
        field = tendon.Field.from_primitives(tendon.Sphere((0.015, 0, 0), 0.015))
        for _ in range(2):
            with tendon.connect(server.address, channel="peg", rate_hz=60) as hand:
                hand.use(field)
                for state in hand.states(30):
                    if state.field is not None and state.force_applied[0] < -0.5:
                        break
                else:
                    pytest.fail(f"not felt: {hand.field_refused}")
        for settings, stiffness, said in (
            ({"channel": "peg"}, 1600, "stiffness = 1600: expected"),
            ({"channel": "free"}, 500, 'the channel "free" may not use fields: expected it in allow of [field]'),
        ):
            field.material("steel", stiffness=stiffness)
            with tendon.connect(server.address, rate_hz=60, **settings) as hand:
                hand.use(field)
                assert any(said in hand.field_refused for _ in hand.states(30)), hand.field_refused


def test_the_example_uploads_a_mesh(tmp_path):
    (tmp_path / "part.stl").write_bytes(binary_stl(*cube(0.008, (0.008, 0.0, 0.0))))
    with Server(tmp_path, scenes={"scene": scene("demo") + "\n[field]\n"}) as server:
        with example(tmp_path, "field", "--server", server.address, "--mesh", tmp_path / "part.stl", "--json") as program:
            program.wait_for_line('{"depth_mm":1')


def test_a_scene_without_fields_tells_the_engine(tmp_path):
    with Server(tmp_path) as server:
        with tendon.connect(server.address) as hand:
            hand.use(tendon.Field.from_primitives(tendon.Sphere()))
            assert any(hand.field_refused == "the server does not support fields" for _ in hand.states(30))


@pytest.fixture
def soft_body(tmp_path):
    """The command of tendon-softbody, whose body is stiffer than its field."""
    program = PROGRAMS / "tendon-softbody"
    if not program.exists():
        pytest.skip(f"{program} is not built; TENDON_PROGRAMS names another folder")
    body = tmp_path / "body.toml"
    body.write_text(scene("softbody") + "[field]\nstiffness_n_per_m = 300\nspacing_mm = 4\n", encoding="utf-8")
    return [program, body, "--server"]


def test_a_soft_body_is_rendered_by_the_server_and_corrected_by_the_engine(tmp_path, soft_body):
    stiffness = 457.9  # N/m, of the body
    hand = scene("demo").replace("amplitude_mm = 15", "amplitude_mm = 8")
    with Server(tmp_path, scenes={"scene": hand + "\n[field]\n"}) as server:
        with Process(tmp_path, [*soft_body, server.address]) as engine:
            engine.wait_for_line("the server renders the field")
            pressed = []
            with tendon.connect(server.address, role=tendon.Role.OBSERVER) as observer:
                for state in observer.states(PATIENCE_S):
                    if state.field is not None and state.field.depth > 2e-3:
                        pressed.append(-state.force_applied[0] / state.position[0])
                    if len(pressed) >= 1000:
                        break
            assert engine.stop() == 0, engine.said
    assert len(pressed) >= 500
    right = [one for one in pressed if abs(one / stiffness - 1) < 0.05]
    assert len(right) > len(pressed) / 2, sorted(pressed)[:: len(pressed) // 10]


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ("", "the server does not support fields"),
        ("[field]\nmax_stiffness_n_per_m = 100\n", "materials[0].stiffness = 300: expected above 0, and at most 100"),
    ],
)
def test_a_soft_body_without_its_field_sends_forces_and_says_why(tmp_path, soft_body, table, why):
    with Server(tmp_path, scenes={"scene": scene("demo") + "\n" + table}) as server:
        with Process(tmp_path, [*soft_body, server.address, "--duration-s", "2"]) as engine:
            assert why in engine.wait_for_line("the field is not rendered: ")
            assert engine.wait() == 0, engine.said
        assert sum("the field is not rendered" in line for line in engine.said) == 1, engine.said
        assert server.end()["forces"] > 100
