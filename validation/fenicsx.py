"""Problem VP^hk written independently in FEniCSx: forms in UFL, algebra in PETSc.

Equation numbers are those of Campo, Fernández and Silva, "Damageable contact between
an elastic body and a rigid foundation". Displacements are P1 or P2 (isoparametric where edges are
curved), ζ is P1. u comes out in the order of the nodes of `Lagrange`, ζ goes in and comes out in
that of the vertices of the triangulation. Written for dolfinx 0.5 (Debian 12).
"""

import logging
from dataclasses import dataclass

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from contact import Bounds, solve_contact
from lagrange import Lagrange
from scene import Expression, SceneError, displacement_order, of_material
from triangulation import edge_keys

logging.disable(logging.INFO)  # the form compiler reports each of its builds

UFL_FUNCTIONS = {
    "pi": np.pi, "sin": ufl.sin, "cos": ufl.cos, "tan": ufl.tan, "sqrt": ufl.sqrt,
    "exp": ufl.exp, "log": ufl.ln, "abs": abs,
    "min": ufl.min_value, "max": ufl.max_value, "atan2": ufl.atan_2,
    "if_": ufl.conditional, "And": ufl.And, "Or": ufl.Or,
}

# The quadrature that defines the discrete loads: in a triangle the midpoints of the sides for P1,
# the three interior points of `INTERIOR_POINTS` for P2; two Gauss points on an edge.
MIDPOINTS = {
    "quadrature_rule": "custom",
    "quadrature_degree": 2,
    "quadrature_points": [[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]],
    "quadrature_weights": [1 / 6, 1 / 6, 1 / 6],
}
INTERIOR_POINTS = {"quadrature_degree": 2}
TWO_GAUSS_POINTS = {"quadrature_degree": 3}
# dolfinx numbers the middles of a triangle's sides as the vertices opposite.
DOLFINX_ORDER = [0, 1, 2, 4, 5, 3]


@dataclass
class State:
    """The fields at one time, at the nodes of u; ζ at the vertices."""

    time: float
    displacement: np.ndarray  # (n, 2)
    zeta: np.ndarray  # (vertices,)
    residual: np.ndarray  # (n, 2): K u − f
    contact_force: float
    active: int


def per_triangle(domain, values):
    """A function that is constant on each triangle, from the values in the order they were given."""
    if (values == values[0]).all():
        return fem.Constant(domain, PETSc.ScalarType(values[0]))
    function = fem.Function(fem.FunctionSpace(domain, ("Discontinuous Lagrange", 0)))
    function.x.array[:] = values[domain.topology.original_cell_index]
    return function


class Body:
    """Spaces, forms and node maps of one scene on one triangulation."""

    def __init__(self, scene, mesh):
        self.scene, self.mesh, self.order = scene, mesh, displacement_order(scene)
        self.nodes, vertices = Lagrange(mesh, self.order), Lagrange(mesh, 1)
        # Of a curved body ζ lives on the straight triangles of the vertices.
        curved = self.nodes.curved()
        domain = self.domain = dolfinx_mesh(self.nodes if curved else vertices)
        self.straight = dolfinx_mesh(vertices) if curved else domain
        self.time = fem.Constant(domain, PETSc.ScalarType(0.0))
        self.V = fem.VectorFunctionSpace(domain, ("Lagrange", self.order))
        self.E = fem.FunctionSpace(domain, ("Lagrange", 1))
        self.dof_of_node = dof_of_node(self.V, self.nodes)
        self.zeta_dof_of_node = dof_of_node(self.E, vertices)
        self.u, self.zeta = fem.Function(self.V), fem.Function(self.E)
        self.boundaries = scene.get("boundary", [])

        v, w = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        # One point per triangle for P1, where it integrates ζ exactly, three for P2.
        self.stiffness_form = fem.form(
            self.zeta * ufl.inner(self.elasticity(ufl.sym(ufl.grad(v))), ufl.sym(ufl.grad(w)))
            * ufl.dx(metadata={"quadrature_degree": self.order})
        )
        self.load_forms = [fem.form(form) for form in self._loads(w)]
        self._must_be_constrained()

    def elasticity(self, strain):
        """A ε: the paper's plane-stress tensor (section 4), or plane strain."""
        young, poisson = (of_material(self.scene, self.mesh, "material", key)
                          for key in ("young", "poisson"))
        if self.scene["material"].get("plane", "stress") == "strain":
            young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
        young, poisson = (per_triangle(self.domain, values) for values in (young, poisson))
        return young / (1 + poisson) * (
            poisson / (1 - poisson) * ufl.tr(strain) * ufl.Identity(2) + strain
        )

    def _loads(self, w):
        """The terms of (f, w)_V: body force, and a traction on each boundary that has one."""
        x = ufl.SpatialCoordinate(self.domain)

        def vector(texts):
            parts = [Expression(s)(x[0], x[1], self.time, UFL_FUNCTIONS) for s in texts]
            return None if all(p == 0 for p in parts) else ufl.as_vector(parts)

        force = vector(self.scene.get("body", {}).get("force", ["0", "0"]))
        if force is not None:
            rule = MIDPOINTS if self.order == 1 else INTERIOR_POINTS
            yield ufl.dot(force, w) * ufl.dx(metadata=rule)
        for boundary in self.boundaries:
            traction = vector(boundary.get("traction", ["0", "0"]))
            if "pressure" in boundary:
                pressure = Expression(boundary["pressure"])(x[0], x[1], self.time, UFL_FUNCTIONS)
                pressure = -pressure * ufl.FacetNormal(self.domain)
                traction = pressure if traction is None else traction + pressure
            if traction is not None:
                edges = _facet_tags(self.domain, self.mesh, boundary["name"])
                ds = ufl.Measure("ds", self.domain, subdomain_data=edges)
                yield ufl.dot(traction, w) * ds(1, metadata=TWO_GAUSS_POINTS)

    def _unknowns(self, nodes, component):
        return 2 * self.dof_of_node[nodes] + component

    def bounds(self, t):
        """Γ_D, symmetry and the gap as prescribed values and bounds on single unknowns."""
        size = 2 * len(self.nodes.points)
        value, lower, upper = np.full(size, np.nan), np.full(size, -np.inf), np.full(size, np.inf)
        for boundary in self.boundaries:
            name = boundary["name"]
            nodes = np.unique(self.nodes.on(self.mesh.edges(name)))
            points = self.nodes.points[nodes]
            if "displacement" in boundary:
                for component, text in enumerate(boundary["displacement"]):
                    if text != "free":
                        value[self._unknowns(nodes, component)] = Expression(text).at(points, t)
            if boundary.get("symmetry"):
                for members, component, _ in self.sides(boundary):
                    value[self._unknowns(members, component)] = 0.0
            if "gap" in boundary:
                for members, component, sign in self.sides(boundary):
                    # ν = ± e: u·ν ≤ g bounds one component from above or below.
                    gap = Expression(boundary["gap"]).at(self.nodes.points[members], t)
                    k = self._unknowns(members, component)
                    if sign > 0:
                        upper[k] = np.minimum(upper[k], gap)
                    else:
                        lower[k] = np.maximum(lower[k], -gap)
        fixed = np.flatnonzero(np.isfinite(value))
        # A node on both Γ_D and Γ_C keeps its prescribed value.
        lower[fixed], upper[fixed] = -np.inf, np.inf
        return Bounds(fixed, value[fixed], lower, upper)

    def _must_be_constrained(self):
        """Refuses a body that can move rigidly even in full contact: u is not unique."""
        bounds = self.bounds(0.0)
        constrained = np.isfinite(bounds.lower) | np.isfinite(bounds.upper)
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
            normals, curved = np.broadcast_to(boundary_direction(boundary), normals.shape), False
        if curved or (np.abs(normals).max(axis=1) < 1 - 1e-9).any():
            raise SceneError(
                f"boundary '{name}': this check knows only contact and symmetry along x or y"
            )
        component = np.abs(normals).argmax(axis=1)
        sign = np.sign(normals[np.arange(len(normals)), component])
        for c, s in sorted(set(zip(component, sign))):
            members = edges[(component == c) & (sign == s)]
            yield np.unique(self.nodes.on(members)), int(c), int(s)

    def contact_step(self, t, zeta):
        """Problem (26), or (27) at t = 0: the displacement for a given damage field."""
        self.time.value = t
        self.zeta.x.array[self.zeta_dof_of_node] = zeta
        stiffness = fem.petsc.assemble_matrix(self.stiffness_form)
        stiffness.assemble()
        load = stiffness.createVecRight()
        for form in self.load_forms:
            load.axpy(1.0, fem.petsc.assemble_vector(form))
        result = solve_contact(stiffness, load, self.bounds(t))
        self.u.x.array[:] = result.displacement
        return State(
            t,
            result.displacement.reshape(-1, 2)[self.dof_of_node],
            np.array(zeta, float),
            result.residual.reshape(-1, 2)[self.dof_of_node],
            result.contact_force,
            result.active,
        )


def boundary_direction(boundary):
    """The obstacle's fixed direction as a unit vector."""
    direction = np.array([float(Expression(s)(0.0, 0.0, 0.0)) for s in boundary["normal"]])
    return direction / np.linalg.norm(direction)


def dolfinx_mesh(nodes):
    """The mesh whose coordinates are interpolated between the nodes: straight triangles from the
    vertices, parabolic sides from the nodes of P2."""
    element = ufl.VectorElement("Lagrange", ufl.triangle, nodes.order)
    cells = nodes.elements[:, DOLFINX_ORDER[:nodes.elements.shape[1]]]
    return dolfinx.mesh.create_mesh(MPI.COMM_SELF, cells, nodes.points, ufl.Mesh(element))


def dof_of_node(space, nodes):
    """For each of the nodes its (blocked) degree of freedom.

    dolfinx reorders twice: nodes and cells when it builds the mesh, unknowns when it builds a
    space. It keeps the order of a cell's vertices.
    """
    elements = nodes.elements[space.mesh.topology.original_cell_index]
    dof = np.empty(len(nodes.points), np.int64)
    dof[elements[:, DOLFINX_ORDER[:elements.shape[1]]]] = (
        space.dofmap.list.array.reshape(elements.shape))
    return dof


def _facet_tags(domain, mesh, name):
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
