"""Draws the table of `signorini compare`: comparison.py FOLDER

Reads FOLDER/comparison.csv and draws FOLDER/comparison.png: the cost and the residuals of each solver on
each scene, and the residuals against the cost.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from drawing import FAINT, INK, RED
from results import read_table

COLOURS = ["#2f6db3", "#d08a1d", "#3d8f5a", "#8e5aa8", "#4fa3a5", "#a3554f"]
MARKERS = ["o", "s", "^", "D", "v", "P", "X", "<", ">", "*"]
KKT = ["kkt_stationarity", "kkt_primal", "kkt_dual", "kkt_complementarity"]


def read(path):
    """The rows of the table with the largest KKT residual added; NaN if a solver failed at its start."""
    rows = read_table(path)
    for row in rows:
        row |= {key: np.nan for key in ["seconds", "iterations", "triangular_solves", *KKT] if row[key] == ""}
        row["kkt"] = max(row[key] for key in KKT)
    return rows


def bars(axes, rows, value, title, ticks=None):
    """A group of bars per scene with a bar per solver, on a logarithmic scale. `ticks` names a second
    column, drawn as ticks on the bars."""
    scenes, solvers = names(rows, "scene"), names(rows, "solver")
    width = 0.8 / len(solvers)
    shown = [row[key] for row in rows for key in (value, ticks) if key and row[key] > 0] or [1.0]
    bottom, top = 10.0 ** np.floor(np.log10(0.8 * min(shown))), 3.0 * max(shown)
    for row in rows:
        solver = solvers.index(row["solver"])
        x = scenes.index(row["scene"]) + (solver - 0.5 * (len(solvers) - 1)) * width
        axes.bar(x, row[value], width, color=colour(solver))
        if ticks:
            axes.plot([x - 0.45 * width, x + 0.45 * width], 2 * [row[ticks]], color=INK, lw=1.8)
        if row["error"]:
            axes.text(x, 1.1 * np.fmax(row[value], bottom), "failed", color=RED, fontsize=8,
                      rotation=90, ha="center", va="bottom")
    axes.set(yscale="log", xlim=(-0.5, len(scenes) - 0.5), ylim=(bottom, top))
    axes.set_xticks(range(len(scenes)), scenes, fontsize=8.5)
    axes.tick_params(axis="x", length=0)
    axes.yaxis.grid(color=FAINT, alpha=0.35, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_title(title, loc="left")


def names(rows, key):
    """The values of a column in the order of their first appearance."""
    return list(dict.fromkeys(row[key] for row in rows))


def colour(solver):
    return COLOURS[solver % len(COLOURS)]


def draw(table):
    """The figure of the table at this path."""
    rows = read(table)
    figure, ((seconds, kkt), (work, trade)) = plt.subplots(2, 2, figsize=(12, 7.6))
    scenes, solvers = names(rows, "scene"), names(rows, "solver")
    bars(seconds, rows, "seconds", "time in the contact solver, all steps (s)")
    bars(kkt, rows, "kkt", "worst relative KKT residual of all steps")
    bars(work, rows, "triangular_solves", "pairs of triangular solves (bars), iterations (ticks)", ticks="iterations")

    # A logarithmic scale has no place for a residual of exactly 0 or the cost of a failure.
    for row in (row for row in rows if not row["error"] and row["kkt"] > 0):
        marker = MARKERS[scenes.index(row["scene"]) % len(MARKERS)]
        trade.loglog(row["seconds"], row["kkt"], marker, color=colour(solvers.index(row["solver"])),
                     ms=7, mec="white", mew=0.5)
    trade.set_title("speed against accuracy: lower left is better", loc="left")
    trade.set(xlabel="time in the contact solver (s)", ylabel="worst KKT residual")
    trade.grid(color=FAINT, alpha=0.35, linewidth=0.6)
    trade.set_axisbelow(True)
    keys = [plt.Rectangle((0, 0), 1, 1, color=colour(i), label=s) for i, s in enumerate(solvers)]
    keys += [plt.Line2D([], [], marker=MARKERS[i % len(MARKERS)], ls="", color=FAINT, label=scene)
             for i, scene in enumerate(scenes)]
    trade.legend(handles=keys, loc="center left", bbox_to_anchor=(1, 0.5))
    return figure


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    table = Path(sys.argv[1]) / "comparison.csv"
    if not table.exists():
        sys.exit(f"error: {table} is missing; run `signorini compare` first")
    draw(table).savefig(table.with_suffix(".png"))
    print(table.with_suffix(".png"))
