"""Reads summary.json of runs: figures with their error bars and units, as rows of a table."""

import csv
import difflib
import json
import re
import sys
from math import inf
from pathlib import Path

from signorini_files import is_of_study

# The ends of columns with the reason why the mesh does not determine an extreme.
FLAGS = (".singular", ".unresolved")
# Kinds of units of values that are no figures; "s" and "MB" do not depend on the scene.
UNITS = {"end_time": "time", "stopped_at": "time", "wall_seconds": "s", "seconds_per_step": "s", "peak_megabytes": "MB"}


# The entries of summary.json that scripts read. A list and a table under "*" have entries of one kind; NUMBER may be null.
NUMBER, TEXT, PLACE = (float, int, type(None)), (str, type(None)), ([(float, int)], type(None))
GOVERNING = {"value": (float, int), "time": (float, int), "at": PLACE}
FIGURE = {"label": str, "unit": str, "value": NUMBER, "bar": NUMBER, "at": PLACE, "singular": TEXT, "unresolved": TEXT,
          "governing": (GOVERNING, type(None))}
VELOCITY = {"centre": [(float, int)], "translation": [(float, int)], "rotation": (float, int)}
# These have all their entries.
COMPLETE = (GOVERNING, FIGURE, VELOCITY)
KINDS = {
    "title": str, "scene": str, "solver": str, "error": TEXT, "steps": int, "end_time": NUMBER, "stopped_by": TEXT,
    "stopped_at": NUMBER, "stopped_uncertainty": NUMBER, "wall_seconds": NUMBER, "notes": [str], "units": {"*": str},
    "phases": {"*": (float, int)}, "kkt": ({"*": NUMBER}, type(None)), "figures": {"*": FIGURE},
    "boundaries": {"*": [[[(float, int)]]]}, "provenance": {"command": [str], "machine": {}},
    "collapse": ({"motion": str, "velocity": VELOCITY}, type(None)), "errors": ({}, type(None)),
}
# Other entries with numbers.
ENTRIES = ("ranks", "nodes", "triangles", "contact_nodes", "active_nodes", "seconds_per_step", "peak_megabytes", "reached")


def is_of(kind, value):
    """Whether a value is of a kind: a type, one of several kinds, a list, or a table, of which known entries are checked."""
    if isinstance(kind, tuple):
        return any(is_of(one, value) for one in kind)
    if isinstance(kind, list):
        return isinstance(value, list) and all(is_of(kind[0], of) for of in value)
    if isinstance(kind, dict):
        return (isinstance(value, dict) and (kind not in COMPLETE or kind.keys() <= value.keys())
                and all(is_of(kind.get(key, kind.get("*", object)), of) for key, of in value.items()))
    return isinstance(value, kind) and (kind not in (int, float) or not isinstance(value, bool) and abs(value) < inf)


def read_summary(path):
    """The contents of a file summary.json; a ValueError names what is wrong there."""
    def refuse(constant):
        raise ValueError(constant)

    for there in path.parent.glob("*"):
        if there.exists() and not there.is_file() and not there.is_dir():
            raise ValueError(f"{there}: it is a pipe or a device, which may never end; move it away")
    # Names and titles are lines.
    try:
        text = re.sub(r"\\(?:(n|r|u000[adAD])|.)", lambda of: "\\" * bool(of[1]) + of[0], path.read_text(encoding="utf-8"))
        summary = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError):
        raise ValueError(f"{path}: it is damaged or cut off; run the scene again") from None
    wrong = next((key for key, kind in KINDS.items() if not is_of({key: kind}, summary)), None)
    if wrong or "steps" not in summary:
        raise ValueError(f"{path}: {wrong or 'steps'} is missing or has another form; run the scene again")
    return summary


def summary_of(folder):
    """summary.json of a folder, or a ValueError with the reason."""
    path = Path(folder) / "summary.json"
    try:
        return read_summary(path)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; name folders of results") from None


def summary_or_error(folder):
    """summary.json of a folder, or a summary with nothing but the reason why there is none."""
    try:
        return summary_of(folder)
    except ValueError as error:
        return {"error": str(error)}


def folders_of(names):
    """`names` without files, as the table of a study stands beside its folders; in place of a study the runs of its table."""
    folders = [name for name in names if not Path(name).is_file()] or names
    return [run for folder in folders for run in (runs_of(folder) if is_study(folder) else [folder])]


def is_study(folder):
    """Whether a folder is that of a study."""
    return is_of_study(Path(folder) / "study.csv")


def runs_of(study):
    """The folders of the runs of a study, in the order of its table."""
    # Names of folders may be any bytes.
    with open(Path(study) / "study.csv", newline="", encoding="utf-8", errors="surrogateescape") as file:
        return [str(Path(study) / row["run"]) for row in csv.DictReader(file)]


def option_of(summary, name):
    """The values of an option in the command of a run."""
    words = summary.get("provenance", {}).get("command", [])
    words = words[:words.index("--")] if "--" in words else words
    option = f"--{name}"
    return [following if word == option else word.partition("=")[2] for word, following in zip(words, [*words[1:], ""])
            if word == option or word.startswith(f"{option}=")]


def columns_of(summaries):
    """The columns of a table by default: the ends of the runs, and the figures of their whole bodies."""
    figures = dict.fromkeys(name for summary in summaries for name in summary.get("figures") or {} if "." not in name)
    return ["end_time", "stopped_by", "stopped_at", *figures, "wall_seconds"]


def figure_of(summary, name):
    """The figure of a run with the longest name that begins `name`, and the rest of it: (figure, ["bar"]) for `work.bar`."""
    figures, parts = summary.get("figures") or {}, name.split(".")
    known = (k for k in range(len(parts), 0, -1) if ".".join(parts[:k]) in figures)
    k = next(known, 0)
    return figures.get(".".join(parts[:k])), parts[k:]


def value_of(summary, name, absent=None):
    """A value by its full name, or `absent`: of a figure, `NAME`, `NAME.governing`, `NAME.governing.time`, or an entry of
    summary.json by its path, `errors.solver`."""
    value, path = figure_of(summary, name)
    for part in path if value else name.split("."):
        value = summary if value is None else value
        if not isinstance(value, dict) or part not in value:
            return absent
        value = value[part]
        if value is None:
            break
    return value.get("value", value) if isinstance(value, dict) else value


def named(columns):
    """Names of columns. Figures had `quantities.` before their names in an earlier release."""
    if old := [name for name in columns if name.startswith("quantities.")]:
        print(f"note: write {old[0].removeprefix('quantities.')}, without `quantities.`", file=sys.stderr)
    return [name.removeprefix("quantities.") for name in columns]


def bars(summary):
    """The error bars of a run by the names of figures, and that of the time of a stop; empty without estimates."""
    found = {name: of.get("bar") for name, of in (summary.get("figures") or {}).items()}
    found["stopped_at"] = summary.get("stopped_uncertainty")
    return {name: bar for name, bar in found.items() if bar is not None}


def flag_of(extreme):
    """`singular` or `not resolved` if the mesh does not determine an extreme, and the reason; else two empty texts."""
    flags = ((name, (extreme or {}).get(key)) for name, key in (("singular", "singular"), ("not resolved", "unresolved")))
    return next(((name, reason) for name, reason in flags if reason), ("", ""))


def units_of(summary):
    """The names of the units of length, force, time and stress, and of units derived from them."""
    units = {"length": "m", "force": "N", "time": "s", "stress": "Pa", **summary.get("units", {})}
    force, length = units["force"], units["length"]
    work = "J/m" if (force, length) == ("N", "m") else f"{force}·{length}/{length}"
    area = units["stress"] if units["stress"] != "Pa" else f"{force}/{length}²"
    return {**units, "work": work, "line": f"{force}/{length}", "area": area, "volume": f"{force}/{length}³"}


def unit_of(name, summary):
    """The unit of a value of the summary; "" without a unit."""
    figure, rest = figure_of(summary, name)
    units = units_of(summary)
    if figure:
        return units["time"] if rest[-1:] == ["time"] else figure.get("unit", "")
    kind = UNITS.get(name.rpartition(".")[2], "")
    return units.get(kind, kind)


def settings_of(summaries):
    """The keys that the command of each run sets, with their values."""
    return [dict(map(str.strip, text.split("=", 1)) for text in option_of(summary, "set") if "=" in text)
            for summary in summaries]


def varied(settings):
    """The keys in which runs differ, in the order of appearance."""
    names = dict.fromkeys(name for of in settings for name in of)
    return [name for name in names if len({of.get(name) for of in settings}) > 1]


def rows_of(folders, summaries, columns, settings=None):
    """A row for each folder, and the units of columns.

    A row has the name of the folder, the settings in which the runs differ, and per column the value, its error bar
    NAME.bar and the reasons NAME.singular and NAME.unresolved, if a run has them. `reached` tells whether the run has the accuracy asked
    for, `status` whether it finished, stopped early or failed.
    """
    settings = settings or settings_of(summaries)
    names, rows, units = varied(settings), [], {}
    for folder, summary, of in zip(folders, summaries, settings):
        row = {"run": Path(folder).name, **{name: of.get(name) for name in names}}
        for name in columns:
            # A key that the runs set has its value already.
            value = value_of(summary, name)
            row[name] = of.get(name) if value is None else value
            row[f"{name}.bar"] = bars(summary).get(name)
            figure = (summary.get("figures") or {}).get(name) or {}
            row.update({f"{name}{flag}": figure.get(flag[1:]) for flag in FLAGS})
            if summary and (unit := unit_of(name, summary)):
                units.setdefault(name, {})[unit] = units.setdefault(f"{name}.bar", {})[unit] = None
        row["reached"] = {True: "yes", False: "no"}.get(summary.get("reached"))
        error = summary.get("error")
        row["status"] = "failed" if error else "stopped" if summary.get("stopped_by") else "finished"
        rows.append({**row, "error": error})
    optional = {key for row in rows for key in row if key.endswith((".bar", *FLAGS)) or key in ("reached", "error")}
    empty = {key for key in optional if all(row[key] is None for row in rows)}
    rows = [{key: value for key, value in row.items() if key not in empty} for row in rows]
    return rows, {name: " or ".join(of) for name, of in units.items()}


def unknown(columns, summaries):
    """Messages about names that no summary has."""
    for name in columns:
        if name == "error" or any(value_of(summary, name, ...) is not ... for summary in summaries):
            continue
        first, point, _ = name.partition(".")
        tables = [summary[first] for summary in summaries if point and isinstance(summary.get(first), dict)]
        there = {f"{first}.{key}" for table in tables for key in table}
        there |= {key for summary in summaries for key in (*(summary.get("figures") or ()), *summary)}
        near = difflib.get_close_matches(name, sorted(there), 3)
        yield f"no summary has {name}; " + (f"did you mean {' or '.join(near)}?" if near else (
            "`signorini info OUT` lists all names"))
