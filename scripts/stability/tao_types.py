"""Figure of map 4. TAO's types."""

import matplotlib.pyplot as plt

from . import CELL_COLOURS


def draw(table, path):
    """Draws the rows of tao-types.csv (dictionaries) into the PNG file at path."""
    tolerances = sorted({r["tolerance"] for r in table}, key=float, reverse=True)
    types = list(dict.fromkeys(r["type"] for r in table))
    scenes = list(dict.fromkeys(r["scene"] for r in table))
    figure, axes = plt.subplots(1, len(tolerances), figsize=(14, 5), sharey=True, layout="constrained")
    for axis, tolerance in zip(axes, tolerances):
        for r in (r for r in table if r["tolerance"] == tolerance):
            x, y = scenes.index(r["scene"]), types.index(r["type"])
            axis.add_patch(plt.Rectangle((x, y), 1, 1, facecolor=CELL_COLOURS[r["verdict"]], edgecolor="white"))
            text = r["iterations"] or r["outcome"]
            if int(r["claimed"]):
                text += " *"
            axis.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=8)
        axis.set(xlim=(0, len(scenes)), ylim=(len(types), 0), title=f"tolerance {float(tolerance):.0e}")
        axis.set_xticks([i + 0.5 for i in range(len(scenes))], scenes)
        axis.set_yticks([i + 0.5 for i in range(len(types))], types)
    figure.suptitle("iterations; green correct, orange refused; * TAO claimed convergence too early")
    figure.savefig(path, dpi=130)
    plt.close(figure)
