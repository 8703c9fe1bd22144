"""Scenes with exact answers. selfcheck.py checks the FEniCSx code of `make validate` with them, judge_check.py the
code that verifies random scenes. A problem is (name, mesh, scene, exact u at points (n, 2))."""

from dataclasses import replace

import numpy as np

import random_bodies as bodies
from lagrange import SIDES

MATERIAL = {"young": 80.0, "poisson": 0.3}
LAW = {"diffusion": 0.5, "lambda_d": 0.1, "lambda_u": 20.0}
NAMES = ("south", "east", "north", "west")
AXIS, PRESSURE = {"name": "west", "symmetry": True}, {"name": "north", "traction": ["0", "-3"]}


def square(turn=0.0, shape=lambda s, t: (s, t)):
    """The rotated unit square with its sides."""
    rng = np.random.default_rng(5)
    points, node, triangles = bodies.grid(rng, 8, 8, shape)
    return bodies.finish(rng, (points, triangles, bodies.sides(node)), 1.0, turn)


def layered():
    """The unit square with two layers; the upper one is the surface `core`."""
    mesh = square(shape=lambda s, t: (s, np.where(abs(t - 0.5) < 0.05, 0.5, t)))
    return replace(mesh, surfaces={"core": mesh.nodes[mesh.triangles, 1].mean(1) > 0.5})


def on_plane(gap="0.01", **more):
    """A square on a rigid plane under pressure 3, with a symmetry axis."""
    return {"material": MATERIAL, "boundary": [AXIS, {"name": "south", "gap": gap}, PRESSURE], **more}


def pressed(gap="0.01"):
    """σ_yy = −p: u_y = −p y/E − g, u_x = ν p x/E in plane stress."""
    return "patch test", square(), on_plane(gap), lambda x, y: (0.3 * 3 / 80 * x, -3 / 80 * y - float(gap))


def plane_strain():
    """As above with E/(1−ν²) and ν/(1−ν)."""
    scene = on_plane("0", material={**MATERIAL, "plane": "strain"})
    return "plane strain", square(), scene, lambda x, y: (3 / 80 * 0.3 * 1.3 * x, -3 / 80 * (1 - 0.3**2) * y)


def layers(low=80.0, high=20.0):
    """Layers in series, ν = 0: u_y = −∫p/E dy."""
    scene = on_plane("0", material={"young": low, "poisson": 0.0, "core": {"young": high}})
    return "layers", layered(), scene, lambda x, y: (
        0 * x, -3 * np.minimum(y, 0.5) / low - 3 * np.maximum(y - 0.5, 0.0) / high)


def prescribed(*field, **more):
    """A body with a displacement field prescribed on its whole boundary."""
    boundary = [{"name": name, "displacement": list(field)} for name in NAMES]
    return {"material": {"young": 80.0, "poisson": 0.25}, "boundary": boundary, **more}


def curved():
    """Isoparametric P2 elements contain all affine fields, wherever the midpoints of sides lie, and the weak form
    integrates them exactly: the cofactors of the Jacobian times ∇φ have degree 2."""
    mesh = square()
    x, y = mesh.nodes[mesh.triangles[:, SIDES]].mean(axis=2).transpose(2, 0, 1)
    moved = np.stack((x + 0.01 * np.sin(7 * x + 3 * y), y + 0.01 * np.cos(5 * x - 6 * y)), -1)
    scene = prescribed("1 + 2*x - 3*y", "x + 0.5*y")
    return "curved sides: affine field", replace(mesh, middles=moved), scene, lambda x, y: (
        1 + 2 * x - 3 * y, x + 0.5 * y)


def quadratic():
    """u = (x² − xy, y²/2), which P2 contains. With ν = ¼ and E = 80 in plane stress σ_xx = E'(2x − y + y/4), σ_yy =
    E'(y + (2x − y)/4), σ_xy = −E'·3/8·x, E' = 80·16/15, and −div σ = −E'(2, 1 − 1/4 − 3/8)."""
    scale = 80 * 16 / 15
    scene = prescribed("x^2 - x*y", "0.5*y^2", body={"force": [repr(-2 * scale), repr(-0.375 * scale)]})
    return "quadratic field", square(), scene, lambda x, y: (x**2 - x * y, 0.5 * y**2)


def problems(order):
    """The problems that elements of an order solve exactly."""
    return [pressed(), plane_strain(), layers(), curved(), *([quadratic()] if order == 2 else [])]


def run(checks, width):
    """Runs the checks with both orders, each a generator of (name, error, tolerance); the exit code."""
    failed = 0
    for check in checks:
        for order in (1, 2):
            for name, error, tolerance in check(order):
                good = error <= tolerance
                failed += not good
                word = "ok" if good else "FAILED"
                print(f"{name:<{width}} P{order} {error:9.1e} ≤ {tolerance:.0e}  {word}")
    return int(failed > 0)
