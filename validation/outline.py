"""Where the boundary of a mesh is smooth, and its tangents, for the verification by `random_scenes.py`.

The rule is that of geo/KEYS.md ("A node on several boundaries"), written without the program. Complex numbers are points, and
angles are in radians.
"""

from collections import defaultdict

import numpy as np

from lagrange import Lagrange

# Largest turn of two edges of a smooth line, and largest kink of its tangents; on meshes with points and without.
KNOWN, UNKNOWN = (np.pi / 3 + 0.01, 1e-4), (np.pi / 6 + 1e-9, np.pi / 90)


def between(a, b):
    """The angle between the directions a and b."""
    return abs(np.angle(a / b))


def tangent(a, p, q):
    """The unit tangent at a, towards p, of the circle through three points: it is at the chord ap the angle under which this
    chord is seen from q."""
    direction = (p - a) * (a - q) / (p - q)
    return direction / abs(direction)


class Outline:
    """The boundary of a triangulation."""

    def __init__(self, mesh):
        self.mesh, self.x = mesh, mesh.nodes @ np.array([1.0, 1.0j])
        self.largest_turn, self.largest_kink = KNOWN if len(mesh.points) else UNKNOWN
        # A middle per side of a triangle; sides of the boundary occur once.
        sides, self.ends = {}, defaultdict(list)
        for t, triangle in enumerate(mesh.triangles.tolist()):
            for k in range(3):
                edge = triangle[k], triangle[(k + 1) % 3]
                middle = None if mesh.middles is None else complex(*mesh.middles[t, k])
                if sides.pop(edge[::-1], None) is None:
                    sides[edge] = [middle]
        self.middle = {}
        for (a, b), [middle] in sides.items():
            self.ends[a].append(b)
            self.ends[b].append(a)
            self.middle[a, b] = self.middle[b, a] = middle
        self.is_curved = mesh.middles is not None and Lagrange(mesh, 2).curved()

    def along(self, a, b):
        """The direction in which the edge ab, straight or the arc through its middle, leaves a."""
        if self.middle[a, b] is None:
            return self.x[b] - self.x[a]
        return tangent(self.x[a], self.middle[a, b], self.x[b])

    def turns_little(self, node, ends):
        return between(self.along(node, ends[0]), -self.along(node, ends[1])) <= self.largest_turn

    def next(self, a, b):
        """The node after b on the way from a, or None where the line ends or turns."""
        ends = self.ends[b]
        if len(ends) != 2 or b in self.mesh.points or not self.turns_little(b, ends):
            return None
        return ends[ends[0] == a]

    def ahead(self, a, b):
        """At most three points of the line after a, by way of b."""
        points = []
        while b is not None and len(points) < 3:
            points += [self.middle[a, b]] * self.is_curved + [self.x[b]]
            a, b = b, self.next(a, b)
        return points[:3]

    def estimate(self, a, b):
        """The tangent at a towards b, and its possible error."""
        points, at = self.ahead(a, b), self.x[a]
        if len(points) == 1:
            before = self.next(b, a)
            return self.along(a, b) if before is None else tangent(at, self.x[b], self.x[before]), 0.0
        direction = tangent(at, *points[:2])
        if len(points) == 3:
            return direction, between(direction, tangent(at, *points[1:]))
        return direction, 0.0 if len(self.mesh.points) else between(direction, self.along(a, b))

    def is_smooth(self, node):
        ends, known = self.ends[node], len(self.mesh.points) > 0
        if len(ends) != 2 or not self.turns_little(node, ends):
            return False
        if known and node not in self.mesh.points:
            return True
        (a, of_a), (b, of_b) = (self.estimate(node, end) for end in ends)
        if between(a, -b) <= of_a + of_b + self.largest_kink:
            return True
        middle = tangent(self.x[node], *self.x[ends])
        return not known and (between(a, middle) <= of_a + self.largest_kink / 2
                              or between(b, -middle) <= of_b + self.largest_kink / 2)

    def tangent(self, a, b):
        """The direction in which the line leaves a towards b; where it is smooth, its sides have opposite ones."""
        own = self.estimate(a, b)[0]
        if not self.is_smooth(a):
            return own / abs(own)
        other = self.estimate(a, self.ends[a][self.ends[a][0] == b])[0]
        return own / abs(own) - other / abs(other)
