"""Curves of fields along a line or a boundary, at several times and of several runs, with their numbers as CSV."""

import sys

import matplotlib.pyplot as plt
import numpy as np

import signorini_results
from drawing import INK, wide
from reading import open_run
from results import ResultError, write_table
from signorini_summaries import units_of

UNITS = {"zeta": "", "u_x": "length", "u_y": "length", "gap": "length", **dict.fromkeys(signorini_results.STRAINS, "")}


def draw_curves(arguments, styled):
    """Draws a figure for each quantity into the folder of the first run, and writes the numbers of all curves; yields
    the paths."""
    runs = [open_run(folder) for folder in arguments.folders]
    where = f"along_{arguments.along}".replace("/", "_") if arguments.along else "line"
    folder = runs[0].folder
    for quantity in arguments.quantity or ["von_mises"]:
        rows, figure = [], plt.figure(figsize=(wide(6.0), max(2.8, 0.63 * wide(6.0))))
        axes = figure.add_subplot()
        units = units_of(runs[0].summary)
        for run, name in zip(runs, _differences([run.folder.name for run in runs])):
            frames = {frame.time: frame for frame in map(run.frame, arguments.times or [None])}
            if missing := [f"{time:g}" for time in arguments.times or [] if not np.isclose(time, list(frames)).any()]:
                print(f"{run.folder}: no frame at t = {', '.join(missing)}: the nearest are drawn", file=sys.stderr)
            for frame in frames.values():
                places, values = _values(frame, arguments, quantity)
                if quantity == "normal_pressure":
                    # Off the contact boundaries frames contain 0.
                    values[np.isnan(_values(frame, arguments, "gap")[1])] = np.nan
                if np.isfinite(values).sum() < 2:
                    contact = quantity in ("normal_pressure", "gap")
                    why = "only contact boundaries have it: use --along NAME" if contact else "is it outside the body?"
                    raise ResultError(f"{run.folder}: {quantity} has no values along this line; {why}")
                label = f"t = {frame.time:g} {units['time']}"
                label = label if len(runs) == 1 else f"{name}, {label}"
                axes.plot(places, values, label=label, linewidth=1.3)
                rows += [{"run": run.folder.name, "time": frame.time, "s": s, quantity: value}
                         for s, value in zip(places, values) if np.isfinite(s)]
        unit = units.get(UNITS.get(quantity, "stress"), "")
        axes.set_xlabel(f"distance along {arguments.along or 'the line'} ({units['length']})")
        words = quantity.replace("_", " ").replace("mises", "Mises stress")
        axes.set_ylabel(f"{words} ({unit})" if unit else words)
        axes.axhline(0.0, color=INK, linewidth=0.5) if axes.get_ylim()[0] < 0.0 < axes.get_ylim()[1] else None
        labels = axes.get_legend_handles_labels()[1]
        if len(labels) > 6 or max(map(len, labels)) > 5 * wide(6.0):
            axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.18), fontsize="small")
        else:
            axes.legend()
        if arguments.line:
            x0, y0, x1, y1 = arguments.line
            axes.set_title(f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g})")
        styled(figure, arguments)
        path = folder / f"curves_{where}_{quantity}.csv"
        write_table(rows, path)
        yield path
        for ending in arguments.format:
            path = folder / f"curves_{where}_{quantity}.{ending}"
            figure.savefig(path)
            yield path
        plt.close(figure)


def _differences(names):
    """The parts, between double underscores, in which names of folders differ; whole names if they do not."""
    parts = [name.split("__") for name in names]
    common = set(parts[0]).intersection(*parts[1:]) if len(names) > 1 else ()
    return ["__".join(part for part in of if part not in common) or name for of, name in zip(parts, names)]


def _values(frame, arguments, quantity):
    try:
        if arguments.along:
            known = frame.run.summary["boundaries"]
            if arguments.along not in known:
                raise ValueError(f"there is no boundary {arguments.along}; there are {', '.join(known)}")
            return frame.along(arguments.along, quantity)
        x0, y0, x1, y1 = arguments.line
        return frame.line((x0, y0), (x1, y1), quantity)
    except ValueError as error:
        raise ResultError(f"{frame.run.folder}: {error}") from None
