# SPDX-License-Identifier: Apache-2.0
"""Uploads fields to a real tendond, whose hand presses into x > 0."""

from __future__ import annotations

import re
import subprocess
from types import SimpleNamespace

import pytest
from conftest import ROOT
from processes import Server, example, scene, tendond
from shapes import binary_stl, cube

import tendon

CHANNELS = '\n[[channel]]\nname = "peg"\n[[channel]]\nname = "free"\n[field]\nallow = ["peg"]\nmax_stiffness_n_per_m = 1500\n'
AT_REST = SimpleNamespace(position=(0, 0, 0), turn=(1, 0, 0, 0), twist=(0, 0, 0, 0, 0, 0))


class Felt(Exception):
    """Ends the loop over the states."""


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
