"""Figure of map 3. Penalty-duality: ω against λω."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm


def heat(axis, rows, title):
    """Iterations over ω/ω_auto × λω; empty where the program refused."""
    omegas = sorted({float(r["omega_over_auto"]) for r in rows})
    lambdas = sorted({float(r["lambda_omega"]) for r in rows})
    grid = np.full((len(lambdas), len(omegas)), np.nan)
    for r in rows:
        if r["converged"] == "true":
            i, j = lambdas.index(float(r["lambda_omega"])), omegas.index(float(r["omega_over_auto"]))
            grid[i, j] = float(r["iterations"])
            axis.text(j, i, r["iterations"], ha="center", va="center", fontsize=7, color="white")
    image = axis.imshow(grid, origin="lower", aspect="auto", norm=LogNorm(10, 1000), cmap="viridis")
    axis.set_xticks(range(len(omegas)), [f"{o:.2g}" for o in omegas], fontsize=7)
    axis.set_yticks(range(len(lambdas)), lambdas)
    axis.axvline(omegas.index(1.0), color="red", lw=0.8)
    axis.set(title=title, xlabel="ω / ω_auto", ylabel="λω")
    axis.set_facecolor("lightgrey")
    return image


def draw(table, path):
    """Draws the rows of penalty-duality.csv (dictionaries) into the PNG file at path."""
    plain_stiffness = [r for r in table if float(r["contrast"]) == 1]
    coarse = [r for r in plain_stiffness if float(r["h"]) == 1 / 16]
    figure, axes = plt.subplots(1, 3, figsize=(16, 4.5), layout="constrained")
    for axis, accelerate, name in zip(axes, ["false", "true"], ["plain", "Anderson"]):
        image = heat(
            axis, [r for r in coarse if r["accelerate"] == accelerate], f"{name}, h = 1/16 (grey: refused)"
        )
    figure.colorbar(image, ax=axes[1], label="iterations")
    half = [r for r in plain_stiffness if float(r["lambda_omega"]) == 0.5 and r["converged"] == "true"]
    for colour, h in enumerate(sorted({float(r["h"]) for r in half}, reverse=True)):
        for accelerate, style in (("false", "o-"), ("true", "s--")):
            points = [
                (float(r["omega_over_auto"]), int(r["iterations"]))
                for r in half
                if float(r["h"]) == h and r["accelerate"] == accelerate
            ]
            if points:
                label = f"h = 1/{round(1 / h)}" + (", Anderson" if accelerate == "true" else "")
                axes[2].loglog(*zip(*sorted(points)), style, color=f"C{colour}", label=label)
    axes[2].axvline(1, color="red", lw=0.8)
    axes[2].set(title="λω = ½, where it converged", xlabel="ω / ω_auto", ylabel="iterations")
    axes[2].legend(fontsize=7)
    figure.savefig(path, dpi=130)
    plt.close(figure)
