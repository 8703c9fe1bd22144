#!/usr/bin/python3
"""The paper's Figures 1 to 9 and its Table 1 in its layout, into out/paper: displacements × 10, ζ rather than 1 − ζ. Figures 6
and 9 are as wide as a page of a journal (170 mm), the others as a column (85 mm). A sheet has all of them, as wide as its
page, for a reader who has the paper beside it.

    paper.py [--binary FILE] [--quick]

--quick leaves out Table 1 and Figure 3, whose runs take some minutes. What the paper does not print is listed at the
end.
"""

import subprocess

import numpy as np

from shared import ROOT, parser_of
import converge
import drawing
import latex
from drawing import BLUE, INK, RED, Map, draw_body, draw_colourbar, draw_maps, draw_values, mesh_of, plt, wrapped
from limits import limits_of
from maps import draw_deformed, draw_mesh, von_mises_map
from reading import read_results
from results import write_table
from setting import draw_setting

# The widths of a column and of the page of a journal, 85 mm and 170 mm, in inches, and dots per inch.
COLUMN, PAGE, DPI = 85 / 25.4, 170 / 25.4, 300
# Scene, overrides, and the figures of its run: number → drawing.
RUNS = {
    "square": (["mesh.size=0.125", "time.end=0.01", "time.step=0.01"], {2: "setting"}),
    "lshape": ([], {4: "setting", 5: "deformed", 6: "stress"}),
    "bridge": ([], {7: "setting", 8: "deformed", 9: "stress"}),
}
CAPTIONS = {
    1: "A frictionless contact problem between an elastic body and a rigid obstacle.",
    2: "Example I: physical setting, and mesh for n = 8.",
    3: "Example I: the error against h + k, in the norm of Corollary 7 (dots: ours; crosses: printed).",
    4: "Example II: contact problem of an L-shaped domain.",
    5: "Example II: deformed mesh (× 10) and initial configuration.",
    6: "Example II: von Mises stress and damage field ζ (1: sound) at the final time.",
    7: "Example III: a U-shaped domain.",
    8: "Example III: deformed mesh (× 10) and initial configuration.",
    9: "Example III: von Mises stress and damage field ζ (1: sound) at the final time.",
}
OURS = """\
What the paper does not print, and what we took (geo/*.toml):
  Figures 4 and 7 have no dimensions. Ours: the leg of the L is [0, 2] x [0, 4] m, its arm [0, 8] x [4, 6] m, with the
    obstacle under 6 <= x <= 8; the bridge is [0, 12] x [0, 6] m with the opening [2, 10] x [0, 4] m, its load on
    4 <= x <= 8 of the top.
  Table 1: with the printed load of Example I, (-10, -10), the run stops at zeta_*, before T = 1. The errors fit a load
    of (-5, 0), with all else as printed: geo/square-table1.toml.
  Table 1 compares with n = 256, k = 1e-4; ours with n = 256 and second-order steps of k = 1e-3.
  Meshes of Figures 5 and 8 are finer here, and graded towards the corners."""


def solved(binary, name, sets, folder):
    """The results of a scene."""
    words = [word for text in sets for word in ("--set", text)]
    subprocess.run([binary, "run", ROOT / "geo" / f"{name}.toml", *words, "--out", folder],
                   check=True, stdout=subprocess.DEVNULL)
    return read_results(folder)


def draw_stress_and_zeta(results, limits):
    """Figures 6 and 9: the von Mises stress, and the damage field ζ, dark where the body is damaged."""
    def paint(axes):
        mesh, zeta = mesh_of(results, results.nodes), results.pieces.at_points(results.zeta)
        bar = draw_colourbar(axes, draw_values(axes, mesh, zeta, "magma", zeta.min(), 1.0))
        # ζ is close to 1, which takes many digits.
        bar.ax.yaxis.set_major_formatter(lambda tick, _: f"{tick:g}")
        bar.ax.tick_params(labelsize="small")
        draw_body(axes, results, 0.0)

    return draw_maps([von_mises_map(results, limits), Map("damage field ζ", results.box, paint)], "", results.units)


def draw_sketch():
    """Figure 1: the body Ω, the parts Γ_D, Γ_N, Γ_C of its boundary, and the gap g to the obstacle."""
    figure, axes = plt.subplots(figsize=(COLUMN, 0.72 * COLUMN), layout="constrained")
    angle = np.linspace(0.0, 2 * np.pi, 400)
    radius = 1.0 + 0.08 * np.cos(3 * angle) + 0.05 * np.sin(2 * angle)
    x, y = 1.5 * radius * np.cos(angle), radius * np.sin(angle)
    axes.fill(x, y, color="#edf1f5")
    axes.plot(x, y, color=INK, linewidth=1.0)
    for low, high, colour, name, place in (
            (2.2, 4.0, BLUE, r"$\Gamma_D$", (-1.7, 0.2)),
            (4.2, 5.3, INK, r"$\Gamma_C$", (0.0, -0.72)), (0.2, 1.6, RED, r"$\Gamma_N$", (0.85, 0.45))):
        part = (angle >= low) & (angle <= high)
        axes.plot(x[part], y[part], color=colour, linewidth=2.6)
        axes.text(*place, name, color=colour, fontsize=10, parse_math=True)
    axes.axhline(-1.3, color=INK, linewidth=2.0)
    axes.fill_between([-2.2, 2.2], -1.3, -1.45, hatch="////", facecolor="none", edgecolor=INK, linewidth=0)
    k, j = (np.abs(angle - place).argmin() for place in (4.45, 4.95))
    gap, arrow = ({"arrowstyle": style, "color": INK, "shrinkA": 0, "shrinkB": 0} for style in ("<->", "->"))
    axes.annotate("", (x[k], -1.3), (x[k], y[k]), arrowprops=gap)
    axes.text(x[k] + 0.07, -1.2, "g", fontsize=9)
    normal = np.array([y[j + 1] - y[j - 1], x[j - 1] - x[j + 1]])
    axes.annotate("", (x[j], y[j]) + 0.3 * normal / np.hypot(*normal), (x[j], y[j]), arrowprops=arrow)
    axes.text(x[j] + 0.12, y[j] - 0.25, r"$\nu$", fontsize=9, parse_math=True)
    for top in (0.55, 0.95, 1.3):
        k = np.abs(angle - top).argmin()
        axes.annotate("", (x[k], y[k]), (1.25 * x[k], 1.3 * y[k]), arrowprops={"arrowstyle": "->", "color": RED})
    axes.text(1.1, 1.0, r"$\mathbf{f}_N$", color=RED, fontsize=10, parse_math=True)
    axes.text(-0.1, 0.0, r"$\Omega$", fontsize=11, parse_math=True)
    axes.text(1.25, -1.68, "obstacle", fontsize=8)
    axes.set(xlim=(-2.3, 2.3), ylim=(-1.75, 1.6), aspect="equal")
    axes.axis("off")
    return figure


def written(figure, out, name):
    """Saves a figure as PNG and PDF; returns the path of the PNG."""
    for ending in ("pdf", "png"):
        path = out / f"{name}.{ending}"
        figure.savefig(path, dpi=DPI)
    plt.close(figure)
    print(path)
    return path


def figures(binary, out):
    """Draws the figures of the runs; returns the PNGs by number."""
    found = {1: [written(draw_sketch(), out, "figure-1")]}
    for name, (sets, drawn) in RUNS.items():
        results = solved(binary, name, sets, out / "runs" / name)
        limits = limits_of([results], 10.0)
        for number, kind in drawn.items():
            # Two maps stand beside each other on the page.
            drawing.use(**{"width": PAGE, "height": 3.0} if kind == "stress" else {"width": COLUMN, "height": 7.0})
            draw = {"setting": draw_setting, "deformed": draw_deformed, "stress": draw_stress_and_zeta}
            found[number] = [written(draw[kind](results, limits), out, f"figure-{number}")]
        if name == "square":
            found[2].append(written(draw_mesh(results), out, "figure-2-mesh"))
    return found


def table_1(rows, out):
    """Table 1 as CSV, and for LaTeX as the paper has it, with the printed value in brackets behind each of ours; 150 mm wide."""
    rows = [{key: row[key] for key in ("h", "k", "sum", "printed")} for row in rows if row["printed"]]
    write_table(rows, out / "table-1.csv")
    steps = sorted({row["k"] for row in rows}, reverse=True)
    cells = {(row["h"], row["k"]): rf"\num{{{row['sum']:#.4g}}} (\num{{{row['printed']:#.4g}}})" for row in rows}
    lines = [[rf"\num{{{np.sqrt(2.0) / h:.0f}}}", *(cells.get((h, k), "") for k in steps)]
             for h in sorted({row["h"] for row in rows}, reverse=True)]
    text = latex.tabular(["$n$", *(rf"$k = \num{{{k:g}}}$" for k in steps)], lines)
    style = r"{\footnotesize\setlength{\tabcolsep}{3pt}\sisetup{group-digits = none}%"
    (out / "table-1.tex").write_text(f"{style}\n{text}}}\n", encoding="utf-8")
    print(out / "table-1.csv", out / "table-1.tex", sep="\n")


def draw_figure_3(rows):
    figure, axes = plt.subplots(figsize=(COLUMN, 1.15 * COLUMN), layout="constrained")
    converge.draw_sums(axes, rows)
    axes.set_title("", loc="left")
    converge.finish(axes)
    axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.22), ncols=2, fontsize="small", columnspacing=1.0)
    return figure


def sheet(found, out):
    """All figures on one page in their own size, beside each other where there is room, with their captions."""
    size, line, lines = 7.5, 0.14, []
    for number in sorted(found):
        for path in found[number]:
            image = plt.imread(path)
            high, wide = np.array(image.shape[:2]) / DPI
            text = wrapped(f"Figure {number}. {CAPTIONS[number]}", wide - 0.1, size)
            if not lines or sum(of[2] for of in lines[-1]) + wide > PAGE + 0.01:
                lines.append([])
            lines[-1].append((image, high, wide, text))
    heads = [line * (1.0 + max(len(text) for *_, text in of)) for of in lines]
    heights = [head + max(high for _, high, *_ in of) + 0.1 for head, of in zip(heads, lines)]
    page, top = plt.figure(figsize=(PAGE, sum(heights))), 0.0
    for of, head, height in zip(lines, heads, heights):
        x = 0.0
        for image, high, wide, text in of:
            page.text((x + 0.05) / PAGE, 1.0 - (top + 0.04) / sum(heights), "\n".join(text), size=size, va="top")
            axes = page.add_axes((x / PAGE, 1.0 - (top + head + high) / sum(heights), wide / PAGE, high / sum(heights)))
            axes.imshow(image, interpolation="none")
            axes.axis("off")
            x += PAGE - COLUMN
        top += height
    written(page, out, "sheet")


def main():
    parser = parser_of(__doc__, "paper")
    parser.add_argument("--quick", action="store_true", help="without Table 1 and Figure 3")
    arguments = parser.parse_args()
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    drawing.use(width=COLUMN, titles=False)
    found = figures(arguments.binary, out)
    if not arguments.quick:
        rows = converge.errors_of_table_1(arguments.binary)
        table_1(rows, out)
        found[3] = [written(draw_figure_3(rows), out, "figure-3")]
    sheet(found, out)
    print(OURS)


if __name__ == "__main__":
    main()
