#!/usr/bin/python3
"""Writes a run's report.html: one page with its pictures, a slider over its frames, histories,
error budget, scene and timings, which needs no other file and no network.

    signorini report out/lshape
"""

import argparse
import base64
import html
import io
import json
import multiprocessing
import shutil
import subprocess
import sys
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from functools import partial
from string import Template

# This module comes first: it checks the memory before numpy is imported.
from drawing import np, plt, wrap_titles
from bars import barred, bars, three_digits
from contact_pressure import draw_evolution, draw_pressure
from histories import draw_damage_history, draw_force_displacement, draw_histories
from limits import limits_of
from maps import draw_deformed, draw_state, draw_stress_and_damage
from reading import evenly, read_results, states
from principal import draw_principal
from report_page import PAGE, SLIDER
from results import ResultError, telling
from setting import draw_setting

# The largest number of frames of the slider.
FRAMES = 10
# What the processes draw, by name.
TASKS = {}
# Values of summary.json for the last state: key, name, kind of unit.
FACTS = (
    ("solver", "contact solver", ""), ("ranks", "ranks", ""), ("nodes", "nodes", ""),
    ("triangles", "triangles", ""), ("steps", "time steps", ""), ("end_time", "last time", "time"),
    ("stopped_by", "stopped by", ""), ("stopped_at", "stopped at", "time"), ("zeta_min", "least ζ", ""),
    ("zeta_mean", "mean ζ", ""), ("displacement_max", "largest displacement", "length"),
    ("work", "work of the loads", "work"), ("contact_force", "sum of contact reactions", "line"),
    ("active_nodes", "active nodes", ""), ("contact_nodes", "contact nodes", ""),
)
ERRORS = {
    "displacement_mesh": "u, from the mesh (energy norm)",
    "damage_mesh": "damage, from the mesh (L²)",
    "displacement_steps": "u, from the time steps (energy norm)",
    "damage_steps": "damage, from the time steps (L²)",
    "solver": "u, from the solver",
}


def encoded(figure, dpi=110):
    """The figure as a PNG in base64; "" without a figure."""
    if figure is None:
        return ""
    wrap_titles(figure)
    with io.BytesIO() as file:
        figure.savefig(file, format="png", dpi=dpi)
        plt.close(figure)
        return base64.b64encode(file.getvalue()).decode()


def call(task):
    """The result of a task."""
    return TASKS[task]()


def all_drawn(tasks):
    """The results of functions by name, which are called in as many processes as there are cores. The processes are
    forked, because they cannot import embedded scripts again. A process that ends early lacks memory."""
    TASKS.update(tasks)
    try:
        with ProcessPoolExecutor(mp_context=multiprocessing.get_context("fork")) as pool:
            return dict(zip(tasks, pool.map(call, tasks)))
    except BrokenExecutor:
        raise MemoryError from None


def pictures(results, everything):
    """Functions that draw the pictures of the page, by name."""
    limits = limits_of([results])
    return {
        "histories": lambda: draw_histories(results),
        "stress and damage": lambda: draw_stress_and_damage(results, limits),
        "principal stresses": lambda: draw_principal(results, limits),
        "evolution of contact": lambda: draw_evolution(everything, limits_of(everything)),
        "deformed mesh": lambda: draw_deformed(results, limits),
        "contact pressure and gap": lambda: draw_pressure(results, limits),
        "the setting": lambda: draw_setting(results, limits),
        "forces on the supports": lambda: draw_force_displacement(results),
        "least and mean ζ": lambda: draw_damage_history(results),
    }


def element(name, data):
    """An element of the page with a picture; "" without a picture."""
    return data and f'<img alt="{name}" src="data:image/png;base64,{data}">'


def table(rows):
    """A table of rows of cells; numbers are aligned to the right."""
    def cell(value):
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return f'<td class="number">{value:.6g}</td>'
        return f"<td>{value}</td>"

    rows = (f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    return f"<table>{''.join(rows)}</table>"


def frame(state, limits):
    """The pictures at one time; they have the same size at all times."""
    with plt.rc_context({"savefig.bbox": None}):
        drawn = {"state": draw_state(state, limits), "pressure": draw_pressure(state, limits)}
        return {"moment": state.moment, **{name: encoded(figure, dpi=90) for name, figure in drawn.items()}}


def slider(frames):
    """Pictures of the body and of Γ_C at several times, with a slider."""
    if len(frames) < 2:
        return ""
    return Template(SLIDER).substitute(last=len(frames) - 1, frames=json.dumps(frames))


def facts(results):
    """The values of summary.json for the last state, and the given quantities by name."""
    summary, units, errors = results.summary, results.units, bars(results.summary)
    stopped = summary.get("stopped_at") is not None

    def text(name, value):
        rounded = three_digits(value) if stopped and isinstance(value, float) else value
        return barred(value, errors.get(name)) or rounded

    rows = [(name, text(key, summary[key]), html.escape(units.get(kind, "")))
            for key, name, kind in FACTS if summary.get(key) is not None]
    named = summary.get("quantities", {})
    return table(rows + [(html.escape(name), text(name, value), html.escape(unit_of(name, units)))
                         for name, value in named.items()])


def unit_of(quantity, units):
    """The unit of a quantity like `clamp.force_x` or `probe.stress_xx`."""
    kinds = {"force": units["line"], "moment": units["force"], "u": units["length"], "zeta": ""}
    return kinds.get(quantity.rpartition(".")[2].split("_")[0], units["stress"])


def governing(everything, units):
    """The extreme values of the run, with their places and times."""
    kinds = (
        ("largest tension σ₁", "stress", lambda state: state.principal[:, 0], 1.0),
        ("largest compression −σ₂", "stress", lambda state: -state.principal[:, 1], 1.0),
        ("largest von Mises stress", "stress", lambda state: state.von_mises, 1.0),
        ("largest contact pressure", "stress", lambda state: state.pressure, 1.0),
        ("largest displacement", "length", lambda state: np.linalg.norm(state.displacement, axis=1), 1.0),
        ("least ζ", "", lambda state: state.zeta, -1.0),
    )
    rows = []
    for name, kind, of, sign in kinds:
        found = [(sign * (sign * of(state)).max(), state, (sign * of(state)).argmax()) for state in everything]
        value, state, node = max(found, key=lambda one: sign * one[0])
        if value == (1.0 if name == "least ζ" else 0.0):
            continue
        x, y = state.nodes[node]
        largest = (state.summary.get("extremes") or {}).get("von_mises_max") or {}
        is_there = kind == "stress" and state.singular and np.allclose(largest["at"], (x, y), atol=1e-9 * state.size)
        singular = f"singular: {html.escape(state.singular)}" if is_there else ""
        rows.append((name, f"{value:.4g}", html.escape(units.get(kind, "")), f"({x:.4g}, {y:.4g})",
                     f"{state.time:g} {html.escape(units['time'])}", singular))
    head = "<tr><th></th><th>value</th><th></th><th>at</th><th>time</th><th></th></tr>"
    return table(rows).replace("<table>", f"<table>{head}")


def body(results):
    """Dimensions, materials, and the resultants of the supports."""
    units, scene = results.units, results.scene
    low, high = results.nodes.min(axis=0), results.nodes.max(axis=0)
    material = scene.get("material", {})
    rows = [("dimensions", f"{high[0] - low[0]:.4g} × {high[1] - low[1]:.4g} {html.escape(units['length'])}"),
            ("plane", html.escape(str(material.get("plane", ""))))]
    surfaces = {name: {**material, **of} for name, of in material.items() if isinstance(of, dict)}
    for name, of in {"material": material, **surfaces}.items():
        words = [f"E = {of['young']:g} {units['stress']}", f"ν = {of['poisson']:g}"] if "young" in of else []
        words += [f"ρ = {of['density']:g}"] if of.get("density") else []
        rows.append((html.escape(name), html.escape(", ".join(words))))
    quantities = results.summary.get("quantities", {})
    for name in dict.fromkeys(key.rpartition(".")[0] for key in quantities if key.endswith(".moment")):
        x, y, moment = (quantities[f"{name}.{part}"] for part in ("force_x", "force_y", "moment"))
        rows.append((f"on the body at {html.escape(name)}", html.escape(
            f"force ({x:.5g}, {y:.5g}) {units['line']}, moment about (0, 0) {moment:.5g} {units['force']}")))
    return table(rows)


def timings(summary):
    """The phases of the run with bars, the longest first."""
    wall = summary.get("wall_seconds") or 1.0
    phases = sorted(summary.get("phases", {}).items(), key=lambda phase: -phase[1])
    rows = [("all", wall, "s", "")]
    for name, seconds in phases:
        if seconds >= 1e-3 * wall:
            bar = f'<td class="bar"><div style="width: {100 * seconds / wall:.1f}%"></div></td>'
            rows.append((html.escape(name), float(f"{seconds:.3g}"), "s", bar))
    return table(rows).replace("<td><td", "<td").replace("</td></td>", "</td>")


def provenance(summary):
    """Version, date, machine and command line."""
    made = summary.get("provenance", {})
    made = {**made, **made.get("machine", {})}
    names = ("version", "date", "directory", "host", "processor", "cores")
    rows = [(key, html.escape(str(made[key]))) for key in names if made.get(key)]
    rows += [("command", f"<code>{html.escape(' '.join(made.get('command', [])))}</code>")]
    return table(rows)


def page(results, arguments):
    """The text of the page."""
    summary = results.summary
    scene = results.folder / "scene.toml"
    everything = states(results, evenly(results.frames, 400))
    chosen = [state for _, state in evenly([(state.time, state) for state in everything], FRAMES)]
    limits = limits_of(chosen)
    tasks = {state.time: partial(frame, state, limits) for state in chosen}
    named = pictures(results, everything)
    drawn = all_drawn({name: lambda draw=draw: encoded(draw()) for name, draw in named.items()} | tasks)
    elements = {name: element(name, drawn[name]) for name in named}
    errors = summary.get("errors") or {}
    percent = {key: f"{100 * value:.2g} %" for key, value in errors.items() if key != "figures" and value is not None}
    notes = [f"<li>{html.escape(note)}</li>" for note in summary.get("notes", [])]
    error = summary.get("error")
    ending = error and f"failed: {error}" or results.ending.replace("$_*$", "_*")
    with_overrides = results.overrides and f"with {results.overrides}"
    return Template(PAGE).substitute(
        title=html.escape(arguments.title or results.title),
        byline=html.escape(" · ".join(filter(None, (arguments.author, arguments.date)))),
        governing=governing(everything, results.units),
        body=body(results),
        subtitle=html.escape(with_overrides),
        ending=html.escape(ending),
        facts=facts(results),
        setting=elements["the setting"],
        slider=slider([drawn[time] for time in tasks]),
        pictures="".join(elements[name] for name in (
            "deformed mesh", "stress and damage", "principal stresses", "contact pressure and gap")),
        histories="".join(elements[name] for name in (
            "least and mean ζ", "forces on the supports", "evolution of contact", "histories"))
        or "One static solve.",
        errors=table((ERRORS.get(key, key), value) for key, value in percent.items()),
        residuals=table((key, f"{value:.1e}") for key, value in (summary.get("kkt") or {}).items()),
        notes=f"<p>Notes:</p><ul>{''.join(notes)}</ul>" if notes else "",
        scene=html.escape(scene.read_text(encoding="utf-8") if scene.exists() else "not kept"),
        timings=timings(summary),
        provenance=provenance(summary),
    )


def printed(page):
    """Prints the page to a PDF on A4 by Chromium; returns its path."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        raise ResultError("--pdf needs Chromium (Debian: apt install chromium); or print the page yourself")
    path = page.with_suffix(".pdf")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer",
               f"--print-to-pdf={path.resolve()}", page.resolve().as_uri()]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode:
        raise ResultError(f"{browser} could not print {page}: {ended.stderr.strip().splitlines()[-1:]}")
    return path


def main(prog=None):
    """Returns the exit code: 2 if a folder lacks files for the report."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help="result folder")
    parser.add_argument("--pdf", action="store_true", help=(
        "also report.pdf, by Chromium (Debian: apt install chromium)"))
    parser.add_argument("--title", help="default: that of the scene")
    parser.add_argument("--author", default="")
    parser.add_argument("--date", default="")
    arguments, failed = parser.parse_args(), False
    for folder in arguments.folders:
        with telling() as problems:
            results = read_results(folder)
            path = results.folder / "report.html"
            path.write_text(page(results, arguments), encoding="utf-8")
            print(path)
            if arguments.pdf:
                print(printed(path))
        failed |= bool(problems)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
