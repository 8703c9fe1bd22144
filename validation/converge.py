#!/usr/bin/python3
"""Orders of convergence on nested meshes; of geo/square-table1.toml the paper's Table 1 and Figure 3:

    converge.py [--binary FILE] [--reference] SCENE

The coarsest mesh (8 times as coarse as the scene's) is refined by the midpoints of all sides. The reference is P1
by `bdf2` on the last refinement, kept in out/reference/nested/ (beside a scene that is not of this repository); --reference makes it alone. The runs are P1 by
Euler's scheme on the coarsest mesh and up to four refinements, k = T/50 … T/1000. All are compared at 51
times. On nested meshes of a polygon the norms of differences are exact. Along curved sides the new nodes are on the
curve; there the coarse fields are continued to the fine mesh. Prints the errors, and writes converge.csv, run by run,
and converge.png into out/converge/<scene>. A study that was interrupted goes on.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from shared import ROOT, out_of, parser_of
from drawing import FAINT, INK, MaxNLocator, drawn_ticks, plt
from reading import read_frame
from references import geometry_of, kept, nested
from results import markdown, read_table, write_table
from scene import SceneError, read_scene, write_scene
from true_errors import Run

INTERVALS, MESHES, COARSER = 50, 5, 8
# T/k of the runs: k = 0.02 … 0.001 s in Table 1.
STEPS = (50, 100, 200, 500, 1000)
# "Example I: Numerical errors obtained with different n and k": a row for n = 4, 8, 16, 32, 64, h = √2/n.
TABLE_1 = """
0.03027 0.02931 0.02884 0.02856 0.02856
0.01934 0.01803 0.01739 0.01701 0.01688
0.01594 0.01167 0.01003 0.009247 0.008794
0.007324 0.005391 0.004471 0.003956 0.003794
0.005254 0.003095 0.002029 0.001441 0.001269"""
TABLE_1 = [[float(word) for word in line.split()] for line in TABLE_1.strip().splitlines()]
PAPER = "square-table1"
# Errors by their columns; the first four are norms of the reference, too.
MEASURES = {
    "strain": "‖ε(Δu)‖ in L²",
    "gradient": "|Δu| in H¹",
    "zeta": "‖Δζ‖ in L²",
    "zeta_gradient": "|Δζ| in H¹",
    "sum": "‖ε(Δu)‖ + ‖Δζ‖ in L² (Corollary 7)",
    "nodal": "|Δu| in H¹ at the nodes + ‖Δζ‖ in L²",
}
NORMS = list(MEASURES)[:4]
SENTENCES = ("order {:.2f} in h + k over all runs", "{:.2f} in h at the smallest k",
             "on the finest mesh it grows with k by {:.1e} per second")
COLOURS = ["#2f6db3", "#d08a1d", "#3d8f5a", "#8e5aa8", "#c0392b"]


class Fields:
    """(u_x, u_y, ζ) of a run in P1 at its nodes, at all times: (times, nodes, 3)."""

    def __init__(self, folder):
        self.run = run = Run(folder)
        frames = (read_frame(path).point_data for _, path in run.frames)
        self.values = np.array([np.column_stack([frame["displacement"][:, :2], frame["zeta"]]) for frame in frames])
        corners = run.points[run.cells]
        self.edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        every, middle = np.arange(len(run.cells)), np.full((len(run.cells), 3), 1 / 3)
        self.gradients = run.gradients(every, middle)
        self.areas = 0.5 * np.abs(np.linalg.det(run.mapped(every, middle)[1]))
        self.inner = np.empty_like(run.points)
        self.inner[run.cells] = corners.mean(axis=1)[:, None]

    def at(self, other):
        """Interpolates the values at the nodes of another mesh of the body."""
        cell, place = self.run.locate(other.run.points, other.inner)
        return np.einsum("nk,tnkc->tnc", place, self.values[:, self.run.cells[cell]])

    def norms(self, values):
        """‖ε(u)‖, |u|, ‖ζ‖ and |ζ| of fields (nodes, 3) on this mesh."""
        corners = values[self.run.cells]
        h = np.einsum("mkc,mkd->mcd", corners, self.gradients)
        u, zeta = h[:, :2], corners[:, :, 2]
        strain = 0.5 * (u + u.swapaxes(1, 2))
        squares = ((strain**2).sum((1, 2)), (u**2).sum((1, 2)),
                   ((zeta**2).sum(1) + zeta.sum(1) ** 2) / 12, (h[:, 2] ** 2).sum(1))
        return np.sqrt([self.areas @ square for square in squares])


class Study:
    """A scene with its nested meshes."""

    def __init__(self, arguments):
        path = arguments.scene
        self.binary, self.name, self.refinements = arguments.binary, path.stem, arguments.refinements
        scene = read_scene(path)
        if "time" not in scene:
            raise SceneError(f"{path}: orders of convergence need a scene with [time]")
        self.end = float(scene["time"]["end"])
        self.step = arguments.step or self.end / 1000
        every = self.end / INTERVALS / self.step
        if not (every > 0.5 and abs(every - round(every)) < 1e-6):
            sys.exit(f"--step: must divide {self.end / INTERVALS:g} s, but is {self.step:g}")
        file, _ = geometry_of(path, scene)
        parameters = dict(scene["mesh"].get("parameters", {}))
        if size := arguments.size or COARSER * scene["mesh"].get("size", 0):
            parameters["size"] = size
        lines = [f"{name} = {value};" for name, value in parameters.items()]
        # The text, not an Include: a changed geometry needs another reference.
        self.geometry = "\n".join([*lines, file.read_text(encoding="utf-8")])
        self.scene = {key: scene[key] for key in scene if key not in ("accuracy", "discretisation")}
        words = "".join(f"-{name}{value:g}" for name, value in parameters.items())
        self.out = out_of(path)
        self.folder = (self.out / "reference" / "nested"
                       / f"{self.name}{words}-refined{self.refinements}-k{self.step:g}")

    def timed(self, step, scheme):
        """The scene with uniform steps and a frame at each compared time."""
        time = {"end": self.end, "step": step, "scheme": scheme}
        every = round(self.end / INTERVALS / step)
        return {**self.scene, "time": time, "output": {"every": every, "checkpoint": 0}}

    def reference(self):
        """The folder of the reference's results."""
        return kept(self.binary, self.folder, self.timed(self.step, "bdf2"), self.geometry, self.refinements)

    def rows(self):
        """A row for each run, mesh by mesh. They are kept beside the reference until the study is complete."""
        exact, file = Fields(self.reference()), self.folder / "rows.csv"
        size = np.max([exact.norms(values) for values in exact.values], axis=0)
        meshes = nested(self.folder, self.refinements)[:-1][:MESHES]
        runs = [(mesh, count) for mesh in meshes for count in STEPS if self.end / count > 0.999 * self.step]
        if not runs:
            raise SceneError("no mesh and step of the study is coarser than this reference")
        rows = read_table(file) if file.exists() else []
        print(f"{len(runs)} runs, {len(rows)} of them complete", file=sys.stderr)
        yield from rows
        for n, (mesh, count) in enumerate(runs[len(rows):], len(rows) + 1):
            with tempfile.TemporaryDirectory() as folder:
                path, out = Path(folder) / "scene.toml", Path(folder) / "out"
                write_scene({**self.timed(self.end / count, "euler"), "mesh": {"file": str(mesh)}}, path)
                subprocess.run([self.binary, "run", path, "--out", out], check=True, stdout=subprocess.DEVNULL)
                rows.append(self.row(exact, size, Fields(out), self.end / count))
            print(f"{n}/{len(runs)} {rows[-1]['nodes']} nodes, k = {rows[-1]['k']:g}: {rows[-1]['sum']:.4g}",
                  file=sys.stderr, flush=True)
            write_table(rows, file)
            yield rows[-1]
        file.unlink()

    def row(self, exact, size, fields, k):
        """The errors of a run: the largest over time."""
        if len(fields.values) != len(exact.values):
            raise SceneError(f"{self.name}: the run stops at ζ_*; choose a scene that reaches its end")
        found = [exact.norms(ours - theirs) for ours, theirs in zip(fields.at(exact), exact.values)]
        nodal = [fields.norms(ours - theirs)[1] for ours, theirs in zip(fields.values, exact.at(fields))]
        worst, h = np.max(found, axis=0), fields.edges.max()
        row = {"nodes": len(fields.run.points), "h": h, "k": k, "h_plus_k": h + k, **dict(zip(NORMS, worst))}
        row |= {"sum": max(norms[0] + norms[2] for norms in found), "nodal": max(nodal) + worst[2]}
        row |= {f"{name}_relative": value for name, value in zip(NORMS, worst / size)}
        return {**row, "printed": printed(h, k) if self.name == PAPER else None}


def printed(h, k):
    """The value of Table 1 for h and k, if there is one."""
    j, column = round(np.log2(np.sqrt(2) / h / 4)), [c for c, n in enumerate(STEPS) if abs(k * n - 1) < 1e-6]
    fits = 0 <= j < MESHES and abs(h * 4 * 2**j / np.sqrt(2) - 1) < 1e-6
    return TABLE_1[j][column[0]] if fits and column else None


def fit(x, y):
    """The order p of y ~ x^p by least squares, and the factor; NaN for a single x."""
    if len(set(x)) < 2:
        return np.nan, np.nan
    p, logarithm = np.polyfit(np.log(x), np.log(y), 1)
    return p, np.exp(logarithm)


def column(rows, name):
    return np.array([row[name] for row in rows])


def text(rows, cell, title, mesh):
    """A line for each mesh and a column for each step."""
    steps = sorted({row["k"] for row in rows}, reverse=True)
    of = {(row["h"], row["k"]): row for row in rows}
    lines = [[mesh(h), *(cell(of[h, k]) for k in steps)] for h in dict.fromkeys(row["h"] for row in rows)]
    return markdown([title, *(f"k = {k:g}" for k in steps)], lines)


def report(rows):
    """Prints the errors with their orders, and those of Table 1."""
    least = [row for row in rows if row["k"] == min(column(rows, "k"))]
    finest = [row for row in rows if row["h"] == min(column(rows, "h"))]
    of_paper = [row for row in rows if row["printed"]]
    for name, title in MEASURES.items():
        print(f"{title}, largest over time\n")
        print(text(rows, lambda row: f"{row[name]:.4g}", "h", lambda h: f"{h:.4g}"))
        orders = [fit(column(of, x), column(of, name))[0] for of, x in ((rows, "h_plus_k"), (least, "h"))]
        growth = np.polyfit(column(finest, "k"), column(finest, name), 1)[0] if len(finest) > 1 else np.nan
        # Orders need two meshes, and a growth two steps.
        orders = orders if np.isfinite(orders[1]) else []
        told = [words.format(value) for words, value in zip(SENTENCES[-len(orders) - 1:], (*orders, growth))
                if np.isfinite(value)]
        print(f"\n{'; '.join(told) or 'no order: it needs at least two meshes or steps'}\n")
    for name in ("sum", "nodal") if of_paper else ():
        ratios = column(of_paper, name) / column(of_paper, "printed")
        orders = [fit(column(of_paper, "h_plus_k"), column(of_paper, of))[0] for of in (name, "printed")]
        print(f"{MEASURES[name]}, in brackets over Table 1 of the paper\n")
        print(text(of_paper, lambda row: f"{row[name]:.4g} ({row[name] / row['printed']:.2f})", "n",
                   lambda h: f"{np.sqrt(2) / h:.0f}"))
        print(f"\nratios {ratios.min():.2f} to {ratios.max():.2f}, {ratios.mean():.2f} in the mean; order in h + k "
              f"{orders[0]:.2f}, the paper's {orders[1]:.2f}\n")


def draw_sums(axes, rows):
    """Draws the error of Table 1 against h + k with fitted orders: ours and the printed one."""
    of_paper = [row for row in rows if row["printed"]]
    for colour, h in zip(COLOURS, dict.fromkeys(row["h"] for row in rows)):
        label = f"n = {np.sqrt(2.0) / h:.0f}" if of_paper else f"h = {h:.3g}"
        for chosen, name, style in ((rows, "sum", "o-"), (of_paper, "printed", "x--")):
            chosen = [row for row in chosen if row["h"] == h]
            axes.loglog(column(chosen, "h_plus_k"), column(chosen, name), style, color=colour, ms=4.5, lw=0.9,
                        label=label if name == "sum" else None)
    for of, name, style, whose in ((rows, "sum", "-", "ours"), (of_paper, "printed", "--", "print")):
        if of:
            x = column(of, "h_plus_k")
            order, factor = fit(x, column(of, name))
            ends = np.array([x.min(), x.max()])
            axes.loglog(ends, factor * ends**order, color=INK, lw=1, ls=style, label=f"fit, {whose}: order {order:.2f}")
    axes.set(xlabel="h + k", ylabel="largest ‖ε(Δu)‖ + ‖Δζ‖ over time")
    title = "error against h + k on each mesh"
    axes.set_title(f"Figure 3: {title}\n(dots: ours; crosses: the paper's Table 1)" if of_paper else title, loc="left")


def draw_orders(axes, rows):
    """Draws all errors against h at the smallest k."""
    least = min(column(rows, "k"))
    rows = [row for row in rows if row["k"] == least]
    h = column(rows, "h")
    for colour, name in zip(COLOURS, NORMS):
        errors = column(rows, f"{name}_relative")
        order, factor = fit(h, errors)
        axes.loglog(h, errors, "o", color=colour, ms=4.5, label=f"{MEASURES[name]}: order {order:.2f}")
        axes.loglog(h, factor * h**order, color=colour, lw=1)
    axes.set(xlabel="h: the longest edge", ylabel="error relative to the reference's norm")
    axes.set_title(f"all errors at k = {least:g}, largest over time", loc="left")


def finish(axes):
    """Draws the grid, and at least three ticks on each logarithmic axis."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)))
        tried = [np.outer(powers, of).ravel() for of in ([1], [1, 2, 5], range(1, 10))]
        tried = [ticks[(low <= ticks) & (ticks <= high)] for ticks in [*tried, MaxNLocator(5).tick_values(low, high)]]
        drawn_ticks(axis, next((ticks for ticks in tried if len(ticks) > 2), tried[-1]))
    axes.grid(color=FAINT, alpha=0.3, linewidth=0.5)
    axes.set_axisbelow(True)


def draw(rows, path):
    """Both figures side by side."""
    figure, panels = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
    for axes, draw_errors in zip(panels, (draw_sums, draw_orders)):
        draw_errors(axes, rows)
        finish(axes)
        axes.legend(fontsize="small")
    figure.savefig(path)


def errors_of_table_1(binary):
    """The rows of the study of the paper's Table 1."""
    return list(Study(arguments_of(["--binary", str(binary)])).rows())


def arguments_of(words=None):
    """The command line."""
    parser = parser_of(__doc__)
    parser.add_argument("scene", type=Path, nargs="?", default=ROOT / "geo" / f"{PAPER}.toml")
    parser.add_argument("--reference", action="store_true", help="only make the reference")
    parser.add_argument("--refinements", type=int, default=6, help="of the coarsest mesh for the reference")
    parser.add_argument("--size", type=float, help="of the coarsest mesh, m (default: 8 times the scene's)")
    parser.add_argument("--step", type=float, help="of the reference, s (default: T/1000)")
    parser.add_argument("--out", type=Path, help="folder for the table and the figure (default: out/converge/<scene>)")
    return parser.parse_args(words)


def main():
    arguments = arguments_of()
    try:
        study = Study(arguments)
        if arguments.reference:
            print(study.reference())
            return
        out = arguments.out or study.out / "converge" / study.name
        out.mkdir(parents=True, exist_ok=True)
        print(f"{study.name}: linear triangles (P1), Euler's scheme", flush=True)
        rows = []
        for row in study.rows():
            rows.append(row)
            write_table(rows, out / "converge.csv")
    except (SceneError, subprocess.CalledProcessError) as error:
        sys.exit(f"error: {error}")
    report(rows)
    print(out / "converge.csv")
    if len({row["h"] for row in rows}) > 1:
        draw(rows, out / "converge.png")
        print(out / "converge.png")


if __name__ == "__main__":
    main()
