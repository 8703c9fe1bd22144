#!/usr/bin/python3
"""Prints the summaries of runs as a table: a row for each folder, with the values that were set, and columns of
summary.json with their units and error bars.

    signorini table out/*/ --columns end_time,stopped_at,clamp.force_y,displacement_max.governing
    signorini table out/lshape-study --latex
"""

import argparse
import csv
import sys
from math import floor, log10

import latex
from bars import barred, plain
from signorini_summaries import FLAGS, columns_of, flag_of, folders_of, named, rows_of, summary_of, unknown


# The figures that are coordinates of places begin so; they have digits far from the origin also.
PLACES = ("contact_start_", "contact_end_", "peak_", "acts_at_")


def text_of(value, decimals=None):
    """A value of a table as text: a float with six digits, or with so many `decimals` if these are more."""
    if value is None:
        return ""
    digits = 6 if decimals is None or not value else max(6, 1 + decimals + floor(log10(abs(value))))
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def names_of(text):
    """The names in a list with commas, as in CSV: a name with a comma stands in double quotes."""
    try:
        return named(next(csv.reader([text], skipinitialspace=True), []))
    except csv.Error as error:
        raise argparse.ArgumentTypeError(f"no list of names with commas: {error}") from None


def write_rows(rows, file, units=None):
    """Writes dictionaries as CSV with a column per key in the order of appearance; the head has the units."""
    names = list(dict.fromkeys(key for row in rows for key in row))
    writer = csv.writer(file)
    writer.writerow(titles(names, units or {}))
    writer.writerows([row.get(name) for name in names] for row in rows)


def titles(names, units):
    """The heads of columns: `work (J/m)`."""
    return [f"{name} ({units[name]})" if name in units else name for name in names]


def write_table(rows, path, units=None):
    """Writes dictionaries as a CSV file."""
    # Names of folders may be any bytes.
    with open(path, "w", newline="", encoding="utf-8", errors="surrogateescape") as file:
        write_rows(rows, file, units)


def printed(rows, units, form=None):
    """Prints rows as `csv` with all digits, as `latex`, or aligned: the last two have figures with their bars, without columns
    that have no value."""
    if form == "csv":
        write_rows(rows, sys.stdout, units)
        return

    def cell(row, name):
        value, bar = row.get(name), row.get(f"{name}.bar")
        text = barred(value, bar) if bar is not None and value is not None else None
        flag, _ = flag_of({flag[1:]: row.get(f"{name}{flag}") for flag in FLAGS})
        is_place = name.rpartition(".")[2].startswith(PLACES)
        return f"{plain(value, 2)} {flag}" if flag else text or text_of(value, 4 if is_place else None)

    names = list(dict.fromkeys(name for row in rows for name in row if not name.endswith((".bar", *FLAGS))))
    names = [name for name in names if any(row.get(name) not in (None, "") for row in rows)]
    cells = [[cell(row, name) for name in names] for row in rows]
    if form == "latex":
        print(latex.tabular([latex.titled(name, units.get(name, "")) for name in names],
                            [[latex.number(text) for text in line] for line in cells]))
        return
    lines = [titles(names, units), *cells]
    widths = [max(map(len, column)) for column in zip(*lines)]
    for line in lines:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip())


def refused(columns, summaries):
    """Prints unknown columns; returns whether there are any."""
    problems = list(unknown(columns or [], summaries))
    print(*(f"error: {problem}\n" for problem in problems), sep="", end="", file=sys.stderr)
    return bool(problems)


def main(prog=None):
    """Returns the exit code: 2 if a folder has no results or a column is unknown; the other rows are printed."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help="folders of results, or of a study")
    parser.add_argument("--columns", type=names_of, action="extend", metavar="NAME,…", help=(
        "figures, also NAME.governing and NAME.governing.time of the whole run, and entries of summary.json: errors.solver; "
        "a name with a comma stands in double quotes"))
    forms = parser.add_mutually_exclusive_group()
    forms.add_argument("--csv", action="store_const", const="csv", dest="form", help=(
        "as CSV with all digits; error bars are columns NAME.bar"))
    forms.add_argument("--latex", action="store_const", const="latex", dest="form", help=(
        "as a table for LaTeX with booktabs and siunitx"))
    arguments = parser.parse_args()
    found, failed = {}, False
    for folder in folders_of(arguments.folders):
        try:
            found[folder] = summary_of(folder)
        except ValueError as error:
            print(f"error: {error}", file=sys.stderr)
            failed = True
    if found:
        columns = arguments.columns or columns_of(found.values())
        printed(*rows_of(found, found.values(), columns), arguments.form)
        failed |= refused(arguments.columns, found.values())
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
