"""Reference solutions made without the program's estimates: P2 on meshes graded to every singularity.

    /usr/bin/python3 validation/graded_reference.py BINARY SCENE.toml FOLDER

Where u − u(corner) ~ r^α, triangles of size h ~ r^(1 − α/3) share the energy error of P2 evenly; α is near ½
at the ends of obstacles and re-entrant corners, so the sides are min(LARGEST, STRENGTH r^(5/6)) m
long, r being the distance to the nearest corner, and smaller near Γ_C where contact moves. gmsh makes
the mesh, the program solves on it with chosen steps, and the first and last states are kept in FOLDER/results.
"""

import subprocess
import sys
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


@dataclass
class Grading:
    """The size of a reference's triangles, m."""

    corners: list
    strength: float
    largest: float
    # Near Γ_C and where the damage is steep, as expressions of gmsh.
    near: tuple = ()
    outline: str = None
    # Of chosen steps; the damage of the squares depends on them most.
    tolerance: float = 1e-3
    # Whether sides follow the geometry as parabolas.
    curved: bool = False

    def geometry(self, file):
        """The text of a .geo: the body of another, with this size."""
        r = [f"((x - {x})^2 + (y - {y})^2)" for x, y in self.corners]
        sizes = [f"{self.strength} * {square}^(5 / 12) + 3e-7" for square in r]
        sizes += [str(self.largest), *self.near]
        first = 101
        fields = [f'Field[{first + i}] = MathEval; Field[{first + i}].F = "{size}";'
                  for i, size in enumerate(sizes)]
        return "\n".join([
            self.outline or f'Include "{file.resolve()}";', *fields,
            f"Field[100] = Min; Field[100].FieldsList = {{{first} : {first + len(sizes) - 1}}};",
            "Background Field = 100;",
            *(f"Mesh.MeshSize{option} = 0;" for option in
              ("ExtendFromBoundary", "FromPoints", "FromCurvature")),
            # The other algorithms leave triangles without area at such sizes.
            "Mesh.Algorithm = 1;", *(["Mesh.ElementOrder = 2;"] if self.curved else []), ""])


LSHAPE = [(2, 4), (6, 4), (8, 4), (0, 0), (2, 0), (0, 6), (8, 6)]
FOOT = [(0, 0), (2, 0), (2, 4), (4, 6), (6, 4)]
GRADINGS = {
    "square.geo": Grading([(0, 0), (0, 1), (1, 0), (1, 1)], 0.045, 0.015, outline=SQUARE, tolerance=3e-4),
    "lshape.geo": Grading(LSHAPE, 0.06, 0.2, ("0.03 + 0.2 * (abs(6 - x) + 6 - x + y - 4)",)),
    "bridge-half.geo": Grading(FOOT, 0.05, 0.15, ("0.02 + 0.2 * y",)),
    "bridge.geo": Grading(FOOT + [(12 - x, y) for x, y in FOOT], 0.05, 0.15, ("0.02 + 0.2 * y",)),
    # The end of contact, where sides need be no shorter than 0.02 mm.
    "hertz.geo": Grading([(5.37e-3, 2.9e-4)], 0.015, 2e-3, curved=True),
    "beam.geo": Grading([(0, 0), (8, 0), (8, 0.5), (0, 0.5)], 0.04, 0.04,
                        ("0.015 + 0.3 * y", "0.008 + 0.05 * (4 - abs(x - 4))")),
}


def make(binary, path, folder):
    """The reference of a scene of geo/: the results kept in this folder, made anew if the scene or the
    mesh is another."""
    path, folder = Path(path), Path(folder)
    scene = read_scene(path)
    file = path.parent / scene["mesh"]["file"]
    grading = GRADINGS[file.name]
    geometry = grading.geometry(file)
    scene = {key: value for key, value in scene.items() if key != "accuracy"}
    scene["mesh"] = {"file": "reference.msh"}
    scene["discretisation"] = {"displacement": 2}
    if "time" in scene:
        scene["time"] = {**scene["time"], "step": "auto", "tolerance": grading.tolerance}
    scene["output"] = {"every": 1000000}
    results, kept, made_of = folder / "results", folder / "reference.toml", folder / "reference.geo"
    if (results / "summary.json").exists() and read_scene(kept) == scene and (
            made_of.read_text(encoding="utf-8") == geometry):
        return results
    folder.mkdir(parents=True, exist_ok=True)
    write_scene(scene, kept)
    made_of.write_text(geometry, encoding="utf-8")
    for command in (["gmsh", "-2", "-v", "1", made_of, "-o", folder / "reference.msh"],
                    [binary, "run", kept, "--out", results]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return results


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    print(make(*sys.argv[1:]))
