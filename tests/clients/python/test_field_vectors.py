# SPDX-License-Identifier: Apache-2.0
"""Fields are encoded as in protocol/vectors/fields.json, which is written by C++."""

from __future__ import annotations

import json

import pytest
from conftest import ROOT

from tendon import Box, Capsule, Field, Plane, Sphere

CASES = json.loads((ROOT / "protocol" / "vectors" / "fields.json").read_text(encoding="utf-8"))["fields"]


def shape(told):
    n = told["numbers"]
    kinds = {
        1: lambda: Plane(n[:3], n[3:6], told["hollow"]),
        2: lambda: Sphere(n[:3], n[3], told["hollow"]),
        3: lambda: Capsule(n[:3], n[3:6], n[6], told["hollow"]),
        4: lambda: Box(n[:3], n[3:6], n[6], tuple(n[7:]), told["hollow"]),
    }
    return kinds[told["kind"]]()


def field_of(case):
    primitives = [shape(told) for told in case["primitives"]]
    field = Field.from_primitives(*primitives) if primitives else None
    if case["sampled"]:
        sampled = Field.from_function(shape(case["sampled"][0]).distance, case["low"], case["high"], 1000 * case["spacing"])
        field = Field(sampled.lattice, sampled.bricks, primitives)
    for region in case["region"]:
        field.material("inside", 100, region=shape(region))
    return field


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_a_field_is_encoded_as_it_is_here(case):
    field = field_of(case)
    told = field.describe()
    assert told.manifest.hex() == case["manifest"]
    assert told.name.hex() == case["field"]
    if field.bricks:
        assert field.bricks[0].weights.hex() == case["first_brick"]


@pytest.mark.parametrize("mesh", json.loads((ROOT / "tests" / "clients" / "field_meshes.json").read_text()), ids=lambda mesh: mesh["name"])
def test_a_mesh_is_encoded_as_by_the_client_in_typescript(mesh):
    field = Field.from_triangles(mesh["points"], mesh["triangles"], mesh["spacing_mm"])
    assert field.describe().name.hex() == mesh["field"]
