"""The discrete problem of a scene, assembled for the verification by `random_scenes.py`.

Stiffness of P1 or isoparametric P2, loads, prescribed rows, contact rows and the damage
step (28), written from the description of the method alone (README.md, the paper's sections 2 to 4). Nothing
here is taken from the program, so a fault of its assembly, bases or constraints appears as a difference.
"""

import re
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

import shared  # noqa: F401
from signorini_results import derivatives, functions
from expressions import Expression
from lagrange import SIDES, Lagrange
from outline import Outline
from scene import DAMAGE, direction_of, displacement_order, elasticity, must_be_followed, of_material

# Lines at an angle below the first value are one line. Below the second value rounding may decide.
SAME, ALIKE = 1e-8, 1e-4
# Barycentric coordinates of the points, of equal weights, that integrate the stiffness.
POINTS = {1: np.full((1, 3), 1 / 3), 2: np.full((3, 3), 1 / 6) + 0.5 * np.eye(3)}
# Per node of an edge (ends, middle): the integral of its function over the length of the edge.
SHARES = {1: (1 / 2, 1 / 2), 2: (1 / 6, 1 / 6, 4 / 6)}
# Parts of an edge in which a traction is integrated.
PARTS = 256
ONE = 1e-4  # directions within this angle are one


def varies(texts):
    """Whether any of the expressions depends on x or y."""
    return any(re.search(r"\b[xy]\b", str(text)) for text in texts)


class Discrete:
    """A scene on its triangulation: u at the `points`, which the `elements` refer to; ζ at the vertices."""

    def __init__(self, scene, mesh):
        self.scene, self.mesh, self.order = scene, mesh, displacement_order(scene)
        self.space = Lagrange(mesh, self.order)
        self.points, self.elements = self.space.points, self.space.elements
        x, t = mesh.nodes, mesh.triangles
        # ∇λ_i of a triangle is its opposite side turned by 90° over twice the area.
        side = x[np.roll(t, -2, 1)] - x[np.roll(t, -1, 1)]
        a, b = x[t[:, 1]] - x[t[:, 0]], x[t[:, 2]] - x[t[:, 0]]
        self.area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        self.gradient = np.stack([-side[..., 1], side[..., 0]], -1) / (2 * self.area)[:, None, None]
        # ∇φ of each triangle at the quadrature points: on the straight one, then on its image under
        # the map that moves the middles of sides, X ↦ X + Σ φ_m(X) offset_m, of Jacobian F.
        local = derivatives(POINTS[self.order].T, self.elements.shape[1])
        straight = np.einsum("qnk,ekd->eqnd", local, self.gradient)
        offsets = self.space.offsets(t[:, SIDES].reshape(-1, 2)).reshape(-1, 3, 2)
        jacobian = np.eye(2) + np.einsum("emi,eqmj->eqij", offsets[:, :straight.shape[2] - 3], straight[:, :, 3:])
        gradient = np.einsum("eqnj,eqjd->eqnd", straight, np.linalg.inv(jacobian))
        self.weight = (self.area / len(local))[:, None] * np.linalg.det(jacobian)
        # (ε_xx, ε_yy, 2ε_xy) = B u_e there.
        self.b = np.zeros((*gradient.shape[:2], 3, 2 * gradient.shape[2]))
        self.b[..., 0, 0::2] = self.b[..., 2, 1::2] = gradient[..., 0]
        self.b[..., 1, 1::2] = self.b[..., 2, 0::2] = gradient[..., 1]
        n = self.elements
        self.dof = np.stack([2 * n, 2 * n + 1], -1).reshape(len(n), -1)
        must_be_followed(scene)
        self.law = {**DAMAGE, **scene.get("damage", {})}
        self.young, poisson = (of_material(scene, mesh, "material", key) for key in ("young", "poisson"))
        self.density = of_material(scene, mesh, "material", "density", 0.0)
        self.d = elasticity(self.young, poisson, scene["material"].get("plane", "stress"))
        self.element = np.einsum("eqki,ekl,eqlj,eq->eqij", self.b, self.d, self.b, self.weight)
        self.boundaries, self.outline = scene.get("boundary", []), Outline(mesh)
        self._gaps = self._contact_faces()
        self.contact = self.contact_rows(0.0)
        self.prescribed = self._prescribed()

    def element_stiffness(self, zeta):
        """Σ_q w_q η_*(ζ)(x_q) Bᵀ D B of each triangle, with η_*(ζ) affine between the vertices. For P1 this is exact, as ε
        is constant."""
        if "damage" in self.scene:
            zeta = np.clip(zeta, self.law["threshold"], 1.0)
        at_points = zeta[self.mesh.triangles] @ POINTS[self.order].T
        return np.einsum("eqij,eq->eij", self.element, at_points)

    def stiffness(self, zeta):
        """K(ζ), the sum over the triangles."""
        return assembled(self.element_stiffness(zeta), self.dof, 2 * len(self.points))

    def element_sizes(self, zeta, u):
        """Per unknown Σ_T |f_T| and Σ_T |K_T||u_T|: the scales of forces and of their rounding."""
        k, v = self.element_stiffness(zeta), u[self.dof]
        force, rounding = np.zeros_like(u), np.zeros_like(u)
        np.add.at(force, self.dof, np.abs(np.einsum("eij,ej->ei", k, v)))
        np.add.at(rounding, self.dof, np.einsum("eij,ej->ei", np.abs(k), np.abs(v)))
        return force, rounding

    def load(self, t):
        """∫ f_B·v by the midpoints of the sides (P1) or the points of the stiffness (P2), and
        ∫ f_N·v by two Gauss points in each of PARTS parts of an edge."""
        x, load = self.points, np.zeros((len(self.points), 2))
        if "body" in self.scene:
            rule = (POINTS[2], self.weight.T)
            if self.order == 1:
                rule = (0.5 - 0.5 * np.eye(3), [self.area / 3] * 3)
            for barycentric, weight in zip(*rule):
                values = functions(barycentric[:, None], self.elements.shape[1])[0]
                points = np.einsum("n,end->ed", values, x[self.elements])
                body = {"force": ["0", "0"], "gravity": ["0", "0"], **self.scene["body"]}
                weights = self.density[:, None] * pair(body["gravity"], points, t)
                force = (pair(body["force"], points, t) + weights) * weight[:, None]
                for node, value in zip(self.elements.T, values):
                    np.add.at(load, node, value * force)
        for boundary in self.boundaries:
            if "traction" not in boundary:
                continue
            edges = self.mesh.edges(boundary["name"])
            gauss = 0.5 + 0.5 / np.sqrt(3) * np.array([-1, 1])
            parts = PARTS
            for s in ((np.arange(parts)[:, None] + gauss) / parts).ravel():
                length = np.linalg.norm(self._tangents(edges, s), axis=1)[:, None]
                values = functions(np.array([[1 - s], [s]]), self.order + 1)[0]
                points = np.einsum("n,end->ed", values, x[self.space.on(edges)])
                force = 0.5 / parts * length * pair(boundary["traction"], points, t)
                for node, value in zip(self.space.on(edges).T, values):
                    np.add.at(load, node, value * force)
        return load.ravel()

    def _tangents(self, edges, s):
        """x'(s) of the edges x(s) = (1 − s) p + s q + 4s(1 − s) offset."""
        p, q = self.mesh.nodes[edges].transpose(1, 0, 2)
        return q - p + 4 * (1 - 2 * s) * self.space.offsets(edges)

    def faces(self, name):
        """Per node of a curve: its (normal, length, normal of the line). The normal is the length-weighted mean of the outward
        normals of the adjacent edges; a corner has one for each side."""
        edges, parts = self.mesh.edges(name), {}
        outward, _ = self.mesh.outward_normals(name)
        for nodes, s, share in zip(self.space.on(edges).T, (0, 1, 0.5), SHARES[self.order]):
            dx, dy = self._tangents(edges, s).T
            length = np.hypot(dx, dy)
            normals = np.column_stack([dy, -dx]) / length[:, None]
            # The side of the chord's normal is outside.
            p, q = self.mesh.nodes[edges].transpose(1, 0, 2)
            chord = q - p
            turn = np.sign(chord[:, 1] * outward[:, 0] - chord[:, 0] * outward[:, 1])
            for edge, node, normal, part in zip(edges.tolist(), nodes.tolist(), turn[:, None] * normals, share * length):
                of_line = normal
                if node in edge:
                    tangent = self.outline.tangent(node, edge[edge[0] == node])
                    of_line = np.array([tangent.imag, -tangent.real])
                    of_line *= np.sign(of_line @ normal)
                parts.setdefault(node, []).append((normal, part, [], of_line))
        return {node: [(n, w, of_line) for n, w, _, of_line in merged(found)] for node, found in parts.items()}

    def _contact_faces(self):
        """Per row: (node, normal, length, gaps). The normal is fixed, or that of a face. Where curves meet smoothly there is
        one row with the mean normal and the gaps of both, each with its length."""
        rows = {}
        for boundary in self.boundaries:
            if "gap" not in boundary:
                continue
            gap, fixed = Expression(boundary["gap"]), direction_of(boundary)
            for node, faces in self.faces(boundary["name"]).items():
                if fixed is not None:
                    faces = [(fixed, sum(face[1] for face in faces), fixed)]
                rows.setdefault(node, []).extend((n, w, [(gap, w)], of_line) for n, w, of_line in faces)
        return [(node, n, w, gaps) for node, parts in sorted(rows.items()) for n, w, gaps, _ in merged(parts)]

    def contact_rows(self, t):
        """u·ν ≤ g at time t, with the smallest of several gaps. The lengths of the others bear no pressure."""
        rows = []
        for node, n, length, gaps in self._gaps:
            values = [(float(g.at(self.points[[node]], t)[0]), w) for g, w in gaps]
            least = min(value for value, _ in values)
            bearing = sum(w for value, w in values if value - least <= 1e-12 * length)
            rows.append((node, n, least, bearing))
        return as_rows(rows)

    def _prescribed(self):
        """Per row: (node, direction, expression), with None for the 0 of a symmetry axis."""
        rows = []
        for boundary in self.boundaries:
            if boundary.get("symmetry"):
                rows += [(node, n, None) for node, faces in self.faces(boundary["name"]).items() for n, _, _ in faces]
            for axis, text in enumerate(boundary.get("displacement", [])):
                if str(text).strip() != "free":
                    value, d = Expression(text), np.eye(2)[axis]
                    rows += [(int(node), d, value)
                             for node in np.unique(
                                 self.space.on(self.mesh.edges(boundary["name"])))]
        return rows

    def prescribed_rows(self, t):
        """The prescribed rows with their values at time t."""
        value = lambda node, e: 0.0 if e is None else float(e.at(self.points[[node]], t)[0])
        return as_rows([(node, d, value(node, e)) for node, d, e in self.prescribed])

    def bad_input(self, times):
        """A reason why the scene must be refused for all loads, or None; then whether refusing and solving are both right: a
        fixed normal points into the body at some of its edges only, or two lines of contact at a node are nearly one."""
        some = False
        for boundary in self.boundaries:
            if "gap" not in boundary:
                continue
            points = self.points[np.unique(self.space.on(self.mesh.edges(boundary["name"])))]
            gap = Expression(boundary["gap"])
            if not all(np.isfinite(gap.at(points, t)).all() for t in times):
                return "gap not finite", False
            if "normal" in boundary:
                cosine = self.mesh.outward_normals(boundary["name"])[0] @ direction_of(boundary)
                if (cosine < -1e-6).all():
                    return "normal into the body", False
                some |= bool((cosine < 1e-6).any())
        rows, prescribed = self.contact, {node for node, _, _ in self.prescribed}
        for node in np.setdiff1d(rows.node, list(prescribed)):
            lines = []
            for n in rows.direction[rows.node == node]:
                sines = [abs(n[0] * m[1] - n[1] * m[0]) for m in lines]
                if all(sine > SAME for sine in sines):
                    lines.append(n)
                some |= any(SAME < sine < ALIKE for sine in sines)
            if len(lines) > 2:
                return "more than two lines of contact at a node", False
        return None, some

    def damage_step(self, u, zeta, step):
        """ζ_n of (28): (M + kκL) ζ_n = M ζ_{n−1} + k b(φ(ε(u_{n−1}), ζ_{n−1})), and the possible rounding error on very thin
        triangles. P1 evaluates φ at the three vertices of a triangle and integrates it with the same M, P2 at the
        points of the stiffness. Each surface has its own law."""
        t, law = self.mesh.triangles, self.law
        cap, breeds, strains, least, diffusion = (
            of_material(self.scene, self.mesh, "damage", key, law[key])
            for key in ("strain_cap", "lambda_d", "lambda_u", "lambda_w", "diffusion"))
        strain = np.einsum("eqki,ei->keq", self.b, u[self.dof])
        squared = strain[0] ** 2 + strain[1] ** 2 + 0.5 * strain[2] ** 2
        psi = np.minimum(squared, cap[:, None])
        at = np.eye(3) if self.order == 1 else POINTS[2]
        eta = np.clip(zeta[t] @ at.T, law["threshold"], 1.0)
        rate = breeds[:, None] * (1 - eta) / eta + 0.5 * strains[:, None] * psi
        phi = -np.maximum(rate - least[:, None], 0.0)
        local = (np.ones((3, 3)) + np.eye(3)) / 12
        if law["mass"] == "lumped":
            local = np.eye(3) / 3
        mass = self.area[:, None, None] * local
        laplace = np.einsum("eik,ejk,e->eij", self.gradient, self.gradient, self.area * diffusion)
        n = len(zeta)
        m, l = assembled(mass, t, n), assembled(laplace, t, n)
        right = m @ zeta
        if self.order == 1:
            np.add.at(right, t, step * np.einsum("eij,ej->ei", mass, phi))
        else:
            np.add.at(right, t, step * (self.area / 3)[:, None] * (phi @ POINTS[2]))
        matrix = m + step * l
        # Jacobi scaling keeps triangles of very different size apart from rounding.
        scale = diags(1 / np.sqrt(matrix.diagonal()))
        factor = splu((scale @ matrix @ scale).tocsc())
        solution = scale @ factor.solve(scale @ right)
        signs = np.where(np.arange(n) % 2, 1.0, -1.0)
        noise = factor.solve(scale @ (2e-15 * signs * (abs(matrix) @ np.abs(solution))))
        return solution, np.abs(scale @ noise).max()


@dataclass
class Rows:
    """Conditions d·u = value (or ≤ value). Per row: node, unit direction, value, and for contact rows the
    tributary length."""

    node: np.ndarray
    direction: np.ndarray
    value: np.ndarray
    weight: np.ndarray


def assembled(blocks, dof, size):
    """The sum of the matrices of triangles (m, k, k) with unknowns (m, k)."""
    rows, columns = (np.broadcast_to(v, blocks.shape).ravel() for v in (dof[:, :, None], dof[:, None, :]))
    return coo_matrix((blocks.ravel(), (rows, columns)), (size, size)).tocsc()


def pair(texts, points, t):
    """Two expressions at points, (n, 2)."""
    return np.stack([Expression(text).at(points, t) for text in texts], -1)


def angle(a, b):
    """The angle between two directions, accurate also for small angles."""
    return np.arctan2(abs(a[0] * b[1] - a[1] * b[0]), a @ b)


def merged(parts):
    """Joins (normal, length, gaps, normal of the line) of edges or curves on one line. The smallest gap counts."""
    rows = []
    for normal, length, gaps, of_line in parts:
        for k, (n, w, others, line) in enumerate(rows):
            if min(angle(n, normal), angle(line, of_line)) <= ONE:
                mean = w * n + length * normal
                rows[k] = (mean / np.linalg.norm(mean), w + length, others + gaps, line)
                break
        else:
            rows.append((normal, length, gaps, of_line))
    return rows


def as_rows(found):
    """Rows from a list of (node, direction, value[, weight])."""
    if not found:
        return Rows(np.zeros(0, int), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    node, direction, value, *weight = zip(*found)
    return Rows(np.array(node), np.array(direction, float), np.array(value, float),
                np.array(weight[0] if weight else np.ones(len(node))))
