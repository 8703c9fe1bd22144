"""Pictures of quantities in time, from history.csv."""

import numpy as np

from drawing import (
    AROUND_PLOTS, BLUE, FAINT, OPTIONS, RED, canvas, colours, em, few_ticks, headline, legend, plot, power_of, room_for_legend,
    times_power,
)
from driven import driven_boundary
from results import ROUNDING, UNDAMAGED, ResultError

# The styles of lines: a figure has the same one in all runs.
DASHES = "-", (0, (4, 3)), (0, (1, 2)), (0, (6, 2, 1, 2)), (0, (8, 2, 1, 2, 1, 2))


def draw_damage_history(results, _limits=None, figure=None):
    """Draws the largest and the mean damage 1 − ζ in time, and the time at which ζ reached ζ_*."""
    time, least = results.history.get("time"), results.history.get("zeta_min")
    if time is None or least is None or len(time) < 3 or np.nanmin(least) >= 1.0 - UNDAMAGED:
        return None
    stopped = results.summary.get("stopped_at")
    reached = "collapse" if results.summary.get("stopped_by") == "collapse" else "ζ_* reached"
    labels = ["mean", "largest"]
    labels += [] if stopped is None else [f"{reached} at t = {results.stopping_time} {results.units['time']}"]
    below, power = room_for_legend(labels), power_of(1.0 - np.nanmin(least))
    figure, axes = plot(headline(results, "damage 1 − ζ in time"), figure, below=below)
    axes.plot(time, (1.0 - results.history["zeta_mean"]) / 10.0**power, color=FAINT, linewidth=1.4, label=labels[0])
    axes.plot(time, (1.0 - least) / 10.0**power, color=BLUE, linewidth=1.8, label=labels[1])
    if stopped is not None:
        axes.axvline(stopped, color=RED, linewidth=1.0, linestyle=(0, (4, 2)), label=labels[2])
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    few_ticks(axes)
    axes.set_xlabel(f"time t ({results.units['time']})")
    axes.set_ylabel(f"damage 1 − ζ{times_power(power)}")
    legend(axes, below)
    return figure


def draw_force_displacement(results, _limits=None, figure=None):
    """Draws the force of each support; see `draw_forces`."""
    return draw_forces([results], [""], figure)


def draw_forces(runs, names, figure=None):
    """Draws the force of each support of one or more runs, its component along the direction that it has where it is
    largest. The abscissa is a column of history.csv if one is asked for; else the displacement of the driven boundary, if all runs
    have one; else the largest displacement, if it grows in all steps of all runs; else the time."""
    kept = [k for k, results in enumerate(runs) if len(results.history["time"]) > 2]
    runs, names = [runs[k] for k in kept], [names[k] for k in kept]
    forces = [_forces(results.history) for results in runs]
    largest = max((np.nanmax(force, initial=0.0) for of in forces for force in of.values()), default=0.0)
    if largest <= 0.0:
        return None
    label, unit, abscissas = _abscissas(runs)
    forces = [{name: force for name, force in of.items() if np.nanmax(force) > ROUNDING * largest} for of in forces]
    supports = list(dict.fromkeys(support for of in forces for support in of))
    # Runs have colours, and supports dashes; the supports of a single run have both.
    curves = [(", ".join(filter(None, (name, support))), abscissa, force, k, supports.index(support))
              for k, (name, abscissa, of) in enumerate(zip(names, abscissas, forces))
              for support, force in of.items()]
    below = room_for_legend([of[0] for of in curves])
    text = "forces on the supports" if len(runs) > 1 else headline(runs[0], "forces on the supports")
    figure, axes = plot(text, figure, below=below)
    across, up = power_of(max(np.nanmax(np.abs(abscissa)) for abscissa in abscissas)), power_of(largest)
    colour = colours(max(len(runs), len(supports)))
    for name, abscissa, force, k, number in curves:
        axes.plot(abscissa / 10.0**across, force / 10.0**up, linewidth=1.6, linestyle=DASHES[number % len(DASHES)], label=name,
                  color=colour[k if len(runs) > 1 else number])
    if min(map(np.nanmin, abscissas)) >= 0.0:
        axes.set_xlim(left=0.0)
    if min(np.nanmin(force) for _, _, force, *_ in curves) < -ROUNDING * largest:
        axes.axhline(0.0, color=FAINT, linewidth=0.7)
    else:
        axes.set_ylim(bottom=0.0)
    few_ticks(axes)
    axes.set_xlabel(label + times_power(across, unit))
    axes.set_ylabel(f"force{times_power(up, runs[0].units['line'])}")
    legend(axes, below)
    return figure


def _abscissas(runs):
    """The abscissa of the forces: its label, its unit, and its values in each run."""
    for results in runs:
        if OPTIONS.abscissa not in (None, *results.history):
            raise ResultError(f"history.csv has no column {OPTIONS.abscissa}; it has {', '.join(results.history)}")
    driven = [driven_boundary(results) for results in runs] if OPTIONS.abscissa is None else [None]
    if None not in driven:
        names = dict.fromkeys(name for name, _ in driven)
        return f"displacement of {' and '.join(names)}", runs[0].units["length"], [moved for _, moved in driven]
    over = OPTIONS.abscissa or (
        "displacement_max" if all(_grows(results.history["displacement_max"]) for results in runs) else "time")
    of = {"label": "time t", "unit": runs[0].units["time"]} if over == "time" else runs[0].summary["figures"].get(over, {})
    return of.get("label", over), of.get("unit", ""), [results.history[over] for results in runs]


def _forces(history):
    """The force of each support along the direction that it has where it is largest."""
    names = [name.removesuffix(".force_x") for name in history if name.endswith(".force_x")]
    return {name: _along_largest(history[f"{name}.force_x"], history[f"{name}.force_y"]) for name in names}


def _grows(reached):
    """Whether values grow in all steps. Over displacements that start near their end the curves would be short."""
    return (np.diff(reached) >= -ROUNDING * reached.max()).all() and reached[0] < 0.5 * reached[-1]


def _along_largest(x, y):
    """The component of forces along the direction of the largest one."""
    size = np.hypot(x, y)
    if not np.nanmax(size, initial=0.0) > 0.0:
        return size
    k = np.nanargmax(size)
    return (x * x[k] + y * y[k]) / size[k]


def draw_histories(results):
    """The figures of the whole body in time, a panel each; None without time steps."""
    history = results.history
    if len(history.get("time", [])) < 3:
        return None
    figures = [(of, history[name]) for name, of in results.figures.items()
               if "." not in name and name in history and np.nanmax(np.abs(history[name]), initial=0.0) > 0.0]
    powers = [power_of(np.nanmax(np.abs(values))) for _, values in figures]
    left, right, top, bottom = (em() * of for of in AROUND_PLOTS)
    figure, grid = canvas([(left, 4.8 - left - right, right)] * 2, [(top, 1.3, bottom)] * ((len(figures) + 1) // 2),
                          titles=[of["label"] + times_power(power, of["unit"]) for (of, _), power in zip(figures, powers)])
    for axes, (_, values), power in zip(grid, figures, powers):
        axes.plot(history["time"], values / 10.0**power, color=BLUE, linewidth=1.2)
        axes.set_xlabel(f"time t ({results.units['time']})")
        axes.yaxis.get_major_formatter().set_useOffset(False)
    for axes in grid[len(figures):]:
        axes.remove()
    return figure
