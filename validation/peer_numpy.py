"""The problem of peers.py with numpy and CHOLMOD (scikit-sparse): peer_numpy.py FILE.

A matrix maps the η of the triangles to the entries of K. CHOLMOD makes a factor of K without the contact unknowns, and
one solve with many right sides their Schur complement S. The active set is found in the small problem with S. In the
steps with damage the old factor and the old S find the active set and precondition conjugate gradients, until these
need more than KEEP iterations.
"""

import sys

import numpy as np
import sksparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import coo_matrix, csc_matrix
from sksparse.cholmod import cholesky

from peer import Problem

# Iterations with one factor, and their relative accuracy in the energy norm.
KEEP, ENERGY = 20, 1e-10
p, kept = Problem(), {}
t, nodes = p.triangles.astype(np.int64), len(p.points)
# ∇λ_i is the side opposite of vertex i, turned by 90°, over twice the area.
side = p.points[np.roll(t, -2, 1)] - p.points[np.roll(t, -1, 1)]
area = 0.5 * (side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
gx, gy = -side[..., 1] / (2.0 * area)[:, None], side[..., 0] / (2.0 * area)[:, None]
# The unknowns that are not fixed, those with contact at the end.
order = np.concatenate((np.setdiff1d(p.unknowns, np.concatenate((p.fixed, p.contact))), p.contact))
size, inner = len(order), len(order) - len(p.contact)


def pattern():
    """K without entries, and the matrix from the η of the triangles to these: Σ η_T area BᵀDB."""
    b = np.zeros((len(t), 3, 6))
    b[:, 0, 0::2] = b[:, 2, 1::2] = gx
    b[:, 1, 1::2] = b[:, 2, 0::2] = gy
    d = np.diag([2.0 * p.mu, 2.0 * p.mu, p.mu]) + p.lame * np.outer([1, 1, 0], [1, 1, 0])
    element = area[:, None, None] * (b.transpose(0, 2, 1) @ d @ b)
    number = np.full(2 * nodes, -1)
    number[order] = np.arange(size)
    own = number[np.stack([2 * t, 2 * t + 1], -1).reshape(-1, 6)]
    free = (own[:, :, None] >= 0) & (own[:, None, :] >= 0)
    keys, entry = np.unique((own[:, :, None] * size + own[:, None, :])[free], return_inverse=True)
    starts = np.searchsorted(keys, size * np.arange(size + 1))
    return (csc_matrix((np.zeros(len(keys)), keys % size, starts), (size, size)),
            coo_matrix((element[free], (entry, np.nonzero(free)[0])), (len(keys), len(t))).tocsr())


K, entries = pattern()


def assemble(eta):
    K.data[:] = entries @ eta[t].mean(1)


def renew():
    """Makes the factor of K_II (I: without contact), W = K_II⁻¹ K_IC and S = K_CC − K_CI W, with signs."""
    cross = K[:inner, inner:]
    if "factor" in kept:
        kept["factor"].cholesky_inplace(K[:inner, :inner])
    else:
        kept["factor"] = cholesky(K[:inner, :inner])
    kept["cross"], kept["W"] = cross, kept["factor"](cross.toarray(order="F"))
    kept["S"] = (K[inner:, inner:].toarray() - cross.T @ kept["W"]) * np.outer(p.sign, p.sign)


def eliminate(r):
    """K_II⁻¹ r_I, and the right side r_C − K_CI K_II⁻¹ r_I of the problem with S."""
    y = kept["factor"](r[:inner])
    return y, p.sign * (r[inner:] - kept["cross"].T @ y)


def expand(y, w):
    """The unknowns from K_II⁻¹ r_I and from the signed contact unknowns."""
    return np.concatenate((y - kept["W"] @ (p.sign * w), p.sign * w))


def bounded(r, room):
    """x of least ½ xᵀK₀x − rᵀx with sign·x ≤ room, for the K₀ of the factor: a primal-dual active set in S."""
    y, g = eliminate(r)
    while True:
        free, w = ~p.active, room.copy()
        S = kept["S"][free]
        w[free] = np.linalg.solve(S[:, free], g[free] - S[:, p.active] @ room[p.active])
        if p.stays(g - kept["S"] @ w, w - room, np.abs(r).max(), np.abs([w, room]).max(initial=0.0)):
            return expand(y, w)


def conjugate_gradients(x, f):
    """x with K x = f outside of the active unknowns, or the last iterate and False."""
    free, w = ~p.active, np.zeros(len(p.contact))
    rows = np.concatenate((np.ones(inner, bool), free))
    small = cho_factor(kept["S"][np.ix_(free, free)])

    def precondition(r):
        y, g = eliminate(r)
        w[free] = cho_solve(small, g[free])
        return expand(y, w)

    product = K @ x
    r, accurate = rows * (f - product), ENERGY**2 * (x @ product)
    d = z = precondition(r)
    for _ in range(KEEP):
        if r @ z <= accurate:
            return x, True
        q = rows * (K @ d)
        alpha, before = (r @ z) / (d @ q), r @ z
        x, r = x + alpha * d, r - alpha * q
        z = precondition(r)
        d = z + (r @ z) / before * d
    return x, bool(r @ z <= accurate)


def contact(guess, f, gap):
    """The active set with the kept factor, then u with the present K; again until the signs are right."""
    x, f, converged = guess[order], f[order], "factor" in kept
    while True:
        if not converged:
            renew()
        x = x + bounded(f - K @ x, gap - p.sign * x[inner:])
        x, last = conjugate_gradients(x, f)
        if not last and not converged:
            sys.exit("conjugate gradients do not converge with a new factor")
        converged, residual = last, K @ x - f
        pressure, excess = -p.sign * residual[inner:], p.sign * x[inner:] - gap
        if converged and p.stays(pressure, excess, np.abs(residual).max(), np.abs(x).max()):
            full = np.zeros(2 * nodes)
            full[order] = x
            return full


def load(x, rate):
    """∫ φ λ_i, with φ affine between the vertices."""
    ux, uy = x[0::2][t], x[1::2][t]
    xx, yy, twice_xy = (gx * ux).sum(1), (gy * uy).sum(1), (gy * ux + gx * uy).sum(1)
    psi = np.minimum(xx**2 + yy**2 + 0.5 * twice_xy**2, p.strain_cap)
    phi = -np.maximum(rate[t] + 0.5 * p.lambda_u * psi[:, None], 0.0)
    return np.bincount(t.ravel(), (area[:, None] / 12.0 * (phi + phi.sum(1)[:, None])).ravel(), nodes)


def of_nodes(element):
    """The matrix of the nodes from those of the triangles."""
    rows, columns = (np.broadcast_to(v, element.shape).ravel() for v in (t[:, :, None], t[:, None, :]))
    return coo_matrix((element.ravel(), (rows, columns)), (nodes, nodes)).tocsc()


def diffuse(k, start, b):
    """(M + kκL)⁻¹ (M start + k b)."""
    if "M" not in kept:
        kept["M"] = of_nodes(area[:, None, None] / 12.0 * (1.0 + np.eye(3)))
        kept["L"] = of_nodes(area[:, None, None] * (gx[:, :, None] * gx[:, None, :] + gy[:, :, None] * gy[:, None, :]))
    if k not in kept:
        kept[k] = cholesky(kept["M"] + k * p.diffusion * kept["L"])
    return kept[k](kept["M"] @ start + k * b)


p.run(f"numpy {np.__version__}, scikit-sparse {sksparse.__version__}", (load, diffuse), assemble, contact)
