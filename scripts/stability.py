"""Draws the maps of the stability study: stability.py FOLDER [MAP...]

Reads FOLDER/<map>.csv as `signorini-study stability` writes it, and draws FOLDER/<map>.png.
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from stability import (  # noqa: E402
    conditioning,
    lost_contact,
    maximum_principle,
    penalty,
    random_contact,
    scales,
    step_size,
    tao_types,
)

MAPS = {
    "step-size": step_size,
    "maximum-principle": maximum_principle,
    "penalty-duality": penalty,
    "tao-types": tao_types,
    "active-set": random_contact,
    "conditioning": conditioning,
    "lost-contact": lost_contact,
    "scales": scales,
}


def main(folder, names):
    for name in names or MAPS:
        table = Path(folder) / f"{name}.csv"
        if not table.exists():
            print(f"no {table}: run `signorini-study stability {name}` first", file=sys.stderr)
            continue
        with open(table, newline="") as rows:
            MAPS[name].draw(list(csv.DictReader(rows)), table.with_suffix(".png"))
        print(table.with_suffix(".png"))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
