"""The picture of the physical setting: boundaries by name, loads and supports (paper, Figures 1, 2,
4 and 7)."""

import textwrap
from dataclasses import replace

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke, withTickedStroke
from matplotlib.tri import Triangulation

from drawing import (
    BLUE, FAINT, GREEN, INK, RED, canvas, draw_foundation, draw_outline, frame, headline, map_size, wide,
)
from expressions import evaluate
from results import paths

# Relative to the size of the body: the longest arrow, and the distances between arrows and between rollers.
ARROW, SPACING, ROLLERS = 0.12, 0.05, 0.03
# Light colours of materials.
MATERIALS = ("#edf1f5", "#f3e3c3", "#d5e8d4", "#e6d5ec", "#f7d4cd", "#cfe3f2")
# The distance of names from their boundaries, inches.
AWAY = 0.13


def draw_setting(results, _limits, figure=None):
    """The body with its boundaries named, tractions as arrows, supports, and the foundation.

    Clamps are hatched. Rollers mark boundaries with one prescribed component, and axes of symmetry. The legend
    lists the conditions with the values of the scene. None if the folder lacks the scene.
    """
    conditions = {b["name"]: b for b in results.scene.get("boundary", [])}
    boundaries = results.summary.get("boundaries")
    if not conditions or not boundaries:
        return None
    curves = [(name, np.array(path)) for name, edges in boundaries.items()
              for path in paths([tuple(map(tuple, edge)) for edge in edges])]
    width, height = map_size(np.ptp(results.nodes, axis=0), wide(6.4))
    figure = canvas((width, height + 0.7 + 0.2 * len(conditions)), figure)
    axes = figure.add_subplot()
    # The body is on the left of its outlines, so the outlines of holes cut them out.
    outlines = Path.make_compound_path(*map(Path, results.outline(results.nodes)))
    if results.materials is None:
        axes.add_patch(PathPatch(outlines, facecolor="#edf1f5", edgecolor="none", zorder=0.5))
    else:
        _draw_materials(axes, results)
    draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9, zorder=2)
    draw_foundation(axes, results)

    size, units = results.size, results.units
    time, forces = _loads(results, conditions, curves)
    largest = max([np.linalg.norm(force, axis=-1).max() for force in forces], default=0.0)
    places = [results.nodes]
    for (name, line), force in zip(curves, forces):
        condition = conditions.get(name, {})
        outer = _draw_support(axes, line, condition, size)
        tails = _draw_traction(axes, line, force * ARROW * size / (largest or 1.0), size)
        beyond = np.vstack([outer, tails, *_opposite(results, line)])
        places += [tails, _write_name(axes, line, name, condition, beyond, size / (width - 1.0))]
    body_force = _draw_body_force(axes, results, time)
    for probe in results.scene.get("probe", []):
        axes.plot(*probe["point"], marker="+", color=INK, zorder=4)
        axes.annotate(probe["name"], probe["point"], xytext=(4, 4), textcoords="offset points", fontsize="small",
                      path_effects=[withStroke(linewidth=2.5, foreground="white")], zorder=4.5)
    frame(axes, np.vstack(places), units)
    for name, condition in conditions.items():
        words = _words(name, condition, units)
        axes.plot([], [], color=_colour(condition), linewidth=4, label=words)
    if body_force:
        axes.plot([], [], color=GREEN, linewidth=4, label=body_force)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.55 / height), fontsize="small", handlelength=1)
    loads = f"; loads at {replace(results, time=time).moment}" if largest or body_force else ""
    axes.set_title(headline(results, f"setting{loads}"))
    return figure


def _loads(results, conditions, curves):
    """A time with loads (the shown time if it has any), and the tractions at this time: (n, 2) at the samples of each
    curve, N/m²."""
    folder = results.folder

    def at(time):
        forces = []
        for name, line in curves:
            points, normals = _samples(line, SPACING * results.size)
            condition = conditions.get(name, {})
            force = _vectors(condition.get("traction", [0, 0]), points, time, folder)
            # A pressure p is the traction −p ν.
            pressure = evaluate(condition.get("pressure", 0), points, time, folder)
            forces.append(force - pressure[:, None] * normals)
        return forces

    def largest(forces):
        return max(np.abs(force).max() for force in forces)

    forces = at(results.time)
    if largest(forces) > 0.0:
        return results.time, forces
    times = [time for time, _ in results.frames]
    time = max(times, key=lambda time: largest(at(time)))
    return time, at(time)


def _vectors(expressions, points, time, folder):
    """The values of two expressions at points, (n, 2)."""
    return np.column_stack([evaluate(text, points, time, folder) for text in expressions])


def _samples(line, spacing):
    """Points along a line at a distance of about `spacing`, including its ends, and the outward normals there."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    s = np.concatenate(([0.0], np.cumsum(steps)))
    at = np.linspace(0.0, s[-1], max(3, 1 + round(s[-1] / spacing)))
    points = np.column_stack([np.interp(at, s, line[:, k]) for k in (0, 1)])
    edge = np.clip(np.searchsorted(s, at) - 1, 0, len(steps) - 1)
    dx, dy = (np.diff(line, axis=0)[edge] / steps[edge, None]).T
    return points, np.column_stack((dy, -dx))


def _draw_support(axes, line, condition, size):
    """Draws the hatching of a clamp, or rollers; returns the outer line of the drawing."""
    prescribed = condition.get("displacement", ["free", "free"])
    free = [component == "free" for component in prescribed]
    if not any(free):
        strokes = withTickedStroke(spacing=6, angle=-135, linewidth=0.9, foreground=BLUE)
        axes.plot(*line.T, color=BLUE, linewidth=0.9, path_effects=[strokes], zorder=1.5)
        axes.plot(*line.T, color=BLUE, linewidth=2.0, zorder=2.5, solid_capstyle="butt")
    elif condition.get("symmetry") or not all(free):
        points, normals = _samples(line, ROLLERS * size)
        radius = 0.35 * ROLLERS * size
        for point in points + radius * normals:
            axes.add_patch(Circle(point, radius, facecolor="white", edgecolor=BLUE, linewidth=0.9, zorder=1.8))
        outer = points + 2.2 * radius * normals
        axes.plot(*outer.T, color=BLUE, linewidth=1.2, zorder=1.8)
        return outer
    return line


def _draw_traction(axes, line, arrows, size):
    """Draws arrows of these lengths, m, towards the boundary for pressing loads and away from it for pulling loads.
    Returns their ends off the boundary."""
    points, normals = _samples(line, SPACING * size)
    presses = (arrows * normals).sum(axis=1) <= 0.0
    off = points + np.where(presses[:, None], -arrows, arrows)
    length = np.linalg.norm(arrows, axis=1)
    if not length.any():
        return points
    for chosen, pivot in ((presses, "tip"), (~presses, "tail")):
        shown = chosen & (length > 0.05 * ARROW * size)
        axes.quiver(*points[shown].T, *arrows[shown].T, color=RED, angles="xy", scale_units="xy",
                    scale=1.0, pivot=pivot, width=0.0035, zorder=4)
    axes.plot(*off.T, color=RED, linewidth=0.8, zorder=3.9)
    return off


def _draw_materials(axes, results):
    """Colours the triangles by material, with a legend."""
    names = results.material_names
    mesh = Triangulation(*results.nodes.T, results.pieces.elements[:, :3])
    colours = ListedColormap([MATERIALS[k % len(MATERIALS)] for k in range(len(names))])
    axes.tripcolor(mesh, facecolors=results.materials.astype(float), cmap=colours, vmin=-0.5,
                   vmax=len(names) - 0.5, zorder=0.5, rasterized=True)
    for number in np.unique(results.materials):
        name = names[number]
        axes.plot([], [], color=colours(int(number)), linewidth=8, label=f"{name}: {results.elasticity(name)}")


def _draw_body_force(axes, results, time):
    """Draws an arrow in the middle of the body; returns the force or the gravity as written in the scene, if any."""
    body = results.scene.get("body", {})
    kind = "gravity" if "gravity" in body else "force"
    force = body.get(kind)
    middle = results.nodes.mean(axis=0, keepdims=True)
    arrow = _vectors(force, middle, time, results.folder) if force else np.zeros((1, 2))
    if arrow.any():
        arrow *= ARROW * results.size / np.linalg.norm(arrow)
        axes.quiver(*middle.T, *arrow.T, color=GREEN, angles="xy", scale_units="xy", scale=1.0,
                    pivot="middle", width=0.006, zorder=4)
    unit = f"{results.units['length']}/s²" if kind == "gravity" else results.units["volume"]
    return f"{'gravity' if kind == 'gravity' else 'body force'}: {_pair(force)} {unit}" if force else None


def _opposite(results, line):
    """The points of the obstacle opposite a part of the boundary."""
    ends = set(map(tuple, line.tolist()))
    pairs = zip(results.contact.reshape(-1, 2).tolist(), results.obstacle.reshape(-1, 2))
    return [opposite for end, opposite in pairs if tuple(end) in ends]


def _write_name(axes, line, name, condition, others, inch):
    """Writes the name of a boundary beside its middle, outside its arrows and the obstacle. Returns the corners of a
    box around the name. An inch of the picture is `inch` metres."""
    points, normals = _samples(line, spacing=np.inf)
    x, y = normal = normals[1]
    beyond = max(0.0, ((others - points[1]) @ normal).max())
    place = points[1] + (beyond + AWAY * inch) * normal
    across = "center" if abs(x) < 0.4 else "left" if x > 0.0 else "right"
    upright = "center" if abs(y) < 0.4 else "bottom" if y > 0.0 else "top"
    axes.text(*place, name, color=_colour(condition), ha=across, va=upright, zorder=5, parse_math=False)
    # A letter is about 0.09 inches wide.
    return np.array([place, place + (0.09 * len(name) * inch * np.sign(x) * (abs(x) >= 0.4), 0.0)])


def _colour(condition):
    """The colour of a boundary: supports blue, the foundation dark, loads red, free parts grey."""
    kinds = (("displacement", BLUE), ("symmetry", BLUE), ("gap", INK), ("traction", RED), ("pressure", RED))
    return next((colour for kind, colour in kinds if kind in condition), FAINT)


def _words(name, condition, units):
    """The conditions on a boundary, in words."""
    length, area = units["length"], units["area"]
    words = {
        "displacement": lambda u: f"u = {_pair(u)} {length}",
        "symmetry": lambda _: "u·ν = 0",
        "gap": lambda gap: f"gap g = {gap} {length}",
        "normal": lambda normal: f"along ν = {_pair(normal)}",
        "traction": lambda force: f"traction {_pair(force)} {area}",
        "pressure": lambda pressure: f"pressure {pressure} {area}",
    }
    parts = [say(condition[key]) for key, say in words.items() if condition.get(key, False) is not False]
    return textwrap.fill(f"{name}: {', '.join(parts)}".replace("$", r"\$"), int(14 * wide(6.4)))


def _pair(components):
    return f"({', '.join(map(str, components))})"
