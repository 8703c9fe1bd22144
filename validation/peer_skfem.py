"""The problem of peers.py in scikit-fem: peer_skfem.py FILE.

Systems are condensed to the free unknowns and solved by CHOLMOD (scikit-sparse), without it by SciPy's SuperLU with the
ordering for symmetric matrices. While the number of free unknowns stays, the factor is kept as a preconditioner for
conjugate gradients, until these need more than KEEP iterations.
"""

import numpy as np
import skfem
from scipy.sparse.linalg import LinearOperator, cg, splu
from skfem import Basis, BilinearForm, ElementTriP1, ElementVector, LinearForm, MeshTri, condense
from skfem.helpers import ddot, div, dot, grad, sym_grad

from peer import Problem

try:
    from sksparse.cholmod import cholesky as factorise
    SOLVER = "CHOLMOD"
except ImportError:
    factorise, SOLVER = lambda A: splu(A, permc_spec="MMD_AT_PLUS_A").solve, "SuperLU"
# Iterations with one factor, and their relative residual.
KEEP, LINEAR = 7, 1e-10
p, kept = Problem(), {}
mesh = MeshTri(np.ascontiguousarray(p.points.T), np.ascontiguousarray(p.triangles.T.astype(np.int64)))
# One point integrates the stiffness exactly, and the rule of order 2 the damage.
V, V2 = (Basis(mesh, ElementVector(ElementTriP1()), intorder=order) for order in (1, 2))
Z1, Z = (Basis(mesh, ElementTriP1(), intorder=order) for order in (1, 2))


@BilinearForm
def stiffness(u, v, w):
    return w["eta"] * (2 * p.mu * ddot(sym_grad(u), sym_grad(v)) + p.lame * div(u) * div(v))


@BilinearForm
def implicit(z, xi, w):
    return z * xi + p.step * p.diffusion * dot(grad(z), grad(xi))


@LinearForm
def source(xi, w):
    strain = sym_grad(w["u"])
    phi = w["rate"] + 0.5 * p.lambda_u * np.minimum(ddot(strain, strain), p.strain_cap)
    return (w["zeta"] - p.step * np.maximum(phi, 0.0)) * xi


def damage(x, zeta, rate):
    if "damage" not in kept:
        kept["damage"] = factorise(implicit.assemble(Z).tocsc())
    return kept["damage"](source.assemble(Z, u=V2.interpolate(x), zeta=Z.interpolate(zeta), rate=Z.interpolate(rate)))


def assemble(eta):
    kept["K"] = stiffness.assemble(V, eta=Z1.interpolate(eta))


def solve(x, f, prescribed):
    A, b, x, free = condense(kept["K"], f, x=x, D=prescribed)
    missed = True
    if len(b) == kept.get("free"):
        x[free], missed = cg(A, b, x[free], rtol=LINEAR, maxiter=KEEP, M=LinearOperator(A.shape, kept["factor"]))
    if missed:
        kept["free"], kept["factor"] = len(b), factorise(A.tocsc())
        x[free] = kept["factor"](b)
    return x, kept["K"] @ x - f


p.run(f"scikit-fem {skfem.__version__}, {SOLVER}", damage, assemble, lambda x, f, gap: p.active_set(x, f, gap, solve))
