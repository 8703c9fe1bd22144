#!/usr/bin/python3
"""Measures speed, everything side by side in one run: bench.py --binary FILE [--quick] [PART…]

compare  seconds per step and of the whole process, files written by all: signorini against a loop in
         FEniCSx and one in NGSolve (loop.py) whose Cholesky factor is kept as a preconditioner or made
         for every linear system; in square-mild, where contact stays as it is, and lshape-rolling, where
         it goes from no node to all and back; for displacements of order 1 and 2, on uniform meshes
         and on those that `--accuracy` finds; and against the floor (floor.py): the bytes that the
         passes of a step must move over the speed of memory, the operations of the factorisations
         that were made over that of dgemm
growth   time per step and peak memory up to two million unknowns
ranks    whole runs on 1, 2 and 4 ranks with our factors (one rank: growth), with MUMPS and with PETSc's
         multigrid (gamg), these two on 4 ranks alone where the mesh is largest

k = 0.01. A step is the mean of all but the first, which makes what the others keep. Programs take turns,
because the machine may be shared: a row has the medians over the rounds, ratios are taken round by round.
All use the same meshes, tolerance and one thread each. What compiling forms takes is left out. A program
whose answer differs from ours by more than 1e-6 is left out. Writes OUT/bench.csv; scripts/bench.py
prints and draws it.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from programs import SAME, TOLERANCE, Bench, Case, Failure

PARTS = ["compare", "growth", "ranks"]
OURS = ("signorini", "active-set")
SOLVERS = [("signorini", "penalty-duality"), ("signorini", "tao")]
KEPT = [("FEniCSx", "kept"), ("NGSolve", "kept")]
ANEW = [("FEniCSx", "anew"), ("NGSolve", "anew")]
# Phases of `--profile` that the floor has, made once in every step.
PASSES = ["stiffness refill", "products", "triangular solves", "vectors", "damage source", "damage solve"]
# What PETSc has in the place of our factors.
PRECONDITIONERS = {
    "MUMPS": [word for of in ("elastic", "damage") for word in (
        f"-{of}_pc_type", "cholesky", f"-{of}_pc_factor_mat_solver_type", "mumps")],
    "gamg": [word for of in ("elastic", "damage") for word in (f"-{of}_pc_type", "gamg")],
}
# Steps of runs that are to tell size and ranks.
STEPS = 10
# Steps of a loop that factorises always, where one step costs as another.
FEW = 20


@dataclass(frozen=True)
class Turns:
    """A case, how often signorini and the loops that keep their factors take their turn, and the other
    programs, whose turn comes once."""

    case: Case
    rounds: int = 3
    others: tuple = ()
    kept: tuple = tuple(KEPT)


FULL = [
    Turns(Case("stays", 1, 64), 3, (*SOLVERS, *ANEW)),
    Turns(Case("stays", 1, 128), 3, (*SOLVERS, *ANEW)),
    Turns(Case("stays", 1, 256), 2, tuple(ANEW)),
    Turns(Case("stays", 2, 64), 2, tuple(ANEW)),
    Turns(Case("stays", 2, accuracy=0.01), 3, tuple(ANEW)),
    Turns(Case("moves", 1, 24), 3, (*SOLVERS, *ANEW)),
    Turns(Case("moves", 1, 48), 3, (*SOLVERS, *ANEW)),
    Turns(Case("moves", 1, 68), 1, tuple(ANEW)),
    Turns(Case("moves", 1, 136, steps=60), 1, kept=(("FEniCSx", "kept"),)),
    Turns(Case("moves", 2, 24), 2, tuple(ANEW)),
    Turns(Case("moves", 2, accuracy=0.01), 3, tuple(ANEW)),
]
QUICK = [
    Turns(Case("stays", 1, 64), 1, tuple(ANEW)),
    Turns(Case("stays", 2, 32), 1),
    Turns(Case("moves", 1, 16), 1, (*SOLVERS, *ANEW)),
    Turns(Case("moves", 2, accuracy=0.1), 1),
]


def compare(bench, quick):
    for turns in QUICK if quick else FULL:
        case = turns.case
        programs = [OURS, *turns.kept, *turns.others]
        if case.contact == "moves" and not case.accuracy:
            # The same body and mesh where contact moves in one step of a hundred.
            programs.append(("signorini", "frozen"))
        programs = [p for p in programs if p[0] == "signorini" or p[0] in bench.rivals]
        found = {p: [] for p in programs}
        for turn in range(turns.rounds):
            for program in programs:
                if turn == 0 or program in [OURS, *KEPT]:
                    found[program].append(one(bench, case, program))
        floor = floor_of(bench, case, found[OURS])
        for program, runs in found.items():
            if wrong := fault(runs, found[OURS][0][1]):
                print(f"left out: {case.mesh_name}, {' '.join(program)}: {wrong}", file=sys.stderr)
                continue
            row = medians([run[0] for run in runs])
            for key in ("seconds_per_step", "whole_seconds"):
                ratios = [run[0][key] / ours[0][key] for run, ours in zip(runs, found[OURS])
                          if run[0][key] and ours[0][key]]
                if ratios:
                    row |= {f"{key}_over_ours": median(ratios), f"{key}_over_ours_least": min(ratios),
                            f"{key}_over_ours_most": max(ratios)}
            if program == OURS:
                row |= floor
            keep(bench, case, program, row, len(runs))


def one(bench, case, program):
    """A run of a program: its row, its last state or history, and its phases."""
    name, method = program
    if program == ("signorini", "frozen"):
        row, history, phases = bench.signorini(replace(case, scene="lshape"))
        return {**row, "whole_seconds": None}, None, phases
    if name == "signorini":
        return bench.signorini(case, method)
    few = method == "anew" and case.contact == "stays" and case.steps > FEW
    try:
        row, told = bench.loop(case, name, method, FEW if few else case.steps)
    except Failure as failure:
        return {"failure": failure}, None, None
    return ({**row, "whole_seconds": None} if few else row), told, None


def fault(runs, history):
    """Why the times of a program do not count: all must solve the same problem."""
    for row, told, _ in runs:
        if "failure" in row:
            return row["failure"]
        if row["kkt"] > TOLERANCE:
            return f"KKT {row['kkt']:.1e}"
        for key in ("zeta_min", "displacement_max", "work") if isinstance(told, dict) else ():
            ours = history[told["steps"]][key]
            apart = abs(told[key] - ours) / max(abs(step[key]) for step in history)
            row["apart"] = max(row.get("apart", 0.0), apart)
            if apart > SAME:
                return f"{key} is {apart:.0e} apart from that of signorini"
    return None


def floor_of(bench, case, runs):
    """Seconds of the floor, beside those of our own passes."""
    if "FEniCSx" not in bench.rivals:
        return {}
    passes, speeds = bench.passes(case), bench.speeds
    row = {}
    for name in PASSES:
        row[f"floor {name}"] = passes[name] / speeds["copy"]
    made = median(run[0]["factorisations"] for run in runs)
    row["floor"] = sum(row.values())
    row["floor factorisation"] = passes["factorisation"] / speeds["dgemm"]
    row["floor"] += made * row["floor factorisation"]
    row["step_over_floor"] = median(run[0]["seconds_per_step"] for run in runs) / row["floor"]
    for name in [*PASSES, "factorisation"]:
        if all(name in run[2] for run in runs):
            row[f"ours {name}"] = median(run[2][name] for run in runs)
    return row


def medians(rows):
    """The row of medians; the ratio of what differs from round to round is in the others."""
    number = lambda values: all(isinstance(v, (int, float)) for v in values)
    columns = {key: [row.get(key) for row in rows] for key in rows[0]}
    return {key: median(values) if number(values) else values[0] for key, values in columns.items()}


def keep(bench, case, program, row, rounds):
    bench.rows.append({"part": bench.part, "contact": case.contact, "scene": case.name, "order": case.order,
                       "mesh": case.mesh_name, "n": case.n, "steps": case.steps, "rounds": rounds,
                       **row, "method": program[1], **bench.speeds})
    whole = f", whole {row['whole_seconds']:.2f} s" if row.get("whole_seconds") else ""
    print(f"{bench.part}: contact {case.contact}, order {case.order}, {case.mesh_name}: "
          f"{' '.join(program)} {1e3 * row['seconds_per_step']:.3g} ms per step{whole}",
          file=sys.stderr, flush=True)


def growth(bench, quick):
    """Time and memory over the size."""
    for n in (32, 64, 128, 256) if quick else (64, 128, 256, 512, 1024):
        case = Case("stays", 1, n, steps=STEPS)
        row, _, _ = bench.signorini(case, frames=False)
        keep(bench, case, OURS, row, 1)


def ranks(bench, quick):
    """Whole runs on several ranks, with each way to precondition."""
    for n, petsc in [(128, (1, 2, 4))] if quick else [(512, (1, 2, 4)), (1024, (4,))]:
        case, answer = Case("stays", 1, n, steps=STEPS), None
        for method in ("active-set", *PRECONDITIONERS):
            for count in petsc if method in PRECONDITIONERS else (2, 4):
                options = PRECONDITIONERS.get(method, ())
                try:
                    row, history, _ = bench.signorini(case, ranks=count, frames=False, petsc=options)
                except (Failure, FileNotFoundError) as failure:
                    print(f"left out: {method} on {count} ranks: {failure}", file=sys.stderr)
                    continue
                answer = answer or history
                if wrong := fault([(row, {"steps": STEPS, **history[STEPS]}, None)], answer):
                    print(f"left out: {method} on {count} ranks: {wrong}", file=sys.stderr)
                else:
                    keep(bench, case, ("signorini", method), row, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}")
    parser.add_argument("--binary", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    parser.add_argument("--quick", action="store_true", help="small meshes, one round")
    arguments = parser.parse_args()
    if unknown := set(arguments.parts) - set(PARTS):
        parser.error(f"there is no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    began = time.perf_counter()
    bench = Bench(arguments.binary.resolve(), arguments.out.resolve())
    try:
        for part in arguments.parts or PARTS:
            bench.part = part
            globals()[part](bench, arguments.quick)
    except Failure as failure:
        sys.exit(f"error: {failure}")
    finally:
        bench.write()
    print(f"{bench.out / 'bench.csv'}: {time.perf_counter() - began:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
