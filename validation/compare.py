#!/usr/bin/python3
"""Compares signorini with FEniCSx, node by node.

    /usr/bin/python3 validation/compare.py --binary target/release/signorini \
        geo/square-mild.toml geo/lshape.toml geo/bridge-half.toml

Both programs read the same mesh file and a scene derived from the given one:

elastic   contact removed, no damage: one static solve at t = 1;
contact   the gap as given, no damage: one static solve at t = 1, with each contact solver;
damage    the whole scheme (25)–(28) in a few steps, compared at each, with each contact solver;

each with displacements of order 1 and 2, on a mesh of the same order.

Every time must agree, also in the number of active nodes; differences are relative to the largest
value of all times, and the largest is shown.
The bodies must be supported: a scene whose solution is not unique cannot be compared.
Exit code 1 if any case fails.
"""

import copy
import itertools
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

try:
    from fenicsx import ContactError, evolve
except ImportError as error:
    sys.exit(f"{error}: the comparison needs FEniCSx; run `make deps-validate`")
from shared import parser_of
from lagrange import Lagrange
from frames import read_frames
from results import ResultError, read_table
from scene import SceneError, of_order, read_scene, solvers, write_scene
from triangulation import mesh_geometry, read_triangulation

TOLERANCE = {"elastic": 1e-10, "contact": 1e-8, "damage": 1e-8}
# The tolerance for a traction with a kink in x or y, which the program integrates to about 1e-6.
KINK = re.compile(r"\b(min|max|abs|if)\b")
KINKED = 2e-6
COLUMNS = (
    "scene", "case", "order", "solver", "nodes", "steps", "active", "|Δu|/|u|", "|Δζ|", "ΔR/R",
    "tolerance", "verdict",
)


class RunError(Exception):
    """The program failed, or its output has not the expected form."""


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
    # A boundary with a name only has no condition.
    scene["boundary"] = [b for b in scene["boundary"] if len(b) > 1]
    return scene


def in_few_steps(scene, steps):
    """The scene with its time interval cut into `steps`."""
    scene = copy.deepcopy(scene)
    scene["time"]["step"] = scene["time"]["end"] / steps
    return scene


def program(binary, scene, space, directory, solver=None):
    """signorini's answers from its files: per accepted time a frame, with values at the nodes of `space`, the contact
    force and the number of active nodes."""
    path, out = directory / "scene.toml", directory / "out"
    shutil.rmtree(out, ignore_errors=True)  # the answer to an earlier case must not be read
    write_scene({**scene, "output": {"every": 1}}, path)
    command = [str(binary), "run", str(path), "--out", str(out)]
    # No rescue: it would hide the failure of a solver.
    command += ["--solver", solver, "--set", "contact.rescue=false"] if solver else []
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=1800)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"{binary}: {error}") from None
    if done.returncode != 0:
        said = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
        raise RunError(next((line for line in said if line.startswith("error:")), said[-1]))
    try:
        rows, frames = read_table(out / "history.csv"), read_frames(space, out)
    except (OSError, ValueError, KeyError, ResultError) as error:
        raise RunError(f"the output cannot be read: {error!r}") from None
    if len(rows) != len(frames):
        raise RunError(f"{len(frames)} frames, but {len(rows)} rows of history.csv")
    return [(frame, row["contact_force"], int(row["active_nodes"])) for frame, row in zip(frames, rows)]


def differences(exact, answers):
    """The largest differences over all times: |Δu| and ΔR relative to the largest |u| and R of all times, and |Δζ|."""
    times, expected = [frame.time for frame, *_ in answers], [state.time for state in exact]
    if len(times) != len(expected) or not np.allclose(times, expected, rtol=1e-9, atol=1e-9):
        raise RunError(f"{len(times)} times up to {times[-1]:g}, FEniCSx's are {len(expected)} "
                       f"up to {expected[-1]:g}")

    def largest(vectors):
        return np.linalg.norm(vectors, axis=1).max()

    du, dzeta, dforce = 0.0, 0.0, 0.0
    for state, (frame, force, active) in zip(exact, answers):
        if state.active != active:
            raise RunError(f"{active} nodes are active at t = {frame.time:g}, FEniCSx's are {state.active}")
        # np.fmax would hide a missing value.
        du = np.maximum(du, largest(frame.u.reshape(-1, 2) - state.displacement))
        dzeta = np.maximum(dzeta, max(np.abs(frame.zeta - state.zeta).max(), frame.apart))
        dforce = max(dforce, abs(force - state.contact_force))
    force = max(abs(state.contact_force) for state in exact)
    du /= max(largest(state.displacement) for state in exact)
    return du, dzeta, dforce / force if force > 0.0 else dforce


def cases(scene, mesh, arguments):
    """(case, derived scene, contact solvers) for one scene."""
    yield "elastic", without_contact(scene, mesh), [None]
    yield "contact", static(scene), arguments.solvers
    if "damage" in scene and "time" in scene:
        yield "damage", in_few_steps(scene, arguments.steps), arguments.solvers


def compare(path, order, arguments):
    """Rows of the table for one scene with displacements of an order. A mesh made here has the same order. "active" are
    the smallest and the largest number of active nodes."""
    scene = of_order(read_scene(path), order)
    with tempfile.TemporaryDirectory() as directory:
        directory = Path(directory)
        source = path.parent / scene["mesh"]["file"]
        if source.suffix == ".geo":
            mesh_geometry(source, scene["mesh"], directory / "mesh.msh", order)
            source = directory / "mesh.msh"
        scene["mesh"] = {"file": str(source.resolve())}
        mesh = read_triangulation(source)
        if order == 2 and mesh.middles is None:
            raise SceneError(f"{source} is of order 1; name a .geo, or --orders 1")
        for case, derived, solvers in cases(scene, mesh, arguments):
            kinked = any(KINK.search(str(b.get("traction"))) for b in derived["boundary"])
            tolerance = KINKED if kinked else TOLERANCE[case]
            space, exact = Lagrange(mesh, order), list(evolve(derived, mesh))
            for solver in solvers:
                active = sorted({state.active for state in exact})
                row = (path.stem, case, str(order), solver or "–", str(len(space.points)),
                       str(len(exact) - 1),
                       "–".join(str(a) for a in dict.fromkeys((active[0], active[-1]))))
                try:
                    errors = differences(exact, program(arguments.binary, derived, space, directory, solver))
                except RunError as error:
                    yield False, (*row, "–", "–", "–", f"{tolerance:.0e}", f"FAILED: {error}")
                    continue
                good = all(error <= tolerance for error in errors)
                numbers = (f"{error:.1e}" for error in errors)
                yield good, (*row, *numbers, f"{tolerance:.0e}", "ok" if good else "FAILED")


def main():
    parser = parser_of(__doc__)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("--solvers", nargs="+", help="contact solvers [default: all]")
    parser.add_argument("--orders", nargs="+", type=int, choices=[1, 2], default=[1, 2], help="of the displacements")
    parser.add_argument("--steps", type=int, default=20, help="time steps of the damage case")
    arguments = parser.parse_args()
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
