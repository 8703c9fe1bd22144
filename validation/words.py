#!/usr/bin/python3
"""Words of the hand-written pages, their links, and the files and commands that they name.

Prints the words of each page and their total. Exit code 1 if a page or the total is too long, if a relative link leads to a file or
to a heading that does not exist, or if code names a file, a target of make, a command or an option that does not exist.
"""

import re
import subprocess
import sys
from pathlib import Path

# The largest total of words. A word has a letter or a digit: the bars of a table do not count.
LIMIT = 19_800
# The largest numbers of words and lines of single pages; a how-to's first lines are what `signorini explain` prints.
WORDS, LINES, HOW_TO, FIRST, COLUMNS = {"CHANGELOG.md": 1500}, {"README.md": 150}, 60, 20, 80
# Pages that programs write, or that are parts of the program or of the tests.
GENERATED = {"geo/KEYS.md", "validation/CONSTANTS.md", "src/command/export.md"}
# Its links are those of geo/KEYS.md, which begins with it.
PART = "scripts/keys.md"
ROOT = Path(__file__).resolve().parent.parent


def git(*patterns):
    """The paths of the files of the repository that match."""
    listed = subprocess.run(["git", "ls-files", "--cached", *patterns], cwd=ROOT, capture_output=True, text=True, check=True)
    return [path for path in listed.stdout.split("\n") if path and (ROOT / path).exists()]


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def words(path):
    """The number of words of a page without the parts that a program writes into it."""
    text = re.sub(r"<!-- .*? is written by .*?-->.*?<!-- end .*?-->", "", read(path), flags=re.S)
    return sum(any(letter.isalnum() for letter in word) for word in text.split())


def anchors(text):
    """The anchors that GitHub gives to the headings of a page; equal headings are numbered."""
    found = set()
    for heading in re.findall(r"^#+ +(.*?) *$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), flags=re.M):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        copies = sum(re.fullmatch(re.escape(anchor) + r"(-\d+)?", other) is not None for other in found)
        found.add(f"{anchor}-{copies}" if copies else anchor)
    return found


def broken(path):
    """The relative links of the page at `path` that lead nowhere."""
    text = re.sub(r"^```.*?^```|`[^`\n]*`", "", read(path), flags=re.M | re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        name, _, anchor = link.partition("#")
        target = (ROOT / path).parent / name if name else ROOT / path
        if re.match(r"[a-z]+:", link):
            continue
        if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target.read_text(encoding="utf-8"))):
            yield f"{path}: {link} leads nowhere"


def too_long(path):
    """What is too long on a page."""
    lines, is_how_to = read(path).splitlines(), path.startswith("geo/how-to/")
    most = HOW_TO if is_how_to else LINES.get(path, len(lines))
    if len(lines) > most:
        yield f"{path}: {len(lines)} lines of at most {most}"
    if words(path) > WORDS.get(path, LIMIT):
        yield f"{path}: {words(path)} words of at most {WORDS[path]}"
    if is_how_to and (any(len(line) > COLUMNS or number and re.match("#+ ", line) for number, line in enumerate(lines[:FIRST]))
                      or all(lines[FIRST - 1:FIRST + 1])):
        yield f"{path}: the first {FIRST} lines have at most {COLUMNS} columns, one heading, and end with a paragraph"


def known():
    """The commands of the program, its options, and the targets of make."""
    commands = re.search(r"enum Command \{(.*?)^\}", read("src/main.rs"), flags=re.M | re.S)[1]
    commands = {name.lower() for name in re.findall(r"^    (\w+)", commands, flags=re.M)} | {"help"}
    options = {"--help", "--version"}
    for path in git("src/main.rs", "src/command/*.rs"):
        for field in re.findall(r"#\[arg\([^\]]*?\blong\b[^\]]*\]\s*(?:pub )?(\w+):", read(path)):
            options.add("--" + field.replace("_", "-"))
    for path in git("scripts/*.py"):
        options.update(re.findall(r"\"(--[a-z-]+)\"", read(path)))
    return commands, options, set(re.findall(r"^([a-z-]+):", read("Makefile"), flags=re.M))


def absent(path, commands, options, targets):
    """The files, commands, options and targets in the code of a page that do not exist."""
    text = read(path)
    blocks = re.findall(r"^```sh\n(.*?)^```", text, flags=re.M | re.S) + re.findall(r"^    (.*)$", text, flags=re.M)
    spans = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))
    for line in [*spans, *(line for block in blocks for line in block.splitlines())]:
        line, before = line.split("  #")[0].strip(), line.split(" -- ")[0]
        called = re.match(r"(?:\S*/)?signorini ([a-z]+)\b", line)
        if called and called[1] not in commands:
            yield f"{path}: `signorini {called[1]}` does not exist"
        if called or (path.startswith("geo/") and line.startswith("--")):
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", before):
                if option not in options:
                    yield f"{path}: the option {option} does not exist"
        target = re.match(r"make ([a-z-]+)(?= |$)", line)
        if target and target[1] not in targets:
            yield f"{path}: `{line}` is no target"
        if re.fullmatch(r"(geo|src|scripts|tests|validation|examples)/[\w./=-]+", line) and "NAME" not in line and not (ROOT / line).exists():
            yield f"{path}: {line} does not exist"


pages = [path for path in git("*.md") if "fixtures/" not in path]
counts = {path: words(path) for path in pages if path not in GENERATED}
for path, count in sorted(counts.items(), key=lambda item: -item[1]):
    print(f"{count:6} {path}")
print(f"{sum(counts.values()):6} of at most {LIMIT}")
errors = [error for path in pages if path != PART for error in broken(path)]
names = known()
errors += [error for path in counts for error in too_long(path)]
# CHANGELOG names what was.
errors += [error for path in counts if path != "CHANGELOG.md" for error in absent(path, *names)]
errors += ["too many words: shorten the pages"] * (sum(counts.values()) > LIMIT)
sys.exit("\n".join(errors) or 0)
