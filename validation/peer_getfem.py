"""The problem of peers.py in GetFEM: peer_getfem.py FILE.

Contact is GetFEM's basic contact brick. Its symmetric augmented Lagrangian (version 2) is the fastest version: the
default one takes 1.3 to 4 times as long. The model is solved by its Newton method, with the linear solver that it
chooses. Fixed unknowns are left out by a partial finite element space.
"""

import getfem as gf
import numpy as np

from peer import Problem

# Residuals of Newton's method over the loads (GetFEM sums magnitudes), and of conjugate gradients.
SYMMETRIC, NEWTON, LINEAR = 2, 1e-9, 1e-12
gf.util_trace_level(0)
p = Problem()
largest = np.abs(p.arrays["load"]).sum(1).max()
mesh = gf.Mesh("empty", 2)
mesh.add_point(p.points.T)
mesh.add_convex(gf.GeoTrans("GT_PK(2,1)"), np.asfortranarray(p.points.T[:, p.triangles.T]))
scalar, vector = gf.MeshFem(mesh, 1), gf.MeshFem(mesh, 2)
for space in (scalar, vector):
    space.set_classical_fem(1)
# One point integrates the stiffness exactly, and the rule of order 2 the damage.
one, two = gf.MeshIm(mesh, 1), gf.MeshIm(mesh, 2)
# GetFEM numbers the nodes anew: the place of each of ours, by its coordinates; the unknowns that are not fixed.
node = np.empty(len(p.points), int)
node[np.lexsort(p.points.T)] = np.lexsort(scalar.basic_dof_nodes())
dof = (2 * node[:, None] + [0, 1]).ravel()
theirs, free = np.argsort(node), np.setdiff1d(dof, dof[p.fixed])
ours = np.argsort(dof)[free]
md = gf.Model("real")
md.add_fem_variable("u", gf.MeshFem("partial", vector, free))
md.add_initialized_fem_data("eta", scalar, np.ones(len(node)))
for name, value in {"lame": p.lame, "mu": p.mu, "gap": 0.0 * p.sign, "alpha": p.sign**2}.items():
    md.add_initialized_data(name, value)
md.add_linear_term(one, "eta * (2 * mu * Sym(Grad_u) : Sym(Grad_Test_u) + lame * Div_u * Div_Test_u)")
loads = md.add_explicit_rhs("u", np.zeros(len(free)))
md.add_variable("pressure", len(p.contact))
normals = gf.Spmat("empty", len(p.contact), len(free))
for row, column in enumerate(np.searchsorted(free, dof[p.contact])):
    normals.add([row], [int(column)], float(p.sign[row]))
md.add_basic_contact_brick("u", "pressure", "mu", normals, "gap", "alpha", SYMMETRIC)
if p.step:
    implicit = gf.asm_generic(two, 2, f"Test2_z * Test_z + {p.step * p.diffusion} * Grad_Test2_z . Grad_Test_z", -1,
                              "z", 1, scalar, np.zeros(len(node)))
    implicit.to_csc()
    factor = gf.Precond("ildlt", implicit)
SOURCE = (f"(zeta - {p.step} * pos_part(rate + {0.5 * p.lambda_u} * min(Norm_sqr(Sym(Grad_u)), {p.strain_cap})))"
          "* Test_z")


def damage(x, zeta, rate):
    data = {"u": (vector, x[np.argsort(dof)]), "zeta": (scalar, zeta[theirs]), "rate": (scalar, rate[theirs])}
    right = gf.asm_generic(two, 1, SOURCE, -1, "z", 1, scalar, np.zeros(len(node)), *(
        word for name, (space, values) in data.items() for word in (name, 0, space, values)))
    return gf.linsolve_cg(implicit, right, factor, "res", LINEAR).ravel()[node]


def assemble(eta):
    md.set_variable("eta", eta[theirs])
    md.assembly("build_all")


def contact(guess, f, gap):
    md.set_variable("u", guess[ours])
    md.set_variable("gap", gap)
    md.set_private_rhs(loads, f[ours])
    md.solve("max_res", NEWTON * largest, "max_iter", 100)
    x = np.zeros(len(dof))
    x[ours] = md.variable("u")
    return x


p.run(f"GetFEM {gf.getfem_env('version')}", damage, assemble, contact)
