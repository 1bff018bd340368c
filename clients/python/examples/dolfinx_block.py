#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A worker whose solver is DOLFINx 0.5 (Debian: python3-dolfinx): an elastic block in front of the hand.

The block B1 of clients/softbody: 100 x 100 x 50 mm, 10 kPa, Poisson's ratio 0.45, linear, quadratic hexahedra. Its free
face is the plane x = 0, its back is held. The hand presses it along +x with a patch of 20 mm around where it is.

Example: tendon-fem serve SCENE --worker "python3 dolfinx_block.py" --launch "mpirun -n 2" --server 127.0.0.1:47100"""
import argparse

import tendon

SIZE, WIDE = 0.05, 0.1  # m: along x, along y and z
YOUNG, POISSON = 1e4, 0.45  # Pa
PATCH = 0.02  # m

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene", nargs="?", help="Scene file from the proxy; not used by this block")
parser.add_argument(
    "--cells", type=int, default=8, choices=range(2, 65, 2), metavar="N", help="Number of cells along y and z, even [%(default)s]"
)
options = parser.parse_args()

import numpy as np  # noqa: E402  --help works without these
import ufl  # noqa: E402
from dolfinx import fem, mesh  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

comm = MPI.COMM_WORLD
n = options.cells
corners = [np.array([0, -WIDE / 2, -WIDE / 2]), np.array([SIZE, WIDE / 2, WIDE / 2])]
block = mesh.create_box(comm, corners, [n // 2, n, n], mesh.CellType.hexahedron)
space = fem.VectorFunctionSpace(block, ("Lagrange", 2))
faces = mesh.locate_entities_boundary(block, 2, lambda x: np.isclose(x[0], 0))
back = mesh.locate_entities_boundary(block, 2, lambda x: np.isclose(x[0], SIZE))
held = fem.dirichletbc(np.zeros(3), fem.locate_dofs_topological(space, 2, back), space)

u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
lame, shear = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
strain = ufl.sym(ufl.grad(u))
stress = lame * ufl.tr(strain) * ufl.Identity(3) + 2 * shear * strain
matrix = fem.petsc.assemble_matrix(fem.form(ufl.inner(stress, ufl.grad(v)) * ufl.dx), bcs=[held])
matrix.assemble()
solver = PETSc.KSP().create(comm)
solver.setType("preonly")
solver.getPC().setType("lu")
solver.getPC().setFactorSolverType("mumps")
solver.setOperators(matrix)
solver.setUp()

# The patch has the weights 3/(πa²)·(1 − (r/a)²)² of clients/softbody/fem/patch.h around a moving center.
x, middle = ufl.SpatialCoordinate(block), fem.Constant(block, np.zeros(3))
r2 = ((x[1] - middle[1]) ** 2 + (x[2] - middle[2]) ** 2) / PATCH**2
weight = ufl.conditional(ufl.lt(r2, 1), 3 / (np.pi * PATCH**2) * (1 - r2) ** 2, 0.0)
face = ufl.Measure("ds", block, subdomain_data=mesh.meshtags(block, 2, np.sort(faces), np.ones(len(faces), np.int32)))
pressed = fem.form(weight * v[0] * face(1, metadata={"quadrature_degree": 12}))
load, moved, inwards = (fem.petsc.create_vector(pressed) for _ in range(3))
ones = fem.Function(space)
ones.interpolate(lambda x: np.array([np.ones_like(x[0]), np.zeros_like(x[0]), np.zeros_like(x[0])]))
ones.vector.copy(inwards)


def stiffness_at(y: float, z: float) -> float:
    """Stiffness of the patch around (y, z), N/m: 1 / (mean displacement of the patch under a distributed force of 1
    N)."""
    middle.value[:] = (0, y, z)
    with load.localForm() as local:
        local.set(0)
    fem.petsc.assemble_vector(load, pressed)
    load.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    covered = load.dot(inwards)  # 1 if the entire patch is on the block
    if covered < 0.5:
        return 0.0
    load.scale(1 / covered)
    fem.petsc.set_bc(load, [held])
    solver.solve(load, moved)
    return 1 / load.dot(moved)


def answer(hand: tendon.DeviceState) -> tendon.Touch:
    depth, y, z = hand.position
    k = stiffness_at(y, z) if depth > 0 else 0.0
    contact = tendon.Contact(normal=(-1, 0, 0), gap=-depth)
    return tendon.Touch(force=(-k * max(depth, 0), 0, 0), stiffness=(k, 0, 0), contact=contact)


stiffness_at(0, 0)  # compiles and caches everything before the first state
tendon.worker.run(answer, comm)
