"""Reads input files of Abaqus and CalculiX (.inp), in which meshio loses the surfaces.

Nodes, elements and names belong to the part or to the assembly that defines them. One part has the triangles or quadrilaterals:
this is the body. A set of the assembly gives its members in the body; parts without faces, as a rigid die, are left out.
"""
import math
import re
from difflib import get_close_matches

from meshes.abaqus_keywords import CHANGING, HARMLESS, NOTED, OF_SCENE, READ
from meshes.description import PLANE, Mesh, real, refuse, text_of, whole

# The types of faces: plane elements, with sides S1 to S4, and shells, with sides E1 to E4 in Abaqus and S3 to S6 in CalculiX.
PLANES = re.compile(r"(?:CPEG?|CPS|CAX|DC2D|AC2D)(\d)(?!\d)")
SHELLS = re.compile(r"(?:M3D|DS|S|R3D|SFM3D|STRI)(\d)")
LINES = re.compile(r"(?:[TF][23]D|R2D)(\d)|(?:B|PIPE)[23]([123])")
POINTS = re.compile("MASS|ROTARYI|SPRING|DASHPOT|CONN[23]D|GAP|HEATCAP")
ANALYTICAL = ("SEGMENTS", "CYLINDER", "REVOLUTION", "USER")


class Scope:
    """A part, or the assembly: its mesh, and its sets by kind and name in capitals. A set is a name, and a list of (scope of
    the members, members, place)."""

    def __init__(self, title):
        self.title, self.mesh, self.sets, self.hidden = title, Mesh(), {"node": {}, "element": {}, "side": {}}, set()

    def put(self, kind, name, owner, members, place):
        """Adds members to a set, whose name has any case."""
        if name:
            self.sets[kind].setdefault(name.upper(), (name, []))[1].append((owner, members, place))

    def known(self, kind):
        return self.mesh.nodes if kind == "node" else self.mesh.elements


class Block:
    """A keyword, its options, and its place."""

    def __init__(self, line, place):
        words = [part.partition("=") for part in line.split(",")]
        self.place, self.name = place, "".join(words[0][0].split()).upper().lstrip("*")
        self.options = {"".join(name.split()).upper(): value.strip().strip('"') for name, _, value in words[1:] if name.strip()}
        listed = (*READ, *NOTED, *OF_SCENE, *HARMLESS)
        if self.name in CHANGING:
            refuse(place, f"*{self.name} may make, move or take away nodes or elements and is not read; write the whole mesh")
        if self.name not in listed:
            refuse(place, f"the keyword *{self.name} is not known here{meant(self.name, listed, '*')}; if it changes no nodes, "
                          "elements or sets, remove it")
        if self.name in READ:
            known = [option for options in READ[self.name] for option in options]
            for option in self.options.keys() - known:
                refuse(place, f"the option {option} of *{self.name} is not known here{meant(option, known)}; if it changes no "
                              "nodes, elements or sets, remove it")

    def __getitem__(self, option):
        if not self.options.get(option):
            refuse(self.place, f"*{self.name} needs the option {option}")
        return self.options[option]


def meant(word, known, star=""):
    """A suggestion for an unknown word."""
    return "".join(f" (did you mean {star}{near}?)" for near in get_close_matches(word, known, 1, 0.8))


def lines_of(path, folder, above=()):
    """The lines of a file and of those that it reads, each with its place. A line of a keyword goes on after a comma."""
    before = ""
    for number, line in enumerate(text_of(path).splitlines(), 1):
        line = before + line.strip()
        before = line if re.match(r"\*[^*].*,$", line) else ""
        if before or not line or line.startswith("**"):
            continue
        place = f"{path.name}, line {number}"
        block = Block(line, place) if line.startswith("*") else None
        if not block or block.name != "INCLUDE":
            yield place, block or line
        if block and block.name in READ and ("INPUT" in block.options or block.name == "INCLUDE"):
            other = folder / block["INPUT"]
            if not other.is_file():
                refuse(place, f"the file {block['INPUT']} does not exist (it is sought in the folder of the first file)")
            if other.resolve() in (*above, path.resolve()):
                refuse(place, f"the file {block['INPUT']} includes itself")
            yield from lines_of(other, folder, (*above, path.resolve()))


def place_in(instance, at):
    """A place of a part in the assembly: moved by the first line of *INSTANCE, then turned about the axis of the second."""
    (a, b, c), (p, q, _), angle = instance
    x, y, z = (u + v for u, v in zip(at, (a, b, c)))
    cos, sin = math.cos(angle), math.sin(angle)
    return [p + cos * (x - p) - sin * (y - q), q + sin * (x - p) + cos * (y - q), z] if angle else [x, y, z]


class Reader:
    """Goes through the lines of a file."""

    def __init__(self):
        self.assembly = self.scope = Scope("the file")
        self.parts, self.instances, self.left_out, self.of_scene = {}, {}, {}, {}
        self.by_meshio, self.block, self.words, self.rows = False, None, [], 0

    def members(self, kind, word, scope, place):
        """The members that a word names, as (scope of the members, members): a label, a set, or one of an instance."""
        instance, _, name = word.rpartition(".") if word.upper() not in scope.sets[kind] else ("", "", word)
        if instance:
            scope = self.instance(instance, place)[0]
        if name.isdigit():
            return [(scope, [whole(name)])]
        if name.upper() not in scope.sets[kind]:
            refuse(place, f"there is no set {word} of {kind}s above in {scope.title}")
        return [(owner, labels) for owner, labels, _ in scope.sets[kind][name.upper()][1]]

    def instance(self, name, place):
        if name.upper() not in self.instances:
            refuse(place, f"there is no instance {name} above")
        return self.instances[name.upper()]

    def row(self, place, line):
        """Reads a line of data. Elements may take several."""
        if not self.block:
            refuse(place, f"`{line}` stands before the first keyword; this is no file of Abaqus or CalculiX")
        if self.block.name in READ:
            self.words += [word.strip().strip('"') for word in line.split(",")]
            if self.words[-1] == "":
                self.words.pop()
            self.rows += 1
            getattr(self, f"row_{self.block.name.lower()}", self.no_row)(place)

    def no_row(self, place):
        refuse(place, f"*{self.block.name} has no lines of data")

    def row_heading(self, place):
        self.by_meshio |= "".join(self.words).startswith("written by meshio")
        self.words = []

    def start(self, block):
        """Begins with a keyword."""
        if self.words:
            refuse(block.place, f"the lines of *{self.block.name} end within element {self.words[0]}")
        self.block, self.rows = block, 0
        for names, found in ((NOTED, self.left_out), (OF_SCENE, self.of_scene)):
            if block.name in names:
                found.setdefault(block.name, block.place)
        getattr(self, f"start_{block.name.lower()}", lambda block: None)(block)

    def leave(self, block):
        """Refuses a keyword within a part."""
        if self.scope is not self.assembly:
            refuse(block.place, f"{self.scope.title} has no end above")

    def start_assembly(self, block):
        self.leave(block)
        self.assembly.title = "the assembly"

    def start_part(self, block):
        self.leave(block)
        if block["NAME"].upper() in self.parts:
            refuse(block.place, f"there is a part {block['NAME']} above")
        self.scope = self.parts[block["NAME"].upper()] = Scope(f"part {block['NAME']}")

    def start_endpart(self, block):
        self.scope = self.assembly

    start_endinstance = start_endpart

    def start_instance(self, block):
        self.leave(block)
        if block["PART"].upper() not in self.parts:
            refuse(block.place, f"there is no part {block['PART']} above")
        self.scope = self.parts[block["PART"].upper()]
        self.instances[block["NAME"].upper()] = [self.scope, ([0.0] * 3, [0.0] * 3, 0.0), block["NAME"]]

    def row_instance(self, place):
        numbers, self.words = [real(word) for word in self.words], []
        of = self.instance(self.block["NAME"], place)
        if len(numbers) <= 3 and self.rows == 1:
            of[1] = ((numbers + [0.0] * 3)[:3], [0.0] * 3, 0.0)
        else:
            if self.rows > 2 or len(numbers) != 7:
                refuse(place, "an instance has a line of three numbers, and one of the ends of an axis and an angle")
            a, b, c, d, e, f, angle = numbers
            if angle and ((a, b) != (d, e) or c == f):
                refuse(place, "the instance is turned out of its plane; write the mesh in its place")
            of[1] = (of[1][0], [a, b, c], math.radians(angle) * (1 if f > c else -1))

    def row_node(self, place):
        (label, *at), self.words = self.words, []
        x, y, z, *_ = [real(word) for word in at] + [0.0] * 3
        system = self.block.options.get("SYSTEM", "R").upper()
        if system == "C":
            x, y = x * math.cos(math.radians(y)), x * math.sin(math.radians(y))
        elif system != "R":
            refuse(place, f"*NODE, SYSTEM={system} is not read; write x and y")
        if len(at) > 6:
            refuse(place, f"node {label} has {len(at)} numbers")
        self.scope.mesh.add_node(whole(label), [x, y, z], place)
        self.scope.put("node", self.block.options.get("NSET"), self.scope, [whole(label)], place)

    def row_element(self, place):
        kind = self.block["TYPE"].upper()
        face, line = PLANES.match(kind) or SHELLS.match(kind), LINES.match(kind)
        if "AX" in kind and not self.by_meshio:
            refuse(place, f"elements of type {kind} are axisymmetric, and this program computes plane bodies")
        if face or line:
            # Cubic beams (B23, B33) have two nodes, in files of meshio three.
            size = int(face[1]) if face else int(line[1] or {"1": 2, "2": 3, "3": 3 if self.by_meshio else 2}[line[2]])
            if len(self.words) < size + 1:
                return
            if len(self.words) > size + 1:
                refuse(place, f"element {self.words[0]} of type {kind} has {len(self.words) - 1} nodes")
        elif not POINTS.match(kind):
            refuse(place, f"elements of type {kind} are not read; {PLANE}")
        (label, *nodes), self.words = self.words, []
        nodes = [whole(node) for node in nodes] if face or line else []
        self.scope.mesh.add_element(whole(label), kind, 2 if face else 1 if line else 0, nodes, place)
        self.scope.put("element", self.block.options.get("ELSET"), self.scope, [whole(label)], place)

    def start_set(self, block):
        """An empty set has a name too. *NSET, ELSET=… names the nodes of elements."""
        kind = "node" if block.name == "NSET" else "element"
        name = block[block.name]
        if "INTERNAL" in block.options:
            self.scope.hidden.add(name.upper())
        self.scope.sets[kind].setdefault(name.upper(), (name, []))
        if kind == "node" and "ELSET" in block.options:
            for owner, labels in self.members("element", block["ELSET"], self.home(), block.place):
                nodes = [node for label in labels if label in owner.mesh.elements for node in owner.mesh.elements[label].nodes]
                self.scope.put(kind, name, owner, nodes, block.place)

    start_nset = start_elset = start_set

    def home(self):
        """The scope of the labels of a set: the instance that an option names, or the present part."""
        of = self.block.options.get("INSTANCE")
        return self.instance(of, self.block.place)[0] if of else self.scope

    def row_set(self, place):
        words, self.words = [word for word in self.words if word], []
        kind = "node" if self.block.name == "NSET" else "element"
        home, name = self.home(), self.block[self.block.name]
        if "GENERATE" not in self.block.options:
            for word in words:
                for owner, labels in self.members(kind, word, home, place):
                    self.scope.put(kind, name, owner, labels, place)
            return
        first, last, step = map(whole, [*words, "1"] if len(words) == 2 else words)
        if step < 1 or last < first:
            refuse(place, f"GENERATE wants a first, a last label and a step, as in 1, 9, 2, but has {', '.join(words)}")
        labels = range(first, last + 1, step)
        there = [label for label in home.known(kind) if label in labels]
        if len(there) < len(labels):
            home.mesh.notes.append(f"{place}: the file lists {len(there)} of the {len(labels)} {kind}s from {first} to {last} "
                                   f"of the set {name}")
        self.scope.put(kind, name, home, there, place)

    row_nset = row_elset = row_set

    def start_surface(self, block):
        """An empty surface has a name too."""
        kind = {"ELEMENT": "side", "NODE": "node"}.get(block.options.get("TYPE", "ELEMENT").upper())
        if kind:
            self.scope.sets[kind].setdefault(block["NAME"].upper(), (block["NAME"], []))

    def row_surface(self, place):
        words, self.words = self.words, []
        kind, name = self.block.options.get("TYPE", "ELEMENT").upper(), self.block["NAME"]
        if "INTERNAL" in self.block.options:
            self.scope.hidden.add(name.upper())
        if kind == "NODE":
            for owner, labels in self.members("node", words[0], self.scope, place):
                self.scope.put("node", name, owner, labels, place)
        elif kind == "ELEMENT":
            for owner, labels in self.members("element", words[0] if words else "", self.scope, place):
                word = words[1].upper() if len(words) > 1 else ""
                self.scope.put("side", name, owner, [side(owner, label, word, place) for label in labels], place)
        elif kind not in ANALYTICAL:
            refuse(place, f"*SURFACE, TYPE={kind} is not read; define the surface by elements")


def side(owner, label, word, place):
    """The side that a word as S1 names, as (label, number); see Mesh."""
    element = owner.mesh.elements.get(label)
    if element is None:
        refuse(place, f"element {label} of a surface is not listed above in {owner.title}")
    is_plane = bool(PLANES.match(element.family))
    if element.dimension == 1 or (is_plane and not word):
        return label, None
    if sign := re.fullmatch("S([1-4])" if is_plane else "E([1-4])|S([3-6])", word):
        return label, int(sign[1]) - 1 if sign[1] else int(sign[2]) - 3
    sides = "S1 to S4" if is_plane else "E1 to E4 (Abaqus) or S3 to S6 (CalculiX)"
    what = "names no side" if is_plane or word not in ("", "S1", "S2", "SPOS", "SNEG") else "is a face of the shell, not a side"
    refuse(place, f"{word or 'a line without a side'} {what} of element {label} of type {element.family}; the sides are {sides}")


def read(path, mesh):
    reader = Reader()
    for place, line in lines_of(path, path.parent):
        try:
            reader.start(line) if isinstance(line, Block) else reader.row(place, line)
        except (ValueError, IndexError, TypeError) as error:
            refuse(place, f"`{line}` is wrong in *{reader.block.name} ({error})")
    if reader.words:
        refuse(place, f"the file ends within element {reader.words[0]}")
    if reader.scope is not reader.assembly:
        refuse(place, f"the file ends within {reader.scope.title}")
    describe(reader, mesh)
    for found, why in ((reader.left_out, "left out: the scene says what holds the body"),
                       (reader.of_scene, "not read: write supports, loads, contact and materials into the scene")):
        if found:
            names = ", ".join(f"*{name} ({place})" for name, place in found.items())
            mesh.notes.append(f"{names} {'are' if len(found) > 1 else 'is'} {why}")


def describe(reader, mesh):
    """The body with the sets of its part and of the assembly."""
    assembly, still = reader.assembly, ([0.0] * 3, [0.0] * 3, 0.0)
    parts = [*reader.instances.values()] or [[part, still, ""] for part in reader.parts.values()]
    has_faces = lambda scope: any(element.dimension == 2 for element in scope.mesh.elements.values())
    bodies = [of for of in [*parts, [assembly, still, ""]] if has_faces(of[0])]
    if len(bodies) > 1:
        refuse("", f"there are several bodies ({', '.join(name or scope.title for scope, _, name in bodies)}); write the mesh of one")
    body, instance, name = bodies[0] if bodies else [assembly, still, ""]
    for scope in {id(scope): scope for scope, _, _ in parts if scope is not body and bodies}.values():
        mesh.notes.append(f"{scope.title} has no triangles or quadrilaterals and is left out; the gap of the scene describes a die")
    mesh.notes += body.mesh.notes
    mesh.nodes, mesh.elements = body.mesh.nodes, body.mesh.elements
    for node in mesh.nodes.values():
        node.at = place_in(instance, node.at)
    own = {"node": mesh.node_sets, "element": mesh.element_sets, "side": mesh.side_sets}
    of_assembly = {key for sets in assembly.sets.values() for key in sets.keys() - assembly.hidden} if body is not assembly else ()
    for scope in (body, assembly) if body is not assembly else (body,):
        for kind, sets in scope.sets.items():
            for key, (spelling, parts) in sets.items():
                check(kind, spelling, parts)
                if key in scope.hidden:
                    continue
                if scope is body and key in of_assembly:
                    mesh.notes.append(f"the name {spelling} is that of a set of the assembly; the set of {body.title} is "
                                      f"{name or body.title}.{spelling}")
                    spelling = f"{name or body.title}.{spelling}"
                own[kind][spelling] = [(labels, place) for owner, labels, place in parts if owner is body]


def check(kind, name, parts):
    """Refuses a set that names what is not there."""
    for owner, labels, place in parts if kind != "side" else ():
        for label in labels:
            if label not in owner.known(kind):
                refuse(place, f"the set {name} names {kind} {label}, which is not listed in {owner.title}")
