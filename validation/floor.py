#!/usr/bin/python3
"""What the passes of a time step cost on this machine whoever makes them: floor.py [SCENE MESH ORDER]

Alone: the speed of memory, as a large copy reads and writes it, and of floating-point operations, as a
large product of dense matrices makes them (dgemm), on one core. With a scene and a mesh: the bytes that
each pass of a step must move at least, every array once, and the operations of a factorisation. The
entries of K are those of FEniCSx's matrix, the entries and operations of its Cholesky factor those of
MUMPS; neither is taken from signorini. Prints a JSON object.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

# Doubles of an array that no cache holds, rows of a dense matrix, and how often both are used.
COPIED, DENSE, PASSES = 1 << 26, 3000, 5


def best(work):
    """The least seconds."""
    seconds = []
    for _ in range(PASSES):
        began = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - began)
    return min(seconds)


def machine():
    """Bytes and operations per second."""
    a, b = np.ones(COPIED), np.ones(COPIED)
    copy = 16 * COPIED / best(lambda: np.copyto(b, a))
    read = 16 * COPIED / best(lambda: np.dot(a, b))
    a, c = np.ones((DENSE, DENSE)), np.ones((DENSE, DENSE))
    return {"copy": copy, "read": read, "dgemm": 2 * DENSE**3 / best(lambda: a @ c)}


def passes(scene, mesh, order):
    """Bytes of each pass; matrices with 8 bytes an entry, 4 for the column of a scalar or of a block of
    2×2; factors in single precision, read twice for a pair of triangular solves."""
    from petsc4py import PETSc

    from loop import Contact, Model
    from loop_fenicsx import Library
    from scene import of_order, read_scene
    from triangulation import read_triangulation

    model = Model(of_order(read_scene(scene), order), read_triangulation(mesh))
    library = Library(model, None)
    contact = Contact(library, model, 0)
    library.refill(0.0, library.initial())
    library.factorise(~(contact.fixed | contact.active))
    factor, operations = analysis(library.reduced, PETSc)
    damage_factor, _ = analysis(library.damage_matrix, PETSc)
    entries, damage_entries = (m.getInfo()["nz_used"] for m in (library.reduced, library.damage_matrix))
    unknowns, vertices = len(contact.u), len(model.mesh.nodes)
    elements = 4 * model.nodes.elements.size
    product = 9 * entries + 16 * unknowns
    return {
        "nodes": unknowns // 2,
        "stiffness refill": 8 * entries + elements + 8 * unknowns + 8 * vertices,
        "products": product,
        "triangular solves": 8 * factor + 32 * unknowns,
        # u ← u + αp, r ← r − αq, rᵀz, p ← z + βp.
        "vectors": 8 * 11 * unknowns,
        "damage source": elements + 8 * unknowns + 16 * vertices,
        "damage solve": 8 * damage_factor + 12 * damage_entries + 48 * vertices,
        "factorisation": operations,
    }


def analysis(matrix, petsc):
    """Entries and operations of the Cholesky factor."""
    pc = petsc.PC().create(petsc.COMM_SELF)
    pc.setOperators(matrix)
    pc.setType("cholesky")
    pc.setFactorSolverType("mumps")
    pc.setUp()
    factor = pc.getFactorMatrix()
    return factor.getMumpsInfog(29), factor.getMumpsRinfog(3)


if __name__ == "__main__":
    if len(sys.argv) == 1:
        print(json.dumps(machine()))
    else:
        print(json.dumps(passes(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))))
