"""A scene as arrays for NGSolve, scikit-fem, GetFEM and numpy with CHOLMOD, and their answers.

The peers solve the discrete problem of signorini on the same mesh: P1, contact at nodes, uniform steps.
They get mesh, loads and bounds ready and write no fields. peer_ngsolve.py, peer_skfem.py and peer_getfem.py say how a
user of each program would write the rest, with the fastest solver and contact method of its manual that we found.
peer_numpy.py says how a user who knows the method would write it without such a program.

An unknown is 2·node + axis. The file has the arrays

points, triangles         the mesh
fixed                     unknowns whose value is 0
contact, sign, gap        unknowns with sign·u ≤ gap; the gap per step
loaded, load              unknowns with a load; the load per step
lame                      λ and μ of plane stress or strain
damage                    the values of `DAMAGE_KEYS` and the step; zeros without damage
two_step                  whether the steps are two-step differences (scheme "bdf2"), not Euler's
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from shared import ROOT
from discrete import Discrete
from scene import DAMAGE, SceneError, displacement_order, read_scene
from triangulation import read_triangulation

# Script, Python and module of each peer. `make deps-peers` installs them.
VENV = ROOT / ".venv-peers" / "bin" / "python"
PEERS = {"NGSolve": ("peer_ngsolve.py", VENV, "ngsolve"), "scikit-fem": ("peer_skfem.py", VENV, "skfem"),
         "GetFEM": ("peer_getfem.py", Path("/usr/bin/python3"), "getfem"),
         "numpy + CHOLMOD": ("peer_numpy.py", VENV, "sksparse.cholmod")}
DAMAGE_KEYS = ("diffusion", "lambda_d", "lambda_u", "lambda_w", "strain_cap", "threshold")
# Relative differences below this are rounding.
ZERO = 1e-12


def installed():
    """The peers that are installed. The others are named."""
    found = []
    for name, (_, python, module) in PEERS.items():
        if python.exists() and subprocess.run([python, "-c", f"import {module}"], capture_output=True).returncode == 0:
            found.append(name)
        else:
            print(f"left out: {name}, which is not installed; run: make deps-peers", file=sys.stderr, flush=True)
    return found


def command(peer, path, *fields):
    """The command of a peer for a file of arrays. Its last line of output is the answer in JSON. It writes u and ζ of the
    last step to the file `fields`, if one is given."""
    script, python, _ = PEERS[peer]
    return [python, ROOT / "validation" / script, path, *fields]


def write_problem(path, scene, mesh, steps):
    """Writes the arrays of a scene file and a mesh file. A SceneError says why the peers cannot follow the scene."""
    scene, mesh = read_scene(scene), read_triangulation(mesh)
    if displacement_order(scene) != 1:
        raise SceneError("the peers have linear displacements only")
    grid = scene.get("time", {"step": 0.0, "scheme": "euler"})
    if isinstance(grid["step"], str):
        raise SceneError("the peers make uniform steps alone")
    # The arrays do not depend on the scheme.
    discrete = Discrete({**scene, "time": {**grid, "scheme": "euler"}} if "time" in scene else scene, mesh)
    step = float(grid["step"])
    times = step * np.arange(steps + 1) if "time" in scene else [1.0]
    rows, prescribed = ([of(t) for t in times] for of in (discrete.contact_rows, discrete.prescribed_rows))
    if any(np.any(row.value) for row in prescribed):
        raise SceneError("the peers prescribe no displacement but 0")
    (fixed, _), (contact, sign) = unknowns(prescribed[0]), unknowns(rows[0])
    free, (x, y) = ~np.isin(contact, fixed), mesh.nodes.T
    rigid = np.stack([[np.ones_like(x), np.zeros_like(x), -y], [np.zeros_like(x), np.ones_like(x), x]]).transpose(2, 0, 1)
    if np.linalg.matrix_rank(rigid.reshape(-1, 3)[np.concatenate((fixed, contact))]) < 3:
        raise SceneError("the peers need a body without a free rigid motion")
    law = {**dict.fromkeys(DAMAGE_KEYS, 0.0), **DAMAGE, **scene.get("damage", {})}
    if law["mass"] != "consistent" or str(law["initial"]) not in ("1", "1.0") or any(
            isinstance(value, dict) for value in law.values()):
        raise SceneError("the peers know one law of damage, its consistent mass, and ζ = 1 at the start")
    stiffness = discrete.d.reshape(-1, 3, 3)
    if np.ptp(stiffness, axis=0).max() > ZERO * stiffness.max():
        raise SceneError("the peers know one material")
    load = np.array([discrete.load(t) for t in times])
    loaded = np.flatnonzero(load.any(0))
    np.savez(path, points=mesh.nodes, triangles=mesh.triangles.astype(np.int32), fixed=np.unique(fixed),
             contact=contact[free], sign=sign[free], gap=np.array([row.value for row in rows])[:, free],
             loaded=loaded, load=load[:, loaded], lame=stiffness[0, [0, 2], [1, 2]],
             damage=[*(float(law[key]) for key in DAMAGE_KEYS), step],
             two_step=grid.get("scheme", "bdf2") == "bdf2")


def unknowns(rows):
    """The unknowns of rows along the axes, and the signs of their directions."""
    axis = np.abs(rows.direction).argmax(1)
    along = rows.direction[np.arange(len(axis)), axis]
    if np.any(np.abs(along) < 1.0 - ZERO):
        raise SceneError("the peers know only conditions along x or y")
    return 2 * rows.node + axis, np.sign(along)


def answer(output):
    """The answer of a peer from its output."""
    return json.loads(output.strip().splitlines()[-1])
