#!/usr/bin/python3
"""Draws the figures of one or more runs into their result folders.

    /usr/bin/python3 scripts/figures.py out/lshape out/bridge

deformed.png        the deformed mesh over the initial outline (paper, Figures 5 and 8)
stress-damage.png   von Mises stress and damage at the final time (Figures 6 and 9)
pressure.png        contact pressure and gap along Γ_C
damage-history.png  the least and the mean ζ in time, where there is damage to see
"""

import argparse
import sys

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.ticker import ScalarFormatter
from matplotlib.tri import Triangulation

from drawing import (
    BLUE, FAINT, INK, RED, along, amplification, damage_scale, draw_colourbar, draw_foundation,
    draw_outline, frame, headline, least_zeta, map_size, unit_prefix,
)
from results import ResultError, read_results

# ζ closer to 1 than this is undamaged.
ROUNDING = 1e-12


def draw_deformed(results, factor=None):
    """The deformed mesh over the initial outline and the foundation.

    The obstacle is drawn opposite the nodes of Γ_C, which slide: it seems to slide with them.
    """
    largest = np.linalg.norm(results.displacement, axis=1).max()
    # The obstacle moves away by as much: it must keep its shape, and stay in sight.
    widest = np.linalg.norm(results.obstacle - results.contact, axis=2).max(initial=0.0)
    factor = factor or amplification(results.size, max(largest, widest))
    moved, pieces = results.nodes + factor * results.displacement, results.pieces
    both = np.vstack((results.nodes, pieces.at_points(moved)))
    extent = np.ptp(both, axis=0)
    width, height = map_size(extent, 7.2)
    figure, axes = plt.subplots(figsize=(width, height + 0.4))

    # Lines must not fill a fine mesh: their width follows the mean edge, in points.
    edge = np.sqrt(extent.prod() / len(pieces.elements)) * 72 * width / extent[0]
    mesh = Triangulation(*pieces.at_points(moved).T, pieces.triangles)
    axes.tripcolor(mesh, np.zeros(len(mesh.x)), cmap=ListedColormap(["#dfe9f3"]), zorder=1)
    # One line for all sides, with a break after each.
    sides = np.pad(pieces.along(pieces.sides(), moved), ((0, 0), (0, 1), (0, 0)),
                   constant_values=np.nan)
    axes.plot(*sides.reshape(-1, 2).T, color=BLUE, linewidth=min(0.6, 0.06 * edge), zorder=2)
    draw_outline(axes, moved, results, color=BLUE, linewidth=1.0, zorder=2.5)
    draw_outline(
        axes, results.nodes, results, color=INK, linewidth=0.9, linestyle=(0, (4, 2)), zorder=3
    )
    draw_foundation(axes, results, factor)
    frame(axes, both, results.size)
    moves = f"displacements × {factor:g} (largest {largest:.3g} m); dashed: initial outline"
    moves = "unloaded" if results.unloaded else moves
    axes.set_title(headline(results, f"deformed mesh at t = {results.time:g} s, {moves}"))
    return figure


def draw_stress_and_damage(results):
    """Von Mises stress beside the damage field, on the initial configuration.

    An undamaged body has only its stress to show.
    """
    extent = np.ptp(results.nodes, axis=0)
    damaged = np.abs(1.0 - results.zeta).max() > ROUNDING
    if not damaged:
        width, height = map_size(extent, 6.0)
        figure, left = plt.subplots(figsize=(width + 0.9, height + 0.5))
    elif extent[0] < 2.5 * extent[1]:
        width, height = map_size(extent, 5.0)
        figure, (left, right) = plt.subplots(1, 2, figsize=(2 * (width + 0.9), height + 0.5))
    else:
        width, height = map_size(extent, 8.0)
        figure, (left, right) = plt.subplots(2, 1, figsize=(width, 2 * height + 0.5))
    pieces = results.pieces
    mesh = Triangulation(*pieces.at_points(results.nodes).T, pieces.triangles)

    # Stress is singular at corners: a few triangles must not darken all the others.
    largest, top = results.von_mises.max(), np.quantile(results.von_mises, 0.995)
    cut = largest > 1.25 * top > 0.0
    factor, prefix = unit_prefix(top)
    stress = left.tripcolor(
        mesh, facecolors=pieces.of_cells(results.von_mises / factor), cmap="viridis", vmin=0.0,
        vmax=(top if cut else largest) / factor or 1.0,
    )
    draw_colourbar(left, stress, f"von Mises stress ({prefix}Pa)", "max" if cut else "neither")
    left.set_title(f"von Mises stress, largest {largest / factor:.3g} {prefix}Pa")

    if damaged:
        values, label, colours, limits = damage_scale(results.zeta)
        values = pieces.at_points(values)
        damage = right.tripcolor(mesh, values, shading="gouraud", cmap=colours, **limits)
        draw_colourbar(right, damage, label)
        right.set_title(rf"damage, least $\zeta$ = {least_zeta(results.zeta.min())}")

    for axes in figure.axes:
        draw_outline(axes, results.nodes, results, color=INK, linewidth=0.7)
        draw_foundation(axes, results)
        frame(axes, results.nodes, results.size)
    figure.suptitle(headline(results, f"t = {results.time:g} s"), fontsize=11.5)
    return figure


def draw_pressure(results):
    """Pressure and gap along each piece of Γ_C; nodes in contact are filled."""
    pieces = results.contact_pieces()
    if not pieces:
        return None
    pieces.sort(key=lambda piece: tuple(results.nodes[piece].min(axis=0)))
    figure, rows = plt.subplots(
        2, len(pieces), figsize=(max(7.2, min(3.8 * len(pieces), 14.0)), 4.6), squeeze=False,
        sharex="col", sharey="row", gridspec_kw={"height_ratios": (2.2, 1)},
    )
    figure.set_constrained_layout_pads(wspace=0.08)
    peak = np.nanmax(np.abs(results.pressure[np.isfinite(results.gap)]))
    factor, prefix = unit_prefix(peak)
    for piece, (above, below) in zip(pieces, rows.T):
        s, label = along(results.nodes[piece])
        pressure, gap = results.pressure[piece] / factor, results.gap[piece]
        active = results.pressure[piece] > 1e-9 * peak
        # Markers shrink where nodes crowd.
        size = np.clip(180.0 / len(piece), 1.5, 5.0)
        for axes, values in ((above, pressure), (below, gap)):
            axes.plot(s, values, color=BLUE, linewidth=1.2, zorder=2)
            for nodes, face in ((active, BLUE), (~active, "white")):
                axes.scatter(s[nodes], values[nodes], s=size**2, facecolor=face, edgecolor=BLUE,
                             linewidth=0.8, zorder=3)
            axes.axhline(0.0, color=FAINT, linewidth=0.7, zorder=1)
            axes.margins(x=0.03)
        if not np.abs(gap).max() > 0.0:
            below.set_ylim(-1.0, 1.0)
            below.set_yticks([0.0])
        above.fill_between(s, 0.0, pressure, color=BLUE, alpha=0.12, linewidth=0)
        below.set_xlabel(label)
    rows[0, 0].set_ylabel(f"contact pressure ({prefix}Pa)")
    rows[1, 0].set_ylabel("gap (m)")
    rows[1, 0].ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    for face, name in ((BLUE, "in contact"), ("white", "open")):
        rows[0, -1].scatter([], [], s=25, facecolor=face, edgecolor=BLUE, linewidth=0.8, label=name)
    rows[0, -1].legend(loc="best")
    active, nodes = (results.summary.get(f"{kind}_nodes", "?") for kind in ("active", "contact"))
    text = "unloaded" if results.unloaded else f"{active} of {nodes} nodes active"
    text = f"contact at t = {results.time:g} s, {text}"
    figure.suptitle(headline(results, text), fontsize=11)
    return figure


def draw_damage_history(results):
    """min ζ and mean ζ in time, and the moment ζ_* was reached."""
    time, least = results.history.get("time"), results.history.get("zeta_min")
    if time is None or least is None or len(time) < 3 or np.nanmin(least) >= 1.0 - ROUNDING:
        return None
    figure, axes = plt.subplots(figsize=(6.4, 3.8))
    axes.plot(time, results.history["zeta_mean"], color=FAINT, linewidth=1.4, label="mean ζ")
    axes.plot(time, least, color=BLUE, linewidth=1.8, label="min ζ")
    stopped = results.summary.get("stopped_at")
    if stopped is not None:
        axes.axvline(stopped, color=RED, linewidth=1.0, linestyle=(0, (4, 2)),
                     label=f"ζ$_*$ reached at t = {stopped:.4g} s")
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    plain = ScalarFormatter(useOffset=False)
    axes.yaxis.set_major_formatter(plain)
    axes.set_xlabel("time t (s)")
    axes.set_ylabel("damage field ζ")
    axes.set_title(headline(results, ""))
    axes.legend(loc="lower left")
    return figure


FIGURES = {
    "deformed.png": draw_deformed,
    "stress-damage.png": draw_stress_and_damage,
    "pressure.png": draw_pressure,
    "damage-history.png": draw_damage_history,
}


def main():
    parser = argparse.ArgumentParser(description="Draw the figures of finished runs.")
    parser.add_argument("folders", nargs="+", metavar="OUT_DIR")
    parser.add_argument("--factor", type=float, help="amplification of the deformed mesh")
    arguments = parser.parse_args()
    figures = FIGURES
    if arguments.factor:
        figures = {**FIGURES, "deformed.png": lambda r: draw_deformed(r, arguments.factor)}
    failed = False
    for folder in arguments.folders:
        try:
            results = read_results(folder)
        except ResultError as error:
            failed = True
            print(f"error: {error}", file=sys.stderr)
            continue
        for name, draw in figures.items():
            figure = draw(results)
            if figure is None:
                # One of an earlier run would be taken for this one's.
                (results.folder / name).unlink(missing_ok=True)
                continue
            figure.savefig(results.folder / name)
            plt.close(figure)
            print(results.folder / name)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
