"""Verifies the results of a run: right, refused (rightly or not), wrong.

There are two tests of the displacement. (i) It satisfies the contact rows and the prescribed values, and Ku − f at
every node is a force that these conditions can exert: zero without conditions, otherwise in the cone of the touching
normals. (ii) It equals the solution of `variational.py`, in the largest displacement and in the energy, up to motions
that the problem leaves open. The damage must satisfy (28) from the previous frame.
"""

import json
import re
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from discrete import Discrete, varies
from frames import read_frames
from expressions import Expression
from scene import read_scene
from triangulation import read_triangulation
from variational import Step, along, without

FORCE = 1e-8  # residual forces, relative to the largest sum of absolute element forces at a node
LOADS = 2e-6  # the same for tractions that the program integrates to 1e-6: on curved sides, or functions of x and y
PLACE = 1e-8  # violations of gaps, relative to the largest displacement
TOUCH = 1e-6  # at smaller gaps, relative to it, a force is allowed: u has this accuracy
ANSWER = 1e-6  # displacements, relative
ENERGY = 1e-4  # strains in the energy norm, relative
PAST = 0.1  # a load may cross zero: scales are at least this part of the largest ones so far
TOLERANCE = 1e-10  # KKT tolerance of a run; relative limits are for this and grow with it
DAMAGE = 1e-8
EPSILON = np.finfo(float).eps


@dataclass
class Verdict:
    """A word, a reason, and the largest relative difference of u. The words: `right`; `refused rightly`; `either`:
    solving and refusing are both right; `gave up`: a solver failed on a scene without a solution; `imprecise`: an error
    within the residuals, without a note; `refused wrongly`; `wrong`."""

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
    """Compares the exit code with the expectation, then verifies the frames."""
    refusal, either = expectation(discrete)
    said = message(output)
    summary = json.loads((out / "summary.json").read_text()) if code == 0 else {}
    stopped = summary.get("stopped_at")
    if summary.get("stopped_by") == "collapse":
        refusal = None
        if fault := judge_collapse(discrete, stopped):
            return Verdict("either" if either else "wrong", fault)
    elif stopped is not None and (refusal or "").startswith("driven") and stopped <= float(refusal.rpartition(" ")[2]):
        refusal = None  # it stopped at ζ_* before
    if code == 2 and (refusal or "").startswith("driven") and stands(discrete):
        return Verdict("either" if either else "refused wrongly", f"it stands at first: {said}")
    if code == 2:
        if either:
            return Verdict("either", said)
        return Verdict("refused rightly" if refusal else "refused wrongly", refusal or said)
    if code not in (0, 1):
        return Verdict("wrong", f"exit code {code}: {said}")
    if refusal and not either:
        word = "gave up" if code == 1 else "wrong"
        return Verdict(word, f"should be refused ({refusal}), exit code {code}")
    frames = read_frames(discrete.space, out)
    if not frames and code == 0:
        return Verdict("wrong", "no frames")
    found = judge_frames(discrete, frames, output)
    if found.word == "wrong":
        return found
    if code == 1:
        why, excused = missed(discrete, frames)
        return Verdict("either" if excused else "refused wrongly", said + why)
    return judge_stop(discrete, frames, summary) or found


def judge_collapse(discrete, time):
    """The fault of the `time` of a collapse, if any: the load must be balanced just before and not just after."""
    zeta, apart = np.ones(len(discrete.mesh.nodes)), 4e-6 * float(discrete.scene["time"]["end"])
    before, after = (Step(discrete, zeta, t).driven for t in (time - apart, time + apart))
    if before > 1e-7 or after < 1e-11:
        return f"collapse at t = {time:g}: unbalanced {before:.1e} before, {after:.1e} after"
    return ""


def stands(discrete):
    """Whether the load of a run is balanced for a while."""
    if "time" not in discrete.scene:
        return False
    end, zeta = float(discrete.scene["time"]["end"]), np.ones(len(discrete.mesh.nodes))
    return all(Step(discrete, zeta, part * end).driven < 1e-11 for part in (0.0, 1e-5, 1e-4))


def missed(discrete, frames):
    """A description of the step at which a solver failed, and whether rounding errors above the tolerance explain the
    failure."""
    damaged = "damage" in discrete.scene
    if frames:
        last = frames[-1]
        zeta, later = last.zeta, [t for t in times(discrete.scene) if t > last.time * (1 + 1e-9)]
        if not later:
            return "", False
        if damaged:
            zeta, _ = discrete.damage_step(last.u, zeta, later[0] - last.time)
    else:
        later, zeta = times(discrete.scene), initial(discrete)
    step = Step(discrete, zeta, later[0])
    own = step.solve()
    forces, places, (force, _) = residuals(step, own)
    level = 1e-16 * discrete.element_sizes(zeta, own)[1].max() / (force or 1.0)
    excused = level > TOLERANCE * ease(discrete)
    if forces > FORCE or places > PLACE:
        return " (nor has the judge a good answer)", level > 0.1 * TOLERANCE * ease(discrete)
    return " (rounding alone is near the tolerance)" if level > 0.01 * TOLERANCE else "", excused


def times(scene):
    """The times of the contact steps."""
    if "time" not in scene:
        return [1.0]
    end, step = (float(scene["time"][key]) for key in ("end", "step"))
    count = round(end / step)
    return [end * n / count for n in range(count + 1)]


def initial(discrete):
    """ζ₀ at the nodes."""
    damaged = "damage" in discrete.scene
    return Expression(discrete.law["initial"] if damaged else 1.0).at(discrete.mesh.nodes)


def traits(discrete):
    """The unusual features of a scene, as words for statistics."""
    rows, words = discrete.contact, []
    prescribed = {node for node, _, _ in discrete.prescribed}
    for node in np.unique(rows.node):
        n = rows.direction[rows.node == node]
        if len(n) > 1 and node not in prescribed:
            words.append("opposite" if (n @ n.T).min() < -0.99 else "corner")
        if len(n) > 2 or len(n) > 1 and node in prescribed:
            words.append("many rows")
    words += ["P2"] if discrete.order == 2 else []
    words += ["curved"] if discrete.space.curved() else []
    words += ["materials"] if len(discrete.mesh.surfaces) > 1 else []
    if (np.array([discrete.contact_rows(t).value for t in times(discrete.scene)]) < 0.0).any():
        words.append("presses")
    if any("t" in re.findall(r"\b[a-z]+\b", str(b.get("gap", ""))) for b in discrete.boundaries):
        words.append("moves")
    if "time" not in discrete.scene and "t" in re.findall(r"\b[a-z]+\b", str(discrete.scene)):
        words.append("static with t")
    return " ".join(sorted(set(words)))


def expectation(discrete):
    """The reason to refuse the scene, or None, and whether solving and refusing are both right."""
    reason, either = discrete.bad_input(times(discrete.scene))
    if reason:
        return reason, False
    zeta = np.ones(len(discrete.mesh.nodes))
    worst = None
    values = [discrete.prescribed_rows(t).value for t in times(discrete.scene)]
    size = max(np.abs(value).max(initial=0.0) for value in values)
    # The displacement of the loads alone: all prescribed values may be rounding errors.
    loads = max(np.abs(discrete.load(t)).sum() for t in times(discrete.scene))
    size = max(size, loads / discrete.young.mean())
    for t in times(discrete.scene):
        step = Step(discrete, zeta, t)
        for name, value, low, high in (
            ("prescribed values contradict", step.contradiction, 1e-11 * size, 1e-7 * size),
            ("prescribed through the obstacle", step.penetration, 1e-13 * size, 1e-9 * size),
            ("no room between obstacles", step.overlap, 1e-13 * size, 1e-9 * size),
            ("hardly room between obstacles", step.squeezed, 1e-13 * size, np.inf),
            ("driven", step.driven, 1e-11, 1e-7),
        ):
            if value > high:
                return f"{name} at t = {t:g}", either
            if value > low:
                worst, either = f"{name}, barely", True
    return worst, either


def judge_frames(discrete, frames, output):
    """Verifies every frame: the damage step, then the contact step."""
    worst, scale, before = Verdict("right", ""), (0.0, 0.0), None
    output = " ".join(output.split())  # a note has several lines
    damaged = "damage" in discrete.scene
    start = initial(discrete)
    for frame in frames:
        expected, allowed = start if before is None else before.zeta, DAMAGE
        if before is not None and damaged:
            expected, unsure = discrete.damage_step(before.u, before.zeta, frame.time - before.time)
            allowed += unsure
        off = np.abs(frame.zeta - expected).max()
        if not np.isfinite(frame.u).all() or not off <= allowed or frame.apart:
            reason = f"ζ differs by {off:.1e}, ranks by {frame.apart:.1e}, or values are missing"
            return Verdict("wrong", f"t = {frame.time:g}: {reason}")
        step = Step(discrete, frame.zeta, frame.time)
        found, scale = judge_step(step, frame.u, scale)
        if found.word == "moved":  # by a small force: right if the program notes it
            told = re.search(r"exact only to about (\S+) of", output)
            told = "one of many" in output or told and found.difference < 10 * float(told[1])
            found.word = "right" if told else "wrong"
        found.reason = f"t = {frame.time:g}: {found.reason}"
        if found.word == "right" and (fault := shown(step, frame, scale)):
            found = Verdict("wrong", f"t = {frame.time:g}: {fault}")
        if found.word == "wrong":
            return found
        if found.word == "imprecise" or found.difference > worst.difference:
            worst = found
        before = frame
    told = re.search(r"exact only|is unknown, as|one of many", output)
    if worst.word == "imprecise" and told:
        worst.word = "right"
    return worst


def shown(step, frame, scale):
    """The errors of the written gap and pressure. The gap is the smallest g − u·ν of a node's rows. In P1 the pressure is
    the nodal reaction over the tributary length, at nodes with one row and one material and without prescribed values."""
    rows, (force, length) = step.rows, scale
    slack = np.full(len(frame.gap), np.inf)
    np.minimum.at(slack, rows.node, rows.value - along(rows, frame.u))
    seen = np.isfinite(frame.gap)
    if (np.abs(frame.gap - slack)[seen] > PLACE * length + 1e-14 * slack[seen]).any():
        return "the gap field is not what the displacement leaves"
    single = np.bincount(rows.node, minlength=len(seen)) == 1
    single[step.prescribed.node] = False
    elements, stiffness = step.discrete.elements, step.discrete.d
    kinds = np.unique(stiffness.reshape(len(stiffness), -1), axis=0, return_inverse=True)[1].reshape(-1, 1)
    least, largest = np.full(len(seen), len(kinds)), np.full(len(seen), -1)
    np.minimum.at(least, elements, kinds)
    np.maximum.at(largest, elements, kinds)
    single &= least == largest
    if not seen[single].all():
        return "the gap field lacks a node of Γ_C"
    reaction = along(rows, step.f - step.k @ frame.u)
    past = np.abs(frame.u) + PAST * length
    rounding = step.discrete.element_sizes(step.zeta, past)[1].reshape(-1, 2).sum(1)
    off = np.abs(frame.pressure[rows.node] * rows.weight - reaction) - 1e-14 * rounding[rows.node]
    allowed = FORCE + LOADS * inexact(step.discrete)
    if step.discrete.order == 1 and (off[single[rows.node]] > allowed * ease(step.discrete) * force).any():
        return "the pressure field is not the nodal reaction over its length"
    off_contact = np.setdiff1d(np.arange(len(seen)), rows.node)
    if frame.pressure[off_contact].any() or seen[off_contact].any():
        return "pressure or gap off Γ_C"
    return ""


def judge_stop(discrete, frames, summary):
    """Checks a stop at ζ_*; None if it is right or there is no stop."""
    if summary["stopped_by"] != "damage":
        return None
    stopped, last = summary["stopped_at"], frames[-1]
    zeta, unsure = discrete.damage_step(last.u, last.zeta, stopped - last.time)
    least = zeta.min()
    if least <= discrete.law["threshold"] + DAMAGE + unsure:
        return None
    return Verdict("wrong", f"stopped at ζ_* at t = {stopped:g}, but min ζ = {least:.3e}")


def inexact(discrete):
    """Whether the program integrates tractions to 1e-6 only."""
    tractions = [b["traction"] for b in discrete.boundaries if "traction" in b]
    return bool(tractions) and (discrete.space.curved() or any(map(varies, tractions)))


def ease(discrete):
    """The KKT tolerance of a scene over the usual one."""
    return discrete.scene.get("contact", {}).get("tolerance", TOLERANCE) / TOLERANCE


def residuals(step, u, scale=(0.0, 0.0)):
    """(forces, places): test (i), relative; and the scales (force, length) it used."""
    sizes, rounding = step.discrete.element_sizes(step.zeta, u)
    force = max((sizes + np.abs(step.f)).max(), PAST * scale[0])
    length = max(np.abs(u).max(), PAST * scale[1])
    easing = ease(step.discrete)
    slack = step.rows.value - along(step.rows, u)
    places = np.r_[-slack, np.abs(along(step.prescribed, u) - step.prescribed.value), 0.0].max()
    force, length = force or 1.0, length or 1.0
    reaction = (step.f - step.k @ u).reshape(-1, 2)
    off = np.linalg.norm(reaction, axis=1)
    touching = slack <= TOUCH * easing * length
    for node in np.unique(np.r_[step.rows.node[touching], step.prescribed.node]):
        d = step.prescribed.direction[step.prescribed.node == node]
        normals = step.rows.direction[(step.rows.node == node) & touching]
        off[node] = force * nnls(np.vstack([normals, d, -d]).T, reaction[node] / force)[1]
    # Element forces of a large rigid motion, now or before, are rounding; where a prescribed
    # displacement carries the body along, the scale of forces is what it would take alone.
    alone = np.abs(step.k @ step.lift).max()
    carried = 10 * TOLERANCE * easing * alone
    travelled = step.discrete.element_sizes(step.zeta, np.full_like(u, PAST * scale[1]))[1]
    # u = a rigid motion and a rest: near the motion's centre of rotation, too, u is exact to the
    # last digits of the largest displacement only.
    largest = step.discrete.element_sizes(step.zeta, np.full_like(u, np.abs(u).max()))[1]
    noise = (1e-14 * (rounding + travelled) + EPSILON * largest).reshape(-1, 2).sum(1)
    off = np.maximum(off - noise - carried, 0.0)
    return off.max() / force / easing, places / length / easing, (max(force, 0.1 * alone), length)


def judge_step(step, u, scale):
    """The verdict on u, and the largest (force, length) so far."""
    forces, places, size = residuals(step, u, scale)
    scale = max(scale[0], size[0]), max(scale[1], size[1])
    if forces > FORCE + LOADS * inexact(step.discrete) or places > PLACE:
        return Verdict("wrong", f"forces off by {forces:.1e}, gaps by {places:.1e}"), scale
    at_rest = not step.lift.any() and (step.b >= 0.0).all()
    if at_rest and np.abs(step.f).max() <= EPSILON * scale[0]:
        return Verdict("right", "no load but rounding: every admissible place will do"), scale
    own = step.solve()
    own_forces, own_places, _ = residuals(step, own, scale)
    noise = 1e-14 * step.discrete.element_sizes(step.zeta, own)[1].max()
    if own_forces > FORCE or own_places > PLACE or noise > 0.01 * scale[0]:
        return Verdict("right", "the judge's own answer is not good enough to compare"), scale
    length = max(np.abs(own).max(), np.abs(u).max(), PAST * scale[1])
    if length == 0.0:
        return Verdict("right", ""), scale
    apart = without(u - own, step.loose)
    by = np.abs(apart).max() / length
    # ‖Ku − f‖₂ may be the tolerance times ‖f‖₂: what that moves, twice.
    norm = np.linalg.norm(step.discrete.element_sizes(step.zeta, own)[0]) + np.linalg.norm(step.f)
    norm = max(norm, scale[0], np.linalg.norm(step.k @ step.lift))
    easing = ease(step.discrete)
    rounding = step.discrete.element_sizes(step.zeta, np.abs(u) + np.abs(own))[1]
    unsure = 2 * TOLERANCE * easing * norm + 1e-15 * np.linalg.norm(rounding)
    move = unsure * step.sensitivity()
    energy, whole = apart @ (step.k @ apart), own @ (step.k @ own)
    # rᵀK⁻¹r ≤ ‖r‖₂ √N max|K⁻¹r|
    rounding_energy = 1e-14 * ((np.abs(u) + np.abs(own)) @ rounding) + unsure * np.sqrt(len(u)) * move
    rounding_energy += (PAST * ANSWER) ** 2 * scale[0] * scale[1]
    strain = np.sqrt(max(energy, 0.0) / whole) if whole > 0.0 else 0.0
    figures = f"u differs by {by:.1e}, strains by {strain:.1e}"
    of_loads = LOADS * inexact(step.discrete) * np.linalg.norm(step.f) * step.sensitivity()
    allowed = ANSWER * easing + of_loads / length
    if energy > (ENERGY * easing) ** 2 * max(whole, 0.0) + rounding_energy:
        return Verdict("wrong", figures, by), scale
    sure = by * length > move and easing == 1.0
    word = "right" if by <= allowed else "moved" if sure else "imprecise"
    return Verdict(word, figures, by), scale


def message(output):
    """The error message of a run without numbers, to count equal errors."""
    lines = [line for line in output.splitlines() if line.startswith("error:")] or ["no error"]
    text = re.sub(r"[-+]?\d[\d.e+-]*", "#", lines[0].replace("scene.toml: ", ""))
    return re.sub(r" \(# times it\)| #(?=,|$)", "", text)[:160]
