"""What the figures and the validation share is in scripts/; importing this module makes it importable."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Behind this folder: the names here win.
sys.path.append(str(ROOT / "scripts"))
