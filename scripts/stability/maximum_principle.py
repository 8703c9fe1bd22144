"""Figure of map 2. The maximum principle of the damage step: kκ against h²."""

import matplotlib.pyplot as plt

from . import verdicts

COLOURS = {8: "#1b9e77", 16: "#d95f02", 32: "#7570b3"}
MASSES = {"consistent": ("o", "full"), "lumped": ("s", "none")}
ROUNDING = 1e-10
PANELS = {
    ("soft square", "rise"): "soft square: ζ above max ζ before",
    ("soft square", "undershoot"): "soft square: ζ below its bound",
    ("nearly broken square", "undershoot"): "nearly broken square: ζ below its bound",
    ("corner", "rise"): "corner: ζ above max ζ before",
    ("corner", "undershoot"): "corner: ζ below its bound",
    ("soft square, obtuse mesh", "rise"): "soft square, obtuse mesh: ζ above max ζ before",
}


def scatter(axis, rows, quantity):
    """How far ζ leaves its bound over kκ/h²; on the lowest line where it does not."""
    for h in sorted({float(r["h"]) for r in rows}, reverse=True):
        for mass, (marker, fill) in MASSES.items():
            of = [r for r in rows if float(r["h"]) == h and r["mass"] == mass]
            axis.plot(
                [float(r["ratio"]) for r in of], [max(float(r[quantity]), ROUNDING) for r in of],
                marker, fillstyle=fill, markersize=4, color=COLOURS[round(1 / h)],
                label=f"h = 1/{round(1 / h)}, {mass}",
            )
    early = [r for r in rows if r["early_stop"] == "true"]
    axis.plot(
        [float(r["ratio"]) for r in early], [max(float(r[quantity]), ROUNDING) for r in early],
        "x", color="black", markersize=9, markeredgewidth=0.8,
    )
    for ratio in (1 / 6, 0.55):
        axis.axvline(ratio, color="grey", linewidth=0.8, linestyle=":")
    axis.set(xscale="log", yscale="log", xlim=(2e-10, 3e2), ylim=(4e-11, 1), xlabel="kκ/h²")


def draw(table, path):
    """Draws the rows of maximum-principle.csv (dictionaries) into the PNG file at path."""
    figure, axes = plt.subplots(2, 3, figsize=(14, 8), layout="constrained", sharey=True)
    for axis, ((scene, quantity), title) in zip(axes.flat, PANELS.items()):
        scatter(axis, [r for r in table if r["scene"] == scene], quantity)
        axis.set_title(title, fontsize=10)
    for axis in axes[:, 0]:
        axis.set_ylabel("excess (1e-10: none)")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="upper left")
    figure.suptitle(f"{verdicts(table)}; dotted: kκ/h² = 1/6 and 0.55; ×: ζ* reached too early")
    figure.savefig(path, dpi=130)
    plt.close(figure)
