#!/usr/bin/python3
"""The site of the pages, with the gallery.

    book.py [--binary FILE] [--mdbook FILE] [--out FOLDER] [--no-gallery]

Copies all pages, and the files that they link to, to FOLDER/src, with the gallery (gallery.py) and a table of contents; mdBook makes
FOLDER/book of them. Exit code 1 if a link or an anchor leads nowhere, if a page needs the network, or if an answer of the gallery misses
the published one.
"""

import re
import shutil
import subprocess
import sys
from fnmatch import fnmatch
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from gallery import HERE, gallery, parser_of
from shared import ROOT

# The four kinds of page (Diátaxis), by patterns; the first pattern that fits counts.
KINDS = {
    "Tutorial": ["geo/TUTORIAL.md"],
    "How-to": ["INSTALL.md", "geo/how-to/*", "CONTRIBUTING.md"],
    "Reference": ["geo/*", "validation/CONSTANTS.md", "validation/MESHES.md", "validation/REPORTS.md", "CHANGELOG.md"],
    "Explanation": ["validation/*", "ARCHITECTURE.md"],
}
# Pages that are a part of the program or of the tests.
OTHERS = ["scripts/*", "src/*", "tests/*"]
# Linked files that stay as they are; others become pages.
SHOWN = {".png", ".svg", ".csv", ".json", ".ipynb"}


def listed():
    """The paths of all pages by kind, in order."""
    paths = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    paths = [path for path in paths if (ROOT / path).exists() and not any(fnmatch(path, other) for other in OTHERS)]
    patterns = [(kind, pattern) for kind, patterns in KINDS.items() for pattern in patterns]
    found = {of: [] for of in patterns}
    for path in paths:
        if path != "README.md":
            of = next((of for of in patterns if fnmatch(path, of[1])), None)
            if of is None:
                sys.exit(f"{path} has no kind: add it to KINDS in {Path(__file__).name}")
            found[of].append(path)
    return {kind: [path for of in patterns if of[0] == kind for path in sorted(found[of], key=title)] for kind in KINDS}


def title(path):
    """The first heading of a page."""
    return re.search(r"^# +(.*)", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)[1]


def show(path, source):
    """Writes a linked file or folder to the site. Returns the ending that the link needs there."""
    file, to = ROOT / path, source / path
    to.parent.mkdir(parents=True, exist_ok=True)
    if file.is_dir():
        names = sorted(other.name for other in file.iterdir() if other.suffix in SHOWN)
        for name in names:
            show(f"{path}/{name}", source)
        body = "\n".join(f'<a href="{file.name}/{name}">{name}</a>' for name in names)
    elif file.suffix in SHOWN:
        shutil.copy(file, to)
        return ""
    else:
        body = escape(file.read_text(encoding="utf-8"))
    to.with_name(f"{to.name}.html").write_text(
        f'<!DOCTYPE html><meta charset="utf-8"><title>{path}</title><pre>{body}</pre>', encoding="utf-8")
    return ".html"


def copy(path, source):
    """Copies a page with the files that it links to."""
    def linked(match):
        link, _, anchor = match[1].partition("#")
        if re.match("[a-z]+:", link) or not link or link.endswith(".md"):
            return match[0]
        file = ((ROOT / path).parent / link).resolve()
        if not file.exists():
            return match[0]
        return f"]({link.rstrip('/')}{show(file.relative_to(ROOT).as_posix(), source)}{'#' * bool(anchor)}{anchor})"

    to = source / path
    to.parent.mkdir(parents=True, exist_ok=True)
    parts = re.split(r"(^```.*?^```|`[^`\n]*`)", (ROOT / path).read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    to.write_text("".join(part if part.startswith("`") else re.sub(r"\]\(([^)\s]+)\)", linked, part) for part in parts),
                  encoding="utf-8")


def contents(kinds, pages):
    """SUMMARY.md, mdBook's table of contents."""
    yield "# Summary\n\n[signorini](README.md)\n"
    for kind, paths in kinds.items():
        yield f"# {kind}\n"
        yield from (f"- [{title(path)}]({path})" for path in paths)
        yield ""
    yield "# Gallery\n\n- [All scenes](gallery/index.md)"
    yield from (f"- [{heading}](gallery/{name}.md)" for name, heading in pages.items())


class Links(HTMLParser):
    """The links, the files that it loads, and the anchors of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors = set(), set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.anchors.update(value for name, value in attrs.items() if name in ("id", "name") and value)
        if tag == "a" and attrs.get("href"):
            self.links.add(attrs["href"])
        elif attrs.get("src") or tag == "link":
            self.loads.add(attrs.get("src") or attrs["href"])


def errors(book):
    """What leads nowhere, or needs the network, in the pages of a book."""
    pages = {path: Links(path.read_text(encoding="utf-8")) for path in sorted(book.rglob("*.html"))}
    for path, page in pages.items():
        if path.name == "404.html":
            continue
        for link in sorted(page.links | page.loads):
            to = urlsplit(link)
            if to.scheme or to.netloc:
                if link in page.loads and to.scheme != "data":
                    yield f"{path.relative_to(book)}: {link} needs the network"
                continue
            target = (path.parent / unquote(to.path)).resolve() if to.path else path
            anchor = unquote(to.fragment)
            if not target.is_file() or anchor and target in pages and anchor not in pages[target].anchors:
                yield f"{path.relative_to(book)}: {link} leads nowhere"
    for path in book.rglob("*.css"):
        if re.search(r"url\(['\"]?(https?:)?//", path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(book)} needs the network"


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--mdbook", default="mdbook")
    parser.add_argument("--out", type=Path, default=ROOT / "target" / "site")
    parser.add_argument("--no-gallery", action="store_true", help="take the pages of the gallery that are there")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    pages, missed = {}, False
    if not arguments.no_gallery:
        shutil.rmtree(out, ignore_errors=True)
        pages, missed = gallery(arguments.binary, out)
    elif (out / "gallery").exists():
        pages = {path.stem: title(path) for path in sorted((out / "gallery").glob("*.md")) if path.stem != "index"}
    source, kinds = out / "src", listed()
    for folder in (source, out / "book"):
        shutil.rmtree(folder, ignore_errors=True)
    for path in ["README.md", *(path for paths in kinds.values() for path in paths)]:
        copy(path, source)
    shutil.copytree(out / "gallery", source / "gallery")
    (source / "SUMMARY.md").write_text("\n".join(contents(kinds, pages)) + "\n", encoding="utf-8")
    for name in ("book.toml", "site.css"):
        shutil.copy(HERE / name, out)
    subprocess.run([arguments.mdbook, "build", out], check=True)
    found = list(errors(out / "book"))
    print("\n".join(found) or f"{out / 'book' / 'index.html'}: no link leads nowhere")
    return int(bool(found) or missed)


if __name__ == "__main__":
    sys.exit(main())
