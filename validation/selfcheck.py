"""Checks the FEniCSx code without the program: exact solutions and signs, for P1 and P2 displacements.

Run: /usr/bin/python3 validation/selfcheck.py
"""

import copy
import sys

import numpy as np

import exact
from fenicsx import evolve
from lagrange import Lagrange
from scene import SceneError, of_order


def solved(scene, mesh, order):
    """The state at the end and the coordinates of the nodes of u."""
    *_, state = evolve(of_order(scene, order), mesh)
    return state, *Lagrange(mesh, order).points.T


def answers(order):
    """The exact answers of exact.py."""
    for name, mesh, scene, field in exact.problems(order):
        state, x, y = solved(scene, mesh, order)
        yield name, np.abs(state.displacement - np.stack(field(x, y), 1)).max(), 1e-13


def forces(order):
    """The contact force is the resultant of the loads: a pressure, and a body force that varies in x by its
    quadrature."""
    mesh = exact.square()
    state, *_ = solved(exact.on_plane(), mesh, order)
    yield "pressure: contact force", abs(state.contact_force - 3.0), 1e-12
    state, *_ = solved(exact.on_plane("0", body={"force": ["0", "-(1 + x + 0*sin(y))"]}), mesh, order)
    yield "body force: contact force", abs(state.contact_force - 3 - 1.5), 1e-12


def partial_contact(order):
    """Clamped on the left, one half pressed, the other pulled: KKT signs node by node."""
    scene = {"material": exact.MATERIAL, "boundary": [
        {"name": "west", "displacement": ["0", "0"]},
        {"name": "north", "traction": ["0", "-40 + 50*max(0, min(1, 1e9*(x - 0.5)))"]},
        {"name": "south", "gap": "1e-3*x"}]}
    state, x, y = solved(scene, exact.square(), order)
    contact = (y == 0) & (x > 0)
    reaction = state.residual[contact, 1]
    distance = 1e-3 * x[contact] + state.displacement[contact, 1]
    yield "KKT: penetration", max(0.0, -distance.min()), 1e-15
    yield "KKT: adhesion", max(0.0, -reaction.min()), 1e-12
    yield "KKT: complementarity", np.abs(reaction * distance).max(), 1e-12
    some = 0 < state.active < contact.sum()
    yield "KKT: contact partly open", 0.0 if some else np.inf, 0.0


def uniform_damage(order):
    """Uniform uniaxial stress: ζ stays uniform and follows the scalar Euler recursion."""
    scene = exact.on_plane("0", damage=exact.LAW, time={"end": 1.0, "step": 0.1, "scheme": "euler"})
    state, *_ = solved(scene, exact.square(), order)
    zeta = 1.0
    for _ in range(10):
        strain_squared = (3 / (80 * zeta)) ** 2 * (1 + 0.3**2)
        zeta -= 0.1 * (0.1 * (1 - zeta) / zeta + 0.5 * 20.0 * strain_squared)
    yield "uniform damage", np.abs(state.zeta - zeta).max(), 1e-13


def refusals(order):
    """A key that the code does not know is refused in every table."""
    base = exact.on_plane("0", damage={**exact.LAW, "upper": {}}, time={"end": 1.0, "step": 0.1, "scheme": "euler"})
    for *tables, name in (["drag"], ["time", "scheme"], ["material", "drag"], ["damage", "upper", "drag"],
                          ["boundary", 0, "drag"]):
        scene = table = copy.deepcopy(base)
        for key in tables:
            table = table[key]
        table[name] = 1
        try:
            solved(scene, exact.square(), order)
            yield f"{name} is refused", np.inf, 0.0
        except SceneError as error:
            yield f"{name} is refused", 0.0 if name in str(error) else np.inf, 0.0


if __name__ == "__main__":
    sys.exit(exact.run((answers, forces, partial_contact, uniform_damage, refusals), 41))
