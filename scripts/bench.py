"""Draws the measurements of `make bench`: bench.py FOLDER

Reads FOLDER/bench.csv and draws FOLDER/bench.png: the time of a step of every program and how much
faster signorini is, where contact stays and where it moves; how far a step is from the work that
none can avoid; growth of time and memory.
"""

from statistics import median

import matplotlib.pyplot as plt
import numpy as np

from drawing import FAINT, INK, RED, draw_table
from results import read_table

STYLES = {
    ("signorini", "active-set"): ("#2f6db3", "o", "-"),
    ("signorini", "penalty-duality"): ("#d08a1d", "s", "-"),
    ("signorini", "tao"): ("#3d8f5a", "^", "-"),
    ("FEniCSx", "lu"): ("#8e5aa8", "D", "--"),
    ("FEniCSx", "cholesky"): ("#a3554f", "v", "--"),
    ("unavoidable", ""): (INK, "_", ":"),
}
DEFAULT = ("signorini", "active-set")
GIBIBYTES = 1024.0**3


def rounds(rows, part, key):
    """Milliseconds per step of a program, by n, round after round."""
    found = {}
    for row in rows:
        if row["part"] == part and (row["program"], row["method"]) == key and not is_whole(row):
            found.setdefault(int(row["n"]), []).append(1e3 * row["seconds_per_step"])
    return found


def is_whole(row):
    """Runs that wrote output; their steps are not compared."""
    return row["frames"] == "True"


def line(axes, values, key, **style):
    """Medians over n with the range of the rounds."""
    colour, marker, dashes = STYLES[key]
    n = sorted(values)
    middle = [median(values[m]) for m in n]
    apart = [[v - min(values[m]) for m, v in zip(n, middle)],
             [max(values[m]) - v for m, v in zip(n, middle)]]
    axes.errorbar(n, middle, apart, color=colour, marker=marker, ls=dashes, ms=6, capsize=2,
                  lw=1.2, label=" ".join(key).strip(), **style)


def time(axes, rows, part, title):
    """Milliseconds per step of every program; the work that none can avoid is that of `steps`."""
    for key in STYLES:
        source = part if key[0] != "unavoidable" else "kernels" if part == "steps" else None
        if values := rounds(rows, source, key):
            line(axes, values, key)
    if not axes.has_data():
        axes.set_visible(False)
        return
    axes.set(xscale="log", yscale="log", xlabel="n", ylabel="ms per step")
    axes.set_title(title, loc="left")
    ticks(axes, rows, part)
    axes.legend(fontsize=8)


def ratios(axes, rows, part):
    """How many times longer FEniCSx takes than the default; where contact stays, what is demanded,
    and the default against the work that no step can avoid."""
    ours = rounds(rows, part, DEFAULT)
    for key in STYLES:
        theirs = rounds(rows, part, key) if key[0] == "FEniCSx" else {}
        same = {n: [a / b for a, b in zip(theirs[n], ours[n])] for n in theirs}
        if same:
            line(axes, same, key)
    if not axes.has_data():
        axes.set_visible(False)
        return
    title = "FEniCSx against active-set"
    # What is demanded, and the unavoidable work, are those of P1.
    if part == "steps" and rows[0].get("order", 1) == 1:
        against_unavoidable(axes, rows)
        title += ", and active-set against the unavoidable work"
    axes.set(xscale="log", xlabel="n", ylabel="times")
    axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
    axes.set_title(title, loc="left")
    ticks(axes, rows, part)
    axes.legend(fontsize=8, loc="upper left")


def against_unavoidable(axes, rows):
    """The default over the unavoidable work, and what is demanded of both ratios."""
    below = rounds(rows, "kernels", ("unavoidable", ""))
    steps = rounds(rows, "kernels", DEFAULT)
    if below:
        same = {n: [a / b for a, b in zip(steps[n], below[n])] for n in below}
        colour = STYLES[DEFAULT][0]
        axes.plot(list(same), [median(r) for r in same.values()], "*", color=colour, ms=10,
                  label="active-set / unavoidable")
    for n, least in ((128, 12), (256, 15)):
        axes.plot([0.85 * n, 1.18 * n], [least, least], color=RED, lw=2)
    axes.plot([0.85 * 256, 1.18 * 256], [2.5, 2.5], color=RED, lw=2, label="demanded")


def growth(axes, rows, key, scale, title, demanded):
    """One quantity over the number of unknowns, with the fitted exponent."""
    runs = middle([row for row in rows if row["part"] == "growth"])
    if not runs:
        axes.set_visible(False)
        return
    n, values = (np.array([row[k] for row in runs]) for k in ("unknowns", key))
    values = values * scale
    axes.loglog(n, values, "o-", color=STYLES[DEFAULT][0], ms=6, lw=1.2)
    large = [i for i, row in enumerate(runs) if row["n"] >= 64]
    slope, start = np.polyfit(np.log(n[large]), np.log(values[large]), 1)
    axes.loglog(n[large], np.exp(start) * n[large] ** slope, ":", color=INK, lw=1,
                label=f"fitted from n = 64: N^{slope:.2f}")
    demanded(axes, n, values)
    axes.set(xlabel="unknowns of u", ylabel=title)
    axes.set_title(f"growth: {title}", loc="left")
    axes.legend(fontsize=8)


def middle(runs):
    """For each n the median run."""
    sizes = dict.fromkeys(row["n"] for row in runs)
    same = [sorted((r for r in runs if r["n"] == n), key=lambda r: r["seconds_per_step"])
            for n in sizes]
    return [group[len(group) // 2] for group in same]


def slope_allowed(axes, n, values):
    """N^1.25 through the run at n = 64."""
    at = min(1, len(n) - 1)
    axes.loglog(n[at:], values[at] * (n[at:] / n[at]) ** 1.25, color=RED, lw=1, label="N^1.25")


def memory_allowed(axes, _n, _values):
    axes.axhline(8 * GIBIBYTES / 1e6, color=RED, lw=1, label="8 GiB")


def ticks(axes, rows, part):
    sizes = sorted({int(row["n"]) for row in rows if row["part"] == part})
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.minorticks_off()


def draw(table):
    rows = read_table(table)
    figure, all_axes = plt.subplots(3, 2, figsize=(11, 12))
    (a, b), (c, d), (e, f) = all_axes
    time(a, rows, "steps", "contact stays: a step of square-mild")
    ratios(b, rows, "steps")
    time(c, rows, "moving", "contact moves: a step of lshape-rolling")
    ratios(d, rows, "moving")
    growth(e, rows, "seconds_per_step", 1e3, "ms per step", slope_allowed)
    growth(f, rows, "peak_mb", 1.0, "peak memory, MB", memory_allowed)
    for axes in all_axes.flat:
        axes.grid(color=FAINT, alpha=0.35, linewidth=0.6)
        axes.set_axisbelow(True)
    return figure


if __name__ == "__main__":
    draw_table(__doc__, "bench", "make bench", draw)
