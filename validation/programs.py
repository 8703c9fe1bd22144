"""Runs what `bench.py` compares, and keeps what it took."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
TOLERANCE = 1e-10
# A competitor may differ from our answer to the same discrete problem by this.
SAME = 1e-6
PYTHON = {"FEniCSx": "/usr/bin/python3", "NGSolve": str(ROOT / "target/ngsolve/bin/python")}
# After how many iterations the loop renews a factor that it keeps: what was fastest where contact
# moves (CHOLMOD's factor costs about twenty solves, NGSolve's five); where it stays none is renewed.
KEEP = {"FEniCSx": 7, "NGSolve": 6}
# Instructions of the processor that OpenBLAS has kernels for; Debian's takes the oldest ones on a
# processor that is younger than itself.
KERNELS = {"avx512f": "SkylakeX", "avx2": "Haswell"}


class Failure(Exception):
    """A program that did not do what it was asked: said in one line."""


@dataclass(frozen=True)
class Case:
    """A scene of geo/ on a mesh made for it: uniform with n cells a side or edges along the contact,
    or the one that `--accuracy` finds; and how many steps of k = 0.01."""

    contact: str
    order: int
    n: int = None
    accuracy: float = None
    steps: int = 100
    scene: str = None

    @property
    def name(self):
        return self.scene or {"stays": "square-mild", "moves": "lshape-rolling"}[self.contact]

    @property
    def mesh_name(self):
        return f"accuracy {self.accuracy:g}" if self.accuracy else f"n = {self.n}"

    def file(self):
        return ROOT / "geo" / f"{self.name}.toml"


class Bench:
    """Runs the programs and keeps what they took, a row each."""

    def __init__(self, binary, out):
        self.binary, self.out, self.rows, self.part = str(binary), out, [], None
        self.compiled = set()
        self.environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
                            "CCACHE_DIR": str(ROOT / "target" / "ccache")}
        out.mkdir(parents=True, exist_ok=True)
        self.rivals = [name for name, module in (("FEniCSx", "dolfinx"), ("NGSolve", "ngsolve"))
                       if self.has(PYTHON[name], module)]
        self.speeds = self.machine()

    def has(self, python, module):
        try:
            self.start([python, "-c", f"import {module}"])
            return True
        except (Failure, FileNotFoundError):
            print(f"{module} is not installed and left out", file=sys.stderr)
            return False

    def start(self, command, **environment):
        """Runs a command to its end: its output and wall seconds."""
        command = [str(word) for word in command]
        began = time.perf_counter()
        with subprocess.Popen(command, env={**self.environment, **environment}, text=True,
                              cwd=self.out, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            said, complaint = process.communicate()
            seconds = time.perf_counter() - began
        if process.returncode != 0:
            lines = (complaint.strip() or said.strip() or "no message").splitlines()
            told = [line for line in lines if line.startswith("error:")] or lines[-1:]
            raise Failure(f"{Path(command[0]).name} … failed: {told[0]}")
        return said, seconds

    def machine(self):
        """Bytes and operations per second of this machine; dgemm with the kernels its processor
        has, and as installed."""
        floor = [PYTHON["FEniCSx"], ROOT / "validation" / "floor.py"]
        flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
        kernels = [core for flag, core in KERNELS.items() if flag in flags][:1]
        installed = json.loads(self.start(floor)[0])
        best = json.loads(self.start(floor, OPENBLAS_CORETYPE=kernels[0])[0]) if kernels else installed
        return {"copy": max(installed["copy"], best["copy"]), "dgemm": max(installed["dgemm"], best["dgemm"]),
                "dgemm as installed": installed["dgemm"]}

    def mesh(self, case):
        """The mesh of a case, made once."""
        geometry = {"square-mild": "square", "lshape-rolling": "lshape", "lshape": "lshape"}[case.name]
        if case.accuracy:
            path = self.out / f"{case.name}-{case.accuracy:g}.msh"
            if not path.exists():
                self.start([self.binary, "run", case.file(), "--accuracy", case.accuracy,
                            "--out", self.out / "adapted"])
                shutil.move(self.out / "adapted" / "mesh.msh", path)
            return path
        path = self.out / f"{geometry}-{case.n}.msh"
        if not path.exists():
            size = ["n", case.n] if geometry == "square" else ["size", 2 / case.n]
            part = path.with_suffix(".part.msh")
            self.start(["gmsh", "-2", ROOT / "geo" / f"{geometry}.geo", "-setnumber", *size, "-o", part,
                        "-v", "1"])
            part.rename(path)
        return path

    def signorini(self, case, solver="active-set", ranks=1, frames=True, petsc=()):
        """A run, about 20 frames written unless told otherwise; its history and what `--profile`
        says of each phase in milliseconds per call."""
        folder = self.out / "run"
        command = [self.binary, "run", case.file(), "--mesh", self.mesh(case), "--solver", solver,
                   "--set", "time.step=0.01", "--set", f"time.end={case.steps / 100}", "--out", folder,
                   "--set", f"discretisation.displacement={case.order}", "--profile"]
        command += [] if frames else ["--set", "output.every=100000"]
        if ranks != 1:
            command = ["mpiexec", "--allow-run-as-root", "--oversubscribe", "-n", ranks, *command]
        command += ["--", *petsc] if petsc else []
        said, whole = self.start(command)
        summary = json.loads((folder / "summary.json").read_text())
        with open(folder / "history.csv", newline="", encoding="utf-8") as file:
            history = [{k: float(v or "nan") for k, v in row.items()} for row in csv.DictReader(file)]
        # The first step also makes what all others keep.
        after = history[2:]
        total = lambda key: sum(row[key] for row in after) / len(after)
        phases = dict(re.findall(r"^ +([A-Za-z ]+?) +\d+ +[\d.]+ +[\d.]+ % +([\d.]+)", said, re.MULTILINE))
        peak = re.findall(r"peak memory (\d+)", said)
        row = {"program": "signorini", "method": solver, "ranks": summary["ranks"], "nodes": summary["nodes"],
               "seconds_per_step": total("seconds"), "whole_seconds": whole,
               "iterations": total("iterations"), "solves": total("linear_iterations"),
               "factorisations": total("factorisations"), "kkt": max(summary["kkt"].values()),
               "peak_mb": float(peak[-1]) if peak else None}
        return row, history, {name: 1e-3 * float(ms) for name, ms in phases.items()}

    def loop(self, case, program, method, steps):
        """The loop of a competitor, forms compiled, and its last state."""
        command = [PYTHON[program], ROOT / "validation" / "loop.py", program.lower(), case.file(),
                   self.mesh(case), "--order", case.order,
                   "--keep", KEEP[program] if method == "kept" else 0]
        if (program, case.name, case.order) not in self.compiled:
            self.start([*command, "--steps", 1])
            self.compiled.add((program, case.name, case.order))
        said, whole = self.start([*command, "--steps", steps, "--out", self.out / "run" / "loop"])
        told = json.loads(said.strip().splitlines()[-1])
        per_step = lambda key: told[key] / (steps - 1)
        return {"program": program, "method": method, "ranks": 1, "nodes": told["nodes"],
                "seconds_per_step": float(np.mean(told["seconds"][1:])),
                "whole_seconds": whole - told["compile_seconds"],
                "iterations": per_step("systems"), "solves": per_step("iterations"),
                "factorisations": per_step("factorisations"), "kkt": told["kkt"],
                "peak_mb": told["peak_mb"]}, told

    def passes(self, case):
        """Bytes of each pass of a step, and operations of a factorisation, that none can avoid."""
        return json.loads(self.start([PYTHON["FEniCSx"], ROOT / "validation" / "floor.py", case.file(),
                                      self.mesh(case), case.order])[0])

    def write(self):
        """The table; what the last runs wrote goes."""
        for folder in ("run", "adapted"):
            shutil.rmtree(self.out / folder, ignore_errors=True)
        columns = list(dict.fromkeys(key for row in self.rows for key in row))
        with open(self.out / "bench.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows(self.rows)
