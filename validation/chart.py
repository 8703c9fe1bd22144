#!/usr/bin/python3
"""Error against seconds, whole processes: chart.py --binary FILE SCENE…

Of each scene of geo/: the paper's method (P1, uniform mesh, uniform steps), meshes graded by the .geo
in P1 and P2, `--accuracy` from 0.1 to 0.001, the other contact solvers, the scene as it is shipped, and
the FEniCSx loop. The seconds are those from start to end of the process, gmsh, adaptation and output
included, on one core, as FEniCSx has; of a run below three seconds the median of three. FEniCSx is
given the mesh, its forms are compiled, and it writes nothing. The error is the larger of those of u
(energy norm) and of the damage (L²) at the end, relative, against the reference of graded_reference.py
in out/reference/graded.
Writes out/chart/<scene>/chart.csv; scripts/chart.py draws it.
"""

import argparse
import csv
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean, median

import graded_reference
from programs import KEEP, SAME
from scene import read_scene, write_scene
from true_errors import Run, elasticity, errors

ROOT = Path(__file__).resolve().parent.parent
SHORT, PASSES = 3.0, 3
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
# Largest size, m, and how often it is halved, in P1; the grading in P1, those in P2.
MESHES = {
    "square-mild": (1 / 16, 4, 4, (4, 32)),
    "square-table1": (1 / 16, 4, 4, (4, 32)),
    "lshape": (0.5, 5, 32, (32, 1024)),
    "bridge-half": (0.5, 5, 32, (32, 1024)),
    "lshape-rolling": (0.5, 4, 32, (32, 1024)),
}


@dataclass(frozen=True)
class Choice:
    """What a run is asked for: an accuracy, or mesh, order and steps, or nothing."""

    series: str
    solver: str = "active-set"
    accuracy: float = None
    order: int = None
    size: float = None
    grading: float = 1
    step: object = None
    # A mesh that is there, instead of a size.
    mesh: str = None

    def scene(self, shipped):
        """The shipped scene with this choice."""
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
        if self.mesh:
            scene["mesh"]["file"] = self.mesh
        else:
            scene["mesh"]["size"] = self.size
            if self.grading != 1:
                scene["mesh"]["parameters"] = {"grading": self.grading}
        return scene


def choices(name):
    """The runs of a scene, but those on its adapted meshes."""
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


def seconds_of(command, per_step, before=lambda: None):
    """Wall time of a command and what `per_step` makes of what it said; medians of three if it is
    short."""
    times, steps = [], []
    while len(times) < (PASSES if not times or times[0] < SHORT else 1):
        before()
        started = time.perf_counter()
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=ENVIRONMENT)
        times.append(time.perf_counter() - started)
        if done.returncode != 0:
            raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)
        steps.append(per_step(done.stdout))
    return median(times), median(steps)


class Study:
    """The runs of one scene and their rows."""

    def __init__(self, binary, path, folder):
        self.binary, self.folder = Path(binary).resolve(), folder
        self.shipped = read_scene(path)
        self.name = Path(path).stem
        shutil.copy(Path(path).parent / self.shipped["mesh"]["file"], folder)
        kept = graded_reference.make(binary, path, ROOT / "out" / "reference" / "graded" / self.name)
        self.reference = Run(kept)
        material = self.shipped["material"]
        self.stiffness = elasticity(material["young"], material["poisson"], material["plane"])
        self.rows = []

    def run(self, choice):
        """Makes a run, judges it and adds its row; the folder of its results."""
        path, out = self.folder / f"{self.name}.toml", self.folder / "out"
        write_scene(choice.scene(self.shipped), path)

        def unmeshed():
            for mesh in set(self.folder.glob("*.msh")) - {self.folder / str(choice.mesh)}:
                mesh.unlink()

        def per_step(_said):
            # The first step makes what the others keep; without time there is no other.
            with open(out / "history.csv", encoding="utf-8") as file:
                steps = list(csv.DictReader(file))
            return mean(float(step["seconds"]) for step in steps[2:] or steps)

        command = [self.binary, "run", path, "--out", out, "--solver", choice.solver]
        seconds, seconds_per_step = seconds_of(command, per_step, unmeshed)
        run = Run(out)
        u, damage = errors(self.reference, run, self.stiffness)
        damage = damage or 0.0
        row = {key: getattr(choice, key) for key in
               ("series", "solver", "accuracy", "order", "size", "grading", "step")}
        row |= {key: run.summary[key] for key in
                ("nodes", "triangles", "steps", "zeta_min", "displacement_max")}
        self.add({**row, "seconds": seconds, "seconds_per_step": seconds_per_step, "u": u,
                  "damage": damage, "error": max(u, damage)})
        return out

    def add(self, row):
        self.rows.append(row)
        told = ", ".join(f"{key} {row[key]}" for key in
                         ("accuracy", "order", "size", "grading", "step") if row[key] is not None)
        print(f"{self.name}, {row['series']}, {row['solver']}: {told}: {row['nodes']} nodes, "
              f"{row['seconds']:.3f} s, u {100 * row['u']:.3f} %, damage {100 * row['damage']:.3f} %",
              flush=True)

    def fenicsx(self, order, mesh, factor):
        """The FEniCSx loop on a mesh with k = 0.01, next to ours on the same mesh."""
        kept = self.folder / "given.msh"
        shutil.copy(mesh, kept)
        self.run(Choice("same mesh as FEniCSx", order=order, step=0.01, mesh=kept.name))
        ours = self.rows[-1]
        loop = [sys.executable, ROOT / "validation" / "loop.py", "fenicsx",
                self.folder / f"{self.name}.toml", kept, "--keep", KEEP["FEniCSx"] if factor == "kept" else 0, "--steps"]
        # The first run compiles the forms.
        subprocess.run(list(map(str, [*loop, 1])), capture_output=True, check=True,
                       text=True, env=ENVIRONMENT)
        apart = []

        def seconds_per_step(said):
            said = json.loads(said)
            apart.append(max(abs(said[key] / ours[key] - 1) for key in ("zeta_min", "displacement_max")))
            return mean(said["seconds"][1:])

        steps = round(self.shipped["time"]["end"] / 0.01)
        seconds, per_step = seconds_of([*loop, steps], seconds_per_step)
        if max(apart) > SAME:
            sys.exit(f"{self.name}: FEniCSx P{order} differs from ours by {max(apart):.1e}")
        self.add({**ours, "series": f"FEniCSx P{order}", "solver": f"factor {factor}",
                  "seconds": seconds, "seconds_per_step": per_step})
        print(f"  per step {per_step / ours['seconds_per_step']:.1f} times ours, "
              f"answers {max(apart):.0e} apart", flush=True)

    def all(self):
        """Every run of the chart."""
        for choice in choices(self.name):
            self.attempt(self.run, choice)
        largest = MESHES[self.name][0]
        for size in (largest, largest / 2):
            self.run(Choice("mesh", order=1, size=size, step=0.05))
            self.rows.pop()
            self.attempt(self.fenicsx, 1, next(self.folder.glob("*size*.msh")), "kept")
        for accuracy, factor in ((0.03, "kept"), (0.01, "kept"), (0.01, "anew")):
            out = self.run(Choice("mesh", accuracy=accuracy))
            self.rows.pop()
            self.attempt(self.fenicsx, 2, out / "mesh.msh", factor)

    def attempt(self, make, *arguments):
        """Makes a row, or says why a program failed."""
        try:
            make(*arguments)
        except subprocess.CalledProcessError as failed:
            told = failed.stderr.strip().splitlines()[-1:]
            print(f"{self.name}, {make.__name__} {arguments}: {told}", file=sys.stderr, flush=True)

    def write(self):
        target = ROOT / "out" / "chart" / self.name / "chart.csv"
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, self.rows[0])
            writer.writeheader()
            writer.writerows(self.rows)
        print(target)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default="target/release/signorini")
    parser.add_argument("scenes", nargs="+")
    arguments = parser.parse_args()
    for path in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            study = Study(arguments.binary, path, Path(folder))
            study.all()
            study.write()


if __name__ == "__main__":
    main()
