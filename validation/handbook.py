#!/usr/bin/python3
"""Problems with published or closed answers against the program: handbook.py [--binary FILE] [NAME…] [--modes P1 0.01 …]

A scene of handbook/ has its truth in comments, one line for each figure of summary.json:

    # let a = 0.04                                     a name for the lines below
    # truth foundation.force_y = 3e4 * a               the exact value: Python, `math`, `root`, `integral`
    # truth D.stress_yy = 92.7e6 ± 5e4                 a published value with its own error
    # refused: the mesh has 2 pieces                   the program must refuse the scene with these words
    # refused with --accuracy: turns over              the same in these modes

Every scene runs with uniform triangles of the first and the second order and `--bars`, and with `--accuracy`. A bar holds
if it covers the error and the truth's own error. "Reached" is true if no error exceeds the accuracy times the largest value
of its kind in the run, except those of extremes that are printed as singular or not resolved. The held-out half of the scenes
has names with an odd hash: change the program by the other half.
Writes OUT/handbook.csv, a row for each figure of each run. Exit code 1 if a bar or a "reached" does not hold.
"""

import csv
import hashlib
import json
import math
import re
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

from shared import parser_of, scales

SCENES = Path(__file__).with_suffix("")
MODES = {"P1": ["--bars"], "P2": ["--bars", "--set", "discretisation.displacement=2"],
         **{accuracy: ["--accuracy", accuracy] for accuracy in ("0.1", "0.03", "0.01")}}
KINDS = {"work": "work", "displacement_max": "displacements", "contact_length": "contact length", "pressure_max":
         "stress extremes", "stopped_at": "stop time"}
# An error below this part of the figure's scale is rounding, and not in the tables.
ROUNDING = 1e-7
# Seconds for a run, and bytes of its address space.
LIMIT, SPACE = 60, 6 << 30


def root(function, low, high):
    """The root of a function between two points where its signs differ."""
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if function(low) * function(middle) > 0 else (low, middle)
    return middle


def integral(function, low, high, panels=20):
    """∫ of a function by Gauss' rule with three points in each panel."""
    half = (high - low) / panels / 2
    middles = [low + (2 * k + 1) * half for k in range(panels)]
    return half * sum(weight * function(x + place * half) for x in middles
                      for place, weight in ((-math.sqrt(0.6), 5 / 9), (0, 8 / 9), (math.sqrt(0.6), 5 / 9)))


def truths(text):
    """The truths of a scene by figure, (value, own error), and the words of its refusals, by "" or an option."""
    names, found, refused = {**vars(math), "root": root, "integral": integral}, {}, {}
    for word, rest in re.findall(r"^# (let|truth|refused:|refused with --accuracy:) (.*)$", text, re.MULTILINE):
        name, _, value = (part.strip() for part in rest.partition("="))
        if word.startswith("refused"):
            refused[word.removeprefix("refused").removeprefix(" with ").rstrip(":")] = rest.strip()
        elif word == "let":
            exec(rest, names)
        else:
            found[name] = [*(float(eval(part, names)) for part in value.split("±")), 0.0][:2]
    return found, refused


def kind(figure):
    """The kind of a figure, for the tables."""
    last = figure.rpartition(".")[2]
    if last in KINDS:
        return KINDS[last]
    starts = {"zeta": "damage", "u_": "displacements", "principal": "stress extremes", "von_mises_max": "stress extremes",
              "stress": "stress at probes", "von_mises": "stress at probes", "acts_at": "places"}
    return next((of for start, of in starts.items() if last.startswith(start)), "forces")


def values(summary):
    """All figures of a summary by name, and the time of a stop."""
    return {"stopped_at": summary["stopped_at"], **{name: of["value"] for name, of in summary["figures"].items()}}


def number(text):
    """A cell of history.csv; empty cells and values without contact count as 0."""
    value = float(text or 0)
    return value if math.isfinite(value) else 0.0


def run(binary, path, out, options):
    """(summary or None, messages, seconds) of a run."""
    started = time.perf_counter()
    command = [str(binary), "run", str(path), "--out", str(out), *options]
    try:
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (SPACE, SPACE))
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, preexec_fn=limit)
        said = done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        said = f"no end within {LIMIT} s"
    summary = out / "summary.json"
    return json.loads(summary.read_text()) if summary.exists() else None, said, time.perf_counter() - started


def rows_of(path, mode, truth, summary, out):
    """A row for each figure of a run that has a truth."""
    with open(out / "history.csv", newline="", encoding="utf-8") as file:
        history = [{name: number(text) for name, text in row.items()} for row in csv.DictReader(file)]
    given, bars = values(summary), {name: of["bar"] for name, of in summary["figures"].items()}
    bars["stopped_at"] = summary.get("stopped_uncertainty")
    rows = [*history, {k: v for k, v in given.items() if v is not None}]
    # Displacements are those of probes, not the means of boundaries.
    of_boundary = lambda name: ".u_" in name and f"{name.rpartition('.')[0]}.zeta" not in given
    scale = scales(rows, {*truth, *(name for row in rows for name in row if not of_boundary(name))})
    held_out = hashlib.sha1(path.stem.encode()).digest()[0] % 2
    for figure, (exact, own) in truth.items():
        value, bar = given.get(figure), bars.get(figure)
        error = None if value is None else abs(value - exact)
        extreme = summary["figures"].get(figure) or {}
        unsettled = any(extreme.get(flag) is not None for flag in ("singular", "unresolved"))
        yield {"scene": path.stem, "half": "held out" if held_out else "open", "mode": mode, "figure": figure,
               "kind": kind(figure), "value": value, "truth": exact, "own": own, "bar": bar, "error": error,
               "scale": max(scale[figure], abs(exact)), "unsettled": unsettled,
               "holds": None if error is None or bar is None else error <= bar + own, "reached": summary.get("reached")}


def reached_is_true(rows):
    """None without "reached", else whether all figures of a run are within the accuracy."""
    if rows[0]["reached"] is not True:
        return None
    # A value of 0 without another one of its kind has no scale; places have none.
    rows = [row for row in rows if row["kind"] != "places" and not row["unsettled"] and
            not (row["truth"] == 0 and row["error"] > 0.999 * row["scale"])]
    return all(row["error"] is not None and row["error"] <= float(row["mode"]) * row["scale"] + row["own"] for row in rows)


def held(rows):
    """How many bars of some rows hold where the error is no rounding, and the median of bar over error."""
    bars = [row for row in rows if row["holds"] is not None and row["error"] > ROUNDING * row["scale"]]
    ratios = [row["bar"] / row["error"] for row in bars if row["error"] > 10 * row["own"]]
    return f"{sum(row['holds'] for row in bars)} of {len(bars)}" + (f" ({median(ratios):.2g})" if ratios else "")


def tables(rows):
    """Prints the bars that hold by kind and mode, and "reached" by mode and half of the scenes."""
    modes = grouped(rows, lambda row: row["mode"])
    print("\nBars that hold, errors of rounding left out (median of bar over error)\n")
    print(f"| kind | {' | '.join(modes)} |\n|---{'|---' * len(modes)}|")
    for kind, of in grouped([row for row in rows if row["kind"] != "places"], lambda row: row["kind"]).items():
        cells = (held([row for row in of if row["mode"] == mode]) for mode in modes)
        print(f"| {kind} | {' | '.join(cells)} |")
    print("\n| half, mode | bars hold | no bar | reached | of these true |\n|---|---|---|---|---|")
    for head, of in grouped(rows, lambda row: f"{row['half']}, {row['mode']}").items():
        runs = {row["scene"]: row for row in of if row["reached"] is not None}
        reached = [row for row in runs.values() if row["reached"]]
        print(f"| {head} | {held(of)} | {sum(row['holds'] is None for row in of)} | {len(reached)} of {len(runs)} | "
              f"{sum(row['true'] for row in reached)} |")


def grouped(rows, key):
    """Rows by a key, in the order of the keys."""
    groups = {}
    for row in sorted(rows, key=key):
        groups.setdefault(key(row), []).append(row)
    return groups


def main():
    parser = parser_of(__doc__, "handbook")
    parser.add_argument("--modes", nargs="+", default=list(MODES), choices=list(MODES))
    parser.add_argument("names", nargs="*", help="of scenes, if not all")
    arguments = parser.parse_args()
    folder = arguments.out / "scenes"
    shutil.copytree(SCENES, folder, dirs_exist_ok=True)
    rows, wrong = [], 0
    for path in sorted(folder.glob("*.toml")):
        if not (SCENES / path.name).exists() or arguments.names and path.stem not in arguments.names:
            continue
        truth, refusals = truths(path.read_text(encoding="utf-8"))
        for mode in arguments.modes:
            refused = refusals.get("") or refusals.get(MODES[mode][0])
            out = arguments.out / f"{path.stem}-{mode}"
            shutil.rmtree(out, ignore_errors=True)
            summary, said, seconds = run(arguments.binary, path, out, MODES[mode])
            if refused or summary is None:
                good = refused is not None and summary is None and refused in said
                wrong += not good
                print(f"{path.stem:<22} {mode:<4} {'refused, as it should be' if good else f'WRONG: {said.strip()[-300:]}'}",
                      flush=True)
                continue
            new = list(rows_of(path, mode, truth, summary, out))
            true = reached_is_true(new)
            cost = {"true": true, "seconds": round(seconds, 2), "megabytes": summary["peak_megabytes"]}
            rows += [{**row, **cost} for row in new]
            missed = [f"{row['figure']} {row['value']:.8g} ± {row['bar']:.2g} for {row['truth']:.8g}" for row in new
                      if row["holds"] is False] + [f"no {row['figure']}" for row in new if row["value"] is None]
            wrong += len(missed) + (true is False)
            print(f"{path.stem:<22} {mode:<4} {seconds:5.1f} s {summary['peak_megabytes']:4.0f} MB"
                  f"{'' if summary.get('reached') is None else ', reached' if summary['reached'] else ', NOT reached'}"
                  f"{', WHICH IS FALSE' if true is False else ''}{'; ' if missed else ''}{'; '.join(missed)}", flush=True)
    if rows:
        with open(arguments.out / "handbook.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        tables(rows)
        seconds = {(row["scene"], row["mode"]): row["seconds"] for row in rows}
        print(f"\n{len(seconds)} runs in {sum(seconds.values()):.0f} s, "
              f"{max(row['megabytes'] for row in rows):.0f} MB at most")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
