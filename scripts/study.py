#!/usr/bin/python3
"""Runs a scene with all combinations of some values, as many runs at once as there are cores, and prints their table.

    signorini study geo/lshape.toml --set material.young=1e5,2e5,4e5 --set mesh.size=0.5,0.25

Each run has a folder below OUT, named by its values; OUT/study.csv is the table. A study that was interrupted goes on:
runs that are complete are not repeated. Runs write no frames (output.every = 0), unless --frames or a --set asks for
them; `signorini run OUT/NAME/scene.toml --set output.every=1` makes those of one run. A list is split at commas outside
brackets and quotes. What follows `--` are other arguments of `run`.
"""

import argparse
import csv
import itertools
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from table import COLUMNS, printed, rows_of, settings_of

# The end of the line of a study's longest name of a folder.
LONGEST = 120


def values_of(text):
    """KEY and its values, from KEY=A,B,C."""
    key, separator, values = text.partition("=")
    if not separator:
        raise argparse.ArgumentTypeError(f"{text}: write KEY=VALUE or KEY=VALUE,VALUE,…")
    found, part, depth, quote = [], "", 0, ""
    for letter in values:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        else:
            depth += (letter in "[{(") - (letter in "]})")
        if letter == "," and not depth and not quote:
            found.append(part)
            part = ""
        else:
            part += letter
    return key.strip(), [part.strip() for part in [*found, part]]


def name_of(chosen):
    """The name of a run's folder from its values."""
    parts = [f"{key.rpartition('.')[2]}={value}" for key, value in chosen]
    return re.sub(r"[^\w.=+-]", "_", ",".join(parts).replace(",", "__"))[:LONGEST] or "run"


def is_complete(folder, chosen):
    """Whether a run with these values has finished in a folder."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    given = settings_of(summary)
    return "error" not in summary and all(given.get(key) == value for key, value in chosen)


def run(scene, folder, chosen, more):
    """Runs the scene with these values into a folder; returns the error, "" if there is none."""
    sets = [word for key, value in chosen for word in ("--set", f"{key}={value}")]
    command = [os.environ["SIGNORINI"], "run", scene, *sets, "--out", str(folder), *more]
    # Each run has a core of its own.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    ended = subprocess.run(command, capture_output=True, text=True, env=environment)
    return ended.stderr.strip() if ended.returncode else ""


def main(prog=None):
    """Returns the exit code: 1 if a run failed, 2 if its input is bad."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", metavar="SCENE")
    parser.add_argument("--set", action="append", type=values_of, default=[], metavar="KEY=A,B,…",
                        help="values of a key; may be repeated")
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: out/SCENE-study")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once")
    parser.add_argument("--frames", action="store_true", help="with frames, as `run` writes them")
    parser.add_argument("--columns", type=lambda text: text.split(","), default=COLUMNS, metavar=(
        "NAME,…"), help="of the table, as for `signorini table`")
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    arguments, more = parser.parse_args(words[:cut]), words[cut + 1:]
    keys = [key for key, _ in arguments.set]
    extra = [] if arguments.frames or "output.every" in keys else [("output.every", "0")]
    out = arguments.out or Path("out") / f"{Path(arguments.scene).stem}-study"
    products = itertools.product(*(values for _, values in arguments.set))
    chosen = [list(zip(keys, values)) for values in products]
    folders = [out / name_of(of) for of in chosen]
    if len(set(folders)) < len(folders):
        print("error: two runs would have the same folder; values are given twice", file=sys.stderr)
        return 2
    open_runs = [(folder, of + extra) for folder, of in zip(folders, chosen)
                 if not is_complete(folder, of + extra)]
    print(f"{len(chosen)} runs, {len(chosen) - len(open_runs)} of them complete", flush=True)
    # One run meshes the geometry first, if the runs share it.
    failed, done = {}, len(chosen) - len(open_runs)
    with ThreadPoolExecutor(max(1, arguments.jobs)) as pool:
        results = pool.map(lambda of: run(arguments.scene, *of, more), open_runs)
        for (folder, _), error in zip(open_runs, results):
            done += 1
            failed.update({folder: error} if error else {})
            print(f"{done}/{len(chosen)} {folder.name}{': ' + error if error else ''}", flush=True)
    rows = rows_of([folder for folder in folders if (folder / "summary.json").exists()],
                   arguments.columns)
    if rows:
        printed(rows, False)
        with open(out / "study.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(dict.fromkeys(name for row in rows for name in row)))
            writer.writeheader()
            writer.writerows(rows)
        print(out / "study.csv")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
