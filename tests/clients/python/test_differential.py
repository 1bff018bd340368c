# SPDX-License-Identifier: Apache-2.0
"""The decoders in C++ and Python must agree. differential.py compares 100 000 datagrams."""

import os
from pathlib import Path

import pytest
from conftest import ROOT
from differential import compare

PROGRAMS = Path(os.environ.get("TENDON_TEST_PROGRAMS", ROOT / "build" / "release" / "tests"))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_both_decoders_say_the_same_of_random_and_of_damaged_datagrams(seed):
    program = PROGRAMS / "decode_lines"
    if not program.exists():
        pytest.skip(f"{program} is not built; TENDON_TEST_PROGRAMS names another folder")
    told, different = compare(program, seed, 2000)
    assert different == []
    assert told.pop("with a contact") > 0
    assert min(told.values()) > 100, "the datagrams must be of all kinds"
