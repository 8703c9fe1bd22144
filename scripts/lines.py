"""Curves of fields along a line or a boundary, at several times and of several runs, with their numbers as CSV."""

import os
import sys
from itertools import product

import matplotlib.pyplot as plt
import numpy as np

import signorini_results
from bars import placed
from drawing import INK, colours, em, legend, plot, room_for_legend, wrapped
from limits import is_near_peak
from reading import open_run
from results import ResultError, write_table
from signorini_files import whole
from signorini_summaries import settings_of, units_of, varied
from table import names_of

UNITS = {"zeta": "", "u_x": "length", "u_y": "length", "gap": "length", **dict.fromkeys(signorini_results.STRAINS, "")}


def draw_curves(arguments):
    """Draws a picture for each quantity into the folder of the first run, and writes the numbers of all curves; yields
    the paths."""
    runs = [open_run(folder) for folder in arguments.folders]
    where = f"along_{arguments.along}".replace("/", "_") if arguments.along else "line"
    folder, units = runs[0].folder, units_of(runs[0].summary)
    for quantity in arguments.quantity or ["von_mises"]:
        curves, rows = [], []
        for run, name in zip(runs, run_names(runs)):
            boundaries = boundaries_of(run, arguments.along)
            frames = {frame.time: frame for frame in map(run.frame, arguments.times or [None])}
            if missing := [f"{time:g}" for time in arguments.times or [] if not np.isclose(time, list(frames)).any()]:
                print(f"{run.folder}: there is no frame at t = {', '.join(missing)}; the nearest one is drawn", file=sys.stderr)
            for frame, boundary in product(frames.values(), boundaries):
                places, values = _values(frame, arguments, boundary, quantity)
                at = coordinate_of(run, boundaries)
                places = places if at is None else _along_axis(run.parts(boundary), at)
                parts = (name * (len(runs) > 1), (boundary or "") * (len(boundaries) > 1), f"t = {frame.time:g} {units['time']}")
                peak = run.summary.get("figures", {}).get(f"{boundary}.pressure_max") if quantity == "normal_pressure" else None
                peak = {**(peak or {}), **({} if frame.time == run.frames[-1][0] else {"bar": None})}
                curves.append((", ".join(filter(None, parts)), places, values, peak, boundary and np.vstack(run.parts(boundary))))
                rows += [{"run": run.folder.name, **({"boundary": boundary} if len(boundaries) > 1 else {}), "time": frame.time,
                          "s": s, quantity: value} for s, value in zip(places, values) if np.isfinite(s)]
        path, unit = folder / f"curves_{where}_{quantity}.csv", units.get(UNITS.get(quantity, "stress"), "")
        with whole(path) as part:
            write_table(rows, part, {"time": units["time"], "s": units["length"], **({quantity: unit} if unit else {})})
        yield path
        figure = _draw(curves, f"{_way(runs[0], arguments)} ({units['length']})", quantity, units)
        for ending in arguments.format:
            path = folder / f"curves_{where}_{quantity}.{ending}"
            with whole(path) as part:
                figure.savefig(part)
            yield path
        plt.close(figure)


def _draw(curves, abscissa, quantity, units):
    """A plot of curves: their labels, places and values; and for the contact pressure the figure of the largest one,
    whose bar is a band, or which is clipped if it is singular, and the points of the boundary."""
    labels = [label + (", clipped: singular" if peak.get("singular") else ", with the bar of the largest" * bool(peak.get("bar")))
              for label, _, _, peak, _ in curves]
    below, tops = room_for_legend(labels), []
    figure, axes = plot(below=below)
    for label, (_, places, values, peak, points), colour in zip(labels, curves, colours(len(curves))):
        axes.plot(places, values, label=label, linewidth=1.3, color=colour)
        if bar := peak.get("bar"):
            axes.fill_between(places, np.maximum(values - bar, 0.0), values + bar, where=values > 0.0, color=colour,
                              alpha=0.25, linewidth=0)
        known = values[np.isfinite(places)]
        regular = known[~is_near_peak(peak, points)] if peak.get("singular") and len(points) == len(known) else known
        tops.append(np.nanmax(regular) + (bar or 0.0) if np.isfinite(regular).any() else 0.0)
    if any(peak.get("singular") for *_, peak, _ in curves) and max(tops) > 0.0:
        axes.set_ylim(0.0, 1.08 * max(tops))
    unit = units.get(UNITS.get(quantity, "stress"), "")
    words = quantity.replace("_", " ").replace("mises", "Mises stress")
    axes.set_ylabel(f"{words} ({unit})" if unit else words)
    axes.set_xlabel("\n".join(wrapped(abscissa, figure.get_size_inches()[0] - 8 * em())), parse_math=False)
    if axes.get_ylim()[0] < 0.0 < axes.get_ylim()[1]:
        axes.axhline(0.0, color=INK, linewidth=0.5)
    legend(axes, below)
    return figure


def _way(run, arguments):
    """The line or the boundary with the coordinates of its ends."""
    if arguments.line:
        x0, y0, x1, y1 = arguments.line
        return f"distance along ({x0:g}, {y0:g}) → ({x1:g}, {y1:g})"
    boundaries = boundaries_of(run, arguments.along)
    if (at := coordinate_of(run, boundaries)) is not None:
        return "xy"[at]
    if len(boundaries) > 1:
        return "distance along each boundary"
    parts = run.parts(arguments.along)
    ends = [" → ".join(placed(point, np.ptp(np.vstack(parts), axis=0).max()) for point in part[[0, -1]]) for part in parts]
    return f"distance along {arguments.along}: {', '.join(ends[:3])}{' …' * (len(ends) > 3)}"


def boundaries_of(run, text):
    """The boundaries that a text names: one, or several with commas as in CSV; [None] without a text."""
    return [text] if text is None or text in run.summary["boundaries"] else names_of(text)


def coordinate_of(run, boundaries):
    """0 or 1 if several boundaries are straight along x or y; None for others."""
    if len(boundaries) < 2:
        return None
    extents = np.array([np.ptp(np.vstack(run.parts(name)), axis=0) for name in boundaries])
    return next((k for k in (0, 1) if (extents[:, 1 - k] <= 1e-9 * extents[:, k]).all()), None)


def _along_axis(parts, k):
    """The coordinates of the points of a boundary, NaN between its parts."""
    return np.concatenate([np.append(part[:, k], np.nan) for part in parts])[:-1]


def run_names(runs):
    """Names of runs for a legend: the values in which they differ, if their folders are called after these, else the folders."""
    settings, folders = settings_of([run.summary for run in runs]), [run.folder.name for run in runs]
    keys = varied(settings)
    if not keys or any("=" not in folder for folder in folders):
        return differences(folders)
    return [", ".join(f"{key.rpartition('.')[2]} = {of[key]}" for key in keys if key in of) or folder
            for of, folder in zip(settings, folders)]


def differences(names):
    """The parts, between double underscores, in which names of folders differ; whole names if they do not."""
    # Fonts have no signs for bytes that are not UTF-8.
    names = [os.fsencode(name).decode(errors="replace") for name in names]
    parts = [name.split("__") for name in names]
    common = set(parts[0]).intersection(*parts[1:]) if len(names) > 1 else ()
    found = ["__".join(part for part in of if part not in common) or name for of, name in zip(parts, names)]
    # Legends leave out labels that begin with an underscore.
    return [f" {name}" if name.startswith("_") else name for name in found]


def _values(frame, arguments, boundary, quantity):
    """The places along the line or the boundary, and the values there."""
    def along(name):
        if boundary:
            return frame.along(boundary, name)
        x0, y0, x1, y1 = arguments.line
        return frame.line((x0, y0), (x1, y1), name)

    try:
        places, values = along(quantity)
        if quantity == "normal_pressure":
            # Off the contact boundaries frames contain 0.
            values[np.isnan(along("gap")[1])] = np.nan
    except ValueError as error:
        raise ResultError(f"{frame.run.folder}: {error}") from None
    if np.isfinite(values).sum() < 2:
        why = ("only contact boundaries have it: use --along NAME" if quantity in ("normal_pressure", "gap") else
               "is it outside the body?")
        raise ResultError(f"{frame.run.folder}: {quantity} has no values along this line; {why}")
    return places, values
