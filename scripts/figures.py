#!/usr/bin/python3
"""Draws the figures of one or more runs into their result folders.

    signorini figures out/lshape out/bridge

setting        the body, its boundaries by name, loads and supports (paper, Figures 2, 4, 7)
deformed       the deformed mesh over the initial outline (Figures 5 and 8)
stress-damage  von Mises stress and damage (Figures 6 and 9)
principal-stresses  tension and compression with their directions
pressure       contact pressure and gap along Γ_C
damage-history the minimum and the mean of ζ in time, if there is damage
force-displacement  the forces on the supports over the largest displacement

and on request: contact-evolution, the pressure on Γ_C in time; damage (without damage: stress) and
pressure as animations.
"""

import argparse
import sys
from dataclasses import replace
from math import isfinite

import matplotlib.pyplot as plt

from animation import FRAMES, MOVIES, animate
from contact_pressure import draw_evolution, draw_pressure
from histories import draw_damage_history, draw_force_displacement
from limits import box_of, limits_of
from maps import draw_deformed, draw_stress_and_damage
from paraview_script import write_script
from principal import draw_principal
from reading import evenly, read_results, states
from results import telling
from setting import draw_setting

FIGURES = {
    "setting": draw_setting,
    "deformed": draw_deformed,
    "stress-damage": draw_stress_and_damage,
    "principal-stresses": draw_principal,
    "pressure": draw_pressure,
    "damage-history": draw_damage_history,
    "force-displacement": draw_force_displacement,
}
# Figures of the whole run, for all times.
OF_ALL_TIMES = ("damage-history", "force-displacement")
# The file formats of pictures.
FORMATS = ("png", "svg", "pdf")
# The largest number of frames in the contact evolution.
EVOLUTION = 400


def arguments_of(prog):
    """The command line."""
    parser = argparse.ArgumentParser(
        prog=prog, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT", help=(
        "result folder; several have the same colours, axes of pressure and amplification"))
    parser.add_argument("--time", type=float, metavar="T", help=(
        "draw the frame nearest to this time, s (default: the last)"))
    parser.add_argument("--factor", type=float, metavar="F", help=(
        "amplification of displacements (in the paper: 10; default: what shows them)"))
    parser.add_argument("--format", type=lambda text: text.split(","), default=["png"], metavar=(
        "FORMAT"), help="png, svg, pdf, or several with commas (default: png)")
    parser.add_argument("--evolution", action="store_true", help="also contact-evolution")
    parser.add_argument("--animate", nargs="?", const="gif", choices=MOVIES, help=(
        "also animations of damage (or stress) and pressure: gif, or mp4 by ffmpeg (default: gif)"))
    parser.add_argument("--paraview", action="store_true", help=(
        "only write open_in_paraview.py, for `paraview --script=OUT/open_in_paraview.py`"))
    arguments = parser.parse_args()
    if unknown := set(arguments.format) - set(FORMATS):
        parser.error(f"--format: {', '.join(unknown)} is none of {', '.join(FORMATS)}")
    if arguments.factor is not None and not arguments.factor > 0.0:
        parser.error("--factor: must be positive")
    if arguments.time is not None and not isfinite(arguments.time):
        parser.error("--time: must be a number")
    return arguments


def save(figure, results, name, formats):
    """Saves a figure and closes it. Without a figure, removes the picture of an earlier run."""
    moment = "" if results.is_last else f"_t{results.time:g}"
    if figure is None:
        for ending in FORMATS:
            (results.folder / f"{name}{moment}.{ending}").unlink(missing_ok=True)
        return
    for ending in formats:
        path = results.folder / f"{name}{moment}.{ending}"
        figure.savefig(path)
        print(path)
    plt.close(figure)


def draw(results, limits, arguments):
    """Draws the figures of one run."""
    if arguments.paraview:
        # The scales suit all frames.
        chosen = states(results, evenly(results.frames, FRAMES))
        print(write_script(results, limits_of(chosen, arguments.factor)))
        return
    last = replace(results, time=results.frames[-1][0])
    for name, figure in FIGURES.items():
        of = last if name in OF_ALL_TIMES else results
        save(figure(results, limits), of, name, arguments.format)
    if arguments.evolution:
        stride = 1 + len(results.frames) // EVOLUTION
        chosen = states(results, results.frames[::stride])
        save(draw_evolution(chosen, limits_of(chosen)), last, "contact-evolution", arguments.format)
    if arguments.animate:
        for path in animate(results, arguments.factor, arguments.animate):
            print(path)


def main(prog=None):
    """Returns the exit code: 2 if a figure could not be drawn. A message names it."""
    arguments = arguments_of(prog)
    runs, failed = [], False
    for folder in arguments.folders:
        with telling() as problems:
            runs.append(read_results(folder, arguments.time))
            last = runs[-1].frames[-1][0]
            if arguments.time is not None and arguments.time > last:
                print(f"{folder}: the last frame is at t = {last:g}, before {arguments.time:g}: it is drawn",
                      file=sys.stderr)
        failed |= bool(problems)
    shared = runs and limits_of(runs, arguments.factor)
    for results in runs:
        with telling() as problems:
            draw(results, replace(shared, box=box_of([results], shared.factor)), arguments)
        failed |= bool(problems)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
