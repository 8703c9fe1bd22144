"""True errors of runs against a finer run: u in the energy norm, the damage in L², at the last time.

    /usr/bin/python3 validation/true_errors.py SCENE.toml REFERENCE RUN…

Folders of results with straight sides (either order). The reference should be quadratic, on a mesh
graded geometrically to every corner and end of contact, with steps of its own: it shares nothing with
the estimates it judges. Prints, for each run, estimated and true relative errors and their ratio."""

import json
import sys
import tomllib
from pathlib import Path

import meshio
import numpy as np
from matplotlib.tri import Triangulation

# Barycentric points and weights of the rule of degree 4 with six points.
NEAR, FAR = 0.816847572980459, 0.108103018168070
POINTS = np.array([[1 - 2 * b if i == j else b for j in range(3)]
                   for b in ((1 - NEAR) / 2, (1 - FAR) / 2) for i in range(3)])
WEIGHTS = np.repeat([0.109951743655322, 0.223381589678011], 3)


class Run:
    """The last frame of a run."""

    def __init__(self, folder):
        folder = Path(folder)
        self.summary = json.loads((folder / "summary.json").read_text())
        frame = meshio.read(sorted(folder.glob("fields_*.vtu"))[-1])
        self.points = frame.points[:, :2]
        self.cells = next(iter(frame.cells_dict.values()))
        self.u = frame.point_data["displacement"][:, :2]
        self.zeta = frame.point_data["zeta"].ravel()
        corners = self.points[self.cells[:, :3]]
        side = corners[:, 1:] - corners[:, :1]
        self.area = 0.5 * np.abs(np.linalg.det(side))
        # Gradients of the barycentric coordinates.
        inverse = np.linalg.inv(side)
        last = np.swapaxes(inverse, 1, 2)
        self.slopes = np.concatenate([-last.sum(1, keepdims=True), last], axis=1)
        vertices = Triangulation(*self.points.T, self.cells[:, :3])
        self.find = vertices.get_trifinder()

    def at(self, cell, barycentric):
        """Strain (xx, yy, 2xy) and ζ at barycentric coordinates (n, 3) of elements (n)."""
        nodes, slopes, l = self.cells[cell], self.slopes[cell], barycentric
        if nodes.shape[1] == 3:
            gradients = slopes
        else:
            pairs = [(0, 1), (1, 2), (2, 0)]
            vertex = [(4 * l[:, i] - 1)[:, None] * slopes[:, i] for i in range(3)]
            middle = [4 * (l[:, i, None] * slopes[:, j] + l[:, j, None] * slopes[:, i])
                      for i, j in pairs]
            gradients = np.stack(vertex + middle, axis=1)
        h = np.einsum("nkc,nkd->ncd", self.u[nodes], gradients)
        strain = np.stack([h[:, 0, 0], h[:, 1, 1], h[:, 0, 1] + h[:, 1, 0]], axis=1)
        zeta = (self.zeta[nodes[:, :3]] * l).sum(1)
        return strain, zeta

    def locate(self, points, centre):
        """The elements that contain points, and barycentric coordinates; points on an edge are first
        moved a little towards `centre`."""
        for step in (0.0, 1e-9, 1e-6, 1e-3):
            moved = points + step * (centre - points)
            cell = self.find(*moved.T)
            if (cell >= 0).all():
                break
            points = np.where((cell < 0)[:, None], moved, points)
        x = points - self.points[self.cells[cell, 0]]
        rest = np.einsum("nkd,nd->nk", self.slopes[cell][:, 1:], x)
        return cell, np.column_stack([1 - rest.sum(1), rest])


def elasticity(young, poisson, plane):
    """The matrix of the paper's 𝒜 for (ε_xx, ε_yy, 2ε_xy)."""
    if plane == "strain":
        young, poisson = young / (1 - poisson**2), poisson / (1 - poisson)
    return young / (1 - poisson**2) * np.array(
        [[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])


def errors(reference, run, d):
    """Relative errors of u and the damage (None without damage)."""
    cells = np.repeat(np.arange(len(reference.cells)), len(POINTS))
    barycentric = np.tile(POINTS, (len(reference.cells), 1))
    corners = reference.points[reference.cells[cells, :3]]
    points = np.einsum("nk,nkd->nd", barycentric, corners)
    weight = (reference.area[:, None] * WEIGHTS).ravel()
    strain, zeta = reference.at(cells, barycentric)
    other, other_zeta = run.at(*run.locate(points, corners.mean(1)))

    def energy(e):
        return (weight * zeta * np.einsum("ni,ij,nj->n", e, d, e)).sum()

    damage = (weight * (1 - zeta) ** 2).sum()
    lost = (weight * (other_zeta - zeta) ** 2).sum()
    return np.sqrt(energy(other - strain) / energy(strain)), np.sqrt(lost / damage) if damage else None


def main():
    scene, reference, *runs = sys.argv[1:]
    material = tomllib.loads(Path(scene).read_text())["material"]
    d = elasticity(material["young"], material["poisson"], material["plane"])
    reference = Run(reference)
    for folder in runs:
        run = Run(folder)
        estimates = run.summary["errors"]
        u, damage = errors(reference, run, d)
        told = estimates["displacement_mesh"]
        line = f"{folder}: u {100 * u:.3f} %, estimated {100 * told:.3f} % ({told / u:.2f})"
        if damage is not None:
            parts = [estimates.get(key) or 0.0 for key in ("damage_mesh", "damage_steps")]
            told = np.hypot(*parts)
            line += f"; damage {100 * damage:.3f} %, estimated {100 * told:.3f} % ({told / damage:.2f})"
        print(line)


if __name__ == "__main__":
    main()
