"""Draws error against seconds: chart.py FOLDER

Reads FOLDER/<scene>/chart.csv as validation/chart.py writes them and draws FOLDER/chart.png, a panel
per scene. Prints the Pareto front of each scene (the runs to which no other is both faster and more
accurate, among runs without FEniCSx) and how many times the seconds of `--accuracy` the paper's method
takes for some errors.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FuncFormatter

from drawing import BLUE, FAINT, INK, RED
from results import read_table

# Label, series, solvers, style; drawn in this order.
KINDS = [
    ("the paper's method: P1, uniform mesh and steps", "P1 uniform", "active-set", BLUE, "o"),
    ("the same by tao", "P1 uniform", "tao", "#3d8f5a", "o"),
    ("the same by penalty-duality", "P1 uniform", "penalty-duality", "#d08a1d", "o"),
    ("P1, graded mesh", "P1 graded", "active-set", "#4fa3a5", "^"),
    ("P2, graded mesh", "P2 graded", "active-set", "#7a6a3a", "v"),
    ("--accuracy 0.1 … 0.001", "accuracy", "active-set", RED, "D"),
    ("the same by tao", "accuracy", "tao", "#3d8f5a", "D"),
    ("the same by penalty-duality", "accuracy", "penalty-duality", "#d08a1d", "D"),
    ("FEniCSx P1, uniform mesh", "FEniCSx P1", "factor kept", "#8e5aa8", "s"),
    ("FEniCSx P2, our adapted meshes", "FEniCSx P2", "factor kept", "#c58ad9", "s"),
]


def front(rows):
    """The runs to which no other is both faster and more accurate, by rising seconds."""
    best, kept = np.inf, []
    for row in sorted(rows, key=lambda row: (row["seconds"], row["error"])):
        if row["error"] < best:
            best = row["error"]
            kept.append(row)
    return kept


def knee(members):
    """The run of a front farthest below the straight line between its ends, in logarithms."""
    if len(members) < 3:
        return None
    x, y = np.log([[row["seconds"], row["error"]] for row in members]).T
    depth = y[0] + (x - x[0]) / (x[-1] - x[0]) * (y[-1] - y[0]) - y
    return members[int(depth.argmax())]


def seconds_for(error, rows):
    """Seconds for an error on the front of `rows`, on straight lines in logarithms, and whether they
    lie beyond the last run: then on the line fitted to the last four."""
    members = front(rows)
    x, y = np.log([[row["error"], row["seconds"]] for row in members]).T
    if error >= members[-1]["error"]:
        return np.exp(np.interp(np.log(error), x[::-1], y[::-1])), False
    slope, at_one = np.polyfit(x[-4:], y[-4:], 1)
    return np.exp(at_one + slope * np.log(error)), True


def draw(axes, name, rows):
    for label, series, solver, colour, marker in KINDS:
        of = [row for row in rows if (row["series"], row["solver"]) == (series, solver)]
        axes.plot([row["seconds"] for row in of], [100 * row["error"] for row in of], marker,
                  color=colour, ms=4.5, alpha=0.8, mew=0, label=label)
    ours = front([row for row in rows if "FEniCSx" not in row["series"]])
    axes.step([row["seconds"] for row in ours], [100 * row["error"] for row in ours], where="post",
              color=INK, lw=0.9, zorder=1, label="Pareto front")
    for row in rows:
        if row["series"] == "as shipped":
            axes.plot(row["seconds"], 100 * row["error"], "*", color="white", mec=INK, ms=13, mew=1.1,
                      label="as shipped", zorder=5)
    axes.set(xscale="log", yscale="log", title=name, xlabel="seconds of the whole process",
             ylabel="larger error of u and of the damage (%)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.grid(which="both", color=FAINT, alpha=0.3, linewidth=0.5)
    axes.set_axisbelow(True)


def text_of(row):
    parts = [f"accuracy {row['accuracy']:g}" if row["accuracy"] != "" else row["series"]]
    if row["size"] != "":
        parts.append(f"size {row['size']:g}")
    if row["grading"] not in ("", 1):
        parts.append(f"grading {row['grading']:g}")
    if row["step"] != "":
        parts.append(f"step {row['step']}")
    if row["solver"] != "active-set":
        parts.append(row["solver"])
    return ", ".join(parts)


def report(name, rows):
    """The front and the ratios of a scene, as text."""
    ours = [row for row in rows if "FEniCSx" not in row["series"]]
    members = front(ours)
    bend = knee(members)
    print(f"\n{name}: the front, and the scene as shipped")
    for row in members + [row for row in ours if row["series"] == "as shipped"]:
        mark = "   (knee)" if row is bend else ""
        print(f"  {row['seconds']:8.3f} s  u {100 * row['u']:7.3f} %  damage {100 * row['damage']:7.3f} %"
              f"  {row['nodes']:7.0f} nodes  {text_of(row)}{mark}")
    paper, asked = ([row for row in ours if row["series"] == series and row["solver"] == "active-set"]
                    for series in ("P1 uniform", "accuracy"))
    for error in (0.1, 0.03, 0.01, 0.003):
        (long, beyond), (short, _) = seconds_for(error, paper), seconds_for(error, asked)
        print(f"  {100 * error:g} %: the paper's method {long:.3g} s{' (extrapolated)' if beyond else ''}, "
              f"--accuracy {short:.3g} s: {long / short:.3g} times")
    for row in rows:
        if row["series"].startswith("FEniCSx"):
            twin = next(other for other in rows if other["series"] == "same mesh as FEniCSx"
                        and (other["order"], other["nodes"]) == (row["order"], row["nodes"]))
            print(f"  {row['series']}, {row['solver']}, {row['nodes']:.0f} nodes: per step "
                  f"{row['seconds_per_step'] / twin['seconds_per_step']:.1f} times ours")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = Path(sys.argv[1])
    tables = {table.parent.name: read_table(table) for table in sorted(folder.glob("*/chart.csv"))}
    if not tables:
        sys.exit(f"no {folder}/*/chart.csv: run `make chart` first")
    columns = min(3, len(tables))
    figure, axes = plt.subplots(-(-(len(tables) + 1) // columns), columns, squeeze=False,
                                figsize=(4.6 * columns, 4.1 * -(-(len(tables) + 1) // columns)))
    axes = list(axes.flat)
    for axis, (name, rows) in zip(axes, tables.items()):
        draw(axis, name, rows)
        report(name, rows)
    for axis in axes[len(tables):]:
        axis.axis("off")
    axes[len(tables)].legend(*axes[0].get_legend_handles_labels(), loc="center", fontsize=9.5)
    picture = folder / "chart.png"
    figure.savefig(picture)
    plt.close(figure)
    print(f"\n{picture}")


if __name__ == "__main__":
    main()
