"""The data of the viewer in report.html: the mesh and the frames of a run, packed, and what their pictures need."""

import base64
import json
import zlib

import matplotlib
import numpy as np

from bars import placed
from drawing import stress_unit
from limits import SINGULAR_PEAK
from reading import evenly, states
from results import ROUNDING
from setting import boundary_colours, curves_of, loads_of
from signorini_results import PEAK, PEAK_PART, paths

# The largest size of all frames in the page, bytes.
LARGEST = 24_000_000
# Fields of the page: label, kind of unit, table of colours. page/data.js computes them.
FIELDS = {
    "damage": ("damage 1 − ζ", "none", "magma"),
    "zeta": ("ζ", "none", "viridis"),
    "von_mises": ("von Mises stress", "stress", "viridis"),
    "stress_1": ("principal stress σ₁", "stress", "viridis"),
    "stress_2": ("principal stress σ₂", "stress", "viridis"),
    "stress_xx": ("σ_xx", "stress", "viridis"),
    "stress_yy": ("σ_yy", "stress", "viridis"),
    "stress_xy": ("σ_xy", "stress", "viridis"),
    "stress_zz": ("σ_zz", "stress", "viridis"),
    "displacement": ("displacement |u|", "length", "viridis"),
    "u_x": ("u_x", "length", "viridis"),
    "u_y": ("u_y", "length", "viridis"),
}


def frames_of(results):
    """The results at all frames, or at as many as fit into the page at about equal intervals."""
    most = max(2, LARGEST // len(packed(columns(results))))
    return states(results, results.frames if len(results.frames) <= most else evenly(results.frames, most))


def packed(*arrays):
    """Numbers of four bytes as text: base64 of zlib, with the first bytes of all numbers first, then the second, …"""
    numbers = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    split = np.frombuffer(numbers, np.uint8).reshape(-1, 4).T.tobytes()
    return base64.b64encode(zlib.compress(split, 6)).decode()


def columns(state):
    """The fields of a state, a row each: u_x, u_y, 1 − ζ, σ_xx, σ_yy, σ_xy, σ_zz; then the pressures and the gaps of each
    curve of Γ_C."""
    # Rounding errors are no stress.
    stress = np.where(np.abs(state.stress) > ROUNDING * state.von_mises.max(), state.stress, 0.0)
    fields = np.vstack((state.displacement.T, 1.0 - state.zeta, stress.T))
    contact = [values for curve in state.curves for values in (curve.pressure, curve.gap)]
    return with_digits(np.concatenate([fields.ravel(), *contact]))


def with_digits(values):
    """Numbers of four bytes with a relative precision of 2⁻¹⁷, five digits: the last bits compress badly."""
    bits = values.astype(np.float32).view(np.uint32)
    return (bits + 0x40 & 0xffffff80).astype(np.uint32)


def elements_of(results, everything, limits):
    """The elements of the page with the data of the viewer; `everything` are the results at its frames."""
    origin = np.round(results.nodes.mean(axis=0), 12)
    mesh = [(results.nodes - origin).astype(np.float32), results.pieces.elements.astype(np.uint32),
            np.zeros(len(results.pieces.elements), np.uint32) if results.materials is None
            else results.materials.astype(np.uint32)]
    text = json.dumps(about(results, everything, limits, origin), separators=(",", ":"), allow_nan=False)
    # Nothing in a script may look like the end of it.
    blocks = [("run", text.replace("<", r"\u003c")), ("mesh", packed(*mesh)),
              *((f"frame{k}", packed(columns(state))) for k, state in enumerate(everything))]
    return "\n".join(f'<script type="text/plain" id="{name}">{block}</script>' for name, block in blocks)


def about(results, everything, limits, origin):
    """What the viewer must know besides the fields; places are relative to `origin`."""
    units, number = results.units, {point: k for k, point in enumerate(map(tuple, results.nodes.tolist()))}
    factor, unit = stress_unit(limits.stress, units)
    left_out = ("damage", "zeta") * ("damage" not in results.scene) + ("stress_zz",) * (results.scene["material"]["plane"] == "stress")
    gaps = np.concatenate([curve.gap for state in everything for curve in state.curves] or [np.zeros(1)])
    colours = boundary_colours(results)
    return {
        "name": results.folder.resolve().name,
        "count": len(results.nodes), "size": len(results.pieces.elements), "order": results.pieces.elements.shape[1],
        "origin": origin.tolist(), "box": (limits.box - origin).tolist(), "automatic": limits.factor,
        "materialNames": [results.surface(name) for name in results.material_names] if results.materials is not None else ["body"],
        "fields": {key: dict(zip(("label", "kind", "colours"), of)) for key, of in FIELDS.items()
                   if key not in left_out},
        "units": {"stress": {"name": unit, "factor": factor}, "length": {"name": units["length"], "factor": 1},
                  "none": {"name": "", "factor": 1}},
        "colours": {name: np.round(255 * matplotlib.colormaps[name](np.arange(256))[:, :3]).astype(int).tolist()
                    for name in ("viridis", "magma")},
        "outline": paths([pair for edge in along(results.pieces.boundary()) for pair in edge]),
        "boundaries": [{"name": name, "colour": colours[name], "nodes": [number[tuple(point)] for point in path.tolist()]}
                       for name, path in curves_of(results) if name in colours],
        "curves": [curve_of(curve, number, units) for curve in results.curves],
        "singular": singular(results, number),
        "peak": {"part": PEAK_PART, "factor": PEAK, "singular": SINGULAR_PEAK},
        "topPressure": limits.pressure if results.curves else 0, "stressTop": limits.stress, "largestLoad": limits.load,
        "leastGap": float(gaps.min()), "largestGap": float(gaps.max()),
        # A static solve has no other time.
        "frames": [{"moment": state.moment * (len(results.frames) > 1), "loads": loads(state, origin), "foundation": foundation(state, origin, limits.factor)}
                   for state in everything],
    }


def along(edges):
    """The parts of edges of two nodes, or of three nodes, of which the last is the middle."""
    return [[(a, b)] if not middle else [(a, middle[0]), (middle[0], b)] for a, b, *middle in edges.tolist()]


def curve_of(curve, number, units):
    """A connected part of Γ_C: its name, its nodes and their distances along it."""
    steps = np.linalg.norm(np.diff(curve.points, axis=0), axis=1)
    at = placed(curve.points[0], np.ptp(curve.points, axis=0).max())
    return {"title": f"{curve.name}, from {at} {units['length']}",
            "nodes": [number[point] for point in map(tuple, curve.points.tolist())],
            "arc": np.concatenate(([0.0], np.cumsum(steps))).tolist()}


def singular(results, number):
    """Nodes where a stress of the last state is singular, and the reasons."""
    found = {}
    for of in results.summary.get("figures", {}).values():
        if of["singular"] and of["at"] and (node := number.get(tuple(of["at"]))) is not None:
            found[node] = f"singular: {of['singular']}"
    return [{"at": node, "reason": reason} for node, reason in found.items()]


def loads(state, origin):
    """Arrows of tractions along each boundary: places, displacements, forces, and whether they press."""
    return [{"at": rounded(points - origin), "moved": rounded(moved), "force": rounded(force), "presses": presses.tolist()}
            for points, moved, force, presses in loads_of(state)]


def foundation(state, origin, magnified):
    """The obstacle as polylines `at` + factor · `by`, as pictures show it for the factors 1 and `magnified` of the displacements."""
    magnified = magnified if magnified > 1.0 else 2.0
    true, other = state.foundation(1.0), state.foundation(magnified)
    if [line.shape for line in true] != [line.shape for line in other]:
        true = other
    slopes = [(b - a) / (magnified - 1.0) for a, b in zip(true, other)]
    return [{"at": rounded(a - by - origin), "by": rounded(by)} for a, by in zip(true, slopes)]


def rounded(array):
    """An array as lists of numbers with seven digits."""
    return [[float(f"{x:.7g}") for x in row] for row in array.tolist()]
