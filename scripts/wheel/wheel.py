"""wheel.py PROGRAM STAND_INS LICENSES GMSH OUT: packs a wheel of the program, its guides, the modules that read its results, and of what gmsh
needs. GMSH is the version of gmsh for which the stand-ins were made."""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]


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
        documents = data / "data/share/doc/signorini"
        subprocess.run([sys.executable, HERE / "pages.py", documents], check=True)
        notices = subprocess.run([sys.executable, HERE / "notices.py"], check=True, capture_output=True).stdout
        for file in [info / "licenses/NOTICES", documents / "NOTICES"]:
            file.write_bytes(notices)
        lines += [f"License-File: {file.name}" for file in sorted((info / "licenses").iterdir())]
        # The program is under MIT or Apache-2.0; some of its libraries make the whole GPL.
        lines += ["", "The own code is under MIT or Apache-2.0. CHOLMOD's supernodal part is under the GPL, version 2 or later, and crates",
                  "under Apache-2.0 need its version 3. licenses/NOTICES names the licences of all parts, licenses/SOURCES says where their sources are."]
        (info / "METADATA").write_text("\n".join(lines) + "\n")
        minor = glibc([data / "scripts/signorini", data / "data/lib/signorini/libgomp.so.1"])
        tag = f"py3-none-manylinux_2_{minor}_x86_64"
        (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: signorini\nRoot-Is-Purelib: false\nTag: {tag}\n")
        Path(out).mkdir(parents=True, exist_ok=True)
        subprocess.run([sys.executable, "-m", "wheel", "pack", "--dest-dir", out, root], check=True)


pack(*sys.argv[1:])
