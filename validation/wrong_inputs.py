"""Wrong inputs and what the program says of them, as it stands on the terminal.

    python3 validation/wrong_inputs.py --binary target/release/signorini

Exit code 1 if one is accepted, or ends in anything but exit code 2 and an `error:` on standard error.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

GEO = Path(__file__).resolve().parent.parent / "geo"

MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
4
1 1 "bottom"
1 2 "left"
1 3 "top"
2 4 "body"
$EndPhysicalNames
$Entities
0 3 1 0
1 0 0 0 1 0 0 1 1 0
2 0 0 0 0 1 0 1 2 0
3 0 1 0 1 1 0 1 3 0
4 0 0 0 1 1 0 1 4 0
$EndEntities
$Nodes
1 4 1 4
2 4 0 4
1
2
3
4
0 0 0
1 0 0
1 1 0
0 1 0
$EndNodes
$Elements
4 5 1 5
1 1 1 1
1 1 2
1 3 1 1
2 3 4
1 2 1 1
3 4 1
2 4 2 2
4 1 2 3
5 1 3 4
$EndElements
"""

SCENE = """title = "A pressed square"
[mesh]
file = "square.msh"
[material]
young = 80
poisson = 0.3
plane = "stress"
[damage]
diffusion = 0.01
lambda_d = 0.1
lambda_u = 20
[time]
end = 1
step = 0.1
[[boundary]]
name = "left"
displacement = ["0", "free"]
[[boundary]]
name = "bottom"
gap = "0"
[[boundary]]
name = "top"
traction = ["0", "-3*t"]
"""

# (what is wrong, text of the scene, its replacement)
SCENES = [
    ("a misspelt key", "young", "yuong"),
    ("a key twice", "young = 80", "young = 80\nyoung = 90"),
    ("text for a number", "young = 80", 'young = "eighty"'),
    ("a negative modulus", "young = 80", "young = -80"),
    ("a key left out", "young = 80\n", ""),
    ("Poisson's ratio of a fluid", "poisson = 0.3", "poisson = 0.5"),
    ("an unknown kind of plane", '"stress"', '"stres"'),
    ("a table that is not closed", "[time]", "[time"),
    ("an unknown table", "[time]", "[tiem]"),
    ("no diffusion", "diffusion = 0.01", "diffusion = 0"),
    ("damage before the run", "lambda_d = 0.1", "lambda_d = 0.1\ninitial = 0"),
    ("damage that varies to nothing", "lambda_d = 0.1", 'lambda_d = 0.1\ninitial = "1 - x"'),
    ("a step longer than the run", "step = 0.1", "step = 2"),
    ("too many steps", "step = 0.1", "step = 1e-12"),
    ("a step in words", "step = 0.1", 'step = "small"'),
    ("an unknown boundary", '"top"', '"toop"'),
    ("a boundary twice", '"top"', '"bottom"'),
    ("a gap that is no number", 'gap = "0"', 'gap = "sqrt(x - 0.5)"'),
    ("a gap and a displacement", 'gap = "0"', 'gap = "0"\ndisplacement = ["0", "0"]'),
    ("a boundary without a condition", 'gap = "0"', ""),
    ("an expression that ends early", '"-3*t"', '"-3*"'),
    ("an unknown variable", '"-3*t"', '"-3*s"'),
    ("an unknown function", '"-3*t"', '"sine(t)"'),
    ("a bracket too few", '"-3*t"', '"-3*(t + 1"'),
    ("a logarithm of nothing", '"-3*t"', '"log(0)"'),
    ("a root of negative numbers", '"-3*t"', '"sqrt(x - 2)"'),
    ("one component of two", '["0", "-3*t"]', '["-3*t"]'),
    ("a normal into the body", 'gap = "0"', 'gap = "0"\nnormal = ["0", "1"]'),
    ("nothing supports the body", 'displacement = ["0", "free"]', 'traction = ["1", "0"]'),
    ("a mesh that is not there", "square.msh", "round.msh"),
    ("a mesh of another kind", "square.msh", "square.stl"),
]

# (what is wrong, text of the mesh, its replacement)
MESHES = [
    ("an empty mesh file", MESH, ""),
    ("a mesh cut off", "4 1 2 3\n5 1 3 4\n$EndElements\n", "4 1 2"),
    ("a node that is not there", "5 1 3 4", "5 1 3 9"),
    ("a coordinate in words", "\n1 1 0\n", "\none 1 0\n"),
    ("a body out of the plane", "\n1 1 0\n", "\n1 1 0.5\n"),
    ("another version", "4.1 0 8", "9.9 0 8"),
]

# (what is wrong, arguments)
ARGUMENTS = [
    ("an unknown solver", ["--solver", "newton"]),
    ("--set without a value", ["--set", "time.step"]),
    ("an unknown type of TAO", ["--", "-tao_type", "trom"]),
    ("an unknown preconditioner", ["--", "-elastic_pc_type", "cholesy"]),
    ("an accuracy beyond reach", ["--accuracy", "1e-9"]),
    ("a scene that is not there", None),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default="target/release/signorini")
    binary = str(Path(parser.parse_args().binary).resolve())
    bad = count = 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)

        def tell(what, scene=SCENE, mesh=MESH, arguments=()):
            nonlocal bad, count
            (folder / "scene.toml").write_text(scene)
            (folder / "square.msh").write_text(mesh)
            name = "none.toml" if arguments is None else "scene.toml"
            ran = subprocess.run([binary, "run", name, *(arguments or ())], cwd=folder, text=True,
                                 capture_output=True, env={**os.environ, "RUST_BACKTRACE": "0"})
            count += 1
            refused = ran.returncode == 2 and ran.stderr.startswith("error: ") and not ran.stdout
            bad += not refused
            print(f"{count}. {what}" + ("" if refused else f"   (exit code {ran.returncode})"))
            print("".join(f"    {line}\n" for line in (ran.stderr + ran.stdout).splitlines()))

        for what, old, new in SCENES:
            assert old in SCENE, old
            tell(what, scene=SCENE.replace(old, new, 1))
        for what, old, new in MESHES:
            assert old in MESH, old
            tell(what, mesh=MESH.replace(old, new, 1))
        for what, arguments in ARGUMENTS:
            tell(what, arguments=arguments)
    print(f"{count} wrong inputs, {bad} not refused with exit code 2 and a message")
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
