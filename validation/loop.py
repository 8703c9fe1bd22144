#!/usr/bin/python3
"""Times the scheme as a FEniCSx user would write it: loop.py SCENE MESH [--steps N]

dolfinx forms, the damage factor kept, SNES `vinewtonrsls` with MUMPS started from the last step;
no second solves or checks as in the validation. MUMPS factorises by LU as in dolfinx's own
demonstrations, or by Cholesky (`--factor cholesky`), which halves its work. Prints one JSON object:
the seconds of each time step, the worst relative KKT residual and the last state's figures.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from dolfinx import fem
from dolfinx.io import XDMFFile
from petsc4py import PETSc

from damage import DEFAULTS, Damage
from fenicsx import Body
from scene import Expression, of_order, read_scene
from triangulation import read_triangulation


class Loop:
    """Everything that is made once for a scene."""

    def __init__(self, scene, mesh, factor):
        self.factor_type = factor
        self.body = body = Body(scene, mesh)
        self.damage = Damage(body, float(scene["time"]["step"]))
        self.factor = PETSc.KSP().create(PETSc.COMM_SELF)
        self.factor.setOperators(self.damage.matrix)
        self.factor.setType("preonly")
        self.factor.getPC().setType(factor)
        self.factor.getPC().setFactorSolverType("mumps")
        self.stiffness = fem.petsc.create_matrix(body.stiffness_form)
        self.load = fem.petsc.create_vector(body.load_forms[0])
        self.u, self.residual = self.stiffness.createVecRight(), self.stiffness.createVecRight()
        # The largest forces and displacement so far, and the worst KKT residual relative to them.
        self.force = self.size = self.kkt = 0.0
        bounds = self.bounds = body.bounds(0.0)
        self.fixed = np.asarray(bounds.fixed, PETSc.IntType)
        self.reduced = None

        lower, upper = self.u.duplicate(), self.u.duplicate()
        lower.array[:] = np.where(np.isfinite(bounds.lower), bounds.lower, PETSc.NINFINITY)
        upper.array[:] = np.where(np.isfinite(bounds.upper), bounds.upper, PETSc.INFINITY)
        self.lower, self.upper = lower, upper

    def start_solver(self):
        """The SNES, once the stiffness has its first values."""
        snes = self.snes = PETSc.SNES().create(PETSc.COMM_SELF)
        snes.setType("vinewtonrsls")
        snes.setFunction(self.function, self.residual)
        snes.setJacobian(lambda *_: None, self.reduced)
        snes.setVariableBounds(self.lower, self.upper)
        ksp = snes.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType(self.factor_type)
        ksp.getPC().setFactorSolverType("mumps")
        PETSc.Options()["snes_vi_zero_tolerance"] = 0.0
        snes.setFromOptions()

    def function(self, _snes, x, out):
        """K u − f; the prescribed unknowns are u themselves, in scale."""
        self.stiffness.mult(x, out)
        out.axpy(-1.0, self.load)
        out.array[self.fixed] = self.scale * (x.array_r[self.fixed] - self.bounds.values)

    def contact(self, t, zeta):
        """u for the damage ζ, from the last u."""
        body = self.body
        body.time.value = t
        body.zeta.x.array[body.zeta_dof_of_node] = zeta
        self.stiffness.zeroEntries()
        fem.petsc.assemble_matrix(self.stiffness, body.stiffness_form)
        self.stiffness.assemble()
        self.load.array[:] = 0.0
        for form in body.load_forms:
            fem.petsc.assemble_vector(self.load, form)
        if self.reduced is None:
            self.scale = self.stiffness.getDiagonal().norm(PETSc.NormType.NORM_INFINITY)
            self.reduced = self.stiffness.copy()
        else:
            self.stiffness.copy(self.reduced, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self.reduced.zeroRowsColumns(self.fixed, diag=self.scale)
        if not hasattr(self, "snes"):
            self.start_solver()
        self.force = max(self.force, self.load.norm())
        # Without any load so far the residual is zero, which SNES wants to be below the tolerance.
        atol = 5e-11 * self.force or 1e-300
        self.snes.setTolerances(rtol=0.0, atol=atol, stol=0.0, max_it=200)
        self.snes.solve(None, self.u)
        if self.snes.getConvergedReason() <= 0:
            raise SystemExit(f"SNES stopped with reason {self.snes.getConvergedReason()}")
        body.u.x.array[:] = self.u.array_r
        self.certify()

    def certify(self):
        """Worst relative KKT residual, as signorini measures it (with the natural residual
        min(p/F, gap/U) for complementarity)."""
        self.function(None, self.u, self.residual)
        r, u = self.residual.array_r, self.u.array_r
        self.size = max(self.size, np.abs(u).max())
        force, size = self.force or 1.0, self.size or 1.0
        below, above = np.isfinite(self.bounds.lower), np.isfinite(self.bounds.upper)
        free = ~(below | above)
        free[self.fixed] = False
        gap = np.where(below, u - self.bounds.lower, self.bounds.upper - u)
        press = np.where(below, r, -r)
        bounded = below | above
        self.kkt = max(
            self.kkt,
            np.linalg.norm(r[free]) / force,
            max(-gap[bounded].min(initial=0.0), 0.0) / size,
            np.linalg.norm(np.minimum(press[bounded], 0.0)) / force,
            np.minimum(press / force, gap / size)[bounded].max(initial=0.0),
        )

    def damage_step(self):
        """ζ of the next step, by the factor kept."""
        right = self.damage.load()
        zeta = right.duplicate()
        self.factor.solve(right, zeta)
        return zeta.array[self.damage.dof_of_node]


class Fields:
    """The results as a FEniCSx user writes them: in XDMF, which takes fields of the degree of the
    mesh's coordinates."""

    def __init__(self, path, body):
        domain, element = body.domain, ("Lagrange", body.domain.geometry.cmap.degree)
        spaces = (fem.VectorFunctionSpace(domain, element), fem.FunctionSpace(domain, element))
        names = ("displacement", "zeta")
        self.fields = [(field, fem.Function(space, name=name))
                       for field, space, name in zip((body.u, body.zeta), spaces, names)]
        path.parent.mkdir(parents=True, exist_ok=True)
        self.file = XDMFFile(domain.comm, str(path), "w")
        self.file.write_mesh(domain)

    def write(self, t):
        for field, written in self.fields:
            written.interpolate(field)
            self.file.write_function(written, t)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--factor", choices=["lu", "cholesky"], default="lu")
    parser.add_argument("--order", type=int, choices=[1, 2],
                        help="polynomial degree of the displacements instead of the scene's")
    parser.add_argument("--out", type=Path, help="write u and ζ at about 20 times, as XDMF")
    arguments = parser.parse_args()
    began = time.perf_counter()
    scene, mesh = read_scene(arguments.scene), read_triangulation(arguments.mesh)
    scene = of_order(scene, arguments.order) if arguments.order else scene
    loop = Loop(scene, mesh, arguments.factor)
    zeta = Expression({**DEFAULTS, **scene["damage"]}["initial"]).at(mesh.nodes)
    loop.contact(0.0, zeta)
    step = float(scene["time"]["step"])
    fields = Fields(arguments.out, loop.body) if arguments.out else None
    every = -(-arguments.steps // 20)
    seconds, iterations = [], []
    for n in range(1, arguments.steps + 1):
        started = time.perf_counter()
        zeta = loop.damage_step()
        loop.contact(n * step, zeta)
        seconds.append(time.perf_counter() - started)
        iterations.append(loop.snes.getIterationNumber())
        if fields and n % every == 0:
            fields.write(n * step)
    print(json.dumps({
        "nodes": len(loop.body.nodes.points),
        "steps": arguments.steps,
        "seconds": seconds,
        "iterations": iterations,
        "whole_seconds": time.perf_counter() - began,
        "kkt": loop.kkt,
        "zeta_min": float(zeta.min()),
        "displacement_max": float(np.hypot(*loop.u.array_r.reshape(-1, 2).T).max()),
    }))


if __name__ == "__main__":
    main()
