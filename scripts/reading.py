"""Reads a folder of results: fields.pvd with its frames, history.csv, summary.json, and scene.toml if it
exists."""

import tomllib
import xml.etree.ElementTree as ElementTree
import zlib
from collections import defaultdict
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from itertools import groupby
from pathlib import Path

import meshio
import numpy as np

import signorini_results
from elements import Pieces, counter_clockwise
from expressions import evaluate, with_values
from results import ContactCurve, ResultError, Results, of_part, read_table, without_roundoff


@contextmanager
def whole(path):
    """Adds the name of the file to an error of reading it."""
    try:
        yield path
    except (TypeError, ValueError, IndexError, ElementTree.ParseError, zlib.error, meshio.ReadError):
        raise ResultError(f"{path}: it is damaged or cut off; run the scene again") from None


def open_run(folder, files=(("history.csv", "columns"), ("fields.pvd", "frames"))):
    """A run of `signorini_results` that has something in these files; a problem is an error in one line."""
    folder, summary = Path(folder), {}
    try:
        run = signorini_results.load(folder)
        summary = run.summary
        # Properties read their files at first use.
        for name, read in files:
            with whole(folder / name) as path:
                if not getattr(run, read):
                    raise ResultError(f"{path}: it is empty")
        return run
    except ValueError as error:
        raise ResultError(str(error)) from None
    except OSError as error:
        if failed := summary.get("error"):
            raise ResultError(f"{folder}: nothing to draw, the run failed: {failed}") from None
        what = "; the run wrote no frames: run its scene.toml with --set output.every=1"
        what = what if summary else "; name a folder of results, out/SCENE"
        raise ResultError(f"{error.filename}: {error.strerror}{what}") from None


def read_results(folder, time=None, material=None, zoom=None):
    """The contents of a folder of results, with the frame nearest to `time` or the last frame; of one material only, if
    it is named, and of the part between the corners `zoom`, for maps."""
    run = open_run(folder)
    scene = _scene_of(run.folder)
    chosen = run.frames[-1 if time is None else nearest(run.frames, time)]
    fields = read_frame(chosen[1])
    try:
        elements = np.vstack([block.data for block in fields.cells if block.type in ("triangle", "triangle6")])
        pieces = Pieces(counter_clockwise(fields.points, elements), fields.point_data.get("global_node"))
        results = Results(run.folder, run.summary, scene, run.columns, run.frames, chosen[0], fields.points[:, :2],
                          pieces, material=material, zoom=zoom and np.array(zoom))
        return with_fields(results, chosen[0], fields)
    except KeyError as error:
        raise ResultError(f"{folder}: the field {error} is missing") from None
    except ValueError as error:
        raise ResultError(f"{folder}: {error}") from None


def read_without_fields(folder, time=None):
    """The history of a run, and the state of its contact boundaries nearest to `time` or the last one. A run of a study, which
    writes no frames, has them as well."""
    run = open_run(folder, [("history.csv", "columns")])
    times = sorted(_contact_rows(run.folder / "contact.csv")) or list(run.columns["time"][-1:])
    frames = [(of, None) for of in times]
    chosen = times[-1 if time is None else nearest(frames, time)]
    nodes = np.vstack([np.reshape(edges, (-1, 2)) for edges in run.summary["boundaries"].values()])
    return Results(run.folder, run.summary, _scene_of(run.folder), run.columns, frames, chosen, nodes, None,
                   curves=_contact_curves(run.folder, chosen))


def _scene_of(folder):
    """The scene as run, with the values of its constants; empty if the folder lacks it."""
    with whole(folder / "scene.toml") as file:
        scene = tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        return with_values(scene, folder)


def nearest(frames, time):
    """The index of the frame nearest to a time."""
    return min(range(len(frames)), key=lambda k: abs(frames[k][0] - time))


def evenly(frames, most):
    """At most `count` frames at about equal intervals, which are not shorter than the longest interval of all."""
    times = [time for time, _ in frames]
    if len(times) < 2:
        return frames
    count = 1 + round((times[-1] - times[0]) / max(np.diff(times)))
    wanted = np.linspace(times[0], times[-1], min(count, most))
    return [frames[k] for k in sorted({nearest(frames, time) for time in wanted})]


def states(results, frames):
    """The results at some of their frames."""
    return [with_fields(results, time, read_frame(path)) for time, path in frames]


def with_fields(results, time, fields):
    """The results with another frame of the same run."""
    points, materials = fields.point_data, fields.cell_data.get("material")
    contact, tangents, obstacle = _foundation(results, time, points["displacement"][:, :2])
    return of_part(without_roundoff(replace(
        results, time=time, contact=contact, tangents=tangents, obstacle=obstacle,
        curves=_contact_curves(results.folder, time),
        materials=materials and np.concatenate(materials),
        displacement=points["displacement"][:, :2],
        zeta=points["zeta"],
        von_mises=points["von_mises"].astype(float),
        stress=points["stress"].astype(float),
        principal=points["principal_stress"].astype(float),
        pressure=points["normal_pressure"],
        gap=points["gap"],
    )))


def read_frame(path):
    """A frame of `signorini_results`; an error of reading it names the file."""
    with whole(path):
        return signorini_results.read_frame(path)


def _foundation(results, time, displacement):
    """The ends of the edges of Γ_C, the sliding directions of the body there, and the opposite points of the obstacle.

    A node x with the gap g along ν is opposite the point x + g ν. A corner has two normals and gaps: its opposite point
    is x + d with d·ν = g for both, and it does not slide.
    """
    def prescribed(of, node, edge_normal):
        # In results of version 0.2.0 a prescribed node has no row in contact.csv, but a gap in the scene.
        at = partial(evaluate, points=node[None], t=time, folder=results.folder)
        normal = np.ravel([at(part) for part in of["normal"]]) if "normal" in of else edge_normal
        return at(of["gap"]) * normal / np.linalg.norm(normal), np.zeros(2)

    displacements = dict(zip(map(tuple, results.nodes.tolist()), displacement))
    conditions = defaultdict(list)
    for row in _contact_rows(results.folder / "contact.csv").get(time, []):
        normal = np.array([row["normal_x"], row["normal_y"]])
        conditions[row["x"], row["y"]].append((normal, row["gap"]))

    def opposite(node, edge_normal):
        found = [(nu, gap + nu @ displacements[node]) for nu, gap in conditions.get(node, [])]
        if not found:
            return None
        normals, gaps = map(np.array, zip(*found))
        if len(found) == 2 and abs(np.linalg.det(normals)) > 1e-4:
            return np.linalg.solve(normals, gaps), np.zeros(2)
        (x, y), gap = max(found, key=lambda condition: condition[0] @ edge_normal)
        return np.array([gap * x, gap * y]), np.array([-y, x])

    ends = []
    for of in results.scene.get("boundary", []):
        for a, b in np.array(results.summary["boundaries"].get(of["name"], []) * ("gap" in of)).reshape(-1, 2, 2):
            normal = np.array([b[1] - a[1], a[0] - b[0]])
            for node in (a, b):
                way, tangent = opposite(tuple(node.tolist()), normal) or prescribed(of, node, normal)
                ends.append([node, tangent, node + way])
    return np.array(ends).reshape(-1, 2, 3, 2).transpose(2, 0, 1, 3)


@cache
def _contact_rows(path):
    """The rows of contact.csv by time. All values are numbers except the name of the boundary."""
    rows = defaultdict(list)
    if path.exists():
        with whole(path):
            for row in read_table(path, texts=("boundary",)):
                rows[row["time"]].append(row)
    return rows


def _contact_curves(folder, time):
    """The connected parts of each contact boundary."""
    path, curves = folder / "contact.csv", []
    for (name, number), part in _parts(_contact_rows(path).get(time, [])):
        columns = ("x", "y", "gap", "pressure", "active")
        values = np.array([[row[key] for key in columns] for row in part])[_orders(path)[name, number]]
        x, y, gap, pressure, active = values.T
        curves.append(ContactCurve(name, np.column_stack((x, y)), gap, pressure, active > 0.0))
    return curves


def _parts(rows):
    """The rows of each connected part, which are consecutive, with its boundary and number."""
    parts = groupby(rows, key=lambda row: (row["boundary"], row["part"]))
    return [(key, list(part)) for key, part in parts]


@cache
def _orders(path):
    """By boundary and part: the order of the rows along it. A closed part begins and ends where no pressure acts at any time, in
    the middle of the longest such stretch, or at the least pressure."""
    parts, orders = defaultdict(list), {}
    for rows in _contact_rows(path).values():
        for key, part in _parts(rows):
            parts[key].append(part)
    for key, states in parts.items():
        place, normal = (lambda row, k=k: (row[f"{k}x"], row[f"{k}y"]) for k in ("", "normal_"))
        first, last = states[0][0], states[0][-1]
        orders[key] = np.arange(len(states[0]))
        if len(states[0]) > 3 and place(first) == place(last):
            # Without a corner the first and the last row are one node.
            count = len(states[0]) - (normal(first) == normal(last))
            largest = np.max([[row["pressure"] for row in part[:count]] for part in states], axis=0)
            loaded = np.flatnonzero(largest)
            gaps = np.diff(loaded, append=loaded[:1] + count)
            k = gaps.argmax() if len(gaps) else None
            begin = 0 if k is None else largest.argmin() if gaps[k] < 2 else loaded[k] + gaps[k] // 2
            orders[key] = (begin + np.arange(count + 1)) % count
    return orders
