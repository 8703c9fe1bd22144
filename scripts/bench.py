"""Prints and draws the measurements of `make bench`: bench.py FOLDER

Reads FOLDER/bench.csv, prints it as the tables of validation/SPEED.md (Markdown) and draws FOLDER/bench.png:
seconds per step and of whole processes as multiples of ours, with the floor that no step can go below, and growth.
"""

from math import isfinite

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FuncFormatter

from drawing import BLUE, FAINT, GREEN, INK, RED, draw_table
from results import read_table

OURS = ("signorini", "active-set")
# Colour of each bar; where the factor is made for every system, paler.
RIVALS = {
    ("FEniCSx", "kept"): ("FEniCSx, factor kept", "#8e5aa8"),
    ("FEniCSx", "anew"): ("FEniCSx, a factor for every system", "#c9aed6"),
    ("NGSolve", "kept"): ("NGSolve, factor kept", "#d08a1d"),
    ("NGSolve", "anew"): ("NGSolve, a factor for every system", "#ecc98b"),
}
PASSES = ["stiffness refill", "products", "triangular solves", "damage solve", "factorisation"]


def cases(rows):
    """The rows of each case by program and method."""
    found = {}
    for row in rows:
        if row["part"] == "compare":
            case = found.setdefault((row["contact"], int(row["order"]), row["mesh"]), {})
            case[row["program"], row["method"]] = row
    return found


def number(value, scale=1.0):
    """Three digits, nothing where there is no value."""
    return f"{scale * value:.3g}" if isinstance(value, float) and isfinite(value) else ""


def markdown(header, rows):
    rows = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(header, *rows)]
    line = lambda row: "| " + " | ".join(c.rjust(w) for c, w in zip(row, widths)) + " |"
    print(line(header))
    print("|" + "|".join("-" * (w + 1) + ":" for w in widths) + "|")
    for row in rows:
        print(line(row))
    print()


def times(case, rival, key, spread=False):
    """How many times ours a competitor takes, with the range over the rounds."""
    row = case.get(rival, {})
    text = number(row.get(f"{key}_over_ours"))
    low, high = (row.get(f"{key}_over_ours_{end}") for end in ("least", "most"))
    if spread and text and low != high:
        text += f" ({number(low)}–{number(high)})"
    return text


def frozen(case):
    """Our step over one on the same mesh of lshape, whose contact moves once in a hundred steps."""
    if ("signorini", "frozen") not in case:
        return ""
    return number(case[OURS]["seconds_per_step"] / case["signorini", "frozen"]["seconds_per_step"])


def side_by_side(found):
    """Ours, and how many times longer the others take."""
    table = []
    for (contact, order, mesh), case in found.items():
        ours = case[OURS]
        table.append([
            contact, order, mesh, int(ours["nodes"]), number(ours["seconds_per_step"], 1e3),
            *(times(case, rival, "seconds_per_step") for rival in RIVALS),
            frozen(case), number(ours.get("floor"), 1e3), number(ours.get("step_over_floor")),
            number(ours["whole_seconds"]),
            *(times(case, rival, "whole_seconds") for rival in RIVALS if rival[1] == "kept"),
        ])
    markdown(["contact", "order", "mesh", "nodes", "ms per step", "× FEniCSx", "× anew", "× NGSolve",
              "× anew", "over frozen", "floor, ms", "step / floor", "whole, s", "× FEniCSx", "× NGSolve"],
             table)


def work(found):
    """What all programs do in a step."""
    table = [[contact, order, mesh, *program, number(row["seconds_per_step"], 1e3), number(row["iterations"]),
              number(row["solves"]), number(row["factorisations"]), number(row["peak_mb"]),
              number(row["kkt"]), number(row.get("apart"))]
             for (contact, order, mesh), case in found.items() for program, row in case.items()]
    markdown(["contact", "order", "mesh", "program", "method", "ms per step", "systems", "solve pairs",
              "factors", "peak MB", "KKT", "apart"], table)


def passes(found):
    """Each pass of ours over its floor."""
    table = []
    for (contact, order, mesh), case in found.items():
        ours = case[OURS]
        cells = [[number(ours.get(f"ours {name}"), 1e3), number(ours.get(f"floor {name}"), 1e3)]
                 for name in PASSES]
        table.append([contact, order, mesh, *(" / ".join(cell) for cell in cells)])
    row = next(iter(found.values()))[OURS]
    print(f"Milliseconds of a pass, ours / floor: {row['copy'] / 1e9:.1f} GB/s, {row['dgemm'] / 1e9:.1f} "
          f"Gflop/s ({row['dgemm as installed'] / 1e9:.1f} with the BLAS as it is installed)\n")
    markdown(["contact", "order", "mesh", *PASSES], table)


def others(rows):
    """Growth and ranks: of whole runs the steps, and all else with the first factors; memory of a rank."""
    columns = (("seconds_per_step", 1e3), ("solves", 1), ("whole_seconds", 1), ("else", 1), ("peak_mb", 1))
    rows = [row for row in rows if row["part"] in ("growth", "ranks")]
    for row in rows:
        row["else"] = row["whole_seconds"] - row["steps"] * row["seconds_per_step"]
    for part in ("growth", "ranks"):
        sizes = {row["n"] for row in rows if row["part"] == part}
        # One rank is that of growth.
        chosen = [row for row in rows if row["part"] in ("growth", part) and row["n"] in sizes]
        chosen.sort(key=lambda row: (row["n"], row["method"], row["ranks"]))
        if chosen:
            print(f"{part}:\n")
            markdown(["n", "steps", "factor", "ranks", "ms per step", "solves", "whole, s", "else, s", "peak MB"],
                     [[int(row["n"]), int(row["steps"]), row["method"].replace("active-set", "ours"),
                       int(row["ranks"]), *(number(row[key], scale) for key, scale in columns)]
                      for row in chosen])
    if sizes := [row for row in rows if row["part"] == "growth" and row["n"] >= 64]:
        for name, key in (("time per step", "seconds_per_step"), ("time of a whole run", "whole_seconds"),
                          ("peak memory", "peak_mb")):
            print(f"{name} grows like N^{slope(sizes, key)[0]:.2f} from n = 64")


def slope(rows, key):
    return np.polyfit(np.log([row["nodes"] for row in rows]), np.log([row[key] for row in rows]), 1)


def bars(axes, found, key, title):
    """Multiples of ours, in groups."""
    found = {name: case for name, case in found.items()
             if any(times(case, rival, key) for rival in RIVALS)}
    ours = [case[OURS] for case in found.values()]
    axes.bar(np.arange(len(ours)) - 0.4, 1.0, 0.19, color=BLUE, label="signorini")
    for k, (rival, (label, colour)) in enumerate(RIVALS.items()):
        heights = [case.get(rival, {}).get(f"{key}_over_ours", "") for case in found.values()]
        at = [(i + 0.2 * (k - 1), float(h)) for i, h in enumerate(heights) if isinstance(h, float)]
        if not at:
            continue
        drawn = axes.bar(*zip(*at), 0.19, color=colour, label=label)
        axes.bar_label(drawn, [f"{h:.3g}" for _, h in at], fontsize=6.5, padding=1)
    if key == "seconds_per_step":
        floor = [1 / (row.get("step_over_floor") or np.nan) for row in ours]
        axes.hlines(floor, np.arange(len(ours)) - 0.52, np.arange(len(ours)) - 0.28, color=RED, lw=2,
                    label="floor: bytes over copy, operations over dgemm")
    took = [f"{number(row[key], 1e3)} ms" if key == "seconds_per_step" else f"{number(row[key])} s"
            for row in ours]
    axes.set_xticks(range(len(ours)), [
        f"contact {contact}\nP{order}, {mesh}\n{int(row['nodes'])} nodes\nours: {seconds}"
        for (contact, order, mesh), row, seconds in zip(found, ours, took)], fontsize=7.5)
    axes.set(yscale="log", ylabel="times ours")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axhline(1, color=BLUE, lw=0.6)
    axes.set_title(title, loc="left")
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.5), 2.2 * high)
    axes.legend(fontsize=8, ncols=3, loc="upper left")


def growth(axes, rows, key, scale, label):
    chosen = [row for row in rows if row["part"] == "growth"]
    if not chosen:
        axes.set_visible(False)
        return
    nodes, values = (np.array([row[k] for row in chosen]) for k in ("nodes", key))
    axes.loglog(2 * nodes, scale * values, "o-", color=GREEN, ms=5, lw=1.2)
    exponent, start = slope([row for row in chosen if row["n"] >= 64] or chosen, key)
    axes.loglog(2 * nodes, scale * np.exp(start) * nodes**exponent, ":", color=INK, lw=1,
                label=f"N^{exponent:.2f}")
    axes.set(xlabel="unknowns", ylabel=label)
    axes.set_title(f"signorini, contact stays: {label}", loc="left")
    axes.legend(fontsize=8)


def draw(table):
    rows = read_table(table)
    found = cases(rows)
    if found:
        side_by_side(found)
        passes(found)
        work(found)
    others(rows)
    figure = plt.figure(figsize=(15, 12))
    grid = figure.add_gridspec(3, 2, height_ratios=[1.3, 1.3, 1])
    steps, whole = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
    if found:
        bars(steps, found, "seconds_per_step", "a step")
        bars(whole, found, "whole_seconds", "the whole process, files written")
    growth(figure.add_subplot(grid[2, 0]), rows, "seconds_per_step", 1e3, "ms per step")
    growth(figure.add_subplot(grid[2, 1]), rows, "peak_mb", 1.0, "peak memory, MB")
    for axes in figure.axes:
        axes.grid(axis="y", color=FAINT, alpha=0.35, linewidth=0.6)
        axes.set_axisbelow(True)
    return figure


if __name__ == "__main__":
    draw_table(__doc__, "bench", "make bench", draw)
