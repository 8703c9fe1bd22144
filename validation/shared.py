"""The common modules of figures and validation are in scripts/. Importing this module adds the folder to the path."""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# After this folder, so that its own modules come first.
sys.path.append(str(ROOT / "scripts"))


def out_of(scene):
    """The folder of the results about a scene: out/ of this repository for its own scenes, and out/ beside another one."""
    folder = Path(scene).resolve().parent
    return (ROOT if ROOT in (folder, *folder.parents) else folder) / "out"


def parser_of(doc, out=None):
    """A parser of a command line with --binary, and with --out below out/ if it has a default."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", type=lambda text: Path(text).resolve(), default=ROOT / "target/release/signorini")
    if out:
        parser.add_argument("--out", type=Path, default=ROOT / "out" / out)
    return parser


def scales(rows, names):
    """Per figure: the largest value of its kind in the rows of a run; of ζ, the largest 1 − ζ."""
    largest = {n: max(abs((n.startswith("zeta_") or n.endswith(".zeta")) - row[n]) for row in rows if n in row)
               for n in names if any(n in row for row in rows)}

    def kind(name):
        last = name.rpartition(".")[2]
        of = next((k for k in ("force_", "u_", "zeta", "stress", "von_mises", "principal") if last.startswith(k)), last)
        return "stress" if of in ("von_mises", "principal") else of

    def scale(name):
        if kind(name) == "zeta" and name != "zeta_mean":
            return largest.get("zeta_min", largest[name])
        return max((v for m, v in largest.items() if kind(m) == kind(name) and ("." in m) == ("." in name)), default=0.0)

    return {name: scale(name) for name in names}
