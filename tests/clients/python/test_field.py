# SPDX-License-Identifier: Apache-2.0
"""Tests shapes, files and materials of fields. The bytes are compared with those of C++ in test_field_vectors.py."""

from __future__ import annotations

import math
import random
import struct
from itertools import product
from types import SimpleNamespace

import pytest
from shapes import Received, ascii_stl, ball, binary_stl, cube, joined, obj

from tendon import Box, Capsule, DepthTable, Field, Plane, Sphere
from tendon.field import _nodes
from tendon.mesh import Mesh, NodeDistances, _Facet, read_mesh
from tendon.messages import FieldDepthTable


def ring(x):
    """A torus."""
    return math.hypot(math.hypot(x[0], x[1]) - 0.012, x[2]) - 0.005


# ---- Files ----


def test_a_part_is_the_same_from_each_kind_of_file(tmp_path):
    points, faces = cube(0.012, (0.03, 0.0, 0.0))
    read = []
    for name, write in (("a.stl", binary_stl), ("b.STL", ascii_stl), ("c.obj", obj)):
        (tmp_path / name).write_bytes(write(points, faces))
        mesh = read_mesh(tmp_path / name, unit_m=1e-3)
        read.append({tuple(mesh.vertices[corner] for corner in corners) for corners in mesh.triangles})
    turned = [{min((a, b, c), (b, c, a), (c, a, b)) for a, b, c in triangles} for triangles in read]
    assert len(turned[0]) == 12 and turned[0] == turned[1] == turned[2]
    dice, seen = random.Random(1), Received(Field.from_mesh(tmp_path / "a.stl", spacing_mm=1.5))
    for _ in range(300):  # where nodes of the spline are not beside an edge
        x, y, z = dice.uniform(-1.3e-3, 1.3e-3), dice.uniform(-3e-3, 3e-3), dice.uniform(-3e-3, 3e-3)
        assert seen.at((0.042 + x, y, z)) == pytest.approx(x, abs=1e-6)


@pytest.mark.parametrize(
    "name, data, said",
    [
        ("a.ply", b"", r'expected a file that ends with .stl or .obj, got ".ply"'),
        ("a.stl", b"x" * 90, r"90 bytes; expected .* for a binary STL file of 2021161080 triangles"),
        ("a.stl", b"solid\nvertex 1 2\n", r'a.stl:2: expected three numbers, got "1 2"'),
        ("a.stl", b"solid\nvertex 1 2 3\n", r"1 vertices; expected three for each facet"),
        ("a.stl", b"solid\nendsolid\n", r"expected at least one triangle"),
        ("a.stl", ascii_stl(*cube()).replace(b"-10", b"nan", 1), r"a.stl: expected coordinates that are finite"),
        ("a.obj", b"v 0 0 0\nf 1 2 3\n", r'a.obj:2: "2": expected a vertex 1 … 1'),
        ("a.obj", b"v 0 0 0\nf 1 x 3\n", r'a.obj:2: "x": expected a vertex 1 … 1'),
    ],
)
def test_a_file_that_is_no_mesh_is_refused_with_its_place(name, data, said, tmp_path):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=said):
        Field.from_mesh(tmp_path / name)


def test_open_edges_are_counted_and_placed(tmp_path):
    points, faces = cube()
    (tmp_path / "part.stl").write_bytes(ascii_stl(points, faces[1:]))
    said = r"part.stl: 3 open edges, for example from \(10, -10, -10\) to \(-10, 10, -10\) mm, .*; expected a closed surface"
    with pytest.raises(ValueError, match=said):
        Field.from_mesh(tmp_path / "part.stl")


def test_turned_triangles_are_counted():
    points, faces = cube()
    a, b, c = faces[0]
    with pytest.raises(ValueError, match="mesh: 3 edges whose triangles have opposite normals"):
        Field.from_triangles(points, [(a, c, b), *faces[1:]])


def test_copies_and_points_of_triangles_do_not_matter():
    points, faces = cube()
    a, b, c = faces[3]
    again = Field.from_triangles(points + [points[0]], [*faces, (b, c, a), (a, a, b), (0, 8, 1), (a, a, a)], 2)
    assert again.describe() == Field.from_triangles(points, faces, 2).describe()


# ---- Distances ----


def test_cavities_and_overlapping_solids_have_the_right_inside():
    outer, beside, cavity = ball(0.0166), ball(0.011, (0.012, 0.006, 0.002)), ball(0.008, (-0.004, -0.004, 0), inward=True)
    seen = Received(Field.from_triangles(*joined(outer, beside, cavity), 2))
    solids, hole = [Sphere((0, 0, 0), 0.0166), Sphere((0.012, 0.006, 0.002), 0.011)], Sphere((-0.004, -0.004, 0), 0.008)
    dice = random.Random(1)
    inside = [0, 0]
    for _ in range(3000):
        x = tuple(dice.uniform(-0.03, 0.03) for _ in range(3))
        union = min(solid.distance(x) for solid in solids)
        away = hole.distance(x)
        value = seen.at(x)
        if value is None or abs(away) < 0.001 or any(abs(solid.distance(x)) < 0.001 for solid in solids):
            continue
        expected = union < 0 and (away > 0 or solids[1].distance(x) < 0)
        assert (value < 0) == expected, x
        inside[expected] += 1
    assert min(inside) > 150


def test_a_mesh_inside_out_is_the_same_solid():
    points, faces = cube()
    turned = [(a, c, b) for a, b, c in faces]
    assert Field.from_triangles(points, turned, 2).describe() == Field.from_triangles(points, faces, 2).describe()


def test_each_node_near_the_surface_is_in_a_brick():
    """The faces of the cube are close to the borders of bricks, which are 16 mm wide."""
    points, faces = cube(0.014, (0.016, 0.016, 0.016))
    field, box = Field.from_triangles(points, faces, 2), Box((0.016, 0.016, 0.016), (0.014, 0.014, 0.014))
    weights = Received(field).weights
    origin = [round(at / 0.002) for at in field.lattice.origin]
    near = 0
    for node in product(range(-3, 20), repeat=3):
        if abs(box.distance(tuple(0.002 * at for at in node))) < 2.499 * 0.002:
            near += 1
            assert tuple(at - first for at, first in zip(node, origin)) in weights, node
    assert near > 3000


def test_a_changed_mesh_keeps_the_bricks_that_are_far_from_the_change():
    part, another = cube(0.02), cube(0.006, (-0.05, 0.0, 0.0))
    before, after = (Field.from_triangles(*mesh, 4).bricks for mesh in (part, joined(part, another)))
    kept = {brick.hash for brick in before} & {brick.hash for brick in after}
    assert len(before) == 8 and len(after) > 8
    assert len(kept) >= 4


def test_distances_of_a_mesh_are_those_to_its_nearest_triangle():
    points, faces = joined(ball(10.3, rings=8), ball(4.0, (-2, -2, 0), rings=6, inward=True))
    mesh = Mesh.of("mesh", points, faces)
    distances = NodeDistances(mesh, (-16.0, -16.0, -16.0), 1.0, (32, 32, 32), 2.5)
    near = {tuple(at // 8 for at in node) for node in distances.near()}
    values = distances.fill({node for place in near for node in _nodes(place, apron=1)})
    dice = random.Random(1)
    errors = []
    for node in dice.sample(sorted(values), 400):
        nearest = math.sqrt(min(facet.squared(*node) for facet in distances._facets))
        errors.append(abs(abs(values[node]) - nearest))
        assert nearest > 2.5 or errors[-1] < 1e-9
    assert max(errors) < 0.05 and sum(error > 1e-9 for error in errors) < 4


@pytest.mark.parametrize("corners", [((0, 0, 0), (4, 0, 0), (1, 2, 0)), ((0, 0, 0), (4, 1, 0), (8, 2, 0)), ((1, 5, 2), (0, 0, 1), (0, 1, 1))])
def test_the_distance_to_a_triangle_is_that_of_its_nearest_sample(corners):
    facet = _Facet([tuple(map(float, corner)) for corner in corners])
    n = 60
    samples = [
        tuple((i * a + j * b + (n - i - j) * c) / n for a, b, c in zip(*corners)) for i in range(n + 1) for j in range(n + 1 - i)
    ]
    dice = random.Random(1)
    for _ in range(40):
        x = [dice.uniform(-3, 9) for _ in range(3)]
        nearest = min(math.dist(x, sample) for sample in samples)
        assert math.sqrt(facet.squared(*x)) <= nearest + 1e-12
        assert math.sqrt(facet.squared(*x)) == pytest.approx(nearest, abs=0.1)


def test_an_array_is_the_field_of_its_function():
    spacing, origin = 0.002, (-0.02, -0.02, -0.01)
    nodes = [[[ring([o + spacing * n for o, n in zip(origin, (i, j, k))]) for k in range(8)] for j in range(24)] for i in range(24)]
    field = Field.from_array(nodes, origin, spacing)
    assert [brick.place for brick in field.bricks] == [(i, j, 0) for j in range(3) for i in range(3)]
    dice, seen, near = random.Random(1), Received(field), 0
    for _ in range(2000):
        x = tuple(dice.uniform(-0.018, 0.018) for _ in range(2)) + (dice.uniform(-0.006, 0.002),)
        if abs(ring(x)) < 0.003:
            near += 1
            assert seen.at(x) == pytest.approx(ring(x), abs=1e-4)
    assert near > 300
    as_numpy = SimpleNamespace(tolist=lambda: nodes)
    assert Field.from_array(as_numpy, origin, spacing).describe() == field.describe()


def test_an_array_goes_on_linearly_beyond_its_ends():
    # The weights of a linear function are equal to its values.
    nodes = [[[0.0005 * (i + j - k) - 0.0001 for k in range(5)] for j in range(4)] for i in range(3)]
    (brick,) = Field.from_array(nodes, (0, 0, 0), 0.001).bricks
    unit = 16 * 0.001 / 32767
    for n, weight in enumerate(struct.unpack("<512h", brick.weights)):
        assert weight * unit == pytest.approx(0.0005 * (n % 8 + n // 8 % 8 - n // 64) - 0.0001, abs=unit)


@pytest.mark.parametrize(
    "rows, said",
    [
        ([[[1.0]]], r"distances.shape = \(1, 1, 1\): expected at least 2 along each axis"),
        ([[[1.0, 1], [1, 1]], [[1, 1], [1]]], "distances: expected rows of the same length"),
        ([[[1.0, 1], [1, 1]], [[1, 1], [1, math.nan]]], "distances: expected finite numbers"),
        ([[[1.0, 1], [1, 1]], [[1, 1], [1, 1]]], "the field has no surface"),
    ],
)
def test_an_array_that_is_no_field_is_refused(rows, said):
    with pytest.raises(ValueError, match=said):
        Field.from_array(rows, (0, 0, 0), 0.001)


def test_bounds_of_a_field_are_told_with_a_remedy():
    ball = Sphere((0, 0, 0), 0.03)
    with pytest.raises(ValueError, match=r"spacing = 9.*: expected 0.00025 to 0.008 m"):
        Field.from_function(ball.distance, (-0.04,) * 3, (0.04,) * 3, 9000)
    with pytest.raises(ValueError, match=r"extent = .*: expected at most 2 m along each axis"):
        Field.from_function(ball.distance, (-1.1, 0, 0), (1.1, 1, 1), 8)
    with pytest.raises(ValueError, match=r"lattice = .*: expected at most 65536 bricks"):
        Field.from_function(ball.distance, (-0.25,) * 3, (0.25,) * 3, 0.5)
    flat = lambda x: x[2]  # noqa: E731
    with pytest.raises(ValueError, match=r"1156 bricks at a spacing of 1 mm: expected at most 1023; try a spacing of 1.1 mm"):
        Field.from_function(flat, (0, 0, 0), (0.272, 0.272, 0.008), 1)


# ---- Primitives ----


@pytest.mark.parametrize("shape, x, distance", [
    (Plane((0, 0, 1), (0, 0, 1)), (5, 5, 3), 2),
    (Plane((0, 0, 1), (0, 0, 1), hollow=True), (5, 5, 3), -2),
    (Sphere((1, 0, 0), 2), (1, 0, 5), 3),
    (Sphere((1, 0, 0), 2, hollow=True), (1, 0, 0), 2),
    (Capsule((0, 0, 0), (4, 0, 0), 1), (2, 3, 0), 2),
    (Capsule((0, 0, 0), (4, 0, 0), 1), (7, 4, 0), 4),
    (Capsule((1, 1, 1), (1, 1, 1), 1), (1, 1, 1), -1),
    (Box((0, 0, 0), (1, 2, 3)), (4, 6, 3), 5),
    (Box((0, 0, 0), (1, 2, 3)), (0.5, 0, 0), -0.5),
    (Box((0, 0, 0), (1, 2, 3), rounding=1), (2, 2, 3), math.sqrt(3) * 1 - 1 + (math.sqrt(6) - math.sqrt(3))),
    (Box((0, 0, 0), (1, 2, 3), turn=(math.sqrt(0.5), 0, 0, math.sqrt(0.5))), (5, 0, 0), 3),
])  # fmt: skip
def test_a_primitive_has_the_distance_of_its_shape(shape, x, distance):
    assert shape.distance(x) == pytest.approx(distance, abs=1e-12)


@pytest.mark.parametrize("build, said", [
    (lambda: Sphere((0, 0, 0), 0), "radius = 0.0: expected a length above 0 m"),
    (lambda: Sphere((0, 0), 1), r"centre = \(0, 0\): expected three numbers"),
    (lambda: Plane((0, 0, 0), (0, 0, 2)), "normal = .*: expected a vector of length 1"),
    (lambda: Capsule((0, 0, math.inf), (0, 0, 0), 1), "start = .*: expected finite numbers"),
    (lambda: Box((0, 0, 0), (1, 0, 1)), "half = .*: expected lengths above 0 m"),
    (lambda: Box((0, 0, 0), (1, 1, 1), 2), "rounding = 2: expected 0 to 1.0 m"),
    (lambda: Box((0, 0, 0), (1, 1, 1), turn=(1, 1, 0, 0)), "turn = .*: expected a quaternion"),
    (lambda: Field.from_primitives(), "the field has no surface"),
    (lambda: Field.from_primitives(*[Sphere()] * 33), "primitives = 33: expected at most 32"),
])  # fmt: skip
def test_a_primitive_that_cannot_be_is_refused(build, said):
    with pytest.raises(ValueError, match=said):
        build()


# ---- Materials ----


def test_a_material_is_that_of_the_bricks_whose_centres_are_in_its_region():
    field = Field.from_function(Plane().distance, (0, 0, -0.008), (0.032, 0.008, 0.008), 1)
    field.material("steel", stiffness=1500, friction=0.3)
    field.material("pad", stiffness=300, relax_s=0.2, region=Box((0.02, 0, 0), (0.01, 0.01, 0.01)))
    field.material("dot", stiffness=700, relax_s=1, branch=50, region=Sphere((0.0195, 0.0035, 0.0035), 0.0005))
    told = field.describe()
    assert [(one.stiffness, one.branch_stiffness, one.relaxation, one.friction) for one in told.materials] == [
        (1500, 0, 0, 0.3),
        (300, 300, 0.2, 0),
        (700, 50, 1, 0),
    ]
    of_place = {brick.place: told.manifest[50 + 23 * n + 6] for n, brick in enumerate(field.bricks)}
    assert of_place == {(0, 0, 0): 0, (1, 0, 0): 1, (2, 0, 0): 1, (3, 0, 0): 1} | {
        (0, 0, 1): 0, (1, 0, 1): 1, (2, 0, 1): 2, (3, 0, 1): 1
    }  # fmt: skip


def test_a_region_also_counts_for_primitives():
    shapes = (Sphere((0, 0, 0)), Plane((9, 0, 0)), Capsule((1, 0, 0), (3, 0, 0), 1), Box((2, 0, 1), (1, 1, 1), hollow=True))
    field = Field.from_primitives(*shapes)
    field.material("pad", 300, region=Box((2, 0, 0), (0.1, 1, 2)))
    manifest = field.describe().manifest
    assert len(manifest) == 50 + 4 * 91
    assert [tuple(manifest[at : at + 3]) for at in range(50, len(manifest), 91)] == [(2, 0, 0), (1, 0, 0), (3, 0, 1), (4, 1, 1)]


def test_a_material_can_be_changed_without_another_manifest():
    field = Field.from_function(Plane().distance, (0, 0, -0.008), (0.008, 0.008, 0.008), 1)
    assert field.describe().materials[0].stiffness == 1000, "N/m, without a material"
    field.material("steel", stiffness=1500)
    before = field.describe()
    field.material("foam", stiffness=200)
    assert (field.describe().name, field.describe().materials[0].stiffness) == (before.name, 200)
    assert before.materials[0].stiffness == 1500, "a description is a copy"
    field.material("pad", 300, region=Sphere((0, 0, 0), 1))
    field.material("pad", 400, region=Sphere((0, 0, 0), 1))
    assert [one.stiffness for one in field.describe().materials] == [200, 400]


@pytest.mark.parametrize("values, said", [
    ({"stiffness": 0}, "stiffness = 0: expected above 0 N/m"),
    ({"stiffness": math.nan}, "stiffness = nan"),
    ({"stiffness": 1, "friction": 3}, "friction = 3: expected 0 to 2"),
    ({"stiffness": 1, "relax_s": 0}, "relax_s = 0: expected 0.01 to 10 s"),
    ({"stiffness": 1, "branch": 5}, "branch = 5: expected a branch with relax_s"),
    ({"stiffness": 1, "relax_s": 1, "branch": 0}, "branch = 0: expected above 0 N/m"),
])  # fmt: skip
def test_a_material_that_cannot_be_is_refused(values, said):
    field = Field.from_primitives(Sphere())
    with pytest.raises(ValueError, match=said):
        field.material("x", **values)


def test_a_table_is_sent_with_the_number_of_its_material():
    field = Field.from_primitives(Sphere())
    table = DepthTable(0.002, [0.1, 0.4])
    field.material("pad", 300, region=Sphere((9, 9, 9)), table=table)
    assert field.describe().tables == (FieldDepthTable(1, 0.002, (0.1, 0.4)),)
    field.material("all", 200, table=DepthTable(0.001, [-0.1]))
    assert [table.material for table in field.describe().tables] == [0, 1]
    field.material("pad", 300, region=Sphere((9, 9, 9)))
    assert [table.material for table in field.describe().tables] == [0]
    for name in "ab":
        field.material(name, 300, region=Sphere(), table=table)
    with pytest.raises(ValueError, match="tables = 4: expected at most 3"):
        field.material("c", 300, region=Sphere(), table=table)
    assert len(field.describe().materials) == 4, "the refused material is not there"


def force_of(stiffness, table, depth):
    at = min(depth / table.step, len(table.force))
    knots = [0.0, *table.force, table.force[-1]]
    return stiffness * depth + knots[int(at)] + (at % 1) * (knots[int(at) + 1] - knots[int(at)])


def test_a_table_of_a_curve_has_the_forces_of_the_curve():
    depths, forces = [0.002, 0.004, 0.006], [0.2, 0.5, 1.4]
    stiffness, table = DepthTable.of_curve(depths, forces)
    assert (table.step, len(table.force)) == (0.002, 3), "points with the same distance are met"
    assert [force_of(stiffness, table, depth) for depth in depths] == pytest.approx(forces)
    assert stiffness == pytest.approx(450), "N/m, of the last segment"
    stiffness, table = DepthTable.of_curve([0.001, 0.0045, 0.016], [0.01, 0.5, 4.0])
    assert (stiffness, len(table.force)) == (pytest.approx(80), 16), "8 times the least slope"
    assert force_of(stiffness, table, 0.001) == pytest.approx(0.01)
    assert force_of(stiffness, table, 0.016) == pytest.approx(4.0)
    slopes = [(b - a) / table.step for a, b in zip([0.0, *table.force], table.force)]
    assert min(slopes) > -0.9 * stiffness
    stiffness, table = DepthTable.of_curve([0.0005], [0.1])
    assert (stiffness, table.step, table.force) == (200, 0.0005, (pytest.approx(0),))


@pytest.mark.parametrize("make, said", [
    (lambda: DepthTable(0, [1]), "step = 0: expected 0.0001 to 0.1 m"),
    (lambda: DepthTable(0.001, []), "force = 0: expected 1 to 16 entries"),
    (lambda: DepthTable(0.001, [0] * 17), "force = 17: expected 1 to 16 entries"),
    (lambda: DepthTable(0.001, [math.nan]), "force = .*: expected ±1e12 N"),
    (lambda: DepthTable.of_curve([], []), "forces = 0: expected as many as depths, 0, and at least 1"),
    (lambda: DepthTable.of_curve([0.001, 0.001], [1, 2]), r"depths\[1\] = 0.001: expected above 0.001 m"),
    (lambda: DepthTable.of_curve([0.001, 0.002], [1, 1]), r"forces\[1\] = 1: expected above 1 N"),
    (lambda: DepthTable.of_curve([0.2], [1]), "step = 0.2: expected 0.0001 to 0.1 m"),
])  # fmt: skip
def test_a_table_that_cannot_be_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_there_are_at_most_8_materials_and_4_fixtures():
    field = Field.from_primitives(Sphere())
    for number in range(7):
        field.material(str(number), 100, region=Sphere())
    with pytest.raises(ValueError, match="materials = 9: expected at most 8"):
        field.material("x", 100, region=Sphere())
    for kind in ("point", "line", "plane", "line"):
        field.fixture(kind, (0, 0, 0), 100, (1, 0, 0), most_force=2)
    with pytest.raises(ValueError, match="fixtures = 5: expected at most 4"):
        field.fixture("point", (0, 0, 0), 100)
    assert [one.kind.name for one in field.describe().fixtures] == ["POINT", "LINE", "PLANE", "LINE"]
    for wrong in ({"kind": "ring"}, {"stiffness": 0}, {"normal": (1, 1, 0)}, {"most_force": 0}):
        values = {"kind": "point", "at": (0, 0, 0), "stiffness": 100} | wrong
        with pytest.raises(ValueError, match=f"{next(iter(wrong))} = "):
            Field.from_primitives(Sphere()).fixture(**values)


# ---- MuJoCo ----


def model_of(kind, size, mesh=None):
    """Returns a stand-in with the attributes of mujoco.MjModel. The geom is rotated by 90° about the x axis."""
    points, faces = mesh or ([], [])
    return SimpleNamespace(
        geom=lambda name: SimpleNamespace(id={"other": 0, "peg": 1}[name]),
        geom_type=[2, kind],
        geom_size=[[1, 1, 1], size],
        geom_pos=[[0, 0, 0], [0.01, 0.02, 0.03]],
        geom_quat=[[1, 0, 0, 0], [math.sqrt(0.5), math.sqrt(0.5), 0, 0]],
        geom_dataid=[-1, 0 if mesh else -1],
        mesh_vertadr=[2], mesh_vertnum=[len(points)], mesh_vert=[[9, 9, 9], [9, 9, 9], *points],
        mesh_faceadr=[1], mesh_facenum=[len(faces)], mesh_face=[[7, 7, 7], *faces],
    )  # fmt: skip


@pytest.mark.parametrize("kind, size, at, distance", [
    (0, [0, 0, 1], (0.01, 0.0, 0.03), 0.02),  # the normal is turned from z to −y
    (2, [0.01, 0, 0], (0.01, 0.02, 0.06), 0.02),
    (3, [0.01, 0.02, 0], (0.01, 0.06, 0.03), 0.01),
    (6, [0.01, 0.02, 0.03], (0.01, 0.06, 0.03), 0.01),
])  # fmt: skip
def test_a_geom_of_mujoco_is_a_primitive_in_the_frame_of_its_body(kind, size, at, distance):
    (shape,) = Field.from_mujoco(model_of(kind, size), "peg").primitives
    assert shape.distance(at) == pytest.approx(distance, abs=1e-12)


def test_a_mesh_of_mujoco_is_sampled_in_the_frame_of_its_body():
    points = [(x, y, 2 * z) for x, y, z in cube()[0]]
    seen = Received(Field.from_mujoco(model_of(7, [0, 0, 0], (points, cube()[1])), "peg", spacing_mm=2))
    assert seen.at((0.01, 0.04 + 0.001, 0.03)) == pytest.approx(0.001, abs=1e-5), "20 mm along z, which is −y of the body"
    assert seen.at((0.01, 0.02, 0.04 + 0.001)) == pytest.approx(0.001, abs=1e-5)


def test_a_geom_of_another_type_is_refused():
    with pytest.raises(ValueError, match="geom peg has type 4: expected a plane"):
        Field.from_mujoco(model_of(4, [0.01, 0.02, 0.03]), "peg")
