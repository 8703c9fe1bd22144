#!/usr/bin/python3
"""Compares the installed peers with signorini: peer_check.py [--binary FILE] [--steps N] [SCENE…]

Each scene (by default all of geo/) is solved with linear displacements on a coarse mesh: static, and with damage in N
uniform steps by Euler's scheme and by `bdf2`. Prints the largest differences of u, of ζ and of the work of the loads;
those of u and of the work are relative. Names each peer that cannot follow a scene, with the reason. Exit code 1 if a
difference exceeds 1e-8 or a peer fails.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from shared import ROOT, parser_of
from peers import answer, command, installed, write_problem
from scene import SceneError, read_scene, write_scene
from signorini_results import load

SAME = 1e-8


class Failure(Exception):
    """A peer fails on a scene that it should follow; the message has one line."""


def works(scene, steps):
    """The static problem of a scene at t = 1 and its evolutions, with names."""
    mesh = {"file": scene["mesh"]["file"], **({"size": scene["mesh"]["size"]} if "size" in scene["mesh"] else {})}
    scene = {**{key: value for key, value in scene.items() if key not in ("accuracy", "discretisation")}, "mesh": mesh}
    yield "static", {key: value for key, value in scene.items() if key not in ("damage", "time")}
    for scheme in ("euler", "bdf2") if "time" in scene else ():
        yield scheme, {**scene, "time": {"end": scene["time"]["end"], "step": scene["time"]["end"] / steps, "scheme": scheme}}


def started(words):
    """The output of a command. A SceneError has the last line of its refusal, a Failure that of its traceback."""
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    if done.returncode:
        kind = Failure if "Traceback" in done.stderr else SceneError
        raise kind((done.stderr.strip() or "it failed").splitlines()[-1])
    return done.stdout


def differences(peer, folder, ours):
    """The largest differences of a peer's u, ζ and work from ours."""
    theirs = answer(started(command(peer, folder / "problem.npz", folder / "fields.npz")))
    fields, frame, steps = np.load(folder / "fields.npz"), ours.frame(), ours.summary["steps"]
    # The frame numbers the nodes anew.
    points, node = np.load(folder / "problem.npz")["points"], np.empty(len(frame.points), int)
    node[np.lexsort(points.T)] = np.lexsort(frame.points.T)
    if theirs["steps"] != steps:
        raise Failure(f"it makes {theirs['steps']} steps and signorini {steps}")
    u, work = frame.field("displacement")[node, :2], ours.figures["work"]["value"]
    # An answer that is 0 has no scale.
    return (np.abs(fields["u"] - u).max() / (np.abs(u).max() or 1.0),
            np.abs(fields["zeta"] - frame.field("zeta")[node]).max(), abs(theirs["work"] - work) / (abs(work) or 1.0))


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE", default=sorted((ROOT / "geo").glob("*.toml")))
    arguments = parser.parse_args()
    peers, failed = installed(), False
    for path in arguments.scenes:
        for work, scene in works(read_scene(path), arguments.steps):
            with tempfile.TemporaryDirectory() as folder:
                folder = Path(folder)
                shutil.copy(path.parent / scene["mesh"]["file"], folder)
                write_scene(scene, folder / path.name)
                started([arguments.binary, "run", folder / path.name, "--out", folder / "out", "--set", "output.every=1000000"])
                ours = load(folder / "out")
                for peer in peers:
                    name = f"{path.stem}, {work}, {len(ours.frame().points)} nodes, {ours.summary['steps']} steps: {peer}"
                    try:
                        write_problem(folder / "problem.npz", folder / path.name, next(folder.glob("*.msh")), arguments.steps)
                        u, zeta, of_loads = differences(peer, folder, ours)
                    except SceneError as error:
                        print(f"{name} is left out: {error}", flush=True)
                        continue
                    except Failure as failure:
                        failed = True
                        print(f"{name} FAILS: {failure}", flush=True)
                        continue
                    # NaN is not the same either.
                    wrong = not all(of <= SAME for of in (u, zeta, of_loads))
                    failed |= wrong
                    print(f"{name}: u {u:.0e}, ζ {zeta:.0e}, work {of_loads:.0e}{', DIFFERENT' * wrong}", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
