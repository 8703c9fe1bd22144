#!/usr/bin/python3
"""Prints the licences of the program and of all that is linked into it (`make licences`).

The texts of the crates are those in their packages. `cargo deny` checks which licences they have (deny.toml). Exit code 1 if a crate
has no text."""

import json
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEAD = """\
The program signorini as a whole is under the GNU General Public License, version 3 or later. Its own code is under the MIT licence or the
Apache licence, version 2.0. It contains, or loads, these libraries:

PETSc                                 BSD-2-Clause
SuiteSparse: CHOLMOD                  LGPL-2.1-or-later; its part Supernodal GPL-2.0-or-later
SuiteSparse: AMD, CAMD, COLAMD,       BSD-3-Clause
  CCOLAMD, SuiteSparse_config
OpenBLAS, LAPACK                      BSD-3-Clause
libgomp, libgfortran, libgcc          GPL-3.0-or-later with the GCC Runtime Library Exception
libquadmath                           LGPL-2.0-or-later
glibc                                 LGPL-2.1-or-later
Rust's standard library               MIT OR Apache-2.0
only for several processes, not in the wheel:
Open MPI                              BSD-3-Clause
MUMPS, PT-Scotch (called by PETSc)    CeCILL-C

Debian's PETSc loads more libraries, which the program does not call; their licences are in /usr/share/doc. The program starts these as
programs of their own: gmsh (GPL-2.0-or-later with an exception for libraries that it links), Python (PSF-2.0) with numpy
(BSD-3-Clause), matplotlib (PSF-2.0) and meshio (MIT).

Below are the notices of the JavaScript libraries in its reports and of all crates in it."""


def crates():
    """The crates that are linked into the program on this machine."""
    host = re.search("^host: (.*)", said("rustc", "-vV"), re.MULTILINE)[1]
    data = json.loads(said("cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host))
    nodes = {node["id"]: node["deps"] for node in data["resolve"]["nodes"]}
    packages = {package["id"]: package for package in data["packages"]}
    root = next(id for id, package in packages.items() if package["name"] == "signorini")
    rest, found = [root], set()
    while rest:
        id = rest.pop()
        if id not in found:
            found.add(id)
            rest += [of["pkg"] for of in nodes[id] if any(kind["kind"] is None for kind in of["dep_kinds"])]
    return sorted((packages[id] for id in found - {root}), key=lambda package: (package["name"], package["version"]))


def said(*words):
    return subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def notices():
    """The notices of all crates; a text that several have stands there once."""
    texts, names = {}, re.compile("licen[cs]e|copying|copyright|unlicense|notice", re.IGNORECASE)
    for crate in crates():
        files = [file for file in Path(crate["manifest_path"]).parent.iterdir() if file.is_file() and names.match(file.name)]
        if not files:
            raise SystemExit(f"{crate['name']} {crate['version']} has no text of its licence: name it in scripts/notices.py")
        for file in sorted(files):
            texts.setdefault(file.read_text(encoding="utf-8").strip(), []).append(
                f"{crate['name']} {crate['version']} ({crate['license']})")
    return ["\n".join(crates) + "\n\n" + text for text, crates in texts.items()]


if __name__ == "__main__":
    page = (ROOT / "scripts/page/libraries.js").read_text(encoding="utf-8")
    scripts = page[page.index("/*") + 2:page.index("*/")].strip()
    print(f"\n\n{'-' * 80}\n\n".join([HEAD, scripts, *notices()]))
