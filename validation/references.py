"""Reference solutions, kept until their scene or mesh changes. Those of the scenes of geo/ have P2 elements on meshes
graded to every singularity, without the program's estimates.

Where u − u(corner) ~ r^α, triangles of size h ~ r^(1 − α/3) share the energy error of P2 evenly; α is near ½
at the ends of obstacles and re-entrant corners, so the sides are min(LARGEST, STRENGTH r^(5/6)) m
long, r being the distance to the nearest corner, and smaller near Γ_C where contact moves. The program
solves on it with adaptive steps.
"""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from scene import read_scene, write_scene

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

    def geometry(self, file):
        """The text of a .geo: the body of another one, with this size."""
        r = [f"((x - {x})^2 + (y - {y})^2)" for x, y in self.corners]
        sizes = [f"{self.strength} * {square}^(5 / 12) + 3e-7" for square in r]
        sizes += [str(self.largest), *self.near]
        return "\n".join([self.outline or f'Include "{file.resolve()}";', *size_fields(sizes), ""])


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


def kept(binary, folder, scene, geometry, refinements=0, limit=None):
    """The results of a scene on the mesh of a .geo text after some refinements. The results in `folder` are used if they
    belong to this scene and text. A run longer than `limit` seconds raises subprocess.TimeoutExpired."""
    results, file, made_of = folder / "results", folder / "reference.toml", folder / "reference.geo"
    complete = folder / "complete"
    mesh = f"refined{refinements}.msh" if refinements else made_of.name
    scene = {**scene, "mesh": {"file": mesh}}
    if complete.exists() and read_scene(file) == scene and (made_of.read_text(encoding="utf-8") == geometry):
        return results
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    write_scene(scene, file)
    made_of.write_text(geometry, encoding="utf-8")
    if refinements:
        subprocess.run(["gmsh", "-2", "-v", "1", made_of, "-o", folder / "reference.msh"], check=True)
        refine(folder / "reference.msh", refinements)
    subprocess.run([binary, "run", file, "--out", results], check=True, timeout=limit, stdout=subprocess.DEVNULL)
    complete.touch()
    return results


def refine(mesh, count):
    """The mesh and `count` refined meshes in the same folder. Each divides every triangle of the previous one into four by
    the midpoints of its sides."""
    meshes = [mesh]
    for k in range(1, count + 1):
        meshes.append(mesh.with_name(f"refined{k}.msh"))
        subprocess.run(["gmsh", meshes[-2], "-refine", "-v", "1", "-format", "msh41", "-o", meshes[-1]], check=True)
    return meshes


def graded(binary, path, folder):
    """The reference of a scene of geo/."""
    path = Path(path)
    scene = read_scene(path)
    file = path.parent / scene["mesh"]["file"]
    grading = GRADINGS[file.name]
    scene = {key: value for key, value in scene.items() if key != "accuracy"}
    scene["discretisation"] = {"displacement": 2}
    if "time" in scene:
        scene["time"] = {**scene["time"], "step": "auto", "tolerance": grading.tolerance}
    scene["output"] = {"every": 1000000}
    return kept(binary, Path(folder), scene, grading.geometry(file))
