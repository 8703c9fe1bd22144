"""Writers of animations: GIF by pillow, MP4 by ffmpeg."""

from contextlib import contextmanager
from pathlib import Path

from matplotlib.animation import FFMpegWriter, PillowWriter

from signorini_files import whole

# Every animation has this comment, by which one is known as written by this program.
COMMENT = "An animation by signorini."
# Frames of an animation, at most, and frames per second.
FRAMES, RATE = 50, 6


class GifWriter(PillowWriter):
    """Without transparency, for which the colours would be reduced too far."""

    def finish(self):
        self._frames = [frame.convert("RGB") for frame in self._frames]
        self._frames[0].info["comment"] = COMMENT.encode()
        super().finish()


MOVIES = {"gif": GifWriter, "mp4": FFMpegWriter}


def check_movie(kind):
    """Raises a ValueError if animations of this kind cannot be written here."""
    if kind not in MOVIES:
        raise ValueError(f"{kind}: animations are {' or '.join(MOVIES)}; choose one of these endings")
    if not MOVIES[kind].isAvailable():
        raise ValueError("mp4 needs ffmpeg (Debian: apt install ffmpeg); install it, or choose gif")


def is_movie(path):
    """Whether a file is an animation of this program."""
    return COMMENT.encode() in Path(path).read_bytes()


@contextmanager
def movie(figure, path, is_own, rate=RATE):
    """A function that adds the figure as it is to an animation, which takes the place of `path` in the end."""
    kind = Path(path).suffix[1:]
    writer = MOVIES[kind](fps=rate, metadata={"comment": COMMENT})
    with whole(path, is_own) as part, writer.saving(figure, part, dpi=110):
        yield writer.grab_frame
