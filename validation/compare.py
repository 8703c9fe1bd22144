#!/usr/bin/python3
"""Compares signorini with FEniCSx, node by node.

    /usr/bin/python3 validation/compare.py --binary target/release/signorini \
        geo/square-mild.toml geo/lshape.toml geo/bridge-half.toml

Both programs read the same mesh file and a scene derived from the given one:

elastic   contact removed, no damage: one static solve at t = 1;
contact   the gap as given, no damage: one static solve at t = 1, with each contact solver;
damage    the whole scheme (25)–(28) in a few steps, compared at each, with each contact solver;

each with displacements of order 1 and 2. Where the program sets the middles of edges itself,
because the mesh file does not have them, FEniCSx is given the same.

Every time must agree, also in the number of active nodes; differences are relative to the largest
value of all times, and the largest is shown.
The bodies must be supported: a scene whose solution is not unique cannot be compared.
Exit code 1 if any case fails.
"""

import argparse
import copy
import itertools
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

try:
    from fenicsx import ContactError, evolve
except ImportError as error:
    sys.exit(f"{error}: the comparison needs FEniCSx; run `make deps-validate`")
import shared  # noqa: F401
from lagrange import Lagrange
from reading import frames_of, read_frame
from results import ResultError, read_table
from scene import SceneError, displacement_order, of_order, read_scene, solvers, write_scene
from triangulation import mesh_geometry, read_triangulation

TOLERANCE = {"elastic": 1e-10, "contact": 1e-8, "damage": 1e-8}
# The same where a traction has a kink in x or y: the program integrates it to about 1e-6.
KINK = re.compile(r"\b(min|max|abs|if)\b")
KINKED = 2e-6
COLUMNS = (
    "scene", "case", "order", "solver", "nodes", "steps", "active", "|Δu|/|u|", "|Δζ|", "ΔR/R",
    "tolerance", "verdict",
)


@dataclass
class Answer:
    """What is compared at an accepted time: fields at the nodes of u, contact force, active nodes;
    and the elements, nodes as VTK numbers them."""

    time: float
    elements: np.ndarray
    nodes: np.ndarray
    displacement: np.ndarray
    zeta: np.ndarray
    contact_force: float
    active: int


class RunError(Exception):
    """The program did not run, or its output is not as agreed."""


def static(scene):
    """The scene without damage and time: one solve at t = 1."""
    return {key: value for key, value in scene.items() if key not in ("damage", "time")}


def without_contact(scene, mesh):
    """The elastic scene: gaps dropped, or prescribed as zero if nothing else supports the body."""
    scene = copy.deepcopy(static(scene))
    scene.pop("contact", None)
    supported = any("displacement" in boundary for boundary in scene["boundary"])
    for boundary in scene["boundary"]:
        if boundary.pop("gap", None) is None:
            continue
        normal = np.abs(mesh.outward_normals(boundary["name"])[0]).mean(axis=0)
        boundary.pop("normal", None)
        if not supported:
            boundary["displacement"] = ["free", "0"] if normal[1] > normal[0] else ["0", "free"]
    # A boundary that is left with its name alone says nothing.
    scene["boundary"] = [b for b in scene["boundary"] if len(b) > 1]
    return scene


def in_few_steps(scene, steps):
    """The scene with its time interval cut into `steps`."""
    scene = copy.deepcopy(scene)
    scene["time"]["step"] = scene["time"]["end"] / steps
    return scene


def reference(scene, mesh):
    """FEniCSx's answers, one for each accepted time."""
    space = Lagrange(mesh, displacement_order(scene))
    return [Answer(state.time, space.elements, space.points, state.displacement, space.spread(state.zeta),
                   state.contact_force, state.active) for state in evolve(scene, mesh)]


def with_middles(mesh, answer):
    """The triangulation with the middles of sides as in an answer of order 2."""
    vertices, middles = np.split(answer.nodes[answer.elements], [3], axis=1)
    if middles.shape != vertices.shape:
        raise RunError("the triangles written are not of order 2")
    if not np.array_equal(vertices, mesh.nodes[mesh.triangles]):
        raise RunError("the triangles written are not those of the mesh")
    return replace(mesh, middles=middles)


def program(binary, scene, directory, solver=None):
    """signorini's answers, one for each accepted time, from the files it writes."""
    path, out = directory / "scene.toml", directory / "out"
    shutil.rmtree(out, ignore_errors=True)  # never read the answer to an earlier case
    write_scene({**scene, "output": {"every": 1}}, path)
    command = [str(binary), "run", str(path), "--out", str(out)]
    # Each solver by itself: a rescue would hide that it failed.
    command += ["--solver", solver, "--set", "contact.rescue=false"] if solver else []
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=1800)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"{binary}: {error}") from None
    if done.returncode != 0:
        said = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
        raise RunError(next((line for line in said if line.startswith("error:")), said[-1]))
    try:
        rows, frames = read_table(out / "history.csv"), frames_of(out)
        if len(rows) != len(frames):
            raise RunError(f"{len(frames)} frames, but {len(rows)} rows of history.csv")
        fields = [read_frame(path) for _, path in frames]
        return [Answer(time, np.vstack([block.data for block in field.cells]), field.points[:, :2],
                       field.point_data["displacement"][:, :2], np.ravel(field.point_data["zeta"]),
                       row["contact_force"], int(row["active_nodes"]))
                for (time, _), field, row in zip(frames, fields, rows)]
    except (OSError, KeyError, ResultError) as error:
        raise RunError(f"the output cannot be read: {error!r}") from None


def same_order(ours, theirs):
    """Indices that bring `theirs` into the order of `ours`; the nodes must coincide."""
    if len(ours) != len(theirs):
        raise RunError(f"{len(theirs)} nodes written, {len(ours)} in the mesh")
    size = np.ptp(ours, axis=0).max()
    if np.abs(ours - theirs).max() <= 1e-12 * size:
        return np.arange(len(ours))
    a, b = (np.lexsort(np.round(points / size, 9).T) for points in (ours, theirs))
    order = np.empty(len(ours), np.int64)
    order[a] = b
    if np.abs(ours - theirs[order]).max() > 1e-9 * size:
        raise RunError("the nodes written are not those of the mesh")
    return order


def differences(exact, answers):
    """The largest of all times: |Δu| and ΔR over the largest |u| and R of all times, and |Δζ|."""
    times, expected = ([a.time for a in run] for run in (answers, exact))
    if len(times) != len(expected) or not np.allclose(times, expected, rtol=1e-9, atol=1e-9):
        raise RunError(f"{len(times)} times up to {times[-1]:g}, FEniCSx's are {len(expected)} "
                       f"up to {expected[-1]:g}")
    order = same_order(exact[0].nodes, answers[0].nodes)

    def largest(vectors):
        return np.linalg.norm(vectors, axis=1).max()

    du, dzeta, dforce = 0.0, 0.0, 0.0
    for ours, theirs in zip(answers, exact):
        if ours.active != theirs.active:
            raise RunError(f"{ours.active} nodes are active at t = {ours.time:g}, "
                           f"FEniCSx's are {theirs.active}")
        du = max(du, largest(ours.displacement[order] - theirs.displacement))
        dzeta = max(dzeta, np.abs(ours.zeta[order] - theirs.zeta).max())
        dforce = max(dforce, abs(ours.contact_force - theirs.contact_force))
    force = max(abs(answer.contact_force) for answer in exact)
    du /= max(largest(answer.displacement) for answer in exact)
    return du, dzeta, dforce / force if force > 0.0 else dforce


def cases(scene, mesh, arguments):
    """(case, derived scene, contact solvers) for one scene."""
    yield "elastic", without_contact(scene, mesh), [None]
    yield "contact", static(scene), arguments.solvers
    if "damage" in scene and "time" in scene:
        yield "damage", in_few_steps(scene, arguments.steps), arguments.solvers


def compare(path, order, arguments):
    """Rows of the table for one scene with displacements of an order; a mesh made here is of the
    same. "active" are the least and the most active nodes."""
    scene = of_order(read_scene(path), order)
    with tempfile.TemporaryDirectory() as directory:
        directory = Path(directory)
        source = path.parent / scene["mesh"]["file"]
        if source.suffix == ".geo":
            mesh_geometry(source, scene["mesh"], directory / "mesh.msh", order)
            source = directory / "mesh.msh"
        scene["mesh"] = {"file": str(source.resolve())}
        mesh = read_triangulation(source)
        for case, derived, solvers in cases(scene, mesh, arguments):
            kinked = any(KINK.search(str(b.get("traction"))) for b in derived["boundary"])
            tolerance = KINKED if kinked else TOLERANCE[case]
            if order == 2 and mesh.middles is None:
                mesh = with_middles(mesh, program(arguments.binary, derived, directory)[0])
            exact = reference(derived, mesh)
            for solver in solvers:
                active = sorted({answer.active for answer in exact})
                row = (path.stem, case, str(order), solver or "–", str(len(exact[0].nodes)),
                       str(len(exact) - 1),
                       "–".join(str(a) for a in dict.fromkeys((active[0], active[-1]))))
                try:
                    errors = differences(
                        exact, program(arguments.binary, derived, directory, solver)
                    )
                except RunError as error:
                    yield False, (*row, "–", "–", "–", f"{tolerance:.0e}", f"FAILED: {error}")
                    continue
                good = max(errors) <= tolerance
                numbers = (f"{error:.1e}" for error in errors)
                yield good, (*row, *numbers, f"{tolerance:.0e}", "ok" if good else "FAILED")


def main():
    parser = argparse.ArgumentParser(description="Compare signorini with FEniCSx.")
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--binary", type=Path, default=Path("target/release/signorini"))
    parser.add_argument("--solvers", nargs="+", help="contact solvers [default: all]")
    parser.add_argument("--orders", nargs="+", type=int, choices=[1, 2], default=[1, 2],
                        help="of the displacements")
    parser.add_argument("--steps", type=int, default=20, help="time steps of the damage case")
    arguments = parser.parse_args()
    arguments.binary = arguments.binary.resolve()
    if not arguments.binary.is_file():
        sys.exit(f"{arguments.binary} does not exist: build it first, or name it with --binary")
    arguments.solvers = arguments.solvers or solvers(arguments.binary)
    line = "{:<14} {:<8} {:>5} {:<16} {:>6} {:>6} {:>7}  {:>9} {:>9} {:>9}  {:>9}  {}"
    print(line.format(*COLUMNS))
    failed = False
    for path, order in itertools.product(arguments.scenes, sorted(arguments.orders)):
        try:
            for good, row in compare(path, order, arguments):
                failed |= not good
                print(line.format(*row), flush=True)
        except (SceneError, ContactError, RunError) as error:
            failed = True
            print(f"{path.stem}: {error}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
