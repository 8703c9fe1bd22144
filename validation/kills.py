"""Kills runs at random moments and restarts them: the results must be those of runs that were left alone.

    python3 validation/kills.py --binary target/release/signorini --count 50

Every case is run once as a reference. Then `count` times a case is started, killed by SIGKILL (now and then
ended by SIGTERM) after a random part of its time, looked at, and restarted; restarts are killed, too,
with a probability of a half. At the end all result files must have the reference's checksums, but for
seconds. Exit code 1 if any has not.
"""

import argparse
import csv
import hashlib
import io
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import meshio

GEO = Path(__file__).resolve().parent.parent / "geo"
# What a run says of its own time and place.
OF_THE_RUN = ("wall_seconds", "seconds_per_step", "phases", "provenance")

# (scene, arguments, ranks)
CASES = [
    ("lshape-rolling", ["--set", "time.step=0.005"], 1),
    ("lshape-rolling", ["--set", "time.step=0.01", "--solver", "penalty-duality"], 1),
    ("lshape-rolling", ["--set", "time.step=0.01", "--solver", "tao"], 1),
    ("lshape-rolling", ["--set", "time.step=0.01"], 2),
    ("beam", ["--set", "time.step=0.005"], 1),
    ("square-mild", ["--set", "time.step=auto", "--set", "time.tolerance=1e-4"], 1),
    ("square-mild", ["--set", "time.step=auto", "--set", "time.tolerance=1e-3"], 2),
    ("square-table1", ["--set", "discretisation.displacement=2", "--set", "time.step=0.005"], 1),
    ("lshape", ["--accuracy", "0.03"], 1),
    ("bridge", ["--set", "time.step=0.001", "--set", "output.every=1"], 1),
]


def command(binary, case, out):
    scene, arguments, ranks = case
    run = [binary, "run", f"{GEO / scene}.toml", *arguments, "--set", "output.checkpoint=0.05",
           "--out", str(out)]
    return run if ranks == 1 else ["mpiexec", "-n", str(ranks), "--oversubscribe", *run]


def start(binary, case, out, restart):
    arguments = command(binary, case, out) + (["--restart"] if restart else [])
    return subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            start_new_session=True)


def digest(folder):
    """The checksums of all files, without what tells how long the run took."""
    sums = {}
    for file in sorted(folder.iterdir()):
        content = file.read_bytes()
        if file.name == "history.csv":
            rows = csv.DictReader(io.StringIO(content.decode()))
            rows = [{key: row[key] for key in row if key != "seconds"} for row in rows]
            content = json.dumps(rows).encode()
        elif file.name == "summary.json":
            summary = {k: v for k, v in json.loads(content).items() if k not in OF_THE_RUN}
            content = json.dumps(summary, sort_keys=True).encode()
        sums[file.name] = hashlib.sha256(content).hexdigest()
    return sums


def look(folder):
    """What a kill has left opens: the list, every frame that it names, whole rows."""
    listed = folder / "fields.pvd"
    if not listed.exists():
        return
    frames = ElementTree.parse(listed).findall(".//DataSet")
    for frame in frames[-2:]:
        file = folder / frame.get("file")
        if file.suffix == ".vtu":
            meshio.read(file)
        else:
            for piece in ElementTree.parse(file).findall(".//Piece"):
                meshio.read(folder / piece.get("Source"))
    history = (folder / "history.csv").read_text()
    if not history.endswith("\n"):
        raise ValueError("a row of history.csv is cut off")


def end(process, kind):
    """Kills the run's own processes; mpiexec then ends by itself."""
    children = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process.pid)],
                              capture_output=True, text=True).stdout.split()
    for pid in [int(child) for child in children] or [process.pid]:
        try:
            os.kill(pid, kind)
        except ProcessLookupError:
            pass
        if kind == signal.SIGKILL and children:
            break  # One rank: mpiexec ends the others.
    return process.communicate(timeout=120)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default="target/release/signorini")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    binary = str(Path(arguments.binary).resolve())
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", RUST_BACKTRACE="0")
    kills = restarts = resumed = bad = 0
    with tempfile.TemporaryDirectory() as scratch:
        references = []
        for number, case in enumerate(CASES):
            out, began = Path(scratch) / f"reference{number}", time.monotonic()
            said, _ = (process := start(binary, case, out, False)).communicate()
            if process.returncode:
                sys.exit(f"the reference fails: {case}\n{said}")
            references.append((digest(out), time.monotonic() - began))
        runs = 0
        while kills < arguments.count:
            number, runs = runs % len(CASES), runs + 1
            (expected, seconds), out = references[number], Path(scratch) / f"killed{runs}"
            restart = False
            while True:
                process = start(binary, CASES[number], out, restart)
                kill = kills < arguments.count and (not restart or draw.random() < 0.5)
                said = ""
                if kill:
                    kind = signal.SIGTERM if draw.random() < 0.2 else signal.SIGKILL
                    time.sleep(draw.uniform(0.1, 0.9) * seconds)
                    said = end(process, kind)
                else:
                    said = process.communicate()[0]
                restarts += restart
                resumed += "  restart " in said
                if process.returncode == 0:
                    break
                if not kill:
                    print(f"FAILS {CASES[number]}: {said[-500:]}")
                    bad += 1
                    break
                kills += 1
                if kind == signal.SIGTERM and CASES[number][2] == 1 and process.returncode not in (143, 0):
                    print(f"SIGTERM gave exit code {process.returncode}: {said[-300:]}")
                    bad += 1
                if out.exists():
                    look(out)
                restart = True
            found = digest(out)
            wrong = [name for name in sorted({*expected, *found}) if expected.get(name) != found.get(name)]
            if wrong:
                print(f"DIFFERS {CASES[number]}: {', '.join(wrong[:6])}")
                bad += 1
            print(f"{kills} kills, {restarts} restarts, {resumed} of them from a checkpoint, "
                  f"{bad} wrong", flush=True)
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
