#!/usr/bin/python3
"""The accuracy asked for against the true error: asked.py --binary FILE SCENE…

Runs scenes of geo/ that reach their end with `--accuracy` 0.1, 0.03, 0.01 and 0.003, without mesh
parameters (a grading) and steps of their own, as chart.py does. Prints the errors of u (energy norm) and the
damage (L²) at the end over the accuracy, the unknowns of u and the seconds of the whole process; exit
code 1 if the larger error is above its accuracy. (That of a figure may ask for much less: make promises.)
"""

import argparse
import sys
import tempfile
from pathlib import Path

from chart import Choice, Study


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default="target/release/signorini")
    parser.add_argument("scenes", nargs="+")
    arguments = parser.parse_args()
    outside, lines = 0, []
    for path in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            study = Study(arguments.binary, path, Path(folder))
            for accuracy in (0.1, 0.03, 0.01, 0.003):
                study.run(Choice("accuracy", accuracy=accuracy))
                row = study.rows[-1]
                u, damage, larger = (row[key] / accuracy for key in ("u", "damage", "error"))
                outside += larger > 1
                lines.append(f"{study.name}, {accuracy}: {larger:.2f} (u {u:.2f}, damage {damage:.2f}), "
                             f"{2 * row['nodes']} unknowns, {row['seconds']:.2f} s")
    print("true error over the accuracy", *lines, sep="\n")
    sys.exit(outside > 0)


if __name__ == "__main__":
    main()
