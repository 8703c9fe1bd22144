"""Draws the errors of `signorini converge` as the paper's Figure 3: converge.py FOLDER

Reads FOLDER/converge.csv and draws FOLDER/converge.png: the error of Table 1 against h + k, and
all errors against h at the least k.
"""

import csv
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from drawing import FAINT, INK

COLOURS = ["#2f6db3", "#d08a1d", "#3d8f5a", "#8e5aa8", "#c0392b"]
MEASURES = {
    "strain": "‖ε(Δu)‖",
    "gradient": "|Δu| in H¹",
    "zeta_gradient": "|Δζ| in H¹",
    "zeta": "‖Δζ‖",
}
# Ticks of h + k and h.
TICKS = [0.02, 0.03, 0.05, 0.1, 0.2, 0.3]


def slope(x, y):
    """The order p of y ~ x^p by least squares, and the factor."""
    p, logarithm = np.polyfit(np.log(x), np.log(y), 1)
    return p, np.exp(logarithm)


def grid(axes):
    axes.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS])
    axes.set_xticks([], minor=True)
    axes.grid(which="both", color=FAINT, alpha=0.3, linewidth=0.5)
    axes.set_axisbelow(True)


def draw_figure_3(axes, rows):
    """Table 1's error against h + k with the fitted order and a line of order 1."""
    cells = sorted({row["n"] for row in rows})
    for colour, n in zip(COLOURS, cells):
        of_n = [row for row in rows if row["n"] == n]
        axes.loglog([row["h_plus_k"] for row in of_n], [row["sum"] for row in of_n], "o-",
                    color=colour, ms=4.5, lw=0.9, label=f"n = {n:g}")
    x = np.array([row["h_plus_k"] for row in rows])
    order, factor = slope(x, np.array([row["sum"] for row in rows]))
    ends = np.array([x.min(), x.max()])
    axes.loglog(ends, factor * ends**order, color=INK, lw=1.2, label=f"fit: order {order:.2f}")
    axes.loglog(ends, 0.6 * factor * ends[1] ** (order - 1) * ends, color=INK, lw=1, ls=":",
                label="order 1")
    axes.set(xlabel="h + k,  h = √2/n", ylabel="largest ‖ε(Δu)‖ + ‖Δζ‖ over time")
    axes.set_title("Figure 3: error of Table 1 against h + k\n"
                   "(points of one n: k from 0.02 down; flat: k hardly counts)", loc="left")
    axes.legend()
    grid(axes)


def draw_orders(axes, rows):
    """All errors against h at the least k."""
    least = min(row["k"] for row in rows)
    rows = [row for row in rows if row["k"] == least]
    h = np.sqrt(2.0) / np.array([row["n"] for row in rows])
    for colour, (key, name) in zip(COLOURS, MEASURES.items()):
        errors = np.array([row[key + "_relative"] for row in rows])
        order, factor = slope(h, errors)
        axes.loglog(h, errors, "o", color=colour, ms=4.5, label=f"{name}: order {order:.2f}")
        axes.loglog(h, factor * h**order, color=colour, lw=1)
    axes.set(xlabel="h = √2/n", ylabel="error relative to the reference's norm")
    axes.set_title(f"all errors at k = {least:g}, largest over time", loc="left")
    axes.legend()
    grid(axes)


def main(folder):
    table = Path(folder) / "converge.csv"
    if not table.exists():
        sys.exit(f"no {table}: run `signorini converge` first")
    with open(table, newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8))
    draw_figure_3(left, rows)
    draw_orders(right, rows)
    picture = table.with_suffix(".png")
    figure.savefig(picture)
    print(picture)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
