#!/usr/bin/python3
"""The proved bound on the error of u against the true error: bounds.py [--random N] [--seed S] [NAME…]

The scenes are those of geo/ and handbook/, with linear and with quadratic displacements, and N random ones (`random_draw`).
The truth is the difference in the energy norm from the answer of second order on the mesh bisected twice everywhere, with the same
ζ (`signorini-study bounds`). Where triangles have curved sides there is no bound, and the finer linear mesh has another shape.
Writes out/bounds/bounds.csv. Exit code 1 if a bound is below the truth, except where the proof leaves out a part.
"""

import csv
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from statistics import median

from shared import ROOT, parser_of
from random_bodies import write_msh
from random_draw import draw
from scene import solvers, write_scene

LIMIT = 120  # seconds for a scene
# The truth is known to this part of itself: the finer answer has an error, too, which makes it too small; and rounding.
ROUNDING = 1e-6


def errors(study, scene, order):
    """The errors that the study finds, or its words."""
    command = [study, "bounds", scene, "--set", f"discretisation.displacement={order}"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, cwd=scene.parent)
    except subprocess.TimeoutExpired:
        return "out of time"
    try:
        return json.loads(done.stdout.splitlines()[-1])
    except (IndexError, json.JSONDecodeError):
        return (done.stderr.strip().splitlines() or ["nothing"])[0][:100]


def random_scenes(binary, out, seed, count):
    """The random scenes, written below `out`."""
    for number in range(count):
        case = draw(seed, number, solvers(binary))
        folder = out / f"random-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        write_msh(case.mesh, folder / "mesh.msh")
        write_scene(case.scene, folder / "scene.toml")
        yield f"random-{number}", folder / "scene.toml"


def main():
    parser = parser_of(__doc__, "bounds")
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--random", type=int, default=350, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    study, out = arguments.binary.with_name("signorini-study"), arguments.out
    out.mkdir(parents=True, exist_ok=True)
    folders = [ROOT / "geo", ROOT / "validation/handbook"]
    scenes = [(path.stem, path) for folder in folders for path in sorted(folder.glob("*.toml"))]
    scenes += random_scenes(arguments.binary, out, arguments.seed, arguments.random)
    wanted = [(name, path, order) for name, path in scenes for order in (1, 2)
              if not arguments.names or name in arguments.names]
    with ThreadPoolExecutor(arguments.jobs) as pool:
        found = pool.map(lambda of: errors(study, *of[1:]), wanted)
        rows = [(name, order, of) for (name, _, order), of in zip(wanted, found)]
    names = ["scene", "order", "triangles", "bound", "estimate", "truth", "ratio", "left out", "seconds", "of a step"]
    wrong, ratios, estimates = [], {"proved": [], "without proof": []}, []
    with open(out / "bounds.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(names)
        for name, order, of in rows:
            if isinstance(of, str):
                table.writerow([name, order, *[""] * 5, of])
                continue
            bound, truth, left_out = of["bound"], of["truth"], of["reservations"]
            ratio = bound / truth if bound is not None and truth else None
            table.writerow([name, order, of["triangles"], bound, of["estimate"], truth, ratio, "; ".join(left_out),
                            *of["seconds"]])
            if ratio is None or truth < ROUNDING:
                continue
            if left_out:
                ratios["without proof"].append((ratio, f"{name} P{order} ({'; '.join(left_out)})"))
                continue
            ratios["proved"].append((ratio, f"{name} P{order}"))
            estimates.append(of["estimate"] / truth)
            if ratio < 1 - ROUNDING:
                wrong.append(f"{name} P{order}: {bound:.3e} proved, {truth:.3e} true")
    print(f"{len(rows)} runs; those below have a bound and a true error above rounding")
    for kind, found in ratios.items():
        found.sort()
        if found:
            values = [ratio for ratio, _ in found]
            below = sum(ratio < 1 - ROUNDING for ratio in values)
            print(f"{kind}: {len(values)}, of which {below} below the error; bound / error: median {median(values):.2f}, "
                  f"nine tenths below {values[len(values) * 9 // 10]:.2f}",
                  "least:", *(f"  {ratio:.3f} {name}" for ratio, name in found[:6]),
                  "largest:", *(f"  {ratio:.2f} {name}" for ratio, name in found[-10:]), sep="\n")
    if estimates:
        print(f"where proved, recovered strains / error: from {min(estimates):.2f} to {max(estimates):.2f}, "
              f"median {median(estimates):.2f}")
    for line in wrong:
        print("WRONG", line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
