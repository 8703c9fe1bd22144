"""Draws the chart of speed against accuracy: chart.py FOLDER

Reads FOLDER/chart.csv as `signorini-study chart` writes it and, where validation/timing.py has left it,
FOLDER/fenicsx.csv, and draws FOLDER/chart.png.

The FEniCSx loop solves the same discrete problem: its error is that of our run with the same n and
k, provided both end with the same min ζ and largest |u|, which is checked here.
"""

import sys

import matplotlib.pyplot as plt
from matplotlib.ticker import LogFormatterSciNotation

from drawing import BLUE, FAINT, INK, RED, draw_table
from results import read_table

# The least two answers of the same discrete problem agree to, at KKT residuals of 1e-10.
SAME = 1e-6
SOLVERS = {"active-set": BLUE, "penalty-duality": "#d08a1d", "tao": "#3d8f5a"}
FENICSX = {1: "#8e5aa8", 2: "#c58ad9"}


def is_plain(row):
    """Uniform mesh and steps, default tolerance: what FEniCSx is compared with."""
    return row["grading"] == 1 and row["step"] != "" and row["tolerance"] == 1e-10


def order(row):
    """The polynomial degree of the displacements."""
    return int(row.get("order", 1))


def matched(fenicsx, rows):
    """FEniCSx's rows with the errors of our runs of the same problem, on squares of n = 1/size."""
    ours = {(round(1 / row["size"]), row["step"], order(row)): row for row in rows
            if row["solver"] == "active-set" and is_plain(row)}
    for row in fenicsx:
        twin = ours.get((row["n"], row["step"], order(row)))
        if twin is None:
            continue
        apart = max(abs(row[key] / twin[key] - 1) for key in ("zeta_min", "displacement_max"))
        if apart > SAME:
            sys.exit(f"FEniCSx P{order(row)} differs by {apart:.1e} at n = {row['n']:g}, "
                     f"k = {row['step']:g}")
        times = row["seconds"] / twin["seconds"]
        yield {**row, "sum": twin["sum"], "zeta": twin["zeta"], "times": times, "apart": apart}


def kinds(rows):
    """(label, rows, style): each run under what sets it apart."""
    def of(solver):
        return [row for row in rows if row["solver"] == solver and is_plain(row)]
    active = [row for row in rows if row["solver"] == "active-set"]
    for solver, colour in SOLVERS.items():
        yield f"{solver}, uniform mesh", of(solver), {"marker": "o", "color": colour}
    graded = [row for row in active if row["grading"] != 1 and row["step"] != ""]
    yield "active-set, graded mesh", [row for row in graded if row["tolerance"] == 1e-10], {
        "marker": "^", "color": "#4fa3a5"}
    yield "active-set, chosen steps", [row for row in active if row["step"] == ""], {
        "marker": "D", "color": "#a3554f"}
    yield "loose KKT tolerance", [row for row in rows if row["tolerance"] != 1e-10], {
        "marker": "x", "color": INK, "linewidths": 0.9}


def steps(row):
    return f"k = {row['step']:g}" if row["step"] != "" else f"auto {row['step_tolerance']:g}"


def name(row):
    parts = 1 / row["size"]
    size = f"1/{parts:g}" if parts > 1 and parts == round(parts) else f"{row['size']:g}"
    mesh = "uniform" if row["grading"] == 1 else f"graded {row['grading']:g}"
    loose = "" if row["tolerance"] == 1e-10 else f", tolerance {row['tolerance']:g}"
    return f"size {size}, {mesh}, {steps(row)}{loose}"


def draw_errors(axes, rows, fenicsx, error, suffix, label):
    for kind, of_kind, style in kinds(rows):
        axes.scatter([row["seconds"] for row in of_kind], [row[error] for row in of_kind],
                     s=16, alpha=0.75, label=kind, **style)
    for degree, colour in FENICSX.items():
        of_order = [row for row in fenicsx if order(row) == degree]
        if of_order:
            axes.scatter([row["seconds"] for row in of_order], [row[error] for row in of_order],
                         s=18, marker="s", color=colour,
                         label=f"FEniCSx loop, P{degree}, uniform mesh")
    front = sorted((row for row in rows if row["front" + suffix] == "true"),
                   key=lambda row: row["seconds"])
    axes.step([row["seconds"] for row in front], [row[error] for row in front], where="post",
              color=RED, lw=1.3, label="Pareto front", zorder=1)
    marks = [("knee", row, (-25, -45), "center") for row in rows if row["knee" + suffix] == "true"]
    marks += [("defaults", row, (45, 75), "left") for row in rows if row["default"] == "true"]
    for title, row, offset, side in marks:
        axes.annotate(f"{title}\n{name(row)}", (row["seconds"], row[error]), offset,
                      textcoords="offset points", fontsize=8.5, ha=side, va="center",
                      arrowprops={"arrowstyle": "->", "color": INK, "lw": 0.9},
                      bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1})
    axes.set(xscale="log", yscale="log", xlabel="wall time of reading the mesh, set-up and steps (s)",
             ylabel=label, xlim=(4e-4, None))
    low, high = axes.get_ylim()
    axes.set_ylim(0.6 * low, high)
    axes.yaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(3, 0.6)))
    axes.grid(which="both", color=FAINT, alpha=0.3, linewidth=0.5)
    axes.set_axisbelow(True)


def draw(table, fenicsx):
    """The figure of the chart at this path; fills the list of FEniCSx's runs."""
    rows = [row for row in read_table(table) if not row["error"]]
    others = table.parent / "fenicsx.csv"
    fenicsx += matched(read_table(others), rows) if others.exists() else []
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6))
    draw_errors(left, rows, fenicsx, "sum", "", "largest ‖ε(Δu)‖ + ‖Δζ‖ over time (that of Table 1)")
    draw_errors(right, rows, fenicsx, "zeta", "_zeta", "largest ‖Δζ‖ over time")
    left.set_title(f"{table.parent.name}: error of displacement and damage", loc="left")
    right.set_title("error of the damage alone", loc="left")
    figure.legend(*left.get_legend_handles_labels(), loc="upper center", ncols=4,
                  bbox_to_anchor=(0.5, 0.0))
    return figure


def main():
    fenicsx = []
    draw_table(__doc__, "chart", "signorini-study chart", lambda table: draw(table, fenicsx))
    for row in fenicsx:
        print(f"FEniCSx P{order(row)}, n = {row['n']:g}, k = {row['step']:g}: "
              f"{row['times']:.1f} times the seconds of active-set, answers {row['apart']:.0e} apart")


if __name__ == "__main__":
    main()
