"""The frames of a run on one rank or several, at the nodes of the mesh."""

from dataclasses import dataclass

import numpy as np

import shared  # noqa: F401
from signorini_results import frames_of, read_frame


@dataclass
class Frame:
    """Time, displacement, ζ at the vertices, remaining gap and pressure. Also two differences that should be 0: between
    the pieces of several ranks at common nodes, and between ζ at a midpoint and the mean of the ends."""

    time: float
    u: np.ndarray
    zeta: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    apart: float


def read_frames(space, out):
    """All frames, with nodes as in the finite element `space` of u. Pieces are matched triangle by triangle, as slits have
    two nodes at one point."""
    size = np.ptp(space.points, axis=0).max()
    place = {key(space.points[t]): t for t in space.elements}
    if not (out / "fields.pvd").exists():
        return []
    frames = []
    for time, path in frames_of(out):
        # The pieces of several ranks stand one after the other, each with its own nodes.
        data, values, apart, seen = read_frame(path), np.full((len(space.points), 5), np.nan), 0.0, 0
        names = ("displacement", "zeta", "gap", "normal_pressure")
        field = np.column_stack([data.point_data[name] for name in names])[:, [0, 1, 3, 4, 5]]
        for cell in np.vstack([block.data for block in data.cells]):
            nodes = place[key(data.points[cell, :2])]
            # Both lists are sorted by their points.
            a, b = (order(points) for points in (space.points[nodes], data.points[cell, :2]))
            if np.abs(space.points[nodes[a]] - data.points[cell[b], :2]).max() > 1e-9 * size:
                raise ValueError("a middle of a side is not where the mesh has it")
            old, new = values[nodes[a]], field[cell[b]]
            apart = max(apart, np.nanmax(np.abs(old - new), initial=0.0))
            values[nodes[a]] = new
            seen += 1
        values[:] = values if seen == len(space.elements) else np.nan
        u, (zeta, gap, pressure) = values[:, :2].ravel(), values[:, 2:].T
        vertices = zeta[:len(space.mesh.nodes)]
        apart, zeta = max(apart, np.abs(space.spread(vertices) - zeta).max()), vertices
        frames.append(Frame(time, u, zeta, gap, pressure, apart))
    return frames


def key(points):
    """A triangle by the coordinates of its vertices."""
    return tuple(map(tuple, (points[order(points)[:3]] + 0.0).tolist()))


def order(points):
    """The vertices sorted by their coordinates, then the middles of the sides between them."""
    p = np.lexsort((points[:3, 1], points[:3, 0]))
    # Side k lies opposite vertex k − 1.
    return p if len(points) == 3 else np.r_[p, 3 + (p[[2, 0, 1]] + 1) % 3]
