"""A state of a run and its geometry, for pictures."""

import csv
import re
import sys
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from bars import LEAST_BAR, barred, plain
from elements import Pieces
from signorini_results import paths
from signorini_summaries import flag_of, option_of, units_of
from table import write_table  # noqa: F401

# Values below these parts of the maximum of a run are rounding errors (the solver's tolerance is 1e-10).
ROUNDING = 1e-9
# ζ closer to 1 than this is undamaged.
UNDAMAGED = 1e-12
# Angles, radians, below which an obstacle is flat.
FLAT = 1e-6
# The name of a surface, in a geometry or among the $PhysicalNames of a mesh, which stand in its first bytes.
SURFACE = re.compile(r'Physical\s+Surface\s*\(\s*"([^"]+)"|^2 \d+ "([^"]+)"', re.MULTILINE)
FIRST_BYTES = 1 << 16


def read_table(path, texts=()):
    """The rows of a CSV file as dictionaries; numbers are converted, except in the columns `texts`."""
    def value(key, text):
        try:
            return text if key in texts else float(text)
        except ValueError:
            return text

    with open(path, newline="", encoding="utf-8") as file:
        return [{key: value(key, text) for key, text in row.items()} for row in csv.DictReader(file)]


def markdown(header, rows, left=()):
    """A table in Markdown. The columns with these numbers are aligned to the left, the others to the right."""
    rows = [[str(cell) for cell in row] for row in (header, *rows)]
    widths = [max(map(len, column)) for column in zip(*rows)]
    rows.insert(1, ["-" * (width - (k not in left)) + ":" * (k not in left) for k, width in enumerate(widths)])
    return "\n".join("| " + " | ".join(
        cell.ljust(width) if k in left else cell.rjust(width)
        for k, (cell, width) in enumerate(zip(row, widths))) + " |" for row in rows)


class ResultError(Exception):
    """The folder lacks data for a figure; the message has one line."""


@contextmanager
def telling(folder=None):
    """Prints problems of reading results or writing pictures in one line, and collects them in the returned list."""
    problems = []
    try:
        yield problems
    except ResultError as error:
        problems.append(str(error))
    except MemoryError:
        sys.exit("error: not enough memory for these results; raise the limit (ulimit -v), or choose fewer folders")
    except OSError as error:
        problems.append(f"{error.filename or 'standard output'}: {error.strerror}")
    except Exception as error:
        problems.append(f"{folder or 'these results'}: damaged, or of another version ({type(error).__name__}: {error}); run the "
                        "scene again")
    for problem in problems:
        print(f"error: {problem}", file=sys.stderr)


@dataclass
class ContactCurve:
    """A connected part of a contact boundary, with the body on its left."""

    name: str  # of the boundary
    points: np.ndarray  # (n, 2): the nodes along it, m
    gap: np.ndarray  # (n,), m
    pressure: np.ndarray  # (n,), Pa
    active: np.ndarray  # (n,): in contact?


@dataclass
class Results:
    """A state of the body, by default the last accepted one, and the history of the run."""

    folder: Path
    summary: dict
    scene: dict  # the scene as run; empty if the folder lacks it
    history: dict  # column → array
    frames: list  # (time, file) of every frame, in the order of time
    time: float
    nodes: np.ndarray  # (n, 2), m
    pieces: Pieces  # the elements, 3 or 6 nodes each
    contact: np.ndarray = None  # (k, 2, 2): both ends of the edges of Γ_C, m
    tangents: np.ndarray = None  # (k, 2, 2): sliding directions of the body there, 0 if it cannot slide
    obstacle: np.ndarray = None  # (k, 2, 2): opposite points of the obstacle, m
    curves: list = None  # the ContactCurves of Γ_C
    materials: np.ndarray = None  # (m,): the number of the material of each element; None for one
    material: str = None  # the name of the material that maps show; None for all
    zoom: np.ndarray = None  # (2, 2): the corners of the part that maps show, m; None for all
    displacement: np.ndarray = None  # (n, 2), m
    zeta: np.ndarray = None  # (n,)
    von_mises: np.ndarray = None  # (n,), Pa
    stress: np.ndarray = None  # (n, 4): σ_xx, σ_yy, σ_xy, σ_zz, Pa
    principal: np.ndarray = None  # (n, 2): σ₁ ≥ σ₂ in the plane, Pa
    pressure: np.ndarray = None  # (n,), Pa, −σ_ν
    gap: np.ndarray = None  # (n,), m, NaN off Γ_C

    @property
    def title(self):
        return self.summary.get("title") or self.summary.get("scene") or self.folder.name

    @property
    def units(self):
        return units_of(self.summary)

    @property
    def moment(self):
        """The time of the state, for titles."""
        if self.is_last and self.summary.get("stopped_by"):
            return f"the last state before t = {self.stopping_time} {self.units['time']}"
        return f"t = {self.time:g} {self.units['time']}"

    @property
    def part(self):
        """The time of the state and the shown material, for titles of maps."""
        return f"{self.moment}, {self.material} only" if self.material else self.moment

    @property
    def stopping_time(self):
        """The time at which the run stopped, as text."""
        time = self.summary["stopped_at"]
        return barred(time, self.summary.get("stopped_uncertainty")) or plain(time)

    @property
    def ending(self):
        """A note with the time at which the run ended early; "" if it reached its end."""
        stopped = self.summary.get("stopped_at")
        if self.summary.get("error"):
            return f"the run FAILED after t = {self.frames[-1][0]:g} {self.units['time']}"
        if stopped is None:
            return ""
        at = f"t = {self.stopping_time} {self.units['time']}"
        if self.summary.get("stopped_by") == "collapse":
            motion = self.summary["collapse"]["motion"]
            return f"stopped at {at}: nothing supports the body against {motion}"
        return f"stopped: ζ_* reached at {at}"

    def falling(self, points):
        """The velocities at points of the motion that nothing supports any more, the largest 1; None if the run has not
        ended with one."""
        collapse = self.summary.get("collapse")
        if not collapse or not self.is_last:
            return None
        of = collapse["velocity"]
        turned = (points - of["centre"]) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        velocity = np.array(of["translation"]) + of["rotation"] * turned
        return velocity / np.linalg.norm(velocity, axis=1).max()

    @property
    def material_names(self):
        """The names of materials in the order of their numbers: the general one, and those of surfaces."""
        tables = [self.scene.get(table, {}) for table in ("material", "damage")]
        return ["material", *sorted({name for table in tables for name, of in table.items() if isinstance(of, dict)})]

    @property
    def materials_there(self):
        """The names of the materials that the body has."""
        return ["material"] if self.materials is None else [self.material_names[k] for k in np.unique(self.materials)]

    def surface(self, material):
        """The name of a material in texts. The rest of the body has the name of its surface, if it is a single one."""
        others = set(surfaces_of(self.folder)) - set(self.material_names)
        return others.pop() if material == "material" and len(others) == 1 else material

    @property
    def figures(self):
        """The figures of the summary, zeros in place of rounding errors: without ζ if the scene has no damage, and with the
        sum of the contact reactions if there are several foundations."""
        figures = self.summary.get("figures", {})
        left_out = ["contact_force"] if sum(name.endswith(".contact_length") for name in figures) < 2 else []
        scales = {}
        for name, of in figures.items():
            scales[_kind(name, of)] = max(scales.get(_kind(name, of), 0.0), abs(of["value"] or 0.0))
        # A moment about the origin has the size of a force at the far end of the body.
        moment, force = (self.units["force"], False), (self.units["line"], False)
        scales[moment] = max(scales.get(moment, 0.0), scales.get(force, 0.0) * max(self.size, np.abs(self.nodes).max()))
        is_damaged = not self.scene or "damage" in self.scene
        return {name: _without_roundoff(of, scales[_kind(name, of)]) for name, of in figures.items() if name not in left_out
                and (is_damaged or not name.rpartition(".")[2].startswith("zeta"))}

    def elasticity(self, name="material"):
        """The elastic constants of a material, in words."""
        general = self.scene.get("material", {})
        of = {**general, **general.get(name, {})}
        young = plain(of["young"], 6) if "young" in of else ""
        words = [f"E = {young} {self.units['stress']}", f"ν = {of['poisson']:g}"] if young else []
        return ", ".join(words + ([f"ρ = {of['density']:g}"] if of.get("density") else []))

    @property
    def shown(self):
        """Per element: do maps show it?"""
        corners = self.places(self.factor)[self.pieces.elements]
        low, high = (-np.inf, np.inf) if self.zoom is None else self.zoom
        is_there = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
        if self.material is None:
            return is_there
        names = [] if self.materials is None else self.material_names
        shown = self.materials == names.index(self.material) if self.material in names else np.array(False)
        if not shown.any():
            raise ResultError(f"{self.folder}: no triangle has the material {self.material}; "
                              f"the scene has {', '.join(names) or 'one material'}")
        return shown & is_there

    @property
    def seen(self):
        """Per node: do maps show it?"""
        nodes = np.isin(np.arange(len(self.nodes)), self.pieces.elements[self.shown])
        inside = nodes & self.has(self.places(self.factor))
        return inside if inside.any() else nodes

    def has(self, points):
        """Per point: is it in the part that maps show?"""
        low, high = (-np.inf, np.inf) if self.zoom is None else self.zoom
        return ((points >= low) & (points <= high)).all(axis=-1)

    @property
    def overrides(self):
        """The overrides of the scene's keys on the command line; "" without overrides."""
        others = [f"{name} {value}" for name in ("mesh", "solver", "accuracy")
                  for value in option_of(self.summary, name)[-1:]]
        return ", ".join(option_of(self.summary, "set") + others)

    @property
    def is_last(self):
        """Whether this is the last state of the run."""
        return self.time == self.frames[-1][0]

    def said(self, name, value, factor=1.0, written=plain):
        """A figure of this state over `factor` as text, with its error bar if it has one, and with two digits if the mesh
        does not determine it; the `value` of the frame if the history lacks the figure."""
        figure = self.summary.get("figures", {}).get(name) or {}
        if self.is_last and figure:
            value = figure["value"]
        elif self.zoom is None and (column := f"{self.material}.{name}" if self.material else name) in self.history:
            value = self.history[column][self.step]
        if flag_of(figure)[0]:
            return plain(value / factor, 2)
        bar = figure.get("bar") if self.is_last else None
        return barred(value / factor, bar and bar / abs(factor)) or written(value / factor)

    def singular(self, name="von_mises_max"):
        """What makes an extreme stress of the last state singular; None if nothing does, and at other times."""
        largest = self.summary.get("figures", {}).get(name) or {}
        return largest.get("singular") if self.is_last else None

    def peak_of(self, curve):
        """The figure of the largest pressure of the last state on the boundary of a curve; empty without one."""
        return self.summary.get("figures", {}).get(f"{curve.name}.pressure_max", {})

    @property
    def step(self):
        """The row of the state in the history."""
        return np.abs(self.history["time"] - self.time).argmin()

    @property
    def active(self):
        """The number of active nodes; None if the history lacks it."""
        return int(self.history["active_nodes"][self.step]) if "active_nodes" in self.history else None

    @property
    def unloaded(self):
        """Whether the body is unloaded: see `without_roundoff`."""
        return not self.displacement.any()

    @property
    def size(self):
        """The longer side of the body's bounding box."""
        return float(np.ptp(self.nodes, axis=0).max())

    def outline(self, points):
        """The boundary as the longest possible polylines, from the coordinates of the nodes."""
        edges = self.pieces.boundary()
        lines = self.pieces.along(edges, points)
        at, joined = {}, []
        for (start, end, *_), line in zip(edges.tolist(), lines):
            ends = [start, *((start, end, k) for k in range(1, len(line) - 1)), end]
            at.update(zip(ends, line))
            joined += zip(ends, ends[1:])
        return [np.array([at[end] for end in path]) for path in paths(joined)]

    @property
    def box(self):
        """Two corners of the body, displaced by `factor`, and of the undeformed one."""
        points = np.vstack([self.nodes, self.places(self.factor)])
        return np.array([points.min(axis=0), points.max(axis=0)])

    @property
    def factor(self):
        """1 if maps of fields show the body deformed, which they do where displacements are seen to scale: the initial
        body would cross a foundation that has moved as far. Else 0."""
        largest = np.linalg.norm(self.displacement, axis=1).max()
        return 1.0 if largest > 0.0 and amplification(self.size, largest) == 1.0 else 0.0

    def places(self, factor):
        """The nodes, displaced by `factor`."""
        return self.nodes + factor * self.displacement

    def displacement_at(self, points):
        """The displacements of nodes at points."""
        nodes, wanted = self.nodes @ (1.0, 1.0j), points @ (1.0, 1.0j)
        order = np.argsort(nodes)
        return self.displacement[order[np.searchsorted(nodes[order], wanted)]]

    def foundation(self, factor=1.0):
        """The obstacle as polylines, for displacements amplified by `factor`.

        To scale, the point opposite a node x of Γ_C is x + g ν. A node touches the obstacle if u·ν = g. So that it also
        does so amplified, the distance is amplified: x + factor g ν. A flat obstacle with one gap is this line, which touches
        the same nodes wherever they slide along it: it stays at its place, however the body moves. On another
        obstacle a node that slides meets other points, so these follow its sliding, as far as this is amplified:
        x + factor g ν + (factor − 1) (u·τ) τ.
        """
        data = np.concatenate((self.contact, self.obstacle, self.tangents), axis=2).reshape(-1, 6)
        # Edges join at equal ends, except for rounding.
        ends = [tuple(end) for end in np.round(data / np.repeat((self.size, self.size, 1.0), 2), 9).tolist()]
        exact = dict(zip(ends, data))
        return [self._part(*np.hsplit(np.array([exact[end] for end in path]), 3), factor)
                for path in paths(list(zip(ends[::2], ends[1::2])))]

    def _part(self, nodes, opposite, tangents, factor):
        """A connected part of the amplified obstacle."""
        displacement = self.displacement_at(nodes)
        sliding = (factor - 1.0) * (displacement * tangents).sum(axis=1, keepdims=True) * tangents
        line = nodes + factor * (opposite - nodes)
        edges = np.diff(line, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        turns = [edges[:, 0] * tau[:, 1] - edges[:, 1] * tau[:, 0] for tau in (tangents[:-1], tangents[1:])]
        if (np.abs(turns) > FLAT * lengths).any():
            return np.round(line + sliding, 12)
        # The body is on the left of the line from its first end, and on the right from the other.
        still, data = line, (line, nodes, opposite - nodes - displacement, sliding)
        for side, order in ((1, slice(None)), (-1, slice(None, None, -1))):
            still = self._with_end(still[order], *(of[order] for of in data), side, factor)[order]
        return np.round(still if len(still) > 1 else line + sliding, 12)

    def _with_end(self, still, line, nodes, distance, sliding, side, factor):
        """A flat obstacle with its first end at its place, if it can be there: it is shorter where the body beside it, which
        has slid here, would be drawn behind the obstacle, and longer where touching nodes have slid beyond it."""
        inwards = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
        outwards = side * np.array([inwards[1], -inwards[0]])
        visible, slid = 1e-3 * self.size, sliding[0] @ inwards
        from_end = self.places(factor) - line[0]
        is_behind = (from_end @ outwards > visible) & ((self.nodes - nodes[0]) @ outwards <= visible)
        is_beside = (from_end @ inwards > 0.0) & (from_end @ inwards < slid)
        touches = np.abs(distance @ outwards) <= ROUNDING * np.linalg.norm(self.displacement, axis=1).max()
        reached = ((line + sliding - line[0]) @ inwards)[touches].min(initial=0.0)
        end = slid if (is_behind & is_beside).any() else reached
        if end == 0.0:
            return still
        beyond = still[(still - line[0]) @ inwards > end]
        return np.vstack([line[0] + end * inwards, beyond]) if len(beyond) else beyond


def amplification(size, largest):
    """1, 2 or 5 times a power of ten with which `largest` appears as 4–10 % of `size`; 1 if it is visible anyway, above
    2 %."""
    wanted = 0.1 * size / largest if largest > 0.0 else 1.0
    if wanted < 5.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted))
    return power * max(m for m in (1, 2, 5) if m * power <= wanted * (1 + 1e-12))


def of_part(results):
    """The results with values outside the chosen material and part that do not enter the scales of maps, and with the extremes
    that are there."""
    if results.material is None and results.zoom is None:
        return results
    name = f"{results.material}." if results.material else ""
    places = results.nodes, results.places(results.factor)

    def is_own(key, of):
        if key.endswith("pressure_max"):
            return True
        at = places[1][np.linalg.norm(places[0] - of["at"], axis=1).argmin()] if of["at"] else None
        return key.startswith(name) and (results.zoom is None or at is not None and results.has(at))

    figures = {key.removeprefix(name): of for key, of in results.summary.get("figures", {}).items() if is_own(key, of)}
    inside = np.isin(np.arange(len(results.nodes)), results.pieces.elements[results.shown])
    if not inside.any():
        # Only the magnified body, or a foundation, is there.
        return replace(results, zoom=None)
    return replace(
        results, summary={**results.summary, "figures": figures},
        zeta=np.where(inside, results.zeta, results.zeta[inside].max()), von_mises=results.von_mises * inside,
        principal=results.principal * inside[:, None])


@cache
def surfaces_of(folder):
    """The names of the surfaces of the mesh, from the geometries and meshes in a folder of results. Names that a geometry
    computes are missing."""
    found = set()
    for path in (*folder.glob("*.geo"), *folder.glob("*.msh")):
        with open(path, encoding="utf-8", errors="replace") as file:
            found |= {geometry or mesh for geometry, mesh in SURFACE.findall(file.read(FIRST_BYTES))}
    return frozenset(found)


def _kind(name, figure):
    """The unit of a figure, and is it a displacement? Coordinates and lengths of contact are as large as the body."""
    return figure["unit"], name.rpartition(".")[2].startswith(("displacement", "u_"))


def _without_roundoff(figure, scale):
    """A figure, and its extreme over all steps, that are 0 if they are within a bar or a rounding error far below the
    `scale` of other figures in its unit."""
    bar = figure["bar"] or 0.0
    noise = max(bar if bar <= LEAST_BAR * scale else 0.0, ROUNDING * scale)

    def rounded(of):
        value = of["value"]
        return {**of, "value": 0.0} if value is not None and abs(value) <= noise else of

    figure = {**rounded(figure), "governing": figure["governing"] and rounded(figure["governing"])}
    return {**figure, "bar": None} if figure["value"] == 0.0 and (bar <= noise or scale == 0.0) else figure


def without_roundoff(results):
    """The results with zeros in place of rounding errors.

    A state is unloaded if its displacements are below the rounding of coordinates, or a billion times smaller
    than earlier in the run (solvers are exact to about 1e-10). In a loaded state pressures are compared with
    stresses, gaps with displacements, and stresses with Young's modulus times displacement over body size.
    """
    largest = np.linalg.norm(results.displacement, axis=1).max()
    earlier = np.nanmax(results.history.get("displacement_max", [0.0]), initial=0.0)
    deformation = max(1e-14 * results.size, ROUNDING * max(largest, earlier))
    zeta = np.where(np.abs(1.0 - results.zeta) <= UNDAMAGED, 1.0, results.zeta)

    def rounded(values, noise):
        return np.where(np.abs(values) <= noise, 0.0, values)

    def rounded_curves(noise):
        return [replace(curve, gap=rounded(curve.gap, deformation),
                        pressure=rounded(curve.pressure, noise)) for curve in results.curves]

    results = replace(results, zeta=zeta, gap=rounded(results.gap, deformation))
    if largest <= deformation:
        names = ("displacement", "von_mises", "stress", "principal", "pressure")
        zeros = {name: 0.0 * getattr(results, name) for name in names}
        return replace(results, **zeros, curves=rounded_curves(np.inf))
    young = results.scene.get("material", {}).get("young")
    young = young if isinstance(young, (int, float)) else 0.0
    rigid = results.von_mises.max() <= ROUNDING * young * largest / results.size
    stress = results.von_mises * (not rigid)
    pressures = np.maximum(results.pressure.max(), stress.max())
    noise = ROUNDING * pressures
    return replace(results, von_mises=stress, stress=results.stress * (not rigid), principal=results.principal * (not rigid),
                   pressure=rounded(results.pressure, noise), curves=rounded_curves(noise))
