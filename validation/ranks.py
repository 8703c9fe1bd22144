#!/usr/bin/env python3
"""What a cluster would do: iterations, messages and bytes of a step, and the memory of a rank, on 2 to 64 ranks.

The counts do not depend on the machine, so the ranks may share a few cores. `messages.c` counts the calls of MPI. A step is the
difference of two runs with 6 and 12 steps of `square-mild` on the same mesh; each factor is made in both. Prints a table of
Markdown behind validation/SPEED.md: with our factors, MUMPS and gamg.

    ranks.py [--binary PATH] [--n 256] [--ranks 2 4 8 16 32 64] [--factors ours MUMPS gamg]
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from bench import PRECONDITIONERS

ROOT = Path(__file__).resolve().parent.parent
STEPS = (6, 12)


def run(binary, n, ranks, steps, options, folder):
    """The counters of a run (messages, their bytes, collective calls, their bytes, solves) and its memory, MB, of all ranks."""
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
                   "MESSAGES": str(folder / "messages")}
    command = ["mpiexec", "--oversubscribe", "-n", str(ranks), "-x", f"LD_PRELOAD={folder / 'messages.so'}",
               "-x", "MESSAGES", binary, "run", str(ROOT / "geo/square-mild.toml"), "--out", str(folder / "out"), "--set",
               f"mesh.size={1 / n}", "--set", f"time.step={1 / steps}", "--set", "output.every=0", "--set",
               "output.checkpoint=0", "--", *options]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError(f"{ranks} ranks: {done.stderr.strip().splitlines()[-1:]}")
    counted = [float(line) for line in (folder / "messages").read_text().split()]
    rows = list(csv.DictReader(open(folder / "out/history.csv")))
    solves = sum(float(row["linear_iterations"]) for row in rows)
    return [*counted, ranks * solves], json.loads((folder / "out/summary.json").read_text())["peak_megabytes"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/signorini"))
    parser.add_argument("--n", type=int, default=256, help="cells along a side of the square")
    parser.add_argument("--ranks", type=int, nargs="+", default=[2, 4, 8, 16, 32, 64])
    parser.add_argument("--factors", nargs="+", default=list(PRECONDITIONERS), choices=list(PRECONDITIONERS))
    arguments = parser.parse_args()
    print("| ranks | factor | solves | messages | kB sent | collective calls | kB given | MB per rank |\n"
          "|---:|---|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        subprocess.run(["mpicc", "-shared", "-fPIC", "-O1", "-o", folder / "messages.so",
                        Path(__file__).with_name("messages.c")], check=True)
        for ranks in arguments.ranks:
            for factor in arguments.factors:
                options = PRECONDITIONERS[factor]
                try:
                    runs = [run(arguments.binary, arguments.n, ranks, steps, options, folder) for steps in STEPS]
                except RuntimeError as error:
                    print(error, file=sys.stderr)
                    continue
                [before, _], [after, megabytes] = runs
                step = [(b - a) / (STEPS[1] - STEPS[0]) / ranks for a, b in zip(before, after)]
                print(f"| {ranks} | {factor} | {step[4]:.1f} | {step[0]:.0f} | {step[1] / 1e3:.1f} | {step[2]:.0f} | "
                      f"{step[3] / 1e3:.1f} | {megabytes / ranks:.0f} |", flush=True)


if __name__ == "__main__":
    main()
