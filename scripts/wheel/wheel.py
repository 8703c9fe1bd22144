"""wheel.py PROGRAM STAND_INS LICENSES GMSH OUT: packs a wheel of the program, of the modules that read its results, and of what gmsh
needs. GMSH is the version of gmsh for which the stand-ins were made."""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
TARGET = "x86_64-unknown-linux-gnu"


def crates():
    """The folders of the crates in the program, by name and version."""
    words = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", TARGET]
    data = json.loads(subprocess.run(words, cwd=HERE.parent, check=True, capture_output=True).stdout)
    nodes = {node["id"]: node["deps"] for node in data["resolve"]["nodes"]}
    packages = {package["id"]: package for package in data["packages"]}
    rest, found = [i for i, package in packages.items() if package["name"] == "signorini"], {}
    while rest:
        package = packages[rest.pop()]
        if package["id"] not in found:
            found[package["id"]] = package
            rest += [of["pkg"] for of in nodes[package["id"]] if any(kind["kind"] is None for kind in of["dep_kinds"])]
    return sorted((f"{p['name']} {p['version']}", p["license"], Path(p["manifest_path"]).parent) for p in found.values())


def crate_licenses():
    """The licences of all crates; a text that several have stands there once."""
    texts, names = {}, re.compile("licen[cs]e|copying|copyright|unlicense|notice", re.IGNORECASE)
    for name, license, folder in crates():
        for file in sorted(file for file in folder.iterdir() if file.is_file() and names.match(file.name)):
            texts.setdefault(file.read_text().strip(), []).append(f"{name} ({license})")
    return "\n\n".join("\n".join(names) + "\n\n" + text for text, names in texts.items())


def glibc(files):
    """The newest version of glibc whose symbols the files use."""
    said = subprocess.run(["objdump", "-T", *files], check=True, capture_output=True, text=True).stdout
    return max(int(minor) for minor in re.findall(r"GLIBC_2\.(\d+)", said))


def pack(program, stand_ins, licenses, gmsh, out):
    setup = tomllib.loads((HERE / "pyproject.toml").read_text())
    project = setup["project"]
    name = f"signorini-{project['version']}"
    needed = [f"gmsh=={gmsh}", *project["dependencies"]]
    extras = [f'{package}; extra == "{extra}"' for extra, all in project["optional-dependencies"].items() for package in all]
    lines = [
        "Metadata-Version: 2.4", "Name: signorini", f"Version: {project['version']}",
        "Summary: Quasistatic contact of a damageable elastic body with a rigid foundation, on PETSc",
        "License-Expression: GPL-3.0-or-later", "Description-Content-Type: text/plain",
        f"Requires-Python: {project['requires-python']}",
        *(f"Requires-Dist: {package}" for package in needed + extras),
        *(f"Provides-Extra: {extra}" for extra in project["optional-dependencies"]),
    ]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        info, data = root / f"{name}.dist-info", root / f"{name}.data"
        for made in [info, data / "scripts", data / "data/lib"]:
            made.mkdir(parents=True)
        shutil.copy(program, data / "scripts/signorini")
        shutil.copytree(stand_ins, data / "data/lib/signorini")
        for module in setup["tool"]["setuptools"]["py-modules"]:
            shutil.copy(HERE / f"{module}.py", root)
        shutil.copytree(licenses, info / "licenses")
        for file in HERE.parent.glob("LICENSE-*"):
            shutil.copy(file, info / "licenses")
        (info / "licenses/crates").write_text(crate_licenses())
        lines += [f"License-File: {file.name}" for file in sorted((info / "licenses").iterdir())]
        # The program is under MIT or Apache-2.0; some of its libraries make the whole GPL.
        lines += ["", "The own code is under MIT or Apache-2.0. CHOLMOD's supernodal part is under the GPL, version 2 or later, and crates",
                  "under Apache-2.0 need its version 3. licenses/SOURCES says where the sources of the libraries are."]
        (info / "METADATA").write_text("\n".join(lines) + "\n")
        minor = glibc([data / "scripts/signorini", data / "data/lib/signorini/libgomp.so.1"])
        tag = f"py3-none-manylinux_2_{minor}_x86_64"
        (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: signorini\nRoot-Is-Purelib: false\nTag: {tag}\n")
        Path(out).mkdir(parents=True, exist_ok=True)
        subprocess.run([sys.executable, "-m", "wheel", "pack", "--dest-dir", out, root], check=True)


pack(*sys.argv[1:])
