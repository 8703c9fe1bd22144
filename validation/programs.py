"""Runs what `bench.py` compares, and keeps what it took."""

import csv
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
LOOP = ROOT / "validation" / "loop.py"
TOLERANCE = 1e-10
# The kernels of a step.
KERNELS = ["stiffness refill", "product", "triangular solves", "damage solve"]


class Failure(Exception):
    """A program that did not do what it was asked: said in one line."""


@dataclass(frozen=True)
class Case:
    """A scene of geo/ on meshes made for it: their parameter for a given n."""

    scene: str
    geometry: str
    parameter: str
    value: callable

    def file(self):
        return ROOT / "geo" / f"{self.scene}.toml"


# n cells a side; the contact set is the same in all steps.
FROZEN = Case("square-mild", "square", "n", lambda n: n)
# n edges across the leg and along the contact; the contact set changes with the steps.
MOVING = Case("lshape-rolling", "lshape", "size", lambda n: 2 / n)


class Bench:
    """Runs the programs in turn and keeps what they took, a row each."""

    def __init__(self, binary, out, sizes, order=1):
        self.binary, self.out, self.sizes = str(binary), out, sizes
        self.order = order  # of the displacements
        self.rows, self.text, self.part = [], [], None
        self.environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        out.mkdir(parents=True, exist_ok=True)

    def say(self, line=""):
        print(line, flush=True)
        self.text.append(line)

    def mesh(self, case, n):
        """The mesh of a case, made once."""
        path = self.out / f"{case.geometry}-{n}.msh"
        if not path.exists():
            part = path.with_suffix(".part.msh")
            command = ["gmsh", "-2", ROOT / "geo" / f"{case.geometry}.geo", "-setnumber",
                       case.parameter, case.value(n), "-o", part, "-v", "1"]
            self.start(command)
            part.rename(path)
        return path

    def start(self, command, environment=None):
        """Runs a command to its end: its output and wall seconds."""
        command = [str(word) for word in command]
        environment = {**self.environment, **(environment or {})}
        began = time.perf_counter()
        with subprocess.Popen(command, env=environment, text=True, cwd=self.out,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            said, complaint = process.communicate()
            seconds = time.perf_counter() - began
        if process.returncode != 0:
            lines = (complaint.strip() or said.strip() or "no message").splitlines()
            told = [line for line in lines if line.startswith("error:")] or lines[-1:]
            raise Failure(f"{Path(command[0]).name} … failed: {told[0]}")
        return said, seconds

    def signorini(self, n, solver="active-set", steps=100, ranks=None, frames=False, case=FROZEN):
        """A run of so many steps of k = 0.01."""
        folder = self.out / "run"
        command = [self.binary, "run", case.file(), "--mesh", self.mesh(case, n),
                   "--solver", solver, "--set", f"time.end={steps / 100}", "--out", folder, "--profile"]
        if self.order != 1:
            command += ["--set", f"discretisation.displacement={self.order}"]
        if not frames:
            command += ["--set", "output.every=100000"]
        if ranks is not None:
            command = ["mpiexec", "--allow-run-as-root", "--oversubscribe", "-n", ranks, *command]
        said, whole = self.start(command)
        summary = json.loads((folder / "summary.json").read_text())
        with open(folder / "history.csv", newline="") as file:
            history = [{k: float(v or "nan") for k, v in row.items()} for row in csv.DictReader(file)]
        # The first step also makes what all others keep.
        after = history[2:]
        total = lambda key: int(sum(row[key] for row in after))
        row = {
            "program": "signorini", "method": solver, "scene": case.scene, "n": n,
            "ranks": ranks or 1, "nodes": summary["nodes"], "steps": len(after),
            "unknowns": 2 * summary["nodes"],
            "seconds_per_step": sum(row["seconds"] for row in after) / len(after),
            "whole_seconds": whole, "iterations": total("iterations"),
            "linear_iterations": total("linear_iterations"),
            "factorisations": total("factorisations"), "kkt": max(summary["kkt"].values()),
            "peak_mb": peak(said), "frames": frames,
        }
        return self.keep(row), history

    def loop(self, n, factor, steps, frames=False, case=FROZEN):
        """The FEniCSx loop."""
        command = ["/usr/bin/python3", LOOP, case.file(), self.mesh(case, n), "--factor", factor,
                   "--steps", steps, "--order", self.order]
        if frames:
            command += ["--out", self.out / "run" / "loop.xdmf"]
        said, whole = self.start(command)
        answer = json.loads(said.strip().splitlines()[-1])
        row = {
            "program": "FEniCSx", "method": factor, "scene": case.scene, "n": n, "ranks": 1,
            "nodes": answer["nodes"], "unknowns": 2 * answer["nodes"], "steps": answer["steps"] - 1,
            "seconds_per_step": float(np.mean(answer["seconds"][1:])),
            "whole_seconds": whole, "iterations": sum(answer["iterations"][1:]),
            "kkt": answer["kkt"], "frames": frames,
        }
        return self.keep(row), answer

    def kernels(self, n):
        """What no step can do without, in isolation: `cargo bench --bench kernels` times it."""
        home = self.out / "kernels"
        environment = {"CRITERION_HOME": str(home), "PATH": os.pathsep.join(
            [os.environ["PATH"], str(Path.home() / ".cargo" / "bin")])}
        self.start(["cargo", "bench", "--locked", "--manifest-path", ROOT / "Cargo.toml",
                    "--bench", "kernels", "--", f"^unavoidable/(.*/{n}|copy)$"], environment)
        group = home / "unavoidable"
        everything = timed(group / "all" / str(n))
        self.keep({"program": "unavoidable", "method": "", "n": n, "ranks": 1,
                   "nodes": everything["Elements"], "seconds_per_step": everything["seconds"]})
        parts = {name: timed(group / name / str(n)) for name in KERNELS}
        return everything["seconds"], parts, timed(group / "copy")

    def keep(self, row):
        """Notes a run, whose answer must satisfy the KKT conditions."""
        if row.get("kkt", 0.0) > TOLERANCE:
            raise Failure(f"{row['program']} {row['method']}: KKT {row['kkt']:.1e} at n = {row['n']}")
        self.rows.append({"part": self.part, "order": self.order, **row})
        name = f"{self.part}, n = {row['n']}: {row['program']} {row['method']}"
        print(f"{name} {1e3 * row['seconds_per_step']:.3g} ms per step", file=sys.stderr)
        return row

    def table(self, header, rows):
        """A Markdown table."""
        rows = [[str(cell) for cell in row] for row in rows]
        width = [max(map(len, column)) for column in zip(header, *rows)]
        line = lambda row: "| " + " | ".join(c.rjust(w) for c, w in zip(row, width)) + " |"
        self.say(line(header))
        self.say("|" + "|".join("-" * (w + 1) + ":" for w in width) + "|")
        for row in rows:
            self.say(line(row))
        self.say()

    def write(self):
        """The table of all runs, and what was said."""
        columns = list(dict.fromkeys(key for row in self.rows for key in row))
        with open(self.out / "bench.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows(self.rows)
        (self.out / "bench.md").write_text("\n".join(self.text), encoding="utf-8")


def timed(benchmark):
    """The median seconds that Criterion measured, and the elements or bytes it was told of."""
    result = benchmark / "new"
    estimates = json.loads((result / "estimates.json").read_text())
    throughput = json.loads((result / "benchmark.json").read_text())["throughput"] or {}
    return {"seconds": 1e-9 * estimates["median"]["point_estimate"], **throughput}


def peak(said):
    """MB, from the last line of a profile."""
    lines = [line for line in said.splitlines() if "peak memory" in line]
    return float(lines[-1].split()[2]) if lines else None
