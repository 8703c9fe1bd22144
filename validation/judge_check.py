"""Checks the verification itself, without the program: exact answers pass, planted faults do not, for P1 and P2
displacements.

Run: /usr/bin/python3 validation/judge_check.py
"""

import sys
from dataclasses import replace

import numpy as np

import exact
import random_bodies as bodies
from discrete import Discrete
from exact import layered, square
from judge import expectation, judge_step, residuals
from lagrange import SIDES
from scene import of_order
from variational import Step, along

SCENE = {"material": exact.MATERIAL}


def answer_of(problem, order):
    """The contact step of a problem of exact.py, and its exact answer."""
    _, mesh, scene, field = problem
    discrete = Discrete(of_order(scene, order), mesh)
    return Step(discrete, np.ones(len(mesh.nodes)), 1.0), np.stack(field(*discrete.points.T), 1).ravel()


def step_of(mesh, boundary, order=1, t=1.0, **more):
    """A contact step of a scene on a mesh, undamaged, at time t."""
    discrete = Discrete(of_order({**SCENE, "boundary": boundary, **more}, order), mesh)
    return Step(discrete, np.ones(len(mesh.nodes)), t)


def wrong(step, u):
    """1 if an answer is called wrong, 0 otherwise."""
    return float(judge_step(step, u, (0, 0))[0].word == "wrong")


def pressed(order, gap="0.01"):
    """A square under pressure, and its exact answer."""
    return answer_of(exact.pressed(gap), order)


def answers(order):
    """The exact fields satisfy every condition and are the solutions of `variational.py`; the patch test is also rotated."""
    for problem in exact.problems(order):
        step, field = answer_of(problem, order)
        yield f"{problem[0]}: residuals of the exact field", max(residuals(step, field)[:2]), 1e-14
        yield f"{problem[0]}: own answer", np.abs(step.solve() - field).max(), 1e-14
    mesh = square(0.7)
    direction = [repr(float(3 * c)) for c in -mesh.outward_normals("north")[0].mean(0)]
    step = step_of(mesh, [{"name": "west", "symmetry": True}, {"name": "south", "gap": "0"},
                          {"name": "north", "traction": direction}], order)
    own = step.solve()
    yield "patch test, turned: residuals", max(residuals(step, own)[:2]), 1e-13


def planted(order):
    """Wrong answers are called wrong: scaled, lifted, through the obstacle, glued, one node moved by 1e-5 of the answer,
    the answer for another gap."""
    step, right = pressed(order)
    x = step.discrete.points
    one = np.zeros_like(right)
    one[2 * int(np.argmin(np.hypot(*(x - 0.5).T)))] = 1e-5 * np.abs(right).max()
    up = np.tile([0.0, 1.0], len(x))
    faults = {"scaled": 1.001 * right, "lifted": right + 1e-5 * up, "through": right - 1e-5 * up,
              "one node": right + one, "other gap": pressed(order, "0.02")[1], "zero": 0 * right}
    for name, u in faults.items():
        yield f"planted: {name}", float(judge_step(step, u, (0, 0))[0].word == "right"), 0.5
    yield "exact is right", float(judge_step(step, right, (0, 0))[0].word != "right"), 0.5
    # Pulled off its foundation: an answer that sticks to it has tensile contact forces.
    pull = [{"name": "north", "displacement": ["0", "0.1"]}, {"name": "south", "gap": "0"}]
    free = step_of(square(), pull, order)
    glued = step_of(square(), [pull[0], {"name": "south", "displacement": ["free", "0"]}], order)
    yield "glued is wrong", float(judge_step(free, glued.solve(), (0, 0))[0].word != "wrong"), 0.5


def tip():
    """The triangle (0,0), (2,∓0.4)."""
    rng = np.random.default_rng(3)
    shape = lambda s, t: (2 * s, 0.4 * s * (2 * t - 1))
    points, node, triangles = bodies.grid(rng, 10, 4, shape)
    triangles = np.where(np.isin(triangles, node[0]), node[0, 0], triangles)
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    lines = {"lower": bodies.chain(np.r_[node[0, 0], node[1:, 0]]), "end": bodies.chain(node[-1]),
             "upper": bodies.chain(np.r_[node[0, 0], node[1:, -1]])}
    return bodies.finish(rng, (points, triangles, lines), 1.0, 0.0)


def plates(low, high):
    """The tip's conditions: clamped at its end, between two plates with these gaps."""
    return [{"name": "end", "displacement": ["0", "0"]},
            {"name": "lower", "gap": low, "normal": ["0", "-1"]},
            {"name": "upper", "gap": high, "normal": ["0", "1"]}]


def opposite(order):
    """A tip between two plates with gaps of 0.001. Both rows are obeyed, and the force of the touching
    plate is a pressure."""
    material = {"young": 1.0, "poisson": 0.3}
    step = step_of(tip(), plates("0.001", "0.001"), order, material=material, body={"force": ["0.01", "0.003"]})
    own = step.solve()
    yield "wedge between plates: residuals", max(residuals(step, own)[:2]), 1e-12
    yield "wedge: the upper plate is obeyed", abs((along(step.rows, own) - 0.001).max()), 1e-15
    large = np.linalg.norm(own.reshape(-1, 2), axis=1).max()
    yield "wedge: largest displacement near 9.9e-3", abs(large - 9.9e-3), 1e-3


def ranks(order):
    """Rigid motions; loads that contact can and cannot balance."""
    corner = {"name": "south", "gap": "0"}
    mesh = square()
    yield "a free square has 3 motions", abs(step_of(mesh, [corner], order).n.shape[1] - 3.0), 0.0
    for name, force, driven in (("down", "-1", 0.0), ("up", "1", 1.0)):
        step = step_of(mesh, [corner], order, body={"force": ["0", force]})
        yield f"pushed {name}: driven or not", abs((step.driven > 1e-7) - driven), 0.0
    scene = {**SCENE, "boundary": [corner], "body": {"force": ["0", "1-2*t"]}}
    refused = expectation(Discrete(of_order(scene, order), mesh))[0] is not None
    yield "only the time of the solve counts", float(refused), 0.0
    yield "one motion is left loose", abs(loose(mesh, corner, order) - 1.0), 0.0


def loose(mesh, corner, order):
    """The number of motions that an answer leaves open: sliding on a flat foundation."""
    step = step_of(mesh, [corner], order, body={"force": ["0", "-1"]})
    step.solve()
    return step.loose.shape[1]


def damage(order):
    """Uniform strain: ζ obeys the scalar Euler recursion; without a source ∫ζ is conserved."""
    step, right = pressed(order)
    law = dict(exact.LAW)
    discrete = Discrete({**step.discrete.scene, "damage": law}, step.discrete.mesh)
    zeta = np.full(len(discrete.mesh.nodes), 0.8)
    squared = (3 / 80) ** 2 * (1 + 0.3**2)
    exact_zeta = 0.8 - 0.1 * (0.1 * 0.2 / 0.8 + 10.0 * squared)
    found, _ = discrete.damage_step(right, zeta, 0.1)
    yield "uniform damage", np.abs(found - exact_zeta).max(), 1e-14
    law["lambda_d"] = law["lambda_u"] = 0.0
    for law["mass"] in ("consistent", "lumped"):
        discrete = Discrete({**step.discrete.scene, "damage": law}, step.discrete.mesh)
        zeta = 0.5 + 0.4 * discrete.mesh.nodes[:, 0] ** 2
        mean = lambda z: (z[discrete.mesh.triangles].mean(1) * discrete.area).sum()
        lost = mean(discrete.damage_step(0 * right, zeta, 0.1)[0]) - mean(zeta)
        yield f"no source: ∫ζ stays, {law['mass']}", abs(lost), 1e-14


def materials(order):
    """The answers of other materials are wrong, and each surface has its own damage law."""
    step, right = answer_of(exact.layers(), order)
    for name, other in (("layers swapped", (20.0, 80.0)), ("one material", (80.0, 80.0))):
        yield f"planted: {name}", 1.0 - wrong(step, answer_of(exact.layers(*other), order)[1]), 0.5
    law, mesh = {"diffusion": 0.5, "lambda_d": 0.1, "lambda_u": 0.0, "core": {"lambda_d": 0.3}}, layered()
    scene = {**step.discrete.scene, "damage": law}
    zeta = np.full(len(mesh.nodes), 0.8)
    found, _ = Discrete(scene, mesh).damage_step(0 * right, zeta, 0.1)
    lost = (step.discrete.area * (0.8 - found)[mesh.triangles].mean(1)).sum()
    yield "the law by surface: ∫ζ", abs(lost - 0.1 * 0.2 * 0.2 / 0.8), 1e-14
    law["core"]["diffusion"] = 5.0
    other, _ = Discrete(scene, mesh).damage_step(0 * right, zeta, 0.1)
    yield "planted: κ of another surface", float(np.abs(other - found).max() < 1e-6), 0.5


def moving(order):
    """Gaps depend on time; an obstacle that overlaps the undeformed body pushes it out."""
    gap = [{"name": "west", "symmetry": True}, {"name": "south", "gap": "0.02*t - 0.005"},
           {"name": "north", "traction": ["0", "-3"]}]
    early, late = (step_of(square(), gap, order, t) for t in (0.0, 1.0))
    yield "moving gap: the answer of its time", wrong(early, pressed(order, "-0.005")[1]), 0.0
    yield "planted: the answer of another time", 1.0 - wrong(late, early.solve()), 0.5
    fixed = [{"name": "north", "displacement": ["0", "0"]}, {"name": "south", "gap": "-0.01"}]
    step = step_of(square(), fixed, order, material={"young": 80.0, "poisson": 0.0})
    right = np.stack((0 * step.discrete.points[:, 0], 0.01 * (1 - step.discrete.points[:, 1])), 1)
    # The symmetry of ν = 0 does not hold u_x at the corners: no shear acts.
    yield "pressed without a load", np.abs(step.solve() - right.ravel()).max(), 1e-14
    yield "planted: at rest in the obstacle", 1.0 - wrong(step, 0 * right.ravel()), 0.5
    for low, high, refused in (("-0.001", "-0.001", 1.0), ("-0.001", "0.002", 0.0)):
        # At the clamped end only gaps that the undeformed body violates count.
        scene = {**SCENE, "boundary": plates(low, high)[1:] + [{"name": "end", "symmetry": True}]}
        discrete = Discrete(of_order(scene, order), tip())
        reason = expectation(discrete)[0] or ""
        yield f"plates of gaps {low}, {high}", abs(("room" in reason) - refused), 0.0


def curved(order):
    """On a disc with midpoints on the circle the normals are radial, and the answer for its chords is wrong."""
    if order == 1:
        return
    mesh = bodies.finish(np.random.default_rng(4), bodies.disc(np.random.default_rng(4)), 1.0, 0.0)
    ends = mesh.nodes[mesh.triangles[:, SIDES]]
    middles = ends.mean(axis=2)
    rim = (np.abs(np.hypot(*np.moveaxis(ends, -1, 0)) - 1.0) < 1e-12).all(axis=2)
    middles[rim] /= np.hypot(*middles[rim].T)[:, None]
    boundary = [{"name": "west", "displacement": ["0", "0"]}, {"name": "south", "gap": "0"},
                {"name": "east", "traction": ["-1", "-2"]}]
    step = step_of(replace(mesh, middles=middles), boundary, order)
    ends = np.bincount(step.rows.node)[step.rows.node] > 1
    inner = [node for node, faces in step.discrete.faces("south").items() if len(faces) == 1]
    radial = step.discrete.points[step.rows.node]
    whole = ~ends & np.isin(step.rows.node, inner)
    off = np.abs(step.rows.direction - radial)[whole].max(axis=1)
    yield "disc: normals are radial", np.sort(off)[:-2].max(), 1e-14
    straight = step_of(mesh, boundary, order)
    yield "planted: sides taken as chords", 1.0 - wrong(step, straight.solve()), 0.5


if __name__ == "__main__":
    sys.exit(exact.run((answers, planted, opposite, ranks, damage, materials, moving, curved), 48))
