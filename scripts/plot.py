#!/usr/bin/python3
"""Draws pictures of one or more runs into their result folders.

    signorini plot out/lshape out/bridge

setting        the body, its boundaries by name, loads and supports (paper, Figures 2, 4, 7)
deformed       the deformed mesh over the initial outline (Figures 5 and 8)
stress-damage  von Mises stress and damage (Figures 6 and 9)
principal-stresses  tension and compression with their directions
pressure       contact pressure and gap along Γ_C
damage-history the largest and the mean damage 1 − ζ in time, if there is damage
force-displacement  the forces on the supports over the largest displacement, or over time if this does not grow

--only pressure,setting draws only these. With --together: one force-displacement and one pressure of all runs.

With --line or --along: curves of fields at several times, of one or more runs, with their numbers as CSV.

With --figure: figures of a study over the value that it varies, with their bars, and with their numbers as CSV:

    signorini plot out/lshape-study --figure zeta_min,foundation.force_y

On request: mesh; contact-evolution, the pressure on Γ_C in time; times, maps of several times; damage (without damage: stress) and
pressure as animations.
"""

import argparse
import os
import re
import sys
from dataclasses import replace
from math import inf, isfinite

# This module comes first: it checks the memory before numpy is imported.
import drawing
from drawing import OPTIONS
from animation import ANIMATED, animate
from contact_pressure import draw_evolution, draw_pressure, draw_pressures
from histories import draw_damage_history, draw_force_displacement, draw_forces
from limits import box_of, limits_of
from lines import draw_curves, run_names
from maps import draw_deformed, draw_mesh, draw_stress_and_damage, draw_times
from paraview_script import write_script
from principal import draw_principal
from reading import evenly, nearest, read_results, read_without_fields, states
from results import ResultError, telling
from setting import draw_setting
from signorini_files import check, whole
from signorini_movies import FRAMES, MOVIES, check_movie
from signorini_summaries import folders_of, is_study, summary_or_error
from study_pictures import drawn
from table import names_of

PICTURES = {
    "setting": draw_setting,
    "deformed": draw_deformed,
    "stress-damage": draw_stress_and_damage,
    "principal-stresses": draw_principal,
    "pressure": draw_pressure,
    "damage-history": draw_damage_history,
    "force-displacement": draw_force_displacement,
}
# Pictures of several runs together.
TOGETHER = {"pressure": draw_pressures, "force-displacement": draw_forces}
# Pictures of the whole run, for all times.
OF_ALL_TIMES = ("damage-history", "force-displacement")
# Pictures of maps, which --zoom changes.
OF_MAPS = ("deformed", "stress-damage", "principal-stresses", "mesh", "times")
# The file formats of pictures.
FORMATS = ("png", "svg", "pdf")
# The largest number of frames in the contact evolution.
EVOLUTION = 400


def arguments_of(prog):
    """The command line."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help=(
        "result folder; several with the same units have the same colours, axes of pressure and amplification"))
    parser.add_argument("--time", type=float, metavar="T", help=(
        "draw the frame nearest to this time, s (default: the last)"))
    parser.add_argument("--factor", type=float, metavar="F", help=(
        "amplification of displacements (in the paper: 10; default: what shows them)"))
    parser.add_argument("--format", type=lambda text: text.split(","), default=["png"], metavar=(
        "FORMAT"), help="png, svg, pdf, or several with commas (default: png)")
    parser.add_argument("--line", type=numbers(4), metavar="X0,Y0,X1,Y1", help=(
        "only curves of fields along this line"))
    parser.add_argument("--along", metavar="BOUNDARY,…", help=(
        "only curves of fields along a boundary, or several in one picture; a name with a comma stands in double quotes"))
    parser.add_argument("--quantity", type=lambda text: text.split(","), metavar="NAME,…", help=(
        "fields of --line and --along: zeta, u_x, u_y, stress_xx, stress_yy, stress_xy, stress_zz, stress_1, "
        "stress_2, strain_xx, strain_yy, strain_xy, von_mises, normal_pressure, gap (default: von_mises)"))
    parser.add_argument("--times", type=numbers(None), metavar="T,…", help=(
        "times of the curves, s (default: the last frame); without curves: only times, maps at these times"))
    parser.add_argument("--zoom", type=numbers(4), metavar="X0,Y0,X1,Y1", help="the part of the body that maps show")
    parser.add_argument("--no-title", action="store_true", help="without titles, for papers")
    parser.add_argument("--width", type=float, metavar="INCHES", help="the width of every picture")
    parser.add_argument("--only", type=lambda text: text.split(","), default=list(PICTURES), metavar="NAME,…", help=(
        "only these pictures, by the names above"))
    parser.add_argument("--together", action="store_true", help=(
        "only force-displacement-together and pressure-together, the forces of all runs and their contact pressures in one picture "
        "each, into the first folder"))
    parser.add_argument("--figure", type=names_of, metavar="NAME,…", help=(
        "only these figures of a study, or of several runs, over the values that they vary, with the numbers as CSV"))
    parser.add_argument("--over", metavar="KEY", help=(
        "the varied key below the curves of --figure, or run (default: the first; the others have a curve for each value)"))
    parser.add_argument("--abscissa", metavar="COLUMN", help=(
        "column of history.csv over which force-displacement draws the forces: time, displacement_max, work, …"))
    parser.add_argument("--range", type=numbers(2), metavar="A,B", help="stresses at the ends of the colour bars, Pa; compression is positive")
    parser.add_argument("--material", metavar="NAME", help=(
        "maps of one material only: the name of a surface, or material for the others"))
    parser.add_argument("--contours", action="store_true", help="contour lines of the stress and ζ")
    parser.add_argument("--mesh", action="store_true", help="also mesh, the undeformed mesh")
    parser.add_argument("--evolution", action="store_true", help="also contact-evolution")
    parser.add_argument("--animate", nargs="?", const="gif", choices=MOVIES, help=(
        "also animations of damage (or stress) and pressure: gif, or mp4 by ffmpeg (default: gif)"))
    parser.add_argument("--paraview", action="store_true", help=(
        "only write open_in_paraview.py, for `paraview --script=OUT/open_in_paraview.py`"))
    # Not only single numbers: a list that starts with a negative number is no option either.
    parser._negative_number_matcher = re.compile(r"-[\d.]")
    arguments = parser.parse_args()
    if unknown := set(arguments.format) - set(FORMATS):
        parser.error(f"--format: {', '.join(unknown)} is none of {', '.join(FORMATS)}")
    if unknown := set(arguments.only) - set(PICTURES):
        parser.error(f"--only: {', '.join(sorted(unknown))} is none of {', '.join(PICTURES)}")
    if arguments.line and arguments.along:
        parser.error("--line and --along: give one of them")
    if arguments.quantity and not (arguments.line or arguments.along):
        parser.error("--quantity is for curves: give --line or --along, too")
    if arguments.zoom:
        x0, y0, x1, y1 = arguments.zoom
        if not (-inf < x0 < x1 < inf and -inf < y0 < y1 < inf):
            parser.error("--zoom: needs X0 < X1 and Y0 < Y1")
        arguments.zoom = [[x0, y0], [x1, y1]]
    for name, most in (("factor", inf), ("width", 100.0)):
        if getattr(arguments, name) is not None and not 0.0 < getattr(arguments, name) < most:
            parser.error(f"--{name}: must be positive" + (f", below {most:g} inches" if most < inf else ""))
    if arguments.range and not 0.0 <= arguments.range[0] < arguments.range[1] < inf:
        parser.error("--range: needs 0 <= A < B")
    if arguments.animate and not set(arguments.only) & ANIMATED:
        parser.error(f"--animate: --only has none of {', '.join(sorted(ANIMATED))}; add one")
    if arguments.time is not None and not isfinite(arguments.time):
        parser.error("--time: must be a number")
    return arguments


def numbers(count):
    """A parser of numbers with commas between them, of this count if one is given."""
    def parse(text):
        values = [float(word) for word in text.split(",")]
        if count not in (None, len(values)):
            raise argparse.ArgumentTypeError(f"needs {count} numbers")
        return values

    return parse


def tell(path):
    """Prints a path. A reader that has left, as `head` does, is no error."""
    try:
        print(path, flush=True)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")


def save(figure, results, name, formats):
    """Saves a figure and closes it. Without a figure, removes the picture of an earlier run."""
    moment = ("" if results.is_last else f"_t{results.time:g}") + ("_zoom" if OPTIONS.zoom and name in OF_MAPS else "")
    if figure is None:
        for path in (results.folder / f"{name}{moment}.{ending}" for ending in FORMATS):
            check(path)
            path.unlink(missing_ok=True)
        return
    for ending in formats:
        path = results.folder / f"{name}{moment}.{ending}"
        with whole(path) as part:
            figure.savefig(part)
        tell(path)
    drawing.plt.close(figure)


def draw(results, limits, arguments):
    """Draws the pictures of one run."""
    if arguments.paraview:
        # The scales suit all frames.
        chosen = states(results, evenly(results.frames, FRAMES))
        tell(write_script(results, limits_of(chosen, arguments.factor)))
        return
    last = replace(results, time=results.frames[-1][0])
    if OPTIONS.zoom and ((limits.box[1] < OPTIONS.zoom[0]) | (limits.box[0] > OPTIONS.zoom[1])).any():
        (x0, y0), (x1, y1) = limits.box.tolist()
        raise ResultError(f"--zoom: the maps show nothing there; they are within {x0:g},{y0:g},{x1:g},{y1:g}")
    if arguments.times:
        chosen = states(results, [results.frames[k] for k in dict.fromkeys(
            nearest(results.frames, time) for time in arguments.times)])
        save(draw_times(chosen, limits_of(chosen, arguments.factor)), last, "times", arguments.format)
        return
    for name in arguments.only:
        save(PICTURES[name](results, limits), last if name in OF_ALL_TIMES else results, name, arguments.format)
    if arguments.mesh:
        save(draw_mesh(results), last, "mesh", arguments.format)
    if arguments.evolution:
        stride = 1 + len(results.frames) // EVOLUTION
        chosen = states(results, results.frames[::stride])
        save(draw_evolution(chosen, limits_of(chosen)), last, "contact-evolution", arguments.format)
    if arguments.animate:
        for path in animate(results, arguments.factor, arguments.animate, arguments.only):
            tell(path)


def draw_together(runs, arguments):
    """Draws the pictures of all runs together into the folder of the first one."""
    chosen = [name for name in TOGETHER if name in arguments.only]
    if not chosen:
        raise ResultError(f"--together draws {' and '.join(TOGETHER)}; name one of them after --only")
    if len({tuple(run.units.items()) for run in runs}) > 1:
        raise ResultError("the runs have different units; draw those with the same units together")
    names, found = run_names(runs), []
    for name in chosen:
        figure = TOGETHER[name](runs, names)
        found += [name] * (figure is not None)
        save(figure, runs[0], f"{name}-together", arguments.format)
    if not found:
        raise ResultError("nothing to draw together: forces need runs with time steps, and pressures runs with a foundation")


def main(prog=None):
    """Returns the exit code: 2 if a picture could not be drawn. A message names it."""
    arguments = arguments_of(prog)
    drawing.use(width=arguments.width, titles=not arguments.no_title, contours=arguments.contours,
                abscissa=arguments.abscissa, range=arguments.range, zoom=arguments.zoom)
    if arguments.animate:
        try:
            check_movie(arguments.animate)
        except ValueError as error:
            print(f"error: --animate: {error}", file=sys.stderr)
            return 2
    target = arguments.folders[0]
    arguments.folders = folders_of(arguments.folders)
    if arguments.figure:
        summaries = list(map(summary_or_error, arguments.folders))
        target = target if is_study(target) else arguments.folders[0]
        return 0 if drawn(arguments.folders, summaries, arguments.figure, target, over=arguments.over,
                          formats=arguments.format) else 2
    if arguments.line or arguments.along:
        with telling(arguments.folders[0]) as problems:
            for path in draw_curves(arguments):
                tell(path)
        return 2 if problems else 0
    runs, failed = [], False
    for folder in arguments.folders:
        with telling(folder) as problems:
            runs.append(read_without_fields(folder, arguments.time) if arguments.together else
                        read_results(folder, arguments.time, arguments.material, arguments.zoom))
            last = runs[-1].frames[-1][0]
            asked = max([*filter(None, [arguments.time]), *(arguments.times or [])], default=last)
            if asked > last:
                print(f"{folder}: there is no frame at t = {asked:g}; the last one, at t = {last:g}, is drawn",
                      file=sys.stderr)
        failed |= bool(problems)
    if arguments.together and runs:
        with telling() as problems:
            draw_together(runs, arguments)
        return 2 if failed or problems else 0
    for results in runs:
        with telling(results.folder) as problems:
            # Only numbers in the same units can have a common scale.
            shared = limits_of([run for run in runs if run.units == results.units], arguments.factor)
            draw(results, replace(shared, box=box_of([results], shared.factor)), arguments)
        failed |= bool(problems)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
