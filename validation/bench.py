#!/usr/bin/python3
"""Measures speed, everything side by side in one run: bench.py [--binary FILE] [--quick] [PART…]

compare  seconds per step and of the whole process, files written by all: signorini against a loop in FEniCSx
         (fenicsx.py) whose Cholesky factor is kept as a preconditioner or made anew for every linear system; in
         square-mild, where contact stays as it is, and lshape-rolling, where it goes from no node to all and
         back; P1 and P2, on uniform meshes and on those that `--accuracy` finds; and against the floor: the
         bytes that the passes of a step must move, once, over the speed of memory, and the operations of the
         factorisations that were made over that of dgemm. The entries of K are those of FEniCSx's matrix,
         entries and operations of its factor those of MUMPS; neither is taken from signorini
growth   time per step and peak memory up to two million unknowns
ranks    whole runs on 1, 2 and 4 ranks with our factors (one rank: growth), with MUMPS and with PETSc's
         multigrid (gamg), these two on 4 ranks alone where the mesh is largest

peers    the same work in NGSolve, scikit-fem, GetFEM, and numpy with CHOLMOD (peers.py): a static contact problem, whole processes and the
         contact solve alone, and 10 steps with damage, by Euler's scheme and by `bdf2`. Whole processes include the imports of Python. Ours reads the
         mesh and writes its results; the peers get arrays and write nothing

k = 0.01. A step is the mean of all but the first, which makes what the others keep. Programs take turns,
because the machine may be shared: a row has the medians over the rounds, ratios are taken round by round.
All use the same meshes, tolerance and one thread each. A program whose answer differs from ours by more than 1e-6
is left out. Writes OUT/bench.csv and prints the tables behind validation/SPEED.md.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

from shared import ROOT, parser_of
from peers import PEERS, answer, command, installed, write_problem
from results import markdown, read_table, write_table
from scene import read_scene, write_scene

# The largest allowed difference of an answer from ours to the same discrete problem, and the largest KKT residual.
SAME, TOLERANCE = 1e-6, 1e-10
# The number of iterations after which the loop renews its factor: the fastest choice with moving contact.
KEEP = {"kept": 7, "anew": 0}
# Instructions of the processor for which OpenBLAS has kernels. Debian's OpenBLAS takes the oldest kernels on a
# processor that it does not know.
KERNELS = {"avx512f": "SkylakeX", "avx2": "Haswell"}
OURS, FROZEN, KEPT, ANEW = "signorini", "frozen", "FEniCSx, factor kept", "FEniCSx, a factor for every system"
RIVALS = {KEPT: "kept", ANEW: "anew"}
# Scene and .geo, order, cells along the contact or accuracy, rounds, programs.
SCENES = {"stays": ("square-mild", "square"), "moves": ("lshape-rolling", "lshape"), FROZEN: ("lshape", "lshape")}
ALL, FEWER = (OURS, KEPT, ANEW, FROZEN), (OURS, KEPT)
CASES = {
    False: [("stays", 1, 64, 3, ALL), ("stays", 1, 128, 3, ALL), ("stays", 1, 256, 2, ALL), ("stays", 2, 64, 2, ALL),
            ("stays", 2, 0.01, 3, ALL), ("moves", 1, 24, 3, ALL), ("moves", 1, 48, 3, ALL), ("moves", 1, 68, 1, ALL),
            ("moves", 1, 136, 1, FEWER), ("moves", 2, 24, 2, ALL), ("moves", 2, 0.01, 3, ALL)],
    True: [("stays", 1, 64, 1, ALL), ("stays", 2, 32, 1, FEWER), ("moves", 1, 16, 1, ALL), ("moves", 2, 0.1, 1, FEWER)],
}
# Stages of a run (`phases` of summary.json) that the floor includes once per step.
PASSES = ["stiffness", "products", "triangular solves", "vectors", "damage source", "damage solve"]
# PETSc's preconditioners in place of our factors.
PRECONDITIONERS = {
    "ours": [],
    "MUMPS": [word for of in ("elastic", "damage") for word in (
        f"-{of}_pc_type", "cholesky", f"-{of}_pc_factor_mat_solver_type", "mumps")],
    "gamg": [word for of in ("elastic", "damage") for word in (f"-{of}_pc_type", "gamg")],
}
# Steps of a run, of a run for growth and ranks, and of a loop with a new factor for every system.
STEPS, SHORT, FEW = 100, 10, 20


class Failure(Exception):
    """A program failed; the message has one line."""


class Bench:
    """Runs the programs and collects rows of their costs."""

    def __init__(self, binary, out):
        self.binary, self.out, self.rows, self.compiled = str(binary), out, [], set()
        self.environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        out.mkdir(parents=True, exist_ok=True)
        # The same script measures this machine, in a process for each kind of kernels.
        floor = [sys.executable, __file__, "--floor"]
        flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
        kernels = [{"OPENBLAS_CORETYPE": core} for flag, core in KERNELS.items() if flag in flags][:1]
        installed, *best = (json.loads(self.start(floor, **more)[0]) for more in ({}, *kernels))
        self.speeds = {**(best or [installed])[0], "dgemm as installed": installed["dgemm"]}

    def start(self, command, **environment):
        """Runs a command; returns its output and wall seconds."""
        began = time.perf_counter()
        done = subprocess.run(list(map(str, command)), env={**self.environment, **environment}, text=True,
                              cwd=self.out, capture_output=True)
        seconds = time.perf_counter() - began
        if done.returncode != 0:
            lines = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
            wrong = [line for line in lines if line.startswith("error:")] or lines[-1:]
            raise Failure(f"{Path(command[0]).name} … failed: {wrong[0]}")
        return done.stdout, seconds

    def mesh(self, scene, geometry, size):
        """The mesh of a case, made once."""
        adapted = size < 1
        path = self.out / f"{scene if adapted else geometry}-{size}.msh"
        if path.exists():
            return path
        if adapted:
            self.start([self.binary, "run", ROOT / "geo" / f"{scene}.toml", "--accuracy", size,
                        "--out", self.out / "adapted"])
            shutil.move(self.out / "adapted" / "mesh.msh", path)
        else:
            number = ["n", size] if geometry == "square" else ["size", 2 / size]
            self.start(["gmsh", "-2", ROOT / "geo" / f"{geometry}.geo", "-setnumber", *number, "-o", path, "-v", "1"])
        return path

    def signorini(self, scene, mesh, order, steps=STEPS, ranks=1, frames=True, petsc=()):
        """A run with about 20 frames by default: its row, its history, and the seconds of each stage: per step, per
        pair of triangular solves, and per factorisation. Without steps the scene is static, and its step is the contact solve."""
        folder = self.out / "run"
        times = ["--set", "time.step=0.01", "--set", f"time.end={steps / 100}"] if steps else []
        launcher = ["mpiexec", "--allow-run-as-root", "--oversubscribe", "-n", ranks] if ranks != 1 else []
        _, whole = self.start([
            *launcher, self.binary, "run", ROOT / "geo" / f"{scene}.toml", "--mesh", mesh, "--out", folder,
            *times, "--set", f"discretisation.displacement={order}",
            *([] if frames else ["--set", "output.every=100000"]), "--", *petsc])
        summary = json.loads((folder / "summary.json").read_text())
        history = read_table(folder / "history.csv")
        # The first step also makes the factor and other data that all steps use.
        mean = lambda key: float(np.mean([row[key] for row in history[2:] or history]))
        phases = {name.removeprefix("contact/"): seconds for name, seconds in summary["phases"].items()}
        counts = {"triangular solves": "linear_iterations", "factorisation": "factorisations"}
        count = lambda name: sum(of[counts[name]] for of in history) if name in counts else summary["steps"]
        row = {"nodes": summary["nodes"], "whole_seconds": whole,
               "seconds_per_step": mean("seconds") if steps else phases["contact"],
               "solves": mean("linear_iterations"), "factorisations": mean("factorisations"),
               "kkt": max(summary["kkt"].values()), "peak_mb": summary["peak_megabytes"]}
        return row, history, {name: seconds / max(count(name), 1) for name, seconds in phases.items()}

    def fenicsx(self, scene, mesh, order, method, steps):
        """Runs the loop with compiled forms; returns its row and its last state."""
        command = [sys.executable, ROOT / "validation" / "fenicsx.py", ROOT / "geo" / f"{scene}.toml", mesh,
                   "--order", order, "--keep", KEEP[method]]
        if (scene, order) not in self.compiled:
            self.start([*command, "--steps", 1])
            self.compiled.add((scene, order))
        said, whole = self.start([*command, "--steps", steps, "--out", self.out / "run" / "loop"])
        last = json.loads(said.strip().splitlines()[-1])
        return {"nodes": last["nodes"], "seconds_per_step": float(np.mean(last["seconds"][1:])),
                "whole_seconds": whole if steps == STEPS else np.nan, "solves": last["iterations"] / (steps - 1),
                "factorisations": last["factorisations"] / (steps - 1), "kkt": last["kkt"],
                "peak_mb": last["peak_mb"]}, last

    def peer(self, program, path):
        """Runs a peer; returns its row and its last state. A step is the mean of all but the first."""
        said, whole = self.start(command(program, path))
        last = answer(said)
        return {"version": last["program"], "whole_seconds": whole,
                "seconds_per_step": float(np.mean(last["seconds"][2:])) if last["steps"] else last["solve"]}, last

    def keep(self, part, row):
        self.rows.append({"part": part, **row, **self.speeds})
        words = " ".join(f"{row[key]}" for key in ("contact", "order", "mesh", "n", "ranks", "program") if key in row)
        print(f"{part}: {words}: {1e3 * row['seconds_per_step']:.3g} ms per step", file=sys.stderr, flush=True)


def differs(last, history, row):
    """The reason why the times of a program do not count, or None: all programs must solve the same problem."""
    if row.get("kkt", 0.0) > TOLERANCE:
        return f"KKT {row['kkt']:.1e}"
    for key in ("zeta_min", "displacement_max", "work"):
        apart = abs(last[key] - history[last["steps"]][key]) / max(abs(step[key]) for step in history)
        if apart > SAME:
            return f"{key} is {apart:.0e} apart from that of signorini"
    return None


def compare(bench, quick):
    """All programs on all cases."""
    for contact, order, size, rounds, programs in CASES[quick]:
        (scene, geometry), case = SCENES[contact], {"contact": contact, "order": order}
        mesh = bench.mesh(scene, geometry, size)
        case["mesh"] = f"accuracy {size}" if size < 1 else f"n = {size}"
        found, ours, phases = {program: [] for program in programs}, [], []
        for turn in range(rounds):
            for program in programs:
                try:
                    if program == OURS:
                        row, history, passes = bench.signorini(scene, mesh, order)
                        ours.append(row)
                        phases.append(passes)
                    elif program == FROZEN and contact == "moves" and size >= 1:
                        # The same body and mesh with contact that moves in one of a hundred steps.
                        row = bench.signorini(SCENES[FROZEN][0], mesh, order)[0]
                    elif program in RIVALS and (program == KEPT or turn == 0):
                        few = program == ANEW and contact == "stays"
                        row, last = bench.fenicsx(scene, mesh, order, RIVALS[program], FEW if few else STEPS)
                        if wrong := differs(last, history, row):
                            raise Failure(wrong)
                    else:
                        continue
                    found[program].append({**row, **{
                        f"{key}_over_ours": row[key] / ours[-1][key] for key in ("seconds_per_step", "whole_seconds")}})
                except Failure as failure:
                    print(f"left out: {case}, {program}: {failure}", file=sys.stderr)
        for program, runs in found.items():
            if runs:
                row = {key: median(run[key] for run in runs) for key in runs[0]}
                more = floor_of(bench, scene, mesh, order, row, phases) if program == OURS else {}
                bench.keep("compare", {**case, "program": program, **row, **more})


def floor_of(bench, scene, mesh, order, row, phases):
    """The seconds of the floor and those of our passes."""
    said, _ = bench.start([sys.executable, __file__, "--floor", ROOT / "geo" / f"{scene}.toml", mesh, order])
    passes = json.loads(said)
    floor = {f"floor {name}": passes[name] / bench.speeds["copy"] for name in PASSES}
    total = sum(floor.values())
    floor["floor factorisation"] = passes["factorisation"] / bench.speeds["dgemm"]
    total += row["factorisations"] * floor["floor factorisation"]
    ours = {f"ours {name}": median(run[name] for run in phases)
            for name in (*PASSES, "factorisation") if all(name in run for run in phases)}
    return {**floor, **ours, "floor": total, "step_over_floor": row["seconds_per_step"] / total}


def growth(bench, quick):
    """Time and memory over the size."""
    for n in (32, 64, 128, 256) if quick else (64, 128, 256, 512, 1024):
        row, _, _ = bench.signorini("square-mild", bench.mesh("", "square", n), 1, SHORT, frames=False)
        bench.keep("growth", {"n": n, "ranks": 1, "program": "ours", **row})


def ranks(bench, quick):
    """Whole runs on several ranks with each preconditioner."""
    for n, petsc in [(128, (1, 2, 4))] if quick else [(512, (1, 2, 4)), (1024, (4,))]:
        answer = None
        for program, options in PRECONDITIONERS.items():
            for count in petsc if options else (2, 4):
                row, history, _ = bench.signorini("square-mild", bench.mesh("", "square", n), 1, SHORT, count, False,
                                                  options)
                answer = answer or history
                if wrong := differs({"steps": SHORT, **history[SHORT]}, answer, row):
                    print(f"left out: {program} on {count} ranks: {wrong}", file=sys.stderr)
                else:
                    bench.keep("ranks", {"n": n, "ranks": count, "program": program, **row})


def beside_peers(bench, quick):
    """What users would pick instead: a static problem whose contact has to be found (the foundation is flat, the square
    is pulled and pressed down), and steps of `square-mild` by Euler's scheme and by the default one."""
    programs, mild = [OURS, *installed()], read_scene(ROOT / "geo" / "square-mild.toml")
    scene = {key: value for key, value in mild.items() if key not in ("damage", "time")}
    scene["boundary"] = [{**of, "traction": ["1", "-1"]} if "traction" in of else of for of in scene["boundary"]]
    for n in (64,) if quick else (64, 128, 256):
        mesh = bench.mesh("", "square", n)
        write_scene({**scene, "mesh": {"file": str(mesh)}}, bench.out / "static.toml")
        by_bdf2 = {**mild, "mesh": {"file": str(mesh)}, "time": {**mild["time"], "scheme": "bdf2"}}
        write_scene(by_bdf2, bench.out / "bdf2.toml")
        for work, name, steps in (("static", bench.out / "static", 0), ("damage", "square-mild", SHORT),
                                  ("damage, bdf2", bench.out / "bdf2", SHORT)):
            write_problem(bench.out / "problem.npz", ROOT / "geo" / f"{name}.toml", mesh, steps)
            found = {program: [] for program in programs}
            for program in programs * (1 if quick else 3):
                try:
                    if program == OURS:
                        row, history, _ = ours = bench.signorini(name, mesh, 1, steps)
                    else:
                        row, last = bench.peer(program, bench.out / "problem.npz")
                        if wrong := differs(last, history, row):
                            raise Failure(wrong)
                    found[program].append({**row, **{
                        f"{key}_over_ours": row[key] / ours[0][key] for key in ("seconds_per_step", "whole_seconds")}})
                except Failure as failure:
                    print(f"left out: {work}, n = {n}, {program}: {failure}", file=sys.stderr)
            for program, runs in found.items():
                if runs:
                    row = {key: of if isinstance(of, str) else median(run[key] for run in runs)
                           for key, of in runs[0].items()}
                    bench.keep("peers", {"contact": work, "n": n, "program": program, **row})


def machine():
    """Bytes and operations per second of one core: the best of five copies of an array larger than all caches, and
    of five products of dense matrices."""
    def best(work):
        seconds = []
        for _ in range(5):
            began = time.perf_counter()
            work()
            seconds.append(time.perf_counter() - began)
        return min(seconds)

    a, b, c = np.ones(1 << 26), np.ones(1 << 26), np.ones((3000, 3000))
    return {"copy": 16 * len(a) / best(lambda: np.copyto(b, a)), "dgemm": 2 * len(c) ** 3 / best(lambda: c @ c)}


def least_work(scene, mesh, order):
    """Bytes of each pass of a step. Matrices have 8 bytes per entry and 4 per column of a scalar or a 2×2 block.
    Factors are in single precision, and a pair of triangular solves reads them twice."""
    from petsc4py import PETSc

    from fenicsx import Body, Contact, Damage
    from scene import of_order, read_scene
    from triangulation import read_triangulation

    def analysis(matrix):
        """Entries and operations of the Cholesky factor."""
        pc = PETSc.PC().create(PETSc.COMM_SELF)
        pc.setOperators(matrix)
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
        pc.setUp()
        return pc.getFactorMatrix().getMumpsInfog(29), pc.getFactorMatrix().getMumpsRinfog(3)

    body = Body(of_order(read_scene(scene), int(order)), read_triangulation(mesh))
    contact, damage = Contact(body), Damage(body, 0.01)
    contact.solve(0.0, np.ones(len(body.mesh.nodes)))
    (factor, operations), (damage_factor, _) = (analysis(matrix) for matrix in (contact.reduced, damage.matrix))
    entries, damage_entries = (matrix.getInfo()["nz_used"] for matrix in (contact.reduced, damage.matrix))
    unknowns, vertices = len(contact.u), len(body.mesh.nodes)
    elements = 4 * body.nodes.elements.size
    return {
        "stiffness": 8 * entries + elements + 8 * unknowns + 8 * vertices,
        "products": 9 * entries + 16 * unknowns,
        "triangular solves": 8 * factor + 32 * unknowns,
        # u ← u + αp, r ← r − αq, rᵀz, p ← z + βp.
        "vectors": 8 * 11 * unknowns,
        "damage source": elements + 8 * unknowns + 16 * vertices,
        "damage solve": 8 * damage_factor + 12 * damage_entries + 48 * vertices,
        "factorisation": operations,
    }


def number(value, scale=1.0):
    """A number with three digits; "" without a value."""
    return f"{scale * value:.3g}" if isinstance(value, (int, float)) and np.isfinite(value) else ""


def exponent(rows, key):
    """The order of growth with the number of nodes, and the factor, for n ≥ 64."""
    rows = [row for row in rows if row["n"] >= 64] or rows
    return np.polyfit(np.log([row["nodes"] for row in rows]), np.log([row[key] for row in rows]), 1)


def report(rows):
    """Prints the tables behind validation/SPEED.md."""
    cases = {}
    for row in rows:
        if row["part"] == "compare":
            cases.setdefault((row["contact"], row["order"], row["mesh"]), {})[row["program"]] = row
    times = lambda case, program, key: number(case.get(program, {}).get(f"{key}_over_ours"))
    lines, passes = [], []
    for name, case in cases.items():
        ours, frozen = case[OURS], case.get(FROZEN, {}).get("seconds_per_step_over_ours")
        lines.append([*name, round(ours["nodes"]), number(ours["seconds_per_step"], 1e3),
                      *(times(case, program, "seconds_per_step") for program in RIVALS),
                      number(frozen and 1 / frozen), number(ours["floor"], 1e3), number(ours["step_over_floor"]),
                      number(ours["whole_seconds"]), times(case, KEPT, "whole_seconds")])
        passes.append([*name, *(f"{number(ours.get(f'ours {of}'), 1e3)} / {number(ours[f'floor {of}'], 1e3)}"
                                for of in (*PASSES, "factorisation"))])
    if cases:
        head = ["contact", "order", "mesh"]
        print(markdown([*head, "nodes", "ms per step", "× FEniCSx", "× anew", "over frozen", "floor, ms",
                        "step / floor", "whole, s", "× FEniCSx"], lines), end="\n\n")
        print(f"Milliseconds of a pass (ours: of all passes of its kind in a step), ours / floor: {ours['copy'] / 1e9:.1f} GB/s, {ours['dgemm'] / 1e9:.1f} Gflop/s "
              f"({ours['dgemm as installed'] / 1e9:.1f} with the BLAS as it is installed)\n")
        print(markdown([*head, *PASSES, "factorisation"], passes), end="\n\n")
    works = {}
    for row in rows:
        if row["part"] == "peers":
            works.setdefault((row["contact"], row["n"]), {})[row["program"]] = row
    lines = [[*name, round(work[OURS]["nodes"]), number(work[OURS]["seconds_per_step"], 1e3),
              number(work[OURS]["whole_seconds"]),
              *(" / ".join(times(work, peer, key) for key in ("seconds_per_step", "whole_seconds")) for peer in PEERS)]
             for name, work in works.items()]
    if works:
        print(markdown(["work", "n", "nodes", "ms", "whole, s", *(f"× {peer}" for peer in PEERS)], lines))
        print("\n" + "; ".join(sorted({row["version"] for work in works.values() for row in work.values()
                                      if "version" in row})), end="\n\n")
    others = sorted((row for row in rows if row["part"] in ("growth", "ranks")),
                    key=lambda row: (row["n"], row["program"], row["ranks"]))
    lines = [[row["n"], row["program"], row["ranks"], number(row["seconds_per_step"], 1e3), number(row["solves"]),
              number(row["whole_seconds"]), number(row["whole_seconds"] - SHORT * row["seconds_per_step"]),
              number(row["peak_mb"])] for row in others]
    if lines:
        print(markdown(["n", "factor", "ranks", "ms per step", "solves", "whole, s", "else, s", "peak MB"], lines))
    if grown := [row for row in rows if row["part"] == "growth"]:
        print("\nfrom n = 64 " + ", ".join(f"{name} grows like N^{exponent(grown, key)[0]:.2f}" for name, key in (
            ("a step", "seconds_per_step"), ("a whole run", "whole_seconds"), ("memory", "peak_mb"))))


def main():
    parts = {"compare": compare, "peers": beside_peers, "growth": growth, "ranks": ranks}
    parser = parser_of(__doc__, "bench")
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(parts)}")
    parser.add_argument("--quick", action="store_true", help="small meshes, one round")
    parser.add_argument("--floor", nargs="*", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.floor is not None:
        print(json.dumps(least_work(*arguments.floor) if arguments.floor else machine()))
        return
    if unknown := set(arguments.parts) - set(parts):
        parser.error(f"there is no part {', '.join(unknown)}; there are {', '.join(parts)}")
    bench = Bench(arguments.binary, arguments.out.resolve())
    try:
        for part in arguments.parts or parts:
            parts[part](bench, arguments.quick)
    except Failure as failure:
        sys.exit(f"error: {failure}")
    finally:
        for folder in ("run", "adapted"):
            shutil.rmtree(bench.out / folder, ignore_errors=True)
        if bench.rows:
            write_table(bench.rows, bench.out / "bench.csv")
    report(bench.rows)


if __name__ == "__main__":
    main()
