# SPDX-License-Identifier: Apache-2.0
"""Tests deploy/scenes/grasp.toml, in which two hands at two devices grasp a simulated liver."""

from __future__ import annotations

import contextlib
import json
import sys

import pytest
from conftest import ROOT
from processes import EXAMPLES, PROGRAMS, Process, Server, scene

ECHO = [sys.executable, EXAMPLES / "echo_motion.py", "--json", "--rate-hz", "0"]


@pytest.mark.parametrize("servers", [1, 2])
def test_two_hands_hold_one_liver_and_are_answered_together(tmp_path, servers):
    program = PROGRAMS / "tendon-softbody"
    if not program.exists():
        pytest.skip(f"{program} is not built; TENDON_PROGRAMS names another folder")
    hands = {
        "left": scene("left").replace("amplitude_mm = 15", "amplitude_mm = 5"),
        "right": scene("right").replace("amplitude_mm = 10", "amplitude_mm = 0"),
    }
    grasp = scene("grasp").replace('file = "liver.msh"', f'file = "{ROOT}/deploy/scenes/liver.msh"')
    with contextlib.ExitStack() as stack:
        if servers == 1:
            addresses = [stack.enter_context(Server(tmp_path, scenes=hands)).address] * 2
        else:
            each = [stack.enter_context(Server(tmp_path, scenes={name: text})) for name, text in hands.items()]
            addresses = [server.address for server in each]
            grasp = grasp.replace('device = "right"', f'device = "right"\nserver = "{addresses[1]}"')
        (tmp_path / "grasp.toml").write_text(grasp, encoding="utf-8")
        command = [program, "grasp.toml", "--server", addresses[0], "--rate-hz", "50", "--duration-s", "60", "--json"]
        with Process(tmp_path, command) as engine:
            for _ in range(2):
                engine.wait_for_line("connected to")
            # Waits until the liver has been squeezed, and until both hands have received answers for one second.
            with Process(tmp_path, [*ECHO, "--server", addresses[1], "--device", "right", "--duration-s", "30"]) as look:
                first, last, squeezed = None, 0, False
                while not squeezed or last - first < 1000:
                    line = json.loads(look.wait_for_line('{"tick"'))
                    first, last = first or line["tick"], line["tick"]
                    squeezed = squeezed or bool(line["force_wanted_n"]) and abs(line["force_wanted_n"][1]) > 0.3
            assert engine.stop() == 0, engine.said
    said = [json.loads(line)["summary"] for line in engine.said if line.startswith('{"summary"')]
    forces = {summary["device"]: summary["forces"] for summary in said}
    assert forces["left"] > 0 and all(summary["forces_unusable"] == 0 for summary in said), said
    # Both hands are answered in the same turn, so the counts only differ by the states before the second hand was
    # present.
    assert abs(forces["left"] - forces["right"]) <= 10, forces
