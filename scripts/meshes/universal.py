"""Reads I-DEAS universal files (.unv), in which meshio loses the groups.

A file is a list of datasets between lines of -1. A dataset begins with its number. A number in no list here is refused.
"""
from meshes.description import PLANE, real, refuse, text_of, whole

NODES, ELEMENTS, SYSTEMS = 2411, 2412, 2420
GROUPS = (2435, 2452, 2467, 2477)
# Header, units, materials, properties, loads, restraints and results.
HARMLESS = (55, 56, 57, 58, 82, 151, 164, 752, 755, 770, 771, 772, 773, 776, 788, 789, 790, 791, 792, 1700, 1703, 1706, 1709, 1710,
            1712, 1713, 1714, 1715, 1716, 1717, 1718, 1719, 1720, 2310, 2322, 2325, 2326, 2414, 2415, 2416, 2422, 2433, 2434,
            2436, 2437, 2438, 2439, 2440, 2448, 2449, 2450, 2451, 2465, 2470)
# The numbers of the types of elements. Beams have a line of their own before the nodes.
BEAMS = (11, 21, 22, 23, 24)
LINES = (*BEAMS, 31, 32)
FACES = (*range(41, 46), *range(51, 56), *range(61, 66), *range(71, 76), *range(91, 96))
AXISYMMETRIC = range(81, 86)
POINTS = (121, 122, *range(136, 143), 151, 152, 161, 171)


class Lines:
    """The lines of a dataset, taken one after the other."""

    def __init__(self, path):
        self.name, self.lines, self.at = path.name, text_of(path).splitlines(), 0

    @property
    def place(self):
        return f"{self.name}, line {self.at}"

    def is_end(self):
        """Is the next line the end of a dataset?"""
        if self.at == len(self.lines):
            refuse(self.place, "the file ends within a dataset; it was cut off")
        return self.lines[self.at].strip() == "-1"

    def take(self):
        """The next line, which is no end of a dataset."""
        if self.is_end():
            refuse(f"{self.name}, line {self.at + 1}", "the dataset ends within a record")
        self.at += 1
        return self.lines[self.at - 1]

    def numbers(self, count=None):
        """The whole numbers of the next line."""
        numbers = [whole(word) for word in self.take().split()]
        if count and len(numbers) < count:
            raise ValueError(f"{count} whole numbers are expected")
        return numbers

    def many(self, count, a_line):
        """Whole numbers in lines of so many."""
        numbers = []
        while len(numbers) < count:
            numbers += self.numbers(min(a_line, count - len(numbers)))
        if len(numbers) > count:
            raise ValueError(f"{count} whole numbers are expected")
        return numbers


def node(lines, mesh, systems):
    label, system, *_ = lines.numbers(2)
    at = [real(word) for word in lines.take().split()]
    if len(at) != 3:
        raise ValueError("three coordinates are expected")
    systems.setdefault(system, lines.place)
    mesh.add_node(label, at, lines.place)


def element(lines, mesh):
    label, kind, *_, size = lines.numbers(6)
    place = lines.place
    if kind in AXISYMMETRIC:
        refuse(place, f"elements of type {kind} are axisymmetric, and this program computes plane bodies")
    if kind not in (*LINES, *FACES, *POINTS):
        refuse(place, f"elements of type {kind} are not read; {PLANE}")
    if kind in BEAMS:
        lines.take()
    nodes = lines.many(size, 8)
    # Middles stand between the corners of the elements of second order.
    if size in (6, 8) or (size == 3 and kind in LINES):
        nodes = nodes[::2] + nodes[1::2]
    mesh.add_element(label, str(kind), 1 if kind in LINES else 2 if kind in FACES else 0, nodes if kind not in POINTS else [], place)


def group(lines, mesh, seen):
    numbers = lines.numbers(8)
    count, name, place = numbers[7], lines.take().strip() or str(numbers[0]), lines.place
    if name in seen:
        refuse(place, f"there is a group {name} above; give each a name of its own")
    seen.add(name)
    # A line has two members; where nodes end and elements begin gmsh starts a new one.
    words = lines.many(4 * count, 4)
    for of, label in zip(words[::4], words[1::4]):
        if of not in (7, 8):
            refuse(place, f"the group {name} has an entity of type {of}; only nodes (7) and elements (8) are read")
        (mesh.node_sets if of == 7 else mesh.element_sets)[name].append(([label], place))


def system(lines, defined):
    """A coordinate system: its number, and whether it is that of the body."""
    number, kind, *_ = lines.numbers(2)
    lines.take()
    rows = [[real(word) for word in lines.take().split()] for _ in range(4)]
    defined[number] = kind == 0 and rows == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]


def read(path, mesh):
    lines, used, defined, seen = Lines(path), {}, {}, set()
    kind = None
    try:
        while lines.at < len(lines.lines):
            if not lines.lines[lines.at].strip():
                lines.at += 1
                continue
            if not lines.is_end():
                refuse(f"{path.name}, line {lines.at + 1}", "a dataset begins with -1; this is no universal file, or it lost lines")
            lines.at += 1
            kind = lines.numbers(1)[0] if not lines.is_end() else 0
            if kind not in (NODES, ELEMENTS, SYSTEMS, *GROUPS, *HARMLESS):
                refuse(lines.place, f"the dataset {kind} is not known here; write nodes as 2411, elements as 2412 and groups as 2467")
            if kind == SYSTEMS:
                lines.take(), lines.take()
            while not lines.is_end():
                if kind == NODES:
                    node(lines, mesh, used)
                elif kind == ELEMENTS:
                    element(lines, mesh)
                elif kind in GROUPS:
                    group(lines, mesh, seen)
                elif kind == SYSTEMS:
                    system(lines, defined)
                else:
                    lines.take()
            lines.at += 1
    except ValueError as error:
        refuse(lines.place, f"`{lines.lines[lines.at - 1].strip()}` is wrong in dataset {kind} ({error})")
    for number, place in used.items():
        if not defined.get(number, True):
            refuse(place, f"the node stands in the coordinate system {number} of dataset 2420, which is cylindrical, turned or moved; "
                          "export in the global system")
