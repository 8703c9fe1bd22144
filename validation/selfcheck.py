"""Checks the FEniCSx side on its own, without the program: exact solutions and signs, for
displacements of order 1 and 2.

Run: /usr/bin/python3 validation/selfcheck.py
"""

import itertools
import sys

import numpy as np

from fenicsx import evolve
from lagrange import SIDES, Lagrange
from scene import of_order
from triangulation import Triangulation


def square(n):
    """The unit square in n × n cells of two triangles, numbered at random on purpose."""
    shuffle = np.random.default_rng(1).permutation((n + 1) ** 2)
    node = shuffle.reshape(n + 1, n + 1)  # node[i, j] at (i/n, j/n)
    nodes = np.empty(((n + 1) ** 2, 2))
    nodes[node.ravel()] = np.indices((n + 1, n + 1)).reshape(2, -1).T / n
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    triangles = np.vstack(
        [np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    )
    line = {"bottom": node[:, 0], "top": node[:, -1], "left": node[0], "right": node[-1]}
    curves = {name: np.stack((ids[:-1], ids[1:]), 1) for name, ids in line.items()}
    return Triangulation(nodes, triangles, curves)


def pressed(gap="0", **extra):
    """A square on a rigid plane under uniform pressure 3, with a symmetry axis."""
    return {
        "mesh": {"file": ""},
        "material": {"young": 80.0, "poisson": 0.3},
        "boundary": [
            {"name": "left", "symmetry": True},
            {"name": "top", "traction": ["0", "-3"]},
            {"name": "bottom", "gap": gap},
        ],
        **extra,
    }


def solved(scene, mesh, order):
    """The state at the end and the coordinates of the nodes of u."""
    *_, state = evolve(of_order(scene, order), mesh)
    return state, *Lagrange(mesh, order).points.T


def patch_test(mesh, order):
    """σ_yy = −p: u_y = −p y/E − g, u_x = ν p x/E in plane stress."""
    state, x, y = solved(pressed("0.01"), mesh, order)
    exact = np.stack((0.3 * 3 / 80 * x, -3 / 80 * y - 0.01), 1)
    yield "patch test: displacement", np.abs(state.displacement - exact).max(), 1e-13
    yield "patch test: contact force", abs(state.contact_force - 3.0), 1e-12


def plane_strain_patch_test(mesh, order):
    """As above with E/(1−ν²) and ν/(1−ν)."""
    scene = pressed()
    scene["material"]["plane"] = "strain"
    state, x, y = solved(scene, mesh, order)
    exact = 3 / 80 * np.stack((0.3 * 1.3 * x, -(1 - 0.3**2) * y), 1)
    yield "plane strain patch test", np.abs(state.displacement - exact).max(), 1e-13


def prescribed(*field, **extra):
    """A body whose whole boundary is moved as a field."""
    sides = ("bottom", "right", "top", "left")
    boundary = [{"name": name, "displacement": list(field)} for name in sides]
    return {"mesh": {"file": ""}, "material": {"young": 80.0, "poisson": 0.25},
            "boundary": boundary, **extra}


def curved_patch_test(mesh, order):
    """Isoparametric elements of order 2 have all affine fields, wherever the middles of sides lie,
    and so does the weak form: the Jacobian's cofactors times ∇φ are of degree 2."""
    middles = mesh.nodes[mesh.triangles[:, SIDES]].mean(axis=2)
    x, y = middles.transpose(2, 0, 1)
    middles = middles + 0.01 * np.stack((np.sin(7 * x + 3 * y), np.cos(5 * x - 6 * y)), -1)
    bent = Triangulation(mesh.nodes, mesh.triangles, mesh.curves, middles)
    state, x, y = solved(prescribed("1 + 2*x - 3*y", "x + 0.5*y"), bent, order)
    exact = np.stack((1 + 2 * x - 3 * y, x + 0.5 * y), 1)
    yield "curved sides: affine field", np.abs(state.displacement - exact).max(), 1e-13


def quadratic_patch_test(mesh, order):
    """u = (x² − xy, y²/2), which order 2 has. With ν = ¼ and E = 80 in plane stress
    σ_xx = E'(2x − y + y/4), σ_yy = E'(y + (2x − y)/4), σ_xy = −E'·3/8·x, E' = 80·16/15, and
    −div σ = −E'(2, 1 − 1/4 − 3/8)."""
    scale = 80 * 16 / 15
    force = [repr(-2 * scale), repr(-0.375 * scale)]
    scene = prescribed("x^2 - x*y", "0.5*y^2", body={"force": force})
    state, x, y = solved(scene, mesh, order)
    error = np.abs(state.displacement - np.stack((x**2 - x * y, 0.5 * y**2), 1)).max()
    # P1 is exact only at the nodes, and only because the triangles are as regular as these.
    yield "quadratic field, at the nodes", error, 1e-13


def body_force(mesh, order):
    """A force that varies in x: total reaction = its integral by the quadrature."""
    scene = pressed(body={"force": ["0", "-(1 + x^2 + 0*sin(y))"]})
    state, *_ = solved(scene, mesh, order)
    yield "body force: contact force", abs(state.contact_force - 3 - 4 / 3), 1e-12


def partial_contact(mesh, order):
    """Clamped on the left, one half pressed, the other pulled: KKT signs node by node."""
    scene = {
        "mesh": {"file": ""},
        "material": {"young": 80.0, "poisson": 0.3},
        "boundary": [
            {"name": "left", "displacement": ["0", "0"]},
            {"name": "top", "traction": ["0", "-40 + 50*max(0, min(1, 1e9*(x - 0.5)))"]},
            {"name": "bottom", "gap": "1e-3*x"},
        ],
    }
    state, x, y = solved(scene, mesh, order)
    contact = (y == 0) & (x > 0)
    reaction = state.residual[contact, 1]
    distance = 1e-3 * x[contact] + state.displacement[contact, 1]
    yield "KKT: penetration", max(0.0, -distance.min()), 1e-15
    yield "KKT: adhesion", max(0.0, -reaction.min()), 1e-12
    yield "KKT: complementarity", np.abs(reaction * distance).max(), 1e-12
    some = 0 < state.active < contact.sum()
    yield "KKT: contact partly open", 0.0 if some else np.inf, 0.0


def uniform_damage(mesh, order):
    """Uniform uniaxial stress: ζ stays uniform and follows the scalar Euler recursion."""
    law = {"diffusion": 0.5, "lambda_d": 0.1, "lambda_u": 20.0}
    state, *_ = solved(pressed(damage=law, time={"end": 1.0, "step": 0.1}), mesh, order)
    zeta = 1.0
    for _ in range(10):
        strain_squared = (3 / (80 * zeta)) ** 2 * (1 + 0.3**2)
        zeta -= 0.1 * (0.1 * (1 - zeta) / zeta + 0.5 * 20.0 * strain_squared)
    yield "uniform damage", np.abs(state.zeta - zeta).max(), 1e-13


def main():
    mesh = square(12)
    failed = 0
    checks = (patch_test, plane_strain_patch_test, curved_patch_test, quadratic_patch_test,
              body_force, partial_contact, uniform_damage)
    for check, order in itertools.product(checks, (1, 2)):
        for name, error, tolerance in check(mesh, order):
            good = error <= tolerance
            failed += not good
            word = "ok" if good else "FAILED"
            print(f"{name:<31} P{order} {error:9.1e} ≤ {tolerance:.0e}  {word}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
