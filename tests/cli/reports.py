"""Compares every number of the tables of report.html with history.csv and summary.json, and the curves in time that the page
draws with history.csv; prints those that contradict, and the number of those compared. It shares no code with the scripts,
which draw the curves."""

import csv
import html
import json
import re
import sys
from pathlib import Path

import numpy as np
from drawing import plt
from histories import draw_damage_history, draw_histories
from reading import read_results

NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
# A number with a bar and a power of ten, or a plain one, with or without a bar.
VALUE = re.compile(rf"\(({NUMBER}) ± ({NUMBER})\)e(-?\d+)|({NUMBER})(?: ± ({NUMBER}))?")


def values(text):
    """The values in a text, each with half a unit of its last digit."""
    found = []
    for inner, of_inner, power, plain, of_plain in VALUE.findall(text):
        value, bar, scale = float(inner or plain), of_inner or of_plain, 10.0 ** int(power or 0)
        digits, _, exponent = (bar or plain).partition("e")
        _, point, decimals = digits.partition(".")
        zeros = 0 if point or not bar else len(digits) - len(digits.rstrip("0"))
        unit = 0.5 * 10.0 ** (int(exponent or 0) - len(decimals) + zeros)
        # Without a bar four digits are printed, or two if the mesh does not determine the figure.
        least = 0.0 if bar else abs(value) * (0.05 if "singular" in text or "not resolved" in text else 5e-4)
        found.append((scale * value, scale * max(unit, least)))
    return found


def compared(where, text, expected):
    """Prints what contradicts; returns the number of comparisons."""
    printed = values(text.partition(" at t =")[0])
    if len(printed) != len(expected):
        print(f"{where}: {text!r} for {expected}")
    for (value, unit), exact in zip(printed, expected):
        if abs(value - exact) > 1.001 * unit + 1e-300:
            print(f"{where}: {text!r}, but {exact}")
    return len(printed)


def extreme(name, column):
    numbers = [float(cell) for cell in column if cell not in ("", "NaN")]
    least = name.rpartition(".")[2] in ("zeta_min", "zeta_mean", "zeta", "principal_min")
    return min(numbers) if least else max(numbers) if name.endswith("_max") else max(numbers, key=abs)


def curves(folder, history, labels):
    """Compares the curves in time, each with its column, which the title of its panel or the legend names; returns the number of
    points."""
    results = read_results(folder)
    drawn = [(axes.get_title(loc="left"), line) for axes in getattr(draw_histories(results), "axes", []) for line in axes.lines]
    drawn += [(f"{line.get_label()} {axes.get_ylabel()}", line) for axes in getattr(draw_damage_history(results), "axes", [])
              for line in axes.lines if len(line.get_xdata()) > 2]
    for title, line in drawn:
        power = re.search(r"10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", title)
        scale = 10.0 ** int(power[1].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) if power else 0)
        is_damage = "damage 1 − ζ" in title
        name = {"mean": "zeta_mean", "largest": "zeta_min"}[title.split()[0]] if is_damage else labels[title.partition(" (")[0]]
        column = np.array([float(row[name] or "nan") for row in history])
        exact = np.transpose([[float(row["time"]) for row in history], 1.0 - column if is_damage else column])
        points = np.transpose([line.get_xdata(), np.multiply(line.get_ydata(), scale)])
        if points.shape != exact.shape or not np.allclose(points, exact, rtol=1e-12, atol=0.0, equal_nan=True):
            print(f"{folder}: the curve of {title} is not {name} of history.csv")
    plt.close("all")
    return sum(len(line.get_xdata()) for _, line in drawn)


count = points = 0
for folder in map(Path, sys.argv[1:]):
    summary = json.loads((folder / "summary.json").read_text())
    with open(folder / "history.csv", newline="") as file:
        history = list(csv.DictReader(file))
    figures = summary["figures"]
    for name, of in figures.items():
        if of["governing"] and (found := [row[name] for row in history if row.get(name)]):
            exact = extreme(name, found)
            if abs(of["governing"]["value"] - exact) > 1e-12 * abs(exact):
                print(f"{folder} {name}: {of['governing']} is not the extreme {exact} of history.csv")
    page = (folder / "report.html").read_text()
    tables = [[[html.unescape(cell) for cell in re.findall(r"<t[dh].*?>(.*?)</t[dh]>", row)]
               for row in re.findall(r"<tr>(.*?)</tr>", table)] for table in re.findall(r"<table>(.*?)</table>", page)]
    # A stress away from singular points names the distance; a surface may be the rest of the body.
    labels = {of["label"].replace(" away from singular points", ", away"): name for name, of in figures.items() if "." not in name}
    points += curves(folder, history, {of["label"]: name for name, of in figures.items() if "." not in name})
    for head, *rows in tables:
        name = ""
        for label, *cells in rows:
            if head[1:2] == ["over all steps"]:
                of, row = figures[labels[re.sub(r", \S+ \S+ away$", ", away", label)]], dict(zip(head[1:], cells))
                last = next((cell for title, cell in row.items() if title.startswith("last state")), "")
                if "reached" not in cells[0]:
                    count += compared(f"{folder} {label}", cells[0], [of["governing"]["value"]])
                count += compared(f"{folder} {label}, last", last, [of["value"]] if last else [])
            elif head[:1] == [""] and len(head) > 1:
                name = label if label.strip() != "extreme" else name
                part = name if any(key.startswith(f"{name}.") for key in figures) else "material"
                for title, cell in zip(head[1:], cells):
                    title = re.sub(r" \([^()]*\)$", "", title)
                    own = [of for key, of in figures.items() if key.rpartition(".")[0] == part and re.sub(
                        rf" (of|at|in) ({name}\b|the rest of the body)|, [xy]$", "", of["label"]) == title]
                    if cell and "–" not in cell:
                        expected = [of["value"] if label == name else of["governing"]["value"] for of in own]
                        count += compared(f"{folder} {name} {title}", cell, expected)
    if summary["stopped_by"]:
        count += compared(f"{folder}, the end", re.search(r"at t = (.*?) s", re.search(
            r'class="ending">(.*?)</p>', page)[1])[1], [summary["stopped_at"]])
print(count, "numbers", points, "points")
