#!/usr/bin/python3
"""Runs a scene with all combinations of some values, as many runs at once as there are cores, and prints their table.

    signorini study geo/lshape.toml --set material.young=1e5,2e5,4e5 --set mesh.size=0.5,0.25

Each run has a folder below OUT, named by its values; OUT/study.csv is the table. A study that was interrupted goes on:
runs that are complete are not repeated, unless the scene or its files have changed. Runs write no frames
(output.every = 0), unless --frames or a --set asks for them; those of one run are made by `signorini run
OUT/NAME/scene.toml --set output.every=1`. A list is split at commas outside brackets and quotes. What follows `--` are
other arguments of `run`.
"""

import argparse
import itertools
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from signorini_summaries import COLUMNS, rows_of, summary_of
from table import printed, refused, write_table

# The longest name of a folder.
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


def inputs_of(scene):
    """The scene's file, its mesh or geometry, and its tables; those that exist."""
    scene = Path(scene)
    text = scene.read_text(encoding="utf-8") if scene.exists() else ""
    names = re.findall(r"""["']([^"'()]+\.(?:geo|msh|csv))["']|table\(["']([^"']+)["']""", text)
    files = [scene, *(scene.parent / name for pair in names for name in pair if name)]
    return [file for file in files if file.exists()]


def command_of(scene, folder, chosen, more):
    """The arguments of a run with these values."""
    sets = [word for key, value in chosen for word in ("--set", f"{key}={value}")]
    return ["run", scene, *sets, "--out", str(folder), *more]


def is_complete(folder, command, inputs):
    """Whether this command has finished in a folder since its inputs were changed last."""
    try:
        summary = summary_of(folder)
    except ValueError:
        return False
    written = (folder / "summary.json").stat().st_mtime
    return ("error" not in summary and summary["provenance"]["command"][1:] == command
            and all(file.stat().st_mtime <= written for file in inputs))


def outcome(folder, error):
    """The summary of a run of the study, or only its error if the run was refused."""
    summary = summary_of(folder) if (folder / "summary.json").exists() else {}
    lines = [line.removeprefix("error: ") for line in error.splitlines() if line.startswith("error")]
    return summary if not error or "error" in summary else {"error": " ".join(lines) or error}


def run(command, runs):
    """Runs the program beside `runs` - 1 others; returns the error, "" if there is none."""
    # Each run has a core of its own.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "SIGNORINI_RUNS": str(runs)}
    command = [os.environ["SIGNORINI"], *command]
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
    if twice := next((key for key in keys if keys.count(key) > 1), None):
        print(f"error: --set {twice} is given twice; write all its values after one: {twice}=A,B,…", file=sys.stderr)
        return 2
    extra = [] if arguments.frames or "output.every" in keys else [("output.every", "0")]
    out = arguments.out or Path("out") / f"{Path(arguments.scene).stem}-study"
    products = itertools.product(*(values for _, values in arguments.set))
    chosen = [list(zip(keys, values)) for values in products]
    folders = [out / name_of(of) for of in chosen]
    if len(set(folders)) < len(folders):
        print("error: two runs would have the same folder: a value is given twice, or values differ only in "
              "signs that are not letters or digits", file=sys.stderr)
        return 2
    commands = [command_of(arguments.scene, folder, of + extra, more) for folder, of in zip(folders, chosen)]
    inputs = inputs_of(arguments.scene)
    open_runs = [(folder, command) for folder, command in zip(folders, commands)
                 if not is_complete(folder, command, inputs)]
    print(f"{len(chosen)} runs, {len(chosen) - len(open_runs)} of them complete", flush=True)
    failed, done = {}, len(chosen) - len(open_runs)
    jobs = max(1, min(arguments.jobs, len(open_runs)))
    with ThreadPoolExecutor(jobs) as pool:
        results = pool.map(lambda of: run(of[1], jobs), open_runs)
        for (folder, command), error in zip(open_runs, results):
            # The memory may suffice for this run alone, after the others.
            error = run(command, 1) if "not enough memory" in error and jobs > 1 else error
            done += 1
            failed.update({folder: error} if error else {})
            print(f"{done}/{len(chosen)} {folder.name}{': ' + error if error else ''}", flush=True)
    summaries = [outcome(folder, failed.get(folder, "")) for folder in folders]
    rows, units = rows_of(folders, summaries, arguments.columns, list(map(dict, chosen)))
    printed(rows, units)
    out.mkdir(parents=True, exist_ok=True)
    write_table(rows, out / "study.csv", units)
    print(out / "study.csv")
    is_refused = refused(arguments.columns, list(filter(None, summaries)))
    return 1 if failed else 2 if is_refused else 0


if __name__ == "__main__":
    sys.exit(main())
