#!/usr/bin/python3
"""Problems with published or closed answers against the program: handbook.py [--binary FILE] [NAME…] [--modes P1 0.01 …]
[--scenes FOLDER]

A scene of handbook/, or of FOLDER, has its truth in comments, one line for each figure of summary.json:

    # let a = 0.04                                     a name for the lines below
    # truth foundation.force_y = 3e4 * a               the exact value: Python, `math`, `root`, `integral`
    # truth D.stress_yy = 92.7e6 ± 5e4                 a published value with its own error
    # no value: tip.stress_xx                          the stress at this probe depends on the direction, or is infinite
    # infinite: von_mises_max                          an extreme that no mesh determines
    # refused: the mesh has 2 pieces                   the program must refuse the scene with these words
    # refused with --accuracy: turns over              the same in these modes

Every scene runs with uniform triangles of the first and the second order and `--bars`, and with `--accuracy`. A bar holds
if it covers the error and the truth's own error. Figures without a value have labels; a bar of one does not hold. "Reached"
is true if no error exceeds the accuracy times the largest value of its kind in the run, except those of extremes that are
printed as singular or not resolved. The held-out half of the scenes has names with an odd hash: change the program by the
other half. The last table counts the finite extremes that are printed as singular or as not resolved.
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
    """The truths of a scene by figure, (value, own error), and the words of its refusals, by "" or an option. A figure
    without a value has NaN."""
    names, found, refused = {**vars(math), "root": root, "integral": integral}, {}, {}
    words = "let|truth|no value:|infinite:|refused:|refused with --accuracy:"
    for word, rest in re.findall(rf"^# ({words}) (.*)$", text, re.MULTILINE):
        name, _, value = (part.strip() for part in rest.partition("="))
        if word in ("no value:", "infinite:"):
            found[name] = [math.nan, 0.0]
        elif word.startswith("refused"):
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
        without = math.isnan(exact)
        error = None if value is None else abs(value - exact)
        labels = summary["figures"].get(figure) or {}
        label = next((flag for flag in ("singular", "unresolved") if labels.get(flag) is not None), None)
        yield {"scene": path.stem, "half": "held out" if held_out else "open", "mode": mode, "figure": figure,
               "kind": "without a value" if without else kind(figure), "value": value, "truth": exact, "own": own, "bar": bar,
               "error": error, "scale": max(scale[figure], abs(exact)), "label": label, "reason": labels.get(label),
               "holds": None if error is None or bar is None else error <= bar + own, "reached": summary.get("reached")}


def reached_is_true(rows):
    """None without "reached", else whether all figures of a run are within the accuracy."""
    if rows[0]["reached"] is not True:
        return None
    # A value of 0 without another one of its kind has no scale; places have none.
    rows = [row for row in rows if row["kind"] not in ("places", "without a value") and not row["label"] and
            not (row["truth"] == 0 and row["error"] > 0.999 * row["scale"])]
    return all(row["error"] is not None and row["error"] <= float(row["mode"]) * row["scale"] + row["own"] for row in rows)


def held(rows):
    """How many bars of some rows hold where the error is no rounding, and the median of bar over error."""
    bars = [row for row in rows if row["holds"] is not None and not row["error"] <= ROUNDING * row["scale"]]
    ratios = [row["bar"] / row["error"] for row in bars if row["error"] > 10 * row["own"]]
    return f"{sum(row['holds'] for row in bars)} of {len(bars)}" + (f" ({median(ratios):.2g})" if ratios else "")


def tables(rows):
    """Prints the bars that hold by kind and mode, "reached" by mode and half of the scenes, and the labels of extremes."""
    modes = grouped(rows, lambda row: row["mode"])
    print("\nBars that hold, errors of rounding left out (median of bar over error)\n")
    print(f"| kind | {' | '.join(modes)} |\n|---{'|---' * len(modes)}|")
    for kind, of in grouped([row for row in rows if row["kind"] != "places"], lambda row: row["kind"]).items():
        cells = (held([row for row in of if row["mode"] == mode]) for mode in modes)
        print(f"| {kind} | {' | '.join(cells)} |")
    print("\n| half, mode | bars hold | no bar | reached | of these true |\n|---|---|---|---|---|")
    halves = grouped(rows, lambda row: f"{row['half']}, {row['mode']}")
    for head, of in {**halves, **{f"all, {mode}": of for mode, of in modes.items()}}.items():
        runs = {row["scene"]: row for row in of if row["reached"] is not None}
        reached = [row for row in runs.values() if row["reached"]]
        print(f"| {head} | {held(of)} | {sum(row['holds'] is None for row in of)} | {len(reached)} of {len(runs)} | "
              f"{sum(row['true'] for row in reached)} |")
    print("\n| mode | finite extremes | singular | not resolved | infinite | with a bar | probes without a value | with a bar |")
    print("|---|---|---|---|---|---|---|---|")
    share = lambda of, label: f"{100 * sum(row['label'] == label for row in of) / max(len(of), 1):.1f} %"
    with_bar = lambda of: f"{len(of)} | {sum(row['bar'] is not None for row in of)}"
    for mode, of in modes.items():
        extremes = [row for row in of if is_extreme(row["figure"])]
        finite = [row for row in extremes if row["kind"] != "without a value"]
        infinite = [row for row in extremes if row["kind"] == "without a value"]
        points = [row for row in of if row["kind"] == "without a value" and not is_extreme(row["figure"])]
        print(f"| {mode} | {len(finite)} | {share(finite, 'singular')} | {share(finite, 'unresolved')} | "
              f"{with_bar(infinite)} | {with_bar(points)} |")


def is_extreme(figure):
    """Whether a figure is an extreme of stress or of contact pressure."""
    return kind(figure) == "stress extremes"


def grouped(rows, key):
    """Rows by a key, in the order of the keys."""
    groups = {}
    for row in sorted(rows, key=key):
        groups.setdefault(key(row), []).append(row)
    return groups


def main():
    parser = parser_of(__doc__, "handbook")
    parser.add_argument("--modes", nargs="+", default=list(MODES), choices=list(MODES))
    parser.add_argument("--scenes", type=Path, default=SCENES, help="their folder")
    parser.add_argument("names", nargs="*", help="of scenes, if not all")
    arguments = parser.parse_args()
    folder = arguments.out / "scenes"
    shutil.copytree(arguments.scenes, folder, dirs_exist_ok=True)
    rows, wrong = [], 0
    for path in sorted(folder.glob("*.toml")):
        if not (arguments.scenes / path.name).exists() or arguments.names and path.stem not in arguments.names:
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
