"""Writes the plane mesh FILE [MATERIALS] of another program as MSH 4.1 to stdout. The suffix names the module that reads it.

MATERIALS is the array of the numbers of materials, in formats with arrays.
"""
import importlib
import sys
from pathlib import Path

from meshes import msh
from meshes.description import Mesh

READERS = {".inp": "abaqus", ".unv": "universal", ".bdf": "nastran", ".nas": "nastran"}


def main(program):
    """Returns the exit code. A message on stderr says why a file is refused."""
    path, mesh = Path(sys.argv[1]), Mesh()
    mesh.materials = sys.argv[2] if len(sys.argv) > 2 else None
    try:
        importlib.import_module(f"meshes.{READERS.get(path.suffix.lower(), 'by_meshio')}").read(path, mesh)
    except ImportError as error:
        if (error.name or "").startswith("pyNastran"):
            sys.exit("Nastran is read by pyNastran, which Python lacks: pip install pyNastran in a virtual environment and set PYTHON=… "
                     "to its python; or export the mesh as .inp, .unv or .msh")
        sys.exit(f"Python lacks {error.name}, which reads this file (Debian: apt install python3-{error.name}; or PYTHON=… for "
                 "another Python)")
    except (Exception, SystemExit) as error:
        # meshio ends the program where it cannot read a file; the messages of these modules are texts.
        if isinstance(error, SystemExit) and isinstance(error.code, str):
            raise
        reason = f"{type(error).__name__}: {error}".splitlines()[0].rstrip(": ")
        sys.exit(f"it cannot be read as {path.suffix} ({reason}); export it as .inp, .unv or .msh")
    mesh.check()
    sys.stdout.write(msh.text(mesh))
