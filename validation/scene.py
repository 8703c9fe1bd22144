"""Reads scene files, as far as a comparison needs them. The program itself checks whether a scene is correct.
"""

import json
import subprocess
import tomllib
from pathlib import Path

import numpy as np

import shared  # noqa: F401
from expressions import Expression


class SceneError(Exception):
    """An error of the user; the message has one line and no traceback."""


def read_scene(path):
    """The scene as nested dictionaries, keys as in the file."""
    try:
        with open(path, "rb") as file:
            scene = tomllib.load(file)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: {error}") from None
    for table in ("mesh", "material"):
        if table not in scene:
            raise SceneError(f"{path}: the table [{table}] is missing")
    return scene


# The keys that the independent codes follow, and the tables without effect on the discrete answer.
FOLLOWED = {
    f"{table}.{key}" for table, keys in {
        "material": "young poisson plane density", "discretisation": "displacement", "time": "end step scheme",
        "damage": "diffusion lambda_d lambda_u lambda_w strain_cap threshold initial mass", "body": "force gravity",
        "boundary": "name displacement symmetry gap normal traction pressure",
    }.items() for key in keys.split()
}
WITHOUT_EFFECT = {"title", "mesh", "contact", "output", "units", "probe"}


def must_be_followed(scene):
    """An error for a key that a code does not know: it would solve another problem."""
    def keys():
        for name, value in scene.items():
            if not isinstance(value, (dict, list)):
                yield name
                continue
            for table in value if isinstance(value, list) else [value]:
                for key, entry in table.items():
                    surface = isinstance(entry, dict)
                    yield from (f"{name}.{inner}" for inner in (entry if surface else [key]))

    unknown = sorted({key for key in keys() if key.split(".")[0] not in WITHOUT_EFFECT} - FOLLOWED)
    if unknown:
        raise SceneError(f"this code does not know the keys {', '.join(unknown)}; take them out of the scene")
    if "damage" in scene and "time" in scene and scene["time"].get("scheme") != "euler":
        raise SceneError('this code knows time.scheme = "euler" alone')


def of_material(scene, mesh, table, key, default=None):
    """A value of [material] or [damage] for each triangle, from the tables of its surfaces."""
    values = np.full(len(mesh.triangles), float(scene[table].get(key, default)))
    for name, surface in scene[table].items():
        if isinstance(surface, dict) and key in surface:
            values[mesh.surfaces[name]] = float(surface[key])
    return values


def elasticity(young, poisson, plane="stress"):
    """D of the paper's σ = 𝒜ε for (ε_xx, ε_yy, 2ε_xy), from numbers or from a value for each triangle (n): (…, 3, 3).
    Plane strain is plane stress with E/(1 − ν²) and ν/(1 − ν)."""
    e, nu = np.asarray(young, float), np.asarray(poisson, float)
    if plane == "strain":
        e, nu = e / (1 - nu**2), nu / (1 - nu)
    d = np.zeros((*e.shape, 3, 3))
    d[..., 0, 0] = d[..., 1, 1] = 1.0
    d[..., 0, 1] = d[..., 1, 0] = nu
    d[..., 2, 2] = 0.5 * (1 - nu)
    return (e / (1 - nu**2))[..., None, None] * d


def direction_of(boundary):
    """The fixed normal of a contact boundary as a unit vector; None without one."""
    if "normal" not in boundary:
        return None
    direction = np.array([float(Expression(text)(0.0, 0.0, 0.0)) for text in boundary["normal"]])
    return direction / np.linalg.norm(direction)


# Defaults of [damage].
DAMAGE = {"lambda_w": 0.0, "strain_cap": 1000.0, "threshold": 0.01, "initial": 1.0, "mass": "consistent"}


def displacement_order(scene):
    """The polynomial degree of the displacements; that of ζ is 1."""
    return scene.get("discretisation", {}).get("displacement", 1)


def of_order(scene, order):
    """The scene with displacements of that degree."""
    if order == displacement_order(scene):
        return scene
    return {**scene, "discretisation": {**scene.get("discretisation", {}), "displacement": order}}


def toml(value):
    """A value in TOML: strings, numbers, booleans and flat lists as in JSON, and inline tables."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + " }"
    return json.dumps(value)


def write_scene(scene, path):
    """Writes scalars, lists of scalars, tables and arrays of tables; scenes use nothing else."""
    top, tables = {}, []
    for name, value in scene.items():
        if isinstance(value, dict):
            tables.append((f"\n[{name}]", value))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            tables += [(f"\n[[{name}]]", table) for table in value]
        else:
            top[name] = value
    lines = [f"{key} = {toml(value)}" for key, value in top.items()]
    for head, table in tables:
        lines += [head, *(f"{key} = {toml(value)}" for key, value in table.items())]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def solvers(binary):
    """The names of the program's contact solvers, the default first."""
    listing = subprocess.run([str(binary), "solvers"], capture_output=True, text=True, check=True)
    return [line.split("\t")[0] for line in listing.stdout.splitlines()]
