"""The problem of peers.py in NGSolve: peer_ngsolve.py FILE.

Prescribed and active unknowns are cleared in the BitArray of the free ones. UMFPACK solves the systems, on one thread
the fastest of NGSolve's direct solvers here. While the active set stays, its factor is kept as a preconditioner for
conjugate gradients, until these need more than KEEP iterations.
"""

import ngsolve
import numpy as np
from netgen.meshing import FaceDescriptor, Mesh
from ngsolve import (
    H1, BilinearForm, BitArray, CGSolver, GridFunction, IfPos, InnerProduct, LinearForm, Sym, VectorH1, div, dx, grad)

from peer import Problem

# Iterations with one factor, and their relative accuracy in the energy norm.
KEEP, ENERGY = 7, 1e-9
# VectorH1 numbers the x components of all nodes first.
p = Problem(lambda points, k: k // 2 + len(points) * (k % 2))
mesh = Mesh(dim=2)
mesh.AddPoints(np.column_stack([p.points, np.zeros(len(p.points))]))
mesh.Add(FaceDescriptor(surfnr=1, domin=1, bc=1))
mesh.AddElements(dim=2, index=1, data=p.triangles, base=0)
mesh = ngsolve.Mesh(mesh)
V, Z = VectorH1(mesh, order=1), H1(mesh, order=1)
(u, v), (z, xi), solution = V.TnT(), Z.TnT(), GridFunction(V)
zeta, eta, rate = GridFunction(Z), GridFunction(Z), GridFunction(Z)
strain, r, loads = lambda w: Sym(grad(w)), solution.vec.CreateVector(), solution.vec.CreateVector()
K = BilinearForm(eta * (2 * p.mu * InnerProduct(strain(u), strain(v)) + p.lame * div(u) * div(v)) * dx, symmetric=True)
M = BilinearForm((z * xi + p.step * p.diffusion * grad(z) * grad(xi)) * dx, symmetric=True)
psi = InnerProduct(strain(solution), strain(solution))
phi = rate + 0.5 * p.lambda_u * IfPos(psi - p.strain_cap, p.strain_cap, psi)
source = LinearForm((zeta - p.step * IfPos(phi, phi, 0.0)) * xi * dx)
kept = {"prescribed": None}


def array(vector):
    return vector.FV().NumPy()


def damage(x, old, rates):
    array(solution.vec)[:], array(zeta.vec)[:], array(rate.vec)[:] = x, old, rates
    if "damage" not in kept:
        kept["damage"] = M.Assemble().mat.Inverse(inverse="sparsecholesky")
    zeta.vec.data = kept["damage"] * source.Assemble().vec
    return array(zeta.vec).copy()


def assemble(values):
    array(eta.vec)[:] = values
    K.Assemble()


def solve(x, f, prescribed):
    array(solution.vec)[:], array(loads)[:] = x, f
    r.data = loads - K.mat * solution.vec
    iterations = KEEP
    if f @ x > 0.0 and np.array_equal(prescribed, kept["prescribed"]):
        cg = CGSolver(K.mat, pre=kept["factor"], maxiter=KEEP, atol=ENERGY * (f @ x) ** 0.5)
        solution.vec.data += cg * r
        iterations = cg.iterations
    if iterations >= KEEP:
        free = BitArray(len(x))
        free.Set()
        for k in prescribed:
            free.Clear(int(k))
        kept["prescribed"], kept["factor"] = prescribed, K.mat.Inverse(free, inverse="umfpack")
        r.data = loads - K.mat * solution.vec
        solution.vec.data += kept["factor"] * r
    r.data = K.mat * solution.vec - loads
    return array(solution.vec).copy(), array(r)


p.run(f"NGSolve {ngsolve.__version__}", damage, assemble, lambda x, f, gap: p.active_set(x, f, gap, solve))
