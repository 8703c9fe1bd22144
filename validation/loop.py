#!/usr/bin/python3
"""Times the scheme as a user of a finite element library writes it: loop.py LIBRARY SCENE MESH

The library, `fenicsx` (loop_fenicsx.py) or `ngsolve` (loop_ngsolve.py, with the Python it is installed
for), assembles, factorises and writes. What is common to both is here: equations (25) to (28), a
primal-dual active set for the contact, and conjugate gradients preconditioned by a Cholesky factor, which
is renewed when it has not served within `--keep` iterations (0: made for every linear system). Scenes
with contact and symmetry along x or y, straight sides, one material, no body force.

Prints one JSON object: seconds of each step, counts, the worst relative KKT residual, the last state.
"""

import argparse
import importlib
import json
import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lagrange import Lagrange
from scene import Expression, SceneError, displacement_order, of_order, read_scene
from triangulation import read_triangulation

# Of the linear systems, over the largest load so far; of signs in the active set, over the largest
# load and displacement.
LINEAR, SIGN = 1e-11, 1e-10


class Model:
    """What a scene and a mesh ask for, by the nodes of u in the order of `Lagrange`."""

    def __init__(self, scene, mesh):
        self.order = displacement_order(scene)
        self.mesh, self.nodes = mesh, Lagrange(mesh, self.order)
        self.boundaries = scene["boundary"]
        self.damage = {"lambda_w": 0.0, "strain_cap": 1000.0, "threshold": 0.01, **scene["damage"]}
        self.step = float(scene["time"]["step"])
        self.zeta = Expression(self.damage.get("initial", 1.0)).at(mesh.nodes)
        young, poisson = (float(scene["material"][key]) for key in ("young", "poisson"))
        if scene["material"].get("plane", "stress") == "strain":
            young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
        # The paper's plane-stress tensor: σ = shear·(ε + ratio·tr(ε) I).
        self.shear, self.ratio = young / (1 + poisson), poisson / (1 - poisson)
        self.tractions = [(b["name"], [Expression(text) for text in b["traction"]])
                          for b in self.boundaries if "traction" in b]

    def prescribed(self):
        """Values of prescribed components (n, 2), NaN where there is none."""
        value = np.full((len(self.nodes.points), 2), np.nan)
        for boundary in self.boundaries:
            nodes, component, _ = self.side(boundary)
            if "displacement" in boundary:
                for c, text in enumerate(boundary["displacement"]):
                    if text != "free":
                        value[nodes, c] = Expression(text).at(self.nodes.points[nodes])
            if boundary.get("symmetry"):
                value[nodes, component] = 0.0
        return value

    def contact(self):
        """s and g of the bounds s·u ≤ g on components, s = 0 where there is none (n, 2)."""
        sign, gap = np.zeros((2, len(self.nodes.points), 2))
        for boundary in self.boundaries:
            if "gap" in boundary:
                nodes, component, s = self.side(boundary)
                sign[nodes, component] = s
                gap[nodes, component] = Expression(boundary["gap"]).at(self.nodes.points[nodes])
        return sign, gap

    def side(self, boundary):
        """Nodes of a boundary, and of a straight one component and sign of its normal."""
        edges = self.mesh.edges(boundary["name"])
        nodes = np.unique(self.nodes.on(edges))
        normals = self.mesh.outward_normals(boundary["name"])[0]
        component = int(np.abs(normals[0]).argmax())
        if not {"gap", "symmetry"}.isdisjoint(boundary):
            if "normal" in boundary or np.abs(normals[:, component]).min() < 1 - 1e-9:
                raise SceneError(f"boundary '{boundary['name']}' is not along x or y")
        return nodes, component, float(np.sign(normals[0, component]))


@dataclass
class Counts:
    """Of all contact steps so far."""

    systems: int = 0
    iterations: int = 0
    factorisations: int = 0


class Contact:
    """The contact step (26): min ½uᵀK(ζ)u − fᵀu, s·u ≤ g, by a primal-dual active set."""

    def __init__(self, library, model, keep):
        self.library, self.keep, self.counts = library, keep, Counts()
        place = library.unknowns
        value, (sign, gap) = model.prescribed(), model.contact()
        self.value, self.sign, self.gap = (np.empty(place.size) for _ in range(3))
        self.value[place], self.sign[place], self.gap[place] = value, sign, gap
        self.fixed = np.isfinite(self.value)
        self.sign[self.fixed] = 0.0
        # Full contact is the first guess: without it a body may be free to move.
        self.active = self.sign != 0.0
        self.factored = None
        self.u = self.before = np.where(self.fixed, self.value, 0.0)
        self.force = self.size = self.kkt = 0.0

    def solve(self, t, zeta):
        """u for the damage ζ, from the straight line through the last two."""
        library, s = self.library, self.sign
        library.refill(t, zeta)
        self.force = max(self.force, np.linalg.norm(library.load))
        u, self.before = 2 * self.u - self.before, self.u
        while True:
            u[self.fixed] = self.value[self.fixed]
            u[self.active] = (s * self.gap)[self.active]
            u = self._linear(u, ~(self.fixed | self.active))
            self.size = max(self.size, np.abs(u).max())
            reaction = library.product(u) - library.load
            pressure, penetration = -s * reaction, s * u - self.gap
            active = (s != 0) & np.where(
                self.active, pressure >= -SIGN * self.force, penetration > SIGN * self.size)
            if (active == self.active).all():
                break
            self.active = active
        self.u = u
        free = ~(self.fixed | active)
        self.kkt = max(
            self.kkt,
            np.linalg.norm(reaction[free]) / (self.force or 1.0),
            -pressure[active].min(initial=0.0) / (self.force or 1.0),
            penetration[(s != 0)].max(initial=0.0) / (self.size or 1.0),
        )

    def _linear(self, u, free):
        """The free entries of K u = f by conjugate gradients (Hestenes and Stiefel)."""
        library, fresh = self.library, False
        r = np.where(free, library.load - library.product(u), 0.0)
        p, rho, iterations = np.zeros(len(u)), 1.0, 0
        self.counts.systems += 1
        while np.linalg.norm(r) > LINEAR * self.force:
            if self.factored is None or (iterations >= self.keep and not fresh):
                library.factorise(free)
                self.factored, fresh, rho, p[:] = free, True, 1.0, 0.0
                self.counts.factorisations += 1
            z = np.where(free, library.precondition(r), 0.0)
            # Unknowns that are free now and were not when the factor was made.
            released = free & ~self.factored
            z[released] = r[released] / library.scale
            last, rho = rho, r @ z
            p = z + rho / last * p if p.any() else z
            q = np.where(free, library.product(p), 0.0)
            alpha = rho / (p @ q)
            u, r = u + alpha * p, r - alpha * q
            iterations += 1
        self.counts.iterations += iterations
        return u


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("library", choices=["fenicsx", "ngsolve"])
    parser.add_argument("scene", type=Path)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--keep", type=int, default=20, metavar="ITERATIONS")
    parser.add_argument("--order", type=int, choices=[1, 2],
                        help="polynomial degree of the displacements instead of the scene's")
    parser.add_argument("--out", type=Path, help="write u and ζ at about 20 times")
    arguments = parser.parse_args()
    scene = read_scene(arguments.scene)
    scene = of_order(scene, arguments.order) if arguments.order else scene
    model = Model(scene, read_triangulation(arguments.mesh))
    library = importlib.import_module(f"loop_{arguments.library}").Library(model, arguments.out)
    contact = Contact(library, model, arguments.keep)
    zeta = library.initial()
    contact.solve(0.0, zeta)
    every = -(-arguments.steps // 20)
    seconds = []
    for n in range(1, arguments.steps + 1):
        if n == 2:  # the first step makes what the others keep
            contact.counts = Counts()
        started = time.perf_counter()
        zeta = library.advance(contact.u, zeta)
        contact.solve(n * model.step, zeta)
        seconds.append(time.perf_counter() - started)
        if arguments.out and n % every == 0:
            library.write(n * model.step, contact.u, zeta)
    print(json.dumps({
        "nodes": len(model.nodes.points),
        "steps": arguments.steps,
        "seconds": seconds,
        **vars(contact.counts),
        "peak_mb": 1.024e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "compile_seconds": library.compile_seconds,
        "kkt": contact.kkt,
        "zeta_min": float(zeta.min()),
        "displacement_max": float(np.hypot(*contact.u[library.unknowns].T).max()),
        "work": float(library.load @ contact.u),
    }))


if __name__ == "__main__":
    main()
