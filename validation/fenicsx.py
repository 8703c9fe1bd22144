#!/usr/bin/python3
"""Problem VP^hk written independently in FEniCSx: fenicsx.py SCENE MESH times it, compare.py compares its answers.

Equation numbers are those of Campo, Fernández and Silva, "Damageable contact between
an elastic body and a rigid foundation". Displacements are P1 or P2 (isoparametric where edges are
curved), ζ is P1. u comes out in the order of the nodes of `Lagrange`, ζ in that of the vertices of the
triangulation. The contact step is solved by a primal-dual active set and conjugate gradients, preconditioned by a
Cholesky factor (CHOLMOD) of an earlier matrix, which is renewed when it needs more than `--keep`
iterations (0: for every linear system). Contact and symmetry must be along x or y. Written for
dolfinx 0.5 to 0.11 (Debian 12 and newer), as fast as we found: blocks of two, forms compiled for this processor.

Prints one JSON object: seconds of each step, counts, the worst relative KKT residual, the last state.
"""

import argparse
import json
import logging
import os
import re
import resource
import time
from dataclasses import dataclass
from pathlib import Path

# Otherwise CHOLMOD would wake four threads in every supernode, whatever OMP_NUM_THREADS says.
os.environ.setdefault("OMP_THREAD_LIMIT", "1")

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.io import XDMFFile
from petsc4py import PETSc

import dolfinx_api as api
import shared  # noqa: F401
from dolfinx_api import form
from expressions import Expression
from lagrange import Lagrange
from scene import (
    DAMAGE, SceneError, direction_of, displacement_order, must_be_followed, of_material, of_order, read_scene,
)
from triangulation import edge_keys, read_triangulation

logging.disable(logging.INFO)  # the form compiler reports each of its builds

# Residuals of the linear systems over the largest load so far; signs in the active set over the largest
# load and displacement; the largest relative KKT residual of an answer; guesses of the active set.
LINEAR, SIGN, KKT, GUESSES = 1e-11, 1e-10, 1e-9, 100
UFL_FUNCTIONS = {
    "pi": np.pi, "sin": ufl.sin, "cos": ufl.cos, "tan": ufl.tan, "sqrt": ufl.sqrt,
    "exp": ufl.exp, "log": ufl.ln, "abs": abs,
    "min": ufl.min_value, "max": ufl.max_value, "atan2": api.atan2,
    "if_": ufl.conditional, "And": ufl.And, "Or": ufl.Or,
}

# The quadrature that defines the discrete loads: in a triangle the midpoints of the sides for P1,
# the three interior points of `INTERIOR_POINTS` for P2; on an edge 20 Gauss points, because the program integrates
# tractions to about 1e-6.
MIDPOINTS = {
    "quadrature_rule": "custom",
    "quadrature_degree": 2,
    "quadrature_points": [[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]],
    "quadrature_weights": [1 / 6, 1 / 6, 1 / 6],
}
INTERIOR_POINTS = {"quadrature_degree": 2}
EDGES = {"quadrature_degree": 39}
# dolfinx numbers the midpoints of a triangle's sides like the opposite vertices.
DOLFINX_ORDER = [0, 1, 2, 4, 5, 3]


@dataclass
class State:
    """The fields at one time, at the nodes of u; ζ at the vertices; and the seconds of the step."""

    time: float
    displacement: np.ndarray  # (n, 2)
    zeta: np.ndarray  # (vertices,)
    residual: np.ndarray  # (n, 2): K u − f
    contact_force: float
    active: int
    work: float
    seconds: float = 0.0


@dataclass
class Bounds:
    """Prescribed unknowns with their values; per unknown the sign s and the gap g of s·u ≤ g, s = 0 without contact."""

    fixed: np.ndarray
    values: np.ndarray
    sign: np.ndarray
    gap: np.ndarray


class ContactError(Exception):
    """The contact step was not solved to the accuracy a reference needs."""


def cholesky(matrix):
    """A factor by CHOLMOD; the symbolic analysis is kept when the matrix changes."""
    factor = PETSc.PC().create(PETSc.COMM_SELF)
    factor.setType("cholesky")
    factor.setFactorSolverType("cholmod")
    factor.setOperators(matrix)
    return factor


def per_triangle(domain, values):
    """A function that is constant on each triangle, from values in the order of the file."""
    if (values == values[0]).all():
        return fem.Constant(domain, PETSc.ScalarType(values[0]))
    function = fem.Function(api.space(domain, "Discontinuous Lagrange", 0))
    function.x.array[:] = values[domain.topology.original_cell_index]
    return function


class Body:
    """Spaces, forms and node maps of one scene on one triangulation."""

    def __init__(self, scene, mesh):
        must_be_followed(scene)
        self.scene, self.mesh, self.order = scene, mesh, displacement_order(scene)
        self.nodes, vertices = Lagrange(mesh, self.order), Lagrange(mesh, 1)
        # On a curved body ζ is defined on the straight triangles of the vertices.
        curved = self.nodes.curved()
        domain = self.domain = dolfinx_mesh(self.nodes if curved else vertices)
        self.straight = dolfinx_mesh(vertices) if curved else domain
        self.time = fem.Constant(domain, PETSc.ScalarType(0.0))
        self.V = api.space(domain, "Lagrange", self.order, is_vector=True)
        self.E = api.space(domain, "Lagrange", 1)
        self.dof_of_node = dof_of_node(self.V, self.nodes)
        self.zeta_dof_of_node = dof_of_node(self.E, vertices)
        self.u, self.zeta = fem.Function(self.V), fem.Function(self.E)
        self.boundaries = scene.get("boundary", [])

        v, w = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        # One point per triangle for P1, where it integrates ζ exactly, three for P2.
        self.stiffness_form = form(
            self.zeta * ufl.inner(self.elasticity(ufl.sym(ufl.grad(v))), ufl.sym(ufl.grad(w)))
            * ufl.dx(metadata={"quadrature_degree": self.order})
        )
        self.load_forms = [form(load) for load in self._loads(w)]
        self._bounds = None
        self._must_be_constrained()

    def elasticity(self, strain):
        """A ε: the paper's plane-stress tensor (section 4), or plane strain."""
        young, poisson = (of_material(self.scene, self.mesh, "material", key) for key in ("young", "poisson"))
        if self.scene["material"].get("plane", "stress") == "strain":
            young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
        young, poisson = (per_triangle(self.domain, values) for values in (young, poisson))
        return young / (1 + poisson) * (poisson / (1 - poisson) * ufl.tr(strain) * ufl.Identity(2) + strain)

    def _loads(self, w):
        """The terms of (f, w)_V: the body force and the tractions."""
        x = ufl.SpatialCoordinate(self.domain)

        def vector(texts):
            parts = [Expression(s)(x[0], x[1], self.time, UFL_FUNCTIONS) for s in texts]
            return None if all(p == 0 for p in parts) else ufl.as_vector(parts)

        force = vector(self.scene.get("body", {}).get("force", ["0", "0"]))
        if force is not None:
            rule = MIDPOINTS if self.order == 1 else INTERIOR_POINTS
            yield ufl.dot(force, w) * ufl.dx(metadata=rule)
        gravity = vector(self.scene.get("body", {}).get("gravity", ["0", "0"]))
        if gravity is not None:
            density = per_triangle(self.domain, of_material(self.scene, self.mesh, "material", "density", 0.0))
            yield density * ufl.dot(gravity, w) * ufl.dx(metadata={"quadrature_degree": 2})
        for boundary in self.boundaries:
            traction = vector(boundary.get("traction", ["0", "0"]))
            if "pressure" in boundary:
                pressure = Expression(boundary["pressure"])(x[0], x[1], self.time, UFL_FUNCTIONS)
                pressure = -pressure * ufl.FacetNormal(self.domain)
                traction = pressure if traction is None else traction + pressure
            if traction is not None:
                edges = facet_tags(self.domain, self.mesh, boundary["name"])
                ds = ufl.Measure("ds", self.domain, subdomain_data=edges)
                yield ufl.dot(traction, w) * ds(1, metadata=EDGES)

    def _unknowns(self, nodes, component):
        return 2 * self.dof_of_node[nodes] + component

    def bounds(self, t):
        """Γ_D, symmetry and the gap as prescribed values and bounds on single unknowns; the same arrays as long as
        they do not depend on t."""
        moving = (str(b.get(key)) for b in self.boundaries for key in ("gap", "displacement"))
        if self._bounds is None or any(re.search(r"\bt\b", text) for text in moving):
            self._bounds = self._bounds_at(t)
        return self._bounds

    def _bounds_at(self, t):
        size = 2 * len(self.nodes.points)
        value, sign, gap = np.full(size, np.nan), np.zeros(size), np.full(size, np.inf)
        for boundary in self.boundaries:
            nodes = np.unique(self.nodes.on(self.mesh.edges(boundary["name"])))
            points = self.nodes.points[nodes]
            for component, text in enumerate(boundary.get("displacement", ())):
                if text != "free":
                    value[self._unknowns(nodes, component)] = Expression(text).at(points, t)
            if {"symmetry", "gap"} & set(boundary):
                for members, component, s in self.sides(boundary):
                    k = self._unknowns(members, component)
                    if boundary.get("symmetry"):
                        value[k] = 0.0
                    else:
                        sign[k] = s
                        gap[k] = np.minimum(gap[k], Expression(boundary["gap"]).at(self.nodes.points[members], t))
        fixed = np.flatnonzero(np.isfinite(value))
        # A node on both Γ_D and Γ_C keeps its prescribed value.
        sign[fixed] = 0.0
        return Bounds(fixed, value[fixed], sign, np.where(sign == 0.0, 0.0, gap))

    def _must_be_constrained(self):
        """An error for a body that can move rigidly even in full contact, as u is not unique."""
        bounds = self.bounds(0.0)
        constrained = bounds.sign != 0.0
        constrained[bounds.fixed] = True
        constrained = constrained.reshape(-1, 2)[self.dof_of_node]
        points = self.nodes.points
        x, y = ((points - points.mean(axis=0)) / np.ptp(points)).T
        motions = np.array([[1 + 0 * x, 0 * x], [0 * x, 1 + 0 * x], [-y, x]])
        if np.linalg.matrix_rank(motions.transpose(0, 2, 1)[:, constrained]) < 3:
            raise SceneError("the body may move rigidly, its displacement is not unique")

    def sides(self, boundary):
        """(nodes, component, sign) for each direction ν = sign·e of a straight boundary."""
        name = boundary["name"]
        edges = self.mesh.edges(name)
        normals, _ = self.mesh.outward_normals(name)
        curved = self.nodes.curved(edges)
        if "normal" in boundary:
            normals, curved = np.broadcast_to(direction_of(boundary), normals.shape), False
        if curved or (np.abs(normals).max(axis=1) < 1 - 1e-9).any():
            raise SceneError(f"boundary '{name}': this check knows only contact and symmetry along x or y")
        component = np.abs(normals).argmax(axis=1)
        sign = np.sign(normals[np.arange(len(normals)), component])
        for c, s in sorted(set(zip(component, sign))):
            members = edges[(component == c) & (sign == s)]
            yield np.unique(self.nodes.on(members)), int(c), int(s)


class Damage:
    """(M + kκL) ζₙ = M ζₙ₋₁ + k b(φ(ε(uₙ₋₁), ζₙ₋₁)), equation (28), on straight triangles."""

    def __init__(self, body, step):
        self.body = body
        self.law = {**DAMAGE, **body.scene["damage"]}
        if self.law["mass"] != "consistent":
            raise SceneError("damage.mass: this check knows only the consistent mass")
        domain = body.straight
        k = fem.Constant(domain, PETSc.ScalarType(step))
        for key in ("diffusion", "lambda_d", "lambda_u", "lambda_w", "strain_cap"):
            values = of_material(body.scene, body.mesh, "damage", key, DAMAGE.get(key))
            self.law[key] = per_triangle(domain if key == "diffusion" else body.domain, values)
        space = api.space(domain, "Lagrange", 1)
        self.dof_of_node = dof_of_node(space, Lagrange(body.mesh, 1))
        self.zeta = fem.Function(space)
        zeta, xi = ufl.TrialFunction(space), ufl.TestFunction(space)
        self.matrix = fem.petsc.assemble_matrix(
            form((zeta * xi + k * self.law["diffusion"] * ufl.dot(ufl.grad(zeta), ufl.grad(xi))) * ufl.dx)
        )
        self.matrix.assemble()
        self.factor = cholesky(self.matrix)
        # φ at three points of each triangle. For P1 displacements at the vertices, from nodal ζ and
        # the triangle's strain: as a discontinuous P1 function it is then integrated exactly. For
        # P2 at the points of the quadrature, which is exact for M ζₙ₋₁, too.
        if body.order == 1:
            source = api.space(domain, "Discontinuous Lagrange", 1)
            points = api.interpolation_points(source)
        else:
            source, points = api.quadrature_space(domain, 2)
        self.source = fem.Function(source)
        self.source_at_points = fem.Expression(self.phi(ufl.sym(ufl.grad(body.u)), body.zeta), points, **api.JIT)
        # The cells of the body's own mesh, in the order of the straight ones.
        place = np.argsort(body.domain.topology.original_cell_index)
        self.cells = place[domain.topology.original_cell_index].astype(np.int32)
        self.right_side = form((self.zeta + k * self.source) * xi * ufl.dx(metadata=INTERIOR_POINTS))

    def phi(self, strain, zeta):
        """The source φ of section 4, with the truncations q* and η_*."""
        law = self.law
        psi = ufl.min_value(ufl.inner(strain, strain), law["strain_cap"])
        eta = ufl.max_value(ufl.min_value(zeta, 1.0), law["threshold"])
        rate = law["lambda_d"] * (1 - eta) / eta + 0.5 * law["lambda_u"] * psi - law["lambda_w"]
        return -ufl.max_value(rate, 0.0)

    def advance(self):
        """ζₙ from the body's current u and ζ, in the node order of the triangulation."""
        body = self.body
        values = api.values(self.source_at_points, body.domain, self.cells)
        self.source.x.array[api.dofs(self.source.function_space).ravel()] = values.ravel()
        self.zeta.x.array[self.dof_of_node] = body.zeta.x.array[body.zeta_dof_of_node]
        right = fem.petsc.assemble_vector(self.right_side)
        zeta, correction = right.duplicate(), right.duplicate()
        self.factor.apply(right, zeta)
        right.axpy(-1.0, self.matrix * zeta)
        self.factor.apply(right, correction)
        return (zeta.array + correction.array)[self.dof_of_node]


class Contact:
    """The contact step (26): min ½uᵀK(ζ)u − fᵀu, s·u ≤ g, by a primal-dual active set."""

    def __init__(self, body, keep=0):
        self.body, self.keep = body, keep
        self.counts = {"systems": 0, "iterations": 0, "factorisations": 0}
        self.matrix = fem.petsc.create_matrix(body.stiffness_form, "baij")
        self.f, self.x, self.y = (self.matrix.createVecRight() for _ in range(3))
        self.reduced = self.factored = self.active = None
        self.u = self.before = np.zeros(self.f.size)
        self.force = self.size = self.kkt = 0.0

    def product(self, x):
        """K x."""
        self.x.array[:] = x
        self.matrix.mult(self.x, self.y)
        return self.y.array.copy()

    def factorise(self, free):
        """A factor of the free rows and columns of K."""
        if self.reduced is None:
            self.reduced = self.matrix.convert("aij", PETSc.Mat())
            self.factor = cholesky(self.reduced)
        else:
            self.matrix.convert("aij", self.reduced)
        self.scale = self.matrix.getDiagonal().max()[1]
        self.reduced.zeroRowsColumns(np.flatnonzero(~free).astype(PETSc.IntType), diag=self.scale)
        self.factor.setOperators(self.reduced)
        self.factor.setUp()
        self.factored = free
        self.counts["factorisations"] += 1

    def precondition(self, r):
        self.x.array[:] = r
        self.factor.apply(self.x, self.y)
        return self.y.array.copy()

    def solve(self, t, zeta):
        """The state for the damage ζ. The first guess is the linear extrapolation of the last two states."""
        body = self.body
        body.time.value = t
        body.zeta.x.array[body.zeta_dof_of_node] = zeta
        self.matrix.zeroEntries()
        fem.petsc.assemble_matrix(self.matrix, body.stiffness_form)
        self.matrix.assemble()
        self.f.array[:] = 0.0
        for load in body.load_forms:
            fem.petsc.assemble_vector(self.f, load)
        f, bounds = self.f.array, body.bounds(t)
        s, gap = bounds.sign, bounds.gap
        fixed = np.zeros(len(s), bool)
        fixed[bounds.fixed] = True
        # Full contact is the first guess: without it a body may be free to move.
        active = s != 0.0 if self.active is None else self.active
        self.force = max(self.force, np.linalg.norm(f))
        u, self.before = 2 * self.u - self.before, self.u
        for _ in range(GUESSES):
            u[fixed] = bounds.values
            u[active] = (s * gap)[active]
            free = ~(fixed | active)
            u = self._linear(u, free)
            self.size = max(self.size, np.abs(u).max())
            reaction = self.product(u) - f
            self.force = max(self.force, np.abs(reaction).max())
            pressure, penetration = -s * reaction, s * u - gap
            following = (s != 0) & np.where(active, pressure >= -SIGN * self.force, penetration > SIGN * self.size)
            if (following == active).all():
                break
            active = following
        else:
            raise ContactError(f"no active set within {GUESSES} guesses")
        force, size = self.force or 1.0, self.size or 1.0
        self.kkt = max(self.kkt, np.linalg.norm(reaction[free]) / force,
                       -pressure[active].min(initial=0.0) / force, penetration[s != 0].max(initial=0.0) / size)
        if not self.kkt <= KKT:
            raise ContactError(f"the KKT conditions hold only to {self.kkt:.1e} (relative)")
        self.u, self.active, body.u.x.array[:] = u, active, u
        return State(t, u.reshape(-1, 2)[body.dof_of_node], np.array(zeta, float),
                     reaction.reshape(-1, 2)[body.dof_of_node], float(np.abs(reaction[s != 0]).sum()),
                     int((pressure[active] > 0.0).sum()), float(f @ u))

    def _linear(self, u, free):
        """The free entries of K u = f by conjugate gradients (Hestenes and Stiefel); with a factor of this matrix
        refined to rounding."""
        f, fresh = self.f.array, False
        r = np.where(free, f - self.product(u), 0.0)
        p, rho, iterations = np.zeros(len(u)), 1.0, 0
        self.counts["systems"] += 1
        if not self.keep or self.factored is None:
            self.factorise(free)
            for _ in range(3):
                u = u + np.where(free, self.precondition(r), 0.0)
                r = np.where(free, f - self.product(u), 0.0)
            self.counts["iterations"] += 3
            return u
        while np.linalg.norm(r) > LINEAR * self.force:
            if iterations >= self.keep and not fresh:
                self.factorise(free)
                fresh, rho, p[:] = True, 1.0, 0.0
            z = np.where(free, self.precondition(r), 0.0)
            # Unknowns that are free now and were not free when the factor was made.
            released = free & ~self.factored
            z[released] = r[released] / self.scale
            last, rho = rho, r @ z
            p = z + rho / last * p if p.any() else z
            q = np.where(free, self.product(p), 0.0)
            alpha = rho / (p @ q)
            u, r = u + alpha * p, r - alpha * q
            iterations += 1
        self.counts["iterations"] += iterations
        return u


def dolfinx_mesh(nodes):
    """The mesh whose coordinates are interpolated between the nodes: straight triangles from the
    vertices, parabolic sides from the nodes of P2."""
    cells = nodes.elements[:, DOLFINX_ORDER[:nodes.elements.shape[1]]]
    return api.create_mesh(cells, nodes.points, nodes.order)


def dof_of_node(space, nodes):
    """Per node: its (blocked) degree of freedom.

    dolfinx reorders twice: nodes and cells when it builds the mesh, unknowns when it builds a
    space. It keeps the order of a cell's vertices.
    """
    elements = nodes.elements[space.mesh.topology.original_cell_index]
    dof = np.empty(len(nodes.points), np.int64)
    dof[elements[:, DOLFINX_ORDER[:elements.shape[1]]]] = api.dofs(space)
    return dof


def facet_tags(domain, mesh, name):
    """Tag 1 on the facets of a curve of the triangulation."""
    topology = domain.topology
    topology.create_connectivity(1, 2)  # meshtags and ds need it
    node_of_vertex = np.empty(len(mesh.nodes), np.int64)
    triangles = mesh.triangles[topology.original_cell_index]
    node_of_vertex[topology.connectivity(2, 0).array] = triangles.ravel()
    facets = node_of_vertex[topology.connectivity(1, 0).array.reshape(-1, 2)]
    size = len(node_of_vertex)
    wanted = np.isin(edge_keys(facets, size), edge_keys(mesh.edges(name), size))
    found = np.flatnonzero(wanted).astype(np.int32)
    return dolfinx.mesh.meshtags(domain, 1, found, np.ones(len(found), np.int32))


def evolve(scene, mesh, contact=None):
    """Yields each accepted state of a scene until its end or ζ_*; the state of a static scene is at t = 1."""
    contact = contact or Contact(Body(scene, mesh))
    body, law = contact.body, {**DAMAGE, **scene.get("damage", {})}
    zeta = Expression(law["initial"]).at(mesh.nodes)
    if "time" not in scene:
        yield contact.solve(1.0, zeta)
        return
    end, step = float(scene["time"]["end"]), float(scene["time"]["step"])
    damage = Damage(body, step) if "damage" in scene else None
    yield contact.solve(0.0, zeta)
    for n in range(1, round(end / step) + 1):
        started = time.perf_counter()
        zeta = damage.advance() if damage else zeta
        if zeta.min() <= law["threshold"]:
            return
        state = contact.solve(n * step, zeta)
        state.seconds = time.perf_counter() - started
        yield state


class Fields:
    """Writes the results in XDMF, which accepts fields of the degree of the mesh."""

    def __init__(self, path, body):
        path.parent.mkdir(parents=True, exist_ok=True)
        self.file = XDMFFile(body.domain.comm, str(path.with_suffix(".xdmf")), "w")
        self.file.write_mesh(body.domain)
        linear = api.space(body.domain, "Lagrange", 1, is_vector=True)
        self.fields = [(body.u, fem.Function(linear, name="u")), (body.zeta, fem.Function(body.E, name="zeta"))]

    def write(self, t):
        for field, written in self.fields:
            written.interpolate(field)
            self.file.write_function(written, t)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--keep", type=int, default=20, metavar="ITERATIONS")
    parser.add_argument("--order", type=int, choices=[1, 2], help="of the displacements instead of the scene's")
    parser.add_argument("--out", type=Path, help="write u and ζ at about 20 times")
    arguments = parser.parse_args()
    scene = read_scene(arguments.scene)
    scene = of_order(scene, arguments.order) if arguments.order else scene
    step = float(scene["time"]["step"])
    scene["time"] = {**scene["time"], "end": arguments.steps * step}
    mesh = read_triangulation(arguments.mesh)
    contact = Contact(Body(scene, mesh), arguments.keep)
    fields, every, states = None, -(-arguments.steps // 20), []
    for n, state in enumerate(evolve(scene, mesh, contact)):
        states.append(state)
        if n == 1:  # the first step makes the factor that all steps use
            contact.counts = dict.fromkeys(contact.counts, 0)
        if arguments.out and n and n % every == 0:
            fields = fields or Fields(arguments.out, contact.body)
            fields.write(state.time)
    print(json.dumps({
        "nodes": len(contact.body.nodes.points),
        "steps": arguments.steps,
        "seconds": [state.seconds for state in states[1:]],
        **contact.counts,
        "peak_mb": 1.024e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "kkt": contact.kkt,
        "zeta_min": float(states[-1].zeta.min()),
        "displacement_max": float(np.hypot(*states[-1].displacement.T).max()),
        "work": states[-1].work,
    }))


if __name__ == "__main__":
    main()
