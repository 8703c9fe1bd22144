"""The pages of report.pdf: text as text, pictures as vector graphics."""

import textwrap
from contextlib import contextmanager
from itertools import zip_longest

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.textpath import TextPath

import drawing
from drawing import INK, plt
from table import text_of

# A4, its margins, and the space between blocks, inches.
WIDTH, HEIGHT, MARGIN, SPACE = 8.27, 11.69, 0.6, 0.15
FULL = WIDTH - 2 * MARGIN
# The size of letters, points, the height of a line, inches, and the number of letters that fit into the full width.
SIZE, LINE, LETTERS = 8, 0.155, 125
# The largest height of four pictures below each other, inches.
HIGHEST = 2.45


class Pages:
    """Pages of blocks that stand beside each other where there is room, and otherwise below each other."""

    def __init__(self, pdf, head):
        self.pdf, self.head, self.figure = pdf, head, None
        self.start()

    def start(self, highest=0.33 * HEIGHT):
        """Starts a page with pictures up to this height."""
        self.highest, self.x, self.y, self.bottom = highest, MARGIN, MARGIN, MARGIN
        self.figure = plt.figure(figsize=(WIDTH, HEIGHT))

    def end(self):
        """Saves the page. The titles of pictures lack `head`, the title of the report."""
        for part in self.figure.subfigs:
            for title in (*(axes.title for axes in part.axes), *filter(None, [part._suptitle])):
                title.set_text(title.get_text().removeprefix(self.head).strip("\n"))
        if self.figure.subfigs:
            drawing.wrap_titles(self.figure)
        self.pdf.savefig(self.figure, dpi=220)
        plt.close(self.figure)

    def place(self, width, height):
        """The upper left corner of a new block of this size."""
        if self.x > MARGIN and self.x + width > WIDTH - MARGIN + 0.01:
            self.x, self.y = MARGIN, self.bottom
        if self.y > MARGIN and self.y + height > HEIGHT - MARGIN + 0.01:
            self.end()
            self.start(self.highest)
        x, y = self.x, self.y
        self.x, self.bottom = x + width + SPACE, max(self.bottom, y + height + SPACE)
        return x, y

    @property
    def room(self):
        """The width beside the last block; half of the page if that is too small for a picture."""
        room = WIDTH - MARGIN - self.x
        return room if room > 2.5 else 0.5 * (FULL - SPACE)

    def panel(self, width, height):
        """A block for a picture."""
        height = min(height, self.highest)
        x, y = self.place(width, height)
        grid = self.figure.add_gridspec(
            3, 3, width_ratios=(x, width, WIDTH - x - width), height_ratios=(y, height, HEIGHT - y - height))
        return self.figure.add_subfigure(grid[1, 1])

    def write(self, x, y, text, size=SIZE, **style):
        self.figure.text(x / WIDTH, 1.0 - y / HEIGHT, text, size=size, va="top", parse_math=False, **style)

    def text(self, text, size=SIZE, **style):
        """A block of text."""
        lines = [part for line in text.splitlines() for part in textwrap.wrap(line, int(LETTERS * SIZE / size))]
        height = LINE * size / SIZE
        x, y = self.place(FULL, height * len(lines) - 0.6 * SPACE)
        for k, line in enumerate(lines):
            self.write(x, y + k * height, line, size, **style)

    def table(self, title, rows):
        """A block with a title and rows of cells. Columns are as wide as their widest cells."""
        columns = [list(map(text_of, column)) for column in zip_longest(*rows)]
        widths = [max(map(width_of, column)) + 0.15 for column in columns]
        x, y = self.place(max(sum(widths), width_of(title) * 1.4), (len(rows) + 1.4) * LINE)
        self.write(x, y, title, size=1.2 * SIZE, weight="bold", color=INK)
        for column, width in zip(columns, widths):
            for k, cell in enumerate(column):
                self.write(x, y + (k + 1.4) * LINE, cell)
            x += width


def width_of(text):
    """The width of a text, inches."""
    return TextPath((0, 0), text.replace("$", r"\$"), size=SIZE).get_extents().width / 72 if text.strip() else 0.0


@contextmanager
def pages_of(path, head):
    """Pages for a PDF. The titles of pictures are written without `head`; their widths are set for the pages."""
    style = {"savefig.bbox": None, "figure.constrained_layout.w_pad": 0.02, "figure.constrained_layout.h_pad": 0.02}
    try:
        with PdfPages(path) as pdf, plt.rc_context(style):
            pages = Pages(pdf, head)
            yield pages
            pages.end()
    finally:
        drawing.WIDTH = None
