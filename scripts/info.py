#!/usr/bin/python3
"""Describes a folder of results: scene, program, outcome, errors, frames, files.

    signorini info out/lshape
"""

import argparse
import json
import re
import sys
from pathlib import Path

from bars import barred
from signorini_summaries import bars, flag_of, read_summary


def row(name, value):
    return f"  {name:<30} {value}"


def text_of_figure(figure):
    """The value of a figure with its bar, its unit, and why the mesh does not determine it."""
    flag, reason = flag_of(figure)
    # The mesh does not determine more digits of a flagged value.
    value = f"{figure['value']:.2g}" if flag else json.dumps(figure["value"])
    value = barred(figure["value"], figure["bar"]) if figure["bar"] else value
    return f"{value} {figure['unit']} {flag and f'{flag}: {reason}'}".strip()


def entry(name, value, errors):
    """The lines of an entry of summary.json, or of the entries of a table. Figures are printed with their error
    bars."""
    if name == "figures":
        return [row(figure, text_of_figure(of)) for figure, of in value.items() if of["value"] is not None]
    if isinstance(value, dict):
        return [line for below in value for line in entry(f"{name}.{below}", value[below], errors)]
    if isinstance(value, list):
        # Others than notes are for figures.
        words = [word for word in value if isinstance(word, str)]
        return [row(name, " ".join(words))] if name.endswith("command") else [row(name, word) for word in words]
    if value is None:
        return []
    bar = errors.get(name)
    return [row(name, value if isinstance(value, str) else bar and barred(value, bar) or json.dumps(value))]


def description(folder):
    summary = read_summary(folder / "summary.json")
    errors = bars(summary)
    lines = [line for name in summary if name != "phases" for line in entry(name, summary[name], errors)]
    frames = []
    if (folder / "fields.pvd").exists():
        frames = re.findall('timestep="(.*?)".*?file="(.*?)"', (folder / "fields.pvd").read_text(encoding="utf-8"))
    times = [time for time, file in frames if (folder / file).exists()]
    if len(frames) > 1 and times:
        try:
            first, last = (f"{float(time):.10g}" for time in (times[0], times[-1]))
        except ValueError:
            raise ValueError(f"{folder / 'fields.pvd'}: it is damaged or cut off; run the scene again") from None
        gone = f" ({len(frames) - len(times)} more are gone)" if len(times) < len(frames) else ""
        lines.append(row("frames", f"{len(times)}, from t = {first} to {last}{gone}"))
    names = sorted(path.name for path in folder.iterdir())
    others = [name for name in names if not name.startswith(("fields_", "contact_"))]
    return "\n".join([*lines, row("files", " ".join(others))])


def main(prog=None):
    """Returns the exit code: 2 if the folder contains no results."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="OUT", help="a folder that `run` has written")
    folder = parser.parse_args().folder
    try:
        text = description(folder)
    except (OSError, ValueError) as error:
        lacks = f"{error.filename}: {error.strerror}; name a folder of results, out/SCENE" if isinstance(error, OSError) else ""
        print(f"error: {lacks or error}", file=sys.stderr)
        return 2
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
