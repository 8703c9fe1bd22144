#!/usr/bin/python3
"""The promises of `--accuracy`, checked on forty bodies that are not shipped: promises.py [--binary FILE] [NAME…]

Runs the scenes of scenes.py with `--accuracy` 0.1, 0.03 and 0.01 and compares every printed figure of
the last state with a truth: quadratic elements on a fine mesh that is graded to the corners and to the
features that the scene names, with hundreds of uniform steps of second order. It depends on no estimate. A second
truth with 1.6 times the sizes and steps tells the first one's own error: their difference. Truths are kept in FOLDER/NAME-FACTOR (--truth).

An error counts relative to the figure's scale, the largest value in the truth's run: of the largest 1 − ζ for
`zeta_min` and ζ at a probe, of its mean for `zeta_mean`, of all components of all supports for forces, of all probes' for a kind of probe. Bars are
`figures` in summary.json where the program writes them. Writes FOLDER/promises.csv (--out): a row for each
figure of each run. Exit code 1 if a bar or a "reached" does not hold.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from shared import ROOT, parser_of, scales
from references import kept
from results import read_table, write_table
from scene import SceneError
from scenes import scenes, texts, write
from true_errors import Run, errors

# Sizes of the second truth over those of the first.
COARSER = 1.6
# A force below this part of the largest one, or a damage below this, is a rounding error.
ROUNDING = 1e-9
# Seconds for a run, on a busy machine.
LIMIT = 240


def make(binary, scene, folder, factor):
    """The results of a scene's truth with its sizes times a factor."""
    geometry, content = texts(scene, factor)
    try:
        return kept(binary, folder / f"{scene.name}-{factor:g}", content, geometry, limit=LIMIT)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError) as error:
        raise SceneError(str(error)) from None


def run(binary, path, out, accuracy):
    """The summary of a run of a scene on one rank."""
    command = [binary, "run", path, "--out", out, "--accuracy", accuracy]
    try:
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        raise SceneError(f"no end within {LIMIT} s") from None
    summary = out / "summary.json"
    if not summary.exists():
        raise SceneError((done.stderr or done.stdout).strip())
    return json.loads(summary.read_text())


def figures(summary):
    """The printed figures by name."""
    names = ["work", "displacement_max", "contact_force"]
    names += ["zeta_min", "zeta_mean"] if summary["errors"]["damage_steps"] is not None else []
    # Truths do not know the ends of contact well enough.
    left_out = ("moment", "contact_", "pressure_max", "peak_", "acts_at_")
    values = {name: of["value"] for name, of in summary["figures"].items()}
    supports = {name.rpartition(".")[0] for name in values if name.endswith(".moment")}
    probes = {name.rpartition(".")[0] for name in values if name.endswith(".zeta")}
    of_parts = {name for name in values if name.rpartition(".")[0] in probes
                or name.rpartition(".")[0] in supports and "force" in name}
    names += [name for name in values if name in of_parts and not name.rpartition(".")[2].startswith(left_out)]
    return {name: values.get(name, 0.0) for name in names}


class Truth:
    """A scene's truth, with its own errors."""

    def __init__(self, binary, scene, folder):
        fine, coarse = (make(binary, scene, folder, factor) for factor in (1.0, COARSER))
        self.scene = scene
        self.run, other = Run(fine), Run(coarse)
        self.figures = figures(self.run.summary)
        if self.run.summary["stopped_at"] is not None:
            raise SceneError("the truth stops at ζ_*")
        self.own = {name: abs(figures(other.summary)[name] - value) for name, value in self.figures.items()}
        self.scales = scales(read_table(fine / "history.csv"), self.figures)
        self.norms = self.errors(other)

    def errors(self, run):
        """The errors of u in the energy norm and of the damage in L², by name; only those with a meaning."""
        with np.errstate(invalid="ignore", divide="ignore"):
            found = zip(("u", "damage"), errors(self.run, run))
        return {name: error for name, error in found if error is not None and error < 1e3}


def compare(truth, summary, result, accuracy, seconds):
    """A row for each figure of a run."""
    notes = [note for note in summary["notes"] if note.startswith("accuracy ")]
    told = "NOT reached" if any("NOT" in note for note in notes) else "reached" if notes else "?"
    head = {"scene": truth.scene.name, "accuracy": accuracy, "told": told, "seconds": f"{seconds:.2f}"}
    given, bars = summary["errors"], {name: of["bar"] for name, of in summary["figures"].items()}
    force = max(scale for name, scale in truth.scales.items() if "force" in name)
    for name, value in figures(summary).items():
        scale, bar = truth.scales[name], bars.get(name)
        # The truth contains only rounding errors: no load does work, no foundation is touched.
        if scale <= (ROUNDING * force if "force" in name else ROUNDING * ("zeta" in name)):
            continue
        yield {**head, "figure": name, "value": value, "truth": truth.figures[name],
               "truth_error": truth.own[name] / scale, "scale": scale,
               "error": abs(value - truth.figures[name]) / scale, "bar": None if bar is None else bar / scale}
    for name, error in truth.errors(Run(result)).items():
        parts = [given.get(f"{'displacement' if name == 'u' else name}_{part}") or 0.0 for part in ("mesh", "steps")]
        yield {**head, "figure": name, "value": None, "truth": None, "truth_error": truth.norms.get(name, 0.0), "scale": 1.0,
               "error": error, "bar": float(np.hypot(*parts))}


def line(rows):
    """One run as text: the largest errors over the required accuracy, with the bars if there are any."""
    first, worst = rows[0], sorted(rows, key=lambda row: -row["error"])[:4]
    bar = lambda row: "" if row["bar"] is None else f" (bar {row['bar'] / row['accuracy']:.2f})"
    shown = ", ".join(f"{row['figure']} {row['error'] / row['accuracy']:.2f}{bar(row)}" for row in worst)
    own = max((row["truth_error"] for row in rows if row["value"] is not None), default=0.0)
    return (f"{first['scene']:<19} {first['accuracy']:<5} {first['told']:<11} {float(first['seconds']):5.1f} s, errors "
            f"over the accuracy: {shown}; figures of the truth to {own:.0e}")


def bars_of(what, rows):
    """The number of bars that hold, their width, and the worst three."""
    rows = [row for row in rows if row["bar"] is not None]
    missed = [row for row in rows if row["error"] > row["bar"] + row["truth_error"]]
    # Only truths of sufficient accuracy count.
    ratios = [row["bar"] / row["error"] for row in rows if row["error"] > 10 * row["truth_error"]]
    if not rows:
        return [f"{what}: no bars"], 0
    lines = [f"{what}: the bar holds in {len(rows) - len(missed)} of {len(rows)} cases; "
             f"median bar over true error {median(ratios or [np.nan]):.2f}"]
    worst = sorted(missed, key=lambda row: (row["bar"] + row["truth_error"]) / row["error"])[:3]
    return lines + [f"  worst: {row['scene']} at {row['accuracy']}, {row['figure']}: error {row['error']:.2e} of the "
                    f"scale, bar {row['bar']:.2e}, truth to {row['truth_error']:.0e}" for row in worst], len(missed)


def reached_of(what, rows):
    """The number of runs in which "reached" is true, and the worst three others."""
    runs, over = {}, {}
    for row in rows:
        runs.setdefault((row["scene"], row["accuracy"]), []).append(row)
    told = {run: of for run, of in runs.items() if of[0]["told"] == "reached"}
    for run, of in told.items():
        if any(row["error"] > row["accuracy"] + row["truth_error"] for row in of):
            over[run] = max(of, key=lambda row: row["error"] - row["truth_error"])
    lines = [f'{what}: "reached" in {len(told)} of {len(runs)} runs, and true in {len(told) - len(over)} of these']
    worst = sorted(over.items(), key=lambda item: -item[1]["error"] / item[1]["accuracy"])[:3]
    return lines + [f"  worst: {name} at {accuracy}: {row['figure']} errs by {row['error'] / accuracy:.3g} times the "
                    "accuracy" for (name, accuracy), row in worst], len(over)


def summary_of(rows):
    """The summary of the trial, and the number of broken bars and promises."""
    printed = [row for row in rows if row["value"] is not None]
    norms = [row for row in rows if row["value"] is None]
    (bars, missed), (told, over) = bars_of("printed figures", printed), reached_of("printed figures", printed)
    name = "u in the energy norm, damage in L²"
    seconds = sum(float(s) for _, _, s in {(r["scene"], r["accuracy"], r["seconds"]) for r in rows})
    return [*bars, *bars_of(name, norms)[0], *told, *reached_of(name, norms)[0],
            f"seconds of all runs: {seconds:.0f}"], missed + over


def trial(binary, truth, accuracy):
    """The rows of a scene with an accuracy."""
    with tempfile.TemporaryDirectory() as folder:
        path, out = write(truth.scene, Path(folder)), Path(folder) / "out"
        started = time.perf_counter()
        summary = run(binary, path, out, accuracy)
        return list(compare(truth, summary, out, accuracy, time.perf_counter() - started))


def main():
    parser = parser_of(__doc__, "promises")
    parser.add_argument("--truth", type=Path, default=ROOT / "out" / "promises" / "truth")
    parser.add_argument("--accuracy", type=float, nargs="+", default=[0.1, 0.03, 0.01])
    parser.add_argument("names", nargs="*", help="of scenes, if not all")
    arguments = parser.parse_args()
    binary, rows = arguments.binary, []
    arguments.out.mkdir(parents=True, exist_ok=True)
    failed = 0
    for scene in (s for s in scenes() if s.name in arguments.names or not arguments.names):
        truth = None
        for accuracy in arguments.accuracy:
            try:
                truth = truth or Truth(binary, scene, arguments.truth)
                new = trial(binary, truth, accuracy)
                rows += new
                print(line(new), flush=True)
            except SceneError as error:
                failed += 1
                print(f"{scene.name} {accuracy}: {error}", flush=True)
        write_table(rows, arguments.out / "promises.csv")
    lines, broken = summary_of(rows)
    print(*lines, sep="\n")
    return int(broken + failed > 0)


if __name__ == "__main__":
    sys.exit(main())
