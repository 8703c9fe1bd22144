#!/usr/bin/python3
"""Measures speed, everything side by side in one run, and says it as ratios.

    /usr/bin/python3 validation/bench.py --binary FILE [--quick] [--order 2] [PART…]

steps    seconds per step of square-mild (k = 0.01) at n = 64, 128, 256, whose contact set never
         changes: each contact solver and the FEniCSx loop (loop.py, MUMPS by LU and by Cholesky);
         the whole process at n = 64
moving   the same for lshape-rolling, whose contact set goes from no node to all and back, with n
         edges along the contact; every program makes all 100 steps, because they cost differently
kernels  the same against the work that no step can avoid, as `cargo bench --bench kernels` times it,
         at n = 128 and 256
growth   time per step, peak memory and iterations from n = 32 to 1024 in one process each
ranks    1 → 2 ranks at n = 512, iterations over 1 … 4 ranks

A step is the mean of all but the first, which makes what the others keep.
Programs take turns (A B A B …), because the machine may be shared: a ratio is the median over the
rounds of the ratio within a round, with the least and the largest beside it. All use the same mesh
files, tolerance and BLAS, and one thread per process. With `--order 2` the displacements of all are
P2; the kernels are those of P1 and left out. Writes OUT/bench.csv and OUT/bench.md.
"""

import argparse
import os
import platform
import subprocess
import sys
import time
from collections import namedtuple
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np

from programs import FROZEN, MOVING, Bench, Failure

SOLVERS = ["active-set", "penalty-duality", "tao"]
FACTORS = ["lu", "cholesky"]
PARTS = ["steps", "moving", "kernels", "growth", "ranks"]
# FEniCSx / active-set asked for, by n.
DEMANDED = {256: 15.0, 128: 12.0}


# How often all programs take turns, and how many steps the default, the other solvers and the
# FEniCSx loop make.
Turns = namedtuple("Turns", "rounds default others loop")


@dataclass
class Sizes:
    """How much is measured, by n."""

    # The default makes many steps, with the factorisations that fall into them; the others' cost
    # the same one after the other.
    steps: dict = field(default_factory=lambda: {
        64: Turns(3, 100, 100, 40), 128: Turns(3, 100, 50, 20), 256: Turns(3, 100, 25, 10),
    })
    # About as many unknowns as at n = 64 and 128 above, and twice as many.
    moving: dict = field(default_factory=lambda: {
        24: Turns(3, 100, 100, 100), 48: Turns(3, 100, 100, 100), 68: Turns(1, 100, 100, 100),
    })
    # Of the parts below.
    rounds: int = 3
    default_steps: int = 100
    # Those that tests/kernels/bench.rs has.
    kernels: list = field(default_factory=lambda: [128, 256])
    growth: list = field(default_factory=lambda: [32, 64, 128, 256, 512, 1024])
    growth_steps: int = 20
    ranks: int = 512
    ranks_steps: int = 20
    # More: two ranks need the whole machine, and others' load shows.
    ranks_rounds: int = 5


QUICK = Sizes(
    steps={64: Turns(1, 20, 20, 10), 128: Turns(1, 20, 10, 5)},
    moving={16: Turns(1, 100, 100, 100)}, rounds=1, default_steps=20, kernels=[128],
    growth=[32, 64, 128, 256], growth_steps=10, ranks=128, ranks_steps=10, ranks_rounds=1,
)


def milliseconds(rounds):
    return f"{1e3 * median(rounds):.3g}"


def ratio(above, below):
    """The median of the ratios round by round, and their range."""
    ratios = [a / b for a, b in zip(above, below)]
    text = f"{median(ratios):.2f}"
    return text if len(ratios) == 1 else f"{text} ({min(ratios):.2f}–{max(ratios):.2f})"


def steps(bench):
    """Steps whose contact set never changes."""
    bench.say("## Seconds per step where contact does not move: square-mild, k = 0.01\n")
    side_by_side(bench, FROZEN, bench.sizes.steps)
    if bench.order == 1:
        demanded = ", ".join(f"{d:.0f} at n = {n}" for n, d in DEMANDED.items())
        bench.say(f"Demanded of the default: {demanded}; of its whole process: 8.\n")


def moving(bench):
    """Steps whose contact set travels."""
    bench.say("## Seconds per step where contact moves: lshape-rolling, k = 0.01\n")
    side_by_side(bench, MOVING, bench.sizes.moving)


def side_by_side(bench, case, sizes):
    """Seconds per step of every program, in turn, and of the whole process on the first mesh."""
    programs = [("signorini", s) for s in SOLVERS] + [("FEniCSx", f) for f in FACTORS]
    have_loop = subprocess.run(["/usr/bin/python3", "-c", "import dolfinx"], capture_output=True)
    if have_loop.returncode != 0:
        bench.say("FEniCSx is not installed (make deps-validate): its loop is left out.\n")
        programs = programs[: len(SOLVERS)]
    rows = []
    for n, turns in sizes.items():
        seconds, last = {p: [] for p in programs}, {}
        for _ in range(turns.rounds):
            for program, method in programs:
                if program == "FEniCSx":
                    row, told = bench.loop(n, method, turns.loop, case=case)
                else:
                    count = turns.default if method == SOLVERS[0] else turns.others
                    row, told = bench.signorini(n, method, count, case=case)
                last[program, method] = row, told
                seconds[program, method].append(row["seconds_per_step"])
        history = last[programs[0]][1]
        for key in programs:
            row, told = last[key]
            times = [ratio(seconds[key], seconds[other]) for other in programs[:1]]
            against = [ratio(seconds["FEniCSx", f], seconds[key]) if len(programs) > len(SOLVERS)
                       and key[0] == "signorini" else "" for f in FACTORS]
            per_step = [f"{row[count] / row['steps']:.2f}" if count in row else "" for count in
                        ("iterations", "linear_iterations")]
            rows.append([n, row["nodes"], *key, row["steps"], milliseconds(seconds[key]), *times,
                         *against, *per_step, row.get("factorisations", ""), f"{row['kkt']:.0e}"])
            if key[0] == "FEniCSx":
                same_answer(told, history[told["steps"]])
        active = [int(row["active_nodes"]) for row in history[2:]]
        changes = sum(a != b for a, b in zip(active, active[1:]))
        bench.say(f"n = {n}: {min(active)} to {max(active)} active nodes; their number changes in "
                  f"{changes} of {len(active)} steps.")
    bench.say()
    bench.table(["n", "nodes", "program", "method", "steps", "ms per step", "times active-set",
                 "FEniCSx LU / this", "FEniCSx Cholesky / this", "its per step",
                 "solve pairs per step", "factorisations", "KKT"], rows)
    if len(programs) > len(SOLVERS):
        n, turns = next(iter(sizes.items()))
        whole_process(bench, case, n, turns)


def same_answer(told, row):
    """The loop and signorini solve the same problem."""
    for key in ("zeta_min", "displacement_max"):
        if abs(told[key] - row[key]) > 1e-8 * abs(row[key]):
            raise Failure(f"{key} differs: FEniCSx {told[key]!r}, signorini {row[key]!r}")


def whole_process(bench, case, n, turns):
    """From the start of the process to its end, about 20 frames written."""
    count = turns.default
    seconds = {"signorini": [], **{factor: [] for factor in FACTORS}}
    for _ in range(turns.rounds):
        row, _ = bench.signorini(n, steps=count, frames=True, case=case)
        seconds["signorini"].append(row["whole_seconds"])
        for factor in FACTORS:
            row, _ = bench.loop(n, factor, count, frames=True, case=case)
            seconds[factor].append(row["whole_seconds"])
    bench.say(f"The whole process, n = {n}, {count} steps, with output:\n")
    rows = [["signorini", f"{median(seconds['signorini']):.2f}", ""]]
    rows += [[f"FEniCSx {f}", f"{median(seconds[f]):.2f}", ratio(seconds[f], seconds["signorini"])]
             for f in FACTORS]
    bench.table(["program", "seconds", "times signorini"], rows)


def summary(bench):
    """What the README says of steps: the medians, contact that stays beside contact that moves."""
    columns = list(dict.fromkeys((row["part"], row["n"]) for row in bench.rows
                                 if row["part"] in ("steps", "moving")))

    def rounds(column, method, key="seconds_per_step"):
        """The rounds of a program, without (or for whole processes with) output."""
        return [row[key] for row in bench.rows if (row["part"], row["n"], row["method"]) ==
                (*column, method) and row["frames"] == (key == "whole_seconds")]

    def against(column, factor, *key):
        both = [rounds(column, method, *key) for method in (factor, SOLVERS[0])]
        return f"{median(a / b for a, b in zip(*both)):.3g}" if all(both) else ""

    names = {"lu": "FEniCSx, MUMPS LU", "cholesky": "FEniCSx, MUMPS Cholesky"}
    rows = [[names.get(method, method),
             *(milliseconds(found) if (found := rounds(column, method)) else ""
               for column in columns)] for method in SOLVERS + FACTORS]
    for factor in FACTORS:
        rows.append([f"{names[factor]} / active-set", *(against(c, factor) for c in columns)])
        rows.append(["… of the whole process, with output",
                     *(against(c, factor, "whole_seconds") for c in columns)])
    if not columns:
        return
    titles = {"steps": "contact stays", "moving": "contact moves"}
    bench.say("## In short: ms per step\n")
    bench.table(["", *(f"{titles[part]}, n = {n}" for part, n in columns)], rows)


def kernels(bench):
    """Steps against the work that none can avoid."""
    if bench.order != 1:
        return
    rows, parts = [], []
    for n in bench.sizes.kernels:
        seconds, unavoidable, answers = [], [], []
        for _ in range(bench.sizes.rounds):
            everything, *answer = bench.kernels(n)
            unavoidable.append(everything)
            answers.append(answer)
            seconds.append(
                bench.signorini(n, steps=bench.sizes.default_steps)[0]["seconds_per_step"])
        rows.append([n, milliseconds(seconds), milliseconds(unavoidable),
                     ratio(seconds, unavoidable)])
        speed = median(copy["Bytes"] / copy["seconds"] for _, copy in answers)
        for name, part in answers[0][0].items():
            time_ = median(parts[name]["seconds"] for parts, _ in answers)
            moved = part.get("Bytes", 0)
            parts.append([n, name, f"{1e3 * time_:.2f}", f"{1e-6 * moved:.1f}" if moved else "",
                          f"{1e-9 * moved / time_:.1f}" if moved else "", f"{1e-9 * speed:.1f}"])
    bench.say("## Against the work that no step can avoid\n")
    bench.table(["n", "ms per step", "unavoidable, ms", "step / unavoidable"], rows)
    bench.say("Demanded: at most 2.5 at n = 256. The unavoidable work in parts:\n")
    bench.table(["n", "part", "ms", "MB moved", "GB/s", "copy, GB/s"], parts)


def growth(bench):
    """Time, memory and iterations over the size."""
    def middle(n):
        """The median run; of the large ones there is one."""
        rounds = bench.sizes.rounds if n <= 256 else 1
        runs = [bench.signorini(n, steps=bench.sizes.growth_steps)[0] for _ in range(rounds)]
        return sorted(runs, key=lambda r: r["seconds_per_step"])[len(runs) // 2]

    runs = [middle(n) for n in bench.sizes.growth]
    bench.say(f"## Growth, active-set, {bench.sizes.growth_steps} steps, one process each\n")
    fitted = lambda key, chosen: np.polyfit(
        np.log([r["unknowns"] for r in chosen]), np.log([r[key] for r in chosen]), 1)[0]
    local = [""] + [f"{fitted('seconds_per_step', pair):.2f}" for pair in zip(runs, runs[1:])]
    bench.table(
        ["n", "unknowns", "ms per step", "local exponent", "peak memory, MB", "bytes per unknown",
         "its per step", "solve pairs per step", "factorisations"],
        [[r["n"], r["unknowns"], f"{1e3 * r['seconds_per_step']:.3g}", exponent,
          f"{r['peak_mb']:.0f}", f"{1e6 * r['peak_mb'] / r['unknowns']:.0f}",
          f"{r['iterations'] / r['steps']:.2f}", f"{r['linear_iterations'] / r['steps']:.2f}",
          r["factorisations"]] for r, exponent in zip(runs, local)])
    large = [r for r in runs if r["n"] >= 64]
    bench.say(f"Fitted from n = 64 up: time per step ~ N^{fitted('seconds_per_step', large):.2f}, "
              f"peak memory ~ N^{fitted('peak_mb', large):.2f}. "
              "Demanded: at most N^1.25 and 8590 MB (8 GiB) at n = 1024.\n")


def ranks(bench):
    """1 → 2 ranks, and iterations over ranks."""
    bench.say("## Ranks\n")
    small = min(bench.sizes.steps)
    try:
        bench.signorini(small, steps=2, ranks=2)
    except (Failure, FileNotFoundError) as failure:
        bench.say(f"Left out: {failure}\n")
        return
    n, count = bench.sizes.ranks, bench.sizes.ranks_steps
    seconds = {1: [], 2: []}
    for _ in range(bench.sizes.ranks_rounds):
        for p in seconds:
            seconds[p].append(bench.signorini(n, steps=count, ranks=p)[0]["seconds_per_step"])
    bench.table(["n", "1 rank, ms per step", "2 ranks, ms per step", "1 / 2"],
                [[n, *map(milliseconds, seconds.values()), ratio(seconds[1], seconds[2])]])
    bench.say("Demanded: at least 1.5.\n")
    n = min(n, 128)
    runs = [bench.signorini(n, steps=count, ranks=p) for p in (1, 2, 3, 4)]
    reference = runs[0][1][-1]
    apart = lambda last: max(abs(last[key] / reference[key] - 1) for key in
                             ("displacement_max", "zeta_min", "work", "contact_force"))
    bench.table(["n", "ranks", "its", "solve pairs", "factorisations", "apart from 1 rank"],
                [[n, r["ranks"], r["iterations"], r["linear_iterations"], r["factorisations"],
                  f"{apart(history[-1]):.0e}"] for r, history in runs])


def machine(bench):
    """What it ran on, and whether it had the machine for itself."""
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
                if line.startswith("model name")), platform.machine())
    blas = os.path.realpath("/usr/lib/x86_64-linux-gnu/libblas.so.3")
    bench.say(f"{cpu}, {os.cpu_count()} cores; BLAS {blas}; one thread per process.")
    load = os.getloadavg()[0]
    if load > 0.5:
        bench.say(f"The machine is shared (load {load:.1f} at the start): times are too long, and "
                  "ratios less certain.")
    bench.say()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}")
    parser.add_argument("--binary", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    parser.add_argument("--order", type=int, choices=[1, 2], default=1,
                        help="polynomial degree of the displacements")
    parser.add_argument("--quick", action="store_true", help="small meshes, one round")
    arguments = parser.parse_args()
    if unknown := set(arguments.parts) - set(PARTS):
        parser.error(f"there is no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    sizes = QUICK if arguments.quick else Sizes()
    bench = Bench(arguments.binary.resolve(), arguments.out.resolve(), sizes,
                  arguments.order)
    began = time.perf_counter()
    machine(bench)
    try:
        for part in PARTS:
            if not arguments.parts or part in arguments.parts:
                bench.part = part
                globals()[part](bench)
        summary(bench)
    except Failure as failure:
        sys.exit(f"error: {failure}")
    finally:
        bench.write()
    print(f"{bench.out / 'bench.csv'}, bench.md: {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
