"""The scheme's forms, factors and files in NGSolve, as fast as we found: blocks of two, forms compiled to
machine code, NGSolve's own sparse Cholesky with its analysis kept."""

import contextlib
import os
import sys
import time

import netgen.meshing
import ngsolve as ng
import numpy as np
from ngsolve import TRIG, SEGM, BilinearForm, IntegrationRule, LinearForm, ds, dx, grad

# ngscxx, which compiles forms, is beside Python.
os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]

FUNCTIONS = {
    "pi": np.pi, "sin": ng.sin, "cos": ng.cos, "sqrt": ng.sqrt, "exp": ng.exp,
    "abs": lambda a: ng.IfPos(a, a, -a), "min": lambda a, b: ng.IfPos(a - b, b, a),
    "max": lambda a, b: ng.IfPos(a - b, a, b),
}
# The quadrature that defines the discrete problem: in a triangle its centroid, vertices or interior
# points, on an edge two Gauss points.
CENTROID = IntegrationRule([(1 / 3, 1 / 3)], [0.5])
VERTICES = IntegrationRule([(0, 0), (1, 0), (0, 1)], 3 * [1 / 6])
INTERIOR = IntegrationRule([(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)], 3 * [1 / 6])
GAUSS = IntegrationRule([(0.5 - 0.5 / 3**0.5,), (0.5 + 0.5 / 3**0.5,)], 2 * [0.5])
# Over the largest entry of the diagonal: the penalty on an unknown that is not free.
PENALTY = 1e13
# NGSolve numbers the middles of a triangle's sides as the vertices opposite.
ORDER = [0, 1, 2, 4, 5, 3]


class Library:
    """What loop.py asks of a library. Vectors are arrays of unknowns, two by two in NGSolve's order."""

    def __init__(self, model, out):
        self.compile_seconds = 0.0
        mesh, nodes = self._mesh(model)
        self.domain = mesh
        # Of netgen's triangles of second order; H1's own functions of order 2 are not nodal.
        self.space = ng.NodalFESpace(mesh, order=model.order, dim=2)
        self.vertices = ng.H1(mesh, order=1)
        self.unknowns = 2 * nodes[:, None] + [0, 1]
        self.zeta_initial = model.zeta
        self.u, self.zeta = ng.GridFunction(self.space), ng.GridFunction(self.vertices)
        self.time = ng.Parameter(0.0)
        self._elasticity(model)
        self._damage(model)
        if out:
            out.parent.mkdir(parents=True, exist_ok=True)
            self.out = ng.VTKOutput(mesh, [self.u, self.zeta], ["u", "zeta"], str(out),
                                    subdivision=model.order - 1)

    def _mesh(self, model):
        """netgen's mesh, and its point of each node."""
        mesh, triangles = netgen.meshing.Mesh(dim=2), model.mesh.triangles
        mesh.AddPoints(np.column_stack([model.mesh.nodes, np.zeros(len(model.mesh.nodes))]))
        mesh.AddElements(2, mesh.AddRegion("body", dim=2), triangles.astype(np.int32), base=0)
        for name, edges in model.mesh.curves.items():
            mesh.AddElements(1, mesh.AddRegion(name, dim=1), edges.astype(np.int32), base=0)
        nodes = np.arange(len(model.nodes.points))
        if model.order == 2:
            mesh.SecondOrder()
            nodes[model.nodes.elements[:, ORDER]] = mesh.Elements2D().NumPy()["nodes"][:, :6] - 1
        return ng.Mesh(mesh), nodes

    def _compiled(self, expression):
        """An expression as machine code, where there is a compiler."""
        began = time.perf_counter()
        try:
            with silenced():
                return expression.Compile(realcompile=True, maxderiv=0, wait=True)
        except Exception:  # NGSolve's own, without a compiler
            return expression.Compile()
        finally:
            self.compile_seconds += time.perf_counter() - began

    def _elasticity(self, model):
        """∫ ζ 𝒜ε(v) : ε(w) and ∫ f_N · w."""
        v, w = self.space.TnT()
        strain = ng.Sym(grad(v))
        stress = model.shear * (strain + model.ratio * ng.Trace(strain) * ng.Id(2))
        energy = self._compiled(self.zeta * ng.InnerProduct(stress, ng.Sym(grad(w))))
        rule = CENTROID if model.order == 1 else INTERIOR
        self.stiffness = BilinearForm(self.space, symmetric=True)
        self.stiffness += energy * dx(intrules={TRIG: rule})
        self.traction = LinearForm(self.space)
        for name, texts in model.tractions:
            force = ng.CF(tuple(f(ng.x, ng.y, self.time, FUNCTIONS) for f in texts))
            self.traction += ng.InnerProduct(force, w) * ds(name, intrules={SEGM: GAUSS})
        self.stiffness.Assemble()
        self.traction.Assemble()
        self.matrix = self.stiffness.mat
        self.load = self.traction.vec.FV().NumPy()
        self.x, self.y = self.matrix.CreateColVector(), self.matrix.CreateColVector()
        # Where the diagonal's entries are among the values, 2×2 a block.
        values, columns, rows = (np.asarray(part) for part in self.matrix.CSR())
        block = np.flatnonzero(columns == np.repeat(np.arange(len(rows) - 1), np.diff(rows.astype(int))))
        self.diagonal = (4 * block[:, None] + [0, 3]).ravel()
        self.values, self.factor = self.matrix.AsVector().FV().NumPy(), None

    def _damage(self, model):
        """(M + kκL) ζ = M ζ + k b(φ), φ at vertices for P1 displacements, else at interior points."""
        law, (zeta, xi) = model.damage, self.vertices.TnT()
        matrix, self.mass = BilinearForm(self.vertices, symmetric=True), BilinearForm(self.vertices)
        self.mass += zeta * xi * dx
        matrix += (zeta * xi + model.step * law["diffusion"] * grad(zeta) * grad(xi)) * dx
        matrix.Assemble(), self.mass.Assemble()
        self.damage_factor = matrix.mat.Inverse(inverse="sparsecholesky")
        largest, least = FUNCTIONS["max"], FUNCTIONS["min"]
        strain = ng.Sym(grad(self.u))
        psi = least(ng.InnerProduct(strain, strain), law["strain_cap"])
        eta = largest(least(self.zeta, 1.0), law["threshold"])
        rate = law["lambda_d"] * (1 - eta) / eta + 0.5 * law["lambda_u"] * psi - law["lambda_w"]
        source = model.step * self._compiled(-largest(rate, 0.0))
        # For P1 first k φ at each triangle's vertices times its area / 3, which is then interpolated.
        corners = ng.Discontinuous(self.vertices) if model.order == 1 else self.vertices
        rule = VERTICES if model.order == 1 else INTERIOR
        self.source, self.interpolated = LinearForm(corners), None
        self.source += source * corners.TestFunction() * dx(intrules={TRIG: rule})
        if model.order == 1:
            area, self.interpolated = LinearForm(corners), BilinearForm(corners, self.vertices)
            area += corners.TestFunction() * dx(intrules={TRIG: VERTICES})
            self.interpolated += corners.TrialFunction() * xi * dx
            area.Assemble(), self.interpolated.Assemble()
            self.area = area.vec.FV().NumPy()
        self.b, self.zeta_next = self.zeta.vec.CreateVector(), self.zeta.vec.CreateVector()

    def initial(self):
        return self.zeta_initial

    def refill(self, t, zeta):
        """K(ζ) and f(t)."""
        self.time.Set(t)
        self.zeta.vec.FV().NumPy()[:] = zeta
        self.stiffness.Assemble()
        self.traction.Assemble()

    def product(self, x):
        """K x."""
        self.x.FV().NumPy()[:] = x
        self.matrix.Mult(self.x, self.y)
        return self.y.FV().NumPy().copy()

    def factorise(self, free):
        """K with a penalty on what is not free; the analysis is kept."""
        kept = self.values[self.diagonal]
        self.scale = kept.max()
        self.values[self.diagonal] += np.where(free, 0.0, PENALTY * self.scale)
        if self.factor is None:
            self.factor = self.matrix.Inverse(inverse="sparsecholesky")
        else:
            self.factor.Update()
        self.values[self.diagonal] = kept

    def precondition(self, r):
        self.x.FV().NumPy()[:] = r
        self.factor.Mult(self.x, self.y)
        return self.y.FV().NumPy().copy()

    def advance(self, u, zeta):
        """ζ of the next step, (28)."""
        self.u.vec.FV().NumPy()[:], self.zeta.vec.FV().NumPy()[:] = u, zeta
        self.source.Assemble()
        self.mass.mat.Mult(self.zeta.vec, self.b)
        if self.interpolated:
            self.source.vec.FV().NumPy()[:] /= self.area
            self.interpolated.mat.MultAdd(1.0, self.source.vec, self.b)
        else:
            self.b += self.source.vec
        self.damage_factor.Mult(self.b, self.zeta_next)
        return self.zeta_next.FV().NumPy().copy()

    def write(self, t, u, zeta):
        self.u.vec.FV().NumPy()[:], self.zeta.vec.FV().NumPy()[:] = u, zeta
        self.out.Do(time=t)


@contextlib.contextmanager
def silenced():
    """What a compiler says is not for the screen."""
    kept = os.dup(2)
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
