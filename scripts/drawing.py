"""Common parts of the pictures: style, places of axes in inches, maps with equal aspect, readable scales."""

import os
import resource
import sys
import textwrap
import warnings
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Callable

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
from matplotlib.font_manager import FontProperties
from matplotlib.patheffects import withTickedStroke
from matplotlib.textpath import text_to_path
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from bars import placed
from signorini_results import SLENDER

if LIMIT != resource.RLIM_INFINITY:
    # OpenBLAS keeps the buffer that it allocates here, before the results take the memory.
    np.ones((64, 64)) @ np.ones((64, 64))

INK, FAINT, BLUE, RED, GREEN = "#22262b", "#9aa3ad", "#2f6db3", "#c0392b", "#3d8f5a"

# The font may lack letters of a name.
warnings.filterwarnings("ignore", "Glyph")
plt.rcParams.update({
    "figure.dpi": 160,
    "font.size": 10,
    "axes.titlesize": "medium",
    "axes.edgecolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "axes.formatter.limits": (-3, 5),
    # Names and units may have dollar signs.
    "text.parse_math": False,
    # TrueType fonts, which journals accept.
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
})

# What the command line asks of pictures: their width, inches, or None for widths of their own; the size of letters,
# points, or None for one that suits the width; the largest height of maps and panels, inches; whether they have titles, and in
# these the name of the run; whether maps have axes; whether maps have contour lines; the column of history.csv over which forces are drawn, and
# the smallest and the largest stress of the colours, Pa, or None to choose; the corners of the part that maps show, (2, 2), m.
OPTIONS = SimpleNamespace(width=None, size=None, height=7.0, titles=True, head=True, axes=True, contours=False, abscissa=None,
                          range=None, zoom=None)
# Coordinates that are so many times farther from 0 than from each other count from a near origin.
DISTANT = 1e3
# Maps of slender bodies are stretched across, to about this ratio of the sides.
STRETCHED = 15.0
# The height of a line of text, and the places around the axes of maps and of plots for ticks and labels (left, right,
# top, bottom), in the size of letters. They fit numbers of six digits.
LINE = 1.35
AROUND_MAPS = 5.6, 1.8, 1.0, 3.6
AROUND_PLOTS = 7.0, 1.8, 1.4, 3.8
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# The least width of pictures that have a width of their own, inches.
NARROWEST = 6.4
# The least height of maps over a legend, in the size of letters.
LEAST_MAPS = 18.0
# The place to the right of a map for a colour bar, in the size of letters.
BAR = 6.4


def use(**options):
    """Sets options."""
    vars(OPTIONS).update(options)
    width = OPTIONS.width or np.inf
    plt.rcParams["font.size"] = OPTIONS.size or (8 if width < 5.0 else 9 if width < 8.0 else 10)


def wide(inches):
    """The width of a picture that is by itself so wide."""
    return OPTIONS.width or inches


def em():
    """The size of letters, inches."""
    return plt.rcParams["font.size"] / 72


def colours(count):
    """Colours of curves that are all different."""
    return [f"C{k}" for k in range(count)] if count <= 10 else [plt.cm.viridis(k / count) for k in range(count)]


@lru_cache(maxsize=4096)
def width_of(text, size=None):
    """The width of a text of this size, points, in inches."""
    size = size or plt.rcParams["font.size"]
    return text_to_path.get_text_width_height_descent(text, FontProperties(size=size), False)[0] / 72


def wrapped(text, width, size=None):
    """The lines of a text that are not wider than `width`, inches, except for single words."""
    lines = []
    for paragraph in text.splitlines():
        lines.append("")
        for word in paragraph.split():
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and width_of(longer, size) > width:
                lines.append(word)
            else:
                lines[-1] = longer
    return lines


def canvas(columns, rows, caption="", titles=(), below=0.0, figure=None):
    """A picture with a caption and axes in columns and rows, and the axes in the order of reading.

    The columns are (left, width, right), the rows (top, height, bottom), in inches: places for labels around the boxes
    of the axes. Titles stand above the axes. `below` is a place for a legend. The picture is a new figure; `figure`,
    cleared; or a part of the pages that `figure` stands for.
    """
    width = max(sum(map(sum, columns)), wide(NARROWEST))
    inset = 0.5 * (width - sum(map(sum, columns)))
    caption = wrapped(caption, width - 1.2 * em()) if OPTIONS.titles else []
    line, count = LINE * em(), len(columns)
    rooms = [sum(column) for column in columns] if count > 1 else [width - inset - columns[0][0]]
    titles = [wrapped(title, rooms[k % count] - em()) for k, title in enumerate(titles)]
    above = [line * max(map(len, titles[k * count:(k + 1) * count]), default=0) for k in range(len(rows))]
    top = line * (len(caption) + 0.4 * bool(caption))
    height = top + sum(above) + sum(map(sum, rows)) + below
    page, x, y = figure, 0.0, 0.0
    if figure is None:
        page = plt.figure(figsize=(width, height))
    elif hasattr(figure, "place"):
        page, x, y = figure.place(width, height)
    else:
        page.clear()
    across, upright = page.get_size_inches()
    page.text((x + 0.6 * em()) / across, 1.0 - (y + 0.3 * em()) / upright, "\n".join(caption), va="top",
              parse_math=False, linespacing=1.15)
    y, axes = y + top, []
    for (over, high, under), title_room in zip(rows, above):
        y, at = y + title_room + over, x + inset
        for left, box, right in columns:
            axes.append(page.add_axes(((at + left) / across, 1.0 - (y + high) / upright, box / across,
                                       high / upright)))
            at += left + box + right
        y += high + under
    for k, (of, title) in enumerate(zip(axes, titles)):
        left, box, _ = columns[k % count]
        # With a given y, matplotlib does not measure everything above the axes.
        of.set_title("\n".join(title), loc="left", x=(0.6 * em() - left) / box if count > 1 else 0.0, y=1.0,
                     pad=9.0, parse_math=False, linespacing=1.15)
    return page, axes


def plot(caption="", figure=None, height=0.6, below=0.0):
    """A picture with one plot, `height` times as high as wide."""
    left, right, top, bottom = (em() * of for of in AROUND_PLOTS)
    width = wide(NARROWEST)
    rows = [(top, max(height * width, min(0.75 * width, 2.8)) - top - bottom, bottom)]
    figure, (axes,) = canvas([(left, width - left - right, right)], rows, caption, below=below, figure=figure)
    return figure, axes


@dataclass
class Map:
    """A map of the body: its title, the corners of its box, (2, 2), a function that draws it into axes, whether it
    has a colour bar, and whether it is a field, which may be zoomed and stretched."""

    title: str
    box: np.ndarray
    paint: Callable
    has_bar: bool = True
    is_field: bool = True


def draw_maps(maps, caption, units, figure=None, below=0.0):
    """A picture of maps with one scale, in that number of columns in which they are largest."""
    left, right, top, bottom = (em() * of for of in (AROUND_MAPS if OPTIONS.axes else (0.6, 0.6, 0.6, 1.0)))
    right = BAR * em() if any(of.has_bar for of in maps) else right
    is_field = all(of.is_field for of in maps)
    boxes = [_with_margin(of.box) if OPTIONS.zoom is None or not is_field else np.array(OPTIONS.zoom) for of in maps]
    stretch = _stretch(np.max([np.ptp(of.box if OPTIONS.zoom is None else box, axis=0) for of, box in zip(maps, boxes)], axis=0))
    if is_field and max(stretch) > 1.0:
        boxes = [_with_margin(of.box, stretch) if OPTIONS.zoom is None else box for of, box in zip(maps, boxes)]
        caption += "".join(f"; {name} × {scale:g}: stretched" for name, scale in zip("xy", stretch) if scale > 1.0)
    else:
        stretch = np.ones(2)
    extent = stretch * np.max([np.ptp(box, axis=0) for box in boxes], axis=0)
    most = wide(7.2 if len(maps) == 1 else 11.0)

    def scale(columns):
        rows, across = -(-len(maps) // columns), most / columns
        lines = max(len(wrapped(of.title, across - em())) for of in maps)
        room = across - left - right, _highest(below) / rows - top - lines * LINE * em() - bottom
        return (np.array(room) / extent).min()

    count = max(range(1, len(maps) + 1), key=scale)
    width, height = np.maximum(scale(count), 0.0) * extent
    rows = -(-len(maps) // count)
    # Where there is room, narrow maps stand apart, so that their titles are in one line.
    own, widest = left + width + right, max(width_of(of.title) for of in maps) + em()
    right += np.clip(widest, own, max(own, most / count)) - own
    figure, axes = canvas([(left, width, right)] * count, [(top, height, bottom)] * rows, caption,
                          [of.title for of in maps], below, figure)
    for of, box, one in zip(maps, boxes, axes):
        of.paint(one)
        frame(one, box, units, stretch)
    for one in axes[len(maps):]:
        one.remove()
    return figure


def _highest(below):
    """The largest height of maps over a legend, which does not take all of it."""
    return max(OPTIONS.height - below, LEAST_MAPS * em())


def inch_of(box, below=0.0):
    """The length of an inch of a picture with one map of this box, without a colour bar and a title, m."""
    left, right, top, bottom = (em() * of for of in AROUND_MAPS)
    room = wide(7.2) - left - right, _highest(below) - top - bottom
    return (np.ptp(_with_margin(box), axis=0) / room).max()


def _with_margin(box, stretch=1.0):
    air = 0.05 * (stretch * np.ptp(box, axis=0)).max() / stretch
    return np.array([box[0] - air, box[1] + air])


def _stretch(extent):
    """The factors of x and y that make a slender box visible: 1, or about 1, 2 or 5 times a power of ten."""
    if extent.max() <= SLENDER * extent.min() or extent.min() <= 0.0:
        return np.ones(2)
    ratio = extent.max() / (STRETCHED * extent.min())
    power = 10.0 ** np.floor(np.log10(ratio))
    return np.where(extent < extent.max(), power * max(m for m in (1, 2, 5) if m * power <= ratio * (1 + 1e-12)), 1.0)


def frame(axes, box, units, stretch=(1.0, 1.0)):
    """Sets equal aspect around a box that is stretched so, with few ticks."""
    axes.set_xlim(box[:, 0])
    axes.set_ylim(box[:, 1])
    axes.set_aspect(stretch[1] / stretch[0], anchor="NW")
    if not OPTIONS.axes:
        axes.axis("off")
    for axis, name, ends, room, ticks in zip((axes.xaxis, axes.yaxis), "xy", box.T, _size_of(axes), (5.0, 2.5)):
        axis.set_major_locator(MaxNLocator(int(np.clip(room / (ticks * em()), 1, 6)), steps=[1, 2, 5, 10]))
        origin, power, less = coordinate(ends)
        axis.set_label_text(f"{name}{less}{times_power(power, units['length'])}")
        if origin or power:
            axis.get_major_formatter().set_useOffset(origin)
            axis.get_major_formatter().set_powerlimits((power, power))
            axis.offsetText.set_visible(False)


def coordinate(ends):
    """How an axis between two values has ticks: a round number from which they count, which is 0 unless the values are far from 0,
    and their power of ten, which is 0 unless they are very large or small; and the first one in the label, ` − 1000000`."""
    span = np.ptp(ends)
    unit = 10.0 ** np.ceil(np.log10(span)) if np.abs(ends).max() >= DISTANT * span > 0.0 else 0.0
    origin = unit and unit * round(ends[0] / unit)
    largest = np.abs(np.subtract(ends, origin)).max()
    power = 0 if 1e-3 <= largest < 1e5 else power_of(largest)
    return origin, power, f" {'+−'[int(origin > 0.0)]} {abs(origin):.12g}" if origin else ""


def _size_of(axes):
    """The width and the height of axes, inches."""
    return axes.get_position().size * axes.figure.get_size_inches()


def headline(results, text):
    """The caption of a picture: what it shows; above it the run, with its overrides, and how it ended if it ended early.
    In a report these are elsewhere."""
    if not OPTIONS.head:
        return text
    run = f"{results.title}, with {results.overrides}" if results.overrides else results.title
    # Two lines of about 90 letters.
    run = textwrap.shorten(run, 180, placeholder=" …")
    return "\n".join(filter(None, (run, results.ending, text)))


def draw_outline(axes, points, results, **style):
    """Draws the boundary of the body as continuous curves, so that dashes continue from edge to edge. `points` are
    the positions of the nodes."""
    axes.add_collection(LineCollection(results.outline(points), capstyle="round", **style))


class Strokes(withTickedStroke):
    """Strokes along a line; none along a line that is shorter than their distance, for which matplotlib fails."""

    def draw_path(self, renderer, gc, path, affine, face=None):
        points = affine.transform(path.vertices)
        if np.linalg.norm(np.diff(points, axis=0), axis=1).sum() > renderer.points_to_pixels(self._spacing):
            super().draw_path(renderer, gc, path, affine, face)


def draw_foundation(axes, results, factor=1.0):
    """The obstacle as a thick line, hatched on its far side, for displacements amplified by `factor`."""
    for line in results.foundation(factor):
        # The body is on the left of the line, so the strokes go to the right.
        strokes = Strokes(spacing=6, angle=-135, length=1.0, linewidth=0.8, foreground=INK)
        axes.plot(*line.T, color=INK, linewidth=0.8, path_effects=[strokes], zorder=1.5)
        axes.plot(*line.T, color=INK, linewidth=1.8, zorder=1.6, solid_capstyle="butt")


def draw_body(axes, results, factor):
    """The outline and the foundation, displaced by `factor`; for 0 both are where they are without displacements."""
    draw_outline(axes, results.places(factor), results, color=INK, linewidth=0.7)
    draw_foundation(axes, results, factor or 1.0)


def draw_colourbar(axes, image, extend="neither"):
    """Draws a colour bar as high as the map; returns it."""
    width, height = _size_of(axes)
    place = axes.inset_axes([1.0 + 0.8 * em() / width, 0.0, em() / width, 1.0])
    ticks = MaxNLocator(int(np.clip(height / (2.5 * em()), 1, 6)), steps=[1, 2, 5, 10])
    bar = axes.figure.colorbar(image, cax=place, extend=extend, ticks=ticks)
    bar.outline.set_linewidth(0.5)
    bar.formatter.set_useOffset(False)
    return bar


def stress_unit(largest, units):
    """The factor and the unit for stresses up to `largest`: a multiple of pascal with numbers below about a thousand.
    Other units stay as they are."""
    if units["stress"] == "Pa":
        for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if largest >= 2 * factor:
                return factor, f"{prefix}Pa"
    return 1.0, units["stress"]


def mesh_of(results, points):
    """The flat pieces of the shown elements, for these positions of the nodes, material by material: a triangle covers
    half a pixel of those before it, so that others would leave specks along interfaces."""
    hidden, triangles = np.repeat(~results.shown, results.pieces.cuts**2), results.pieces.triangles
    if results.materials is not None:
        order = np.repeat(results.materials, results.pieces.cuts**2).argsort(kind="stable")
        hidden, triangles = hidden[order], triangles[order]
    return Triangulation(*results.pieces.at_points(points).T, triangles, hidden)


def stress_colours(results, top):
    """The smallest and the largest stress of the colours, and the factor and the unit of their numbers."""
    low, top = OPTIONS.range or (0.0, top)
    return low, top, *stress_unit(top, results.units)


def draw_stress(axes, mesh, results, stress, top):
    """Colours the body by a stress from 0 to `top`, or in the range asked for, with a colour bar."""
    low, top, factor, _ = stress_colours(results, top)
    image = draw_values(axes, mesh, results.pieces.at_points(stress) / factor, "viridis", low / factor,
                        top / factor or 1.0)
    extend = {(0, 1): "max", (1, 0): "min", (1, 1): "both"}.get((stress.min() < low, stress.max() > top), "neither")
    draw_colourbar(axes, image, extend)


def draw_values(axes, mesh, values, colours, low, high):
    """Colours a triangulation by values at its points, with contour lines if they are asked for. The axes keep their
    limits (matplotlib's tripcolor computes them from an object per triangle, which takes longer than the picture)."""
    image = TriMesh(mesh, cmap=colours, norm=Normalize(low, high), rasterized=True)
    image.set_array(values)
    axes.add_collection(image, autolim=False)
    if OPTIONS.contours and high > low:
        axes.tricontour(mesh, values, levels=np.linspace(low, high, 9)[1:-1], colors="white", linewidths=0.6, zorder=2)
    return image


def room_for_legend(labels, always=False):
    """The height of a legend below a plot, inches; 0 for a legend inside it."""
    if not labels or not always and len(labels) <= 4 and max(map(width_of, labels)) < 0.3 * wide(NARROWEST):
        return 0.0
    columns, lines = legend_columns(labels, wide(NARROWEST)), [label.count("\n") + 1 for label in labels]
    return 1.4 * em() * (sum(max(lines[k:k + columns]) for k in range(0, len(lines), columns)) + 0.5)


def legend_columns(labels, width):
    """The number of columns of a legend, inches wide."""
    widest = max(width_of(line) for label in labels for line in label.split("\n"))
    return max(1, min(len(labels), int(width / (widest + 3 * em()))))


def legend(axes, below, lower=0.0, **style):
    """A legend inside axes, or in the place `below` them, and below further `lower` lines of ticks, inches."""
    if not below:
        axes.legend(loc="best", **style)
        return
    size, left = _size_of(axes), (0.6 - AROUND_MAPS[0]) * em()
    columns = legend_columns(axes.get_legend_handles_labels()[1], wide(NARROWEST))
    axes.legend(loc="upper left", bbox_to_anchor=(left / size[0], -(3.8 * em() + lower) / size[1]), ncols=columns,
                borderaxespad=0.0, borderpad=0.0, fontsize="small", labelspacing=0.3, handletextpad=0.8,
                columnspacing=1.0, **{"handlelength": 1.6, **style})


def few_ticks(axes):
    """Lets an axis x have about five ticks, and fewer in a narrow plot."""
    axes.locator_params("x", nbins=int(np.clip(_size_of(axes)[0] / (4.0 * em()), 1, 5)))


def drawn_ticks(axis, ticks):
    """Sets ticks of a logarithmic axis. A label that would touch the one before is left out."""
    is_x, low_high = axis.axis_name == "x", np.log(axis.get_view_interval())
    room = _size_of(axis.axes)[0 if is_x else 1] / np.ptp(low_high)
    labels, end = [], -np.inf
    for tick in ticks:
        text, middle = f"{tick:g}", room * np.log(tick)
        half = 0.5 * (width_of(text) + 0.6 * em() if is_x else LINE * em())
        labels.append(text if middle - half >= end else "")
        end = middle + half if labels[-1] else end
    axis.set_ticks([], minor=True)
    axis.set_ticks(ticks, labels)


def power_of(largest):
    """The power of ten in which values up to `largest` are written: 0 for values between 0.1 and 1e5."""
    return 0 if 0.1 <= largest < 1e5 or not largest > 0.0 else int(np.floor(np.log10(largest)))


def times_power(power, unit=""):
    """A unit with a power of ten: ` (10⁻³ m)`; "" for 1."""
    text = " ".join(filter(None, (f"10{str(power).translate(SUPERSCRIPTS)}" if power else "", unit)))
    return f" ({text})" if text else ""


def least_zeta(low):
    """ζ as text, with enough digits to show its distance from 1."""
    if low >= 1.0:
        return "1"
    return f"{low:.{max(3, 1 - int(np.floor(np.log10(1.0 - low))))}f}"


def along(points, units):
    """A coordinate along a path: x or y if the path follows this axis, otherwise arc length between its named ends."""
    unit, size = units["length"], np.ptp(points, axis=0).max()
    for k, (name, other) in enumerate(("xy", "yx")):
        if np.ptp(points[:, 1 - k]) <= 1e-9 * np.ptp(points[:, k]):
            origin, power, less = coordinate(np.sort(points[[0, -1], k]))
            return ((points[:, k] - origin) / 10.0**power,
                    f"{name}{less}{times_power(power, unit)} along {other} = {placed(points[:1, 1 - k], size)}")
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _, power, _ = coordinate((0.0, steps.sum()))
    first, last = (placed(of, size) for of in points[[0, -1]])
    way = f"once round from {first}" if first == last else f"{first} → {last}"
    return np.concatenate(([0.0], np.cumsum(steps))) / 10.0**power, f"arclength{times_power(power, unit)}, {way}"
