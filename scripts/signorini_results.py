"""Reads the results of a run. It needs numpy and meshio, and can be copied beside a script of your own:

    from signorini_results import load
    run = load("out/lshape")
    run.summary["work"], run.times, run.history["contact_force"]
    frame = run.frame(0.5)                       # the frame nearest to t = 0.5; without a time the last one
    frame.field("zeta"), frame.field("stress_yy")
    along, zeta = frame.line((0, 5), (8, 5), "zeta")
    along, pressure = frame.along("foundation", "normal_pressure")
"""

import csv
import json
import xml.etree.ElementTree as ElementTree
from functools import cached_property
from pathlib import Path

import meshio
import numpy as np

# Names of components: the array of a frame, and the column in it.
COMPONENTS = {
    "u_x": ("displacement", 0), "u_y": ("displacement", 1),
    "stress_xx": ("stress", 0), "stress_yy": ("stress", 1), "stress_xy": ("stress", 2), "stress_zz": ("stress", 3),
    "stress_1": ("principal_stress", 0), "stress_2": ("principal_stress", 1),
}
# A point is in a triangle if its barycentric coordinates are not smaller.
OUTSIDE = -1e-9
# The largest number of pairs of points and triangles that are tried at once.
AT_ONCE = 4_000_000


def load(folder):
    """The results in a folder."""
    return Run(folder)


class Run:
    """A folder of results."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.summary = json.loads((self.folder / "summary.json").read_text(encoding="utf-8"))

    @cached_property
    def history(self):
        """Column of history.csv → array; a missing number is NaN."""
        with open(self.folder / "history.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}

    @cached_property
    def frames(self):
        """(time, file) of each frame, in the order of time."""
        return frames_of(self.folder)

    @property
    def times(self):
        """The times of the frames, s."""
        return [time for time, _ in self.frames]

    def frame(self, time=None):
        """The frame nearest to a time, or the last one."""
        at = min(self.frames, key=lambda of: abs(of[0] - time)) if time is not None else self.frames[-1]
        return Frame(self, *at)


class Frame:
    """The fields of a run at a time, s, at its `points` (n, 2)."""

    def __init__(self, run, time, path):
        self.run, self.time = run, time
        self.mesh = read_frame(path)
        self.points = self.mesh.points[:, :2]
        blocks = [block.data for block in self.mesh.cells if block.type in ("triangle", "triangle6")]
        self.elements = np.vstack(blocks)

    def field(self, name):
        """A point field of the frame, or a component: u_x, stress_yy, stress_1, …"""
        if name in COMPONENTS:
            array, column = COMPONENTS[name]
            return self.mesh.point_data[array][:, column]
        try:
            return self.mesh.point_data[name]
        except KeyError:
            known = ", ".join([*self.mesh.point_data, *COMPONENTS])
            raise ValueError(f"there is no field {name}; there are {known}") from None

    def line(self, start, end, name, count=401):
        """A field along a straight line: the distances from its start and the values, NaN outside the body."""
        s = np.linspace(0.0, 1.0, count)[:, None]
        points = (1 - s) * np.asarray(start, float) + s * np.asarray(end, float)
        return s[:, 0] * np.linalg.norm(np.subtract(end, start)), self.at(points, name)

    def along(self, boundary, name):
        """A field along a boundary of the scene: the distances from its first end along it, and the values at the
        vertices. Parts that are not connected have a NaN between them."""
        edges = np.array(self.run.summary["boundaries"][boundary])
        places, values, length = [], [], 0.0
        for path in paths([tuple(map(tuple, edge)) for edge in edges.tolist()]):
            points = np.array(path)
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
            places += [*(length + np.concatenate(([0.0], np.cumsum(steps)))), np.nan]
            values += [*self.at(points, name), np.nan]
            length += steps.sum()
        return np.array(places[:-1]), np.array(values[:-1])

    def to_gmsh(self, path):
        """Writes the frame as .msh for gmsh, which takes scalars and vectors only. The gap is left out: it is not a
        number off Γ_C."""
        data = {name: values for name, values in self.mesh.point_data.items()
                if values.shape[1:] in ((), (3,)) and np.isfinite(values).all()}
        data |= {name: self.field(name) for name in COMPONENTS}
        meshio.write(path, meshio.Mesh(self.mesh.points, self.mesh.cells, data), file_format="gmsh")

    def at(self, points, name):
        """A field at a point or at points (k, 2); NaN outside the body. Sides count as straight."""
        places, nodal = np.asarray(points, float), self.field(name)
        points, columns = places.reshape(-1, 2), nodal.reshape(len(nodal), -1)
        found = np.full((len(points), columns.shape[1]), np.nan)
        step = max(1, AT_ONCE // len(self.elements))
        for first in range(0, len(points), step):
            some = slice(first, first + step)
            barycentric = self._barycentric(points[some])
            least = barycentric.min(axis=2)
            best = least.argmax(axis=1)
            rows = np.arange(len(best))
            l = barycentric[rows, best]
            values = columns[self.elements[best]]
            if self.elements.shape[1] == 6:
                middles = 4 * l[:, [0, 1, 2]] * l[:, [1, 2, 0]]
                weights = np.hstack((l * (2 * l - 1), middles))
            else:
                weights = l
            # The gap is NaN at nodes off Γ_C, which do not count on a side along it.
            values = np.where(np.abs(weights)[..., None] <= -OUTSIDE, 0.0, values)
            inside = least[rows, best] >= OUTSIDE
            found[some] = np.where(inside[:, None], (weights[..., None] * values).sum(axis=1), np.nan)
        return found.reshape(places.shape[:-1] + nodal.shape[1:])

    def _barycentric(self, points):
        """(points, triangles, 3)."""
        a, b, c = (self.points[self.elements[:, k]] for k in range(3))
        x = points[:, None, :]

        def cross(p, q):
            return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]

        twice = cross(b - a, c - a)
        return np.stack((cross(b - x, c - x), cross(c - x, a - x), cross(a - x, b - x)), -1) / (twice[:, None])


def frames_of(folder):
    """(time, file) of each frame that fields.pvd lists, in the order of time."""
    folder = Path(folder)
    listed = ElementTree.parse(folder / "fields.pvd").findall(".//DataSet")
    frames = [(float(of.get("timestep")), folder / of.get("file")) for of in listed]
    return sorted(frames, key=lambda frame: frame[0])


def read_frame(path):
    """A frame: a .vtu file, or the .pvtu list of the pieces of several ranks, which meshio does not read. The pieces
    stand one after the other; nodes of several pieces have one number, `global_node`."""
    path = Path(path)
    if path.suffix != ".pvtu":
        # meshio.read would end the program if it finds a fault.
        return meshio.vtu.read(path)
    sources = [piece.get("Source") for piece in ElementTree.parse(path).findall(".//Piece")]
    pieces = [read_frame(path.parent / source) for source in sources]
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    cells = [start + piece.cells[0].data for piece, start in zip(pieces, starts)]
    return meshio.Mesh(
        np.concatenate([piece.points for piece in pieces]),
        [(pieces[0].cells[0].type, np.concatenate(cells))],
        point_data={name: np.concatenate([piece.point_data[name] for piece in pieces])
                    for name in pieces[0].point_data},
        cell_data={name: [np.concatenate([piece.cell_data[name][0] for piece in pieces])]
                   for name in pieces[0].cell_data},
    )


def paths(edges):
    """Joins edges (pairs of hashable ends) into the longest possible paths.

    A path has the direction of its first edge. If all edges have the same orientation, so have the paths. A closed
    curve ends at its first point.
    """
    at = {}
    for k, edge in enumerate(edges):
        for end in edge:
            at.setdefault(end, []).append(k)
    unused = set(range(len(edges)))
    found = []

    def follow(point):
        walked = []
        while following := [k for k in at[point] if k in unused]:
            unused.discard(following[0])
            a, b = edges[following[0]]
            point = b if a == point else a
            walked.append(point)
        return walked

    for k, (a, b) in enumerate(edges):
        if k in unused:
            unused.discard(k)
            forward = follow(b)
            found.append([*reversed(follow(a)), a, b, *forward])
    return found
