#!/usr/bin/python3
"""Runs scenes with every contact solver and compares cost and answers.

    signorini compare geo/lshape.toml geo/beam.toml --solvers active-set,tao --set time.step=0.02

Each solver stands by itself (contact.rescue = false, unless --set says otherwise). Where a scene asks for an accuracy, all start from
the mesh that the first solver adapts. The results of a run are in OUT/SCENE-SOLVER/, the table also in
OUT/comparison.csv. What follows `--` are PETSc options."""

import argparse
import os
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import numpy as np

from reading import read_frame
from results import markdown, write_table
from signorini_files import begins, check, check_folder, whole
from signorini_results import load

# Titles of the printed table; the others are shown in comparison.csv alone.
TITLES = {
    "scene": "scene", "solver": "solver", "steps": "steps", "contact_changes": "contact changes",
    "iterations": "iterations", "factorisations": "factors", "triangular_solves": "solves",
    "fallbacks": "rescues", "seconds": "seconds", "times_first": "ratio", "kkt": "residual",
    "difference_u": "Δu", "difference_zeta": "Δζ", "difference_pressure": "Δp",
}
MEANINGS = """contact changes: steps in which the number of nodes in contact changes
solves: pairs of triangular solves; rescues: steps that another solver computed
ratio: seconds over those of the first solver; residual: largest KKT residual
Δ: largest difference from the answer with the smallest residuals, over the largest value"""
# The title of an additional column for failed solvers, and its width.
REASON, WIDTH = "why it failed", 90
DIFFERENCES = ["difference_u", "difference_zeta", "difference_pressure"]
# Sums over all steps, and their columns in history.csv.
TOTALS = {"iterations": "iterations", "factorisations": "factorisations",
          "triangular_solves": "linear_iterations", "fallbacks": "fallbacks"}
KKT = ["kkt_stationarity", "kkt_primal", "kkt_dual", "kkt_complementarity"]


class Refused(Exception):
    """The program ended with this exit code."""


def signorini(*arguments):
    """Runs the program that runs this script; returns its error, "" if there is none."""
    ended = subprocess.run([os.environ["SIGNORINI"], *arguments], capture_output=True, text=True)
    lines = ended.stderr.splitlines()
    print(*(line for line in lines if line.startswith("warning")), sep="\n", end="", file=sys.stderr)
    first = next((i for i, line in enumerate(lines) if line.startswith("error")), len(lines))
    error = "\n".join(lines[first:])
    if ended.returncode > 1:
        print(error, file=sys.stderr)
        raise Refused(ended.returncode)
    return error.removeprefix("error: ") if ended.returncode else ""


def compared(scene, arguments):
    """The rows of a scene. Per solver: the cost of its run, and the difference of its last state from the state
    with the smallest residuals."""
    rows, states, mesh = [], [], []
    for solver in arguments.solvers:
        folder = arguments.out / f"{scene.stem}-{solver.replace(':', '-')}"
        # A run that fails at its start does not remove the results of an earlier one.
        check(folder / "history.csv")
        (folder / "history.csv").unlink(missing_ok=True)
        sets = settings(["contact.rescue=false", *arguments.set])
        words = ["run", str(scene), "--solver", solver, "--out", str(folder)]
        error = signorini(*words, *mesh, *sets, "--", *arguments.petsc)
        row, state = read(folder, error)
        rows.append({"scene": scene.stem, "solver": solver, **row, **dict.fromkeys(DIFFERENCES), "error": error})
        states.append(state)
        asks = tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8")) if state else {}
        if not mesh and "accuracy" in asks:
            mesh = ["--mesh", str(folder / "mesh.msh")]
    complete = [k for k, row in enumerate(rows) if not row["error"]]
    best = min(complete, key=lambda k: worst(rows[k]), default=None)
    for row, state in zip(rows, states):
        known = state and best is not None
        row.update(zip(DIFFERENCES, differences(state, states[best]) if known else 3 * [np.nan]))
    return rows


def read(folder, error):
    """The cost of a run over all steps, its last state, and the largest |u| and |p| of the run. There is no
    state if the first solve failed."""
    run = load(folder) if (folder / "history.csv").exists() else None
    if run is None or not len(run.columns["step"]):
        return {"steps": 0, **dict.fromkeys(["contact_changes", *TOTALS, "seconds", *KKT])}, None
    history = run.columns
    row = {
        "steps": int(history["step"][-1]),
        "contact_changes": np.count_nonzero(np.diff(history["active_nodes"])),
        **{name: int(history[key].sum()) for name, key in TOTALS.items()},
        "seconds": run.summary.get("phases", {}).get("contact", 0.0),
        **{key: history[key].max() for key in KKT},
    }
    meshes = [read_frame(path) for _, path in run.frames]
    frames = [mesh.point_data for mesh in meshes]
    scales = [history["displacement_max"].max(), 1.0,
              max(np.max(np.abs(frame["normal_pressure"])) for frame in frames)]
    values = [frames[-1][name] for name in ["displacement", "zeta", "normal_pressure"]]
    return row, (meshes[-1].points, values, [scale or 1.0 for scale in scales])


def differences(state, best):
    """max |u − u_ref| over max |u_ref|, max |ζ − ζ_ref|, max |p − p_ref| over max |p_ref|, where the
    reference is the best state, with its maxima over all steps (for p: all frames). Nothing if the nodes
    differ: an adapted mesh that is read again has its midpoints in another order."""
    (points, values, _), (others, references, scales) = state, best
    order = other = np.arange(len(points))
    if not np.array_equal(points, others):
        order, other = np.lexsort(points.T), np.lexsort(others.T)
    if len(order) != len(other) or not np.array_equal(points[order], others[other]):
        return 3 * [np.nan]
    return [np.max(np.abs(a[order] - b[other])) / scale for a, b, scale in zip(values, references, scales)]


def worst(row):
    return max(row[key] for key in KKT)


def settings(keys):
    return [word for key in keys for word in ("--set", key)]


def cells(row, first):
    """The cells of a solver; the first solver took `first` seconds. For a failed solver only the steps before
    its failure."""
    if row["error"]:
        return [str(row[key]) if key in ("scene", "solver", "steps") else "FAILED" if key == "kkt" else "-"
                for key in TITLES]
    shown = dict(row, seconds=f"{row['seconds']:.3f}", times_first=f"{row['seconds'] / first:.1f}",
                 kkt=f"{worst(row):.1e}", **{key: f"{row[key]:.1e}" for key in DIFFERENCES})
    return [str(shown[key]) for key in TITLES]


def table(rows):
    """The table in Markdown."""
    first = {row["scene"]: row["seconds"] for row in reversed(rows) if not row["error"]}
    header = list(TITLES.values())
    lines = [cells(row, first.get(row["scene"]) or np.nan) for row in rows]
    if any(row["error"] for row in rows):
        header.append(REASON)
        for line, row in zip(lines, rows):
            line.append(textwrap.shorten(row["error"], WIDTH, placeholder=" …"))
    return markdown(header, lines, left=(0, 1, len(TITLES)))


def is_own(path):
    """Whether a file is a table of this script."""
    return begins(path, b"scene,solver,steps,contact_changes,")


def arguments_of(prog):
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE", help="scene file")
    parser.add_argument("--solvers", metavar="NAME,…", type=lambda names: names.split(","),
                        help="solvers to compare (all)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="override a key of the scenes; may be repeated")
    parser.add_argument("--out", type=Path, default=Path("out/compare"), metavar="DIR",
                        help="folder for the results (%(default)s)")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments = parser.parse_args(words[:end])
    arguments.petsc = words[end + 1:]
    stems = [scene.stem for scene in arguments.scenes]
    if twice := next((stem for stem in stems if stems.count(stem) > 1), None):
        parser.error(f"two scenes have the name {twice}, which the table goes by; rename one")
    return arguments


def main(prog=None):
    """Returns the exit code: 2 for wrong input, which is found before the first run; 1 if a solver failed."""
    arguments = arguments_of(prog)
    if not arguments.solvers:
        names = subprocess.run([os.environ["SIGNORINI"], "solvers"], capture_output=True, text=True)
        arguments.solvers = [line.split("\t")[0] for line in names.stdout.splitlines()]
    check_folder(arguments.out)
    path = arguments.out / "comparison.csv"
    check(path, is_own)
    try:
        for scene in arguments.scenes:
            for solver in arguments.solvers:
                signorini("check", str(scene), *settings([*arguments.set, f"contact.solver='{solver}'"]))
        rows = [row for scene in arguments.scenes for row in compared(scene, arguments)]
    except Refused as refused:
        return refused.args[0]
    print(table(rows))
    print(MEANINGS)
    # Runs that fail at their start make no folder.
    arguments.out.mkdir(parents=True, exist_ok=True)
    with whole(path, is_own) as part:
        write_table(rows, part)
    print(f"written to {path}")
    errors = [f"{row['scene']}, {row['solver']}: {row['error']}" for row in rows if row["error"]]
    print(*(f"error: {error}\n" for error in errors), sep="", end="", file=sys.stderr)
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
