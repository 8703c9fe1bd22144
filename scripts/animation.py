"""Animations of a run: the damage, or the stress, of the deforming body; the pressure along Γ_C."""

import matplotlib.pyplot as plt
from matplotlib.animation import FFMpegWriter, PillowWriter

from contact_pressure import draw_pressure
from limits import limits_of
from maps import draw_state
from reading import evenly, states
from results import ResultError
from signorini_files import whole


class GifWriter(PillowWriter):
    """Without transparency, for which the colours would be reduced too far."""

    def finish(self):
        self._frames = [frame.convert("RGB") for frame in self._frames]
        super().finish()


MOVIES = {"gif": GifWriter, "mp4": FFMpegWriter}
# Frames of an animation, at most, and frames per second.
FRAMES, RATE = 50, 6


def animate(results, factor, kind):
    """Draws the animations of the body, `damage` or without damage `stress`, and `pressure` into the
    result folder; yields their paths."""
    writer = MOVIES[kind]
    if not writer.isAvailable():
        raise ResultError("--animate mp4 needs ffmpeg (Debian: apt install ffmpeg); or use gif")
    chosen = states(results, evenly(results.frames, FRAMES))
    limits = limits_of(chosen, factor)
    body = "damage" if limits.is_damaged else "stress"
    for name, draw in ((body, draw_state), ("pressure", draw_pressure)):
        figure = draw(chosen[0], limits)
        if figure is None:
            continue
        path, movie = results.folder / f"{name}.{kind}", writer(fps=RATE)
        with whole(path) as part, movie.saving(figure, part, dpi=110):
            for state in chosen:
                draw(state, limits, figure)
                movie.grab_frame()
        plt.close(figure)
        yield path
