"""Principal stresses: tension and compression apart, with lines along their directions."""

import numpy as np
from matplotlib.path import Path

import signorini_results
from bars import three_digits
from drawing import INK, canvas, draw_foundation, draw_outline, draw_stress, frame, headline, mesh_of, panels_of
from limits import stress_top
from results import ROUNDING

# About so many lines along the longer side of the body, and to an inch at most.
LINES, DENSITY = 24, 5.0


def draw_principal(results, _limits, figure=None):
    """Tension, the positive part of σ₁, beside compression, the negative part of σ₂. The lines have the directions
    of these stresses, and lengths in proportion to them. None for an unloaded body."""
    if not results.principal.any():
        return None
    extent = np.ptp(results.nodes, axis=0)
    size, shape = panels_of(extent)
    figure = canvas(size, figure)
    # Rounding errors are no stress.
    noise = ROUNDING * results.von_mises.max()
    longest = extent.max() / min(LINES, DENSITY * (size[0] / shape[1] - 1.5))
    places, values, directions = _principal_at(results, longest)
    panels = [(name, key, np.where(stress > noise, stress, 0.0), np.maximum(of, 0.0), along) for
              name, key, stress, of, along in (
                  ("tension", "principal_max", results.principal[:, 0], values[:, 1], directions[:, :, 1]),
                  ("compression", "principal_min", -results.principal[:, 1], -values[:, 0], directions[:, :, 0]))]
    mesh = mesh_of(results, results.nodes)
    least_top = 0.05 * max(stress_top(results, stress) for _, _, stress, _, _ in panels)
    for axes, (name, key, stress, of, along) in zip(figure.subplots(*shape), panels):
        top = max(stress_top(results, stress), least_top)
        factor, unit, top = draw_stress(axes, mesh, results, stress, name, top)
        largest = three_digits(stress.max() / factor)
        singular = ": singular" if results.singular(key) else ""
        axes.set_title(f"{name}, largest {largest} {unit}{singular}" if stress.any() else f"no {name}")
        _draw_lines(axes, results, places, longest, np.minimum(of / top, 1.0)[:, None] * along)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.7)
        draw_foundation(axes, results)
        frame(axes, results.nodes, results.units)
    figure.suptitle(headline(results, f"principal stresses at {results.part}"))
    return figure


def _principal_at(results, spacing):
    """The points of a regular lattice in the shown part of the body, and the eigenvalues and eigenvectors of the
    stresses there, in increasing order."""
    low, extent = results.nodes.min(axis=0), np.ptp(results.nodes, axis=0)
    counts = np.maximum(1, np.round(extent / spacing).astype(int))
    steps = (low[k] + (np.arange(count) + 0.5) * extent[k] / count for k, count in enumerate(counts))
    points = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    state = signorini_results.load(results.folder).frame(results.time)
    triangles, barycentric = state.locate(points)
    points = points[results.shown[triangles] & np.isfinite(barycentric[:, 0])]
    return points, *np.linalg.eigh(state.at(points, "stress")[:, [[0, 2], [2, 1]]])


def _draw_lines(axes, results, points, longest, lines):
    """Lines centred at points, within the body, as fractions of the longest. White under dark ones keeps them visible."""
    body = Path.make_compound_path(*map(Path, results.outline(results.nodes)))
    are_seen = np.linalg.norm(lines, axis=1) > 0.1
    points, half = points[are_seen], 0.45 * longest * lines[are_seen]
    ends = np.stack((points - half, points + half, np.full_like(points, np.nan)), axis=1)
    for colour, width in (("white", 1.8), (INK, 0.8)):
        axes.plot(*ends.reshape(-1, 2).T, color=colour, linewidth=width, zorder=3, solid_capstyle="round",
                  clip_path=(body, axes.transData))
