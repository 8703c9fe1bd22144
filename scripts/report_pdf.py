"""The pages of report.pdf: text as text, pictures as vector graphics."""

from contextlib import contextmanager

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages

import drawing
from drawing import INK, OPTIONS, plt, width_of, wrapped
from signorini_files import whole
from table import text_of

# A4, its margins, and the space between blocks, inches.
WIDTH, HEIGHT, MARGIN, SPACE = 8.27, 11.69, 0.5, 0.12
FULL = WIDTH - 2 * MARGIN
# The size of letters, points, and the height of a line, inches.
SIZE, LINE = 7.5, 0.145
# Tables that are wider than a page by up to this factor have smaller letters; and those beside a picture, by the second one.
WIDEST, BESIDE = 1.3, 1.1
# The least width of a last column of sentences, which is narrower in a wide table, inches.
SENTENCES = 1.8


class Pages:
    """Pages of blocks that stand beside each other where there is room, and otherwise below each other. A picture may stand at the
    right margin, and the blocks that fit beside it."""

    def __init__(self, pdf):
        self.pdf, self.number = pdf, 0
        self.start()

    def start(self):
        """Starts a page."""
        self.x, self.y, self.bottom, self.number = MARGIN, MARGIN, MARGIN, self.number + 1
        # The right end of blocks beside a picture at the margin, and the lower end of this.
        self.right, self.until, self.is_aside = WIDTH - MARGIN, MARGIN, False
        self.figure = plt.figure(figsize=(WIDTH, HEIGHT))

    def end(self):
        """Saves the page."""
        self.pdf.savefig(self.figure, dpi=150)
        plt.close(self.figure)

    def next(self):
        """Saves the page, and starts another one."""
        self.end()
        self.start()

    def place(self, width, height):
        """The page and the upper left corner of a new block of this size."""
        if self.is_aside:
            self.is_aside, self.right, self.until = False, WIDTH - MARGIN - width - SPACE, self.y + height + SPACE
            return self.figure, self.right + SPACE, self.y
        if self.x > MARGIN and self.x + width > MARGIN + self.room + 0.01:
            self.new_line()
        if width > self.room + 0.01:
            self.y = self.bottom = max(self.bottom, self.until)
        if self.y > MARGIN and self.y + height > HEIGHT - MARGIN + 0.01:
            self.next()
        x, y = self.x, self.y
        self.x, self.bottom = x + width + SPACE, max(self.bottom, y + height + SPACE)
        return self.figure, x, y

    def new_line(self):
        """The next block stands below all others."""
        self.x, self.y = MARGIN, self.bottom

    def aside(self):
        """The next block is a picture at the right margin."""
        self.new_line()
        self.is_aside = True

    @property
    def room(self):
        """The width of the line."""
        return (self.right if self.y < self.until - 0.01 else WIDTH - MARGIN) - MARGIN

    @property
    def left(self):
        """The height below all blocks of the page."""
        return HEIGHT - MARGIN - max(self.bottom, self.until)

    def write(self, x, y, text, size=SIZE, **style):
        self.figure.text(x / WIDTH, 1.0 - y / HEIGHT, text, size=size, va="top", parse_math=False, **style)

    def text(self, text, size=SIZE, **style):
        """A block of text over the full width."""
        lines, line = wrapped(text, FULL / (1.15 if "weight" in style else 1.0), size), LINE * size / SIZE
        self.new_line()
        _, x, y = self.place(FULL, line * len(lines) - 0.6 * SPACE)
        for k, text in enumerate(lines):
            self.write(x, y + k * line, text, size, **style)

    def table(self, title, rows, head=()):
        """A block with a title and rows of cells, below a head if there is one. Columns are as wide as their widest
        cells. In a table that is too wide, sentences of the last column have several lines; then letters are smaller, or
        columns stand below the others, with the first column again."""
        cells = [[text_of(cell) for cell in row] for row in rows]
        columns = [list(column) for column in zip(*cells)]
        widths = [max(width_of(cell, SIZE) for cell in column) + 0.15 for column in columns]
        if head:
            widths = [max(width, min(width_of(name, SIZE) + 0.15, 1.0)) for width, name in zip(widths, head)]
        room = self.room if sum(widths) <= BESIDE * self.room else FULL
        widths[-1] = max(min(widths[-1], SENTENCES), widths[-1] - max(0.0, sum(widths) - room))
        size = room / sum(widths) if room < sum(widths) <= WIDEST * room else 1.0
        while columns:
            count = len(columns)
            while count > 2 and size * sum(widths[:count]) > room + 1e-9:
                count -= 1
            self._part(title, columns[:count], widths[:count], head[:count], size)
            title = ""
            columns, widths, head = ([of[0], *of[count:]] if count < len(of) else [] for of in (columns, widths, head))

    def _part(self, title, columns, widths, head, size):
        heads, line = [wrapped(name, width - 0.1, SIZE) for name, width in zip(head, widths)], size * LINE
        cells = [[[cell] for cell in column] for column in columns]
        cells[-1] = [wrapped(cell, widths[-1] - 0.1, SIZE) for cell in columns[-1]]
        # The first line of each row.
        lines = np.cumsum([0] + [max(1, *map(len, row)) for row in zip(*cells)])
        first, above = 1.4 * LINE * bool(title), line * max(map(len, heads), default=0)
        _, x, y = self.place(max(size * sum(widths) - 0.1, width_of(title, SIZE) * 1.4), first + above + lines[-1] * line)
        self.write(x, y, title, size=1.2 * SIZE, weight="bold", color=INK)
        for k, (column, width) in enumerate(zip(cells, widths)):
            for number, text in enumerate(heads[k] if heads else ()):
                self.write(x, y + first + number * line, text, size * SIZE, color="#66707a")
            for start, cell in zip(lines, column):
                for number, text in enumerate(cell, start):
                    self.write(x, y + first + above + number * line, text, size * SIZE)
            x += size * width


@contextmanager
def pages_of(path):
    """Pages for a PDF, and pictures for them."""
    before = dict(vars(OPTIONS))
    try:
        with whole(path) as part, PdfPages(part) as pdf:
            pages = Pages(pdf)
            yield pages
            pages.end()
    finally:
        drawing.use(**before)
