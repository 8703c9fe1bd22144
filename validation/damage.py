"""The damage equation (25)/(28) and the whole scheme, on top of `fenicsx.Body`."""

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from contact import solve_linear
from fenicsx import Body
from scene import Expression

DEFAULTS = {"lambda_w": 0.0, "strain_cap": 1000.0, "threshold": 0.01, "initial": 1.0}


class Damage:
    """(M + kκL) ζₙ = M ζₙ₋₁ + k b(φ(ε(uₙ₋₁), ζₙ₋₁)), equation (28)."""

    def __init__(self, body, step):
        self.body = body
        self.law = {**DEFAULTS, **body.scene["damage"]}
        k = fem.Constant(body.domain, PETSc.ScalarType(step))
        kappa = fem.Constant(body.domain, PETSc.ScalarType(self.law["diffusion"]))
        zeta, xi = ufl.TrialFunction(body.E), ufl.TestFunction(body.E)
        self.matrix = fem.petsc.assemble_matrix(
            fem.form((zeta * xi + k * kappa * ufl.dot(ufl.grad(zeta), ufl.grad(xi))) * ufl.dx)
        )
        self.matrix.assemble()
        # φ at the three vertices of each triangle, from nodal ζ and the triangle's strain;
        # as a discontinuous P1 function it is then integrated exactly.
        corners = fem.FunctionSpace(body.domain, ("Discontinuous Lagrange", 1))
        self.source = fem.Function(corners)
        self.source_at_corners = fem.Expression(
            self.phi(ufl.sym(ufl.grad(body.u)), body.zeta), corners.element.interpolation_points()
        )
        self.right_side = fem.form((body.zeta + k * self.source) * xi * ufl.dx)

    def phi(self, strain, zeta):
        """The source φ of section 4, with the truncations q* and η_*."""
        law = self.law
        psi = ufl.min_value(ufl.inner(strain, strain), law["strain_cap"])
        eta = ufl.max_value(ufl.min_value(zeta, 1.0), law["threshold"])
        rate = law["lambda_d"] * (1 - eta) / eta + 0.5 * law["lambda_u"] * psi - law["lambda_w"]
        return -ufl.max_value(rate, 0.0)

    def advance(self):
        """ζₙ from the body's current u and ζ, in the node order of the triangulation."""
        self.source.interpolate(self.source_at_corners)
        right_side = fem.petsc.assemble_vector(self.right_side)
        return solve_linear(self.matrix, right_side, [], [])[self.body.zeta_dof_of_node]


def evolve(scene, mesh, observe=lambda state: None):
    """Runs a scene; returns the last admissible state and the time ζ_* was reached, or None.

    `observe` sees each accepted state. Without [time] there is one static solve at t = 1.
    """
    body = Body(scene, mesh)
    law = {**DEFAULTS, **scene.get("damage", {})}
    zeta = Expression(law["initial"]).at(mesh.nodes)
    if "time" not in scene:
        state = body.equilibrium(1.0, zeta)
        observe(state)
        return state, None
    end, step = float(scene["time"]["end"]), float(scene["time"]["step"])
    damage = Damage(body, step) if "damage" in scene else None
    state = body.equilibrium(0.0, zeta)
    observe(state)
    for n in range(1, round(end / step) + 1):
        zeta = damage.advance() if damage else state.zeta
        if zeta.min() <= law["threshold"]:
            return state, n * step
        state = body.equilibrium(n * step, zeta)
        observe(state)
    return state, None
