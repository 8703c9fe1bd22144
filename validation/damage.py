"""The damage equation (25)/(28) and the whole scheme, on top of `fenicsx.Body`."""

import basix
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from contact import solve_linear
from fenicsx import INTERIOR_POINTS, Body, dof_of_node, per_triangle
from lagrange import Lagrange
from scene import Expression, of_material

DEFAULTS = {"lambda_w": 0.0, "strain_cap": 1000.0, "threshold": 0.01, "initial": 1.0}


class Damage:
    """(M + kκL) ζₙ = M ζₙ₋₁ + k b(φ(ε(uₙ₋₁), ζₙ₋₁)), equation (28), on straight triangles."""

    def __init__(self, body, step):
        self.body = body
        self.law = {**DEFAULTS, **body.scene["damage"]}
        domain = body.straight
        k = fem.Constant(domain, PETSc.ScalarType(step))
        def constant(key, domain):
            values = of_material(body.scene, body.mesh, "damage", key, DEFAULTS.get(key))
            return per_triangle(domain, values)

        kappa = constant("diffusion", domain)
        for key in ("lambda_d", "lambda_u", "lambda_w", "strain_cap"):
            self.law[key] = constant(key, body.domain)
        space = fem.FunctionSpace(domain, ("Lagrange", 1))
        self.dof_of_node = dof_of_node(space, Lagrange(body.mesh, 1))
        self.zeta = fem.Function(space)
        zeta, xi = ufl.TrialFunction(space), ufl.TestFunction(space)
        self.matrix = fem.petsc.assemble_matrix(
            fem.form((zeta * xi + k * kappa * ufl.dot(ufl.grad(zeta), ufl.grad(xi))) * ufl.dx)
        )
        self.matrix.assemble()
        # φ at three points of each triangle. For P1 displacements at the vertices, from nodal ζ and
        # the triangle's strain: as a discontinuous P1 function it is then integrated exactly. For
        # P2 at the points of the quadrature, which is exact for M ζₙ₋₁, too.
        if body.order == 1:
            source = fem.FunctionSpace(domain, ("Discontinuous Lagrange", 1))
            points = source.element.interpolation_points()
        else:
            source = fem.FunctionSpace(domain, ufl.FiniteElement(
                "Quadrature", ufl.triangle, 2, quad_scheme="default"))
            points, _ = basix.make_quadrature(basix.CellType.triangle, 2)
        self.source = fem.Function(source)
        self.source_at_points = fem.Expression(
            self.phi(ufl.sym(ufl.grad(body.u)), body.zeta), points)
        # The cells of the body's own mesh, in the order of the straight ones.
        place = np.argsort(body.domain.topology.original_cell_index)
        self.cells = place[domain.topology.original_cell_index].astype(np.int32)
        self.right_side = fem.form(
            (self.zeta + k * self.source) * xi * ufl.dx(metadata=INTERIOR_POINTS))

    def phi(self, strain, zeta):
        """The source φ of section 4, with the truncations q* and η_*."""
        law = self.law
        psi = ufl.min_value(ufl.inner(strain, strain), law["strain_cap"])
        eta = ufl.max_value(ufl.min_value(zeta, 1.0), law["threshold"])
        rate = law["lambda_d"] * (1 - eta) / eta + 0.5 * law["lambda_u"] * psi - law["lambda_w"]
        return -ufl.max_value(rate, 0.0)

    def load(self):
        """The right-hand side for the body's current u and ζ."""
        body, values = self.body, self.source_at_points.eval(self.cells)
        self.source.x.array[self.source.function_space.dofmap.list.array] = values.ravel()
        self.zeta.x.array[self.dof_of_node] = body.zeta.x.array[body.zeta_dof_of_node]
        return fem.petsc.assemble_vector(self.right_side)

    def advance(self):
        """ζₙ from the body's current u and ζ, in the node order of the triangulation."""
        return solve_linear(self.matrix, self.load(), [], [])[self.dof_of_node]


def evolve(scene, mesh, observe=lambda state: None):
    """Runs a scene; returns the last admissible state and the time ζ_* was reached, or None.

    `observe` sees each accepted state. Without [time] there is one static solve at t = 1.
    """
    body = Body(scene, mesh)
    law = {**DEFAULTS, **scene.get("damage", {})}
    zeta = Expression(law["initial"]).at(mesh.nodes)
    if "time" not in scene:
        state = body.contact_step(1.0, zeta)
        observe(state)
        return state, None
    end, step = float(scene["time"]["end"]), float(scene["time"]["step"])
    damage = Damage(body, step) if "damage" in scene else None
    state = body.contact_step(0.0, zeta)
    observe(state)
    for n in range(1, round(end / step) + 1):
        zeta = damage.advance() if damage else state.zeta
        if zeta.min() <= law["threshold"]:
            return state, n * step
        state = body.contact_step(n * step, zeta)
        observe(state)
    return state, None
