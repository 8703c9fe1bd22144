"""The picture of the physical setting: boundaries by name, loads and supports (paper, Figures 1, 2,
4 and 7)."""

from dataclasses import replace

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.tri import Triangulation

from bars import plain
from drawing import (
    BLUE, FAINT, GREEN, INK, LINE, RED, Map, Strokes, draw_foundation, draw_maps, draw_outline, em, headline, inch_of, legend,
    room_for_legend, wide, width_of, wrapped,
)
from expressions import evaluate
from reading import states
from results import paths

# Relative to the size of the body: the longest arrow, and the distances between arrows and between rollers.
ARROW, SPACING, ROLLERS = 0.12, 0.05, 0.03
# Obstacles at a larger distance from the body are cut off, relative to its size.
FAR = 0.25
# Light colours of materials.
MATERIALS = ("#edf1f5", "#f3e3c3", "#d5e8d4", "#e6d5ec", "#f7d4cd", "#cfe3f2")
# The distance of names from their boundaries, inches; how many places of a name are tried, and how often all names are placed.
AWAY, TRIED, MOST = 0.13, 10, 12
# The largest width of a line of a name, over that of the picture, and how much smaller names may make the body.
WIDEST, SMALLEST = 0.28, 4.0


def draw_setting(results, _limits, figure=None):
    """The body with its boundaries named, tractions as arrows, supports, and the foundation at the start.

    Clamps are hatched. Rollers mark boundaries with one prescribed component, and axes of symmetry. The legend
    lists the conditions with the values of the scene. None if the folder lacks the scene.
    """
    conditions, curves = _conditions(results), curves_of(results)
    if not conditions or not curves:
        return None
    start = states(results, results.frames[:1])[0]
    time, tractions = _loads(results, curves)
    largest = max([np.linalg.norm(force, axis=-1).max() for force in tractions], default=0.0)
    size, units = results.size, results.units
    arrows = [force * ARROW * size / (largest or 1.0) for force in tractions]
    outer = [np.vstack([_outside(line, conditions.get(name, {}), size), _tails(line, force, size)[0],
                        near(_opposite(start, line), results.nodes)]) for (name, line), force in zip(curves, arrows)]
    entries, probes = _entries(results), results.scene.get("probe", [])
    below = room_for_legend([words for _, words in entries], always=True)
    points = np.vstack([results.nodes, *outer])
    drawn = np.vstack([points[:0], *outer, *(_samples(line, SPACING * size)[0] for _, line in curves)])
    first = inch = inch_of(np.array([points.min(axis=0), points.max(axis=0)]), below)
    # The length of an inch of the picture, m, follows from its box, and the box from the names. These have shorter lines if
    # little would be left for the body.
    for number in range(MOST):
        widest = WIDEST / (1 + 2 * number // MOST)
        names, taken = [], []
        for name, line, beyond in [*((name, line, beyond) for (name, line), beyond in zip(curves, outer)),
                                   *((of["name"], np.array(of["point"]), None) for of in probes)]:
            name = _lines(name, widest)
            at = _beside(line, name, inch) if beyond is None else _outwards(line, name, beyond, inch)
            # The first of the best places.
            names.append((name, *min(at, key=lambda place: _covers(place[-1], taken, drawn))))
            taken.append(names[-1][-1])
        points = np.vstack([results.nodes, *outer, *taken])
        before, inch = inch, min(inch_of(np.array([points.min(axis=0), points.max(axis=0)]), below), SMALLEST * first)
        if abs(inch - before) < 1e-3 * inch < 0.99e-3 * SMALLEST * first:
            break

    def paint(axes):
        # The body is on the left of its outlines, so the outlines of holes cut them out.
        outlines = Path.make_compound_path(*map(Path, results.outline(results.nodes)))
        if results.materials is None:
            axes.add_patch(PathPatch(outlines, facecolor="#edf1f5", edgecolor="none", zorder=0.5))
        else:
            _draw_materials(axes, results)
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.9, zorder=2)
        draw_foundation(axes, start)
        for (name, line), force, (lines, place, style, _) in zip(curves, arrows, names):
            condition = conditions.get(name, {})
            _draw_support(axes, line, condition, size)
            _draw_traction(axes, line, force, size)
            axes.text(*place, lines, color=_colour(condition), zorder=5, **style)
        for probe, (lines, place, style, _) in zip(probes, names[len(curves):]):
            axes.plot(*probe["point"], marker="+", color=INK, zorder=4)
            axes.text(*place, lines, fontsize="small", zorder=4.5,
                      path_effects=[withStroke(linewidth=2.5, foreground="white")], **style)
        _draw_body_force(axes, results, time)
        for colour, words in entries:
            axes.plot([], [], color=colour, linewidth=4, label=words)
        legend(axes, below, handlelength=1)

    loads = f"; loads at {replace(results, time=time).moment}" if largest or "body" in results.scene else ""
    box = np.array([points.min(axis=0), points.max(axis=0)])
    return draw_maps([Map("", box, paint, has_bar=False, is_field=False)], headline(results, f"setting{loads}"), units, figure, below)


def _entries(results):
    """Colours and words of the legend; boundaries with the same conditions have one entry."""
    alike = {}
    for name, of in _conditions(results).items():
        alike.setdefault((_colour(of), _words(of, results.units)), []).append(name)
    found = [(colour, "\n".join(wrapped(f"{', '.join(names)}: {words}", wide(6.4) - 8 * em())))
             for (colour, words), names in alike.items()]
    if results.materials is not None:
        names = [(int(k), results.material_names[k]) for k in np.unique(results.materials)]
        found += [(MATERIALS[k % len(MATERIALS)], f"{results.surface(name)}: {results.elasticity(name)}")
                  for k, name in names]
    kind, force = _body_force(results)
    unit = f"{results.units['length']}/s²" if kind == "gravity" else results.units["volume"]
    return found + ([(GREEN, f"{kind}: {_pair(force)} {unit}")] if force else [])


def _conditions(results):
    """The conditions of the scene by boundary."""
    return {of["name"]: of for of in results.scene.get("boundary", [])}


def curves_of(results):
    """The connected parts of boundaries: names and polylines."""
    return [(name, np.array(path)) for name, edges in results.summary.get("boundaries", {}).items()
            for path in paths([tuple(map(tuple, edge)) for edge in edges])]


def _tractions(results, curves, time):
    """The tractions at a time: (n, 2) at the samples of each curve, N/m²."""
    conditions, forces = _conditions(results), []
    for name, line in curves:
        points, normals = _samples(line, SPACING * results.size)
        condition = conditions.get(name, {})
        force = _vectors(condition.get("traction", [0, 0]), points, time, results.folder)
        # A pressure p is the traction −p ν.
        pressure = evaluate(condition.get("pressure", 0), points, time, results.folder)
        forces.append(force - pressure[:, None] * normals)
    return forces


def _largest(forces):
    return max((np.linalg.norm(force, axis=-1).max() for force in forces), default=0.0)


def _loads(results, curves):
    """A time with loads (the shown time if it has any), and the tractions at this time."""
    forces = _tractions(results, curves, results.time)
    if _largest(forces) > 0.0:
        return results.time, forces
    times = [time for time, _ in results.frames]
    time = max(times, key=lambda time: _largest(_tractions(results, curves, time)))
    return time, _tractions(results, curves, time)


def largest_load(results):
    """The largest traction of a state, N/m²."""
    return _largest(_tractions(results, curves_of(results), results.time))


def draw_loads(axes, results, largest, factor):
    """The tractions of a state on the deformed body, as arrows; `largest` has the longest."""
    curves = curves_of(results) if largest else []
    for (_, line), force in zip(curves, _tractions(results, curves, results.time)):
        moved = line + factor * results.displacement_at(line)
        _draw_traction(axes, line, force * ARROW * results.size / largest, results.size, moved)


def loads_of(results):
    """The tractions of a state along each loaded boundary: points of the undeformed body, their displacements, the
    tractions there, (n, 2) each, and which of them press."""
    curves = curves_of(results)
    for (_, line), force in zip(curves, _tractions(results, curves, results.time)):
        if force.any():
            points, normals = _samples(line, SPACING * results.size)
            moved, _ = _samples(line, SPACING * results.size, results.displacement_at(line))
            yield points, moved, force, (force * normals).sum(axis=1) <= 0.0


def boundary_colours(results):
    """The colours of the boundaries with conditions, by name."""
    return {name: _colour(of) for name, of in _conditions(results).items()}


def _vectors(expressions, points, time, folder):
    """The values of two expressions at points, (n, 2)."""
    return np.column_stack([evaluate(text, points, time, folder) for text in expressions])


def _samples(line, spacing, moved=None):
    """Points along a line at a distance of about `spacing`, including its ends, or where the line has `moved` to, and
    the outward normals there."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    s = np.concatenate(([0.0], np.cumsum(steps)))
    at = np.linspace(0.0, s[-1], max(3, 1 + round(s[-1] / spacing)))
    points = np.column_stack([np.interp(at, s, (line if moved is None else moved)[:, k]) for k in (0, 1)])
    edge = np.clip(np.searchsorted(s, at) - 1, 0, len(steps) - 1)
    dx, dy = (np.diff(line, axis=0)[edge] / steps[edge, None]).T
    return points, np.column_stack((dy, -dx))


def _has_rollers(condition):
    """Whether a boundary has one prescribed component, or is an axis of symmetry."""
    free = [component == "free" for component in condition.get("displacement", ["free", "free"])]
    return any(free) and (condition.get("symmetry") or not all(free))


def _outside(line, condition, size):
    """The outer line of the drawing of a support."""
    if not _has_rollers(condition):
        return line
    points, normals = _samples(line, ROLLERS * size)
    return points + 2.2 * 0.35 * ROLLERS * size * normals


def _draw_support(axes, line, condition, size):
    """Draws the hatching of a clamp, or rollers."""
    if _has_rollers(condition):
        points, normals = _samples(line, ROLLERS * size)
        radius = 0.35 * ROLLERS * size
        for point in points + radius * normals:
            axes.add_patch(Circle(point, radius, facecolor="white", edgecolor=BLUE, linewidth=0.9, zorder=1.8))
        axes.plot(*_outside(line, condition, size).T, color=BLUE, linewidth=1.2, zorder=1.8)
    elif "free" not in condition.get("displacement", ["free"]):
        strokes = Strokes(spacing=6, angle=-135, linewidth=0.9, foreground=BLUE)
        axes.plot(*line.T, color=BLUE, linewidth=0.9, path_effects=[strokes], zorder=1.5)
        axes.plot(*line.T, color=BLUE, linewidth=2.0, zorder=2.5, solid_capstyle="butt")


def _tails(line, arrows, size, moved=None):
    """The ends of arrows off the boundary, the ends on it, and which of the arrows press."""
    points, normals = _samples(line, SPACING * size, moved)
    presses = (arrows * normals).sum(axis=1) <= 0.0
    return points + np.where(presses[:, None], -arrows, arrows), points, presses


def _draw_traction(axes, line, arrows, size, moved=None):
    """Draws arrows of these lengths, m, towards the boundary for pressing loads and away from it for pulling loads."""
    off, points, presses = _tails(line, arrows, size, moved)
    length = np.linalg.norm(arrows, axis=1)
    if not length.any():
        return
    for chosen, pivot in ((presses, "tip"), (~presses, "tail")):
        shown = chosen & (length > 0.05 * ARROW * size)
        axes.quiver(*points[shown].T, *arrows[shown].T, color=RED, angles="xy", scale_units="xy",
                    scale=1.0, pivot=pivot, width=0.0035, zorder=4)
    axes.plot(*off.T, color=RED, linewidth=0.8, zorder=3.9)


def _draw_materials(axes, results):
    """Colours the triangles by material."""
    count = len(results.material_names)
    mesh = Triangulation(*results.nodes.T, results.pieces.elements[:, :3])
    colours = ListedColormap([MATERIALS[k % len(MATERIALS)] for k in range(count)])
    axes.tripcolor(mesh, facecolors=results.materials.astype(float), cmap=colours, vmin=-0.5, vmax=count - 0.5,
                   zorder=0.5, rasterized=True)


def _body_force(results):
    """The kind of force in the body and its components, as the scene has them; None without it."""
    body = results.scene.get("body", {})
    return ("gravity", body["gravity"]) if "gravity" in body else ("body force", body.get("force"))


def _draw_body_force(axes, results, time):
    """Draws an arrow in the middle of the body."""
    _, force = _body_force(results)
    middle = results.nodes.mean(axis=0, keepdims=True)
    arrow = _vectors(force, middle, time, results.folder) if force else np.zeros((1, 2))
    if arrow.any():
        arrow *= ARROW * results.size / np.linalg.norm(arrow)
        axes.quiver(*middle.T, *arrow.T, color=GREEN, angles="xy", scale_units="xy", scale=1.0,
                    pivot="middle", width=0.006, zorder=4)


def _opposite(results, line):
    """The points of the obstacle opposite a part of the boundary."""
    is_end = np.isin(results.contact.reshape(-1, 2) @ (1.0, 1.0j), line @ (1.0, 1.0j))
    return results.obstacle.reshape(-1, 2)[is_end]


def near(points, body):
    """Points that are moved as near to the points of a body as pictures show."""
    low, high = body.min(axis=0), body.max(axis=0)
    return np.clip(points, low - FAR * max(high - low), high + FAR * max(high - low))


def _outwards(line, name, others, inch):
    """Places of a boundary's name beside its middle, outside its arrows and the obstacle, the nearest first: how the name is
    aligned, and the corners of its box. An inch of the picture is `inch` metres."""
    points, normals = _samples(line, spacing=np.inf)
    x, y = normal = normals[1]
    beyond = max(0.0, ((others - points[1]) @ normal).max())
    style = {"ha": "center" if abs(x) < 0.4 else "left" if x > 0.0 else "right",
             "va": "center" if abs(y) < 0.4 else "bottom" if y > 0.0 else "top"}
    return [_aligned(points[1] + (beyond + inch * (AWAY + LINE * em() * k)) * normal, style, name, inch) for k in range(TRIED)]


def _beside(point, name, inch):
    """Places of the name of a probe in the four corners beside it, the nearest first."""
    return [_aligned(point + (0.5 + k) * AWAY * inch * np.array([x, y]), {"ha": across, "va": upright}, name, inch)
            for k in range(TRIED) for y, upright in ((1, "bottom"), (-1, "top")) for x, across in ((1, "left"), (-1, "right"))]


def _lines(name, widest):
    """A name in lines, whose largest width is given over that of the picture."""
    return "\n".join(wrapped(name, widest * wide(7.2)))


def _aligned(place, style, name, inch):
    """A place of a name, its style, and the corners of its box."""
    style = {**style, "parse_math": False, "linespacing": 1.1, "multialignment": style["ha"]}
    lines = name.split("\n")
    size = np.array([max(width_of(f"{line} ") for line in lines), LINE * em() * len(lines)]) * inch
    low = place - size * ({"left": 0.0, "center": 0.5, "right": 1.0}[style["ha"]],
                          {"bottom": 0.0, "center": 0.5, "top": 1.0}[style["va"]])
    return place, style, np.array([low, low + size])


def _covers(box, taken, points):
    """How many other boxes a box covers, and how many points."""
    return (sum((box[0] < of[1]).all() and (of[0] < box[1]).all() for of in taken),
            np.count_nonzero((box[0] < points).all(axis=1) & (points < box[1]).all(axis=1)))


def _colour(condition):
    """The colour of a boundary: supports blue, the foundation dark, loads red, free parts grey."""
    kinds = (("displacement", BLUE), ("symmetry", BLUE), ("gap", INK), ("traction", RED), ("pressure", RED))
    return next((colour for kind, colour in kinds if kind in condition), FAINT)


def _words(condition, units):
    """The conditions on a boundary, in words."""
    length, area = units["length"], units["area"]
    words = {
        "displacement": lambda u: f"u = {_pair(u)} {length}",
        "symmetry": lambda _: "u·ν = 0",
        "gap": lambda gap: f"gap g = {_text(gap)} {length}",
        "normal": lambda normal: f"along ν = {_pair(normal)}",
        "traction": lambda force: f"traction {_pair(force)} {area}",
        "pressure": lambda pressure: f"pressure {_text(pressure)} {area}",
    }
    parts = [say(condition[key]) for key, say in words.items() if condition.get(key, False) is not False]
    return ", ".join(parts)


def _pair(components):
    return f"({', '.join(map(_text, components))})"


def _text(value):
    """A number of the scene, or an expression, as text."""
    return plain(value, 7) if isinstance(value, float) else str(value)
