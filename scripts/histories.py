"""Pictures of quantities in time, from history.csv."""

from itertools import cycle

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import ScalarFormatter

import drawing
from drawing import BLUE, FAINT, RED, canvas, headline, wide
from results import ROUNDING, UNDAMAGED, ResultError


# Names of abscissas; others are columns of history.csv.
NAMES = {"time": "time t ({time})", "displacement_max": "largest displacement ({length})",
         "work": "work of the loads ({work})"}


def draw_damage_history(results, _limits=None, figure=None):
    """Draws min ζ and mean ζ in time, and the time at which ζ reached ζ_*."""
    time, least = results.history.get("time"), results.history.get("zeta_min")
    if time is None or least is None or len(time) < 3 or np.nanmin(least) >= 1.0 - UNDAMAGED:
        return None
    figure = canvas((wide(6.4), max(2.8, 0.6 * wide(6.4))), figure)
    axes = figure.add_subplot()
    axes.plot(time, results.history["zeta_mean"], color=FAINT, linewidth=1.4, label="mean ζ")
    axes.plot(time, least, color=BLUE, linewidth=1.8, label="min ζ")
    stopped = results.summary.get("stopped_at")
    reached = "collapse" if results.summary.get("stopped_by") == "collapse" else "ζ$_*$ reached"
    if stopped is not None:
        axes.axvline(stopped, color=RED, linewidth=1.0, linestyle=(0, (4, 2)),
                     label=f"{reached} at t = {results.stopping_time} {results.units['time']}")
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    axes.yaxis.set_major_formatter(ScalarFormatter(useOffset=False))
    axes.set_xlabel(f"time t ({results.units['time']})")
    axes.set_ylabel("damage field ζ")
    axes.set_title(headline(results, ""))
    axes.legend(loc="lower left")
    return figure


def draw_force_displacement(results, _limits=None, figure=None):
    """Draws the force of each support, its component along the direction that it has where it is largest, over the
    column ABSCISSA. By default this is the largest displacement if it grows in all steps, else the time."""
    history = results.history
    supports = [name.removesuffix(".force_x") for name in history if name.endswith(".force_x")]
    forces = {name: _along_largest(history[f"{name}.force_x"], history[f"{name}.force_y"]) for name in supports}
    largest = max((np.nanmax(force, initial=0.0) for force in forces.values()), default=0.0)
    if largest <= 0.0 or len(history["time"]) < 3:
        return None
    if drawing.ABSCISSA not in (None, *history):
        raise ResultError(f"history.csv has no column {drawing.ABSCISSA}; it has {', '.join(history)}")
    reached = history["displacement_max"]
    # Over displacements that start near their end the curves would be short.
    grows = (np.diff(reached) >= -ROUNDING * reached.max()).all() and reached[0] < 0.5 * reached[-1]
    abscissa = drawing.ABSCISSA or ("displacement_max" if grows else "time")
    figure = canvas((wide(6.4), max(2.8, 0.6 * wide(6.4))), figure)
    axes = figure.add_subplot()
    shown = {name: force for name, force in forces.items() if np.nanmax(force) > ROUNDING * largest}
    # Dashes show a curve under another one.
    for (name, force), dashes in zip(shown.items(), cycle(("-", (0, (4, 3)), (0, (1, 2))))):
        axes.plot(history[abscissa], force, linewidth=1.6, linestyle=dashes, label=name.replace("$", r"\$"))
    if np.nanmin(history[abscissa]) >= 0.0:
        axes.set_xlim(left=0.0)
    if min(map(np.nanmin, shown.values())) < -ROUNDING * largest:
        axes.axhline(0.0, color=FAINT, linewidth=0.7)
    else:
        axes.set_ylim(bottom=0.0)
    axes.locator_params("x", nbins=5)
    axes.set_xlabel(NAMES.get(abscissa, abscissa).format(**results.units))
    axes.set_ylabel("force on the support ({line})".format(**results.units))
    axes.set_title(headline(results, ""))
    axes.legend(loc="best")
    return figure


def _along_largest(x, y):
    """The component of forces along the direction of the largest one."""
    size = np.hypot(x, y)
    if not np.nanmax(size, initial=0.0) > 0.0:
        return size
    k = np.nanargmax(size)
    return (x * x[k] + y * y[k]) / size[k]


# Panels of the figure of all histories: title, columns with their names, logarithmic or not.
PANELS = (
    ("largest displacement ({length})", {"displacement_max": ""}, False),
    ("work of the loads ({work})", {"work": ""}, False),
    ("sum of the contact reactions ({line})", {"contact_force": ""}, False),
    ("active nodes", {"active_nodes": ""}, False),
    ("KKT residuals", {f"kkt_{kind}": kind for kind in (
        "stationarity", "primal", "dual", "complementarity")}, True),
    ("iterations", {"iterations": "of contact", "linear_iterations": "linear"}, False),
    ("error bound of ζ from its linear system", {"zeta_error": ""}, True),
    ("seconds per step", {"seconds": ""}, True),
)


def draw_histories(results):
    """Draws the columns of history.csv in panels; None without time steps."""
    history = results.history
    if len(history.get("time", [])) < 3:
        return None
    panels = [(title, {k: v for k, v in columns.items() if k in history}, is_log) for title, columns, is_log in PANELS]
    panels = [panel for panel in panels if any(np.nanmax(history[k]) > 0.0 for k in panel[1])]
    rows = (len(panels) + 1) // 2
    figure, grid = plt.subplots(rows, 2, figsize=(9.6, 2.1 * rows), sharex=True, squeeze=False)
    for axes, (title, columns, is_log) in zip(grid.flat, panels):
        for column, name in columns.items():
            values = history[column]
            largest = np.nanmax(np.abs(values))
            if is_log:
                values = np.where(values > 0.0, values, np.nan)
            else:
                values = np.where(np.abs(values) <= ROUNDING * largest, 0.0, values)
            if np.isfinite(values).any():
                axes.plot(history["time"], values, linewidth=1.2, label=name)
        axes.set_title(title.format(**results.units), fontsize=9.5)
        axes.set_yscale("log" if is_log else "linear")
        if any(columns.values()):
            axes.legend(fontsize=8, ncols=2, loc="best")
    for axes in grid.flat[len(panels):]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel(f"time t ({results.units['time']})")
    return figure
