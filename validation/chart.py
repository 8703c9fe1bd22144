#!/usr/bin/python3
"""Error against seconds, whole processes: chart.py [--binary FILE] [--asked] [--quick] SCENE…

The runs of a scene are: P1 on uniform meshes with uniform steps by the paper's method, `penalty-duality:plain`, by the
other contact solvers, in FEniCSx, and in the peers (NGSolve, scikit-fem, GetFEM, numpy with CHOLMOD) if they are there
(`make deps-peers`); meshes graded by the .geo in P1 and P2; `--accuracy` from 0.1 to 0.001; and the scene as it is.
A program that cannot follow a scene is named with the reason. The time is that of the processor for the whole process
on one core, with gmsh, adaptation and output; FEniCSx gets the mesh, the peers get arrays and write nothing. For a run
below three seconds it is the median of three runs. The error is the larger one of the relative errors of u (energy
norm) and of the damage (L²) at the end, against the reference of references.py. The other programs solve the same
discrete problem: they have our error, if the work of their loads agrees to 1e-6.

Writes out/chart/<scene>/chart.csv and draws out/chart/chart.png, a panel per scene (beside scenes that are not of this
repository). Prints the Pareto front
of each scene (the runs to which no other is both faster and more accurate) and how many times the seconds of
`--accuracy` uniform meshes and steps take for some errors.

With --asked the runs are `--accuracy` 0.1, 0.03, 0.01 and 0.003, and the printed errors are relative to the accuracy;
exit code 1 if the larger one exceeds it. (`make promises` checks the error of every figure.)
"""

import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

import references
from shared import ROOT, out_of, parser_of
from converge import finish
from drawing import BLUE, GREEN, INK, RED, plt
from peers import PEERS, answer, command, installed, write_problem
from results import write_table
from scene import SceneError, read_scene, write_scene
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
PLAIN, FENICSX = "penalty-duality:plain", "FEniCSx"
KINDS = [
    ("P1, uniform mesh and steps: active-set", "P1 uniform", "active-set", BLUE, "o"),
    ("P1, uniform: tao", "P1 uniform", "tao", GREEN, "s"),
    ("P1, uniform: penalty-duality", "P1 uniform", "penalty-duality", "#d08a1d", "^"),
    ("P1, uniform: the paper's method", "P1 uniform", PLAIN, INK, "X"),
    ("P1, uniform: FEniCSx", "P1 uniform", FENICSX, "#8e5aa8", "P"),
    *((f"P1, uniform: {peer}", "P1 uniform", peer, colour, marker) for peer, colour, marker in zip(
        PEERS, ("#c2185b", "#00838f", "#9e9d24", "#5d4037"), ("h", "d", "8", (4, 1, 0)), strict=True)),
    ("P1, graded mesh: active-set", "P1 graded", "active-set", "#4fa3a5", "v"),
    ("P2, graded mesh: active-set", "P2 graded", "active-set", "#7a6a3a", "<"),
    ("--accuracy: active-set", "accuracy", "active-set", RED, "D"),
    ("--accuracy: tao", "accuracy", "tao", "#7fbf3f", ">"),
    ("--accuracy: penalty-duality", "accuracy", "penalty-duality", "#e377c2", "p"),
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
        scene = {key: shipped[key] for key in shipped if key not in ("accuracy", "discretisation")}
        parameters = {name: of for name, of in shipped["mesh"].get("parameters", {}).items() if name != "grading"}
        scene["mesh"] = {"file": shipped["mesh"]["file"], "parameters": parameters}
        if self.accuracy is not None:
            return {"accuracy": self.accuracy, **scene}
        scene["discretisation"] = {"displacement": self.order}
        scene["mesh"]["size"] = self.size
        if self.step:
            scene["time"] = {**shipped["time"], "step": self.step}
        if self.step == "auto":
            scene["time"]["tolerance"] = 0.03
        if self.grading != 1:
            parameters["grading"] = self.grading
        return scene

    def __str__(self):
        parts = [f"accuracy {self.accuracy:g}" if self.accuracy else self.series]
        parts += [f"{name} {getattr(self, name)}" for name in ("size", "grading", "step")
                  if getattr(self, name) not in (None, 1)]
        return ", ".join(parts + [self.solver] * (self.solver != "active-set"))


def choices(study, quick, peers):
    """The runs of a scene; a third of them if it has to be quick."""
    end, file = study.shipped.get("time", {}).get("end"), study.folder / study.shipped["mesh"]["file"]
    extent = float(np.ptp(study.reference.points, axis=0).max())
    largest, halvings, linear, quadratic = MESHES.get(study.name, (extent / 16, 4, 32, (32, 1024)))
    is_graded = "grading" in file.read_text(encoding="utf-8")
    sizes = [largest / 2**k for k in range(halvings + 1 - 2 * quick)]
    few, step, auto = 2 if quick else 3, end and 0.01 * end, end and "auto"
    steps = [step] if quick or not end else [5 * step, step, 0.2 * step]
    yield Choice("as shipped")
    for size, k in itertools.product(sizes, steps):
        # Small steps where they are cheap.
        if not end or k >= step or size >= largest / 4:
            yield Choice("P1 uniform", order=1, size=size, step=k)
        if k == step and size in sizes[:few]:
            for solver in [FENICSX, *peers]:
                yield Choice("P1 uniform", solver, order=1, size=size, step=k)
    for solver, size in itertools.product((PLAIN, "tao", "penalty-duality"), sizes[:few]):
        yield Choice("P1 uniform", solver, order=1, size=size, step=step)
    for size in sizes[:few + 1] * is_graded:
        yield Choice("P1 graded", order=1, size=size, grading=linear, step=step)
    for grading, size in itertools.product(quadratic, [2 * largest, *sizes[:2 * few - 3]] * is_graded):
        yield Choice("P2 graded", order=2, size=size, grading=grading, step=auto)
    for accuracy in (0.1, 0.03, 0.01, 0.003, 0.001)[:5 - quick]:
        yield Choice("accuracy", accuracy=accuracy)
    for solver in ("tao", "penalty-duality"):
        yield Choice("accuracy", solver, accuracy=0.01)


class Study:
    """The runs of one scene and their rows."""

    def __init__(self, binary, path, folder, passes):
        self.binary, self.folder, self.passes, self.name, self.rows = binary, folder, passes, Path(path).stem, []
        self.shipped = read_scene(path)
        file, _ = references.geometry_of(path, self.shipped)
        shutil.copy(file, folder)
        self.reference = Run(references.graded(self.binary, path, out_of(path) / "reference" / "graded" / self.name))
        if self.reference.summary["stopped_by"]:
            raise SceneError(f"{path}: the run stops before its end, where errors are taken; choose a smaller time.end")

    def run(self, choice):
        """Adds the row of a run, or reports why it failed."""
        try:
            write_scene(choice.scene(self.shipped), self.folder / f"{self.name}.toml")
            row = self.elsewhere(choice) if choice.solver in (FENICSX, *PEERS) else self.by_us(choice)
        except SceneError as error:
            print(f"{self.name}, {choice}, is left out: {error}", file=sys.stderr, flush=True)
            return
        self.rows.append(row)
        print(f"{self.name}: {line(row)}", flush=True)

    def by_us(self, choice):
        """The row of a run of signorini."""
        out = self.folder / "out"
        command = [self.binary, "run", self.folder / f"{self.name}.toml", "--out", out, "--solver", choice.solver]
        seconds, _ = self.timed(command, self.folder.glob)
        self.last = run = Run(out)
        u, damage = errors(self.reference, run)
        damage = damage or 0.0
        return {"run": str(choice), "series": choice.series, "solver": choice.solver,
                "accuracy": choice.accuracy, "nodes": run.summary["nodes"], "steps": run.summary["steps"],
                "seconds": seconds, "u": u, "damage": damage, "error": max(u, damage)}

    def elsewhere(self, choice):
        """The row of another program on the mesh of the last run, which has solved the same discrete problem."""
        scene, mesh = self.folder / f"{self.name}.toml", next(self.folder.glob("*.msh"))
        steps = round(self.shipped["time"]["end"] / choice.step) if choice.step else 0
        if choice.solver == FENICSX:
            if not steps:
                raise SceneError("the loop in FEniCSx needs time steps")
            fenicsx = [sys.executable, ROOT / "validation" / "fenicsx.py", scene, mesh, "--keep", 7,
                       "--out", self.folder / "loop"]
            # This compiles the forms.
            self.timed([*fenicsx, "--steps", 1])
            seconds, said = self.timed([*fenicsx, "--steps", steps])
        else:
            write_problem(self.folder / "problem.npz", scene, mesh, steps)
            seconds, said = self.timed(command(choice.solver, self.folder / "problem.npz"))
        ours, theirs = self.last.figures["work"]["value"], answer(said)["work"]
        if abs(theirs - ours) > 1e-6 * abs(ours):
            raise SceneError(f"the work of the loads is {theirs}, but {ours} by signorini: another answer")
        return {**self.rows[-1], "run": str(choice), "solver": choice.solver, "seconds": seconds}

    def timed(self, command, meshes=lambda _: ()):
        """The median seconds of a command, each time without the listed meshes, and its output."""
        times = []
        while len(times) < (self.passes if not times or times[0] < SHORT else 1):
            for mesh in meshes("*.msh"):
                mesh.unlink()
            # Other work on the machine does not count.
            started = os.times()
            done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=ENVIRONMENT)
            times.append(sum(os.times()[2:4]) - sum(started[2:4]))
            if done.returncode:
                raise SceneError((done.stderr.strip() or "it failed").splitlines()[-1])
        return median(times), done.stdout


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


def seconds_for(error, rows):
    """The seconds for an error on the front of `rows`, by linear interpolation of logarithms; NaN beyond the last run."""
    x, y = np.log([[row["error"], row["seconds"]] for row in front(rows)]).T
    return np.exp(np.interp(-np.log(error), -x, y, right=np.nan))


def draw(axes, name, rows):
    """The panel of a scene."""
    for label, series, solver, colour, marker in KINDS:
        of = [row for row in rows if (row["series"], row["solver"]) == (series, solver)]
        axes.plot([row["seconds"] for row in of], [100 * row["error"] for row in of], marker=marker, ls="none",
                  color=colour, ms=9, alpha=0.85, mec="white", mew=0.7, label=label)
    members = front(rows)
    axes.step([row["seconds"] for row in members], [100 * row["error"] for row in members], where="post",
              color=INK, lw=1.5, zorder=1, label="Pareto front: fastest for its error")
    for row in rows:
        if row["series"] == "as shipped":
            axes.plot(row["seconds"], 100 * row["error"], "*", color="white", mec=INK, ms=20, mew=1.6,
                      label="the scene as shipped", zorder=5)
    axes.set(xscale="log", yscale="log", title=name, xlabel="processor seconds", ylabel="larger error of u and damage (%)")
    finish(axes)


def report(name, rows):
    """The front and the ratios of a scene, as text."""
    members = front(rows)
    print(f"\n{name}: the front, and the scene as shipped")
    for row in members + [row for row in rows if row["series"] == "as shipped"]:
        print(f"  {line(row)}")
    uniform, asked = ([row for row in rows if row["series"] == series and row["solver"] == "active-set"]
                    for series in ("P1 uniform", "accuracy"))
    for error in ASKED if uniform and asked else ():
        long, short = seconds_for(error, uniform), seconds_for(error, asked)
        print(f"  {100 * error:g} %: uniform P1 " + (
            f"{long:.3g} s, --accuracy {short:.3g} s: {long / short:.3g} times" if long > 0.0 else
            f"not by its finest run, --accuracy {short:.3g} s"))


def draw_all(tables, origin, picture):
    """A panel per scene, and one with the legend and the origin of the numbers."""
    columns = min(3, len(tables))
    rows = -(-(len(tables) + 1) // columns)
    # Letters that can be read at half the size.
    plt.rcParams["font.size"] = 16
    figure, axes = plt.subplots(rows, columns, squeeze=False, figsize=(5.6 * columns, 5.0 * rows), layout="constrained")
    axes = list(axes.flat)
    for axis, (name, table) in zip(axes, tables.items()):
        draw(axis, name, table)
        report(name, table)
    for axis in axes[len(tables):]:
        axis.axis("off")
    axes[len(tables)].legend(*axes[0].get_legend_handles_labels(), loc="center", title=origin)
    figure.savefig(picture, dpi=90)
    print(f"\n{picture}")


def main():
    """Returns the exit code: 1 if a scene cannot be measured, or with --asked if an error exceeds its accuracy."""
    parser = parser_of(__doc__)
    parser.add_argument("--asked", action="store_true", help="the accuracy asked for against the true error")
    parser.add_argument("--quick", action="store_true", help="a third of the runs, each once")
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    arguments = parser.parse_args()
    tables, out, failed = {}, out_of(arguments.scenes[0]) / "chart", False
    peers = [] if arguments.asked else installed()
    for path in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            try:
                study = Study(arguments.binary, path, Path(folder), 1 if arguments.quick else PASSES)
            except (SceneError, subprocess.CalledProcessError) as error:
                failed = True
                print(f"error: {error}", file=sys.stderr)
                continue
            asked = (Choice("accuracy", accuracy=accuracy) for accuracy in ASKED)
            for choice in asked if arguments.asked else choices(study, arguments.quick, peers):
                study.run(choice)
            tables[study.name], made = study.rows, study.last.summary["provenance"]
        if not arguments.asked:
            table = out_of(path) / "chart" / study.name / "chart.csv"
            table.parent.mkdir(parents=True, exist_ok=True)
            write_table(study.rows, table)
    if arguments.asked:
        print("true error over the accuracy")
        for name, rows in tables.items():
            for row in rows:
                u, damage, larger = (row[key] / row["accuracy"] for key in ("u", "damage", "error"))
                print(f"{name}, {row['accuracy']}: {larger:.2f} (u {u:.2f}, damage {damage:.2f}), "
                      f"{2 * row['nodes']} unknowns, {row['seconds']:.2f} s")
        return failed or any(row["error"] > row["accuracy"] for rows in tables.values() for row in rows)
    if tables:
        draw_all(tables, f"{made['date'][:10]}, signorini {made['version']}", out / "chart.png")
    return failed


if __name__ == "__main__":
    sys.exit(main())
