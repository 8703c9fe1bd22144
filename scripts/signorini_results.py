"""Runs scenes and reads their results. It needs numpy and meshio; matplotlib to find points and for pictures, pandas for
tables, scipy for matrices.

    from signorini_results import load, run, table
    result = load("out/lshape")                  # or run("geo/lshape.toml", "--bars", mesh={"size": 0.5})
    result                                       # its figures; in a notebook with a picture
    result.figures["work"]["value"], result.times, result.history["contact_force"]
    result.plot("damage", time=0.5), result.plot.pressure()
    result.animate("damage", "damage.gif")       # or .mp4, by ffmpeg
    result.matrices().K                          # and M, L, f, A, a, B, g, u, zeta, …: see `signorini export`
    frame = result.frame(0.5)                    # the frame nearest to t = 0.5; without a time the last one
    frame.field("zeta"), frame.field("stress_yy"), frame.at((3, 5), "strain_xx"), frame.gradient((3, 5), "zeta")
    along, zeta = frame.line((0, 5), (8, 5), "zeta")
    along, pressure = frame.along("foundation", "normal_pressure")
    table(["out/lshape", "out/beam"], ["work", "clamp.force_y"])
    table("out/lshape-study", ["work"]).plot(x="material.young", y="work", yerr="work.bar", marker="o")   # with --bars
"""

import base64
import csv
import html
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from contextlib import contextmanager, nullcontext
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np

from signorini_files import whole
from signorini_summaries import columns_of, folders_of, read_summary, rows_of, summary_of, unknown

# Names of components: the array of a frame, and the column in it.
COMPONENTS = {
    "u_x": ("displacement", 0), "u_y": ("displacement", 1),
    "stress_xx": ("stress", 0), "stress_yy": ("stress", 1), "stress_xy": ("stress", 2), "stress_zz": ("stress", 3),
    "stress_1": ("principal_stress", 0), "stress_2": ("principal_stress", 1),
}
# Names of strains, ½(∂u_i/∂x_j + ∂u_j/∂x_i), and the indices i, j.
STRAINS = {"strain_xx": (0, 0), "strain_yy": (1, 1), "strain_xy": (0, 1)}
# The end of a frame for gmsh.
WRITTEN = b"$Comments\nA frame of signorini.\n$EndComments\n"
# The colours of a picture leave out a peak: values on this part of the area, if the largest one is so many times the others.
PEAK_PART, PEAK = 0.005, 4.0
# Bodies whose sides have a larger ratio are not drawn to scale.
SLENDER = 30.0
# A point is in a triangle if its barycentric coordinates are not smaller.
OUTSIDE = -1e-9
# The largest number of pairs of points and triangles that are tried at once.
AT_ONCE = 4_000_000


def load(folder):
    """The results in a folder."""
    return Run(folder)


def run(scene, *options, out=None, **overrides):
    """Runs a scene into `out` (default: out/SCENE) and returns its results; a RuntimeError if the run fails.

    The scene is a path, an open file, or a dict with the tables of a scene; files that it names are beside it, those of a
    dict in the current folder. `options` are those of `signorini run`. Overrides are keys of the scene: `material={"young": 2e5}`, or with points
    `**{"material.young": 2e5}`. The program is the variable SIGNORINI; without it, `signorini` in the virtual environment of
    this Python, in the path, or in the clone of this module. A notebook shows the progress if tqdm is there.
    """
    sets = [word for key, value in _keys(overrides) for word in ("--set", f"{key}={value}")]
    with _written(scene) as (path, name):
        out = Path(out or Path("out") / name)
        try:
            _call("run", str(path), "--out", str(out), *sets, *map(str, options))
        except RuntimeError as error:
            if not isinstance(scene, dict):
                raise
            raise RuntimeError(str(error).replace(str(path), "the scene")) from None
    return load(out)


def _call(*arguments):
    """Calls the program."""
    clone = Path(__file__).resolve().parents[1]
    own = [str(Path(sys.executable).with_name("signorini"))] * (sys.prefix != sys.base_prefix)
    usual = [*own, "signorini", str(clone / "target/release/signorini")]
    places = [os.environ["SIGNORINI"]] if "SIGNORINI" in os.environ else usual
    program = next(filter(None, map(shutil.which, places)), None)
    if program is None:
        raise RuntimeError("the program signorini was not found; put it into PATH, or set SIGNORINI to its path")
    said = []
    with _progress() as bar, subprocess.Popen([program, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                              text=True, encoding="utf-8", errors="replace") as process:
        try:
            for line in process.stderr:
                part = re.match(r" *(\d+) % after ", line)
                if part is None:
                    said.append(line)
                elif bar is not None:
                    bar.update(int(part[1]) - bar.n)
        except BaseException:
            process.terminate()
            raise
        if process.wait():
            raise RuntimeError("".join(said).strip().removeprefix("error: "))
        if bar is not None:
            bar.update(100 - bar.n)


def _progress():
    """A bar from 0 to 100 in a notebook with tqdm, otherwise None."""
    try:
        if "ipykernel" in sys.modules:
            from tqdm import tqdm

            return tqdm(total=100, unit="%", leave=False, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
    except ImportError:
        pass
    return nullcontext()


@contextmanager
def _written(scene):
    """The path of the file of a scene, which is written for a dict, and the name of the scene."""
    if not isinstance(scene, dict):
        path = Path(scene.name if hasattr(scene, "read") else scene)
        yield path, path.stem
        return
    with tempfile.NamedTemporaryFile("w", dir=".", prefix=".scene-", suffix=".toml", encoding="utf-8") as file:
        tables = {"title": "scene", **scene}.items()
        file.writelines(f"{key} = {_toml(value)}\n" for key, value in tables if value is not None)
        file.flush()
        yield Path(file.name), "scene"


def _toml(value):
    """A value in TOML. Strings, numbers and lists of them in JSON are the same there. Keys that are None are left out."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(of)}" for key, of in value.items() if of is not None) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False, default=lambda of: str(of) if isinstance(of, Path) else of.tolist())


def _keys(overrides, prefix=""):
    """(key with points, value in TOML) of nested tables."""
    for key, value in overrides.items():
        if isinstance(value, dict):
            yield from _keys(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", _toml(value)


def table(folders, columns=None):
    """A pandas frame with a row per folder (or its Run), or per run of a folder of a study: the settings in which the runs differ, and columns of summary.json with
    their bars, as `signorini table` prints them. Its `attrs["units"]` are the units by column."""
    try:
        import pandas
    except ImportError:
        raise ImportError("table() needs pandas (Debian: apt install python3-pandas); `signorini table` prints the same") from None

    folders = [folders] if isinstance(folders, (str, Path)) else folders
    folders = folders_of([getattr(folder, "folder", folder) for folder in folders])
    summaries = [summary_of(folder) for folder in folders]
    if problems := list(unknown(columns or [], summaries)):
        raise ValueError("; ".join(problems))
    rows, units = rows_of(folders, summaries, columns or columns_of(summaries))
    frame = pandas.DataFrame(rows)
    for name in frame:
        try:
            frame[name] = pandas.to_numeric(frame[name])
        except (TypeError, ValueError):
            pass
    frame.attrs["units"] = units
    return frame


class Run:
    """A folder of results."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.summary = read_summary(self.folder / "summary.json")

    @property
    def figures(self):
        """Name of a figure → its label, unit, value in the last state, error bar, place, and governing value in the run."""
        return self.summary["figures"]

    @property
    def plot(self):
        """Pictures: `plot("damage", time=0.5)`, `plot.pressure()`."""
        return Plot(self)

    def animate(self, name, path, factor=0.0, rate=6, **style):
        """Writes an animation of a field, see `plot`, over at most 50 frames with the same colours: `rate` of them per second. The
        ending of `path` says how: gif, or mp4 by ffmpeg. Another file is not replaced. Returns the path."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        from signorini_movies import FRAMES, check_movie, is_movie, movie

        path = Path(path)
        check_movie(path.suffix[1:])
        times = [self.times[k] for k in np.unique(np.linspace(0, len(self.times) - 1, FRAMES).round().astype(int))]
        frames = [self.frame(time) for time in times]
        values = [_values(frame, name) for frame in frames]
        tops = [_top(frame, of) for frame, of in zip(frames, values)]
        corners = np.array([_ends(frame.points + factor * frame.field("displacement")[:, :2]) for frame in frames])
        low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
        air = 0.03 * (high - low).max()
        style = {"vmin": 0.0 if name == "damage" else min(map(np.min, values)), "vmax": max(tops), **style}
        figure = Figure(figsize=(6, 4), layout="compressed")
        FigureCanvasAgg(figure)
        with movie(figure, path, is_movie, rate) as grab:
            for frame in frames:
                figure.clear()
                axes = self.plot(name, frame.time, figure.subplots(), factor, **style)
                axes.set(xlim=(low[0] - air, high[0] + air), ylim=(low[1] - air, high[1] + air))
                grab()
        return path

    @property
    def ended(self):
        """How the run ended."""
        of, time = self.summary, self.summary["units"]["time"]
        if of.get("error"):
            return f"failed: {of['error']}"
        if of["stopped_by"]:
            return f"stopped by {of['stopped_by']} at t = {of['stopped_at']:.6g} {time}"
        steps = f"finished at t = {of['end_time']:g} {time} after {of['steps']} steps"
        return steps if of["steps"] else "a static solve"

    def __repr__(self):
        """The figures of the body and of contact in the last state."""
        lines = [f"{self.folder}: {self.summary['title']}, {self.ended}"]
        for name, of in self.figures.items():
            if "." not in name and of["value"] is not None:
                value, bar = of["value"], of["bar"]
                reason = ": singular" if of["singular"] else ": not resolved" if of["unresolved"] else ""
                has_bar = bar and bar > 1e-9 * abs(value)
                # As many digits as the bar leaves.
                power = lambda size: int(np.floor(np.log10(size)))
                digits = 2 if reason else max(1, 1 + power(abs(value)) - power(bar)) if has_bar and value else 7
                text = f"{value:.{digits}g}" + (f" ± {bar:.1g}" if has_bar else "")
                lines.append(f"  {of['label']:<36} {text} {of['unit']}{reason}".rstrip())
        return "\n".join([*lines, *(f"  note: {note}" for note in self.summary["notes"])])

    def _repr_html_(self):
        """The figures and a picture of the damage, or of the stress if there is no damage."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        picture, figure = io.BytesIO(), Figure(figsize=(6, 4), layout="compressed")
        is_damaged = self.figures["zeta_min"]["value"] < 1.0
        self.plot("damage" if is_damaged else "von_mises", axes=figure.subplots())
        FigureCanvasAgg(figure).print_png(picture)
        source = base64.b64encode(picture.getvalue()).decode()
        return f'<pre>{html.escape(repr(self))}</pre><img src="data:image/png;base64,{source}">'

    def matrices(self, time=None):
        """The matrices and vectors of the last step, or of the first one that reaches `time`, by name: K, M, L, f, A, a, B,
        g, u, zeta, zeta_before, b; nodes and triangles; `about`, their meanings. `signorini export` runs the scene again."""
        try:
            from scipy.io import mmread
        except ImportError:
            raise ImportError("matrices() needs scipy (Debian: apt install python3-scipy)") from None

        with tempfile.TemporaryDirectory() as folder:
            until = () if time is None else ("--time", str(time))
            _call("export", str(self.folder / "scene.toml"), "--out", folder, *until)
            about = json.loads((Path(folder) / "export.json").read_text(encoding="utf-8"))
            found = {"about": about, "u_D": np.zeros(0), "g": np.zeros(0)}
            for name in about["files"]:
                file, stem = Path(folder) / name, Path(name).stem
                if file.suffix == ".csv":
                    found[stem] = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
                else:
                    read = mmread(file)
                    found[stem] = read.ravel() if isinstance(read, np.ndarray) else read.tocsr()
        return SimpleNamespace(**found)

    @cached_property
    def history(self):
        """history.csv as a pandas frame; without pandas `columns`."""
        try:
            import pandas
        except ImportError:
            return self.columns
        return pandas.DataFrame(self.columns)

    @cached_property
    def columns(self):
        """Column of history.csv → array; a missing number is NaN."""
        with open(self.folder / "history.csv", newline="", encoding="utf-8") as file:
            names, *rows = csv.reader(file)
        values = np.array([[float(text or "nan") for text in row] for row in rows])
        return dict(zip(names, values.reshape(-1, len(names)).T))

    @cached_property
    def frames(self):
        """(time, file) of each frame, in the order of time."""
        return frames_of(self.folder)

    @property
    def times(self):
        """The times of the frames, s."""
        return [time for time, _ in self.frames]

    def parts(self, boundary):
        """The connected parts of a boundary of the scene as polylines, (n, 2) each: with increasing x, or y if they are
        higher than wide; a closed part begins at any point."""
        try:
            edges = self.summary["boundaries"][boundary]
        except KeyError:
            known = ", ".join(self.summary["boundaries"])
            raise ValueError(f"there is no boundary {boundary}; there are {known}") from None
        parts = [np.array(path) for path in paths([tuple(map(tuple, edge)) for edge in edges])]
        way = np.ptp(np.vstack(parts), axis=0).argmax()
        turned = [part[::-1] if tuple(part[-1, [way, 1 - way]]) < tuple(part[0, [way, 1 - way]]) else part
                  for part in parts]
        return sorted(turned, key=lambda part: tuple(part[0, [way, 1 - way]]))

    def frame(self, time=None):
        """The frame nearest to a time, or the last one."""
        at = min(self.frames, key=lambda of: abs(of[0] - time)) if time is not None else self.frames[-1]
        return Frame(self, *at)


class Plot:
    """Pictures of a run by matplotlib: each call returns its axes."""

    def __init__(self, run):
        self.run, self.units = run, run.summary["units"]

    def __call__(self, name="damage", time=None, axes=None, factor=0.0, **style):
        """A field at a time (default: the last frame): damage, that is 1 − ζ, or a name of `Frame.field`; on the body
        with `factor` times its displacements. `style` is for `Axes.tripcolor`."""
        import matplotlib.pyplot as pyplot

        frame, axes = self.run.frame(time), axes or pyplot.figure(layout="compressed").subplots()
        values = _values(frame, name)
        unit = "length" if name in ("u_x", "u_y", "gap") else "" if name in ("damage", "zeta") else "stress"
        corners, points = frame.elements[:, :3], frame.points + factor * frame.field("displacement")[:, :2]
        style = {"shading": "gouraud", "cmap": "magma" if name == "damage" else "viridis", "vmax": _top(frame, values), **style}
        label = "damage 1 − ζ" if name == "damage" else f"{name} ({self.units[unit]})" if unit else name
        axes.figure.colorbar(axes.tripcolor(*points.T, corners, values, **style), ax=axes, label=label,
                             extend="max" if values.max() > style["vmax"] else "neither")
        extent = np.ptp(frame.points, axis=0)
        is_slender = extent.max() > SLENDER * extent.min()
        axes.set(aspect="auto" if is_slender else "equal", xlabel=f"x ({self.units['length']})", ylabel=f"y ({self.units['length']})",
                 title=f"t = {frame.time:g} {self.units['time']}" + f", displacements × {factor:g}" * bool(factor)
                 + ", not to scale" * is_slender)
        return _plain(axes)

    def pressure(self, time=None, axes=None):
        """The contact pressure along each foundation."""
        import matplotlib.pyplot as pyplot

        names = [name.removesuffix(".contact_length") for name in self.run.figures if name.endswith(".contact_length")]
        if not names:
            raise ValueError("there is no foundation: no boundary of the scene has a gap")
        frame, axes = self.run.frame(time), axes or pyplot.figure(layout="compressed").subplots()
        for name in names:
            axes.plot(*frame.along(name, "normal_pressure"), label=name)
        axes.set(xlabel=f"along the foundation ({self.units['length']})", ylabel=f"pressure ({self.units['stress']})",
                 title=f"t = {frame.time:g} {self.units['time']}")
        axes.legend()
        return _plain(axes)


def _values(frame, name):
    """The damage, that is 1 − ζ, or a field of a frame."""
    return 1.0 - frame.field("zeta") if name == "damage" else frame.field(name)


def _top(frame, values):
    """The top of the colours: the largest value. A peak on a small area must not darken the rest: then the value that 0.5 % of the
    area exceeds."""
    corners = frame.elements[:, :3]
    a, b, c = (frame.points[corners[:, k]] for k in range(3))
    means, areas = values[corners].mean(axis=1), _cross(b - a, c - a)
    order = means.argsort()
    top = means[order[np.searchsorted(areas[order].cumsum(), (1.0 - PEAK_PART) * areas.sum())]]
    return top if values.max() > PEAK * top > 0.0 else values.max()


def _ends(points):
    """The lower left and the upper right corner of a box around points."""
    return points.min(axis=0), points.max(axis=0)


def _plain(axes):
    """Axes whose texts, which contain names and units, are no mathematics; those of their colour bars also."""
    for text in axes.figure.findobj(lambda of: hasattr(of, "set_parse_math")):
        text.set_parse_math(False)
    return axes


class Frame:
    """The fields of a run at a time, s, at its `points` (n, 2)."""

    def __init__(self, run, time, path):
        self.run, self.time = run, time
        self.mesh = read_frame(path)
        self.points = self.mesh.points[:, :2]
        self.elements = np.vstack([block.data for block in self.mesh.cells if block.type in ("triangle", "triangle6")])

    def field(self, name):
        """A point field of the frame, or a component: u_x, stress_yy, stress_1, …"""
        if name in COMPONENTS:
            array, column = COMPONENTS[name]
            return self.mesh.point_data[array][:, column]
        try:
            return self.mesh.point_data[name]
        except KeyError:
            known = ", ".join([*self.mesh.point_data, *COMPONENTS])
            raise ValueError(f"there is no field {name}; there are {known}") from None

    def line(self, start, end, name, count=401):
        """A field along a straight line: the distances from its start and the values, NaN outside the body."""
        if not np.subtract(end, start).any():
            raise ValueError("both ends of the line are the same point; give two points")
        s = np.linspace(0.0, 1.0, count)[:, None]
        points = (1 - s) * np.asarray(start, float) + s * np.asarray(end, float)
        return s[:, 0] * np.linalg.norm(np.subtract(end, start)), self.at(points, name)

    def along(self, boundary, name):
        """A field along a boundary of the scene, in the direction of `Run.parts`: the distances from its first end, and
        the values at the vertices. Parts that are not connected have a NaN between them."""
        places, values, length = [], [], 0.0
        for points in self.run.parts(boundary):
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
            places += [*(length + np.concatenate(([0.0], np.cumsum(steps)))), np.nan]
            values += [*self.at(points, name), np.nan]
            length += steps.sum()
        return np.array(places[:-1]), np.array(values[:-1])

    def to_gmsh(self, path):
        """Writes the frame as .msh for gmsh; another file is not replaced. gmsh takes scalars and vectors only. The gap is left out: it is not a
        number off Γ_C."""
        data = {name: values for name, values in self.mesh.point_data.items()
                if values.shape[1:] in ((), (3,)) and np.isfinite(values).all()}
        data |= {name: self.field(name) for name in COMPONENTS}
        with whole(path, lambda there: there.read_bytes().endswith(WRITTEN)) as part:
            meshio.write(part, meshio.Mesh(self.mesh.points, self.mesh.cells, data), file_format="gmsh")
            with open(part, "ab") as file:
                file.write(WRITTEN)

    def at(self, points, name):
        """A field, or a strain, at a point or at points (k, 2); NaN outside the body. Sides count as straight. Strains
        jump between triangles: on a side they are those of one of its triangles."""
        if name in STRAINS:
            i, j = STRAINS[name]
            slopes = self.gradient(points, "displacement")
            return 0.5 * (slopes[..., i, j] + slopes[..., j, i])
        places, nodal = np.asarray(points, float), self.field(name)
        triangles, barycentric = self.locate(places.reshape(-1, 2))
        weights, values = functions(barycentric.T, self.elements.shape[1]), nodal[self.elements[triangles]]
        # The gap is NaN at nodes off Γ_C, which do not count on a side along it.
        values[np.abs(weights) <= -OUTSIDE] = 0.0
        # Not by einsum: a point has the same value alone as among others.
        found = (weights[..., None] * values.reshape(*weights.shape, -1)).sum(axis=1)
        return found.reshape(places.shape[:-1] + nodal.shape[1:])

    def gradient(self, points, name):
        """The gradient of a field at a point or at points (k, 2): ∂/∂x and ∂/∂y in the last axis; see `at`."""
        places, nodal = np.asarray(points, float), self.field(name)
        triangles, barycentric = self.locate(places.reshape(-1, 2))
        a, b, c = (self.points[self.elements[triangles, k]] for k in range(3))
        # ∇λ of a corner is normal to the opposite side and ends with it in twice the area.
        sides = np.stack((c - b, a - c, b - a), axis=1)
        normals = sides[..., ::-1] * (-1.0, 1.0) / _cross(b - a, c - a)[:, None, None]
        slopes = derivatives(barycentric.T, self.elements.shape[1]) @ normals
        slopes[np.isnan(barycentric).any(axis=1)] = np.nan
        found = np.einsum("kn...,knd->k...d", nodal[self.elements[triangles]], slopes)
        return found.reshape(places.shape[:-1] + nodal.shape[1:] + (2,))

    def locate(self, points):
        """The triangles of points (k, 2), and the barycentric coordinates there, (k, 3), NaN outside the body."""
        finder, outer = self._finder
        found = finder(*points.T)
        # By rounding, points on the boundary may be outside; their triangles are at the boundary.
        lost = np.flatnonzero(found < 0)
        for some in np.array_split(lost, 1 + len(lost) * len(outer) // AT_ONCE):
            found[some] = outer[self._barycentric(points[some, None], outer).min(axis=2).argmax(axis=1)]
        barycentric = self._barycentric(points, found)
        return found, np.where(barycentric.min(axis=1, keepdims=True) >= OUTSIDE, barycentric, np.nan)

    @cached_property
    def _finder(self):
        """A function that finds the triangles of points, and the triangles at the boundary."""
        from matplotlib.tri import Triangulation

        # A node of several ranks or materials is listed several times.
        points, number = np.unique(self.points, axis=0, return_inverse=True)
        mesh = Triangulation(*points.T, number.reshape(-1)[self.elements[:, :3]])
        return mesh.get_trifinder(), np.flatnonzero((mesh.neighbors < 0).any(axis=1))

    def _barycentric(self, x, triangles):
        a, b, c = (self.points[self.elements[triangles, k]] for k in range(3))
        parts = _cross(b - x, c - x), _cross(c - x, a - x), _cross(a - x, b - x)
        return np.stack(parts, axis=-1) / _cross(b - a, c - a)[..., None]


def _cross(p, q):
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def functions(barycentric, nodes):
    """The Lagrange functions (P1, or P2 for this number of nodes) of a triangle or an edge at points, which are
    rows of barycentric coordinates: (points, functions)."""
    corners = len(barycentric)
    if nodes == corners:
        return barycentric.T
    middles = [barycentric[k] * barycentric[(k + 1) % corners] for k in range(nodes - corners)]
    return np.vstack([barycentric * (2 * barycentric - 1), 4 * np.array(middles)]).T


def derivatives(barycentric, nodes):
    """∂φ_n/∂λ_k of the functions of a triangle, P1 or with 6 nodes P2, at points as in `functions`:
    (points, functions, 3)."""
    points = barycentric.T
    found = np.zeros((len(points), nodes, 3))
    if nodes == 3:
        found[:] = np.eye(3)
        return found
    for i in range(3):
        j = (i + 1) % 3
        found[:, i, i] = 4 * points[:, i] - 1
        found[:, 3 + i, i], found[:, 3 + i, j] = 4 * points[:, j], 4 * points[:, i]
    return found


def frames_of(folder):
    """(time, file) of each frame that fields.pvd lists, in the order of time. They stand beside it."""
    folder = Path(folder)
    listed = ElementTree.parse(folder / "fields.pvd").findall(".//DataSet")
    frames = [(float(of.get("timestep")), folder / Path(of.get("file")).name) for of in listed]
    return sorted(frames, key=lambda frame: frame[0])


def read_frame(path):
    """A frame: a .vtu file, or the .pvtu list of the pieces of several ranks, which meshio does not read. The pieces
    stand one after the other; nodes of several pieces have one number, `global_node`."""
    path = Path(path)
    if path.suffix != ".pvtu":
        # meshio.read would end the program if it finds a fault.
        return meshio.vtu.read(path)
    sources = [piece.get("Source") for piece in ElementTree.parse(path).findall(".//Piece")]
    pieces = [read_frame(path.parent / Path(source).name) for source in sources]
    starts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    cells = [start + piece.cells[0].data for piece, start in zip(pieces, starts)]
    return meshio.Mesh(
        np.concatenate([piece.points for piece in pieces]),
        [(pieces[0].cells[0].type, np.concatenate(cells))],
        point_data={name: np.concatenate([piece.point_data[name] for piece in pieces])
                    for name in pieces[0].point_data},
        cell_data={name: [np.concatenate([piece.cell_data[name][0] for piece in pieces])]
                   for name in pieces[0].cell_data},
    )


def paths(edges):
    """Joins edges (pairs of hashable ends) into the longest possible paths.

    A path has the direction of its first edge. If all edges have the same orientation, so have the paths. A closed
    curve ends at its first point.
    """
    at = {}
    for k, edge in enumerate(edges):
        for end in edge:
            at.setdefault(end, []).append(k)
    unused = set(range(len(edges)))
    found = []

    def follow(point):
        walked = []
        while following := [k for k in at[point] if k in unused]:
            unused.discard(following[0])
            a, b = edges[following[0]]
            point = b if a == point else a
            walked.append(point)
        return walked

    for k, (a, b) in enumerate(edges):
        if k in unused:
            unused.discard(k)
            forward = follow(b)
            found.append([*reversed(follow(a)), a, b, *forward])
    return found
