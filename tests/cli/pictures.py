"""Draws every picture and the PDF of the folders, and prints texts that overlap or are cut off, and wrong widths."""

import argparse
import sys
from pathlib import Path

import drawing
import report
import report_pdf
from contact_pressure import draw_evolution
from plot import PICTURES
from histories import draw_histories
from limits import limits_of
from maps import draw_state
from matplotlib.text import Text
from reading import evenly, read_results, states

drawn, draw = [], Text.draw


def noted(text, renderer):
    draw(text, renderer)
    if text.get_visible() and text.get_text().strip():
        drawn.append((text.get_text(), text.get_window_extent(renderer)))


def check(name, figure, width=None):
    """Draws a figure and prints what is wrong. A pixel is the error of measuring a text."""
    if figure is None:
        return
    drawn.clear()
    figure.canvas.draw()
    if width and abs(figure.get_size_inches()[0] - width) > 1e-9:
        print(f"{name}: {figure.get_size_inches()[0]} inches wide, not {width}")
    for k, (text, box) in enumerate(drawn):
        if min(box.x0, box.y0, figure.bbox.x1 - box.x1, figure.bbox.y1 - box.y1) < -1.0:
            print(f"{name}: {text!r} is cut off")
        for other, of in drawn[:k]:
            if min(box.x1, of.x1) - max(box.x0, of.x0) > 1.0 and min(box.y1, of.y1) - max(box.y0, of.y0) > 1.0:
                print(f"{name}: {text!r} is over {other!r}")
    drawing.plt.close(figure)


Text.draw = noted
for folder in map(Path, sys.argv[1:]):
    results = read_results(folder)
    everything = states(results, evenly(results.frames, 3))
    limits = limits_of(everything)
    for width in (None, 3.5):
        drawing.use(width=width)
        for name, draw_one in PICTURES.items():
            check(f"{folder} {name} {width}", draw_one(results, limits), width)
        check(f"{folder} state {width}", draw_state(results, limits), width)
        check(f"{folder} evolution {width}", draw_evolution(everything, limits), width)
    drawing.use(width=None, head=False)
    check(f"{folder} histories", draw_histories(results))
    pages, end = [], report_pdf.Pages.end
    report_pdf.Pages.end = lambda page: (pages.append(page.number), check(f"{folder} page {page.number}", page.figure))
    report.write_pdf(f"{folder}/report.pdf", results, argparse.Namespace(title=None, author="A", date="B"), everything)
    report_pdf.Pages.end = end
    # Three pages are for many figures.
    if pages not in ([1], [1, 2], [1, 2, 3]):
        print(f"{folder}: {len(pages)} pages")
    drawing.use(head=True)
