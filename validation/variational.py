"""The contact step (26) solved in the judge's own way: min ½uᵀKu − fᵀu, Du = d, Au ≤ g.

Prescribed rows are eliminated node by node with an orthonormal basis of what they leave. With N
the rigid motions that remain and G the inverse of K with as many unknowns pinned, v = G(q − Aᵀλ)
+ Nα, and what is left is dense and as small as Γ_C:

    s = Sλ + c − Bα ≥ 0,   λ ≥ 0,   λᵀs = 0,   Bᵀλ = Nᵀq,   S = AGAᵀ, B = AN, c = b − AGq.

An interior-point method (Mehrotra's predictor and corrector) finds the active set, one least-squares
solve on it gives the answer. Neither knows of degenerate nodes: parallel, opposite and redundant
rows are allowed. Whether there is a solution, and only one, is told by ranks and by Farkas.
"""

import numpy as np
from scipy.linalg import null_space, qr
from scipy.optimize import nnls
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

RANK = 1e-9  # singular values of unit-sized rows below this are zero


class Step:
    """One contact step: its algebra, whether it has a solution, and the solution."""

    def __init__(self, discrete, zeta, t):
        self.discrete, self.rows = discrete, discrete.contact
        self.k, self.f = discrete.stiffness(zeta), discrete.load(t)
        self.held = discrete.prescribed_rows(t)
        self.zeta = zeta
        self._eliminate()
        self.q = self.z.T @ (self.f - self.k @ self.lift)
        self.a = row_matrix(self.rows, len(self.f)) @ self.z
        self.b = self.rows.value - along(self.rows, self.lift)
        self._motions()
        self.contradiction, self.penetration = self._contradiction(), self._penetration()
        self.driven = self._driven()

    def _eliminate(self):
        """u = lift + Z v: per node the least-squares value of its prescribed rows, and an
        orthonormal basis of the directions they leave."""
        n = len(self.f) // 2
        self.lift, at = np.zeros(2 * n), {}
        for k, node in enumerate(self.held.node):
            at.setdefault(int(node), []).append(k)
        rows, columns, entries, count = [], [], [], 0
        for node in range(n):
            basis = np.eye(2)
            if node in at:
                d = self.held.direction[at[node]]
                self.lift[2 * node:2 * node + 2] = (
                    np.linalg.pinv(d, rcond=1e-8) @ self.held.value[at[node]])
                basis = null_space(d, rcond=1e-8)
            for vector in basis.T:
                rows += [2 * node, 2 * node + 1]
                columns += [count, count]
                entries += list(vector)
                count += 1
        self.z = coo_matrix((entries, (rows, columns)), (2 * n, count)).tocsc()

    def _motions(self):
        """N: rigid motions of the pieces that agree at common nodes (hinges) and that no
        prescribed row resists; those that no contact row resists either are `free`."""
        x, t = self.discrete.mesh.nodes, self.discrete.mesh.triangles
        count, piece = self.discrete.clusters()
        fields, first, ties = np.zeros((len(x), 2, 3 * count)), np.full(len(x), -1), []
        for c in range(count):
            nodes = np.unique(t[piece == c])
            y = x[nodes] - x[nodes].mean(0)
            y = y / np.abs(y).max()
            local = np.zeros((len(nodes), 2, 3 * count))
            local[:, 0, 3 * c] = local[:, 1, 3 * c + 1] = 1.0
            local[:, 0, 3 * c + 2], local[:, 1, 3 * c + 2] = -y[:, 1], y[:, 0]
            common = first[nodes] >= 0
            ties.append((local[common] - fields[nodes[common]]).reshape(-1, 3 * count))
            fields[nodes[~common]] = local[~common]
            first[nodes] = c
        resisted = np.einsum("ri,rik->rk", self.held.direction, fields[self.held.node])
        motions = fields.reshape(len(self.f), -1) @ kernel(np.vstack([*ties, resisted]), 3 * count)
        motions = np.linalg.qr(motions)[0] if motions.size else motions
        self.n = unit(self.z.T @ motions)
        contact = self.a @ self.n
        free = kernel(contact, self.n.shape[1])
        self.free, resisted = self.n @ free, null_space(free.T) if free.size else np.eye(len(free))
        self.n_contact = self.n @ resisted
        self.bn = self.a @ self.n_contact

    def _contradiction(self):
        """Largest |d·u − value| of the prescribed rows at nodes that have more than two."""
        return np.abs(along(self.held, self.lift) - self.held.value).max(initial=0.0)

    def _penetration(self):
        """How far the prescribed values push some node through its obstacles: the least
        violation of the contact rows at a node over what is free to move there."""
        worst = 0.0
        a = self.a.toarray()
        for node in np.unique(self.held.node):
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

    def _driven(self):
        """How much of the load, relative, no contact force λ ≥ 0 balances (Farkas)."""
        size = max(np.abs(self.q).sum(), np.abs(self.f).sum())
        if size == 0.0 or self.n.shape[1] == 0:
            return 0.0
        left = np.abs(self.free.T @ self.q).max(initial=0.0)
        work = self.n_contact.T @ self.q / size
        if len(work):
            left = max(left, nnls(self.bn.T, work, maxiter=1000 * len(self.b))[1] * size)
        return left / size

    def solve(self):
        """u, and what tells of its accuracy; needs a step that has a solution."""
        pins = []
        if self.n.size:
            pins = qr(self.n.T, pivoting=True, mode="economic")[2][:self.n.shape[1]]
        self.open = np.setdiff1d(np.arange(len(self.q)), pins)
        self.h = (self.z.T @ self.k @ self.z).tocsc()
        self.factor = splu(self.h[self.open][:, self.open]) if len(self.open) else None
        a = self.a.toarray()
        self.ga = np.column_stack([self._inverse(row) for row in a]) if len(a) else a.T
        s = 0.5 * (a @ self.ga + (a @ self.ga).T)
        gq = self._inverse(self.q)
        e = self.n_contact.T @ self.q
        self.force = max(np.abs(self.q).max(initial=0.0), np.finfo(float).tiny)
        self.s = s
        lam, alpha = complementarity(s, self.b - a @ gq, self.bn, e, self.force)
        self.active = np.flatnonzero(lam > 0)
        v = self._inverse(self.q - a.T @ lam) + self.n_contact @ alpha
        strict = lam > 1e-8 * self.force
        self.loose = self.z @ (self.n @ kernel((self.a @ self.n)[strict], self.n.shape[1]))
        self.u = self.lift + self.z @ v
        return self.u

    def _inverse(self, right):
        """G: K⁻¹ with the pins held, once refined."""
        out = np.zeros(len(right))
        if self.factor is not None:
            out[self.open] = self.factor.solve(right[self.open])
            residual = (right - self.h @ out)[self.open]
            out[self.open] += self.factor.solve(residual)
        return out

    def response(self, force):
        """The displacement that small extra forces cause while the active set stays."""
        a = self.a.toarray()[self.active]
        s, b = self.s[np.ix_(self.active, self.active)], self.bn[self.active]
        q = self.z.T @ force
        g = self._inverse(q)
        lam, alpha = saddle(s, b, a @ g, self.n_contact.T @ q)
        return self.z @ (self._inverse(q - a.T @ lam) + self.n_contact @ alpha)

    def sensitivity(self):
        """About the largest |u| per ‖force‖₂: a few power iterations on the response."""
        force = np.random.default_rng(0).standard_normal(len(self.f))
        largest = 0.0
        for _ in range(4):
            force /= max(np.linalg.norm(force), np.finfo(float).tiny)
            u = without(self.response(force), self.loose)
            largest, force = max(largest, np.abs(u).max()), u
        return largest


def complementarity(s, c, b, e, force):
    """λ and α of the problem at the head of this page, in units of its own."""
    m, k = b.shape
    if m == 0:
        return np.zeros(0), np.zeros(k)
    compliance = s.diagonal().max() or 1.0
    length = compliance * force
    c, s, e = c / length, s / compliance, e / force
    lam, slack, alpha = np.ones(m), np.maximum(1.0, c), np.zeros(k)
    best, since = (np.inf, lam, alpha, slack), 0
    for _ in range(150):
        r1, r2 = s @ lam + c - b @ alpha - slack, b.T @ lam - e
        mu = lam @ slack / m
        merit = mu + np.abs(r1).max() + np.abs(r2).max(initial=0.0)
        since += 1
        if merit < best[0]:
            best, since = (merit, lam, alpha, slack), 0
        if mu < 1e-22 or since > 10 or not np.isfinite(merit):
            break
        ratio = np.minimum(slack / np.maximum(lam, 1e-200), 1e40)
        matrix = np.block([[s + np.diag(ratio), -b], [b.T, np.zeros((k, k))]])
        aim, correction = 0.0, 0.0
        for _ in range(2):  # predictor, then corrector
            rest = (aim - lam * slack - correction) / lam
            step = balanced(matrix, np.r_[rest - r1, -r2])
            dl, da = step[:m], step[m:]
            ds = rest - ratio * dl
            length_l, length_s = (min(1.0, 0.999 * (-x[d < 0] / d[d < 0]).min(initial=2.0))
                                  for x, d in ((lam, dl), (slack, ds)))
            ahead = (lam + length_l * dl) @ (slack + length_s * ds) / m
            aim, correction = mu * (ahead / mu) ** 3, dl * ds
        size = min(length_l, length_s)
        lam, slack, alpha = lam + size * dl, slack + size * ds, alpha + size * da
    _, lam, alpha, slack = best
    active = lam > slack
    for _ in range(10):  # tidied until signs agree
        tidy = np.zeros(m)
        tidy[active], shift = saddle(s[np.ix_(active, active)], b[active], -c[active], e)
        gap = s @ tidy + c - b @ shift
        wrong = (active & (tidy < 0)) | (~active & (gap < -1e-14 * np.abs(c).max()))
        if not wrong.any():
            break
        active = active ^ wrong
    lost = max(-tidy.min(), -(gap / max(1.0, np.abs(c).max())).min())
    if lost < 1e-9 or lost < best[0]:
        lam, alpha = np.where(active, tidy, 0.0), shift
    return lam * force, alpha * length


def balanced(matrix, right):
    """A linear solve whose rows and columns are first scaled by the diagonal."""
    d = 1 / np.sqrt(np.where(matrix.diagonal() > 0, matrix.diagonal(), 1.0))
    return d * np.linalg.lstsq(d[:, None] * matrix * d, d * right, rcond=1e-16)[0]


def saddle(s, b, right, e):
    """Sλ − Bα = right, Bᵀλ = e in the least-squares sense; returns λ, α."""
    m, k = b.shape
    if m + k == 0:
        return np.zeros(0), np.zeros(0)
    unit_size = s.diagonal().max(initial=0.0) or 1.0
    matrix = np.block([[s / unit_size, -b], [b.T, np.zeros((k, k))]])
    out = np.linalg.lstsq(matrix, np.r_[right / unit_size, e], rcond=1e-13)[0]
    return out[:m], out[m:] * unit_size


def kernel(rows, size):
    """Orthonormal columns that `rows` (of unit size) do not see."""
    if rows.shape[0] == 0 or size == 0:
        return np.eye(size)
    _, values, vectors = np.linalg.svd(rows)
    return vectors[(values > RANK * np.sqrt(len(rows))).sum():].T


def unit(columns):
    """Columns scaled to a largest entry of 1."""
    return columns / np.abs(columns).max(0) if columns.size else columns


def without(u, motions):
    """u less its share of some motions, by least squares."""
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
