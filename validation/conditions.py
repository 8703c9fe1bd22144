"""Conditions at nodes, as the judge of `random_scenes.py` has them: rows d·u = value or d·u ≤ value, and
the normals that a node sees."""

from dataclasses import dataclass

import numpy as np

from scene import Expression

CORNER = np.pi / 6  # edges further apart meet in a corner


@dataclass
class Rows:
    """Conditions d·u = value (or ≤ value), a row each: node, unit direction, value, and of contact
    rows the tributary length."""

    node: np.ndarray
    direction: np.ndarray
    value: np.ndarray
    weight: np.ndarray


def pair(texts, points, t):
    """Two expressions at points, (n, 2)."""
    return np.stack([Expression(text).at(points, t) for text in texts], -1)


def angle(a, b):
    """The angle between two directions, exact also where it is small."""
    return np.arctan2(abs(a[0] * b[1] - a[1] * b[0]), a @ b)


def merged(parts):
    """Joins (normal, length) of edges no further apart than a corner."""
    faces = []
    for normal, length in parts:
        for k, (n, w) in enumerate(faces):
            if angle(n, normal) <= CORNER + 1e-9:
                mean = w * n + length * normal
                faces[k] = (mean / np.linalg.norm(mean), w + length)
                break
        else:
            faces.append((normal, length))
    return faces


def merged_gaps(parts):
    """Joins (normal, length, gaps) of curves that meet smoothly: the smallest gap counts."""
    rows = []
    for normal, length, gaps in parts:
        for k, (n, w, others) in enumerate(rows):
            if angle(n, normal) < CORNER:
                mean = w * n + length * normal
                rows[k] = (mean / np.linalg.norm(mean), w + length, others + gaps)
                break
        else:
            rows.append((normal, length, gaps))
    return rows


def as_rows(found):
    """Rows from a list of (node, direction, value[, weight])."""
    if not found:
        return Rows(np.zeros(0, int), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    node, direction, value, *weight = zip(*found)
    return Rows(np.array(node), np.array(direction, float), np.array(value, float),
                np.array(weight[0] if weight else np.ones(len(node))))
