"""The description of a plane mesh. Each format fills one, and msh.py writes it."""
import re
import sys
from collections import defaultdict
from dataclasses import dataclass

# The numbers of nodes of lines and faces: the corners come first, then the middles of the sides, then the centre. Masses and
# springs have dimension 0; sets may name them.
SIZES = {0: range(9), 1: (2, 3), 2: (3, 4, 6, 8, 9)}
PLANE = "the mesh must be plane, of triangles or quadrilaterals (as CPS3, CPE4, CPS6 or CPE8)"


def refuse(place, problem):
    """Ends the program with a message. The place is as `file.inp, line 12`, or empty."""
    sys.exit(f"{place}: {problem}" if place else problem)


def text_of(path, encoding="utf-8-sig"):
    """The text of a file."""
    text = path.read_text(encoding=encoding, errors="replace")
    if re.search(r"[\0-\x08]", text):
        refuse("", f"it is a binary file; export the mesh as text, with the ending {path.suffix} only if it is in this format")
    return text


def whole(word):
    """The whole number in a word. Python itself reads 1_0 too."""
    if not re.fullmatch(r"[+-]?\d+", word.strip()):
        raise ValueError(f"{word.strip() or 'nothing'} is no whole number")
    return int(word)


def real(word):
    """The number in a word. Fortran also writes 1.D+0 and 1.5-3; a blank is 0."""
    parts = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]([+-]?\d+)|([+-]\d+))?", word.strip() or "0")
    if not parts:
        raise ValueError(f"{word.strip()} is no number")
    return float(f"{parts[1]}e{parts[2] or parts[3] or 0}")


@dataclass
class Node:
    """Its coordinates, and its place in the file."""
    at: list
    place: str


@dataclass
class Element:
    """A line (dimension 1) or a face (dimension 2). The family is its type in the words of its format."""
    family: str
    dimension: int
    nodes: list
    place: str


class Mesh:
    """Nodes and elements by label, and sets by name. A set is a list of (members, place): one for each place that names some.

    The members are labels of nodes, labels of elements, or sides: pairs of the label of a face and the number of its side.
    Side i goes from corner i to corner i + 1, and the first one is 0; None stands for all outer sides of the face. The program
    makes no set for a name in `hidden`. Notes are for the user; they are kept in the .msh.
    """

    def __init__(self):
        self.nodes, self.elements, self.notes, self.hidden = {}, {}, [], set()
        self.materials = None  # The array of the numbers of materials that the user chose.
        self.node_sets, self.element_sets, self.side_sets = (defaultdict(list) for _ in range(3))

    def add_node(self, label, at, place=""):
        """Adds a node with two or three coordinates."""
        node = Node([*map(float, at), 0.0][:3], place)
        first = self.nodes.setdefault(label, node)
        if first.at != node.at:
            refuse(place, f"node {label} stands {_above(first)} with other coordinates; give each node a number of its own")

    def add_element(self, label, family, dimension, nodes, place=""):
        """Adds a line or a face."""
        if len(nodes) not in SIZES.get(dimension, ()):
            refuse(place, f"element {label} ({family}) has {len(nodes)} nodes in {dimension} dimensions; {PLANE}")
        element = Element(family, dimension, nodes, place)
        first = self.elements.setdefault(label, element)
        if (first.dimension, first.nodes) != (dimension, nodes):
            refuse(place, f"element {label} stands {_above(first)} with other nodes; give each element a number of its own")

    def check(self):
        """Refuses elements and sets that name what is not there."""
        for label, element in self.elements.items():
            if lost := set(element.nodes) - self.nodes.keys():
                refuse(element.place, f"element {label} refers to node {min(lost)}, which the file does not list")
        for kind, known, sets in (("node", self.nodes, self.node_sets), ("element", self.elements, self.element_sets)):
            for name, parts in sets.items():
                for members, place in parts:
                    if lost := [label for label in members if label not in known]:
                        refuse(place, f"the set {name} names {kind} {lost[0]}, which the file does not list")
        for name, parts in self.side_sets.items():
            for sides, place in parts:
                for label, side in sides:
                    of = self.elements.get(label)
                    if of is None or of.dimension != 2:
                        refuse(place, f"the surface {name} names the element {label}, which is no triangle or quadrilateral "
                                      "of the file")
                    if side is not None and not 0 <= side < corners(of.nodes):
                        refuse(place, f"the surface {name} names side {side + 1} of element {label}, which has "
                                      f"{corners(of.nodes)} sides")


def corners(nodes):
    """The number of corners of a face."""
    return 3 if len(nodes) in (3, 6) else 4


def _above(first):
    return f"above ({first.place})" if first.place else "twice in the file"
