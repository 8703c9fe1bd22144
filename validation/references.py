"""Reference solutions, kept until their scene or mesh changes. Those of the scenes of geo/ have P2 elements on meshes
graded to every singularity, without the program's estimates. So are those of other scenes, to the ends of all curves.

Where u − u(corner) ~ r^α, triangles of size h ~ r^(1 − α/3) share the energy error of P2 evenly; α is near ½
at the ends of obstacles and re-entrant corners, so the sides are min(LARGEST, STRENGTH r^(5/6)) m
long, r being the distance to the nearest corner, and smaller near Γ_C where contact moves. The program
solves on it with adaptive steps.
"""

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scene import SceneError, read_scene, write_scene
from shared import ROOT

# square.geo makes a structured mesh: its outline, and its curves by their names.
SQUARE = """
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1 : 4};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("bottom") = {1}; Physical Curve("right") = {2};
Physical Curve("top") = {3}; Physical Curve("left") = {4};
"""


def size_fields(sizes):
    """Lines of a .geo: the size of triangles is the minimum of some expressions of gmsh, m."""
    first, last = 101, 100 + len(sizes)
    return [*(f'Field[{k}] = MathEval; Field[{k}].F = "{size}";' for k, size in enumerate(sizes, first)),
            f"Field[100] = Min; Field[100].FieldsList = {{{first} : {last}}}; Background Field = 100;",
            *(f"Mesh.MeshSize{option} = 0;" for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature")),
            # The other algorithms of gmsh make flat triangles at such sizes.
            "Mesh.Algorithm = 1;"]


@dataclass
class Grading:
    """The size of a reference's triangles, m."""

    corners: list
    strength: float
    largest: float
    # Near Γ_C and where the damage is steep, as expressions of gmsh.
    near: tuple = ()
    outline: str = None
    # The tolerance of adaptive steps; the damage of the squares depends most on it.
    tolerance: float = 1e-3
    # Lines before these sizes: the fields that they use.
    fields: tuple = ()

    def geometry(self, file, parameters=()):
        """The text of a .geo: the body of another one with its parameters, with this size."""
        r = [f"((x - ({x}))^2 + (y - ({y}))^2)" for x, y in self.corners]
        sizes = [f"{self.strength} * {square}^(5 / 12) + 3e-7" for square in r]
        sizes += [str(self.largest), *self.near]
        body = self.outline or f'Include "{file.resolve()}";'
        return "\n".join([*parameters, body, *self.fields, *size_fields(sizes), ""])


LSHAPE = [(2, 4), (6, 4), (8, 4), (0, 0), (2, 0), (0, 6), (8, 6)]
FOOT = [(0, 0), (2, 0), (2, 4), (4, 6), (6, 4)]
GRADINGS = {
    "square.geo": Grading([(0, 0), (0, 1), (1, 0), (1, 1)], 0.045, 0.015, outline=SQUARE, tolerance=3e-4),
    "lshape.geo": Grading(LSHAPE, 0.06, 0.2, ("0.03 + 0.2 * (abs(6 - x) + 6 - x + y - 4)",)),
    "bridge-half.geo": Grading(FOOT, 0.05, 0.15, ("0.02 + 0.2 * y",)),
    "bridge.geo": Grading(FOOT + [(12 - x, y) for x, y in FOOT], 0.05, 0.15, ("0.02 + 0.2 * y",)),
    # The end of contact, where sides need be no shorter than 0.02 mm.
    "hertz.geo": Grading([(5.37e-3, 2.9e-4)], 0.015, 2e-3),
    "beam.geo": Grading([(0, 0), (8, 0), (8, 0.5), (0, 0.5)], 0.04, 0.04,
                        ("0.015 + 0.3 * y", "0.008 + 0.05 * (4 - abs(x - 4))")),
}


def geometry_of(path, scene):
    """The .geo of a scene and lines that set its parameters; a SceneError if it has none."""
    file = path.parent / scene["mesh"]["file"]
    if file.suffix != ".geo":
        raise SceneError(f"{path}: the meshes are made from a .geo, but mesh.file is {file.name}")
    return file, [f"{name} = {value};" for name, value in scene["mesh"].get("parameters", {}).items()]


def grading_of(file, parameters, scene):
    """The size of a reference's triangles for any body: graded to the ends of all its curves, and smaller near Γ_C."""
    if "Transfinite" in file.read_text(encoding="utf-8"):
        raise SceneError(f"{file}: a reference needs a graded mesh, but Transfinite prescribes the nodes; leave it out")
    with tempfile.TemporaryDirectory() as folder:
        geometry, mesh = Path(folder) / "curves.geo", Path(folder) / "curves.msh"
        geometry.write_text("\n".join([*parameters, f'Include "{file.resolve()}";', ""]), encoding="utf-8")
        subprocess.run(["gmsh", "-1", "-save_all", "-v", "1", geometry, "-o", mesh], check=True)
        text = mesh.read_text(encoding="utf-8")
    # MSH 4.1. A point: its number, x, y, z, …; a curve: its number, a box, n, n physical curves, 2, its ends.
    lines = [line.split() for line in text.partition("$Entities\n")[2].partition("$End")[0].splitlines()]
    count, all_curves = map(int, lines[0][:2])
    points, curves = lines[1:1 + count], lines[1 + count:1 + count + all_curves]
    ends = {end.lstrip("-") for curve in curves for end in curve[9 + int(curve[7]):]}
    corners = [(float(x), float(y)) for point, x, y, *_ in points if point in ends]
    gaps = [boundary["name"] for boundary in scene["boundary"] if "gap" in boundary]
    numbers = {number for number, name in re.findall(r'^1 (\d+) "(.*)"', text, re.MULTILINE) if name in gaps}
    contact = ", ".join(curve[0] for curve in curves if numbers & set(curve[8:8 + int(curve[7])]))
    size = float(np.ptp([[float(x) for x in curve[k:k + 2]] for curve in curves for k in (1, 4)], axis=0).max())
    distance = f"Field[99] = Distance; Field[99].NumPointsPerCurve = 200; Field[99].CurvesList = {{{contact}}};"
    near, fields = ((f"{size / 400} + 0.2 * F99",), (distance,)) if contact else ((), ())
    return Grading(corners, 0.04 * size ** (1 / 6), size / 50, near, fields=fields)


def kept(binary, folder, scene, geometry, refinements=0, limit=None):
    """The results of a scene on the mesh of a .geo text after some refinements. The results in `folder` are used if they
    belong to this scene and text. A run longer than `limit` seconds raises subprocess.TimeoutExpired."""
    results, file, made_of = folder / "results", folder / "reference.toml", folder / "reference.geo"
    complete = folder / "complete"
    scene = {**scene, "mesh": {"file": f"refined{refinements}.msh" if refinements else made_of.name}}
    same = file.exists() and read_scene(file) == scene and made_of.read_text(encoding="utf-8") == geometry
    # Results of an earlier release have no figures.
    same = same and (not complete.exists() or '"figures": {' in (results / "summary.json").read_text(encoding="utf-8"))
    if complete.exists() and same:
        return results
    if not same:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        made_of.write_text(geometry, encoding="utf-8")
        if refinements:
            refine(folder, refinements)
        write_scene(scene, file)
    command, options = [binary, "run", file, "--out", results], {"timeout": limit, "stdout": subprocess.DEVNULL}
    # An interrupted run goes on, unless it was that of another program.
    goes_on = any(results.glob("checkpoint*"))
    if not goes_on or subprocess.run([*command, "--restart"], **options).returncode:
        subprocess.run(command, check=True, **options)
    complete.touch()
    return results


def nested(folder, count):
    """The files of the coarsest mesh and of its refinements."""
    return [folder / "reference.msh", *(folder / f"refined{k}.msh" for k in range(1, count + 1))]


def refine(folder, count):
    """Meshes reference.geo, and refines the mesh `count` times: every triangle into four by the midpoints of its sides.
    Midpoints of curved sides are on the curve."""
    saves = [f'Save "{mesh.name}";' for mesh in nested(folder, count)]
    script = folder / "refine.geo"
    script.write_text("\n".join(['Include "reference.geo";', "Mesh 2;", "\nRefineMesh;\n".join(saves), ""]))
    subprocess.run(["gmsh", script, "-v", "1", "-"], check=True)


def graded(binary, path, folder):
    """The reference of a scene."""
    path = Path(path)
    scene = read_scene(path)
    file, parameters = geometry_of(path, scene)
    shipped = GRADINGS.get(file.name) if file.resolve().parent == ROOT / "geo" else None
    grading = shipped or grading_of(file, parameters, scene)
    scene = {key: value for key, value in scene.items() if key != "accuracy"}
    scene["discretisation"] = {"displacement": 2}
    if "time" in scene:
        scene["time"] = {**scene["time"], "step": "auto", "tolerance": grading.tolerance}
    scene["output"] = {"every": 1000000}
    return kept(binary, Path(folder), scene, grading.geometry(file, () if shipped else parameters))
