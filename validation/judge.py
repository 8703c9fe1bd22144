"""Judges what a run of the program wrote: right, refused (rightly or not), wrong.

Two tests, of which the first needs no other answer: (i) the displacement written keeps the contact
rows and the prescribed values, and at every node Ku − f is a force that they may exert: zero where
there are none, in the cone of the touching normals elsewhere; (ii) it is the judge's own answer, in
the largest displacement and in the energy, up to motions that the problem leaves open. The damage
written obeys (28) from the frame before.
"""

import json
import re
from dataclasses import dataclass
from xml.etree import ElementTree

import meshio
import numpy as np
from scipy.optimize import nnls

from discrete import Discrete
from scene import Expression, read_scene
from triangulation import read_triangulation
from variational import Step, along, without

FORCE = 1e-8  # residual forces, relative to the largest sum of absolute element forces at a node
PLACE = 1e-8  # violations of gaps, relative to the largest displacement
ANSWER = 1e-6  # displacements, relative
ENERGY = 1e-4  # strains in the energy norm, relative
HISTORY = 1e-9  # of the largest force and displacement so far: a load may cross zero
TOLERANCE = 1e-10  # KKT tolerance of the runs
DAMAGE = 1e-8


@dataclass
class Verdict:
    """A word; why; the largest relative difference of u found. `right`; `refused rightly`;
    `either`: refusing is as good; `gave up`: a solver failed on a scene that has no solution;
    `imprecise`: off by what the residuals allow, untold; `refused wrongly`; `wrong`."""

    word: str
    reason: str
    difference: float = 0.0
    traits: str = ""


def judge(folder, code, output):
    """The verdict on a run of folder/scene.toml into folder/out with an exit code and output."""
    scene = read_scene(folder / "scene.toml")
    discrete = Discrete(scene, read_triangulation(folder / scene["mesh"]["file"]))
    verdict = verdict_on(discrete, folder / "out", code, output)
    verdict.traits = traits(discrete)
    return verdict


def verdict_on(discrete, out, code, output):
    """First by the exit code against what the data ask for, then by the frames."""
    refusal, either = expectation(discrete)
    said = message(output)
    if code == 2:
        if either:
            return Verdict("either", said)
        return Verdict("refused rightly" if refusal else "refused wrongly", refusal or said)
    if code not in (0, 1):
        return Verdict("wrong", f"exit code {code}: {said}")
    if refusal and not either:
        word = "gave up" if code == 1 else "wrong"
        return Verdict(word, f"should be refused ({refusal}), exit code {code}: {said}")
    frames = read_frames(discrete.mesh, out)
    if not frames and code == 0:
        return Verdict("wrong", "no frames")
    found = judge_frames(discrete, frames, output)
    if found.word == "wrong":
        return found
    if code == 1:
        return Verdict("refused wrongly", f"exit code 1: {said}")
    return judge_stop(discrete, frames, out) or found


def traits(discrete):
    """What is unusual about a scene, in words to count by."""
    rows, words = discrete.contact, []
    held = {node for node, _, _ in discrete.prescribed}
    for node in np.unique(rows.node):
        n = rows.direction[rows.node == node]
        if len(n) > 1 and node not in held:
            words.append("opposite" if (n @ n.T).min() < -0.99 else "corner")
        if len(n) > 2 or len(n) > 1 and node in held:
            words.append("many rows")
    if discrete.clusters()[0] > 1:
        words.append("pieces")
    if "time" not in discrete.scene and "t" in re.findall(r"\b[a-z]+\b", str(discrete.scene)):
        words.append("static with t")
    return " ".join(sorted(set(words)))


def expectation(discrete):
    """(reason to refuse the scene or None, whether either will do): by data and by the ranks."""
    reason, either = discrete.bad_input()
    if reason:
        return reason, False
    zeta = np.ones(len(discrete.mesh.nodes))
    worst = None
    steps = [1.0]
    if "time" in discrete.scene:
        end, step = (float(discrete.scene["time"][key]) for key in ("end", "step"))
        count = round(end / step)
        steps = [end * n / count for n in range(count + 1)]
    for t in steps:
        step = Step(discrete, zeta, t)
        size = np.abs(step.held.value).max(initial=0.0)
        for name, value, low, high in (
            ("prescribed values contradict", step.contradiction, 1e-11 * size, 1e-7 * size),
            ("prescribed through the obstacle", step.penetration, 1e-13 * size, 1e-9 * size),
            ("driven", step.driven, 1e-11, 1e-7),
        ):
            if value > high:
                return f"{name} at t = {t:g}", either
            if value > low:
                worst, either = f"{name}, barely", True
    return worst, either


def judge_frames(discrete, frames, output):
    """Every frame written: the damage step, then the contact step."""
    worst, scale, before = Verdict("right", ""), (0.0, 0.0), None
    damaged = "damage" in discrete.scene
    start = Expression(discrete.law["initial"] if damaged else 1.0).at(discrete.mesh.nodes)
    for time, u, zeta, apart in frames:
        expected = start
        if before is not None:
            expected = before[2]
            if damaged:
                expected = discrete.damage_step(before[1], before[2], time - before[0])
        off = np.abs(zeta - expected).max()
        if not np.isfinite(u).all() or not off <= DAMAGE or apart:
            reason = f"ζ differs by {off:.1e}, ranks by {apart:.1e}, or values are missing"
            return Verdict("wrong", f"t = {time:g}: {reason}")
        found, scale = judge_step(Step(discrete, zeta, time), u, scale)
        found.reason = f"t = {time:g}: {found.reason}"
        if found.word == "wrong":
            return found
        if found.word == "imprecise" or found.difference > worst.difference:
            worst = found
        before = (time, u, zeta)
    told = re.search(r"exact only|cannot be estimated|one of many", output)
    if worst.word == "imprecise" and told:
        worst.word = "right"
    return worst


def judge_stop(discrete, frames, out):
    """A stop at ζ_* must be one; None if it is, or there is none."""
    stopped = json.loads((out / "summary.json").read_text()).get("stopped_at")
    if stopped is None:
        return None
    time, u, zeta, _ = frames[-1]
    least = discrete.damage_step(u, zeta, stopped - time).min()
    if least <= discrete.law["threshold"] + DAMAGE:
        return None
    return Verdict("wrong", f"stopped at ζ_* at t = {stopped:g}, but min ζ = {least:.3e}")


def residuals(step, u, scale=(0.0, 0.0)):
    """(forces, places): test (i), relative; and the scales (force, length) it used."""
    sizes, rounding = step.discrete.element_sizes(step.zeta, u)
    force = max((sizes + np.abs(step.f)).max(), HISTORY * scale[0])
    length = max(np.abs(u).max(), HISTORY * scale[1])
    slack = step.rows.value - along(step.rows, u)
    places = np.r_[-slack, np.abs(along(step.held, u) - step.held.value), 0.0].max()
    force, length = force or 1.0, length or 1.0
    reaction = (step.f - step.k @ u).reshape(-1, 2)
    off = np.linalg.norm(reaction, axis=1)
    touching = slack <= PLACE * length
    for node in np.unique(np.r_[step.rows.node[touching], step.held.node]):
        d = step.held.direction[step.held.node == node]
        normals = step.rows.direction[(step.rows.node == node) & touching]
        off[node] = force * nnls(np.vstack([normals, d, -d]).T, reaction[node] / force)[1]
    # Element forces of a large rigid motion are rounding.
    off = np.maximum(off - 1e-14 * rounding.reshape(-1, 2).sum(1), 0.0)
    return off.max() / force, places / length, (force, length)


def judge_step(step, u, scale):
    """The verdict on u, and the largest (force, length) so far."""
    forces, places, size = residuals(step, u, scale)
    scale = max(scale[0], size[0]), max(scale[1], size[1])
    if forces > FORCE or places > PLACE:
        return Verdict("wrong", f"forces off by {forces:.1e}, gaps by {places:.1e}"), scale
    own = step.solve()
    own_forces, own_places, _ = residuals(step, own, scale)
    if own_forces > FORCE or own_places > PLACE:
        return Verdict("right", "the judge's own answer is not good enough to compare"), scale
    length = max(np.abs(own).max(), np.abs(u).max(), HISTORY / ANSWER * scale[1])
    if length == 0.0:
        return Verdict("right", ""), scale
    apart = without(u - own, step.loose)
    by = np.abs(apart).max() / length
    # ‖Ku − f‖₂ may be the tolerance times ‖f‖₂: what that moves, twice.
    norm = np.linalg.norm(step.discrete.element_sizes(step.zeta, own)[0]) + np.linalg.norm(step.f)
    norm = max(norm, HISTORY * scale[0])
    move = 2 * TOLERANCE * norm * step.sensitivity()
    rounding = step.discrete.element_sizes(step.zeta, own)[1]
    energy, whole = apart @ (step.k @ apart), own @ (step.k @ own)
    floor = 1e-14 * (np.abs(own) @ rounding) + TOLERANCE * norm * move
    strain = np.sqrt(max(energy, 0.0) / max(whole, np.finfo(float).tiny))
    figures = f"u differs by {by:.1e}, strains by {strain:.1e}"
    if by > ANSWER and by * length > move or energy > ENERGY**2 * whole + floor:
        return Verdict("wrong", figures, by), scale
    return Verdict("imprecise" if by > ANSWER else "right", figures, by), scale


def read_frames(mesh, out):
    """(time, u, ζ, largest difference at nodes that several pieces share) of every frame, nodes as
    in `mesh`; pieces are matched triangle by triangle, as slits have two nodes at one point."""
    place = {key(mesh.nodes[t]): t for t in mesh.triangles}
    frames = []
    collection = out / "fields.pvd"
    if not collection.exists():
        return frames
    for entry in ElementTree.parse(collection).iter("DataSet"):
        path = out / entry.get("file")
        pieces = [path]
        if path.suffix == ".pvtu":
            tree = ElementTree.parse(path)
            pieces = [out / piece.get("Source") for piece in tree.iter("Piece")]
        values, apart, seen = np.full((len(mesh.nodes), 3), np.nan), 0.0, 0
        for piece in pieces:
            data = meshio.read(piece)
            field = np.column_stack([data.point_data["displacement"][:, :2], data.point_data["zeta"]])
            for cell in np.vstack([b.data for b in data.cells]):
                nodes = place[key(data.points[cell, :2])]
                # Both lists in the order of their points.
                a, b = (order(points) for points in (mesh.nodes[nodes], data.points[cell, :2]))
                old, new = values[nodes[a]], field[cell[b]]
                apart = max(apart, np.nanmax(np.abs(old - new), initial=0.0))
                values[nodes[a]] = new
                seen += 1
        if seen != len(mesh.triangles):
            values[:] = np.nan
        frames.append((float(entry.get("timestep")), values[:, :2].ravel(), values[:, 2], apart))
    return frames


def key(points):
    """A triangle by the coordinates of its corners."""
    return tuple(map(tuple, (points[order(points)] + 0.0).tolist()))


def order(points):
    """Corners sorted by their coordinates."""
    return np.lexsort((points[:, 1], points[:, 0]))


def message(output):
    """The error of a run without its numbers, so that like errors count together."""
    text = " ".join(output.split())
    text = text[text.find("error:"):] if "error:" in text else text[-200:]
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", text)[:200]
