"""Triangles of three or six nodes for pictures: cut into flat pieces, with their sides as polylines."""

import numpy as np

from signorini_results import functions

# Nodes of the sides: both ends and, of triangles of six nodes, the middle.
SIDES = np.array([[0, 1, 3], [1, 2, 4], [2, 0, 5]])


class Pieces:
    """Elements (m, 3) or (m, 6), nodes as VTK numbers them, each cut into `cuts`² flat triangles.

    A picture shows linear interpolants of quadratic functions and curved sides. The cuts make them exact to a
    few pixels. Triangles of three nodes need no cuts. Points with the same of the `numbers` are one node: it is
    listed again by another piece, or for another material.
    """

    def __init__(self, elements, numbers=None):
        self.elements = elements
        self._numbers = np.arange(elements.max() + 1) if numbers is None else numbers
        self.cuts = cuts = 1 if elements.shape[1] == 3 else cuts_of(len(elements))
        # A lattice of points with barycentric coordinates i/cuts, and the triangles between them.
        lattice = [(i, j) for i in range(cuts + 1) for j in range(cuts + 1 - i)]
        number = {point: k for k, point in enumerate(lattice)}
        upright = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in lattice if i + j < cuts]
        between = [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in lattice if i + j < cuts - 1]
        b, c = np.array(lattice, float).T / cuts
        self._functions = functions(np.stack((1 - b - c, b, c)), elements.shape[1])
        first = len(lattice) * np.arange(len(elements))[:, None, None]
        self.triangles = (first + np.array(upright + between)).reshape(-1, 3)

    def at_points(self, nodal):
        """A nodal field, (n,) or (n, 2), at the corners of the pieces."""
        values = np.einsum("kn,mn...->mk...", self._functions, nodal[self.elements])
        return values.reshape(-1, *nodal.shape[1:])

    def along(self, edges, nodal):
        """A nodal field along edges (k, 2) or (k, 3): (k, cuts + 1) values each."""
        s = np.linspace(0.0, 1.0, self.cuts + 1)
        values = functions(np.stack((1 - s, s)), edges.shape[1])
        return np.einsum("sn,kn...->ks...", values, nodal[edges])

    def sides(self):
        """The nodes of all sides, each side once: ends in increasing order, then the midpoint."""
        sides = sides_of(self.elements)
        _, first = np.unique(self._ends(sides), axis=0, return_index=True)
        return sides[first]

    def boundary(self):
        """The nodes of the sides that belong to one element, which is on their left."""
        sides = sides_of(self.elements)
        _, first, count = np.unique(self._ends(sides), axis=0, return_index=True, return_counts=True)
        return sides[first[count == 1]]

    def _ends(self, sides):
        return np.sort(self._numbers[sides[:, :2]], axis=1)


def cuts_of(count):
    """The number of parts per side for `count` triangles; all triangles have about 1e5 pieces."""
    return int(np.clip(np.sqrt(1e5 / count), 2, 12))


def sides_of(elements):
    """The sides of all elements, (3m, 2) or (3m, 3), with the element on their left."""
    return elements[:, SIDES[:, :elements.shape[1] // 3 + 1]].swapaxes(0, 1).reshape(3 * len(elements), -1)


def counter_clockwise(points, elements):
    """The elements in counter-clockwise order."""
    a, b, c = (points[elements[:, k], :2] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    order = [0, 2, 1, 5, 4, 3][:elements.shape[1]]
    return np.where(turn[:, None], elements[:, order], elements)
