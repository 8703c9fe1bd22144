"""Common scales of pictures, so that one can compare runs, or the frames of a run, by eye."""

from dataclasses import dataclass

import numpy as np

from results import amplification
from setting import largest_load, near
from signorini_results import PEAK, PEAK_PART

# A singular stress is a peak if it is so many times the others.
SINGULAR_PEAK = 1.25
# A singular pressure is a peak within this part of its boundary; pressures below this part of it are no contact.
NEAR, LEAST_REST = 0.02, 1e-3


@dataclass
class Limits:
    """The scales of one or more states."""

    factor: float  # amplification of displacements
    box: np.ndarray  # (2, 2): corners of a box around the bodies before and after deformation, m
    stress: float  # the top of the colours, Pa
    damage: float  # the largest 1 − ζ
    pressure: float  # the top of the pressures on Γ_C, Pa
    gap: float  # the largest of Γ_C, m
    load: float  # the largest traction, Pa

    @property
    def is_damaged(self):
        """Whether the damage is visible."""
        return self.damage > 0.0


def _exceeded_in(part, values, sizes):
    """The value that is exceeded on this part of the total size."""
    order = np.argsort(values)
    below = np.cumsum(sizes[order]) <= (1.0 - part) * sizes.sum()
    return values[order[min(np.count_nonzero(below), len(order) - 1)]]


def stress_top(state, stress):
    """The top of the colours for a stress at the nodes: the largest, or if that is a peak, the stress that is exceeded
    beside it. Singular stresses are peaks sooner."""
    (ax, ay), (bx, by), (cx, cy) = (state.nodes[state.pieces.elements[:, i]].T for i in range(3))
    areas = np.abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) * state.shown
    means = stress[state.pieces.elements[:, :3]].mean(axis=1)
    top, largest = _exceeded_in(PEAK_PART, means, areas), stress.max()
    return top if largest > (SINGULAR_PEAK if state.singular() else PEAK) * top > 0.0 else largest


def _pressure_top(state):
    """The largest contact pressure. Near a singular one and the ends of its boundary, and at another peak of a corner, it is the
    largest beside them."""
    curves = [curve for curve in state.curves if len(curve.points) > 1]
    if not curves:
        return state.pressure.max()
    lengths = np.concatenate([np.linalg.norm(np.gradient(of.points, axis=0), axis=1) for of in curves])
    pressure = np.concatenate([curve.pressure for curve in curves])
    regular = np.concatenate([curve.pressure * ~is_near_peak(state.peak_of(curve), curve.points) for curve in curves])
    # Without other pressures the peak is the contact.
    regular = regular if regular.max() > LEAST_REST * pressure.max() else pressure
    largest, top = regular.max(), _exceeded_in(0.01, regular, lengths)
    # A narrow contact that meshes settle is not a peak of a corner.
    is_settled = any(state.peak_of(curve).get("bar") for curve in curves if curve.pressure.max() >= largest)
    return top if largest > PEAK * top > 0.0 and not is_settled else largest


def is_near_peak(figure, points):
    """Per node of a contact boundary: is it near a singular pressure, which this figure is, or near the ends?"""
    if not figure.get("singular"):
        return np.full(len(points), False)
    peaks = np.array([points[0], points[-1], figure["at"] or points[0]])
    distances = np.linalg.norm(points[:, None] - peaks, axis=2).min(axis=1)
    return distances <= NEAR * np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def limits_of(states, factor=None):
    """Scales for all `states`, with the given amplification of displacements, if any."""
    # A peak on a small area must not darken the rest.
    top = max(stress_top(state, state.von_mises) for state in states)
    factor = factor or _amplification(states)
    return Limits(
        factor=factor,
        box=box_of(states, factor),
        stress=float(top),
        damage=float(max(1.0 - state.zeta.min() for state in states)),
        pressure=max(_pressure_top(state) for state in states),
        gap=max((curve.gap.max() for state in states for curve in state.curves), default=0.0),
        load=max(largest_load(state) for state in states),
    )


def box_of(states, factor):
    """The lower left and the upper right corner of a box around the bodies, undeformed and deformed `factor` times,
    and around the near parts of their obstacles."""
    bodies = np.vstack([points for state in states for points in (
        state.nodes, state.pieces.at_points(state.nodes + factor * state.displacement))])
    obstacles = np.vstack([bodies[:0], *(line for state in states for line in state.foundation(factor))])
    points = np.vstack([bodies, near(obstacles, bodies)])
    return np.array([points.min(axis=0), points.max(axis=0)])


def _amplification(states):
    """An amplification that shows the displacements and keeps the obstacle, which moves as far, in the picture."""
    largest = max(np.linalg.norm(state.displacement, axis=1).max() for state in states)
    widest = max(np.linalg.norm(s.obstacle - s.contact, axis=2).max(initial=0.0) for s in states)
    return amplification(min(state.size for state in states), max(largest, widest))
