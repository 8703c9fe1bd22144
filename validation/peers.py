"""A scene as arrays for NGSolve, scikit-fem and GetFEM, and their answers.

The peers solve the discrete problem of signorini on the same mesh: P1, contact at nodes, steps of the paper's scheme.
They get mesh, loads and bounds ready and write no fields. peer_ngsolve.py, peer_skfem.py and peer_getfem.py say how a
user of each program would write the rest, with the fastest solver and contact method of its manual that we found.

An unknown is 2·node + axis. The file has the arrays

points, triangles         the mesh
fixed                     unknowns whose value is 0
contact, sign, gap        unknowns with sign·u ≤ gap; the gap per step
loaded, load              unknowns with a load; the load per step
lame                      λ and μ of plane stress or strain
damage                    the values of `DAMAGE_KEYS` and the step; zeros without damage
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
         "GetFEM": ("peer_getfem.py", Path("/usr/bin/python3"), "getfem")}
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


def command(peer, path):
    """The command of a peer for a file of arrays. Its last line of output is the answer in JSON."""
    script, python, _ = PEERS[peer]
    return [python, ROOT / "validation" / script, path]


def write_problem(path, scene, mesh, steps):
    """Writes the arrays of a scene file and a mesh file. A SceneError says why the peers cannot follow the scene."""
    scene, mesh = read_scene(scene), read_triangulation(mesh)
    if displacement_order(scene) != 1:
        raise SceneError("the peers have linear displacements only")
    discrete = Discrete(scene, mesh)
    step = float(scene["time"]["step"]) if "time" in scene else 0.0
    times = step * np.arange(steps + 1) if "time" in scene else [1.0]
    rows, prescribed = ([of(t) for t in times] for of in (discrete.contact_rows, discrete.prescribed_rows))
    if any(np.any(row.value) for row in prescribed):
        raise SceneError("the peers prescribe no displacement but 0")
    (fixed, _), (contact, sign) = unknowns(prescribed[0]), unknowns(rows[0])
    free = ~np.isin(contact, fixed)
    law = {**dict.fromkeys(DAMAGE_KEYS, 0.0), **DAMAGE, **scene.get("damage", {})}
    if law["mass"] != "consistent" or str(law["initial"]) not in ("1", "1.0") or any(
            isinstance(law[key], dict) for key in DAMAGE_KEYS):
        raise SceneError("the peers know one law of damage, its consistent mass, and ζ = 1 at the start")
    stiffness = discrete.d.reshape(-1, 3, 3)
    if np.ptp(stiffness, axis=0).max() > ZERO * stiffness.max():
        raise SceneError("the peers know one material")
    load = np.array([discrete.load(t) for t in times])
    loaded = np.flatnonzero(load.any(0))
    np.savez(path, points=mesh.nodes, triangles=mesh.triangles.astype(np.int32), fixed=np.unique(fixed),
             contact=contact[free], sign=sign[free], gap=np.array([row.value for row in rows])[:, free],
             loaded=loaded, load=load[:, loaded], lame=stiffness[0, [0, 2], [1, 2]],
             damage=[*(float(law[key]) for key in DAMAGE_KEYS), step])


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
