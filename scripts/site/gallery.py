#!/usr/bin/python3
"""The gallery: a page for each scene of `signorini new --list`, made by running it.

    gallery.py [--binary FILE] [--out FOLDER] [NAME…]

Each scene is written by `signorini new --from`, solved and drawn in FOLDER/runs. FOLDER/gallery gets a page and a picture for each, and
a page with all of them. Exit code 1 if an answer misses the published or closed one: if its bar and the published error do not
cover the difference.
"""

import json
import math
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE.parent), str(HERE.parents[1] / "validation")]
from bars import LEAST_BAR, barred
from handbook import truths
from shared import parser_of

LIST = HERE / "gallery.toml"


def source_of(scene):
    """The source in the comments of a scene, with links of Markdown."""
    lines = re.search(r"^# Source: (.*?)(?=\n(?!#)|\n# (?:Truth:|let |truth ))", scene, re.MULTILINE | re.DOTALL)
    return re.sub(r"https?://\S*\w/?", r"<\g<0>>", re.sub(r"\s*\n# *", " ", lines[1]))


def answers(summary, truth):
    """(figure, label, value, bar, unit, published value, its error, whether it misses) of each truth with a value."""
    for figure, (exact, own) in truth.items():
        of = summary["figures"].get(figure) or {"label": "time of the stop", "unit": summary["units"]["time"],
                                                "value": summary["stopped_at"], "bar": summary["stopped_uncertainty"]}
        if math.isfinite(exact):
            # The bar as it is printed.
            misses = of["bar"] is None or abs(of["value"] - exact) > max(of["bar"], LEAST_BAR * abs(of["value"])) + own
            yield figure, of["label"], of["value"], of["bar"], of["unit"], exact, own, misses


def text_of(value, bar, unit):
    """A value with its bar and its unit, on one line."""
    text = barred(value, bar) or f"{value:.10g}".replace("e-0", "e-")
    text = f"{f'({text})' if ' ± ' in text and unit and not text.startswith('(') else text} {unit}".strip()
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def table(rows):
    """The answers beside the published ones, in Markdown."""
    yield "| figure | this program | published or closed | |\n|---|---|---|---|"
    for figure, label, value, bar, unit, exact, own, misses in rows:
        exact = 0.0 if abs(exact) < 1e-12 * max(abs(value), bar or 0.0) else exact
        sign = "**misses it**" if misses else "agrees"
        text, closed = text_of(value, bar, unit), text_of(exact, own, unit)
        power = re.search(r"\)(e-?\d+)", text)
        if power and not own:
            closed = f"{exact / float(f'1{power[1]}'):.10g}{power[1]} {unit}"
        yield f"| {label} (`{figure}`) | {text} | {closed} | {sign} |"


def page(name, entry, binary, out):
    """(title, answers that miss) of a scene, whose page is written."""
    folder = out / "runs" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    commands = [["new", "--from", name], ["run", f"{name}.toml", *entry.get("options", ["--accuracy", "0.01"])],
                ["plot", f"out/{name}", "--only", entry["picture"]]]
    said, seconds = [], []
    for command in commands:
        started = time.perf_counter()
        done = subprocess.run([binary, *command], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{name}: signorini {' '.join(command)}\n{done.stderr}")
        said.append(done.stdout)
        seconds.append(time.perf_counter() - started)
    scene = (folder / f"{name}.toml").read_text(encoding="utf-8")
    geometry = (folder / f"{name}.geo").read_text(encoding="utf-8")
    summary = json.loads((folder / "out" / name / "summary.json").read_text(encoding="utf-8"))
    rows = list(answers(summary, truths(scene)[0]))
    shown = [row for row in rows if row[0] in entry["figures"] or row[-1]]
    unknown = set(entry["figures"]) - {row[0] for row in rows}
    if unknown:
        sys.exit(f"{LIST.name}: the scene {name} has no truth for {', '.join(sorted(unknown))}")
    shutil.copy(folder / "out" / name / f"{entry['picture']}.png", out / "gallery" / f"{name}.png")
    typed = "\n".join(f"signorini {' '.join(command)}" for command in commands)
    (out / "gallery" / f"{name}.md").write_text(f"""\
# {summary["title"]}

{entry["text"]}

![{entry["picture"]} of the scene {name}]({name}.png)

```sh
{typed}
```

{chr(10).join(table(shown))}

The answer is that at the end of the run, ± its error bar. It agrees if its bar and the published error cover the difference. \
Figures of this scene with a published or closed value: {len(rows)}, of which {sum(not row[-1] for row in rows)} agree.

Source: {source_of(scene)}

## The scene

`signorini new --from {name}` writes it as `{name}.toml`:

```toml
{scene.rstrip()}
```

Its geometry is `{name}.geo`:

```c
{geometry.rstrip()}
```

## What the run prints

It took {seconds[1]:.1f} seconds.

```text
{said[1].rstrip()}
```
""", encoding="utf-8")
    missed = [row for row in rows if row[-1]]
    print(f"{name:<15} {sum(seconds):5.1f} s, {len(rows) - len(missed)} of {len(rows)} agree"
          + "".join(f"; {row[0]} {row[2]:.8g} ± {row[3] or 0:.2g} for {row[5]:.8g}" for row in missed), flush=True)
    return summary["title"], missed


def gallery(binary, out, names=()):
    """(names by title, whether an answer misses) of the scenes, or of all in the list."""
    entries = tomllib.loads(LIST.read_text(encoding="utf-8"))
    listed = subprocess.run([binary, "new", "--list"], capture_output=True, text=True, check=True).stdout
    different = {line.split()[0] for line in listed.splitlines()} ^ set(entries)
    if different:
        sys.exit(f"{', '.join(sorted(different))}: either in {LIST.name} or in `signorini new --list`, but not in both")
    (out / "gallery").mkdir(parents=True, exist_ok=True)
    pages, missed = {}, []
    for name in names or entries:
        pages[name], misses = page(name, entries[name], binary, out)
        missed += misses
    cards = "\n".join(f'<a href="{name}.html"><img src="{name}.png" alt="">{title}</a>' for name, title in pages.items())
    (out / "gallery" / "index.md").write_text(f"""\
# Gallery

Each page has a scene to start from, the commands that solve it, and answers with error bars beside published or closed ones.

<div class="gallery">
{cards}
</div>
""", encoding="utf-8")
    return pages, bool(missed)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--out", type=Path, default=Path("target/site"))
    parser.add_argument("names", nargs="*", help="of scenes, if not all")
    arguments = parser.parse_args()
    return int(gallery(arguments.binary, arguments.out.resolve(), arguments.names)[1])


if __name__ == "__main__":
    sys.exit(main())
