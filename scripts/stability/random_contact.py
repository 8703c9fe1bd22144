"""Figure of map 5, the active set on random problems."""

import matplotlib.pyplot as plt

from . import verdicts


def draw(table, path):
    """Draws the rows of active-set.csv (dictionaries) into the PNG file at path."""
    solved = [r for r in table if r["iterations"]]
    kinds = list(dict.fromkeys(r["kind"] for r in table))
    of = {k: [r for r in solved if r["kind"] == k] for k in kinds}
    figure, axes = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    most = max(int(r["iterations"]) for r in solved)
    axes[0, 0].hist([[int(r["iterations"]) for r in of[k]] for k in kinds],
                    bins=[i - 0.5 for i in range(most + 2)], stacked=True, label=kinds)
    axes[0, 0].set(xlabel="iterations", ylabel="problems")
    axes[0, 0].legend(frameon=False, fontsize=8)
    axes[0, 1].bar(kinds, [sum(int(r["fallbacks"]) for r in of[k]) for k in kinds])
    axes[0, 1].set(ylabel="fallbacks, all problems", ylim=(0, None))
    axes[0, 1].tick_params(axis="x", labelsize=7)
    for k in kinds:
        contrast = [float(r["contrast"]) for r in of[k]]
        axes[1, 0].loglog(contrast, [max(float(r["kkt"]), 1e-17) for r in of[k]], ".", ms=3)
        axes[1, 1].semilogx(contrast, [int(r["iterations"]) for r in of[k]], ".", ms=3)
    axes[1, 0].axhline(1e-10, color="black", lw=0.8)
    axes[1, 0].set(xlabel="contrast of the stiffness", ylabel="worst KKT residual")
    axes[1, 1].set(xlabel="contrast of the stiffness", ylabel="iterations")
    figure.suptitle(verdicts(table))
    figure.savefig(path, dpi=130)
    plt.close(figure)
