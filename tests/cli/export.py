"""Solves the contact step and the damage step from the files of `signorini export`, by SciPy and an active set in NumPy;
prints the folders in which an answer differs from that of the run. It shares no code with the program."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve


def contact(K, A, B, a, f, g):
    """u minimises ½ uᵀKu − fᵀu over Au = a, Bu ≤ g; and the multipliers of B. Primal-dual active set, from all active."""
    # Conditions in the size of K keep the digits of the direct solver.
    active, size = np.ones(len(g), bool), K.diagonal().mean()
    for _ in range(50):
        C, c = size * sparse.vstack([A, B[active]]), size * np.concatenate([a, g[active]])
        solved = spsolve(sparse.bmat([[K, C.T], [C, None]], format="csc"), np.concatenate([f, c]))
        u, p = solved[:len(f)], np.zeros(len(g))
        p[active] = size * solved[len(f) + len(a):]
        wanted = p + 1e-3 * size * (B @ u - g) > 0.0
        if (wanted == active).all():
            return u, p
        active = wanted
    raise RuntimeError("the active set does not settle")


def check(folder):
    """What is wrong, and whether some gaps are open and some are closed."""
    about = json.loads((folder / "export.json").read_text())
    files = [name.removesuffix(".mtx") for name in about["files"] if name.endswith(".mtx")]
    read = {name: scipy.io.mmread(folder / f"{name}.mtx") for name in files}
    read = {name: value.ravel() if isinstance(value, np.ndarray) else value.tocsr() for name, value in read.items()}
    for name in ("u_D", "g"):
        read.setdefault(name, np.zeros(0))
    assert set(about["files"]) | {"export.json"} <= {path.name for path in folder.iterdir()}
    u, p = contact(*(read[name] for name in ("K", "A", "B", "u_D", "f", "g")))
    size = abs(u).max()
    if not size > 0.0 or abs(u - read["u"]).max() > 1e-8 * size:
        yield f"u differs by {abs(u - read['u']).max() / size}"
    if abs(read["K"] - read["K"].T).max() > 1e-12 * abs(read["K"]).max():
        yield "K is not symmetric"
    if len(read["u"]) != 2 * sum(1 for _ in csv.DictReader(open(folder / "nodes.csv"))):
        yield "nodes.csv does not number the unknowns"
    if "M" in read:
        k, kappa = about["k"], about["kappa"]
        right = read["M"] @ read["zeta_before"] + k * read["source"]
        zeta = spsolve((read["M"] + k * kappa * read["L"]).tocsc(), right)
        damage = 1.0 - read["zeta"].min()
        if not damage > 1e-3 or abs(zeta - read["zeta"]).max() > 1e-10:
            yield f"ζ differs by {abs(zeta - read['zeta']).max()}; damage {damage}"
    print(folder.name, "open" if (p == 0.0).any() else "", "closed" if (p > 0.0).any() else "", len(read["u_D"]))


for folder in map(Path, sys.argv[1:]):
    for problem in check(folder):
        print(f"WRONG {folder}: {problem}")
