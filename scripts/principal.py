"""Principal stresses: tension and compression apart, with lines along their directions."""

from functools import lru_cache

import numpy as np
from matplotlib.path import Path

import signorini_results
from drawing import (
    INK, OPTIONS, Map, draw_body, draw_maps, draw_stress, headline, mesh_of, stress_colours,
)
from limits import stress_top
from results import ROUNDING

# About so many lines along the longer side of the body, and to an inch at most; and at least so many across it, as a beam
# has tension beside compression.
LINES, DENSITY, LEAST = 24, 5.0, 2


def draw_principal(results, _limits, figure=None):
    """Tension, the positive part of σ₁, beside compression, the negative part of σ₂. None for an unloaded body."""
    maps = principal_maps(results)
    return maps and draw_maps(maps, headline(results, f"principal stresses at {results.part}"), results.units, figure)


def principal_maps(results):
    """Tension and compression. The lines have the directions of these stresses, and lengths in proportion to them. None
    for an unloaded body."""
    if not results.principal.any():
        return None
    # Rounding errors are no stress.
    noise = ROUNDING * results.von_mises.max()
    parts = [("tension", "principal_max", results.principal[:, 0], 1),
             ("compression", "principal_min", -results.principal[:, 1], 0)]
    parts = [(name, key, np.where(stress > noise, stress, 0.0), k) for name, key, stress, k in parts]
    least_top = 0.05 * max(stress_top(results, stress) for _, _, stress, _ in parts)

    def map_of(name, key, stress, k):
        top = max(stress_top(results, stress), least_top)
        *_, factor, unit = stress_colours(results, top)
        title = f"{name} ({unit})"
        if OPTIONS.titles:
            # The smallest σ₂ is negative where there is compression.
            said = results.said(key, (2 * k - 1) * stress[results.seen].max(), (2 * k - 1) * factor)
            title += f", largest {said}" + ": singular" * bool(results.singular(key)) if stress[results.seen].any() else ": none"

        def paint(axes):
            draw_stress(axes, mesh_of(results, results.places(results.factor)), results, stress, top)
            _draw_lines(axes, results, k, top)
            draw_body(axes, results, results.factor)

        return Map(title, results.box, paint)

    return [map_of(*part) for part in parts]


def _part_of(results):
    """The lower left corner and the size of the body, or of the part that the maps show."""
    low, high = results.nodes.min(axis=0), results.nodes.max(axis=0)
    if results.zoom is not None:
        low, high = np.maximum(low, results.zoom[0]), np.minimum(high, results.zoom[1])
    return low, high - low


def _principal_at(results, spacing):
    """The points of a regular lattice in the shown part of the body, displaced, and the eigenvalues and eigenvectors of
    the stresses there, in increasing order."""
    low, extent = _part_of(results)
    counts = np.maximum(LEAST, np.round(extent / spacing).astype(int))
    steps = (low[k] + (np.arange(count) + 0.5) * extent[k] / count for k, count in enumerate(counts))
    points = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    state = _frame_of(results.folder, results.time)
    triangles, barycentric = state.locate(points)
    points = points[results.shown[triangles] & np.isfinite(barycentric[:, 0])]
    moved = points + results.factor * state.at(points, "displacement")[:, :2]
    return moved, *np.linalg.eigh(state.at(points, "stress")[:, [[0, 2], [2, 1]]])


@lru_cache(maxsize=1)
def _frame_of(folder, time):
    return signorini_results.load(folder).frame(time)


def _draw_lines(axes, results, k, top):
    """Lines along the direction of the smaller (k = 0) or larger (k = 1) principal stress, within the body, as long as
    the stress is high. White under dark ones keeps them visible."""
    _, extent = _part_of(results)
    inches = axes.get_position().size * axes.figure.get_size_inches()
    longest = extent.max() / min(LINES, DENSITY * inches.max())
    points, values, directions = _principal_at(results, longest)
    part = np.clip((2 * k - 1) * values[:, k] / top, 0.0, 1.0) if top else np.zeros(len(values))
    are_seen = part > 0.1
    points, half = points[are_seen], 0.45 * longest * (part[:, None] * directions[:, :, k])[are_seen]
    ends = np.stack((points - half, points + half, np.full_like(points, np.nan)), axis=1)
    body = Path.make_compound_path(*map(Path, results.outline(results.places(results.factor))))
    for colour, width in (("white", 1.8), (INK, 0.8)):
        axes.plot(*ends.reshape(-1, 2).T, color=colour, linewidth=width, zorder=3, solid_capstyle="round",
                  clip_path=(body, axes.transData), clip_box=axes.bbox)
