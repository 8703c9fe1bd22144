#!/usr/bin/env python3
"""Euler's steps and two-step differences with the same number of steps: results/schemes_zeta_min.csv.

    schemes.py [--binary PATH]

Prints the error of min ζ relative to the damage, against adaptive steps of tolerance 1e-5, on coarse meshes.
"""

import json
import subprocess
import tempfile
from pathlib import Path

from shared import ROOT, parser_of

LOAD = "boundary.right.traction"
SQUARE, COARSE = "square-table1", "mesh.size=0.0625"
# Name: the scene and its changes.
CASES = {
    "`lshape`": ("lshape", "mesh.size=0.5"), "`lshape-rolling`": ("lshape-rolling", "mesh.size=0.5"),
    "`bridge-half`": ("bridge-half",), "`beam`": ("beam",), "`square-mild`": ("square-mild", COARSE),
    "`square-table1`": (SQUARE, COARSE),
    "jump": (SQUARE, COARSE, f'{LOAD}=["if(t < 0.33, 0, -5)", 0]'),
    "kinks": (SQUARE, COARSE, f'{LOAD}=["-5*abs(2*t - 1)", 0]'),
    "pulse": (SQUARE, COARSE, f'{LOAD}=["-8*sin(pi*t)^2", 0]'),
    "λ_W": (SQUARE, COARSE, f'{LOAD}=["-5*t", 0]', "damage.lambda_w=0.05"),
    "near ζ_\\*": (SQUARE, COARSE, "damage.lambda_u=430"),
}


def least(binary, folder, scene, *sets):
    """min ζ at the end of a run."""
    words = [word for entry in (*sets, "output.every=0") for word in ("--set", entry)]
    subprocess.run([binary, "run", ROOT / "geo" / f"{scene}.toml", "--out", folder, *words], check=True, capture_output=True)
    return json.loads((folder / "summary.json").read_text())["figures"]["zeta_min"]["value"]


def main():
    binary = parser_of(__doc__).parse_args().binary
    with tempfile.TemporaryDirectory() as folder:
        def errors(scheme, count):
            for case, exact in references.items():
                found = least(binary, Path(folder), *CASES[case], f"time.step={1 / count}", f"time.scheme={scheme}")
                yield abs(found - exact) / (1.0 - exact)

        steps = ("time.step=auto", "time.tolerance=1e-5")
        references = {case: least(binary, Path(folder), *of, *steps) for case, of in CASES.items()}
        print("| steps |", " | ".join(references), "|\n|" + "---|" * (1 + len(references)))
        for scheme, count in (("euler", 10), ("euler", 80), ("bdf2", 10), ("bdf2", 80)):
            print(f"| `{scheme}`, {count} |", " | ".join(f"{error:.1e}" for error in errors(scheme, count)), "|", flush=True)


if __name__ == "__main__":
    main()
