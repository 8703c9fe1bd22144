"""The common modules of figures and validation are in scripts/. Importing this module adds the folder to the path."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# After this folder, so that its own modules come first.
sys.path.append(str(ROOT / "scripts"))
