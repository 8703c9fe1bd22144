"""What else a random scene may have: quadratic displacements, curved sides, several materials, moving and
negative gaps. Drawn from a stream of their own, so that the scenes of `random_draw` stay what they are.
"""

import numpy as np

from random_bodies import bent, patched
from random_draw import PROFILES
from scene import of_order

# Parts of the scenes: with quadratic displacements; of these and of the others on a mesh with curved sides;
# with several materials; with a gap that moves, of scenes with time and without.
QUADRATIC, CURVED, CURVED_LINEAR, PATCHED, MOVING, STILL = 0.4, 0.6, 0.1, 0.3, 0.4, 0.1


def vary(case, seed, number, order=None):
    """Adds to scene `number` of a seed; with the order given, if it is."""
    rng = np.random.default_rng([seed, number, 2])
    drawn = 2 if rng.random() < QUADRATIC else 1
    order = order or drawn
    case.scene = of_order(case.scene, order)
    if rng.random() < (CURVED if order == 2 else CURVED_LINEAR):
        case.mesh = bent(rng, case.mesh)
    if rng.random() < PATCHED:
        case.mesh = patched(rng, case.mesh)
        materials(rng, case)
    timed = "time" in case.scene
    for boundary in case.scene["boundary"]:
        if "gap" in boundary and rng.random() < (MOVING if timed else STILL):
            boundary["gap"] += motion(rng, case, timed)


def materials(rng, case):
    """Stiffness over six decades, any ν, and what the law of damage may have otherwise."""
    material, law = case.scene["material"], case.scene.get("damage")
    for name in case.mesh.surfaces:
        material[name] = {"young": material["young"] * 10 ** rng.uniform(-3, 3)}
        if rng.random() < 0.7:
            material[name]["poisson"] = round(float(rng.uniform(0, 0.45)), 3)
        if law and rng.random() < 0.7:
            law[name] = {"diffusion": law["diffusion"] * 10 ** rng.uniform(-2, 1),
                         "lambda_d": float(rng.uniform(0, 0.3)),
                         "lambda_u": law["lambda_u"] * 10 ** rng.uniform(-2, 0.3),
                         "lambda_w": float(rng.choice([0.0, 0.05])),
                         "strain_cap": float(rng.choice([1e3, case.strain**2]))}


def motion(rng, case, timed):
    """A term that moves an obstacle by a hundredth to five times the scene's typical displacement; without
    time it stays where it is at t = 1."""
    size = case.move * 10 ** rng.uniform(-2, 0.7)
    profile = str(rng.choice(PROFILES)) if timed else "t"
    return f" {rng.choice(['+', '-'])} {float(size)!r}*{profile}"
