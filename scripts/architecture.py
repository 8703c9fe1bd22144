#!/usr/bin/python3
"""Draws the rooms of src/ from their `use` lines: which room uses which, and what they are for.

    scripts/architecture.py geo/rooms.svg

Rooms stand in the order of lib.rs. A room may use only those before it: otherwise the exit code is 1. An arrow is left out if
a way by other rooms leads there. The exit code is also 1 if a page about the code names a file, type or function that does not exist.
"""

import re
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "src"
# The pages about the code, and the folders in which their files may stand: rooms are named without `src`.
PAGES, FOLDERS = ("ARCHITECTURE.md", "CONTRIBUTING.md"), ("", "src", "src/evolution", "src/problem", "src/observe", "src/advice", "src/scene",
                                                           "src/fem", "geo")


def rooms():
    """The names of the rooms in the order of lib.rs; the program comes last."""
    names = re.findall(r"^pub mod (\w+);", (SOURCES / "lib.rs").read_text(encoding="utf-8"), re.MULTILINE)
    return [name for name in [*names, "command"] if (SOURCES / name).is_dir()]


def files(room):
    """The texts of a room's files."""
    return [path.read_text(encoding="utf-8") for path in sorted((SOURCES / room).rglob("*.rs"))]


def used(room, names):
    """The rooms that a room names."""
    text = "\n".join(line for of in files(room) for line in of.splitlines() if not line.lstrip().startswith("//"))
    blocks = re.findall(r"\buse (?:crate|signorini)::\{(.*?)\n\};", text, re.DOTALL)
    words = re.findall(r"\b(?:crate|signorini)::(\w+)", text)
    words += [word for block in blocks for word in re.findall(r"^    (\w+)", block, re.MULTILINE)]
    words += re.findall(r"\buse (?:crate|signorini)::\{(\w+)", text)
    return [name for name in names if name in words and name != room]


def purpose(room):
    """The first sentence about the room."""
    text = (SOURCES / room / "mod.rs").read_text(encoding="utf-8")
    about = " ".join(line[3:].strip() for line in text.splitlines() if line.startswith("//!"))
    return re.sub(r"[`\[\]]", "", re.split(r"(?<=\.)\s", about)[0].rstrip("."))


def absent():
    """The links and the words in backticks of the pages that are neither a file nor a name in the code."""
    code = [path for folder in ("src", "tests", "scripts") for path in (ROOT / folder).rglob("*") if path.suffix in (".rs", ".py")]
    names = set(re.findall(r"\w+", "\n".join(path.read_text(encoding="utf-8") for path in code)))
    for page in PAGES:
        text = re.sub(r"```.*?```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL)
        links = {(word, False) for word in re.findall(r"\]\(([^)#:]+)\)", text)}
        for word, is_word in sorted(links | {(word, True) for word in re.findall(r"`([\w./:]+)`", text)}):
            is_file = word.endswith((".rs", ".py"))
            known = {path.name for path in code} if is_file else names
            is_name = is_word and "/" not in word and all(name in known for name in re.findall(r"[\w.]+" if is_file else r"\w+", word))
            if not is_name and "NAME" not in word and not any((ROOT / folder / word).exists() for folder in FOLDERS):
                yield f"error: {page}: `{word}` does not exist"


def needed(uses):
    """The arrows to which no other way leads."""
    def reached(room):
        return {below for of in uses[room] for below in (of, *reached(of))}

    return {room: [of for of in uses[room] if not any(of in reached(other) for other in uses[room] if other != of)]
            for room in uses}


def draw(path):
    from matplotlib import pyplot as plt

    plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "rooms", "font.family": "sans-serif"})
    names = rooms()
    uses = {room: used(room, names) for room in names}
    wrong = [(room, of) for room in names for of in uses[room] if names.index(of) > names.index(room)]
    wrong = [f"error: src/{room} uses src/{of}, which stands after it in lib.rs" for room, of in wrong]
    if wrong := [*wrong, *absent()]:
        sys.exit("\n".join(wrong))
    figure, axes = plt.subplots(figsize=(9, 0.45 * len(names)), layout="constrained")
    for y, room in enumerate(names):
        axes.text(0, y, room, weight="bold", va="center", ha="right", size=12)
        axes.text(0.3, y, textwrap.fill(purpose(room), 84), va="center", size=9)
    for room, below in needed(uses).items():
        for of in below:
            top, foot = names.index(room), names.index(of)
            bend = 0.0 if top - foot == 1 else 0.25
            axes.annotate("", (-1.75, foot + 0.1), (-1.75, top - 0.1), arrowprops={
                "arrowstyle": "->", "color": "tab:blue", "lw": 1.2, "connectionstyle": f"arc3,rad={bend}"})
    axes.set(xlim=(-2.6, 9), ylim=(-0.6, len(names) - 0.4))
    axes.axis("off")
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    draw(sys.argv[1])
