#!/usr/bin/python3
"""Writes a run's report.html: one page with its pictures, a slider over its frames, histories,
error budget, scene and timings, which needs no other file and no network. With --pdf also report.pdf.

    signorini report out/lshape
"""

import argparse
import base64
import html
import io
import json
import multiprocessing
import os
import sys
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from functools import partial
from importlib.util import find_spec
from string import Template

# This module comes first: it checks the memory before numpy is imported.
import drawing
from drawing import RED, headline, least_zeta, np, plt, wrap_titles
from bars import barred, three_digits
from contact_pressure import draw_evolution, draw_pressure
from figures import FIGURES
from histories import draw_histories
from limits import limits_of
from maps import draw_state
from reading import evenly, read_results, states
from report_pdf import FULL, HIGHEST, SPACE, pages_of
from results import telling
from signorini_summaries import bars, flag_of, folders_of, unit_of
from table import text_of

# The largest number of frames of the slider.
FRAMES = 10
# The limits of the model, for the head of the report.
MODEL = "Limits of the model: two dimensions, small strains, no inertia; one body, a rigid foundation without friction."
# Places, which the PDF leaves out: it has two pages.
PLACES = [f".{name}_{axis}" for name in ("contact_start", "contact_end", "peak") for axis in "xy"]
# What the processes draw, by name.
TASKS = {}
# Values of summary.json for the last state, with their names.
FACTS = {
    "solver": "contact solver", "ranks": "ranks", "nodes": "nodes", "triangles": "triangles", "steps": "time steps",
    "end_time": "last time", "stopped_by": "stopped by", "stopped_at": "stopped at", "active_nodes": "active nodes", "contact_nodes": "contact nodes",
}
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
    return {**{name: partial(draw, results, limits) for name, draw in FIGURES.items()},
            "histories": partial(draw_histories, results),
            "contact-evolution": lambda: draw_evolution(everything, limits_of(everything))}


def element(name, data):
    """An element of the page with a picture; "" without a picture."""
    return data and f'<img alt="{name}" src="data:image/png;base64,{data}">'


def table(rows, head=()):
    """A table of rows of cells; numbers are aligned to the right."""
    def cell(value):
        kind = ' class="number"' if isinstance(value, (int, float)) and not isinstance(value, bool) else ""
        return f"<td{kind}>{html.escape(text_of(value))}</td>"

    lines = [map("<th>{}</th>".format, head)] * bool(head) + [map(cell, row) for row in rows]
    lines = "".join(f"<tr>{''.join(line)}</tr>" for line in lines)
    return f"<table>{lines}</table>"


def frame(state, limits):
    """The pictures at one time; they have the same size at all times."""
    with plt.rc_context({"savefig.bbox": None}):
        drawn = {"state": draw_state(state, limits), "pressure": draw_pressure(state, limits)}
        return {"moment": state.moment, **{name: encoded(figure, dpi=90) for name, figure in drawn.items()}}


def slider(frames):
    """Pictures of the body and of Γ_C at several times, with a slider."""
    if len(frames) < 2:
        return ""
    return template()[1].substitute(last=len(frames) - 1, frames=json.dumps(frames))


def template():
    """The templates of the page and of its slider, from report.html beside the scripts or embedded."""
    spec = find_spec("report_pdf")
    path = os.path.join(os.path.dirname(spec.origin or ""), "report.html")
    return [Template(text) for text in spec.loader.get_data(path).decode().split("<!-- slider -->\n")]


def facts(results, left_out=()):
    """The values of summary.json for the last state, and the given quantities by name. Names that end with one of
    `left_out` are left out."""
    summary, errors = results.summary, bars(results.summary)
    figures = summary.get("figures") or {}

    def text(name, value):
        flag, _ = flag_of(figures.get(name))
        if flag:
            return f"{value:.2g}, {flag}"
        is_rounded = summary.get("stopped_at") is not None and isinstance(value, float)
        return barred(value, errors.get(name)) or (three_digits(value) if is_rounded else value)

    rows = [(name, text(key, summary[key]), unit_of(key, summary))
            for key, name in FACTS.items() if summary.get(key) is not None]
    return rows + [(of["label"], text(name, of["value"]), of["unit"]) for name, of in figures.items()
                   if of["value"] is not None and not name.endswith(tuple(left_out))]


def governing(everything, units):
    """The extreme values of the run, with their places and times."""
    kinds = (
        ("largest tension σ₁", "principal_max", "stress", lambda state: state.principal[:, 0], 1.0),
        ("largest compression −σ₂", "principal_min", "stress", lambda state: -state.principal[:, 1], 1.0),
        ("largest von Mises stress", "von_mises_max", "stress", lambda state: state.von_mises, 1.0),
        ("largest contact pressure", "pressure_max", "stress", lambda state: state.pressure, 1.0),
        ("largest displacement", "displacement_max", "length",
         lambda state: np.linalg.norm(state.displacement, axis=1), 1.0),
        ("least ζ", "zeta_min", "", lambda state: state.zeta, -1.0),
    )
    rows = []
    for name, key, kind, of, sign in kinds:
        found = [(sign * (sign * of(state)).max(), state, (sign * of(state)).argmax()) for state in everything]
        value, state, node = max(found, key=lambda one: sign * one[0])
        if value == (1.0 if name == "least ζ" else 0.0):
            continue
        x, y = state.nodes[node]
        extreme = (state.summary["figures"].get(key) if state.is_last else None) or {}
        is_there = extreme and np.allclose(extreme["at"], (x, y), atol=1e-9 * state.size)
        flag, reason = flag_of(extreme if is_there else None)
        plain = least_zeta(value) if key == "zeta_min" else f"{value:.{2 if flag else 4}g}"
        text = state.barred(key, value) or plain
        rows.append((name, text, units.get(kind, ""), f"({x:.4g}, {y:.4g})", f"{state.time:g} {units['time']}",
                     f"{flag}: {reason}" if flag else ""))
    return rows


def body(results):
    """Dimensions, materials, and the resultants of the supports."""
    units, scene = results.units, results.scene
    low, high = results.nodes.min(axis=0), results.nodes.max(axis=0)
    material = scene.get("material", {})
    rows = [("dimensions", f"{high[0] - low[0]:.4g} × {high[1] - low[1]:.4g} {units['length']}"),
            ("plane", str(material.get("plane", "")))]
    surfaces = [name for name, of in material.items() if isinstance(of, dict)]
    rows += [(name, results.elasticity(name)) for name in ("material", *surfaces)]
    figures = results.summary.get("figures", {})
    for name in dict.fromkeys(key.rpartition(".")[0] for key in figures if key.endswith(".moment")):
        x, y, moment = (figures[f"{name}.{part}"]["value"] for part in ("force_x", "force_y", "moment"))
        rows.append((f"on the body at {name}", f"force ({x:.5g}, {y:.5g}) {units['line']}, "
                     f"moment about (0, 0) {moment:.5g} {units['force']}"))
    return rows


def timings(summary):
    """The phases of the run with bars, the longest first."""
    wall = summary.get("wall_seconds") or 1.0
    phases = sorted(summary.get("phases", {}).items(), key=lambda phase: -phase[1])
    return [("all", wall, "s")] + [(name, float(f"{seconds:.3g}"), "s", round(40 * seconds / wall) * "■")
                                   for name, seconds in phases if seconds >= 1e-3 * wall]


def provenance(summary):
    """Version, date, machine and command line."""
    made = summary.get("provenance", {})
    made = {**made, **made.get("machine", {}), "command": " ".join(made.get("command", []))}
    names = ("version", "date", "directory", "host", "processor", "cores", "command")
    return [(key, str(made[key])) for key in names if made.get(key)]


def head_of(results, arguments):
    """Title, byline, overrides, and how the run ended."""
    error = results.summary.get("error")
    return (arguments.title or results.title, " · ".join(filter(None, (arguments.author, arguments.date))),
            results.overrides and f"with {results.overrides}",
            error and f"failed: {error}" or results.ending.replace("$_*$", "_*"))


def errors_of(summary):
    """The estimated relative errors."""
    errors = {key: value for key, value in (summary.get("errors") or {}).items() if isinstance(value, float)}
    return [(ERRORS.get(key, key), f"{100 * value:.2g} %") for key, value in errors.items()]


def page(results, arguments, everything):
    """The text of the page."""
    summary, scene = results.summary, results.folder / "scene.toml"
    chosen = [state for _, state in evenly([(state.time, state) for state in everything], FRAMES)]
    limits = limits_of(chosen)
    tasks = {state.time: partial(frame, state, limits) for state in chosen}
    named = pictures(results, everything)
    drawn = all_drawn({name: lambda draw=draw: encoded(draw()) for name, draw in named.items()} | tasks)
    elements = {name: element(name, drawn[name]) for name in named}
    notes = [f"<li>{html.escape(note)}</li>" for note in summary.get("notes", [])]
    title, byline, subtitle, ending = map(html.escape, head_of(results, arguments))
    return template()[0].substitute(
        title=title,
        byline=byline,
        model=MODEL,
        governing=table(governing(everything, results.units), head=("", "value", "", "at", "time", "")),
        body=table(body(results)),
        subtitle=subtitle,
        ending=ending,
        facts=table(facts(results)),
        setting=elements["setting"],
        slider=slider([drawn[time] for time in tasks]),
        pictures="".join(elements[name] for name in (
            "deformed", "stress-damage", "principal-stresses", "pressure")),
        histories="".join(elements[name] for name in (
            "damage-history", "force-displacement", "contact-evolution", "histories"))
        or "One static solve.",
        errors=table(errors_of(summary)),
        residuals=table((key, f"{value:.1e}") for key, value in (summary.get("kkt") or {}).items()),
        notes=f"<p>Notes:</p><ul>{''.join(notes)}</ul>" if notes else "",
        scene=html.escape(scene.read_text(encoding="utf-8") if scene.exists() else "not kept"),
        timings=table(timings(summary)),
        provenance=table(provenance(summary)),
    )


def write_pdf(path, results, arguments, everything):
    """Writes two pages: the setting and the governing values; maps and curves."""
    title, byline, subtitle, ending = head_of(results, arguments)
    draw, summary = pictures(results, everything), results.summary
    with pages_of(path, headline(results, "")) as pages:
        pages.text(title, size=14, weight="bold")
        pages.text("\n".join(filter(None, (byline, subtitle, MODEL))))
        pages.text(ending, color=RED, weight="bold")
        pages.table("Last state", facts(results, PLACES))
        drawing.set_width(pages.room)
        draw["setting"](figure=pages)
        pages.table("Governing values", governing(everything, results.units))
        pages.table("Body, materials, supports", body(results))
        pages.table("Estimated relative errors", errors_of(summary))
        pages.table("Made by", provenance(summary)[:-1])
        pages.text("\n".join(f"Note: {note}" for note in summary.get("notes", [])))
        pages.end()
        # A static solve has no histories: three rows of pictures instead of four.
        pages.start(HIGHEST if len(everything) > 1 else 4 / 3 * HIGHEST)
        for name in ("deformed", "pressure", "stress-damage", "principal-stresses", "force-displacement",
                     "damage-history"):
            drawing.set_width(FULL if "stress" in name else 0.5 * (FULL - SPACE))
            draw[name](figure=pages)


def main(prog=None):
    """Returns the exit code: 2 if a folder lacks files for the report."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help="result folder")
    parser.add_argument("--pdf", action="store_true", help="also report.pdf: two pages with values, maps and curves")
    parser.add_argument("--title", help="default: that of the scene")
    parser.add_argument("--author", default="")
    parser.add_argument("--date", default="")
    arguments, failed = parser.parse_args(), False
    for folder in folders_of(arguments.folders):
        with telling() as problems:
            results = read_results(folder)
            everything = states(results, evenly(results.frames, 400))
            path = results.folder / "report.html"
            path.write_text(page(results, arguments, everything), encoding="utf-8")
            print(path)
            if arguments.pdf:
                write_pdf(path.with_suffix(".pdf"), results, arguments, everything)
                print(path.with_suffix(".pdf"))
        failed |= bool(problems)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
