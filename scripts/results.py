"""Reads a result folder: fields.pvd with its frames, history.csv, summary.json."""

import csv
import json
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import meshio
import numpy as np

from elements import Pieces, counter_clockwise


def read_table(path):
    """The rows of a CSV file as dictionaries, with numbers where there are any."""
    def value(text):
        try:
            return float(text)
        except ValueError:
            return text

    with open(path, newline="", encoding="utf-8") as file:
        return [{key: value(text) for key, text in row.items()} for row in csv.DictReader(file)]


class ResultError(Exception):
    """The folder does not hold what a figure needs: said in one line."""


@dataclass
class Results:
    """The last accepted state, and what happened on the way to it."""

    folder: Path
    summary: dict
    history: dict  # column → array
    time: float
    nodes: np.ndarray  # (n, 2), m
    pieces: Pieces  # the elements, 3 or 6 nodes each
    displacement: np.ndarray  # (n, 2), m
    zeta: np.ndarray  # (n,)
    von_mises: np.ndarray  # (m,), Pa
    pressure: np.ndarray  # (n,), Pa, −σ_ν
    gap: np.ndarray  # (n,), m, NaN off Γ_C
    contact: np.ndarray  # (k, 2, 2): both ends of the edges of Γ_C, m
    tangents: np.ndarray  # (k, 2, 2): along which the body slides there, 0 where it cannot
    obstacle: np.ndarray  # (k, 2, 2): what is opposite them, m

    @property
    def title(self):
        return self.summary.get("title") or self.summary.get("scene") or self.folder.name

    @property
    def ending(self):
        """That the run did not reach its end, and when it ended; nothing if it did."""
        stopped = self.summary.get("stopped_at")
        if self.summary.get("error"):
            return f"the run FAILED after t = {self.time:g} s"
        return "" if stopped is None else f"stopped: ζ$_*$ reached at t = {stopped:.4g} s"

    @property
    def unloaded(self):
        """Whether nothing has moved: see `without_roundoff`."""
        return not self.displacement.any()

    @property
    def size(self):
        """The longer side of the body's bounding box."""
        return float(np.ptp(self.nodes, axis=0).max())

    def outline(self, points):
        """The boundary as polylines as long as possible, from the coordinates of the nodes."""
        edges = self.pieces.boundary()
        lines = self.pieces.along(edges, points)
        at, joined = {}, []
        for (start, end, *_), line in zip(edges.tolist(), lines):
            ends = [start, *((start, end, k) for k in range(1, len(line) - 1)), end]
            at.update(zip(ends, line))
            joined += zip(ends, ends[1:])
        return [np.array([at[end] for end in path]) for path in paths(joined)]

    def contact_pieces(self):
        """Γ_C as node paths: its connected pieces, the body on the left."""
        edges = self.pieces.boundary()
        edges = edges[np.isfinite(self.gap)[edges].all(axis=1)]
        # From one end by way of the middle, if there is one, to the other.
        edges = np.column_stack([edges[:, 0], edges[:, 2:], edges[:, 1]])
        return paths([pair for edge in edges.tolist() for pair in zip(edge, edge[1:])])

    def foundation(self, factor=None):
        """The obstacle as polylines; with a factor, as the body deformed so many times meets it.

        A node of Γ_C touches the obstacle where u·ν = g, so what is opposite it moves to
        x + factor (g ν + (u·τ) τ): it goes along with the sliding of the body.
        """
        lines = self.obstacle
        if factor is not None:
            at = {tuple(x): u for x, u in zip(self.nodes.tolist(), self.displacement)}
            u = np.array([at[tuple(x)] for x in self.contact.reshape(-1, 2).tolist()])
            u = u.reshape(self.contact.shape)
            sliding = (u * self.tangents).sum(axis=2, keepdims=True) * self.tangents
            lines = self.contact + factor * (self.obstacle - self.contact + sliding)
        lines = np.round(lines, 12)
        return [np.array(path) for path in paths([tuple(map(tuple, l)) for l in lines.tolist()])]


def paths(edges):
    """Joins edges (pairs of hashable ends) into paths as long as possible.

    The first edge's direction is the path's: where all edges run the same way round,
    so do the paths. A closed curve ends on the point it starts from.
    """
    at = defaultdict(list)
    for k, edge in enumerate(edges):
        for end in edge:
            at[end].append(k)
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


def read_results(folder):
    """Everything a figure needs from one result folder."""
    folder, summary = Path(folder), {}
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        with open(folder / "history.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        frames = ElementTree.parse(folder / "fields.pvd").findall(".//DataSet")
        last = max(frames, key=lambda frame: float(frame.get("timestep")))
        fields = read_frame(folder / last.get("file"))
        blocks = [k for k, b in enumerate(fields.cells) if b.type in ("triangle", "triangle6")]
        elements = np.vstack([fields.cells[k].data for k in blocks])
        results = Results(
            folder=folder,
            summary=summary,
            history={c: np.array([_number(r[c]) for r in rows]) for c in (rows or [{}])[0]},
            time=float(last.get("timestep")),
            nodes=fields.points[:, :2],
            pieces=Pieces(counter_clockwise(fields.points, elements)),
            displacement=fields.point_data["displacement"][:, :2],
            zeta=np.ravel(fields.point_data["zeta"]),
            von_mises=np.concatenate([np.ravel(fields.cell_data["von_mises"][k]) for k in blocks]),
            pressure=np.ravel(fields.point_data["normal_pressure"]),
            gap=np.ravel(fields.point_data["gap"]),
            contact=_segments(summary["contact_boundary"]),
            tangents=_segments(summary["contact_tangents"]),
            obstacle=_segments(summary["foundation"]),
        )
        return without_roundoff(results)
    except OSError as error:
        if failed := summary.get("error"):
            raise ResultError(f"{folder}: nothing to draw, the run failed: {failed}") from None
        raise ResultError(f"{error.filename}: {error.strerror}") from None
    except KeyError as error:
        raise ResultError(f"{folder}: the field {error} is missing") from None
    except (ValueError, ElementTree.ParseError, meshio.ReadError) as error:
        raise ResultError(f"{folder}: {error}") from None


def without_roundoff(results):
    """The results, with zeros in the place of what round-off leaves of an unloaded state.

    That is a state whose displacements are below the rounding of coordinates, or a billion times
    smaller than earlier in the run (solvers are exact to about 1e-10).
    """
    largest = np.linalg.norm(results.displacement, axis=1).max()
    earlier = np.nanmax(results.history.get("displacement_max", [0.0]), initial=0.0)
    if largest > max(1e-14 * results.size, 1e-9 * earlier):
        return results
    names = ("displacement", "von_mises", "pressure")
    return replace(results, **{name: 0.0 * getattr(results, name) for name in names})


def read_frame(path):
    """A frame: a .vtu file, or the .pvtu list of the pieces that several ranks have written.

    meshio does not read lists; nodes that pieces share are joined by their numbers.
    """
    if path.suffix != ".pvtu":
        return meshio.read(path)
    sources = [piece.get("Source") for piece in ElementTree.parse(path).findall(".//Piece")]
    # A rank that has no triangles leaves an empty piece.
    pieces = [piece for piece in (meshio.read(path.parent / s) for s in sources) if piece.cells]
    numbers = [np.ravel(piece.point_data["global_node"]) for piece in pieces]
    _, first, place = np.unique(np.concatenate(numbers), return_index=True, return_inverse=True)
    starts = np.cumsum([0, *map(len, numbers)])

    def joined(arrays):
        return np.concatenate(arrays)[first]

    cells = [
        place[start + block.data]
        for piece, start in zip(pieces, starts)
        for block in piece.cells
    ]
    return meshio.Mesh(
        joined([piece.points for piece in pieces]),
        [(pieces[0].cells[0].type, np.concatenate(cells))],
        point_data={
            name: joined([piece.point_data[name] for piece in pieces])
            for name in pieces[0].point_data
        },
        cell_data={
            name: [np.concatenate([block for piece in pieces for block in piece.cell_data[name]])]
            for name in pieces[0].cell_data
        },
    )


def _segments(lists):
    return np.array(lists, dtype=float).reshape(-1, 2, 2)


def _number(text):
    return float(text) if text else np.nan
