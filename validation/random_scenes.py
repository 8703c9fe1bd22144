#!/usr/bin/python3
"""Verifies the program on random scenes: random_scenes.py [--count N] [--seed S] [--order 2] …

Each scene (`random_draw`) is run with a random solver on one to three ranks, and `judge` verifies its answer by code
that shares nothing with the program. Some scenes have P2 displacements, curved sides, several materials or moving
gaps. Writes out/random/scenes.csv. Wrong or wrongly refused scenes are kept in out/random/failures/ID and make the
exit code 1; `--again ID` repeats one of them. (`judge_check` checks the verification itself.)
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from pathlib import Path

# The matrices of the verification are small: threads would only wait for each other.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", SCOTCH_PTHREAD_NUMBER="1")

from shared import parser_of  # noqa: E402
from server import Server  # noqa: E402
from judge import Verdict, judge  # noqa: E402
from random_bodies import write_msh  # noqa: E402
from random_draw import draw, vary  # noqa: E402
from results import write_table  # noqa: E402
from scene import read_scene, solvers, write_scene  # noqa: E402

LIMIT = 120  # seconds a run may take, on a busy machine
# Waiting ranks yield their cores.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_mpi_yield_when_idle": "1"}
BAD = ("wrong", "refused wrongly", "no verdict")


@cache
def server(binary):
    """The server of this process."""
    return Server(binary, output=True, env=ENVIRONMENT)


def run(binary, folder, solver, ranks):
    """Runs folder/scene.toml into folder/out; returns (exit code, output), None out of time."""
    words = lambda at: ["run", str(at / "scene.toml"), "--out", str(at / "out"), "--solver", solver]
    command = [str(binary), *words(Path())]
    if ranks > 1:
        command = ["mpiexec", "--oversubscribe", "-n", str(ranks), *command]
    (folder / "command").write_text(" ".join(command) + "\n")
    output = folder / "log"
    if ranks == 1:
        try:
            code, text = server(binary).run(words(folder), LIMIT)
        except TimeoutError:
            code, text = None, ""
        output.write_text(text.replace(f"{folder}/", ""))
        return code, output.read_text()
    with open(output, "w") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, env=ENVIRONMENT, start_new_session=True)
        try:
            code = process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGTERM)  # mpiexec ends its ranks
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:  # a step without end
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            code = None
    return code, output.read_text(errors="replace")


def examine(folder, binary, solver, ranks):
    """Runs and verifies the scene in a folder; returns the verdict and the seconds of the run."""
    started = time.perf_counter()
    code, output = run(binary, folder, solver, ranks)
    if code == 1 and "MPI_INIT" in output:  # Open MPI did not start, which is no fault of the program
        code, output = run(binary, folder, solver, ranks)
    seconds = time.perf_counter() - started
    try:
        if code is None:
            return Verdict("wrong", f"no end within {LIMIT} s"), seconds
        verdict = judge(folder, code, output)
        advised = re.search(r"double precision reaches only about (\S+) here", output)
        if verdict.word == "refused wrongly" and advised:
            return follow(folder, binary, solver, ranks, float(advised[1])), seconds
        return verdict, seconds
    except Exception:  # an error of the verification must be visible and not end the other scenes
        return Verdict("no verdict", traceback.format_exc(limit=-2).replace("\n", " | ")), seconds


def follow(folder, binary, solver, ranks, tolerance):
    """Follows the program's advice if rounding errors exceed the tolerance: repeats the scene with the advised tolerance and
    a little more."""
    advised = folder / "advised"
    advised.mkdir(exist_ok=True)
    shutil.copy(folder / "mesh.msh", advised)
    scene = read_scene(folder / "scene.toml")
    write_scene({**scene, "contact": {"tolerance": 2 * tolerance}}, advised / "scene.toml")
    verdict = judge(advised, *run(binary, advised, solver, ranks))
    if verdict.word in BAD:
        verdict.reason = f"after the advice to set the tolerance: {verdict.reason}"
        return verdict
    verdict.word = "right as advised"
    return verdict


def one(binary, out, seed, number, solver, order):
    """Draws, runs and verifies scene `number`; keeps its files if it failed."""
    case = draw(seed, number, solvers(binary))
    case.solver = solver or case.solver
    vary(case, seed, number, order)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_msh(case.mesh, folder / "mesh.msh")
        write_scene(case.scene, folder / "scene.toml")
        verdict, seconds = examine(folder, binary, case.solver, case.ranks)
        row = {"id": f"{seed}-{number}", "kind": case.kind, "solver": case.solver,
               "ranks": case.ranks, "nodes": len(case.mesh.nodes),
               "traits": verdict.traits, "verdict": verdict.word,
               "difference": f"{verdict.difference:.1e}", "seconds": f"{seconds:.2f}",
               "reason": verdict.reason}
        if verdict.word in BAD:
            kept = out / "failures" / row["id"]
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(folder, kept)
            (kept / "verdict.json").write_text(json.dumps(row, indent=1) + "\n")
    return row


def summarise(rows):
    """The number of each verdict per kind, solver and number of ranks; then the reasons of refusals and failures."""
    words = ("right", "right as advised", "imprecise", "either", "refused rightly", "gave up", *BAD)
    lines = [f"{'':<16}" + "".join(f"{word:>18}" for word in words)]
    for column in ("kind", "solver", "ranks"):
        for name in sorted({str(row[column]) for row in rows}):
            of = Counter(row["verdict"] for row in rows if str(row[column]) == name)
            lines.append(f"{name:<16}" + "".join(f"{of[word]:>18}" for word in words))
    reasons = Counter((row["verdict"], re.sub(" at t = [0-9.e-]+", "", row["reason"]))
                      for row in rows if row["verdict"].startswith("refused"))
    lines += [f"{count:5} {word}: {reason}" for (word, reason), count in reasons.most_common()]
    lines += [f"{row['id']} {row['kind']} [{row['traits']}] {row['solver']} x{row['ranks']} "
              f"{row['verdict']}: {row['reason']}" for row in rows if row["verdict"] in BAD]
    return "\n".join(lines)


def main():
    parser = parser_of(__doc__, "random")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--solver", help="this one instead of the one drawn")
    parser.add_argument("--order", type=int, choices=[1, 2], help="of the displacements (default: drawn)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--again", help="run a kept scene once more")
    arguments = parser.parse_args()
    binary, out = arguments.binary, arguments.out.resolve()
    if arguments.again:
        folder = out / "failures" / arguments.again
        row = json.loads((folder / "verdict.json").read_text())
        verdict, _ = examine(folder, binary, row["solver"], row["ranks"])
        print(f"{verdict.word}: {verdict.reason}")
        return int(verdict.word in BAD)
    out.mkdir(parents=True, exist_ok=True)
    numbers = range(arguments.first, arguments.first + arguments.count)
    rows = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        runs = [pool.submit(one, binary, out, arguments.seed, n, arguments.solver, arguments.order) for n in numbers]
        for done in as_completed(runs):
            rows.append(done.result())
    rows.sort(key=lambda row: int(row["id"].split("-")[1]))
    write_table(rows, out / "scenes.csv")
    print(summarise(rows))
    return int(any(row["verdict"] in BAD for row in rows))


if __name__ == "__main__":
    sys.exit(main())
