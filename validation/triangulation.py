"""Triangulations from gmsh, read by meshio independently of the program."""

import contextlib
import io
import subprocess
from dataclasses import dataclass, field

import meshio
import numpy as np

from scene import SceneError


@dataclass
class Triangulation:
    """Nodes (n, 2), triangles (m, 3) counter-clockwise, the edges of each named curve and, for each
    named surface, whether a triangle is in it; of a file of second order the points in the middle of
    the sides 01, 12, 20 (m, 3, 2); the nodes at points of the geometry, if they are known."""

    nodes: np.ndarray
    triangles: np.ndarray
    curves: dict
    middles: np.ndarray = None
    surfaces: dict = field(default_factory=dict)
    points: frozenset = frozenset()

    def outward_normals(self, name):
        """Unit outward normals and lengths of a curve's edges; all must be boundary edges."""
        sides = np.vstack([self.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
        keys = edge_keys(sides, len(self.nodes))
        order = np.argsort(keys)
        wanted = edge_keys(self.edges(name), len(self.nodes))
        first = np.searchsorted(keys, wanted, sorter=order)
        if (np.searchsorted(keys, wanted, "right", sorter=order) - first != 1).any():
            raise SceneError(f"curve '{name}' has an edge that is not on the boundary")
        a, b = self.nodes[sides[order[first]]].transpose(1, 0, 2)
        # Counter-clockwise: the body is left of a → b, so (dy, −dx) points outwards.
        (dx, dy), lengths = (b - a).T, np.linalg.norm(b - a, axis=1)
        return np.column_stack([dy, -dx]) / lengths[:, None], lengths

    def edges(self, name):
        """Node pairs of a curve."""
        if name not in self.curves:
            known = ", ".join(sorted(self.curves)) or "none"
            raise SceneError(f"the mesh has no physical curve '{name}' (it has: {known})")
        return self.curves[name]


def edge_keys(edges, nodes):
    """A number for each edge of a mesh with `count` nodes, for both orders of its ends."""
    return edges.min(axis=1) * nodes + edges.max(axis=1)


def read_triangulation(path):
    """Vertices in the order of the file, without those of no triangle; all groups of each line.

    A line may belong to several groups. The 4.1 format states this per entity, which
    meshio gives as cell sets; the 2.2 format repeats the line with another tag.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # meshio prints an empty line
            mesh = meshio.read(path)
    except (OSError, meshio.ReadError) as error:
        raise SceneError(f"{path}: {error}") from None
    blocks = [(k, b.data) for k, b in enumerate(mesh.cells)]
    triangles = [data for k, data in blocks if mesh.cells[k].type in ("triangle", "triangle6")]
    if not triangles:
        raise SceneError(f"{path}: no triangles")
    triangles = np.vstack(triangles).astype(np.int64)
    middles = mesh.points[triangles[:, 3:], :2] if triangles.shape[1] == 6 else None
    triangles = triangles[:, :3]

    used = np.unique(triangles)
    renumber = np.full(len(mesh.points), -1, np.int64)
    renumber[used] = np.arange(len(used))
    nodes, triangles = mesh.points[used, :2], renumber[triangles]

    # A plane surface may be drawn clockwise: turn its triangles round.
    ab, ac = (nodes[triangles[:, k]] - nodes[triangles[:, 0]] for k in (1, 2))
    clockwise = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] < 0
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1]]
    if middles is not None:
        middles[clockwise] = middles[clockwise][:, [2, 1, 0]]

    tags = mesh.cell_data.get("gmsh:physical", [[]] * len(mesh.cells))
    curves, surfaces = {}, {}
    for name, (tag, dimension) in mesh.field_data.items():
        edges, inside = [], []
        for k, data in blocks:
            found = np.zeros(len(data), bool)
            found[mesh.cell_sets[name][k] if name in mesh.cell_sets else tags[k] == tag] = True
            if mesh.cells[k].type in ("line", "line3"):
                edges.append(renumber[data[found][:, :2]])
            elif mesh.cells[k].type in ("triangle", "triangle6"):
                inside.append(found)
        if dimension == 1:
            curves[name] = np.unique(np.sort(np.vstack(edges), axis=1), axis=0)
        elif dimension == 2:
            surfaces[name] = np.concatenate(inside)
    entities = mesh.point_data.get("gmsh:dim_tags", np.ones((len(mesh.points), 2)))
    points = frozenset(np.flatnonzero(entities[used, 0] == 0).tolist())
    return Triangulation(nodes, triangles, curves, middles, surfaces, points)


def mesh_geometry(geometry, table, target, order=1):
    """Meshes a .geo file into `target` with gmsh; `table` is the scene's [mesh]. Of order 2 the
    middles of edges lie on the geometry."""
    numbers = dict(table.get("parameters", {}))
    if "size" in table:
        numbers["size"] = table["size"]
    command = ["gmsh", "-2", str(geometry), "-o", str(target), "-v", "2", "-order", str(order)]
    for name, value in numbers.items():
        command += ["-setnumber", name, str(value)]
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise SceneError("gmsh is not installed") from None
    if done.returncode != 0 or not target.exists():
        raise SceneError(f"gmsh could not mesh {geometry}: {(done.stderr or done.stdout).strip()}")
