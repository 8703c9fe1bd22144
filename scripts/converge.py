"""Draws the errors of `signorini-study converge`: converge.py FOLDER

Reads FOLDER/converge.csv and draws FOLDER/converge.png: the error of Table 1 against h + k, which for
the paper's scene is its Figure 3 with the printed errors beside ours, and all errors against h at the
least k.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

from drawing import FAINT, INK, draw_table
from results import read_table

COLOURS = ["#2f6db3", "#d08a1d", "#3d8f5a", "#8e5aa8", "#c0392b"]
MEASURES = {
    "strain": "‖ε(Δu)‖",
    "gradient": "|Δu| in H¹",
    "zeta_gradient": "|Δζ| in H¹",
    "zeta": "‖Δζ‖",
}


def slope(x, y):
    """The order p of y ~ x^p by least squares, and the factor."""
    p, logarithm = np.polyfit(np.log(x), np.log(y), 1)
    return p, np.exp(logarithm)


def grid(axes):
    """Ticks at 1, 2 and 5 times the powers of ten within the limits."""
    low, high = axes.get_xlim()
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))))
    ticks = [m * 10.0**power for power in powers for m in (1, 2, 5)]
    ticks = [tick for tick in ticks if low <= tick <= high]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.grid(which="both", color=FAINT, alpha=0.3, linewidth=0.5)
    axes.set_axisbelow(True)


def draw_sums(axes, rows):
    """Table 1's error against h + k with the fitted orders, ours and the printed one."""
    printed = [row for row in rows if row["printed"] != ""]
    meshes = sorted({row["h"] for row in rows}, reverse=True)
    for colour, h in zip(COLOURS, meshes):
        name = f"n = {np.sqrt(2.0) / h:.0f}" if printed else f"h = {h:.3g}"
        of_mesh = [row for row in rows if row["h"] == h]
        axes.loglog([row["h_plus_k"] for row in of_mesh], [row["sum"] for row in of_mesh], "o-",
                    color=colour, ms=4.5, lw=0.9, label=name)
        theirs = [row for row in of_mesh if row in printed]
        axes.loglog([row["h_plus_k"] for row in theirs], [row["printed"] for row in theirs], "x--",
                    color=colour, ms=5, lw=0.9)
    for of, key, style, whose in ((rows, "sum", "-", "ours"), (printed, "printed", "--", "print")):
        if not of:
            continue
        x = np.array([row["h_plus_k"] for row in of])
        order, factor = slope(x, np.array([row[key] for row in of]))
        ends = np.array([x.min(), x.max()])
        axes.loglog(ends, factor * ends**order, color=INK, lw=1, ls=style,
                    label=f"fit, {whose}: order {order:.2f}")
    axes.set(xlabel="h + k", ylabel="largest ‖ε(Δu)‖ + ‖Δζ‖ over time")
    title = "error against h + k on each mesh"
    if printed:
        title = f"Figure 3: {title}\n(dots: ours; crosses: the paper's Table 1)"
    axes.set_title(title, loc="left")
    axes.legend()
    grid(axes)


def draw_orders(axes, rows):
    """All errors against h at the least k."""
    least = min(row["k"] for row in rows)
    rows = [row for row in rows if row["k"] == least]
    h = np.array([row["h"] for row in rows])
    for colour, (key, name) in zip(COLOURS, MEASURES.items()):
        errors = np.array([row[key + "_relative"] for row in rows])
        order, factor = slope(h, errors)
        axes.loglog(h, errors, "o", color=colour, ms=4.5, label=f"{name}: order {order:.2f}")
        axes.loglog(h, factor * h**order, color=colour, lw=1)
    axes.set(xlabel="h: the longest edge", ylabel="error relative to the reference's norm")
    axes.set_title(f"all errors at k = {least:g}, largest over time", loc="left")
    axes.legend()
    grid(axes)


def draw(table):
    rows = read_table(table)
    if len({row["h"] for row in rows}) < 2:
        sys.exit(f"{table}: an order needs two meshes; refine the reference more often")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8))
    draw_sums(left, rows)
    draw_orders(right, rows)
    return figure


if __name__ == "__main__":
    draw_table(__doc__, "converge", "signorini-study converge", draw)
