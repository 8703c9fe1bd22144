"""Pictures of figures over the values in which runs differ, with the numbers as CSV: `study --plot`, `plot --figure`."""

import json
import re
import sys
import textwrap
import tomllib
from pathlib import Path

# This module comes first: it checks the memory before numpy is imported.
import drawing  # noqa: F401
import numpy as np

from drawing import (
    INK, LINE, NARROWEST, colours, drawn_ticks, em, legend, plot, plt, power_of, room_for_legend, times_power, wide, width_of,
    wrapped,
)
from results import ResultError, telling
from signorini_files import is_of_run, is_of_study, whole
from signorini_summaries import FLAGS, figure_of, rows_of, settings_of, varied
from table import refused, write_table

# A varied value whose largest is more than this multiple of its smallest has a logarithmic axis.
LOGARITHMIC = 20.0
# The most lines of a category below the axis.
LINES = 3
# The smallest height of the axis, over the largest value: the digits below are rounding.
LEAST_RANGE = 1e-4
# The markers of values, with their meanings.
MARKS = {"": "", "hollow": "hollow: singular or not resolved", "×": "×: stopped before the end"}


def paths_of(folder, names, formats):
    """The files of the pictures in a folder, and of their numbers."""
    stems = {name: re.sub(r"[^\w.=+-]", "_", name) for name in names}
    return {name: [Path(folder) / f"curves_{stem}.{ending}" for ending in ("csv", *formats)] for name, stem in stems.items()}


def is_own(path):
    """Whether the names of pictures in this folder belong to the program: it is that of a run or of a study."""
    return is_of_run(path) or is_of_study(path)


def drawn(folders, summaries, names, target, **options):
    """Draws the pictures and prints their paths; returns whether all are drawn. See `draw_studies`."""
    known = [name for name in names if not refused([name], list(filter(None, summaries)))]
    with telling() as problems:
        for path in draw_studies(folders, summaries, known, target, **options) if known else ():
            print(path, flush=True)
    return known == names and not problems


def draw_studies(folders, summaries, names, target, over=None, settings=None, formats=("png",)):
    """Draws a picture of each figure of `names` into the folder `target`; yields the paths. The abscissa is the key `over`, by
    default the first one in which the runs differ; the values of the other keys have a curve each."""
    settings = settings or settings_of(summaries)
    complete = [k for k, summary in enumerate(summaries) if summary and not summary.get("error")]
    failed = [Path(folder).name for k, folder in enumerate(folders) if k not in complete]
    if not complete:
        raise ResultError("nothing to draw: no run has results")
    folders, summaries, settings = ([of[k] for k in complete] for of in (folders, summaries, settings))
    settings = [{name: _text(of[name]) if of.get(name) else _value_in(folder, name) for name in varied(settings)}
                for folder, of in zip(folders, settings)]
    keys = varied(settings)
    if over not in (None, "run", *keys):
        raise ResultError(f"--over {over}: the runs do not differ in it; choose {', '.join([*keys, 'run'])}")
    key = over or next(iter(keys), "run")
    others = [name for name in keys if name != key]
    if len({of.get(key) for of in settings}) == 1 and key != "run" or len(folders) == 1:
        print(f"note: one {key if key == 'run' else f'value of {key}'} makes a single dot; figures of a run in time: `signorini plot "
              f"{folders[0]} --only force-displacement`, also with --abscissa COLUMN, and history.csv", file=sys.stderr)
    if failed:
        print(f"note: the pictures lack the failed runs {', '.join(failed)}", file=sys.stderr)
    for name, (table, *pictures) in paths_of(target, names, formats).items():
        rows, units = rows_of(folders, summaries, [name], settings)
        absent = [row["run"] for row in rows if not isinstance(row[name], (int, float))]
        rows = [row for row in rows if row["run"] not in absent]
        if not rows:
            raise ResultError(f"{name}: no run has a value of it")
        kept = ("run", key, *others, name, *(end for end in rows[0] if end.startswith(f"{name}.")), "status")
        with whole(table, is_own) as part:
            write_table([{column: row.get(column) for column in kept} for row in rows], part, units)
        yield table
        left_out = [f"without failed runs: {', '.join(failed)}"] * bool(failed)
        left_out += [f"without a value: {', '.join(absent)}"] * bool(absent)
        figure = _draw(name, key, others, rows, units.get(name, ""), summaries, left_out)
        for path in pictures:
            with whole(path, is_own) as part:
                figure.savefig(part)
            yield path
        plt.close(figure)


def _value_in(folder, key):
    """The value of a key in the scene of a run, as text; "default" if it is not written there."""
    try:
        scene = tomllib.loads((Path(folder) / "scene.toml").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return "default"
    found = scene if "." in key else scene.get("constants", {})
    for part in key.split("."):
        if isinstance(found, list):
            found = next((of for of in found if of.get("name") == part), {})
        else:
            found = found.get(part, {}) if isinstance(found, dict) else {}
    return "default" if found == {} else _text(found)


def _text(value):
    """A value of a scene, or its text on the command line, as text: equal values are equal texts."""
    if isinstance(value, str):
        try:
            value = tomllib.loads(f"value = {value}")["value"]
        except ValueError:
            return value
    if isinstance(value, str):
        return value
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return f"{value:.10g}" if is_number else json.dumps(value, ensure_ascii=False, default=str)


def _number(text):
    """A text as a number; None if it is none."""
    try:
        return float(text)
    except ValueError:
        return None


def _draw(name, key, others, rows, unit, summaries, left_out):
    """A plot of a figure over a key; see `draw_studies`."""
    texts = [str(row[key]) for row in rows]
    values = [_number(text) for text in texts]
    is_numeric, names = None not in values, list(dict.fromkeys(texts))
    places = np.array(values if is_numeric else [names.index(text) for text in texts], float)
    across, up = (power_of(np.abs(of).max()) for of in (places, [row[name] for row in rows]))
    is_logarithmic = is_numeric and places.min() > 0.0 and places.max() > LOGARITHMIC * places.min()
    across = 0 if is_logarithmic else across
    # Runs that all differ in the abscissa are one curve, as those of a table of cases.
    is_one = len(set(places)) == len(places)
    curves, seen = {}, set()
    for place, row in sorted(zip(places / 10.0**across, rows), key=lambda of: of[0]):
        label = "" if is_one else ", ".join(f"{other} = {row[other]}" for other in others)
        mark = _mark(row, name)
        seen.add(mark)
        curves.setdefault(label, []).append((place, row[name] / 10.0**up, (row.get(f"{name}.bar") or 0.0) / 10.0**up, mark))
    labels = [*filter(None, curves), *filter(None, (MARKS[mark] for mark in sorted(seen)))]
    categories = [] if is_numeric else [_broken(text, (wide(NARROWEST) - 9.0 * em()) / len(names)) for text in names]
    lower = LINE * em() * max((text.count("\n") for text in categories), default=0)
    below = room_for_legend(labels, always=len(labels) > 1)
    label = _label(name, summaries)
    titles = {summary.get("title", "") for summary in summaries}
    # A key without a table is that of a constant.
    key = key if "." in key or key == "run" else f"constant {key}"
    caption = "; ".join([f"{label} over {key}", *left_out])
    caption = "\n".join([*(titles if len(titles) == 1 else ()), textwrap.shorten(caption, 300, placeholder=" …")])
    figure, axes = plot(caption, below=below + lower)
    for (text, points), colour in zip(curves.items(), colours(len(curves))):
        x, y, bars, marks = map(np.array, zip(*points))
        axes.plot(x, y, color=colour, linewidth=1.3, label=f" {text}" if text.startswith("_") else text or "_")
        if (known := bars > 0.0).any():
            axes.errorbar(x[known], y[known], yerr=bars[known], fmt="none", ecolor=colour, elinewidth=1.0, capsize=3.0)
        for at, value, mark in zip(x, y, marks):
            axes.plot(at, value, color=colour, **_style(mark))
    for mark in sorted(filter(MARKS.get, seen)):
        axes.plot([], [], color=INK, linestyle="none", label=MARKS[mark], **_style(mark))
    low, high = axes.get_ylim()
    least = LEAST_RANGE * max(abs(low), abs(high))
    if high - low < least:
        axes.set_ylim(0.5 * (low + high - least), 0.5 * (low + high + least))
    axes.yaxis.get_major_formatter().set_useOffset(False)
    axes.set_xlabel(key + times_power(across), parse_math=False)
    room = axes.get_position().height * figure.get_size_inches()[1]
    axes.set_ylabel("\n".join(wrapped(label + times_power(up, unit), room)), parse_math=False)
    if categories:
        axes.set_xlim(-0.5, len(names) - 0.5)
        axes.set_xticks(range(len(names)), categories, parse_math=False)
    elif is_logarithmic:
        axes.set_xscale("log")
        drawn_ticks(axes.xaxis, sorted(set(places)))
    else:
        axes.locator_params("x", nbins=6)
    if labels:
        legend(axes, below, lower=lower)
    return figure


def _mark(row, name):
    """The marker of a value: hollow if the mesh does not determine it, a cross if the run stopped early."""
    if any(row.get(f"{name}{flag}") for flag in FLAGS):
        return "hollow"
    return "×" if row["status"] == "stopped" else ""


def _style(mark):
    return {"marker": "x" if mark == "×" else "o", "markersize": 5, "fillstyle": "full", "zorder": 3,
            **({"markerfacecolor": "white"} if mark == "hollow" else {})}


def _label(name, summaries):
    """The label of a figure, or of its extreme over the run; else its name."""
    of, rest = next((found for found in (figure_of(summary, name) for summary in summaries) if found[0]), (None, []))
    words = {"": "", "governing": ", over all steps", "governing.time": ", time of the extreme"}
    return f"{of['label']}{words.get('.'.join(rest), '.' + '.'.join(rest))}" if of else name


def _broken(text, width):
    """A text in a few lines that are not wider than `width`, inches, broken at any letter."""
    lines = [""]
    for letter in text:
        if lines[-1] and width_of(lines[-1] + letter) > width:
            lines.append("")
        lines[-1] += letter
    return "\n".join(lines) if len(lines) <= LINES else "\n".join([*lines[:LINES - 1], lines[LINES - 1][:-1] + "…"])
