"""The contact step (26), solved independently of the program: min ½uᵀKu − fᵀu, Du = d, Au ≤ g.

Prescribed rows are eliminated node by node, with an orthonormal basis of the remaining directions: u = lift + Zv. An
interior-point method finds the active set, and a refined linear solve on it gives the answer. Parallel, opposite and
redundant rows are allowed. The ranks of the rigid motions and the lemma of Farkas decide whether a solution exists and
whether it is unique.
"""

import numpy as np
from scipy.linalg import null_space, qr
from scipy.optimize import linprog, nnls
from scipy.sparse import bmat, coo_matrix, diags, identity
from scipy.sparse.linalg import splu

RANK = 1e-9  # singular values of unit-sized rows below this are zero


class Step:
    """One contact step: its algebra, whether it has a solution, and the solution."""

    def __init__(self, discrete, zeta, t):
        self.discrete, self.rows = discrete, discrete.contact_rows(t)
        self.k, self.f = discrete.stiffness(zeta), discrete.load(t)
        self.prescribed = discrete.prescribed_rows(t)
        self.zeta = zeta
        self._eliminate()
        self.q = self.z.T @ (self.f - self.k @ self.lift)
        self.a = row_matrix(self.rows, len(self.f)) @ self.z
        self.b = self.rows.value - along(self.rows, self.lift)
        self._motions()
        self.contradiction, self.penetration = self._contradiction(), self._penetration()
        self.overlap, self.squeezed = self._overlap(), self._overlap(1e3)
        self.driven = self._driven()

    def _eliminate(self):
        """u = lift + Z v. Per node: the least-squares value of its prescribed rows, and an orthonormal basis of the remaining
        directions."""
        n = len(self.f) // 2
        self.lift, at = np.zeros(2 * n), {}
        for k, node in enumerate(self.prescribed.node):
            at.setdefault(int(node), []).append(k)
        rows, columns, entries, count = [], [], [], 0
        for node in range(n):
            basis = np.eye(2)
            if node in at:
                d = self.prescribed.direction[at[node]]
                self.lift[2 * node:2 * node + 2] = (np.linalg.pinv(d, rcond=1e-8) @ self.prescribed.value[at[node]])
                basis = null_space(d, rcond=1e-8)
            for vector in basis.T:
                rows += [2 * node, 2 * node + 1]
                columns += [count, count]
                entries += list(vector)
                count += 1
        self.z = coo_matrix((entries, (rows, columns)), (2 * n, count)).tocsc()

    def _motions(self):
        """N: the rigid motions of the body that no prescribed row resists. Those that no contact row resists are `free`."""
        x = self.discrete.points
        y = x - x.mean(0)
        y = y / np.abs(y).max()
        fields = np.zeros((len(x), 2, 3))
        fields[:, 0, 0] = fields[:, 1, 1] = 1.0
        fields[:, 0, 2], fields[:, 1, 2] = -y[:, 1], y[:, 0]
        resisted = np.einsum("ri,rik->rk", self.prescribed.direction, fields[self.prescribed.node])
        motions = fields.reshape(len(self.f), -1) @ kernel(resisted, 3)
        motions = np.linalg.qr(motions)[0] if motions.size else motions
        self.n = unit(self.z.T @ motions)
        contact = self.a @ self.n
        free = kernel(contact, self.n.shape[1])
        self.free, resisted = self.n @ free, null_space(free.T) if free.size else np.eye(len(free))
        self.n_contact = self.n @ resisted
        self.bn = self.a @ self.n_contact

    def _contradiction(self):
        """Largest |d·u − value| of the prescribed rows at nodes that have more than two."""
        return np.abs(along(self.prescribed, self.lift) - self.prescribed.value).max(initial=0.0)

    def _penetration(self):
        """The distance by which prescribed values push a node through its obstacles: the smallest violation of the contact
        rows at a node over its free displacements."""
        worst = 0.0
        a = self.a.toarray()
        for node in np.unique(self.prescribed.node):
            at = np.flatnonzero(self.rows.node == node)
            rows = a[at][:, np.abs(a[at]).max(0) > 1e-8] if len(at) else np.zeros((0, 0))
            if rows.shape[1] == 0:
                worst = max(worst, (-self.b[at]).max(initial=0.0))
                continue
            w, b = rows[:, 0], self.b[at]
            worst = max(worst, (-b[np.abs(w) <= 1e-8]).max(initial=0.0))
            up, down = w > 1e-8, w < -1e-8
            room = (b[up] / w[up]).min(initial=np.inf) - (b[down] / w[down]).max(initial=-np.inf)
            worst = max(worst, -room)
        return worst

    def _overlap(self, reach=np.inf):
        """The overlap of obstacles on several sides of a node: the smallest s with Av ≤ b + s and |v| at most `reach` times the
        gaps."""
        worst, rows = 0.0, self.rows
        for node in np.setdiff1d(rows.node[rows.value < 0.0], self.prescribed.node):
            at = rows.node == node
            if at.sum() < 2:
                continue
            size = np.abs(rows.value[at]).max()
            left = np.column_stack([rows.direction[at], -np.ones(at.sum())])
            bounds = [(-reach, reach)] * 2 + [(0.0, None)]
            found = linprog([0.0, 0.0, 1.0], left, rows.value[at] / size, bounds=bounds)
            worst = max(worst, found.x[2] * size)
        return worst

    def _driven(self):
        """The relative part of the load that no contact force λ ≥ 0 balances (Farkas). Forces of 1e11 times the load do not
        count, as they would depend on the rounding of opposite normals."""
        size = max(np.abs(self.q).sum(), np.abs(self.f).sum())
        if size == 0.0 or self.n.shape[1] == 0:
            return 0.0
        left = np.abs(self.free.T @ self.q).max(initial=0.0)
        work = self.n_contact.T @ self.q / size
        if len(work):
            rows = np.vstack([self.bn.T, 1e-11 * np.eye(len(self.b))])
            lam, _ = nnls(rows, np.r_[work, np.zeros(len(self.b))], maxiter=1000 * len(self.b))
            left = max(left, np.linalg.norm(self.bn.T @ lam - work) * size)
        return left / size

    def solve(self):
        """u and its accuracy, for a step with a solution."""
        h = (self.z.T @ self.k @ self.z).tocsc()
        self.size = h.diagonal().max(initial=0.0) or 1.0
        # If a load does no work on the free motions, as many unknowns can be fixed.
        pins = qr(self.free.T, pivoting=True, mode="economic")[2] if self.free.size else []
        pinned = np.isin(np.arange(len(self.q)), pins[:self.free.shape[1]])
        self.h = h + self.size * diags(pinned * 1.0)
        # A body that overlaps its obstacles is pressed without a load.
        force = max(np.abs(self.q).max(initial=0.0), self.size * (-self.b).max(initial=0.0))
        v, self.active = np.zeros(len(self.q)), np.zeros(len(self.b), bool)
        lam = np.zeros(len(self.b))
        if force > 0.0:
            near, self.active = interior_point(self.h, self.q, self.a, self.b, force, self.size)
            for _ in range(5):  # tidied until the signs agree
                v, lam = self._on_active_set(self.q, self.b[self.active], near)
                slack = self.b - self.a @ v
                length = np.abs(v).max()
                wrong = np.where(self.active, lam < -1e-12 * force, slack < -1e-12 * length)
                if not wrong.any():
                    break
                self.active = self.active ^ wrong
            v, lam = self._on_active_set(self.q, self.b[self.active], near)
        motions = self.n.shape[1]
        self.loose = self.z @ (self.n @ kernel((self.a @ self.n)[lam > 1e-8 * force], motions))
        return self.lift + self.z @ v

    def _on_active_set(self, q, b, v):
        """Hv + Aᵀλ = q, Av = b on the active set, near v. A small regularisation allows redundant rows and free
        motions, which stay as in v; the refinement removes its effect. λ is 0 on the other rows."""
        a, n = self.a[self.active] * self.size, len(q)
        small = 1e-10 * self.size
        m = a.shape[0]
        factor = splu(bmat([[self.h + small * identity(n), a.T], [a, -small * identity(m)]]).tocsc())
        lam = np.zeros(m)
        for _ in range(10):
            step = factor.solve(np.r_[q - self.h @ v - a.T @ lam, self.size * b - a @ v])
            v, lam = v + step[:n], lam + step[n:]
        everywhere = np.zeros(len(self.b))
        everywhere[self.active] = self.size * lam
        return v, everywhere

    def sensitivity(self):
        """The approximate largest |u| per ‖force‖₂ for this active set, by a few power iterations."""
        force, largest = np.random.default_rng(0).standard_normal(len(self.q)), 0.0
        for _ in range(4):
            force /= max(np.linalg.norm(force), np.finfo(float).tiny)
            at_rest = np.zeros(len(force))
            v, _ = self._on_active_set(force, np.zeros(self.active.sum()), at_rest)
            u = without(self.z @ v, self.loose)
            largest, force = max(largest, np.abs(u).max()), self.z.T @ u
        return largest


def interior_point(h, q, a, b, force, size):
    """About v, and the active set, of Hv + Aᵀλ = q, s = b − Av ≥ 0, λ ≥ 0, λᵀs = 0 by Mehrotra's predictor and
    corrector: (H + AᵀDA) dv = …, D = λ/s, in which no pinning loses digits of a thin body."""
    m = len(b)
    if m == 0:
        return np.zeros(len(q)), np.zeros(0, bool)
    v = splu((h + size * (a.T @ a)).tocsc()).solve(q + size * (a.T @ b))
    length = max(np.abs(v).max(), np.abs(a @ v - b).min())
    lam, slack = np.full(m, force), np.maximum(b - a @ v, length)
    best, since = (np.inf, v, lam > slack), 0
    for _ in range(150):
        rd, rp = h @ v - q + a.T @ lam, a @ v + slack - b
        mu = lam @ slack / m
        merit = mu / (force * length) + np.abs(rd).max() / force + np.abs(rp).max() / length
        since += 1
        if merit < best[0]:
            best, since = (merit, v, lam / force > slack / length), 0
        if mu < 1e-24 * force * length or since > 15 or not np.isfinite(merit):
            break
        d = np.clip(lam / slack, 1e-20 * size, 1e20 * size)
        try:
            factor = splu((h + a.T @ diags(d) @ a).tocsc())
        except RuntimeError:  # singular in the last digits
            break
        aim, correction = 0.0, 0.0
        for _ in range(2):  # predictor, then corrector
            t = (aim - correction) / slack - lam
            dv = factor.solve(-rd - a.T @ (t + d * rp))
            ds = -rp - a @ dv
            dl = t - d * ds
            length_l, length_s = (min(1.0, 0.999 * (-x[g < 0] / g[g < 0]).min(initial=2.0))
                                  for x, g in ((lam, dl), (slack, ds)))
            ahead = (lam + length_l * dl) @ (slack + length_s * ds) / m
            aim, correction = mu * min(ahead / mu, 1.0) ** 3, dl * ds
        step = min(length_l, length_s)
        v, lam, slack = v + step * dv, lam + step * dl, slack + step * ds
    return best[1:]


def kernel(rows, size):
    """Orthonormal columns of the kernel of `rows` (of unit size)."""
    if rows.shape[0] == 0 or size == 0:
        return np.eye(size)
    _, values, vectors = np.linalg.svd(rows)
    return vectors[(values > RANK * np.sqrt(len(rows))).sum():].T


def unit(columns):
    """Columns scaled to a largest entry of 1."""
    return columns / np.abs(columns).max(0) if columns.size else columns


def without(u, motions):
    """u without its components of some motions, by least squares."""
    if not motions.size:
        return u
    return u - motions @ np.linalg.lstsq(motions, u, rcond=None)[0]


def along(rows, u):
    """d·u of each row."""
    return (rows.direction * u.reshape(-1, 2)[rows.node]).sum(1)


def row_matrix(rows, size):
    """The rows as a sparse matrix."""
    k = np.arange(len(rows.node))
    index = (np.r_[k, k], np.r_[2 * rows.node, 2 * rows.node + 1])
    return coo_matrix((rows.direction.T.ravel(), index), (len(k), size)).tocsr()
