"""systems.py OURS THEIRS: the largest difference of the figures of the runs in two folders, for `make systems`.

It is relative to the largest value of the same unit in the run. Places are left out, and figures that depend on the
mesh: singular and unresolved ones.
"""

import json
import sys
from pathlib import Path

PLACES = ("start_", "end_", "peak_", "acts_at_")


def figures(folder):
    """The unit and the value of every figure of a run."""
    found = json.loads((folder / "summary.json").read_text())["figures"]
    return {name: (figure["unit"], figure["value"]) for name, figure in found.items()
            if figure["value"] is not None and not figure["singular"] and not figure["unresolved"]
            and not any(place in name for place in PLACES)}


def differences(ours, theirs):
    """Per figure of both runs: the relative difference, and its name."""
    own, other = figures(ours), figures(theirs)
    for name in own.keys() & other.keys():
        unit, value = own[name]
        scale = max(abs(value) for of, value in own.values() if of == unit)
        yield abs(value - other[name][1]) / (scale or 1), f"{ours.name}: {name}"


ours, theirs = map(Path, sys.argv[1:])
runs = [file.parent for file in ours.glob("*/summary.json") if (theirs / file.parent.name / "summary.json").exists()]
largest, name = max((found for run in runs for found in differences(run, theirs / run.name)), default=(None, "no runs"))
print("-" if largest is None else f"{largest:.0e}")
print(f"largest difference: {largest}, {name}", file=sys.stderr)
