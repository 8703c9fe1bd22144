"""The common modules of figures and validation are in scripts/. Importing this module adds the folder to the path."""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# After this folder, so that its own modules come first.
sys.path.append(str(ROOT / "scripts"))


def parser_of(doc, out=None):
    """A parser of a command line with --binary, and with --out below out/ if it has a default."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", type=lambda text: Path(text).resolve(), default=ROOT / "target/release/signorini")
    if out:
        parser.add_argument("--out", type=Path, default=ROOT / "out" / out)
    return parser
