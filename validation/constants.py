#!/usr/bin/env python3
"""Prints the register of the constants that were tuned, validation/CONSTANTS.md, from their comments in src:

    validation/constants.py > validation/CONSTANTS.md      (make constants)

A tuned constant has two paragraphs: its meaning, and what other values do, in the form

    /// Tuned on SCENES. Half: EFFECT. Twice: EFFECT.

Another value may stand in place of "Half" or "Twice". A name that two constants have is an error."""

import re
import sys
from collections import Counter
from pathlib import Path

SRC = Path(__file__).resolve().parents[1] / "src"
CONSTANT = re.compile(r"((?:^ *///.*\n)*)^ *(?:pub(?:\([a-z:]+\))? )?(?:const|static) ([A-Z][A-Z_0-9]+): [^=]+?=\s*([^;]+);", re.M)
TUNED = re.compile(r"Tuned on (?P<scenes>.+?)\. (?P<lower>\S+?): (?P<less>.+?)\. (?P<upper>\S+?): (?P<more>.+?)\.$")
HEAD = """# Constants that were tuned

`make constants` makes this page from the comments in `src`, and a test compares both. Constants were halved and doubled
(or set to the value that is named), and their scenes were run again, 31 of them on this state of the code; statements about
bars that fail are older. The other constants in `src` follow from theory, from
rounding or from a file format, or only choose when a note appears; their comments say which.

| scenes | runs |
|---|---|
| the 13 adapted runs | all nine scenes of `geo` with `--accuracy 0.1`; `beam`, `bridge-half`, `lshape-rolling`, `square-table1` with 0.03 |
| the 6 plain runs | `bridge`, `hertz`, `lshape`, `lshape-rolling`, `square`, `square-table1` as they are |
| the 4 penalty-duality runs | `bridge`, `hertz`, `lshape`, `square-table1` with `--solver penalty-duality` |
| the handbook | `make handbook` |

Numbers are sums over the runs, of triangles, time steps or iterations. To tune a constant, change it in `src`, run its scenes,
enter the effects in its comment, and run `make constants`.

| constant | value | meaning | tuned on | less | more |
|---|---|---|---|---|---|"""


def constants():
    """Of each constant: file, comment, name, value."""
    for file in sorted(SRC.rglob("*.rs")):
        for comment, name, value in CONSTANT.findall(file.read_text()):
            lines = [line.strip().removeprefix("///").strip() for line in comment.splitlines()]
            yield file.relative_to(SRC), "\n".join(lines), name, value


def main():
    found = list(constants())
    twice = [name for name, count in Counter(name for _, _, name, _ in found).items() if count > 1]
    if twice:
        sys.exit(f"these names have several definitions in src: {', '.join(twice)}")
    print(HEAD)
    for file, comment, name, value in found:
        meaning, _, tuned = comment.rpartition("\n\n")
        if not tuned.startswith("Tuned"):
            continue
        effect = TUNED.match(tuned.replace("\n", " "))
        if not effect:
            sys.exit(f'{file}: {name}: expected "Tuned on SCENES. Half: EFFECT. Twice: EFFECT."')
        cells = [f"`{name}`<br>[{file}](../src/{file})", value, meaning, effect["scenes"],
                 f"{effect['lower']}: {effect['less']}", f"{effect['upper']}: {effect['more']}"]
        print("| " + " | ".join(cell.replace("\n", " ").replace("|", "\\|").replace("[`", "`").replace("`]", "`") for cell in cells) + " |")


if __name__ == "__main__":
    main()
