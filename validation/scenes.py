"""Forty bodies on which the program was not tuned: obstacles between nodes, thin layers, pads, narrow loads,
steep damage, pulses in time, pins, notches.

A scene is a row of strings (`Scene`); `texts` makes its .geo and its table, of a truth with quadratic
elements on a fine mesh that is graded to the body's corners and to the features that the row names.
"""

from dataclasses import dataclass

from references import size_fields
from scene import write_scene

SQUARE = {"body": "0,0 base 1,0 right 1,1 top 0,1 left"}
STRIP = {"body": "0,0 base 4,0 right 4,1 top 0,1 left"}
BEAM = {"body": "0,0 base 8,0 right 8,0.2 top 0,0.2 left"}
PAD = {"body": "0,0 base 1,0 right 1,0.05 top 0,0.05 left"}
LAYERED = {"layer": "0,0 base 1,0 side 1,0.05 - 0,0.05 left", "body": "0,0.05 - 1,0.05 right 1,1 top 0,1 left"}
COATED = {"coat": "0,0 base 1,0 side 1,0.02 - 0,0.02 left", "body": "0,0.02 - 1,0.02 right 1,0.5 top 0,0.5 left"}
SANDWICH = {"low": "0,0 base 1,0 side 1,0.4 - 0,0.4 left", "glue": "0,0.4 - 1,0.4 side 1,0.43 - 0,0.43 left",
            "high": "0,0.43 - 1,0.43 side 1,1 top 0,1 left"}
ANGLE = {"body": "0,0 base 1,0 leg 1,2 under 3,2 tip 3,3 top 0,3 left"}
FILLET = {"body": "0,0 base 1,0 leg 1,1.8 round@1.2,1.8 1.2,2 under 3,2 tip 3,3 top 0,3 left"}
NOTCH = {"body": "0,0 base 1.95,0 flank 1.95,0.4 round@2,0.4 2.05,0.4 flank 2.05,0 base 4,0 right 4,1 top 0,1 left"}
HOLE = {"body": "0,0 base 2,0 right 2,1 top 0,1 left / 1.2,0.5 rim@1,0.5 1,0.7 rim@1,0.5 0.8,0.5 rim@1,0.5 1,0.3 rim@1,0.5"}
# The upper half of an eye 1 m in radius about a pin, and its bar.
LUG = {"body": "0.5,0 mid 4,0 end 4,0.6 edge 0.8,0.6 eye@0,0 0,1 eye@0,0 -1,0 mid -0.5,0 pin@0,0 0,0.5 pin@0,0"}
# A quarter of a ring on a shaft.
RING = {"body": "1,0 low 1.3,0 outer@0,0 0,1.3 left 0,1 inner@0,0"}
DISC = {"body": "0,0 foot@0,1 0.5,0.1339745962155614 side@0,1 1,1 top 0,1 left"}
ARCH = {"body": "-1,0 outer@0,0 0,1 outer@0,0 1,0 foot 0.85,0 inner@0,0 0,0.85 inner@0,0 -0.85,0 base"}
WEDGE = {"body": "0,0 base 2,0 right 2,0.5 top"}
INCLUSION = {"body": "0,0 base 1,0 right 1,1 top 0,1 left / 0.7,0.4 -@0.5,0.4 0.5,0.6 -@0.5,0.4 0.3,0.4 -@0.5,0.4 "
             "0.5,0.2 -@0.5,0.4", "core": "0.7,0.4 -@0.5,0.4 0.5,0.6 -@0.5,0.4 0.3,0.4 -@0.5,0.4 0.5,0.2 -@0.5,0.4"}
FEET = {"body": "0,0 base 0.3,0 side 0.3,0.3 under 1.1,0.3 side 1.1,0 base 1.5,0 right 1.5,1 top 0,1 left"}
PLATE_MM = {"body": "0,0 base 200,0 right 200,100 top 0,100 left"}
FIXED = "left u 0|0"
ROLLER = "0.00001+0.5*(x-0.55)^2"
NARROW = "-0.05*if(abs(x-0.6137)<0.001,1,0)/(2*0.001)"
# The outlines of truths have corners where the data jump.
LOADED = {"body": "0,0 base 1,0 right 1,1 top 0.6147,1 top 0.6127,1 top 0,1 left"}
BOX = "0.7037,0.59 - 0.7237,0.59 - 0.7237,0.61 - 0.7037,0.61 -"
BOXED = {"body": SQUARE["body"] + " / " + BOX, "box": BOX}
STEPPED = {"body": "0,0 base 0.4137,0 base 1,0 right 1,1 top 0,1 left"}


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
    """The table."""
    soft, stiff = "1000 .3 stress", "1e5 .3 stress"
    press = "; top t 0|-0.05; base gap "
    law = "0.01 0.1 "
    return [
        Scene("roller", SQUARE, soft, FIXED + press + ROLLER, fine=("at .55 0 1.5e-4",), probes="p .55,.05"),
        Scene("roller-symmetry", SQUARE, soft, "left sym; top t 0|-0.05; base gap " + ROLLER, fine=("at .55 0 1.5e-4",)),
        Scene("rollers", SQUARE, soft, FIXED + "; top t 0|-0.1; base gap 0.00001+0.5*min((x-0.21)^2,min((x-0.5533)^2,(x-0.873)^2))",
              fine=("at .21 0 3e-4", "at .5533 0 1.5e-4", "at .873 0 1.5e-4")),
        Scene("rolling-roller", SQUARE, soft, FIXED + press + "0.00001+0.1*(x-0.3-0.6*t)^2", fine=("0.002+0.25*(y+max(0.3-x,max(x-.95,0)))",),
              damage=law + "2e6", steps=600),
        Scene("rolling-elastic", STRIP, soft, "left u 0|0; right u 0|0; top t 0|-0.1; base gap 0.0002+0.01*(x-0.7-2.6*t)^2",
              fine=("0.005+0.2*y",), time=True, largest=0.1, steps=400),
        Scene("kink", SQUARE, soft, FIXED + press + "0.00002+0.05*abs(x-0.37)", fine=("at .37 0 3e-5",)),
        Scene("kink-flat", SQUARE, soft, FIXED + press + "0.0002*abs(x-0.37)", fine=("0.001+0.1*y", "at .37 0 3e-4")),
        Scene("ledge", SQUARE, soft, FIXED + press + "if(x<0.4137,1,0.00002)", fine=("0.002+0.1*y",), truth=STEPPED),
        Scene("punch", STRIP, soft, "top u 0|0; base gap 0.02*(x-1.37)^2-0.004*t", damage=law + "5e3",
              fine=("0.005+0.2*(y+max(abs(x-1.37)-.6,0))",)),
        Scene("layer", LAYERED, "1000 .3 strain; layer .1 .45", "left sym; top t 0|-0.001*(1+x); base gap 0", fine=("0.0025+0.1*max(0,y-.05)",),
              probes="p .5,.1"),
        Scene("layer-clamped", LAYERED, "1000 .3 strain; layer .1 .45", "left u 0|0; top t 0|-0.005; base gap 0.00001",
              fine=("0.0025+0.1*max(0,y-.05)",)),
        Scene("coating-hard", COATED, "100 .3 strain; coat 1e4 .2", "left sym; top u free|-0.001; base gap 0.02*x^2",
              fine=("0.001+0.1*y",)),
        Scene("coating-soft", COATED, "1000 .3 stress; coat 10 .4", "left u 0|0; top t 0|-0.1; base gap 0.00001+0.01*(x-.6)^2",
              fine=("0.001+0.1*y",)),
        Scene("sandwich", SANDWICH, "1e3 .3 strain; glue 1 .49", "left sym; top t 0.002|-0.02; base gap 0", damage=law + "10",
              fine=("0.003+0.15*max(abs(y-.415)-.015,0)",)),
        Scene("pad", PAD, "1 .4999 strain", "top u 0|-0.0002*t; base u 0|0", time=True, damage="0.001 0.1 200",
              fine=("0.0025",)),
        Scene("pad-contact", PAD, "1 .4999 strain", "top u 0|-0.00003; base gap 0.00002*abs(x-.3137)", fine=("0.0015",)),
        Scene("pad-shear", PAD, "1 .499 strain", "base u 0|0; top t 0.002|-0.01*sin(pi*x)", fine=("0.002",), probes="p .9,.025"),
        Scene("slender", BEAM, stiff, "left u 0|0; top t 0|-1; base gap 0.01", damage=law + "2e4", fine=("at 8 0 5e-4", "0.004+.1*abs(8-x)"),
              probes="tip 8,.2 mid 4,.1"),
        Scene("slender-humps", BEAM, stiff, "left u 0|0; right u 0|0; top t 0|-2*(1+x/8); base gap 0.001+0.05*min((x-2.71)^2,(x-5.63)^2)",
              fine=("at 2.71 0 5e-4", "at 5.63 0 5e-4")),
        Scene("arch", ARCH, stiff, "foot u 0|0; base gap 0; outer p 20*t*y^2", damage=law + "500", largest=0.03),
        Scene("narrow-load", SQUARE, soft, "left u 0|0; base gap 0; top t 0|" + NARROW, truth=LOADED),
        Scene("narrow-load-roller", SQUARE, soft, f"left u 0|0; base gap {ROLLER}; top t 0|{NARROW}",
              fine=("at .55 0 1.5e-4",), truth=LOADED),
        Scene("narrow-force", SQUARE, soft, "base gap 0; left u 0|0", force="0|-125*if(abs(x-0.7137)<0.01,1,0)*if(abs(y-0.6)<0.01,1,0)",
              fine=("0.002+0.15*max(abs(x-.7137)-.01,max(abs(y-.6)-.01,0))",), probes="p .7137,.6", truth=BOXED),
        Scene("narrow-force-smooth", SQUARE, soft, "base gap 0; left u 0|0", force="0|-160*exp(-((x-0.7137)^2+(y-0.6)^2)/0.01^2)",
              fine=("0.0012+0.15*sqrt((x-.7137)^2+(y-.6)^2)",), probes="p .7137,.6"),
        Scene("narrow-moving", STRIP, soft, "left u 0|0; right u 0|0; base gap 0; top t 0|-40*exp(-((x-0.5-3*t)/0.02)^2)",
              damage=law + "3e3", fine=("0.008+0.2*(1-y)",), steps=1000),
        Scene("steep-damage", SQUARE, soft, "left u 0|0; base gap 0; top t 0|-5*t", "0.001 0.5 100 0 1-0.9*exp(-((x-0.03)/0.01)^2)",
              fine=("x 0.03 0.0012",)),
        Scene("steep-band", SQUARE, soft, "base u 0|0; right gap 0.002; top t 2|0", "0.001 0.2 2e3 0 1-0.8*exp(-((y-0.4137)/0.01)^2)",
              fine=("y 0.4137 0.0012",)),
        Scene("gap-pulse", SQUARE, soft, "top u 0|0; base gap 0.1-0.12*exp(-((t-0.55)/0.01)^2)*x", "0.01 0.1 2e4",
              fine=("0.01+0.2*y",), steps=1500),
        Scene("load-pulse", SQUARE, soft, "left u 0|0; base gap 0.001; top t 0|-10*exp(-((t-0.317)/0.01)^2)", "0.01 0.1 2e3",
              fine=("0.01+0.2*y",), steps=1500),
        Scene("threshold", SQUARE, "1e4 .3 stress", "left u 0|0; base gap 0; top t 0|-60*t", "0.01 0.1 2000 0.02", steps=800),
        Scene("threshold-angle", ANGLE, stiff, "base u 0|0; tip gap 0.001; top t 0|-60*t", "0.01 0.1 3e3 0.02", fine=("at 1 2 5e-4",), steps=800),
        Scene("cyclic-gap", SQUARE, soft, "top u 0|0; base gap 0.004-0.008*sin(6.5*pi*t)*(1-x)", "0.01 0.1 3e3", steps=800),
        Scene("lug", LUG, stiff, "mid sym; end t 100*t|0; pin gap 0.0005*(1+x/sqrt(x^2+y^2))", law + "3e3", fine=("0.01+0.2*(sqrt(x^2+y^2)-.5)",)),
        Scene("hole", HOLE, soft, "left u 0|0; right t 10*t|0; base gap 0", "0.01 0.1 300", fine=("0.005+.15*abs(sqrt((x-1)^2+(y-.5)^2)-.2)",)),
        Scene("fillet", FILLET, stiff, "base u 0|0; under gap 0.0001; top t 0|-60*t", "0.02 0.1 5e3", probes="tip 3,3"),
        Scene("notch-fine", NOTCH, stiff, "left u 0|0; base gap 0; right t 60*t|0", "0.005 0.1 1e4", fine=("0.003+.15*abs(sqrt((x-2)^2+(y-.4)^2)-.05)",)),
        Scene("wedge", WEDGE, "1000 .3 strain", "right sym; base gap 0; top p 5*t*x", law + "1e3"),
        Scene("inclusion", INCLUSION, "1e3 .3 stress; core 1e5 .2", "left sym; base gap 0.0002*x; top t 0|-10*t", "0.005 0.1 500"),
        Scene("disc", DISC, soft, "left sym; top u free|-0.01*t; foot gap y", law + "200", fine=("0.0015+.1*max(0,sqrt(x^2+y^2)-.15)",)),
        Scene("varying-push", SQUARE, soft, "top u 0|-0.02*t*sin(pi*x)^2*(1+x); base gap 0.001; left sym", "0.01 0.1 500"),
        Scene("millimetres", PLATE_MM, "30 .2 stress", "left u 0|0; base gap 0.001; top t 0|-0.02*t", "100 0.1 2e4", units="mm kN", size=20),
        Scene("press-fit", RING, "1e5 .3 strain", "low sym; left sym; inner gap -0.001*(1+0.3*cos(4*atan2(y,x)))", largest=0.01),
        Scene("feet", FEET, soft, "base gap 0; left sym; right t -1|0; top t 0|-6*t*(1.5-x)", "0.01 0.1 1e3"),
    ]


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
    material = {**young.pop(""), "plane": scene.material.split(";")[0].split()[2]}
    result = {"title": scene.name, "mesh": {"file": f"{scene.name}.geo"}, "material": material}
    result |= {f"material.{name}": values for name, values in young.items()}
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
