"""The scheme's forms, factors and files in FEniCSx (dolfinx 0.5), as fast as we found: blocks of two,
forms compiled for this processor, CHOLMOD with its analysis kept."""

import logging
import os

# CHOLMOD otherwise wakes four threads in every supernode, whatever OMP_NUM_THREADS says.
os.environ.setdefault("OMP_THREAD_LIMIT", "1")

import basix
import numpy as np
import ufl
from dolfinx import fem, mesh as meshes
from dolfinx.io import XDMFFile
from mpi4py import MPI
from petsc4py import PETSc

from triangulation import edge_keys

logging.disable(logging.INFO)  # the form compiler reports each of its builds

JIT = {"cffi_extra_compile_args": ["-O3", "-march=native"]}
# In the expressions of scenes.
FUNCTIONS = {"pi": np.pi, "sin": ufl.sin, "cos": ufl.cos, "sqrt": ufl.sqrt, "exp": ufl.exp,
             "abs": abs, "min": ufl.min_value, "max": ufl.max_value, "if_": ufl.conditional}
# dolfinx numbers the middles of a triangle's sides as the vertices opposite.
ORDER = [0, 1, 2, 4, 5, 3]


class Library:
    """What loop.py asks of a library. Vectors are arrays of unknowns in dolfinx's order."""

    # Compiled forms are kept in files.
    compile_seconds = 0.0

    def __init__(self, model, out):
        element = ufl.VectorElement("Lagrange", ufl.triangle, 1)
        triangles, points = model.mesh.triangles, model.mesh.nodes
        domain = meshes.create_mesh(MPI.COMM_SELF, triangles, points, ufl.Mesh(element))
        self.space = fem.VectorFunctionSpace(domain, ("Lagrange", model.order))
        self.vertices = fem.FunctionSpace(domain, ("Lagrange", 1))
        self.u, self.zeta = fem.Function(self.space), fem.Function(self.vertices)
        self.time = fem.Constant(domain, PETSc.ScalarType(0.0))
        nodes = dofs(self.space, model.nodes.elements)
        self.unknowns = 2 * nodes[:, None] + [0, 1]
        self.zeta_initial = np.empty(len(points))
        self.zeta_initial[dofs(self.vertices, triangles)] = model.zeta
        self._elasticity(model, domain)
        self._damage(model, domain)
        self.out = Fields(out, domain, self.u, self.zeta) if out else None

    def _elasticity(self, model, domain):
        """∫ ζ 𝒜ε(v) : ε(w) and ∫ f_N · w."""
        v, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        strain = ufl.sym(ufl.grad(v))
        stress = model.shear * (strain + model.ratio * ufl.tr(strain) * ufl.Identity(2))
        self.stiffness = form(self.zeta * ufl.inner(stress, ufl.grad(w))
                              * ufl.dx(metadata={"quadrature_degree": model.order}))
        x = ufl.SpatialCoordinate(domain)
        self.tractions = []
        for name, texts in model.tractions:
            force = ufl.as_vector([f(x[0], x[1], self.time, FUNCTIONS) for f in texts])
            ds = ufl.Measure("ds", domain, subdomain_data=facets(domain, model.mesh, name))
            self.tractions.append(
                form(ufl.dot(force, w) * ds(1, metadata={"quadrature_degree": 3})))
        self.matrix = fem.petsc.create_matrix(self.stiffness, "baij")
        self.f, self.x, self.y = (self.matrix.createVecRight() for _ in range(3))
        self.load = self.f.array
        self.reduced, self.factor = None, solver()

    def _damage(self, model, domain):
        """(M + kκL) ζ = M ζ + k b(φ), φ at vertices for P1 displacements, else at interior points."""
        law, zeta, xi = model.damage, ufl.TrialFunction(self.vertices), ufl.TestFunction(self.vertices)
        self.damage_matrix = fem.petsc.assemble_matrix(form(
            (zeta * xi + model.step * law["diffusion"] * ufl.dot(ufl.grad(zeta), ufl.grad(xi))) * ufl.dx))
        self.damage_matrix.assemble()
        self.damage_factor = solver()
        self.damage_factor.setOperators(self.damage_matrix)
        strain = ufl.sym(ufl.grad(self.u))
        psi = ufl.min_value(ufl.inner(strain, strain), law["strain_cap"])
        eta = ufl.max_value(ufl.min_value(self.zeta, 1.0), law["threshold"])
        rate = law["lambda_d"] * (1 - eta) / eta + 0.5 * law["lambda_u"] * psi - law["lambda_w"]
        space = fem.FunctionSpace(domain, ("Discontinuous Lagrange", 1) if model.order == 1 else
                                  ufl.FiniteElement("Quadrature", ufl.triangle, 2, quad_scheme="default"))
        points = (space.element.interpolation_points() if model.order == 1
                  else basix.make_quadrature(basix.CellType.triangle, 2)[0])
        self.source = fem.Function(space)
        self.source_at_points = fem.Expression(-ufl.max_value(rate, 0.0), points, jit_params=JIT)
        self.cells = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
        self.right_side = form((self.zeta + model.step * self.source) * xi
                               * ufl.dx(metadata={"quadrature_degree": 2}))
        self.b, self.zeta_next = self.damage_matrix.createVecs()

    def initial(self):
        return self.zeta_initial

    def refill(self, t, zeta):
        """K(ζ) and f(t)."""
        self.time.value = t
        self.zeta.x.array[:] = zeta
        self.matrix.zeroEntries()
        fem.petsc.assemble_matrix(self.matrix, self.stiffness)
        self.matrix.assemble()
        self.load[:] = 0.0
        for traction in self.tractions:
            fem.petsc.assemble_vector(self.f, traction)

    def product(self, x):
        """K x."""
        self.x.array[:] = x
        self.matrix.mult(self.x, self.y)
        return self.y.array.copy()

    def factorise(self, free):
        """The rows and columns of K that are free; the analysis is kept."""
        if self.reduced is None:
            self.reduced = self.matrix.convert("aij", PETSc.Mat())
            self.scale = self.matrix.getDiagonal().max()[1]
        else:
            self.matrix.convert("aij", self.reduced)
        self.reduced.zeroRowsColumns(np.flatnonzero(~free).astype(PETSc.IntType), diag=self.scale)
        self.factor.setOperators(self.reduced)
        self.factor.setUp()

    def precondition(self, r):
        self.x.array[:] = r
        self.factor.apply(self.x, self.y)
        return self.y.array.copy()

    def advance(self, u, zeta):
        """ζ of the next step, (28)."""
        self.u.x.array[:], self.zeta.x.array[:] = u, zeta
        values = self.source_at_points.eval(self.cells)
        self.source.x.array[self.source.function_space.dofmap.list.array] = values.ravel()
        self.b.array[:] = 0.0
        fem.petsc.assemble_vector(self.b, self.right_side)
        self.damage_factor.apply(self.b, self.zeta_next)
        return self.zeta_next.array.copy()

    def write(self, t, u, zeta):
        self.u.x.array[:], self.zeta.x.array[:] = u, zeta
        self.out.write(t)


class Fields:
    """The results in XDMF, which takes fields of the degree of the mesh's coordinates."""

    def __init__(self, path, domain, u, zeta):
        path.parent.mkdir(parents=True, exist_ok=True)
        self.file = XDMFFile(domain.comm, str(path.with_suffix(".xdmf")), "w")
        self.file.write_mesh(domain)
        self.fields = [(u, fem.Function(fem.VectorFunctionSpace(domain, ("Lagrange", 1)), name="u")),
                       (zeta, fem.Function(zeta.function_space, name="zeta"))]

    def write(self, t):
        for field, written in self.fields:
            written.interpolate(field)
            self.file.write_function(written, t)


def form(expression):
    return fem.form(expression, jit_params=JIT)


def solver():
    """A Cholesky factor by CHOLMOD."""
    factor = PETSc.PC().create(PETSc.COMM_SELF)
    factor.setType("cholesky")
    factor.setFactorSolverType("cholmod")
    return factor


def dofs(space, elements):
    """For each node its (blocked) degree of freedom; dolfinx keeps the order of a cell's vertices."""
    elements = elements[space.mesh.topology.original_cell_index]
    found = np.empty(elements.max() + 1, np.int64)
    found[elements[:, ORDER[:elements.shape[1]]]] = space.dofmap.list.array.reshape(elements.shape)
    return found


def facets(domain, mesh, name):
    """Tag 1 on the facets of a curve."""
    topology = domain.topology
    topology.create_connectivity(1, 2)
    node = np.empty(len(mesh.nodes), np.int64)
    node[topology.connectivity(2, 0).array] = mesh.triangles[topology.original_cell_index].ravel()
    ends = node[topology.connectivity(1, 0).array.reshape(-1, 2)]
    keys = (edge_keys(edges, len(node)) for edges in (ends, mesh.edges(name)))
    found = np.flatnonzero(np.isin(*keys)).astype(np.int32)
    return meshes.meshtags(domain, 1, found, np.ones(len(found), np.int32))
