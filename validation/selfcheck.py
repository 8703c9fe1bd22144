"""Checks the FEniCSx side on its own, without the program: exact solutions and signs.

Run: /usr/bin/python3 validation/selfcheck.py
"""

import sys

import numpy as np

from damage import evolve
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


def patch_test(mesh):
    """σ_yy = −p: u_y = −p y/E − g, u_x = ν p x/E in plane stress."""
    state, _ = evolve(pressed("0.01"), mesh)
    x, y = mesh.nodes.T
    exact = np.stack((0.3 * 3 / 80 * x, -3 / 80 * y - 0.01), 1)
    yield "patch test: displacement", np.abs(state.displacement - exact).max(), 1e-13
    yield "patch test: contact force", abs(state.contact_force - 3.0), 1e-12


def plane_strain_patch_test(mesh):
    """As above with E/(1−ν²) and ν/(1−ν)."""
    scene = pressed()
    scene["material"]["plane"] = "strain"
    state, _ = evolve(scene, mesh)
    x, y = mesh.nodes.T
    exact = 3 / 80 * np.stack((0.3 * 1.3 * x, -(1 - 0.3**2) * y), 1)
    yield "plane strain patch test", np.abs(state.displacement - exact).max(), 1e-13


def body_force(mesh):
    """A force that varies in x: total reaction = its integral by the midpoint rule."""
    scene = pressed(body={"force": ["0", "-(1 + x^2 + 0*sin(y))"]})
    state, _ = evolve(scene, mesh)
    yield "body force: contact force", abs(state.contact_force - 3 - 4 / 3), 1e-12


def partial_contact(mesh):
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
    state, _ = evolve(scene, mesh)
    x, y = mesh.nodes.T
    contact = (y == 0) & (x > 0)
    reaction = state.residual[contact, 1]
    distance = 1e-3 * x[contact] + state.displacement[contact, 1]
    yield "KKT: penetration", max(0.0, -distance.min()), 1e-15
    yield "KKT: adhesion", max(0.0, -reaction.min()), 1e-12
    yield "KKT: complementarity", np.abs(reaction * distance).max(), 1e-12
    some = 0 < state.active < contact.sum()
    yield "KKT: contact partly open", 0.0 if some else np.inf, 0.0


def uniform_damage(mesh):
    """Uniform uniaxial stress: ζ stays uniform and follows the scalar Euler recursion."""
    law = {"diffusion": 0.5, "lambda_d": 0.1, "lambda_u": 20.0}
    state, _ = evolve(pressed(damage=law, time={"end": 1.0, "step": 0.1}), mesh)
    zeta = 1.0
    for _ in range(10):
        strain_squared = (3 / (80 * zeta)) ** 2 * (1 + 0.3**2)
        zeta -= 0.1 * (0.1 * (1 - zeta) / zeta + 0.5 * 20.0 * strain_squared)
    yield "uniform damage", np.abs(state.zeta - zeta).max(), 1e-13


def main():
    mesh = square(12)
    failed = 0
    checks = (patch_test, plane_strain_patch_test, body_force, partial_contact, uniform_damage)
    for check in checks:
        for name, error, tolerance in check(mesh):
            good = error <= tolerance
            failed += not good
            print(f"{name:<32} {error:9.1e} ≤ {tolerance:.0e}  {'ok' if good else 'FAILED'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
