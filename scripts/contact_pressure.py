"""Pictures of Γ_C: pressure and gap along it, and the pressure in time."""

import matplotlib.pyplot as plt
import numpy as np

from bars import three_digits
from drawing import BLUE, FAINT, along, canvas, draw_colourbar, headline, stress_unit, wide


def draw_pressure(results, limits, figure=None):
    """Pressure and gap along each part of each contact boundary; nodes in contact are filled."""
    curves = results.curves
    if not curves:
        return None
    width = wide(max(7.2, min(3.8 * len(curves), 14.0)))
    figure = canvas((width, np.clip(0.64 * width, 3.4, 4.6)), figure)
    rows = figure.subplots(2, len(curves), squeeze=False, sharex="col", sharey="row",
                           gridspec_kw={"height_ratios": (2.2, 1), "wspace": 0.08})
    factor, unit = stress_unit(limits.pressure, results.units)
    for curve, name, (above, below) in zip(curves, _names(curves), rows.T):
        s, label = along(curve.points, results.units)
        pressure, gap = curve.pressure / factor, curve.gap
        above.set_title(name, parse_math=False)
        active = curve.active & (pressure > 0.0)
        # Markers are smaller if there are many nodes.
        size = np.clip(180.0 / len(curve.points), 1.5, 5.0)
        for axes, values in ((above, pressure), (below, gap)):
            axes.plot(s, values, color=BLUE, linewidth=1.2, zorder=2)
            for nodes, face in ((active, BLUE), (~active, "white")):
                axes.scatter(s[nodes], values[nodes], s=size**2, facecolor=face, edgecolor=BLUE,
                             linewidth=0.8, zorder=3)
            axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=1)
            for corner in s[_corners(curve.points)]:
                axes.axvline(corner, color=FAINT, linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
            axes.margins(x=0.03)
        above.fill_between(s, 0.0, pressure, color=BLUE, alpha=0.12, linewidth=0)
        below.set_xlabel(label)
    _scale(rows[0, 0], limits.pressure / factor)
    _scale(rows[1, 0], limits.gap)
    rows[0, 0].set_ylabel(f"contact pressure ({unit})")
    rows[1, 0].set_ylabel(f"gap ({results.units['length']})")
    rows[1, 0].ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    for face, name in ((BLUE, "in contact"), ("white", "open")):
        rows[0, -1].scatter([], [], s=25, facecolor=face, edgecolor=BLUE, linewidth=0.8, label=name)
    rows[0, -1].legend(loc="best")
    text = f"{results.active} of {results.summary.get('contact_nodes', '?')} nodes active"
    largest = results.pressure.max()
    if largest > limits.pressure > 0.0:
        text += f"; the pressure goes up to {three_digits(largest / factor)} {unit}"
    text = "unloaded" if results.unloaded else "" if results.active is None else text
    text = ", ".join(filter(None, (f"contact at {results.moment}", text)))
    figure.suptitle(headline(results, text))
    return figure


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
        axes.set_ylim(-0.08 * largest, 1.08 * largest)
    else:
        axes.set_ylim(-1.0, 1.0)
        axes.set_yticks([0.0])


def draw_evolution(states, limits):
    """The pressure along each part of each contact boundary (upwards) in time (to the right); white: open."""
    first, last = states[0], states[-1]
    curves = first.curves
    if not curves or len(states) < 3:
        return None
    size = wide(7.2), 1.2 + min(2.8 * len(curves), 8.0)
    figure, rows = plt.subplots(len(curves), 1, figsize=size, squeeze=False, sharex=True)
    factor, unit = stress_unit(limits.pressure, first.units)
    times = np.array([state.time for state in states])
    for k, (curve, name, axes) in enumerate(zip(curves, _names(curves), rows[:, 0])):
        s, label = along(curve.points, first.units)
        pressure = np.array([state.curves[k].pressure for state in states]).T / factor
        axes.set_title(name, parse_math=False)
        shown = np.ma.masked_where(pressure <= 0.0, pressure)
        image = axes.pcolormesh(_between(times), _between(s), shown, cmap="viridis", vmin=0.0,
                                vmax=limits.pressure / factor or 1.0, rasterized=True)
        draw_colourbar(axes, image, f"contact pressure ({unit})")
        axes.set_ylabel(label)
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
    rows[-1, 0].set_xlabel(f"time t ({first.units['time']})")
    text = f"contact pressure on $\\Gamma_C$ in {len(states)} frames; white: open"
    figure.suptitle(headline(last, text))
    return figure


def _between(values):
    """Bounds of cells around monotone values, halfway between neighbours."""
    return np.concatenate((values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]))
