#!/usr/bin/python3
"""Words of the hand-written pages, and the links between them.

Prints the words of each page and their total. Exit code 1 if the total exceeds LIMIT, or if a relative link leads to a file or
to a heading that does not exist.
"""

import re
import subprocess
import sys
from pathlib import Path

# The largest total of words.
LIMIT = 27_500
# Pages that programs write, or that are parts of the program or of the tests.
GENERATED = {"geo/KEYS.md", "validation/CONSTANTS.md", "src/command/export.md"}
ROOT = Path(__file__).resolve().parent.parent


def pages():
    """The paths of all pages, relative to the root."""
    listed = subprocess.run(["git", "ls-files", "--cached", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    paths = [path for path in listed.stdout.split() if (ROOT / path).exists()]
    return [path for path in paths if "fixtures/" not in path]


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
    text = re.sub(r"^```.*?^```|`[^`\n]*`", "", (ROOT / path).read_text(), flags=re.M | re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        name, _, anchor = link.partition("#")
        target = (ROOT / path).parent / name if name else ROOT / path
        if re.match(r"[a-z]+:", link):
            continue
        if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target.read_text())):
            yield f"{path}: {link} leads nowhere"


words = {path: len((ROOT / path).read_text().split()) for path in pages() if path not in GENERATED}
for path, count in sorted(words.items(), key=lambda item: -item[1]):
    print(f"{count:6} {path}")
print(f"{sum(words.values()):6} of at most {LIMIT}")
# The links of scripts/keys.md are those of geo/KEYS.md, which it begins.
errors = [error for path in pages() if path != "scripts/keys.md" for error in broken(path)]
errors += ["too many words: shorten the pages"] * (sum(words.values()) > LIMIT)
sys.exit("\n".join(errors) or 0)
