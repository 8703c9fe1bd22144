"""The boundary that drives a run: its prescribed displacement, or the gap of its foundation, changes in time."""

import re

import numpy as np

from expressions import evaluate
from results import ROUNDING


def driven_boundary(results):
    """The boundary that moves farthest, and its displacement at each step; None if no boundary is driven. Of a boundary that
    turns only, the mean displacement is 0: it drives nothing here."""
    moved = {of["name"]: _displacement(results, of) for of in results.scene.get("boundary", [])
             if _varies(of.get("gap", of.get("displacement"))) and results.summary["boundaries"].get(of["name"])}
    moved = {name: way for name, way in moved.items() if np.ptp(way) > ROUNDING * results.size}
    return max(moved.items(), key=lambda of: np.ptp(of[1]), default=None)


def _varies(expressions):
    """Whether one of some expressions may depend on time, by its letters: tables are functions of t by default."""
    return bool(re.search(r"\b(t|table|spline|pchip)\b", str(expressions)))


def _displacement(results, of):
    """The mean prescribed displacement of a boundary in the direction of the largest one, or the mean way of its foundation
    towards the body since t = 0; by step."""
    times = results.history["time"]
    edges = np.array(results.summary["boundaries"][of["name"]])
    middles, lengths = edges.mean(axis=1), np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)

    def mean(expression, time):
        return np.average(evaluate(expression, middles, time, results.folder), weights=lengths)

    if "gap" in of:
        return mean(of["gap"], 0.0) - np.array([mean(of["gap"], time) for time in times])
    ways = np.array([[0.0 if component == "free" else mean(component, time) for component in of["displacement"]]
                     for time in times])
    k = np.linalg.norm(ways, axis=1).argmax()
    return ways @ ways[k] / (np.linalg.norm(ways[k]) or 1.0)
