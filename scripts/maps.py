"""Pictures of the whole body: its deformed mesh, stress and damage."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.tri import Triangulation

from bars import three_digits
from drawing import (
    BLUE, INK, RED, canvas, damage_scale, draw_colourbar, draw_foundation, draw_outline, draw_stress, draw_values,
    frame, headline, is_flat, least_zeta, map_size, mesh_of, panels_of, wide,
)

# About so many arrows along the boundary.
ARROWS = 30


def draw_deformed(results, limits, figure=None):
    """The deformed mesh over the initial outline and the foundation (paper, Figures 5 and 8).

    The obstacle is drawn opposite the nodes of Γ_C. As these slide, the obstacle seems to slide with them.
    """
    pieces = results.pieces
    moved = results.nodes + limits.factor * results.displacement
    extent = np.ptp(limits.box, axis=0)
    width, height = map_size(extent, wide(7.2))
    figure = canvas((width, height + 0.4), figure)
    axes = figure.add_subplot()
    mesh = Triangulation(*pieces.at_points(moved).T, pieces.triangles)
    draw_values(axes, mesh, np.zeros(len(mesh.x)), ListedColormap(["#dfe9f3"]), 0.0, 0.0)
    _draw_sides(axes, pieces, moved, width / extent[0])
    draw_outline(axes, moved, results, color=BLUE, linewidth=1.0, zorder=2.5)
    draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)
    draw_foundation(axes, results, limits.factor)
    _draw_fall(axes, results, moved)
    frame(axes, limits.box, results.units)
    text = f"deformed mesh at {results.moment}, {_amplified(results, limits)}"
    text += "" if results.unloaded else "; dashed: initial outline"
    axes.set_title(headline(results, text))
    return figure


def draw_mesh(results):
    """The undeformed mesh."""
    extent = np.ptp(results.nodes, axis=0)
    width, height = map_size(extent, wide(7.2))
    figure, axes = plt.subplots(figsize=(width, height + 0.4))
    _draw_sides(axes, results.pieces, results.nodes, width / extent[0])
    draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9)
    frame(axes, results.nodes, results.units)
    axes.set_title(headline(results, f"mesh: {len(results.pieces.elements)} triangles"))
    return figure


def _draw_sides(axes, pieces, points, scale):
    """Draws the sides of all elements as one line with breaks. Its width follows the mean edge, so that it does not fill
    a fine mesh; a metre is `scale` inches long."""
    sides = np.pad(pieces.along(pieces.sides(), points), ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    edge = 72 * scale * np.sqrt(np.ptp(points, axis=0).prod() / len(pieces.elements))
    axes.plot(*sides.reshape(-1, 2).T, color=BLUE, linewidth=min(0.6, 0.06 * edge), zorder=2)


def _draw_fall(axes, results, moved):
    """Arrows of the motion that nothing supports any more, at nodes along the boundary."""
    outline = np.vstack(results.outline(moved))
    outline = outline[::max(1, len(outline) // ARROWS)]
    velocity = results.falling(outline)
    if velocity is not None:
        axes.quiver(*outline.T, *(0.12 * results.size * velocity).T, color=RED, angles="xy",
                    scale_units="xy", scale=1.0, width=0.004, zorder=4)


def draw_stress_and_damage(results, limits, figure=None):
    """Von Mises stress beside the damage field, on the initial configuration (Figures 6 and 9).

    For an undamaged body only the stress is drawn.
    """
    extent = np.ptp(results.nodes, axis=0)
    size, shape = panels_of(extent)
    if not limits.damaged:
        width, height = map_size(extent, wide(6.9) - 0.9)
        size, shape = (width + 0.9, height + 0.5), (1, 1)
    figure, mesh = canvas(size, figure), mesh_of(results, results.nodes)
    panels = figure.subplots(*shape, squeeze=False).flat
    for axes, paint in zip(panels, (_paint_stress, _paint_damage)):
        axes.set_title(paint(axes, mesh, results, limits))
    for axes in figure.axes:
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.7)
        draw_foundation(axes, results)
        frame(axes, results.nodes, results.units)
    cause = results.singular()
    text = f"{results.part}; circle: {cause}, the stress grows as the mesh is refined" if cause else results.part
    figure.suptitle(headline(results, text))
    return figure


def draw_state(results, limits, figure=None):
    """The deformed body coloured by its damage, or by its stress where there is no damage."""
    width, height = map_size(np.ptp(limits.box, axis=0), 7.2)
    figure = canvas((width, height + 0.4), figure)
    axes = figure.add_subplot()
    moved = results.nodes + limits.factor * results.displacement
    mesh = mesh_of(results, moved)
    paint = _paint_damage if limits.damaged else _paint_stress
    shown = paint(axes, mesh, results, limits)
    draw_outline(axes, moved, results, color=INK, linewidth=0.7)
    draw_outline(axes, results.nodes, results, color=INK, linewidth=0.6, linestyle=(0, (4, 2)), zorder=0)
    draw_foundation(axes, results, limits.factor)
    frame(axes, limits.box, results.units)
    text = f"{results.part}: {shown}\n{_amplified(results, limits)}"
    axes.set_title(headline(results, text))
    return figure


def _amplified(results, limits):
    """The amplification in words."""
    largest = np.linalg.norm(results.displacement, axis=1).max()
    largest = results.barred("displacement_max", largest) or three_digits(largest)
    if results.unloaded:
        return "unloaded"
    what = "displacements and gaps" if len(results.contact) else "displacements"
    scale = "to scale" if limits.factor == 1.0 else f"× {limits.factor:g}"
    return f"{what} {scale} (largest {largest} {results.units['length']})"


def _paint_stress(axes, mesh, results, limits):
    """Draws the von Mises stress with a colour bar; returns the text for the title."""
    factor, unit, _ = draw_stress(axes, mesh, results, results.von_mises, "von Mises stress", limits.stress)
    largest = results.von_mises.max()
    text = f"von Mises stress, largest {three_digits(largest / factor)} {unit}"
    if not results.singular() or not largest:
        return text
    at = results.nodes[results.von_mises.argmax()]
    axes.plot(*at, marker="o", markersize=9, fillstyle="none", color=RED, zorder=5)
    return f"{text}: singular (circle)"


def _paint_damage(axes, mesh, results, limits):
    """Draws ζ with a colour bar; returns the text for the title."""
    shown, label, colours, (low, high) = damage_scale(*limits.zeta)
    image = draw_values(axes, mesh, results.pieces.at_points(shown(results.zeta)), colours, low, high)
    draw_colourbar(axes, image, label, flat=is_flat(results))
    least = results.zeta.min()
    return rf"damage, least $\zeta$ = {results.barred('zeta_min', least) or least_zeta(least)}"
