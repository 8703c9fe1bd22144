"""Figure of the map of lost contact: bodies pulled off, on one point, about to tip over."""

import matplotlib.pyplot as plt

from . import CELL_COLOURS

SOLVERS = ["active-set", "penalty-duality", "tao"]
AXES = {
    "clamped, lifted": "1 − load / load at which the last node leaves",
    "free, lifted": "net lift / weight",
    "one point and an axis": "e / width: resultant off the middle",
    "on a wedge": "e / width: resultant beside the point",
    "on a curve": "e / width: resultant beside the point",
    "on a wedge, lighter": "load, with e = 0.001",
    "on a flat foot": "e / width: resultant off the middle; 0.5 is the foot's edge",
}


def text(row):
    """Iterations, a star for each fallback, a ring for a note, or who refused."""
    if row["outcome"] == "failed":
        return "–"
    note = "°" if row["outcome"] == "noted" else ""
    return row["iterations"] + "*" * int(row["fallbacks"]) + note


def label(value):
    """Short, but tells 0.499999 from 0.5."""
    number = float(value)
    if 0 < abs(number - 0.5) < 5e-3:
        return f"0.5{number - 0.5:+.0e}".replace("e-0", "e-")
    return f"{number:g}".replace("e-0", "e-")


def draw(table, path):
    """Draws the rows of lost-contact.csv (dictionaries) into the PNG file at path."""
    sweeps = list(dict.fromkeys(r["sweep"] for r in table))
    figure, axes = plt.subplots(len(sweeps), 1, figsize=(12, 1.75 * len(sweeps)), layout="constrained")
    for axis, sweep in zip(axes, sweeps):
        rows = [r for r in table if r["sweep"] == sweep]
        values = list(dict.fromkeys(r["value"] for r in rows))
        for r in rows:
            x, colour = values.index(r["value"]), CELL_COLOURS[r["verdict"]]
            first, height = (0, 3) if r["solver"] == "all" else (SOLVERS.index(r["solver"]), 1)
            cell = plt.Rectangle((x, first), 1, height, facecolor=colour, edgecolor="white")
            axis.add_patch(cell)
            told = "setup" if r["solver"] == "all" else text(r)
            axis.text(x + 0.5, first + height / 2, told, ha="center", va="center", fontsize=8)
        axis.set(xlim=(0, 16), ylim=(3, 0))
        axis.set_xlabel(AXES[sweep], loc="left", fontsize=9)
        axis.set_title(sweep, loc="left", fontsize=10, fontweight="bold")
        axis.set_xticks([i + 0.5 for i in range(len(values))], [label(v) for v in values], fontsize=8)
        axis.set_yticks([0.5, 1.5, 2.5], SOLVERS)
        axis.tick_params(length=0)
        axis.spines[:].set_visible(False)
    figure.suptitle(
        "iterations; green correct, orange refused, red wrong\n"
        "– solver error, ° the answer is noted as one of many, * fallback, setup: refused before solving"
    )
    figure.savefig(path, dpi=130)
    plt.close(figure)
