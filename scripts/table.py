#!/usr/bin/python3
"""Prints the summaries of runs as a table: a row for each folder, with the values that were set, and columns of
summary.json.

    signorini table out/*/ --columns end_time,stopped_at,quantities.clamp.force_y
"""

import argparse
import csv
import json
import sys
from pathlib import Path

COLUMNS = ("end_time", "stopped_by", "stopped_at", "zeta_min", "displacement_max", "work",
           "contact_force", "von_mises_max", "wall_seconds")


def summary_of(folder):
    """summary.json of a folder, or a ValueError that tells what is wrong."""
    path = Path(folder) / "summary.json"
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; name folders of results") from None
    except ValueError:
        raise ValueError(f"{path}: it is damaged or cut off; run the scene again") from None


def option_of(summary, name):
    """The values of an option in the command of a run."""
    words = summary.get("provenance", {}).get("command", [])
    words = words[:words.index("--")] if "--" in words else words
    option = f"--{name}"
    return [following if word == option else word.partition("=")[2] for word, following in zip(words, [*words[1:], ""])
            if word == option or word.startswith(f"{option}=")]


def settings_of(summary):
    """KEY → value of the `--set` arguments of a run."""
    return dict((part.strip() for part in text.split("=", 1)) for text in option_of(summary, "set") if "=" in text)


def value_of(summary, name):
    """A value of the summary by its full name; names of quantities contain points."""
    if name.startswith("quantities."):
        return summary.get("quantities", {}).get(name.removeprefix("quantities."))
    value = summary
    for part in name.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value


def rows_of(folders, columns):
    """A dictionary for each folder: the folder, the settings in which the runs differ, and the columns."""
    summaries = [summary_of(folder) for folder in folders]
    settings = [settings_of(summary) for summary in summaries]
    names = list(dict.fromkeys(name for of in settings for name in of))
    names = [n for n in names if len({of.get(n) for of in settings}) > 1]
    return [{"run": Path(folder).name, **{name: of.get(name) for name in names},
             **{name: value_of(summary, name) for name in columns},
             **({"error": summary["error"]} if "error" in summary else {})}
            for folder, of, summary in zip(folders, settings, summaries)]


def text_of(value):
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def write_rows(rows, file):
    """Writes dictionaries as CSV with a column per key in the order of appearance."""
    writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
    writer.writeheader()
    writer.writerows(rows)


def write_table(rows, path):
    """Writes dictionaries as a CSV file."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        write_rows(rows, file)


def printed(rows, as_csv):
    """Prints rows as CSV with all digits, or aligned. Columns without any value are left out there."""
    if as_csv:
        write_rows(rows, sys.stdout)
        return
    names = list(dict.fromkeys(name for row in rows for name in row))
    names = [name for name in names if any(row.get(name) not in (None, "") for row in rows)]
    lines = [names] + [[text_of(row.get(name)) for name in names] for row in rows]
    widths = [max(map(len, column)) for column in zip(*lines)]
    for line in lines:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip())


def main(prog=None):
    """Returns the exit code: 2 if a folder has no results or a column no value; the other rows are printed."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help="folders of results")
    parser.add_argument("--columns", type=lambda text: text.split(","), default=COLUMNS, metavar=(
        "NAME,…"), help="names in summary.json, with points: quantities.clamp.force_y, errors.solver")
    parser.add_argument("--csv", action="store_true", help="as CSV with all digits")
    arguments = parser.parse_args()
    folders, problems = [], []
    # The table of a study stands beside its folders.
    for folder in [folder for folder in arguments.folders if not Path(folder).is_file()]:
        try:
            summary_of(folder)
            folders.append(folder)
        except ValueError as error:
            problems.append(str(error))
    rows = rows_of(folders, arguments.columns)
    if folders:
        printed(rows, arguments.csv)
    if folders and arguments.columns is not COLUMNS:
        known = sorted({name for folder in folders for name in summary_of(folder)})
        problems += [f"no summary has {name}; there are {', '.join(known)}" for name in arguments.columns
                     if name.split(".")[0] not in known
                     or name.startswith("quantities.") and all(row[name] is None for row in rows)]
    for problem in problems:
        print(f"error: {problem}", file=sys.stderr)
    return 2 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
