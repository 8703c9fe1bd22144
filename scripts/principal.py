"""Principal stresses: tension and compression apart, with lines along their directions."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.tri import Triangulation

from drawing import (
    INK, canvas, draw_colourbar, draw_foundation, draw_outline, draw_values, frame, headline,
    map_size, stress_unit,
)
from limits import stress_top
from results import ROUNDING

# About so many lines along the longer side of the body.
LINES = 24


def draw_principal(results, _limits, figure=None):
    """Tension, the positive part of σ₁, beside compression, the negative part of σ₂. The lines have the directions
    of these stresses, and lengths in proportion to them. None for an unloaded body."""
    if not results.principal.any():
        return None
    extent = np.ptp(results.nodes, axis=0)
    across = extent[0] < 2.5 * extent[1]
    width, height = map_size(extent, 5.0 if across else 8.0)
    size = (2 * (width + 0.9), height + 0.5) if across else (width, 2 * height + 0.5)
    figure = canvas(size, figure)
    panels = figure.subplots(*((1, 2) if across else (2, 1)))
    tension = np.maximum(results.principal[:, 0], 0.0)
    compression = np.maximum(-results.principal[:, 1], 0.0)
    turned = results.direction @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    places = _lattice(results.nodes)
    mesh = Triangulation(*results.pieces.at_points(results.nodes).T, results.pieces.triangles)
    # Rounding errors are no stress.
    tension, compression = (np.where(stress > ROUNDING * results.von_mises.max(), stress, 0.0)
                            for stress in (tension, compression))
    least_top = 0.05 * max(stress_top(results, tension), stress_top(results, compression))
    for axes, name, stress, direction in (
            (panels[0], "tension", tension, results.direction),
            (panels[1], "compression", compression, turned)):
        top = max(stress_top(results, stress), least_top) or 1.0
        factor, unit = stress_unit(top, results.units)
        image = draw_values(axes, mesh, results.pieces.at_points(stress) / factor, "viridis", 0.0, top / factor)
        extend = "max" if stress.max() > top else "neither"
        draw_colourbar(axes, image, f"{name} ({unit})", extend)
        _draw_lines(axes, results.nodes[places], direction[places], stress[places] / top,
                    extent.max() / LINES)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.7)
        draw_foundation(axes, results)
        frame(axes, results.nodes, results.units)
        own_factor, own_unit = stress_unit(stress.max(), results.units)
        largest = f"{float(f'{stress.max() / own_factor:.3g}'):g} {own_unit}"
        axes.set_title(f"{name}, largest {largest}" if stress.any() else f"no {name}")
    figure.suptitle(headline(results, f"principal stresses at {results.moment}"), fontsize=11.5)
    return figure


def _lattice(points):
    """For each cell of a lattice with points in it: the index of the point nearest to its middle."""
    size = np.ptp(points, axis=0).max() / LINES
    scaled = (points - points.min(axis=0)) / size
    cells = np.floor(scaled)
    distance = np.linalg.norm(scaled - cells - 0.5, axis=1)
    order = np.lexsort((distance, cells[:, 1], cells[:, 0]))
    _, first = np.unique(cells[order], axis=0, return_index=True)
    return order[first]


def _draw_lines(axes, points, directions, lengths, longest):
    """Lines centred at the points. White under dark lines keeps them visible on all colours."""
    half = 0.45 * longest * directions * np.minimum(lengths, 1.0)[:, None]
    shown = lengths > 0.04
    ends = np.stack((points - half, points + half, np.full_like(points, np.nan)), axis=1)[shown]
    for colour, width in (("white", 2.0), (INK, 0.9)):
        axes.plot(*ends.reshape(-1, 2).T, color=colour, linewidth=width, zorder=3,
                  solid_capstyle="round")
