"""Common parts of the figures: style, maps with equal aspect, readable scales."""

import os
import resource
import sys
import textwrap

# Address space in bytes that the packages and a small picture take. OpenBLAS waits for ever when it gets no buffer.
NEEDED = 320 << 20
LIMIT, _ = resource.getrlimit(resource.RLIMIT_AS)
if LIMIT != resource.RLIM_INFINITY:
    if LIMIT < NEEDED:
        sys.exit(f"error: pictures need at least {NEEDED >> 20} MiB of memory, but the limit (ulimit -v) is "
                 f"{LIMIT >> 20} MiB; raise it")
    # Each thread would reserve a stack and a buffer.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, TriMesh
from matplotlib.colors import Normalize
from matplotlib.patheffects import withTickedStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

if LIMIT != resource.RLIM_INFINITY:
    # OpenBLAS keeps the buffer that it allocates here, before the results take the memory.
    np.ones((64, 64)) @ np.ones((64, 64))

INK, FAINT, BLUE, RED, GREEN = "#22262b", "#9aa3ad", "#2f6db3", "#c0392b", "#3d8f5a"

plt.rcParams.update({
    "figure.dpi": 160,
    "figure.constrained_layout.use": True,
    "savefig.bbox": "tight",
    "savefig.pad_inches": 0.1,
    "font.size": 10,
    "axes.titlesize": 10.5,
    "figure.titlesize": 11,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    # TrueType fonts, which journals accept.
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
})


# The least number of letters in a line of a title.
SHORTEST = 12
# The width of every figure, inches, or None for widths of their own.
WIDTH = None


def set_width(inches):
    """Makes every figure so wide, with fonts that suit it."""
    global WIDTH
    WIDTH = inches
    size = 8 if inches < 5.0 else 9 if inches < 8.0 else 10
    plt.rcParams.update({"font.size": size, "axes.titlesize": size, "figure.titlesize": size + 0.5})


def wide(inches):
    """The width of a figure that is by itself so wide."""
    return WIDTH or inches


def panels_of(extent):
    """A figure with two maps of a body of this extent, side by side if there is room, and their axes."""
    if extent[0] < 2.5 * extent[1] and wide(11.8) >= 6.5:
        width, height = map_size(extent, 0.5 * wide(11.8) - 0.9)
        return (2 * (width + 0.9), height + 0.5), (1, 2)
    width, height = map_size(extent, wide(8.9) - 0.9)
    return (width + 0.9, 2 * height + 0.5), (2, 1)


def canvas(size, figure=None):
    """An empty figure: a new one of `size`, inches; `figure`, cleared in its own size; or a part of the pages that
    `figure` stands for."""
    if figure is None:
        return plt.figure(figsize=size)
    if hasattr(figure, "panel"):
        return figure.panel(*size)
    figure.clear()
    return figure


def amplification(size, largest):
    """1, 2 or 5 times a power of ten with which `largest` appears as 4–10 % of `size`; 1 if it is visible anyway, above
    2 %."""
    wanted = 0.1 * size / largest if largest > 0.0 else 1.0
    if wanted < 5.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted))
    return power * max(m for m in (1, 2, 5) if m * power <= wanted * (1 + 1e-12))


def headline(results, text):
    """The title of a figure: the scene with its overrides, a note if the run ended early, and the quantity shown."""
    overrides = textwrap.shorten(f"with {results.overrides}", 100, placeholder=" …")
    overrides = overrides.replace("$", r"\$") if results.overrides else ""
    return "\n".join(filter(None, (results.title, overrides, results.ending, text)))


def wrap_titles(figure):
    """Breaks the lines of titles that are wider than their axes, first of the titles above all axes of a figure or
    subfigure: these make the axes smaller."""
    for of_axes in (False, True):
        figure.get_layout_engine().execute(figure)
        for part in figure.subfigs or [figure]:
            for axes in part.axes:
                axes.apply_aspect()
            boxes = [axes.get_window_extent() for axes in part.axes]
            if of_axes:
                for axes, box in zip(part.axes, boxes):
                    _wrap(axes.title, box.width)
            elif part._suptitle:
                _wrap(part._suptitle, max(box.x1 for box in boxes) - min(box.x0 for box in boxes))


def _wrap(title, room):
    """Breaks the lines of a title into parts that are about equally long, until it is not wider than `room`, pixels."""
    lines = title.get_text().split("\n")
    letters = max(map(len, lines))
    while (width := title.get_window_extent().width) > room and letters > SHORTEST:
        letters = min(letters - 1, int(letters * room / width) + 1)
        parts = [max(1, -(-len(line) // letters)) for line in lines]
        rooms = [min(letters, len(line) // part + 8) for line, part in zip(lines, parts)]
        title.set_text("\n".join(textwrap.fill(line, room, break_long_words=False) for line, room in zip(lines, rooms)))


def map_size(extent, across):
    """The size, inches, of a map with equal aspect that is `across` wide including ticks and labels."""
    least, most = (1.4, 1.2 * WIDTH) if WIDTH else (2.2, 8.0)
    return across, float(np.clip((across - 1.0) * extent[1] / extent[0] + 0.9, least, most))


def draw_outline(axes, points, results, **style):
    """Draws the boundary of the body as continuous curves, so that dashes continue from edge to edge. `points` are
    the positions of the nodes."""
    axes.add_collection(LineCollection(results.outline(points), capstyle="round", **style))


def draw_foundation(axes, results, factor=None):
    """The obstacle as a thick line, hatched on its far side.

    If displacements are amplified by `factor`, the distance from Γ_C is amplified, too. So the body touches the
    obstacle where the gap is closed, and does not cross it.
    """
    for line in results.foundation(factor):
        # The body is on the left of the line, so the strokes go to the right.
        strokes = withTickedStroke(spacing=6, angle=-135, length=1.0, linewidth=0.8, foreground=INK)
        axes.plot(*line.T, color=INK, linewidth=0.8, path_effects=[strokes], zorder=1.5)
        axes.plot(*line.T, color=INK, linewidth=1.8, zorder=1.6, solid_capstyle="butt")


def frame(axes, points, units):
    """Sets equal aspect around `points`, with margins and few ticks."""
    low, high = points.min(axis=0), points.max(axis=0)
    air = 0.05 * max(high - low)
    axes.set_xlim(low[0] - air, high[0] + air)
    axes.set_ylim(low[1] - air, high[1] + air)
    axes.set_aspect("equal")
    axes.xaxis.set_major_locator(MaxNLocator(5 if WIDTH else 6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.set_xlabel(f"x ({units['length']})")
    axes.set_ylabel(f"y ({units['length']})")


def draw_colourbar(axes, image, label, extend="neither", flat=False):
    """Draws a colour bar as high as the map. Beside a flat body there is no room for the label, which is below it."""
    bar = axes.figure.colorbar(image, cax=axes.inset_axes([1.03, 0.0, 0.035, 1.0]), extend=extend)
    bar.outline.set_linewidth(0.5)
    bar.formatter.set_useOffset(False)
    if flat:
        axes.annotate(label, (1.08, 0.0), (0.0, -2.4 * plt.rcParams["font.size"]), xycoords="axes fraction",
                      textcoords="offset points", ha="right", va="top", fontsize="small")
    else:
        bar.set_label(label)


def is_flat(results):
    """Whether the body is much wider than high."""
    width, height = np.ptp(results.nodes, axis=0)
    return height < 0.3 * width


def stress_unit(largest, units):
    """The factor and the unit for stresses up to `largest`: a multiple of pascal with numbers below about a thousand.
    Other units stay as they are."""
    if units["stress"] == "Pa":
        for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if largest >= 2 * factor:
                return factor, f"{prefix}Pa"
    return 1.0, units["stress"]


# What figures show of the damage: "zeta", "loss", or None to choose.
DAMAGE = None
# The column of history.csv over which forces are drawn, or None to choose.
ABSCISSA = None
# Whether maps have contour lines.
CONTOURS = False
# The smallest and the largest stress of the colours, Pa, or None to choose.
RANGE = None


def mesh_of(results, points):
    """The flat pieces of the shown elements, for these positions of the nodes."""
    hidden = np.repeat(~results.shown, results.pieces.cuts**2)
    return Triangulation(*results.pieces.at_points(points).T, results.pieces.triangles, hidden)


def draw_stress(axes, mesh, results, stress, name, top):
    """Colours the body by a stress from 0 to `top`, or in RANGE, with a colour bar. Returns the factor and the unit of
    the numbers, and the top."""
    low, top = RANGE or (0.0, top)
    factor, unit = stress_unit(top, results.units)
    image = draw_values(axes, mesh, results.pieces.at_points(stress) / factor, "viridis", low / factor,
                        top / factor or 1.0)
    extend = {(0, 1): "max", (1, 0): "min", (1, 1): "both"}.get((stress.min() < low, stress.max() > top), "neither")
    draw_colourbar(axes, image, f"{name} ({unit})", extend, is_flat(results))
    return factor, unit, top


def draw_values(axes, mesh, values, colours, low, high):
    """Colours a triangulation by values at its points, with contour lines if they are asked for. The axes keep their
    limits (matplotlib's tripcolor computes them from an object per triangle, which takes longer than the picture)."""
    image = TriMesh(mesh, cmap=colours, norm=Normalize(low, high), rasterized=True)
    image.set_array(values)
    axes.add_collection(image, autolim=False)
    if CONTOURS and high > low:
        axes.tricontour(mesh, values, levels=np.linspace(low, high, 9)[1:-1], colors="white", linewidths=0.6, zorder=2)
    return image


def damage_scale(least, largest):
    """How to show ζ between two values: the function that is drawn, its label, colour map and limits. As in all
    figures, dark colours are low values.

    If ζ is close to 1, the loss 1 − ζ is shown, in a power of ten, unless DAMAGE says otherwise. If ζ is uniform, the
    limits are moved apart, so that the colours do not show rounding errors.
    """
    low, high = 1.0 - largest, 1.0 - least
    uniform = high - low <= 1e-9 * high
    if 0.0 < high and DAMAGE != "zeta" and (high < 0.1 or DAMAGE == "loss"):
        unit = 10.0 ** np.floor(np.log10(high))
        label = rf"damage  $1 - \zeta$  ($\times 10^{{{np.log10(unit):.0f}}}$)"
        limits = (0.0, 10.0) if uniform else (low / unit, high / unit)
        return lambda zeta: (1.0 - zeta) / unit, label, "magma", limits
    limits = (0.0, 1.0) if uniform else (least, largest)
    return lambda zeta: zeta, r"damage field  $\zeta$", "magma", limits


def least_zeta(low):
    """ζ as text, with enough digits to show its distance from 1."""
    if low >= 1.0:
        return "1"
    return f"{low:.{max(3, 1 - int(np.floor(np.log10(1.0 - low))))}f}"


def along(points, units):
    """A coordinate along a path: x or y if the path follows this axis, otherwise arc length."""
    unit = units["length"]
    for k, (name, other) in enumerate(("xy", "yx")):
        if np.ptp(points[:, 1 - k]) <= 1e-9 * np.ptp(points[:, k]):
            return points[:, k], f"{name} ({unit}) along {other} = {points[0, 1 - k]:g}"
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps))), f"arclength along $\\Gamma_C$ ({unit})"
