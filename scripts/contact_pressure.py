"""Pictures of Γ_C: pressure and gap along it, and how the pressure evolves."""

import matplotlib.pyplot as plt
import numpy as np

from drawing import BLUE, FAINT, along, canvas, draw_colourbar, headline, stress_unit


def draw_pressure(results, limits, figure=None):
    """Pressure and gap along each piece of Γ_C; nodes in contact are filled."""
    pieces = results.contact_pieces()
    if not pieces:
        return None
    figure = canvas((max(7.2, min(3.8 * len(pieces), 14.0)), 4.6), figure)
    rows = figure.subplots(
        2, len(pieces), squeeze=False, sharex="col", sharey="row",
        gridspec_kw={"height_ratios": (2.2, 1)},
    )
    figure.set_constrained_layout_pads(wspace=0.08)
    factor, unit = stress_unit(limits.pressure, results.units)
    for piece, (above, below) in zip(pieces, rows.T):
        s, label = along(results.nodes[piece], results.units)
        pressure, gap = results.pressure[piece] / factor, results.gap[piece]
        active = pressure > 0.0
        # Markers shrink where nodes crowd.
        size = np.clip(180.0 / len(piece), 1.5, 5.0)
        for axes, values in ((above, pressure), (below, gap)):
            axes.plot(s, values, color=BLUE, linewidth=1.2, zorder=2)
            for nodes, face in ((active, BLUE), (~active, "white")):
                axes.scatter(s[nodes], values[nodes], s=size**2, facecolor=face, edgecolor=BLUE,
                             linewidth=0.8, zorder=3)
            axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=1)
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
        factor, unit = stress_unit(largest, results.units)
        text += f"; the pressure goes up to {largest / factor:.3g} {unit}"
    text = "unloaded" if results.unloaded else "" if results.active is None else text
    text = ", ".join(filter(None, (f"contact at {results.moment}", text)))
    figure.suptitle(headline(results, text), fontsize=11)
    return figure


def _scale(axes, largest):
    """Room from 0 to the largest value; a field that is 0 has no other tick."""
    if largest > 0.0:
        axes.set_ylim(-0.08 * largest, 1.08 * largest)
    else:
        axes.set_ylim(-1.0, 1.0)
        axes.set_yticks([0.0])


def draw_evolution(states, limits):
    """The pressure along each piece of Γ_C (upwards) in time (to the right); white: open."""
    first, last = states[0], states[-1]
    pieces = first.contact_pieces()
    if not pieces or len(states) < 3:
        return None
    figure, rows = plt.subplots(
        len(pieces), 1, figsize=(7.2, 1.2 + min(2.8 * len(pieces), 8.0)), squeeze=False, sharex=True
    )
    factor, unit = stress_unit(limits.pressure, first.units)
    times = np.array([state.time for state in states])
    for piece, axes in zip(pieces, rows[:, 0]):
        s, label = along(first.nodes[piece], first.units)
        pressure = np.array([state.pressure[piece] for state in states]).T / factor
        image = axes.pcolormesh(
            _between(times), _between(s), np.ma.masked_where(pressure <= 0.0, pressure),
            cmap="viridis_r", vmin=0.0, vmax=limits.pressure / factor or 1.0, rasterized=True,
        )
        draw_colourbar(axes, image, f"contact pressure ({unit})")
        axes.set_ylabel(label)
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
    rows[-1, 0].set_xlabel(f"time t ({first.units['time']})")
    text = f"contact pressure on $\\Gamma_C$ in {len(states)} frames; white: open"
    figure.suptitle(headline(last, text), fontsize=11)
    return figure


def _between(values):
    """Bounds of cells around increasing or decreasing values: halfway between neighbours."""
    return np.concatenate((values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]))
