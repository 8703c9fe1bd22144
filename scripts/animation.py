"""Animations of a run: the damage, or the stress, of the deforming body; the pressure along Γ_C."""

import matplotlib.pyplot as plt

from contact_pressure import draw_pressure
from limits import limits_of
from maps import draw_state
from reading import evenly, states
from signorini_files import is_of_run
from signorini_movies import FRAMES, movie


# The pictures of which there are animations: those of the body have one.
ANIMATED = {"deformed", "stress-damage", "pressure"}


def animate(results, factor, kind, only):
    """Draws the animations of the body, `damage` or without damage `stress`, and `pressure` into the
    result folder, if their pictures are among `only`; yields their paths."""
    chosen = states(results, evenly(results.frames, FRAMES))
    limits = limits_of(chosen, factor)
    body = "damage" if limits.is_damaged else "stress"
    for name, draw, pictures in ((body, draw_state, ANIMATED - {"pressure"}), ("pressure", draw_pressure, {"pressure"})):
        figure = draw(chosen[0], limits) if pictures & set(only) else None
        if figure is None:
            continue
        path = results.folder / f"{name}.{kind}"
        with movie(figure, path, is_of_run) as grab:
            for state in chosen:
                draw(state, limits, figure)
                grab()
        plt.close(figure)
        yield path
