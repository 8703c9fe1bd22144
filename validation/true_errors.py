"""True errors of runs against a finer run: u in the energy norm, the damage in L², at the last time.

The runs may be P1 or P2, with straight or curved sides. Integrals are sums over the quadrature points of the
reference. Newton's method finds the element and the coordinates of these points in the run. At a curved boundary two
meshes differ by the error of their parabolas; the elements of the run are continued up to the reference. The reference
should be P2 on a mesh graded geometrically to every corner and end of contact, with its own time steps."""

import numpy as np
from matplotlib.tri import Triangulation

import shared  # noqa: F401
import signorini_results
from scene import elasticity, read_scene
from signorini_results import derivatives, functions, read_frame

# Barycentric points and weights of the rule of degree 4 with six points.
NEAR, FAR = 0.816847572980459, 0.108103018168070
POINTS = np.array([[1 - 2 * b if i == j else b for j in range(3)]
                   for b in ((1 - NEAR) / 2, (1 - FAR) / 2) for i in range(3)])
WEIGHTS = np.repeat([0.109951743655322, 0.223381589678011], 3)
# Derivatives of the barycentric coordinates in the last two of them.
SLOPES = np.array([[-1, -1], [1, 0], [0, 1]])
# The number of Newton steps, the longest step, and the number of elements on the way to a point.
NEWTON, STEP, WALK = 12, 0.5, 30


class Run(signorini_results.Run):
    """A run at its last frame."""

    def __init__(self, folder):
        super().__init__(folder)
        frame = read_frame(self.frames[-1][1])
        # A node where materials meet is several points.
        numbers = frame.point_data.get("global_node", np.arange(len(frame.points)))
        _, first, node = np.unique(numbers, return_index=True, return_inverse=True)
        self.points = frame.points[first, :2]
        self.cells = node[next(iter(frame.cells_dict.values()))]
        self.u = frame.point_data["displacement"][first, :2]
        self.zeta = frame.point_data["zeta"][first].ravel()
        # Per element: 0, or the number of its surface by name; None for a single material.
        self.material = frame.cell_data["material"][0].ravel() if "material" in frame.cell_data else None
        vertices = Triangulation(*self.points.T, self.cells[:, :3])
        self.find = vertices.get_trifinder()
        # Opposite each vertex.
        self.neighbours = vertices.neighbors[:, [1, 2, 0]]

    @property
    def stiffness(self):
        """D of the paper's σ = 𝒜ε per element, or for all of them: (…, 3, 3)."""
        scene = read_scene(self.folder / "scene.toml")
        names = sorted({name for table in ("material", "damage") for name, of in scene.get(table, {}).items()
                        if isinstance(of, dict)})
        materials = [{**scene["material"], **scene["material"].get(name, {})} for name in ("", *names)]
        young, poisson = (np.array([of[key] for of in materials], float) for key in ("young", "poisson"))
        number = 0 if self.material is None else self.material.astype(int)
        return elasticity(young, poisson, scene["material"].get("plane", "stress"))[number]

    def mapped(self, cell, l):
        """Points of elements (n) at barycentric coordinates (n, 3), and ∂x/∂(l₁, l₂)."""
        nodes = self.points[self.cells[cell]]
        values, slopes = functions(l.T, nodes.shape[1]), derivatives(l.T, nodes.shape[1]) @ SLOPES
        return np.einsum("nk,nkd->nd", values, nodes), np.einsum("nkd,nke->nde", nodes, slopes)

    def gradients(self, cell, l):
        """∇φ of the functions of elements (n) at barycentric coordinates (n, 3): (n, functions, 2)."""
        return derivatives(l.T, self.cells.shape[1]) @ SLOPES @ np.linalg.inv(self.mapped(cell, l)[1])

    def at(self, cell, l):
        """Strain (xx, yy, 2xy) and ζ at barycentric coordinates (n, 3) of elements (n)."""
        nodes = self.cells[cell]
        h = np.einsum("nkc,nkd->ncd", self.u[nodes], self.gradients(cell, l))
        strain = np.stack([h[:, 0, 0], h[:, 1, 1], h[:, 0, 1] + h[:, 1, 0]], axis=1)
        return strain, (self.zeta[nodes[:, :3]] * l).sum(1)

    def coordinates(self, cell, points):
        """Barycentric coordinates of points in elements, continued beyond their sides."""
        l = np.full((len(points), 3), 1 / 3)
        for _ in range(NEWTON):
            x, jacobian = self.mapped(cell, l)
            step = np.linalg.solve(jacobian, (points - x)[:, :, None])[:, :, 0] @ SLOPES.T
            l = l + step / np.maximum(np.abs(step).max(axis=1, keepdims=True) / STEP, 1.0)
        return l

    def locate(self, points, inner):
        """The elements that contain points, or are nearest across the boundary, and barycentric
        coordinates. The search begins on the way from a point to its inner one."""
        cell = self.find(*points.T)
        for part in (1e-9, 1e-6, 1e-3, 0.03, 0.3, 1.0):
            lost = cell < 0
            if not lost.any():
                break
            cell[lost] = self.find(*(points[lost] + part * (inner - points)[lost]).T)
        # A point between a chord and its arc belongs to the element with the nearest midpoint.
        middles = self.points[self.cells[:, :3]].mean(1)
        for k in np.flatnonzero(cell < 0):
            cell[k] = np.hypot(*(middles - points[k]).T).argmin()
        l = self.coordinates(cell, points)
        for _ in range(WALK):
            other = self.neighbours[cell, l.argmin(1)]
            beyond = np.flatnonzero((l.min(1) < -1e-9) & (other >= 0))
            if len(beyond) == 0:
                break
            cell[beyond] = other[beyond]
            l[beyond] = self.coordinates(cell[beyond], points[beyond])
        return cell, l


def errors(reference, run):
    """The relative errors of u and of the damage (None without damage), for the body or per element of the reference. NaN
    without deformation."""
    cells = np.repeat(np.arange(len(reference.cells)), len(POINTS))
    barycentric = np.tile(POINTS, (len(reference.cells), 1))
    points, jacobian = reference.mapped(cells, barycentric)
    weight = 0.5 * np.linalg.det(jacobian) * np.tile(WEIGHTS, len(reference.cells))
    strain, zeta = reference.at(cells, barycentric)
    inner = points.reshape(-1, len(POINTS), 2).mean(1).repeat(len(POINTS), axis=0)
    other, other_zeta = run.at(*run.locate(points, inner))

    d = np.broadcast_to(reference.stiffness, (len(reference.cells), 3, 3))[cells]

    def energy(e):
        return (weight * zeta * np.einsum("ni,nij,nj->n", e, d, e)).sum()

    damage = (weight * (1 - zeta) ** 2).sum()
    lost = (weight * (other_zeta - zeta) ** 2).sum()
    return np.sqrt(energy(other - strain) / energy(strain)), np.sqrt(lost / damage) if damage else None
