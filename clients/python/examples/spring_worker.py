#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A worker that is started by a proxy and renders a spring that pulls the hand to the origin.

With MPI, `mpirun -n 2 spring_worker.py --mpi`: every rank gets each state, and the answer of rank 0 is sent.

Example: tendon-fem serve SCENE --worker "python3 spring_worker.py" --server 127.0.0.1:47100"""
import argparse

import tendon

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene", nargs="?", help="Scene file from the proxy; not used by this spring")
parser.add_argument("--stiffness-n-per-m", type=float, default=500, help="Stiffness of the spring, N/m [%(default)s]")
parser.add_argument("--mpi", action="store_true", help="Run as one of several ranks (requires python3-mpi4py)")
options = parser.parse_args()


def spring(hand: tendon.DeviceState) -> tendon.Touch:
    k = options.stiffness_n_per_m
    return tendon.Touch(force=[-k * x for x in hand.position], stiffness=k)


comm = None
if options.mpi:
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
tendon.worker.run(spring, comm)
