#!/usr/bin/python3
"""Writes a run's report.html: one page with its fields at all times, to look at in a browser, pictures, histories,
error budget, scene and timings, which needs no other file and no network. With --pdf also report.pdf.

    signorini report out/lshape
"""

import argparse
import base64
import html
import io
import multiprocessing
import os
import re
import signal
import sys
import threading
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from functools import partial
from importlib.util import find_spec
from string import Template

# This module comes first: it checks the memory before numpy is imported.
import drawing
from drawing import FAINT, RED, plt, wrapped
from bars import barred, placed, plain
from contact_pressure import draw_evolution
from plot import PICTURES
from histories import draw_histories
from limits import limits_of
from maps import draw_everything
from reading import evenly, read_results
from report_pdf import FULL, LINE, SIZE, SPACE, pages_of
from results import ROUNDING, telling
from signorini_files import check, whole
from signorini_summaries import flag_of, folders_of
from table import text_of
from viewer import elements_of, frames_of

# The largest number of frames of the contact pressure in time.
EVOLUTION = 50
# The scripts of the viewer, in the order in which they need each other, and the pictures in the place of which it stands.
SCRIPTS = "data.js", "locator.js", "body.js", "overlay.js", "charts.js", "viewer.js"
IN_VIEWER = "deformed", "stress-damage", "principal-stresses"
# The letters of pictures in the PDF, points. The least height, inches, for its maps on a page with other blocks, where they have no
# axes; the width and the largest height of the setting, and its height if it has many names.
LETTERS, LEAST_MAPS, BESIDE, LOW, HIGH, MANY = 7, 2.4, 2.1, 2.4, 4.0, 7
# The limits of the model, for the head of the report.
MODEL = "Limits of the model: two dimensions, small strains, no inertia; one body, a rigid foundation without friction."
# What the processes draw, by name.
TASKS = {}
ERRORS = {
    "displacement_bound": "u, from the mesh, at most (energy)",
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
    with io.BytesIO() as file:
        figure.savefig(file, format="png", dpi=dpi)
        plt.close(figure)
        return base64.b64encode(file.getvalue()).decode()


def call(task):
    """The result of a task."""
    return TASKS[task]()


def obey():
    """Lets this process end with the one that has started it, also if that is killed, and leaves signals to it."""
    def watch():
        multiprocessing.parent_process().join()
        os._exit(1)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=watch, daemon=True).start()


def all_drawn(tasks):
    """The results of functions by name, which are called in as many processes as there are cores. The processes are
    forked, because they cannot import embedded scripts again. A process that ends early lacks memory."""
    TASKS.update(tasks)
    pool = None
    try:
        pool = ProcessPoolExecutor(mp_context=multiprocessing.get_context("fork"), initializer=obey)
        return dict(zip(tasks, pool.map(call, tasks)))
    except BrokenExecutor:
        raise MemoryError from None
    except OSError:
        # Processes need shared memory (/dev/shm), which a container may lack. The same error in a picture comes again.
        return {name: task() for name, task in tasks.items()}
    finally:
        if pool:
            pool.shutdown(wait=False, cancel_futures=True)


def pictures(results, everything):
    """Functions that draw the pictures of the page, by name."""
    limits = limits_of([results])
    some = [state for _, state in evenly([(state.time, state) for state in everything], EVOLUTION)]
    return {**{name: partial(draw, results, limits) for name, draw in PICTURES.items()},
            "histories": partial(draw_histories, results),
            "contact-evolution": lambda: draw_evolution(some, limits_of(some))}


def element(name, data):
    """An element of the page with a picture; "" without a picture."""
    return data and f'<img alt="{name}" src="data:image/png;base64,{data}">'


def table(rows, head=()):
    """A table of rows of cells; numbers are aligned to the right."""
    def cell(value):
        kind = ' class="number"' if isinstance(value, (int, float)) and not isinstance(value, bool) else ""
        return f"<td{kind}>{html.escape(text_of(value))}</td>"

    lines = [[f"<th>{html.escape(name)}</th>" for name in head]] * bool(head) + [map(cell, row) for row in rows]
    lines = "".join(f"<tr>{''.join(line)}</tr>" for line in lines)
    return f"<table>{lines}</table>"


def page_file(name):
    """A file of the page, from the folder beside the scripts or embedded."""
    spec = find_spec("report_pdf")
    return spec.loader.get_data(os.path.join(os.path.dirname(spec.origin or ""), "page", name)).decode()


def viewer(results, everything, limits):
    """The element of the viewer, and its data and scripts."""
    left_out = len(results.frames) - len(everything)
    note = f"{len(everything)} of {len(results.frames)} frames are here; fields.pvd has all." if left_out else ""
    inks = "".join(f"const {name} = '{getattr(drawing, name)}';\n" for name in ("INK", "BLUE", "RED"))
    own = inks + "".join(page_file(name) for name in SCRIPTS)
    scripts = [f"<script>{page_file('libraries.js')}</script>", elements_of(results, everything, limits),
               f'<script>(() => {{ "use strict";\n{own}}})();</script>']
    return Template(page_file("viewer.html")).substitute(left_out=note), "\n".join(scripts)


def is_flagged(figure, extreme):
    """Does the reason why the mesh does not determine the last value hold for an extreme of the run? It knows one place."""
    return extreme["value"] == figure["value"] or extreme["at"] is not None and extreme["at"] == figure["at"]


def said(figure, value, flagged=True):
    """A value of a figure as text: with its bar if it is that of the last state, and with two digits and the reason if
    the mesh does not determine it. The reason may not hold at another place and time."""
    if value is None:
        return "–"
    if value == 0.0 and figure["bar"] is None:
        return "0"
    flag, _ = flag_of(figure)
    if flag and flagged:
        return f"{plain(value, 2)}, {flag}"
    return value == figure["value"] and barred(value, figure["bar"]) or plain(value, 4)


def reason(results, name, figure):
    """Why the mesh does not determine a figure, in plain words, with the distance at which to read a stress that is infinite
    at a point."""
    flag, why = flag_of(figure)
    if flag == "singular":
        away = f"; see {_away(results)}" if f"{name}_away" in results.figures else ""
        return f"infinite at {why}{away}"
    return f"the mesh is too coarse: {why}" if flag and not why.startswith("it ") else why


def _away(results):
    """The distance from singular points of the figures `…_away`, in words."""
    away = results.scene.get("away")
    return f"{away:g} {results.units['length']} away" if isinstance(away, (int, float)) else "away from singular points"


def governing(results):
    """Of each figure of the whole body: its name, its extreme over all steps, the unit, the time and the place, the value
    of the last state if it is another one, and why the mesh does not determine it; below a head. A stress away from
    singular points stands below that of the whole body."""
    rows, is_stopped = [], results.summary.get("stopped_by") == "damage"
    figures = {name: of for name, of in results.figures.items() if "." not in name and of["governing"]}
    order = [name for base in figures for name in (base, f"{base}_away") if name in figures]
    for name in dict.fromkeys(order):
        figure = figures[name]
        extreme = figure["governing"]
        flagged, place = is_flagged(figure, extreme), extreme["at"]
        text, last = said(figure, extreme["value"], flagged), said(figure, figure["value"])
        time = f"{extreme['time']:g}"
        if name == "zeta_min" and is_stopped:
            text, time = "reached ζ_*", results.stopping_time
        label = figure["label"].replace(" away from singular points", f", {_away(results)}")
        rows.append((label, text, figure["unit"], time, placed(place, results.size) if place else "",
                     last * (last != text), reason(results, name, figure) if flagged else ""))
    before = ", before the stop" if results.summary.get("stopped_by") else ""
    head = ("", "over all steps", "", f"at t ({results.units['time']})", f"at ({results.units['length']})",
            f"last state{before}", "why not determined")
    # A static solve has no other time.
    shown = [k for k in range(len(head)) if k == 0 or any(row[k] for row in rows) and (k != 3 or len(results.frames) > 1)]
    return [[row[k] for k in shown] for row in rows], [head[k] for k in shown]


def by_name(results, with_places=True):
    """Tables of the figures of supports, probes and materials: a row for each name, and two where the extreme of the run
    is not the value of the last state; a column for each figure, or for both components. Places have no extremes."""
    figures, names, alike = results.figures, {}, {}
    for key, of in figures.items():
        name, point, kind = key.rpartition(".")
        if point and (with_places or of["governing"]):
            names.setdefault(name, []).append(kind)
    for name, kinds in names.items():
        alike.setdefault(tuple(kinds), []).append(name)
    # A table of many columns also has the names that have some of them.
    for kinds in sorted(alike, key=len):
        if larger := next((others for others in alike if set(kinds) < set(others)), None):
            alike[larger] = sorted(alike[larger] + alike.pop(kinds), key=list(names).index)
    for kinds, group in alike.items():
        full = next(name for name in group if tuple(names[name]) == kinds)
        pairs = {kind: f"{kind[:-1]}y" for kind in kinds if kind.endswith("_x") and f"{kind[:-1]}y" in kinds}
        columns = [(kind, pairs[kind]) if kind in pairs else (kind,) for kind in kinds if kind not in pairs.values()]
        first = [(figures[f"{full}.{column[0]}"], len(column)) for column in columns]
        of_name = re.compile(rf" (of|at|in) ({re.escape(full)}|the rest of the body)(?!\w)")
        head = [f"{of_name.sub('', of['label'])[:-3 if count == 2 else None]} ({of['unit']})" for of, count in first]
        rows = []
        for name in group:
            cells = [[figures[f"{name}.{kind}"] for kind in column if kind in names[name]] for column in columns]
            # Figures without an extreme are coordinates of places, and lengths of the scene.
            last = [_cell((of, of["value"]) for of in cell)
                    if not cell or cell[0]["governing"] or any(of["value"] is None for of in cell) else placed([of["value"] for of in cell], results.size) for cell in cells]
            extremes = [[(of, of["governing"]) for of in cell if of["governing"]] for cell in cells]
            most = [_cell((of, extreme["value"], is_flagged(of, extreme)) for of, extreme in cell) for cell in extremes]
            times = [", ".join(dict.fromkeys(f"{extreme['time']:g}" for _, extreme in cell)) for cell in extremes]
            shown = [f"{text} at t = {time}" * (text not in ("", value))
                     for text, time, value in zip(most, times, last)]
            rows += [[results.surface(name), *last]] + [["   extreme", *shown]] * any(shown)
        yield rows, ["", *(text.replace(" ()", "") for text in head)]


def _cell(parts):
    """A value, or a pair of components."""
    texts = [said(*part) for part in parts]
    return f"({', '.join(texts)})" if len(texts) > 1 else "".join(texts)


def body(results):
    """Dimensions and materials."""
    units, scene = results.units, results.scene
    low, high = results.nodes.min(axis=0), results.nodes.max(axis=0)
    material = scene.get("material", {})
    rows = [("dimensions", f"{high[0] - low[0]:.4g} × {high[1] - low[1]:.4g} {units['length']}"),
            ("plane", str(material.get("plane", "")))]
    return rows + [(results.surface(name), results.elasticity(name)) for name in results.materials_there]


def run_of(summary):
    """The size and the solver of the run."""
    names = {"solver": "contact solver", "ranks": "ranks", "nodes": "nodes", "triangles": "triangles",
             "contact_nodes": "contact nodes", "active_nodes": "active nodes", "steps": "time steps"}
    return [(name, summary[key]) for key, name in names.items() if summary.get(key) is not None]


def timings(summary):
    """The phases of the run with bars, the longest first."""
    wall = summary.get("wall_seconds") or 1.0
    phases = [phase for phase in summary.get("phases", {}).items() if "/" not in phase[0]]
    phases.sort(key=lambda phase: -phase[1])
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
            error and f"failed: {error}" or results.ending)


def errors_of(summary):
    """The relative errors, proved or estimated."""
    errors = {key: value for key, value in (summary.get("errors") or {}).items() if isinstance(value, float)}
    # A bound below 100 % takes the place of the estimate.
    errors.pop("displacement_mesh" if errors.get("displacement_bound", 1) < 1 else "displacement_bound", None)
    return [(ERRORS.get(key, key), "unknown: as large as the solution, or larger" if value > 1.0 else
             f"{100 * value:.2g} %" if value > ROUNDING else f"below {plain(100 * ROUNDING)} %") for key, value in errors.items()]


def page(results, arguments, everything):
    """The text of the page."""
    summary, scene = results.summary, results.folder / "scene.toml"
    named = {name: draw for name, draw in pictures(results, everything).items() if name not in IN_VIEWER}
    # The longest task first.
    tasks = {"pdf": partial(write_pdf, results.folder / "report.pdf", results, arguments, everything)}
    tasks = tasks if arguments.pdf else {}
    drawn = all_drawn(tasks | {name: lambda draw=draw: encoded(draw()) for name, draw in named.items()})
    elements = {name: element(name, drawn[name]) for name in named}
    notes = [f"<li>{html.escape(note)}</li>" for note in summary.get("notes", [])]
    title, byline, subtitle, ending = map(html.escape, head_of(results, arguments))
    element_of_viewer, scripts = viewer(results, everything, limits_of(everything))
    return Template(page_file("report.html")).substitute(
        title=title,
        byline=byline,
        model=MODEL,
        governing=table(*governing(results)),
        by_name="".join(table(*of) for of in by_name(results)),
        body=table(body(results)),
        subtitle=subtitle,
        ending=ending,
        setting=elements["setting"],
        viewer=element_of_viewer,
        scripts=scripts,
        library_style=page_file("libraries.css"),
        histories="".join(elements[name] for name in (
            "pressure", "damage-history", "force-displacement", "contact-evolution", "histories"))
        or "One static solve.",
        errors=table(errors_of(summary)),
        residuals=table((key, f"{value:.1e}") for key, value in (summary.get("kkt") or {}).items()),
        notes=f"<p>Notes:</p><ul>{''.join(notes)}</ul>" if notes else "",
        scene=html.escape(scene.read_text(encoding="utf-8") if scene.exists() else "not kept"),
        timings=table(timings(summary)),
        run=table(run_of(summary)),
        provenance=table(provenance(summary)),
    )


def write_pdf(path, results, arguments, everything):
    """Writes the setting, the governing values and curves, and maps, on one page if there is room. What only its author needs is
    at the end."""
    title, byline, subtitle, ending = head_of(results, arguments)
    draw, summary = pictures(results, everything), results.summary
    with pages_of(path) as pages:
        pages.text(title, size=14, weight="bold")
        pages.text("\n".join(filter(None, (byline, subtitle, MODEL))))
        pages.text(ending, color=RED, weight="bold")
        errors = errors_of(summary)
        is_many = len(results.summary.get("boundaries", {})) >= MANY
        drawing.use(size=LETTERS, width=FULL if is_many else BESIDE, height=HIGH if is_many else LOW)
        if not is_many:
            pages.aside()
            draw["setting"](figure=pages)
        pages.table("Body and materials", body(results))
        pages.table("Estimated relative errors", errors)
        pages.new_line()
        if is_many:
            draw["setting"](figure=pages)
            pages.new_line()
        rows, head = governing(results)
        why = {}
        if head[-1] == "why not determined":
            for *row, reason_of in rows:
                why.setdefault(reason_of, []).append(row[0])
            rows, head = [row[:-1] for row in rows], head[:-1]
        pages.table("Governing values", rows, head)
        pages.text("\n".join(f"{', '.join(names)}: {text}" for text, names in why.items() if text))
        title = "Supports, probes, materials"
        for rows, head in by_name(results, with_places=False):
            pages.new_line()
            pages.table(title, rows, head)
            title = ""
        pages.text("\n".join(f"Note: {note}" for note in summary.get("notes", [])))
        pages.new_line()
        # Three plots stand beside each other. The pressure has the longest caption.
        narrow = 0.3 * (FULL - 2 * SPACE)
        drawing.use(width=narrow)
        draw["force-displacement"](figure=pages)
        draw["damage-history"](figure=pages)
        drawing.use(width=FULL - 2 * (narrow + SPACE) if len(results.curves) < 2 else FULL)
        draw["pressure"](figure=pages)
        is_beside = pages.left >= LEAST_MAPS
        if not is_beside:
            pages.next()
        pages.new_line()
        made = " · ".join(f"{name} {value}" for name, value in run_of(summary) + provenance(summary)[:-1])
        last = LINE * (len(wrapped(made, FULL, SIZE)) + 1)
        drawing.use(width=FULL, height=pages.left - last - 0.25, axes=not is_beside)
        draw_everything(results, limits_of([results]), pages)
        pages.text(made, color=FAINT)


def main(prog=None, description=__doc__, shown=None):
    """Returns the exit code: 2 if a folder lacks files for the report. `shown` gets the path of each page."""
    parser = argparse.ArgumentParser(
        prog=prog, description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help="result folder")
    parser.add_argument("--pdf", action="store_true", help="also report.pdf: one to three pages with values, maps and curves")
    parser.add_argument("--title", help="default: that of the scene")
    parser.add_argument("--author", default="")
    parser.add_argument("--date", default="")
    arguments, failed = parser.parse_args(), False
    drawing.use(head=False)
    for folder in folders_of(arguments.folders):
        with telling(folder) as problems:
            results = read_results(folder)
            everything = frames_of(results)
            path = results.folder / "report.html"
            for ending in (".html", ".pdf")[:1 + arguments.pdf]:
                check(path.with_suffix(ending))
            text = page(results, arguments, everything)
            with whole(path) as part:
                part.write_text(text, encoding="utf-8", errors="surrogateescape")
            print(path)
            if arguments.pdf:
                print(path.with_suffix(".pdf"))
            if shown:
                shown(path)
        failed |= bool(problems)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
