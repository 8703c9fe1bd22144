"""Pictures of the whole body: its deformed mesh, stress and damage."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.tri import Triangulation

from drawing import (
    BLUE, INK, OPTIONS, RED, Map, draw_body, draw_colourbar, draw_foundation, draw_maps, draw_outline, draw_stress,
    draw_values, headline, least_zeta, mesh_of, power_of, stress_colours, times_power,
)
from principal import principal_maps
from setting import ARROW, draw_loads

# About so many arrows along the boundary.
ARROWS = 30


def draw_deformed(results, limits, figure=None):
    """The deformed mesh over the initial outline and the foundation (paper, Figures 5 and 8)."""
    caption = headline(results, f"deformed mesh at {results.moment}")
    return draw_maps([deformed_map(results, limits)], caption, results.units, figure)


def draw_mesh(results, figure=None):
    """The undeformed mesh."""
    def paint(axes):
        _draw_sides(axes, results.pieces, results.nodes)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9)

    caption = headline(results, f"mesh: {len(results.pieces.elements)} triangles")
    return draw_maps([Map("", results.box, paint, has_bar=False)], caption, results.units, figure)


def draw_stress_and_damage(results, limits, figure=None):
    """Von Mises stress beside the damage field (Figures 6 and 9); for an undamaged body only the stress."""
    maps = [von_mises_map(results, limits)] + [damage_map(results, limits)] * limits.is_damaged
    return draw_maps(maps, headline(results, _with_circle(results, results.part)), results.units, figure)


def draw_times(chosen, limits, figure=None):
    """The damage, or the stress without damage, at several times, a map each, in common colours."""
    coloured = damage_map if limits.is_damaged else von_mises_map
    maps = [coloured(results, limits) for results in chosen]
    for of, results in zip(maps, chosen):
        of.title = f"{results.moment}: {of.title}"
    return draw_maps(maps, headline(chosen[-1], f"{len(maps)} states"), chosen[-1].units, figure)


def draw_everything(results, limits, figure=None):
    """The maps of all other pictures in one."""
    maps = [deformed_map(results, limits), von_mises_map(results, limits), *(principal_maps(results) or ())]
    maps[2:2] = [damage_map(results, limits)] * limits.is_damaged
    return draw_maps(maps, headline(results, _with_circle(results, f"maps at {results.part}")), results.units, figure)


def draw_state(results, limits, figure=None):
    """The deformed body under its loads, coloured by its damage, or by its stress where there is no damage."""
    coloured = (damage_map if limits.is_damaged else von_mises_map)(results, limits, limits.factor)

    def paint(axes):
        coloured.paint(axes)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.6, linestyle=(0, (4, 2)), zorder=0)
        draw_loads(axes, results, limits.load, limits.factor)

    # Pressing loads are outside the body.
    beyond = ARROW * results.size * (limits.load > 0.0) * np.array([[-1.0], [1.0]])
    amplified = _amplified(results, limits)
    caption = headline(results, f"{results.part}, {amplified}")
    title = coloured.title if OPTIONS.titles else f"{coloured.title}; {amplified}"
    return draw_maps([Map(title, limits.box + beyond, paint)], caption, results.units, figure)


def deformed_map(results, limits):
    """The deformed mesh, the initial outline and the foundation; see `Results.foundation`."""
    moved = results.places(limits.factor)
    fall = _fall(results, moved)
    tips = np.vstack([limits.box, *(points + arrows for points, arrows in fall)])

    def paint(axes):
        mesh = Triangulation(*results.pieces.at_points(moved).T, results.pieces.triangles)
        draw_values(axes, mesh, np.zeros(len(mesh.x)), ListedColormap(["#dfe9f3"]), 0.0, 0.0)
        _draw_sides(axes, results.pieces, moved)
        draw_outline(axes, moved, results, color=BLUE, linewidth=1.0, zorder=2.5)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3)
        draw_foundation(axes, results, limits.factor)
        for points, arrows in fall:
            axes.quiver(*points.T, *arrows.T, color=RED, angles="xy", scale_units="xy", scale=1.0, width=0.004, zorder=4)

    return Map(_amplified(results, limits), np.array([tips.min(axis=0), tips.max(axis=0)]), paint, has_bar=False)


def von_mises_map(results, limits, factor=None):
    """The von Mises stress of the body, deformed by `factor`, or as `Results.factor` says."""
    *_, size, unit = stress_colours(results, limits.stress)
    title, largest, is_singular = f"von Mises stress ({unit})", results.von_mises[results.seen].max(), bool(results.singular())
    if OPTIONS.titles:
        said = results.said("von_mises_max", largest, size)
        title += f", largest {said}" + ": singular (circle)" * bool(is_singular and largest > 0.0)
    elif is_singular and largest > 0.0:
        title += "; circle: singular"
    factor = results.factor if factor is None else factor

    def paint(axes):
        at = results.places(factor)
        draw_stress(axes, mesh_of(results, at), results, results.von_mises, limits.stress)
        draw_body(axes, results, factor)
        if is_singular and largest:
            axes.plot(*at[results.von_mises.argmax()], marker="o", markersize=9, fillstyle="none", color=RED, zorder=5)

    return Map(title, results.box, paint)


def damage_map(results, limits, factor=None):
    """The damage 1 − ζ from 0, sound, to the largest of the states; see `von_mises_map`."""
    power = power_of(limits.damage)
    title = f"damage 1 − ζ{times_power(power)}"
    if OPTIONS.titles:
        title += f", least ζ {results.said('zeta_min', results.zeta[results.seen].min(), written=least_zeta)}"
    factor = results.factor if factor is None else factor

    def paint(axes):
        damage, mesh = (1.0 - results.pieces.at_points(results.zeta)) / 10.0**power, mesh_of(results, results.places(factor))
        draw_colourbar(axes, draw_values(axes, mesh, damage, "magma", 0.0, limits.damage / 10.0**power))
        draw_body(axes, results, factor)

    return Map(title, results.box, paint)


def _with_circle(results, text):
    cause = results.singular()
    return f"{text}; circle: singular at {cause}" if cause else text


def _draw_sides(axes, pieces, points):
    """Draws the sides of all elements as one line with breaks. Its width follows the mean edge, so that it does not fill
    a fine mesh."""
    sides = np.pad(pieces.along(pieces.sides(), points), ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    across = 72 * axes.figure.get_size_inches()[0] * axes.get_position().width
    extent = np.ptp(points, axis=0)
    edge = across / extent[0] * np.sqrt(extent.prod() / len(pieces.elements))
    axes.plot(*sides.reshape(-1, 2).T, color=BLUE, linewidth=min(0.6, 0.06 * edge), zorder=2)


def _fall(results, moved):
    """Points along the boundary and arrows there of the motion that nothing supports any more; empty without one."""
    outline = np.vstack(results.outline(moved))
    outline = outline[::max(1, len(outline) // ARROWS)]
    velocity = results.falling(outline)
    return [] if velocity is None else [(outline, ARROW * results.size * velocity)]


def _amplified(results, limits):
    """The amplification in words, with titles also the largest displacement."""
    if results.unloaded:
        return "unloaded"
    largest = results.said("displacement_max", np.linalg.norm(results.displacement[results.seen], axis=1).max())
    what = "displacements and gaps" if len(results.contact) else "displacements"
    scale = "to scale" if limits.factor == 1.0 else f"× {limits.factor:g}"
    if not OPTIONS.titles:
        return f"{what} {scale}"
    return f"{what} {scale}, largest {largest} {results.units['length']}"
