"""Animations of a run: the damage, or the stress, of the deforming body; the pressure along Γ_C."""

import matplotlib.pyplot as plt

from contact_pressure import draw_pressure
from limits import limits_of
from maps import draw_state
from reading import evenly, states
from signorini_files import is_of_run
from signorini_movies import FRAMES, movie


def animate(results, factor, kind):
    """Draws the animations of the body, `damage` or without damage `stress`, and `pressure` into the
    result folder; yields their paths."""
    chosen = states(results, evenly(results.frames, FRAMES))
    limits = limits_of(chosen, factor)
    body = "damage" if limits.is_damaged else "stress"
    for name, draw in ((body, draw_state), ("pressure", draw_pressure)):
        figure = draw(chosen[0], limits)
        if figure is None:
            continue
        path = results.folder / f"{name}.{kind}"
        with movie(figure, path, is_of_run) as grab:
            for state in chosen:
                draw(state, limits, figure)
                grab()
        plt.close(figure)
        yield path
