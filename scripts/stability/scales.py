"""Figure of map 8. Units and gaps."""

import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm
import numpy as np


def draw(table, path):
    """Draws the rows of scales.csv (dictionaries) into the PNG file at path.

    A cell stands for all units: the largest difference from the active set in SI units, and how
    many of them were refused or wrong.
    """
    ratios = sorted({float(r["ratio"]) for r in table})
    names = list(dict.fromkeys((r["kind"], r["solver"]) for r in table))
    worst = np.full((len(names), len(ratios)), np.nan)
    figure, axes = plt.subplots(figsize=(11, 4.2), layout="constrained")
    for i, name in enumerate(names):
        for j, ratio in enumerate(ratios):
            cell = [r for r in table if (r["kind"], r["solver"]) == name and float(r["ratio"]) == ratio]
            found = [float(r["difference"]) for r in cell if r["difference"]]
            worst[i, j] = max([*found, 1e-16])
            bad = sum(r["verdict"] != "correct" for r in cell)
            if bad:
                axes.text(j, i, f"{bad} of {len(cell)}", ha="center", va="center", fontsize=7, color="red")
    image = axes.imshow(worst, norm=LogNorm(1e-16, 1e-6), cmap="viridis", aspect="auto")
    figure.colorbar(image, label="largest difference in all units, relative")
    axes.set_xticks(range(len(ratios)), [f"{r:.0e}" for r in ratios], fontsize=8)
    axes.set_yticks(range(len(names)), [f"{kind}, {solver}" for kind, solver in names], fontsize=8)
    axes.set(xlabel="gap over displacement", title="red: refused or wrong")
    figure.savefig(path, dpi=130)
    plt.close(figure)
