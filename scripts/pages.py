#!/usr/bin/python3
"""pages.py FOLDER: writes the guides, the scenes and the tables behind them into FOLDER, for a package or a wheel.

A link to a file that is not among them becomes its text."""

import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FILES = ["README.md", "geo/*.md", "geo/how-to/*.md", "geo/*.geo", "geo/*.toml", "geo/*.ipynb", "geo/*.png",
         "geo/scene.schema.json", "validation/*.md", "validation/results/*.csv", "examples/*.rs"]


def with_links(text, page, shipped):
    """The text of a page, with the relative links that lead to shipped files."""
    def link(found):
        target = (page.parent / found["path"]).resolve()
        stays = re.match("[a-z]+:", found["path"]) or not found["path"] or target in shipped or target == ROOT / "validation/results"
        return found[0] if stays else found["text"]
    return re.sub(r"!?\[(?P<text>[^]]*)\]\((?P<path>[^)\s#]*)(#[^)\s]*)?\)", link, text)


def main(folder):
    shipped = {path for pattern in FILES for path in ROOT.glob(pattern)}
    for path in shipped:
        to = folder / path.relative_to(ROOT)
        to.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            to.write_text(with_links(path.read_text(encoding="utf-8"), path, shipped), encoding="utf-8")
        else:
            shutil.copyfile(path, to)


main(Path(sys.argv[1]))
