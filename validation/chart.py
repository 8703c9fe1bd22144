#!/usr/bin/python3
"""Error against seconds, whole processes: chart.py [--binary FILE] [--asked] SCENE…

The runs of each scene of geo/ are: the paper's method (P1, uniform mesh, uniform steps), meshes graded by the
.geo in P1 and P2, `--accuracy` from 0.1 to 0.001, the other contact solvers, and the scene as shipped. The time is
that of the whole process on one core, with gmsh, adaptation and output. For a run below three seconds it is the
median of three runs. The error is the larger one of the relative errors of u (energy norm) and of the damage (L²) at
the end, against the reference of references.py in out/reference/graded.

Writes out/chart/<scene>/chart.csv and draws out/chart/chart.png, a panel per scene. Prints the Pareto front
of each scene (the runs to which no other is both faster and more accurate) and how many times the seconds of
`--accuracy` the paper's method takes for some errors.

With --asked the runs are `--accuracy` 0.1, 0.03, 0.01 and 0.003, and the printed errors are relative to the accuracy;
exit code 1 if the larger one exceeds it. (`make promises` checks the error of every figure.)
"""

import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from matplotlib.ticker import FuncFormatter

import references
from shared import ROOT, parser_of
from drawing import BLUE, FAINT, GREEN, INK, RED, plt
from results import write_table
from scene import elasticity, read_scene, write_scene
from true_errors import Run, errors

SHORT, PASSES = 3.0, 3
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
# The largest size, m, and the number of its halvings in P1; the grading in P1, the gradings in P2.
MESHES = {
    "square-mild": (1 / 16, 4, 4, (4, 32)),
    "square-table1": (1 / 16, 4, 4, (4, 32)),
    "lshape": (0.5, 5, 32, (32, 1024)),
    "bridge-half": (0.5, 5, 32, (32, 1024)),
    "lshape-rolling": (0.5, 4, 32, (32, 1024)),
}
ASKED = (0.1, 0.03, 0.01, 0.003)
# Label, series, solver and style of the panels; drawn in this order.
KINDS = [
    ("the paper's method: P1, uniform mesh and steps", "P1 uniform", "active-set", BLUE, "o"),
    ("the same by tao", "P1 uniform", "tao", GREEN, "o"),
    ("the same by penalty-duality", "P1 uniform", "penalty-duality", "#d08a1d", "o"),
    ("P1, graded mesh", "P1 graded", "active-set", "#4fa3a5", "^"),
    ("P2, graded mesh", "P2 graded", "active-set", "#7a6a3a", "v"),
    ("--accuracy 0.1 … 0.001", "accuracy", "active-set", RED, "D"),
    ("the same by tao", "accuracy", "tao", GREEN, "D"),
    ("the same by penalty-duality", "accuracy", "penalty-duality", "#d08a1d", "D"),
]


@dataclass(frozen=True)
class Choice:
    """The options of a run: an accuracy, or mesh, order and steps, or nothing."""

    series: str
    solver: str = "active-set"
    accuracy: float = None
    order: int = None
    size: float = None
    grading: float = 1
    step: object = None

    def scene(self, shipped):
        """The shipped scene with these options."""
        if self.accuracy is None and self.order is None:
            return shipped
        # A mesh of order 1 has straight sides; all scenes here have.
        scene = {key: shipped[key] for key in shipped if key not in ("accuracy", "discretisation")}
        scene["mesh"] = {"file": shipped["mesh"]["file"]}
        if self.accuracy is not None:
            return {"accuracy": self.accuracy, **scene}
        scene["discretisation"] = {"displacement": self.order}
        scene["time"] = {**shipped["time"], "step": self.step}
        if self.step == "auto":
            scene["time"]["tolerance"] = 0.03
        scene["mesh"]["size"] = self.size
        if self.grading != 1:
            scene["mesh"]["parameters"] = {"grading": self.grading}
        return scene

    def __str__(self):
        parts = [f"accuracy {self.accuracy:g}" if self.accuracy else self.series]
        parts += [f"{name} {getattr(self, name)}" for name in ("size", "grading", "step")
                  if getattr(self, name) not in (None, 1)]
        return ", ".join(parts + [self.solver] * (self.solver != "active-set"))


def choices(name):
    """The runs of a scene."""
    largest, halvings, linear, quadratic = MESHES[name]
    sizes = [largest / 2**k for k in range(halvings + 1)]
    yield Choice("as shipped")
    for size, step in itertools.product(sizes, (0.05, 0.01, 0.002)):
        # Small steps where they are cheap.
        if step >= 0.01 or size >= largest / 4:
            yield Choice("P1 uniform", order=1, size=size, step=step)
    for solver, size in itertools.product(("tao", "penalty-duality"), sizes[:3]):
        yield Choice("P1 uniform", solver, order=1, size=size, step=0.01)
    for size in sizes[:4]:
        yield Choice("P1 graded", order=1, size=size, grading=linear, step=0.01)
    for grading, size in itertools.product(quadratic, [2 * largest, *sizes[:3]]):
        yield Choice("P2 graded", order=2, size=size, grading=grading, step="auto")
    for accuracy in (0.1, 0.03, 0.01, 0.003, 0.001):
        yield Choice("accuracy", accuracy=accuracy)
    for solver in ("tao", "penalty-duality"):
        yield Choice("accuracy", solver, accuracy=0.01)


class Study:
    """The runs of one scene and their rows."""

    def __init__(self, binary, path, folder):
        self.binary, self.folder = binary, folder
        self.shipped = read_scene(path)
        self.name = Path(path).stem
        shutil.copy(Path(path).parent / self.shipped["mesh"]["file"], folder)
        kept = references.graded(self.binary, path, ROOT / "out" / "reference" / "graded" / self.name)
        self.reference = Run(kept)
        material = self.shipped["material"]
        self.stiffness = elasticity(material["young"], material["poisson"], material["plane"])
        self.rows = []

    def run(self, choice):
        """Adds the row of a run, or reports why it failed."""
        path, out, times = self.folder / f"{self.name}.toml", self.folder / "out", []
        write_scene(choice.scene(self.shipped), path)
        command = [str(self.binary), "run", path, "--out", out, "--solver", choice.solver]
        while len(times) < (PASSES if not times or times[0] < SHORT else 1):
            for mesh in self.folder.glob("*.msh"):
                mesh.unlink()
            started = time.perf_counter()
            done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT)
            times.append(time.perf_counter() - started)
            if done.returncode != 0:
                print(f"{self.name}, {choice}: {done.stderr.strip()}", file=sys.stderr, flush=True)
                return
        run = Run(out)
        u, damage = errors(self.reference, run, self.stiffness)
        damage = damage or 0.0
        row = {"run": str(choice), "series": choice.series, "solver": choice.solver,
               "accuracy": choice.accuracy, "nodes": run.summary["nodes"], "steps": run.summary["steps"],
               "seconds": median(times), "u": u, "damage": damage, "error": max(u, damage)}
        self.rows.append(row)
        print(f"{self.name}: {line(row)}", flush=True)


def line(row):
    """A run as text."""
    return (f"{row['seconds']:8.3f} s  u {100 * row['u']:7.3f} %  damage {100 * row['damage']:7.3f} %"
            f"  {row['nodes']:7.0f} nodes  {row['run']}")


def front(rows):
    """The runs that no other run beats in both time and accuracy, by increasing seconds."""
    best, kept = np.inf, []
    for row in sorted(rows, key=lambda row: (row["seconds"], row["error"])):
        if row["error"] < best:
            best = row["error"]
            kept.append(row)
    return kept


def knee(members):
    """The run of a front that is farthest below the straight line between its ends, in logarithms."""
    if len(members) < 3:
        return None
    x, y = np.log([[row["seconds"], row["error"]] for row in members]).T
    depth = y[0] + (x - x[0]) / (x[-1] - x[0]) * (y[-1] - y[0]) - y
    return members[int(depth.argmax())]


def seconds_for(error, rows):
    """The seconds for an error on the front of `rows`, by linear interpolation of logarithms, and whether they are
    extrapolated: beyond the last run they are on the line fitted to the last four runs."""
    members = front(rows)
    x, y = np.log([[row["error"], row["seconds"]] for row in members]).T
    if error >= members[-1]["error"]:
        return np.exp(np.interp(np.log(error), x[::-1], y[::-1])), False
    slope, at_one = np.polyfit(x[-4:], y[-4:], 1)
    return np.exp(at_one + slope * np.log(error)), True


def draw(axes, name, rows):
    """The panel of a scene."""
    for label, series, solver, colour, marker in KINDS:
        of = [row for row in rows if (row["series"], row["solver"]) == (series, solver)]
        axes.plot([row["seconds"] for row in of], [100 * row["error"] for row in of], marker,
                  color=colour, ms=4.5, alpha=0.8, mew=0, label=label)
    members = front(rows)
    axes.step([row["seconds"] for row in members], [100 * row["error"] for row in members], where="post",
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


def report(name, rows):
    """The front and the ratios of a scene, as text."""
    members = front(rows)
    bend = knee(members)
    print(f"\n{name}: the front, and the scene as shipped")
    for row in members + [row for row in rows if row["series"] == "as shipped"]:
        print(f"  {line(row)}{'   (knee)' if row is bend else ''}")
    paper, asked = ([row for row in rows if row["series"] == series and row["solver"] == "active-set"]
                    for series in ("P1 uniform", "accuracy"))
    for error in ASKED:
        (long, beyond), (short, _) = seconds_for(error, paper), seconds_for(error, asked)
        print(f"  {100 * error:g} %: the paper's method {long:.3g} s{' (extrapolated)' if beyond else ''}, "
              f"--accuracy {short:.3g} s: {long / short:.3g} times")


def draw_all(tables, picture):
    """A panel per scene, and one with the legend."""
    columns = min(3, len(tables))
    rows = -(-(len(tables) + 1) // columns)
    figure, axes = plt.subplots(rows, columns, squeeze=False, figsize=(4.6 * columns, 4.1 * rows))
    axes = list(axes.flat)
    for axis, (name, table) in zip(axes, tables.items()):
        draw(axis, name, table)
        report(name, table)
    for axis in axes[len(tables):]:
        axis.axis("off")
    axes[len(tables)].legend(*axes[0].get_legend_handles_labels(), loc="center", fontsize=9.5)
    figure.savefig(picture)
    print(f"\n{picture}")


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--asked", action="store_true", help="the accuracy asked for against the true error")
    parser.add_argument("scenes", nargs="+", type=Path)
    arguments = parser.parse_args()
    tables, out = {}, ROOT / "out" / "chart"
    for path in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            study = Study(arguments.binary, path, Path(folder))
            asked = (Choice("accuracy", accuracy=accuracy) for accuracy in ASKED)
            for choice in asked if arguments.asked else choices(study.name):
                study.run(choice)
            tables[study.name] = study.rows
    if arguments.asked:
        print("true error over the accuracy")
        for name, rows in tables.items():
            for row in rows:
                u, damage, larger = (row[key] / row["accuracy"] for key in ("u", "damage", "error"))
                print(f"{name}, {row['accuracy']}: {larger:.2f} (u {u:.2f}, damage {damage:.2f}), "
                      f"{2 * row['nodes']} unknowns, {row['seconds']:.2f} s")
        sys.exit(any(row["error"] > row["accuracy"] for rows in tables.values() for row in rows))
    for name, rows in tables.items():
        (out / name).mkdir(parents=True, exist_ok=True)
        write_table(rows, out / name / "chart.csv")
    draw_all(tables, out / "chart.png")


if __name__ == "__main__":
    main()
