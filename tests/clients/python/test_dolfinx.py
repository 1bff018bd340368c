# SPDX-License-Identifier: Apache-2.0
"""Compares the worker with DOLFINx to the reference engine on the same mesh."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest
from proxy import HAND, SECRET, Proxy, mpirun, running
from processes import EXAMPLES, PROGRAMS

BLOCK = EXAMPLES / "dolfinx_block.py"
COMPILED_S = 240  # DOLFINx compiles its forms at the first start

# Places of the hand on the block's face, m.
MIDDLE, ASIDE, OFF = (0.0, 0.0), (0.01, -0.02), (0.06, 0.0)

REFERENCE = """
effects = ["contact"]
[body]
shape = "block"
size_mm = [100, 100, 50]
cells = [8, 8, 4]
element = "hex27"
material = { young_pa = 10_000, poisson = 0.45 }
[model]
kind = "linear"
[touch]
patch_radius_mm = 20
"""

pytestmark = pytest.mark.skipif(
    find_spec("dolfinx") is None or find_spec("petsc4py") is None, reason="no DOLFINx: apt-get install python3-dolfinx"
)


def pressed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *command: str | Path, depth: float = 1e-3) -> list[float]:
    """Returns the stiffness at each place, N/m. The forces must be consistent with a linear spring."""
    proxy = Proxy("unix", tmp_path)
    monkeypatch.setenv("TENDON_WORKER_ADDRESS", proxy.address)
    monkeypatch.setenv("TENDON_WORKER_SECRET", SECRET)
    found = []
    with running(command) as program:
        try:
            proxy.accept(COMPILED_S)
            for sequence, (y, z) in enumerate((MIDDLE, ASIDE, OFF), 1):
                told = proxy.ask(sequence, replace(HAND, position=(depth, y, z)))
                k = told.model.stiffness[0][0]
                assert told.force == pytest.approx((-k * max(depth, 0), 0, 0))
                assert told.model.contact.normal == (-1, 0, 0) and told.model.contact.gap == -depth
                found.append(k)
        finally:
            proxy.close()
        assert program.wait(COMPILED_S) == 0
    (tmp_path / "proxy").unlink()
    return found


def test_the_block_is_as_stiff_as_that_of_the_reference_engine(tmp_path, monkeypatch):
    middle, aside, off = pressed(tmp_path, monkeypatch, sys.executable, BLOCK)
    assert middle == pytest.approx(420.2, rel=0.03)  # B1: tests/clients/softbody/pressed_block.h
    assert 0.9 * middle < aside < middle  # softer near the free sides
    assert off == 0
    engine = PROGRAMS / "tendon-softbody"
    if not engine.exists():
        pytest.skip(f"{engine} is not built; TENDON_PROGRAMS names another folder")
    (tmp_path / "block.toml").write_text(REFERENCE, encoding="utf-8")
    told = subprocess.run([engine, "explain", tmp_path / "block.toml", "--json"], capture_output=True, check=True)
    # the patch is integrated differently
    assert middle == pytest.approx(json.loads(told.stdout)["k_n_per_m"], rel=2e-3)


def test_two_ranks_answer_as_one(tmp_path, monkeypatch):
    one = pressed(tmp_path, monkeypatch, sys.executable, BLOCK, "--cells", "4")
    two = pressed(tmp_path, monkeypatch, *mpirun(sys.executable, BLOCK, "--cells", "4"))
    assert two == pytest.approx(one, rel=1e-9)


def test_a_hand_that_does_not_touch_feels_nothing(tmp_path, monkeypatch):
    assert pressed(tmp_path, monkeypatch, sys.executable, BLOCK, "--cells", "4", depth=-1e-3) == [0, 0, 0]
