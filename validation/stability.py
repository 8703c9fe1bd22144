#!/usr/bin/python3
"""Draws the maps of the stability study: stability.py FOLDER [MAP…]

Reads FOLDER/<map>.csv as `signorini-study stability` writes it, and draws FOLDER/<map>.png. A map is a list of
panels: fields coloured by their verdict, or points and lines, with × for refused and a red ring for wrong answers.
"""

import sys
from pathlib import Path

import numpy as np

import shared  # noqa: F401
from drawing import plt, wrapped
from results import read_table

COLOURS = {"correct": "#7fbf7b", "refused": "#fdd49e", "wrong": "#d7301f"}
# Zeros on logarithmic axes, and the largest number of characters of a name on an axis.
FLOOR, LONG = 1e-16, 14


def name(value):
    """A short text for a value; 0.499999 and 0.5 stay apart."""
    if isinstance(value, tuple):
        return " ".join(map(name, value))
    if not isinstance(value, float):
        return str(value)
    if 0 < abs(value - 0.5) < 5e-3:
        return f"0.5{value - 0.5:+.0e}".replace("e-0", "e-")
    return f"{value:.3g}".replace("e-0", "e-")


def groups(rows, key):
    """Groups the rows by their keys, in the order of appearance."""
    found = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return found


def columns(*names):
    """The values of some columns of a row; of one column not as a tuple."""
    return lambda row: row[names[0]] if len(names) == 1 else tuple(row[n] for n in names)


def points(axes, rows, x, y, by, labels, scale="log", line=True, low=FLOOR):
    """A line with marks per group, without rows that lack a value. `labels` are those of both axes."""
    for k, (key, group) in enumerate(groups(rows, by).items()):
        at = sorted((x(row), max(y(row), low), row["verdict"]) for row in group if "" not in (x(row), y(row)))
        if not at:
            continue
        xs, ys, verdicts = zip(*at)
        axes.plot(xs, ys, "os^vD*"[k // 10 % 6] + "-" * line, color=f"C{k % 10}", ms=4, lw=0.8, label=name(key))
        for verdict, style in (("refused", "kx"), ("wrong", "ro")):
            bad = [(a, b) for a, b, found in at if found == verdict]
            if bad:
                axes.plot(*zip(*bad), style, ms=8, mfc="none")
    axes.set(xscale="log", yscale=scale, xlabel=labels[0], ylabel=labels[1])
    axes.legend(frameon=False, fontsize=7)


def cells(axes, rows, x, y, labels, text):
    """A field for each row, coloured by its verdict, with a text. `labels` are those of both axes."""
    across, down = ([*groups(rows, key)] for key in (x, y))
    for row in rows:
        at = across.index(x(row)), down.index(y(row))
        axes.add_patch(plt.Rectangle(at, 1, 1, facecolor=COLOURS[row["verdict"]], edgecolor="white"))
        axes.text(at[0] + 0.5, at[1] + 0.5, text(row), ha="center", va="center", fontsize=7)
    axes.set(xlim=(0, len(across)), ylim=(len(down), 0), xlabel=labels[0], ylabel=labels[1])
    turn = 90 if max(len(name(value)) for value in across) > LONG / 2 else 0
    axes.set_xticks(np.arange(len(across)) + 0.5, map(name, across), fontsize=7, rotation=turn)
    axes.set_yticks(np.arange(len(down)) + 0.5, map(name, down), fontsize=7)
    axes.tick_params(length=0)


def iterations(row):
    """Iterations, with * for each fallback or early claim of convergence and ° for a noted answer; – without any."""
    count = "–" if row["iterations"] == "" else f"{row['iterations']:.0f}"
    stars = sum(int(row.get(key) or 0) for key in ("fallbacks", "claimed"))
    noted = row.get("outcome") == "noted" or (row.get("notes") or 0) > 0
    return count + "*" * min(stars, 3) + "°" * noted


def solver_order(rows):
    """Expands a row of all solvers (`all`: refused before solving) to a row per solver."""
    solvers = [s for s in groups(rows, columns("solver")) if s != "all"]
    return [{**row, "solver": s} for row in rows for s in ([row["solver"]] if row["solver"] != "all" else solvers)]


def failure_error(row):
    return abs(row["failure_time"] / row["reference"] - 1)


# What the sweeps of lost contact vary.
LIFTS = {
    "clamped, lifted": "1 − load/load of first touch", "free, lifted": "load/weight − 1",
    "on a wedge, lighter": "resultant of the pressure (N/m)", "": "eccentricity of the pressure (m)",
}


def lost_contact(rows):
    """A panel for each sweep."""
    return [(sweep, of, cells, dict(x=columns("value"), y=columns("solver"), text=iterations,
                                    labels=(LIFTS.get(sweep, LIFTS[""]), "solver")))
            for sweep, of in groups(solver_order(rows), columns("sweep")).items()]


def step_size(rows):
    return [
        ("time of failure; lines: cells a side", [row for row in rows if row["step"] != ""], points,
         dict(x=columns("step"), y=columns("failure_time"), by=columns("n"), scale="linear",
              labels=("uniform step k (s)", "time of failure (s)"))),
        ("its relative error; lines: cells a side, steps", [row for row in rows if row["steps"] > 0], points,
         dict(x=lambda row: row["steps"] + row["rejected"], y=failure_error,
              by=lambda row: (row["n"], "uniform" if row["step"] != "" else "auto"),
              labels=("steps, rejected ones included", "relative error (1)"))),
    ]


def maximum_principle(rows):
    panels = [(scene, of, side) for scene, of in groups(rows, columns("scene")).items()
              for side in ("rise", "undershoot")]
    return [(f"{scene}; marks: h (m), mass", of, points,
             dict(x=columns("ratio"), y=columns(side), by=columns("h", "mass"), line=False, low=1e-10,
                  labels=("kκ/h² (1)", f"{side} of ζ beyond its bound (1)")))
            for scene, of, side in panels if any(row[side] > 0 for row in of)]


def penalty(rows):
    rows = [row for row in rows if row["contrast"] == 1]
    coarse = groups([row for row in rows if row["h"] == 1 / 16], columns("accelerate"))
    panels = [(f"iterations, {kind}, h = 1/16 m", of, cells,
               dict(x=columns("omega_over_auto"), y=columns("lambda_omega"), text=iterations,
                    labels=("ω/ω_auto (1)", "λω (1)")))
              for kind, of in zip(("plain", "Anderson"), coarse.values())]
    half = [row for row in rows if row["lambda_omega"] == 0.5]
    return [*panels, ("λω = ½; lines: h (m), accelerated", half, points, dict(
        x=columns("omega_over_auto"), y=columns("iterations"), by=columns("h", "accelerate"),
        labels=("ω/ω_auto (1)", "iterations")))]


def tao_types(rows):
    return [(f"iterations, tolerance {tolerance:g}", of, cells,
             dict(x=columns("scene"), y=columns("type"), text=iterations, labels=("scene", "type of TAO")))
            for tolerance, of in groups(rows, columns("tolerance")).items()]


def active_set(rows):
    return [(title, rows, points, dict(x=columns("contrast"), y=columns(key), by=columns("kind"), line=False, scale=scale,
                                       labels=("contrast of the stiffness (1)", label)))
            for title, label, key, scale in (("iterations", "iterations", "iterations", "linear"),
                                             ("residuals", "worst relative KKT residual (1)", "kkt", "log"))]


def conditioning(rows):
    of = groups(rows, columns("sweep"))
    tight = {sweep: [row for row in of[sweep] if row["tolerance"] == 1e-10] for sweep in of}
    exact = [row for row in of["incompressible"] if row["solver"] == "active-set"]
    apart = "relative difference of u between solvers (1)"
    return [
        ("soft hole; lines: cells a side, solver", tight["hole"], points,
         dict(x=columns("parameter"), y=columns("difference"), by=columns("nx", "solver"),
              labels=("ζ₀ in the hole (1)", apart))),
        ("slivers; lines: case, solver", tight["slivers"], points,
         dict(x=columns("parameter"), y=columns("difference"), by=columns("case", "solver"),
              labels=("smallest angle (°)", apart))),
        ("plane strain; lines: cells a side", exact, points,
         dict(x=lambda row: 0.5 - row["parameter"], y=columns("error"), by=columns("nx"),
              labels=("½ − ν (1)", "relative error of u (1)"))),
        ("slender bodies: iterations", of["slender"], cells,
         dict(x=columns("case", "tolerance", "solver"), y=columns("parameter", "nx", "ny"), text=iterations,
              labels=("case, tolerance, solver", "length/height, cells"))),
    ]


def scales(rows):
    return [("marks: body, solver", rows, points,
             dict(x=columns("ratio"), y=columns("difference"), by=columns("kind", "solver"), line=False,
                  labels=("gap/displacement (1)", "relative difference from the active set in SI units (1)")))]


# Panels of each map, and how many of them stand side by side.
MAPS = {
    "step-size": (step_size, 2),
    "maximum-principle": (maximum_principle, 3),
    "penalty-duality": (penalty, 3),
    "tao-types": (tao_types, 3),
    "active-set": (active_set, 2),
    "conditioning": (conditioning, 2),
    "lost-contact": (lost_contact, 2),
    "scales": (scales, 1),
}


def draw(table, panels, across):
    """The figure of a table."""
    rows = read_table(table)
    panels = panels(rows)
    down = -(-len(panels) // across)
    figure, axes = plt.subplots(down, across, figsize=(7 * across, 1 + 3.9 * down), squeeze=False,
                                layout="constrained")
    for axis, (title, of, kind, options) in zip(axes.flat, panels):
        kind(axis, of, **options)
        axis.set_title(title, loc="left", fontsize=10)
    for axis in axes.flat[len(panels):]:
        axis.set_visible(False)
    counts = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in COLOURS}
    said = ", ".join(f"{n} {verdict}" for verdict, n in counts.items())
    said += "; × refused, ring: wrong; * fallback or early claim, ° noted, – no answer"
    figure.suptitle("\n".join(wrapped(said, 6.8 * across)), fontsize=10)
    figure.savefig(table.with_suffix(".png"), dpi=110)
    plt.close(figure)
    print(table.with_suffix(".png"))


def main(folder, *names):
    for map_name in names or MAPS:
        table = Path(folder) / f"{map_name}.csv"
        if table.exists():
            draw(table, *MAPS[map_name])
        else:
            print(f"no {table}: run `signorini-study stability {map_name}` first", file=sys.stderr)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
