"""Figure of conditioning: soft holes, slivers, near incompressibility, slender bodies."""

import matplotlib.pyplot as plt

from . import verdicts

SOLVERS = {"active-set": "o", "penalty-duality": "s", "tao": "^"}
VERDICTS = {"correct": "#1b9e77", "refused": "#e08214", "wrong": "#d7301f"}


def of(table, **keys):
    """The rows with these values."""
    return [r for r in table if all(r[k] == v for k, v in keys.items())]


def mark(axis, rows, x, y, **style):
    """One mark a row: its shape the solver, its colour the verdict, hollow where noted."""
    for r in rows:
        colour = VERDICTS[r["verdict"]]
        axis.plot(x(r), y(r), SOLVERS[r["solver"]], ms=5, mec=colour,
                  mfc="none" if r["notes"] != "0" else colour, **style)


def differences(axis, rows, cases, floor=1e-15):
    """The difference from the other solvers at 1e-10, over the parameter; refused ones on top."""
    for case, (label, style) in cases.items():
        lines = [r for r in rows if case(r) and r["solver"] == "penalty-duality" and r["difference"]]
        points = sorted((float(r["parameter"]), max(float(r["difference"]), floor)) for r in lines)
        axis.plot(*zip(*points), style, color="grey", lw=0.8, label=label, zorder=0)
    for r in rows:
        mark(axis, [r], lambda r: float(r["parameter"]),
             lambda r: max(float(r["difference"]), floor) if r["difference"] else 1e-4)
    axis.axhline(1e-6, color="black", lw=0.8)
    axis.set(xscale="log", yscale="log", ylim=(1e-15, 1e-3), ylabel="difference of u between solvers")
    axis.invert_xaxis()
    axis.legend(frameon=False, fontsize=8, loc="upper left")


def locking(axis, rows):
    """Error of u against ½ − ν, one line per mesh."""
    for n, style in (("8", ":"), ("16", "--"), ("32", "-")):
        line = of(rows, nx=n, solver="active-set")
        axis.plot([0.5 - float(r["parameter"]) for r in line], [float(r["error"]) for r in line], style,
                  color="grey", lw=0.8, label=f"n = {n}", zorder=0)
        mark(axis, line, lambda r: 0.5 - float(r["parameter"]), lambda r: float(r["error"]))
    axis.axvline(0.05, color="black", lw=0.8)
    axis.set(xscale="log", yscale="log", xlabel="½ − ν (line: noted to its right)",
             ylabel="error of u against the exact answer",
             title="ν → ½ in plane strain (all solvers agree)")
    axis.invert_xaxis()
    axis.legend(frameon=False, fontsize=8, loc="upper left")


def strips(axis, table):
    """A field per body and solver."""
    rows = of(table, sweep="slender")
    bodies = list(dict.fromkeys((r["parameter"], r["nx"], r["ny"]) for r in rows))
    columns = [(case, tolerance) for case in ("bent", "pushed along", "lying", "weightless")
               for tolerance in ("1e-10", "1e-6")]
    for r in rows:
        i = columns.index((r["case"], r["tolerance"])) * 3 + list(SOLVERS).index(r["solver"])
        j = bodies.index((r["parameter"], r["nx"], r["ny"]))
        axis.add_patch(plt.Rectangle((i, j), 1, 1, facecolor=VERDICTS[r["verdict"]], edgecolor="white"))
        text = "n" if r["notes"] != "0" else "" if r["iterations"] else "×"
        axis.text(i + 0.5, j + 0.5, text, ha="center", va="center", fontsize=7, color="white")
    for i in range(0, 25, 3):
        axis.axvline(i, color="black", lw=1.4 if i % 6 == 0 else 0.5)
    axis.set(xlim=(0, 24), ylim=(len(bodies), 0),
             title="strips; in each group active-set, penalty-duality, tao\n"
                   "× ended with an error, n noted")
    axis.set_xticks([3 * k + 1.5 for k in range(8)],
                    [f"{case}\n{tolerance}" for case, tolerance in columns], fontsize=6.5)
    axis.set_yticks([j + 0.5 for j in range(len(bodies))],
                    [f"1:{float(a):.0f}, {nx}×{ny}" for a, nx, ny in bodies], fontsize=7)


def draw(table, path):
    """Draws the rows of conditioning.csv (dictionaries) into the PNG file at path."""
    figure, axes = plt.subplots(2, 2, figsize=(13, 9.5))
    tight = of(table, tolerance="1e-10")
    differences(axes[0, 0], of(tight, sweep="hole"), {
        lambda r: r["nx"] == "16": ("n = 16", "--"), lambda r: r["nx"] == "32": ("n = 32", "-")})
    axes[0, 0].set(xlabel="ζ₀ in the hole", title="soft hole, KKT 1e-10")
    differences(axes[0, 1], of(tight, sweep="slivers"), {
        lambda r: r["case"] == "needles": ("needles", "--"), lambda r: r["case"] == "cap": ("cap", "-")})
    axes[0, 1].axvline(1, color="black", lw=0.8)
    axes[0, 1].set(xlabel="smallest angle (°; line: noted to its right)",
                   title="slivers, KKT 1e-10 (on top: ended with an error)")
    locking(axes[1, 0], of(table, sweep="incompressible"))
    strips(axes[1, 1], table)
    handles = [plt.Line2D([], [], ls="", marker=m, color="grey", label=s) for s, m in SOLVERS.items()]
    handles += [plt.Line2D([], [], ls="", marker="o", color=c, label=v) for v, c in VERDICTS.items()]
    handles += [plt.Line2D([], [], ls="", marker="o", mec="grey", mfc="none", label="hollow: noted")]
    figure.legend(handles=handles, loc="lower center", ncol=7, frameon=False)
    figure.suptitle(verdicts(table))
    figure.tight_layout(rect=(0, 0.04, 1, 0.98))
    figure.savefig(path, dpi=130)
    plt.close(figure)
