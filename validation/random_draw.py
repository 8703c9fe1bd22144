"""Random scenes by kind: a body of `random_bodies`, its conditions and loads, solver and ranks.

Scales are drawn over decades: E from 1e-3 to 1e12 Pa, lengths from 1e-3 to 1e3 m, strains from 1e-9
to 1e-2, gaps from 1e-6 to 1e9 times the displacement that such a strain means. The scenes contain irregular
features that the stability study avoids: tips, slits, pinches, nodes with several normals, bodies that are
unsupported or supported by contact only, loads that cross zero.
"""

from dataclasses import dataclass

import numpy as np

import random_bodies as bodies
from scene import of_order
from triangulation import Triangulation

# Factors of a load in time; a static solve is at t = 1.
PROFILES = ("1", "t", "cos(pi*t)", "(1 - 2*t)", "sin(2*pi*t)", "(0.2 + t^2)", "(t - 0.5)")

# Parts of the scenes: with quadratic displacements; of these and of the others on a mesh with curved sides;
# with several materials; with a gap that moves, of scenes with time and without; with points of the geometry in the mesh.
QUADRATIC, CURVED, CURVED_LINEAR, PATCHED, MOVING, STILL, WITH_POINTS = 0.4, 0.6, 0.1, 0.3, 0.4, 0.1, 0.5


@dataclass
class Case:
    """A scene to run; its typical displacement, m, and strain."""

    kind: str
    scene: dict
    mesh: Triangulation
    solver: str
    ranks: int
    move: float
    strain: float


class Draw:
    """The scales of one scene, and the conditions drawn in them."""

    def __init__(self, rng, kind):
        self.rng, self.kind = rng, kind
        self.length = 10 ** rng.uniform(-3, 3)
        self.young = 10 ** rng.uniform(-3, 12)
        strain = 10 ** rng.uniform(-9, -2)
        self.stress, self.move, self.strain = self.young * strain, self.length * strain, strain
        self.turn = float(rng.choice([0.0, rng.uniform(0, 2 * np.pi)]))
        self.timed = kind in ("rolling", "damage", "prescribed") or rng.random() < 0.3
        self.boundary = {}
        self.pressed = None  # the body force's direction, if it is not any

    def chance(self, p):
        """True with probability p."""
        return self.rng.random() < p

    def number(self, low=-1.0, high=1.0):
        """A number drawn evenly."""
        return float(self.rng.uniform(low, high))

    def profile(self):
        """A factor in time; in static scenes mostly 1."""
        if not self.timed and self.chance(0.85):
            return "1"
        return str(self.rng.choice(PROFILES))

    def put(self, name, **condition):
        """Adds conditions on a curve."""
        self.boundary.setdefault(name, {"name": name}).update(condition)

    def gap(self, name, normal=None, size=None):
        """A gap of some decade, often 0, sometimes varying along the curve."""
        if size is None:
            size = 0.0 if self.chance(0.4) else self.move * 10 ** self.number(-6, 9)
            if self.chance(0.5):
                size = min(size, self.move * 10 ** self.number(-3, 1))
        text = repr(size)
        if size and self.chance(0.3):
            text += f"*(1 + {self.number(0, 0.9)!r}*sin({self.number(1, 6)!r}*x/{self.length!r}))"
        self.put(name, gap=text, **({} if normal is None else {"normal": vector(normal)}))

    def support(self, name):
        """Clamped, one component free, a symmetry axis, or moved in time."""
        value = f"{self.number() * self.move!r}*{self.profile()}"
        way = self.rng.integers(6 if self.timed else 5)
        if way == 2:
            self.put(name, symmetry=True)
        else:
            self.put(name, displacement=[["0", "0"], ["0", "0"], None, ["0", "free"], ["free", "0"], [value, "0"]][way])

    def traction(self, name, mesh):
        """Mostly pressing along the curve's mean normal; also along any direction, or one that
        rolls along the curve."""
        n = mesh.outward_normals(name)[0].mean(0)
        size = self.stress * 10 ** self.number(-0.5, 0.5)
        direction = -n if self.chance(0.6) else self.rng.standard_normal(2)
        force = [f"{float(size * c)!r}*{self.profile()}" for c in direction]
        if self.kind == "rolling" or self.chance(0.1):
            nodes = mesh.nodes[np.unique(mesh.edges(name))]
            axis = int(np.ptp(nodes, axis=0).argmax())
            low, extent = float(nodes[:, axis].min()), float(np.ptp(nodes[:, axis]))
            centre = f"({low!r} + {extent!r}*t)"
            bump = f"max(0, 1 - abs({'xy'[axis]} - {centre})/{self.number(0.1, 0.6) * extent!r})"
            force = [f"{c}*{bump}" for c in force]
        if not {"displacement", "symmetry"} & set(self.boundary.get(name, {})):
            self.put(name, traction=force)

    def tractions(self, names, mesh, p):
        """Tractions on some of the curves, each with probability p."""
        for name in names:
            if self.chance(p):
                self.traction(name, mesh)

    def normal(self, mesh, name, tilt):
        """The curve's mean outward normal, turned by an angle."""
        n = mesh.outward_normals(name)[0].mean(0)
        c, s = np.cos(tilt), np.sin(tilt)
        n = np.array([c * n[0] - s * n[1], s * n[0] + c * n[1]])
        return n / np.linalg.norm(n)

    def scene(self, mesh, damage):
        """The scene as a table."""
        scene = {"title": self.kind, "mesh": {"file": "mesh.msh"}, "material": {
            "young": self.young, "poisson": round(self.number(0, 0.45), 3),
            "plane": str(self.rng.choice(["stress", "strain"]))}}
        if damage or self.chance(0.15):
            scene["damage"] = self.damage()
        if self.timed:
            count = int(self.rng.integers(2, 7))
            end = 10 ** self.number(-2, 2) if self.chance(0.3) else 1.0
            scene["time"] = {"end": end, "step": end / count, "scheme": "euler"}
        if self.chance(0.4) or not any("traction" in b for b in self.boundary.values()):
            size = self.stress / self.length * 10 ** self.number(-1, 0.5)
            force = self.rng.standard_normal(2) if self.pressed is None else self.pressed
            scene["body"] = {"force": [f"{float(size * c)!r}*{self.profile()}" for c in force]}
        if "body" in scene and self.chance(0.3):
            gravity = [f"{float(size * c)!r}" for c in force]
            scene["material"]["density"] = 1.0
            scene["body"] = {"gravity": gravity}
        scene["output"] = {"every": 1}
        scene["boundary"] = list(self.boundary.values())
        return scene

    def damage(self):
        """A law whose source makes some percent of damage in the time of the run, and a field ζ₀."""
        initial = "1"
        if self.chance(0.7):
            waves = [self.number(-6, 6) / self.length for _ in range(2)]
            initial = f"0.7 + {self.number(0, 0.29)!r}*sin({waves[0]!r}*x + {waves[1]!r}*y)"
        return {"diffusion": self.length**2 * 10 ** self.number(-4, 1),
                "lambda_d": self.number(0, 0.3),
                "lambda_u": 10 ** self.number(-2, 0.3) / self.strain**2,
                "lambda_w": float(self.rng.choice([0.0, 0.05])), "strain_cap": 1000.0,
                "threshold": 0.01, "initial": initial,
                "mass": str(self.rng.choice(["consistent", "lumped"]))}


def block(d, mesh):
    """On its foot; a side supported or not; loads on the others."""
    d.gap("south")
    if d.chance(0.8):
        d.support(str(d.rng.choice(["west", "east"])))
    d.tractions(("north", "east", "west"), mesh, 0.6)


def wedge(d, mesh):
    """Between two plates that touch its sides, or whose normals are fixed: the tip has both."""
    if d.chance(0.7):
        d.put("end", displacement=["0", "0"])
    else:
        d.support("end")
    axis = d.normal(mesh, "end", 0.0)
    across = np.array([-axis[1], axis[0]])
    plates = d.chance(0.5)
    for name, side in (("lower", -1), ("upper", 1)):
        if d.chance(0.9):
            d.gap(name, side * across if plates else None)
        d.tractions([name], mesh, 0.3)


def slit(d, mesh):
    """A rigid sheet in the slit: both lips may touch it, and the tip has two opposite normals."""
    d.support(str(d.rng.choice(["east", "south", "north"])))
    for name in ("lip_low", "lip_high"):
        if d.chance(0.85):
            d.gap(name)
    d.tractions([name for name in ("south", "north", "west") if name not in d.boundary], mesh, 0.6)


def cells(d, mesh):
    """Any condition on any side."""
    names = list(d.rng.permutation(list(mesh.curves)))
    d.gap(names[0])
    for name in names[1:]:
        way = d.rng.random()
        if way < 0.25:
            d.support(name)
        elif way < 0.6:
            d.gap(name)
        d.tractions([name], mesh, 0.4)


def rounded(d, mesh):
    """A disc in a bore or an arch on its feet or over a mandrel: contact on curves."""
    names = list(mesh.curves)
    if d.chance(0.5):
        d.support(str(d.rng.choice(names[1:])))
    for name in names:
        if name not in d.boundary and d.chance(0.9 if name == names[0] else 0.5):
            d.gap(name)
    if d.chance(0.6):
        d.traction(names[0 if d.chance(0.2) else -1], mesh)
    else:
        d.pressed = d.normal(mesh, names[0], d.number(-0.3, 0.3))


def prescribed(d, mesh):
    """Pushed into the obstacle by a displacement in time."""
    n = d.normal(mesh, "north", 0.0)
    way = [float(-d.move * c) for c in n]
    profile = d.profile()
    value = [f"{c!r}*{profile}" for c in way]
    if d.chance(0.4):
        value[int(abs(n[0]) > abs(n[1])) ^ 1 if d.chance(0.5) else int(abs(n[1]) < 0.5)] = "free"
    d.put("north", displacement=value)
    d.gap("south")
    for name in ("east", "west"):
        if d.chance(0.3):
            d.gap(name)


def loose(d, mesh):
    """Supported by contact alone on some or all sides, and mostly pressed against it."""
    names = list(d.rng.permutation(list(mesh.curves)))
    touching = names[:int(d.rng.integers(1, len(names) + 1))]
    for name in touching:
        d.gap(name)
    if d.chance(0.7):
        pressed = sum(d.normal(mesh, name, 0.0) for name in touching)
        if np.linalg.norm(pressed) > 0.1:  # opposite sides leave only rounding
            d.pressed = pressed
    d.tractions(names, mesh, 0.4 if d.pressed is None else 0.1)


def normals(d, mesh):
    """Fixed normals at an angle to the body's own; a few point into the body."""
    names = list(d.rng.permutation(list(mesh.curves)))
    d.support(names[0])
    for name in names[1:]:
        if d.chance(0.7):
            tilt = d.number(-1.2, 1.2) if d.chance(0.8) else np.pi + d.number(-0.5, 0.5)
            d.gap(name, d.normal(mesh, name, tilt))
        d.tractions([name], mesh, 0.4)


# Kind: bodies to choose from, and its conditions.
KINDS = {
    "block": ((bodies.block,), block),
    "wedge": ((bodies.wedge,), wedge),
    "slit": ((bodies.slit,), slit),
    "cells": ((bodies.cells,), cells),
    "round": ((bodies.disc, bodies.arch), rounded),
    "rolling": ((bodies.block,), block),
    "damage": ((bodies.block, bodies.slit, bodies.wedge, bodies.disc), None),
    "prescribed": ((bodies.block, bodies.slit), prescribed),
    "loose": ((bodies.block, bodies.disc, bodies.cells, bodies.wedge), loose),
    "normals": ((bodies.block, bodies.wedge, bodies.disc, bodies.arch), normals),
}
OWN = {bodies.block: block, bodies.slit: slit, bodies.wedge: wedge, bodies.disc: rounded}


def draw(seed, number, solvers):
    """Scene `number` of a seed, for one of `solvers`. It does not depend on the number of scenes."""
    rng = np.random.default_rng([seed, number])
    kind = str(rng.choice(list(KINDS)))
    choices, conditions = KINDS[kind]
    make = choices[int(rng.integers(len(choices)))]
    d = Draw(rng, kind)
    mesh = bodies.finish(rng, make(rng), d.length, d.turn)
    (conditions or OWN[make])(d, mesh)
    scene = d.scene(mesh, kind == "damage")
    return Case(kind, scene, mesh, str(rng.choice(solvers)),
                int(rng.choice([1, 2, 3], p=[0.7, 0.15, 0.15])), d.move, d.strain)


def vector(direction):
    """The vector in the syntax of the scene file."""
    return [repr(float(c)) for c in direction]


def vary(case, seed, number, order=None):
    """Adds quadratic displacements, curved sides, several materials, moving and negative gaps to scene `number` of a seed,
    with the order given, if it is. They have their own random stream, so the scenes of `draw` do not change."""
    rng = np.random.default_rng([seed, number, 2])
    drawn = 2 if rng.random() < QUADRATIC else 1
    order = order or drawn
    case.scene = of_order(case.scene, order)
    if rng.random() < (CURVED if order == 2 else CURVED_LINEAR):
        case.mesh = bodies.bent(rng, case.mesh)
    if rng.random() < PATCHED:
        case.mesh = bodies.patched(rng, case.mesh)
        materials(rng, case)
    timed = "time" in case.scene
    for boundary in case.scene["boundary"]:
        if "gap" in boundary and rng.random() < (MOVING if timed else STILL):
            boundary["gap"] += motion(rng, case, timed)
    if rng.random() < WITH_POINTS:
        case.mesh = bodies.with_points(rng, case.mesh)


def materials(rng, case):
    """Stiffness over six decades, any ν, and other constants of the damage law."""
    material, law = case.scene["material"], case.scene.get("damage")
    for name in case.mesh.surfaces:
        material[name] = {"young": material["young"] * 10 ** rng.uniform(-3, 3)}
        if "density" in material:
            material[name]["density"] = float(rng.uniform(0, 5))
        if rng.random() < 0.7:
            material[name]["poisson"] = round(float(rng.uniform(0, 0.45)), 3)
        if law and rng.random() < 0.7:
            law[name] = {"diffusion": law["diffusion"] * 10 ** rng.uniform(-2, 1),
                         "lambda_d": float(rng.uniform(0, 0.3)),
                         "lambda_u": law["lambda_u"] * 10 ** rng.uniform(-2, 0.3),
                         "lambda_w": float(rng.choice([0.0, 0.05])),
                         "strain_cap": float(rng.choice([1e3, case.strain**2]))}


def motion(rng, case, timed):
    """A term that moves an obstacle by a hundredth to five times the typical displacement of the scene. Without time it has
    its value at t = 1."""
    size = case.move * 10 ** rng.uniform(-2, 0.7)
    profile = str(rng.choice(PROFILES)) if timed else "t"
    return f" {rng.choice(['+', '-'])} {float(size)!r}*{profile}"
