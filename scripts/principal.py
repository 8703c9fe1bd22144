"""Principal stresses: tension and compression apart, with lines along their directions."""

import numpy as np
from matplotlib.path import Path

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
    panels = figure.subplots(*shape)
    tension = np.maximum(results.principal[:, 0], 0.0)
    compression = np.maximum(-results.principal[:, 1], 0.0)
    turned = results.direction @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    longest = extent.max() / min(LINES, DENSITY * (size[0] / shape[1] - 1.5))
    stressed = np.flatnonzero(results.von_mises)
    places = stressed[_lattice(results.nodes[stressed], longest)]
    mesh = mesh_of(results, results.nodes)
    # Rounding errors are no stress.
    tension, compression = (np.where(stress > ROUNDING * results.von_mises.max(), stress, 0.0)
                            for stress in (tension, compression))
    least_top = 0.05 * max(stress_top(results, tension), stress_top(results, compression))
    for axes, name, stress, direction in (
            (panels[0], "tension", tension, results.direction),
            (panels[1], "compression", compression, turned)):
        top = max(stress_top(results, stress), least_top) or 1.0
        factor, unit, top = draw_stress(axes, mesh, results, stress, name, top)
        largest = three_digits(stress.max() / factor)
        axes.set_title(f"{name}, largest {largest} {unit}" if stress.any() else f"no {name}")
        _draw_lines(axes, results, direction[places], stress[places] / top, longest, places)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.7)
        draw_foundation(axes, results)
        frame(axes, results.nodes, results.units)
    figure.suptitle(headline(results, f"principal stresses at {results.part}"))
    return figure


def _lattice(points, size):
    """For each cell of this size of a lattice with points in it: the index of the point nearest to its middle."""
    scaled = (points - points.min(axis=0)) / size
    cells = np.floor(scaled)
    distance = np.linalg.norm(scaled - cells - 0.5, axis=1)
    order = np.lexsort((distance, cells[:, 1], cells[:, 0]))
    _, first = np.unique(cells[order], axis=0, return_index=True)
    return order[first]


def _draw_lines(axes, results, directions, lengths, longest, places):
    """Lines centred at nodes, within the body. White under dark lines keeps them visible on all colours."""
    points, body = results.nodes[places], Path.make_compound_path(*map(Path, results.outline(results.nodes)))
    half = 0.45 * longest * directions * np.minimum(lengths, 1.0)[:, None]
    shown = lengths > 0.1
    ends = np.stack((points - half, points + half, np.full_like(points, np.nan)), axis=1)[shown]
    for colour, width in (("white", 2.0), (INK, 0.9)):
        axes.plot(*ends.reshape(-1, 2).T, color=colour, linewidth=width, zorder=3, solid_capstyle="round",
                  clip_path=(body, axes.transData))
