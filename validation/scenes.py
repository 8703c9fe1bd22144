"""Forty bodies on which the program was not tuned: obstacles between nodes, thin layers, pads, narrow loads,
steep damage, pulses in time, pins, notches.

A scene is a table of strings in scenes.toml (`Scene`); `texts` makes its .geo and its table, of a truth with quadratic
elements on a fine mesh that is graded to the body's corners and to the features that the row names.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

from references import size_fields
from scene import write_scene


@dataclass
class Scene:
    """Body, `E ν plane` (and by surface), conditions `NAME KIND VALUES; …`, the law
    `κ λ_D λ_U [λ_W [ζ₀]]` (T = 1) or nothing, the truth's sizes by feature (`at X Y SIZE`, `x X SIZE`,
    `y Y SIZE`, or an expression of gmsh), and more: body force, probes `NAME X,Y …`, units, the truth's
    number of steps, its largest size, its outline where the data jump within a side."""

    name: str
    body: dict
    material: str
    conditions: str
    damage: str = ""
    fine: tuple = ()
    size: float = 0.1
    force: str = ""
    probes: str = ""
    units: str = ""
    time: bool = False
    steps: int = 400
    largest: float = 0.0
    truth: dict = None

    @property
    def timed(self):
        """Whether it has time, with its damage or without."""
        return bool(self.damage or self.time)


def scenes():
    """The scenes of scenes.toml."""
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    bodies = table["body"]
    return [Scene(name, **{**of, "body": bodies[of["body"]], "truth": bodies.get(of.get("truth"))})
            for name, of in table["scene"].items()]


class Outline:
    """Points, curves and loops of a body, each point and curve once."""

    def __init__(self, body):
        self.points, self.curves, self.named, self.lines, loops = {}, {}, {}, [], 0
        for number, (surface, text) in enumerate(body.items(), 1):
            first = loops + 1
            for loop in text.split(" / "):
                words, loops = loop.split(), loops + 1
                corners = words[::2]
                sides = [str(self.curve(*ends)) for ends in zip(corners, words[1::2], corners[1:] + corners[:1])]
                self.lines.append(f"Curve Loop({loops}) = {{{', '.join(sides)}}};")
            self.lines += [f"Plane Surface({number}) = {{{first} : {loops}}};",
                           f'Physical Surface("{surface}") = {{{number}}};']
        self.lines += [f'Physical Curve("{name}") = {{{", ".join(of)}}};' for name, of in self.named.items() if name != "-"]

    def point(self, text):
        """The number of a point `X,Y`."""
        if text not in self.points:
            self.points[text] = len(self.points) + 1
            self.lines.append(f"Point({self.points[text]}) = {{{text}, 0}};")
        return self.points[text]

    def curve(self, a, side, b):
        """The signed number of a side `NAME` or `NAME@CENTRE` from a to b."""
        name, _, centre = side.partition("@")
        if (b, a) in self.curves:
            return -self.curves[b, a]
        if (a, b) not in self.curves:
            ends = [self.point(p) for p in filter(None, (a, centre, b))]
            self.curves[a, b] = len(self.curves) + 1
            self.lines.append(f"{'Circle' if centre else 'Line'}({self.curves[a, b]}) = {{{', '.join(map(str, ends))}}};")
            self.named.setdefault(name, []).append(str(self.curves[a, b]))
        return self.curves[a, b]


def fields(scene, points, factor):
    """The sizes of a truth, times a factor: at corners a small part of the body's thickness, increasing by 0.2 of the
    distance."""
    corners = [tuple(map(float, p.split(","))) for p in points]
    extents = [max(c) - min(c) for c in zip(*corners)]
    # Without time there is one solve.
    least = min(extents) / (2000 if scene.timed else 1e5)
    largest = scene.largest or min(min(extents) / 10, max(extents) / 25)

    def size(feature):
        kind, *numbers = feature.split()
        if kind not in ("at", "x", "y"):
            return feature
        *place, finest = map(float, numbers)
        axes = "xy" if kind == "at" else kind
        squares = "+".join(f"({axis}-({value}))^2" for axis, value in zip(axes, place))
        return f"{finest}+0.2*sqrt({squares})"

    wanted = [size(f"at {x} {y} {least}") for x, y in corners] + [size(f) for f in scene.fine] + [str(largest)]
    return size_fields([f"{factor}*({f})" for f in wanted])


def table(scene):
    """The scene as a table, without mesh size, order and steps."""
    young = {}
    for k, entry in enumerate(scene.material.split("; ")):
        *name, e, nu = entry.split() if k else entry.split()[:2]
        young[name[0] if name else ""] = {"young": float(e), "poisson": float(nu)}
    material = {**young.pop(""), "plane": scene.material.split(";")[0].split()[2], **young}
    result = {"title": scene.name, "mesh": {"file": f"{scene.name}.geo"}, "material": material}
    if scene.damage:
        diffusion, lambda_d, lambda_u, lambda_w, initial = (scene.damage.split() + ["0", "1"][len(scene.damage.split()) - 3:])
        result["damage"] = {"diffusion": float(diffusion), "lambda_d": float(lambda_d), "lambda_u": float(lambda_u),
                            "lambda_w": float(lambda_w), "initial": initial, "threshold": 0.01}
    if scene.force:
        result["body"] = {"force": scene.force.split("|")}
    if scene.units:
        result["units"] = dict(zip(("length", "force"), scene.units.split()))
    sides = {}
    for entry in scene.conditions.split("; "):
        name, kind, *value = entry.split(None, 2)
        key = {"u": "displacement", "t": "traction", "p": "pressure", "gap": "gap", "sym": "symmetry"}[kind]
        values = value[0].split("|") if value else [True]
        sides.setdefault(name, {"name": name})[key] = values if len(values) > 1 else values[0]
    result["boundary"] = list(sides.values())
    words = scene.probes.split()
    probes = [{"name": n, "point": list(map(float, p.split(",")))} for n, p in zip(words[::2], words[1::2])]
    return {**result, **({"probe": probes} if probes else {})}


def texts(scene, factor=0.0):
    """The .geo text and the scene's table: as it is run with an accuracy, or the truth with its sizes times a factor."""
    outline, content = Outline(factor and scene.truth or scene.body), table(scene)
    lines = [f"DefineConstant[ size = {scene.size} ];", *outline.lines]
    if not factor:
        content["time"] = {"end": 1.0, "step": 0.02} if scene.timed else None
        return "\n".join([*lines, "Mesh.MeshSizeMax = size;", ""]), {k: v for k, v in content.items() if v}
    content["discretisation"] = {"displacement": 2}
    content["output"] = {"every": 1000000, "checkpoint": 0}
    if scene.timed:
        content["time"] = {"end": 1.0, "step": factor / scene.steps, "scheme": "bdf2"}
    return "\n".join([*lines, *fields(scene, outline.points, factor), ""]), content


def write(scene, folder):
    """Writes NAME.geo and NAME.toml into a folder; the path of the latter."""
    geometry, content = texts(scene)
    (folder / f"{scene.name}.geo").write_text(geometry, encoding="utf-8")
    write_scene(content, folder / f"{scene.name}.toml")
    return folder / f"{scene.name}.toml"
