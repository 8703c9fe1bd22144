"""Pictures of Γ_C: pressure and gap along it, and the pressure in time."""

import numpy as np

from drawing import (
    AROUND_PLOTS, BAR, BLUE, FAINT, LINE, NARROWEST, OPTIONS, RED, along, canvas, colours, draw_colourbar, em, headline, legend,
    power_of, room_for_legend, stress_unit, times_power, wide, wrapped,
)

# The least width of a panel, in the size of letters; panels of many boundaries stand in several rows.
LEAST = 7.5
# The end of an axis over the largest value that it shows.
TOP = 1.08


def draw_pressure(results, limits, figure=None):
    """Pressure and gap along each part of each contact boundary; nodes in contact are filled."""
    curves = results.curves
    if not curves:
        return None
    left, right, top, bottom = (em() * of for of in AROUND_PLOTS)
    right *= 1.0 if len(curves) == 1 else 1.6
    width = wide(max(7.2, min(3.8 * len(curves), 14.0)))
    count = min(len(curves), max(1, int((width - left) / (LEAST * em() + right))))
    lines = -(-len(curves) // count)
    panel = (width - left - count * right) / count
    # Pictures of one row are as high as other plots.
    high = max(min(3.0, 0.42 * width, OPTIONS.height) if lines == 1 else 0.0, 10.0 * em())
    pressure, gap = 0.7 * high, 0.3 * high
    columns = [(left, panel, right)] + [(0.0, panel, right)] * (count - 1)
    labels = [wrapped(along(curve.points, results.units)[1], panel + 0.5 * right) for curve in curves]
    rows = [(top, pressure, 1.8 * em()), (0.0, gap, bottom + LINE * em() * (max(map(len, labels)) - 1))] * lines
    # A row of titles, and one without.
    names = [name for k in range(lines) for name in (_names(curves)[k * count:(k + 1) * count] + [""] * count)]
    factor, unit = stress_unit(limits.pressure, results.units)
    figure, axes = canvas(columns, rows, headline(results, _contact(results, limits, factor, unit)),
                          names if OPTIONS.titles else (), figure=figure)
    power = power_of(limits.gap)
    bars = [results.is_last and results.peak_of(curve).get("bar") or 0.0 for curve in curves]
    highest = (limits.pressure + max(bars)) / factor
    for k, (curve, bar) in enumerate(zip(curves, bars)):
        above, below = (axes[(2 * (k // count) + part) * count + k % count] for part in (0, 1))
        _draw_curve(above, below, curve, factor, 10.0**power, panel, bar / factor, highest)
        below.set_xlabel("\n".join(labels[k]))
        above.tick_params(labelbottom=False, labelleft=k % count == 0)
        below.tick_params(labelleft=k % count == 0)
        _scale(above, highest)
        _scale(below, limits.gap / 10.0**power)
        if k % count == 0:
            above.set_ylabel(f"pressure ({unit})")
            below.set_ylabel(f"gap{times_power(power, results.units['length'])}")
    if not OPTIONS.titles and results.active:
        for face, words in ((BLUE, "in contact"), ("white", "open")):
            axes[0].scatter([], [], s=20, facecolor=face, edgecolor=BLUE, linewidth=0.8, label=words)
        axes[0].legend(loc="best", fontsize="small", handletextpad=0.2)
    for k in range(len(curves), lines * count):
        for part in (0, 1):
            axes[(2 * (k // count) + part) * count + k % count].remove()
    return figure


def draw_pressures(runs, names, figure=None):
    """The pressures of several runs along each part of each contact boundary, a panel each. None without contact boundaries."""
    panels = {}
    for k, results in enumerate(runs):
        for title, curve in zip(_names(results.curves), results.curves):
            panels.setdefault(title, []).append((k, curve))
    if not panels:
        return None
    left, right, top, bottom = (em() * of for of in AROUND_PLOTS)
    below, colour = room_for_legend(names, always=True), colours(len(runs))
    high = max(min(0.6 * wide(NARROWEST) - top - bottom, 8.0 / len(panels)), 1.0)
    factor, unit = stress_unit(max(curve.pressure.max() for of in panels.values() for _, curve in of), runs[0].units)
    moments = dict.fromkeys(results.moment for results in runs)
    caption = f"contact pressure{f' at {runs[0].moment}' * (len(moments) == 1)}"
    figure, rows = canvas([(left, wide(NARROWEST) - left - right, right)], [(top, high, bottom)] * len(panels), caption,
                          list(panels) if OPTIONS.titles or len(panels) > 1 else (), below, figure)
    for axes, curves in zip(rows, panels.values()):
        for k, curve in curves:
            axes.plot(along(curve.points, {"length": ""})[0], curve.pressure / factor, color=colour[k], linewidth=1.4)
        axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=1)
        ways = list(dict.fromkeys(along(curve.points, runs[0].units)[1] for _, curve in curves))
        axes.set_xlabel(ways[0] if len(ways) == 1 else f"along {curves[0][1].name} ({runs[0].units['length']})")
        axes.set_ylabel(f"pressure ({unit})")
    for name, of in zip(names, colour):
        rows[-1].plot([], [], color=of, label=name)
    legend(rows[-1], below)
    return figure


def _contact(results, limits, factor, unit):
    """The caption: the number of nodes in contact, a pressure that is not shown, and the bars."""
    if results.unloaded:
        return f"contact at {results.moment}, unloaded"
    if results.active is None:
        return f"contact at {results.moment}"
    nodes = results.summary.get("contact_nodes", "?")
    text = f"{results.moment}: {results.active} of {nodes} nodes in contact (filled)"
    largest = results.pressure.max()
    if largest > limits.pressure > 0.0:
        is_singular = any(results.peak_of(curve).get("singular") for curve in results.curves)
        text += "; ▲: clipped, " + "singular, " * is_singular + (
            f"up to {results.said('pressure_max', largest, factor)} {unit}" + " on this mesh" * is_singular)
    if results.is_last and any(results.peak_of(curve).get("bar") for curve in results.curves):
        text += "; band: bar of the largest pressure"
    return text


def _draw_curve(above, below, curve, stress, length, width, bar, top):
    """Pressure and gap, in these units, along a part of a boundary, in panels of this width, inches; with a band for the bar
    of pressures, and marks of pressures above the top."""
    s, _ = along(curve.points, {"length": ""})
    pressure, gap = curve.pressure / stress, curve.gap / length
    active = curve.active & (pressure > 0.0)
    # Markers are smaller if there are many nodes.
    size = np.clip(27.0 * width / len(curve.points), 1.5, 5.0)
    for axes, values in ((above, pressure), (below, gap)):
        axes.plot(s, values, color=BLUE, linewidth=1.2, zorder=2)
        for nodes, face in ((active, BLUE), (~active, "white")):
            axes.scatter(s[nodes], values[nodes], s=size**2, facecolor=face, edgecolor=BLUE, linewidth=0.8, zorder=3)
        axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=1)
        for corner in s[_corners(curve.points)]:
            axes.axvline(corner, color=FAINT, linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
        axes.margins(x=0.03)
        axes.locator_params("x", nbins=int(np.clip(width / (5.0 * em()), 1, 6)))
    above.fill_between(s, 0.0, pressure, color=BLUE, alpha=0.12, linewidth=0)
    if bar:
        above.fill_between(s, np.maximum(pressure - bar, 0.0), pressure + bar, where=active, color=BLUE, alpha=0.25, linewidth=0)
    clipped = np.flatnonzero(pressure > TOP * top) if top > 0.0 else []
    # One mark for neighbours.
    for group in np.split(clipped, np.flatnonzero(np.diff(clipped) > 1) + 1) if len(clipped) else ():
        above.plot(s[group[pressure[group].argmax()]], TOP * top, marker="^", color=RED, markersize=6, clip_on=False, zorder=4)


def _corners(points):
    """The nodes at corners, which are two rows each: dotted lines mark them."""
    return np.flatnonzero((np.diff(points, axis=0) == 0.0).all(axis=1))


def _names(curves):
    """The name of each curve's boundary, numbered where the boundary has several parts."""
    names = [curve.name for curve in curves]
    return [name if names.count(name) == 1 else f"{name} ({names[:k + 1].count(name)} of {names.count(name)})"
            for k, name in enumerate(names)]


def _scale(axes, largest):
    """Scales the axis from 0 to the largest value; the axis of a zero field has the tick 0 only."""
    if largest > 0.0:
        axes.set_ylim((1.0 - TOP) * largest, TOP * largest)
        axes.locator_params("y", nbins=int(np.clip(axes.get_position().height * axes.figure.get_size_inches()[1]
                                                   / (2.5 * em()), 1, 6)))
    else:
        axes.set_ylim(-1.0, 1.0)
        axes.set_yticks([0.0])


def draw_evolution(states, limits):
    """The pressure along each part of each contact boundary (upwards) in time (to the right); white: open."""
    first, last = states[0], states[-1]
    curves = first.curves
    if not curves or len(states) < 3:
        return None
    left, _, top, bottom = (em() * of for of in AROUND_PLOTS)
    column = (left, wide(7.2) - left - BAR * em(), BAR * em())
    high = min(2.8 * len(curves), 8.0) / len(curves) - top - bottom
    factor, unit = stress_unit(limits.pressure, first.units)
    text = f"contact pressure ({unit}) in {len(states)} frames; white: open"
    figure, rows = canvas([column], [(top, max(high, 1.0), bottom)] * len(curves), headline(last, text),
                          _names(curves) if OPTIONS.titles else [f"contact pressure ({unit}); white: open"])
    times = np.array([state.time for state in states])
    for k, (curve, axes) in enumerate(zip(curves, rows)):
        s, label = along(curve.points, first.units)
        pressure = np.array([state.curves[k].pressure for state in states]).T / factor
        shown = np.ma.masked_where(pressure <= 0.0, pressure)
        image = axes.pcolormesh(_between(times), _between(s), shown, cmap="viridis", vmin=0.0,
                                vmax=limits.pressure / factor or 1.0, rasterized=True)
        draw_colourbar(axes, image)
        axes.set(ylabel=label, xlabel=f"time t ({first.units['time']})")
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
    return figure


def _between(values):
    """Bounds of cells around monotone values, halfway between neighbours."""
    return np.concatenate((values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]))
