"""The nodes of continuous finite elements of order 1 or 2 on a triangulation."""

import numpy as np

from triangulation import edge_keys

# The sides of a triangle, in the order in which their middles follow the vertices (gmsh, VTK).
SIDES = np.array([[0, 1], [1, 2], [2, 0]])


class Lagrange:
    """Points (n, 2): the vertices, for order 2 then the middles of the edges. Elements (m, 3) or
    (m, 6): the vertices of each triangle, then the middles of its sides 01, 12, 20."""

    def __init__(self, mesh, order):
        self.mesh, self.order = mesh, order
        self.points, self.elements = mesh.nodes, mesh.triangles
        if order == 2:
            sides = mesh.triangles[:, SIDES].reshape(-1, 2)
            keys = edge_keys(sides, len(mesh.nodes))
            self._keys, first, edge = np.unique(keys, return_index=True, return_inverse=True)
            middles = mesh.nodes[sides].mean(axis=1)
            if mesh.middles is not None:
                middles = mesh.middles.reshape(-1, 2)
            self.points = np.vstack([mesh.nodes, middles[first]])
            middle = len(mesh.nodes) + edge.reshape(-1, 3)
            self.elements = np.hstack([mesh.triangles, middle])

    def on(self, edges):
        """The nodes (k, 2) or (k, 3) of edges given by their ends: the ends, then the middle."""
        if self.order == 1:
            return edges
        middle = np.searchsorted(self._keys, edge_keys(edges, len(self.mesh.nodes)))
        return np.column_stack([edges, len(self.mesh.nodes) + middle])

    def offsets(self, edges):
        """The offsets of the midpoints of edges from the midpoints of their chords (k, 2)."""
        if self.order == 1:
            return np.zeros((len(edges), 2))
        a, b, middle = self.points[self.on(edges)].transpose(1, 0, 2)
        return middle - 0.5 * (a + b)

    def curved(self, edges=None):
        """Whether some of the edges (by default of all edges) are curved."""
        if edges is None:
            edges = self.mesh.triangles[:, SIDES].reshape(-1, 2)
        size = np.ptp(self.points, axis=0).max()
        return bool(np.abs(self.offsets(edges)).max(initial=0.0) > 1e-12 * size)

    def spread(self, values):
        """The values at the nodes of a P1 function given at the vertices."""
        if self.order == 1:
            return values
        spread = np.empty(len(self.points))
        spread[self.elements] = np.hstack(
            [values[self.mesh.triangles], values[self.mesh.triangles[:, SIDES]].mean(axis=2)])
        return spread
