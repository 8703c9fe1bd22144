#!/usr/bin/python3
"""Times the FEniCSx loop for the chart of speed against accuracy: timing.py SCENE FOLDER [ORDER…]

Runs loop.py on uniform meshes of n cells a side to T = 1 with displacements of each order (the
scene's, unless given), each run in a process of its own, and writes
FOLDER/fenicsx.csv: the seconds of mesh, set-up and all steps (not of starting Python and PETSc,
nor of compiling the forms: a first run is not counted), and what the answer is known by.
"""

import csv
import itertools
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from scene import displacement_order, of_order, read_scene, write_scene
from triangulation import mesh_geometry

CELLS = (8, 16, 32, 64, 128)
STEPS = (0.1, 0.05, 0.02, 0.01)


def run(scene, mesh, step, folder):
    """What loop.py prints of the scene with uniform steps."""
    write_scene({**scene, "time": {**scene["time"], "step": step}}, folder / "scene.toml")
    steps = round(scene["time"]["end"] / step)
    command = [sys.executable, str(Path(__file__).with_name("loop.py")),
               str(folder / "scene.toml"), str(mesh), "--steps", str(steps)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        said = done.stderr.strip() or "no message"
        sys.exit(f"loop.py: {said.splitlines()[-1]}")
    return json.loads(done.stdout)


def main(path, target, *orders):
    path, scene = Path(path), read_scene(path)
    orders = [int(order) for order in orders] or [displacement_order(scene)]
    # The meshes are made here, uniform.
    scene["mesh"].pop("parameters", None)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        mesh = folder / "square.msh"
        for n in CELLS:
            geometry = path.parent / scene["mesh"]["file"]
            mesh_geometry(geometry, {"parameters": {"n": n}}, mesh)
            for order, step in itertools.product(orders, STEPS):
                ordered = of_order(scene, order)
                if n == CELLS[0] and step == STEPS[0]:
                    run(ordered, mesh, step, folder)
                said = run(ordered, mesh, step, folder)
                rows.append({
                    "order": order, "n": n, "step": step,
                    "seconds": said["whole_seconds"], "kkt": said["kkt"],
                    "zeta_min": said["zeta_min"], "displacement_max": said["displacement_max"],
                })
                print("P{order}, n = {n}, k = {step}: {seconds:.2f} s".format(**rows[-1]),
                      flush=True)
    table = Path(target) / "fenicsx.csv"
    with open(table, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    print(table)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
