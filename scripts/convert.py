"""Writes the plane mesh FILE of another program as MSH 4.1 to stdout. The suffix names the format: Abaqus and CalculiX (.inp)
and I-DEAS (.unv) are read here, because meshio loses their surfaces and groups; meshio reads the others.

Sets become physical groups. A set of elements is a surface, one of line elements a curve. A surface of element sides is a
curve; so is a set of nodes, with the edges of the outer boundary that have both ends in the set.
"""
import contextlib
import io
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

# The numbers of nodes of lines and faces: the corners come first, then the middles of the sides, then the centre.
SIZES = {1: (2, 3), 2: (3, 4, 6, 8, 9)}
PLANE = "the mesh must be plane, of triangles or quadrilaterals (as CPS3, CPE4, CPS6 or CPE8)"


class Mesh:
    def __init__(self):
        self.nodes, self.elements = {}, {}  # [x, y, z] and (dimension, nodes), by label
        self.node_sets, self.element_sets, self.sides = (defaultdict(list) for _ in range(3))  # by name

    def add(self, label, dimension, nodes):
        if len(nodes) not in SIZES.get(dimension, ()):
            sys.exit(f"element {label} has {len(nodes)} nodes in {dimension} dimensions; {PLANE}")
        self.elements[label] = (dimension, nodes)


def abaqus_lines(path):
    """The lines of a file and of those that it reads, each with its place. A line of a keyword goes on after a comma."""
    before = ""
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        line = before + line.strip()
        before = line if re.match(r"\*[^*].*,$", line) else ""
        if before or not line or line.startswith("**"):
            continue
        place, name = f"{path.name}, line {number}", re.match(r"\*.*,\s*input\s*=\s*\"?([^\",]+)", line, re.I)
        if not re.match(r"\*include\b", line, re.I):
            yield place, line
        if name and not path.with_name(name[1]).is_file():
            sys.exit(f"{place}: the file {name[1]} does not exist")
        if name:
            yield from abaqus_lines(path.with_name(name[1]))


def abaqus(path, mesh):
    keyword, options, words, spelled, shift, hidden, count = "", {}, [], {}, (0, 0, 0), {""}, Counter()

    def own(sets, option):
        """The set with the name of this option, whose case does not matter."""
        name = options.get(option, "")
        return sets[spelled.setdefault((id(sets), name.upper()), name)]

    def members(sets, word):
        name = word.rsplit(".", 1)[-1].upper()
        if not word.isdigit() and (id(sets), name) not in spelled:
            sys.exit(f"{place}: there is no set {word} above")
        return [int(word)] if word.isdigit() else list(sets[spelled[id(sets), name]])

    for place, line in abaqus_lines(path):
        try:
            if line.startswith("*"):
                keyword, *rest = (word.strip() for word in line.split(","))
                keyword, words, parts = keyword.upper(), [], [word.partition("=") for word in rest]
                options = {key.strip().upper(): value.strip().strip('"') for key, _, value in parts}
                hidden |= set(options.values()) if "INTERNAL" in options else set()
                count[keyword] += 1
                if max(count["*PART"], count["*INSTANCE"]) > 1:
                    sys.exit(f"{place}: there are several parts or instances; write the mesh of one body")
                continue
            words += [word.strip() for word in line.rstrip(", ").split(",")]
            if keyword == "*NODE":
                mesh.nodes[int(words[0])] = [float(x or 0) for x in [*words[1:4], 0, 0][:3]]
                own(mesh.node_sets, "NSET").append(int(words[0]))
            elif keyword == "*ELEMENT" and not re.match("MASS|ROTARYI|SPRING|DASHPOT", options["TYPE"].upper()):
                kind = options["TYPE"].upper()
                face = re.match(r"(?:CPEG?|CPS|M3D|D?S|R3D|DC2D|AC2D|STRI)(\d)", kind)
                beam = re.match(r"(?:T[23]D|R2D)(\d)|B[23](\d)", kind)
                if not (face or beam):
                    sys.exit(f"{place}: elements of type {kind} are not read; {PLANE}")
                if len(words) <= int(face[1] if face else beam[1] or 1 + int(beam[2])) and line.endswith(","):
                    continue
                mesh.add(int(words[0]), 2 if face else 1, [int(word) for word in words[1:]])
                own(mesh.element_sets, "ELSET").append(int(words[0]))
            elif keyword in ("*NSET", "*ELSET"):
                sets = mesh.node_sets if keyword == "*NSET" else mesh.element_sets
                if "GENERATE" in options:
                    first, last, *step = map(int, words)
                    words = map(str, range(first, last + 1, *step))
                own(sets, keyword[1:]).extend(label for word in words for label in members(sets, word))
            elif keyword == "*SURFACE" and options.get("TYPE", "").upper() == "NODE":
                own(mesh.node_sets, "NAME").extend(members(mesh.node_sets, words[0]))
            elif keyword == "*SURFACE":
                side = int("".join(words[1:]).upper().replace("S", "") or 0)
                own(mesh.sides, "NAME").extend((label, side) for label in members(mesh.element_sets, words[0]))
            elif keyword == "*INSTANCE":
                if any(shift):
                    sys.exit(f"{place}: the instance is rotated; write the mesh in its place")
                shift = [float(x) for x in words]
            words = []
        except (ValueError, IndexError, KeyError) as error:
            sys.exit(f"{place}: `{line}` is wrong in {keyword or 'a file of Abaqus'} ({type(error).__name__} {error})")
    mesh.nodes = {label: [a + b for a, b in zip(at, shift)] for label, at in mesh.nodes.items()}
    for sets in (mesh.node_sets, mesh.element_sets, mesh.sides):
        for own in hidden & sets.keys():
            del sets[own]


def universal(path, mesh):
    for kind, text in re.findall(r"^ *-1\s*\n\s*(\d+)\s*\n(.*?)^ *-1\s*$", path.read_text(errors="replace"), re.S | re.M):
        lines = text.splitlines()
        while kind == "2411" and lines:
            label, at, *lines = lines
            mesh.nodes[int(label.split()[0])] = [float(x.replace("D", "E")) for x in at.split()]
        while kind == "2412" and lines:
            label, of, *_, size = map(int, lines[0].split())
            is_beam, rows = of in (11, 21, 22, 23, 24), 1 + (size - 1) // 8
            nodes = [int(word) for word in " ".join(lines[1 + is_beam:1 + is_beam + rows]).split()]
            lines = lines[1 + is_beam + rows:]
            # Middles stand between the corners of the elements of second order.
            nodes = nodes[::2] + nodes[1::2] if size in (6, 8) or (size == 3 and is_beam) else nodes
            if size > 1:
                mesh.add(label, 1 if is_beam else 2 if of < 100 else 3, nodes)
        while kind in ("2435", "2452", "2467", "2477") and lines:
            rows = 2 + (int(lines[0].split()[7]) + 1) // 2
            words = [int(word) for word in " ".join(lines[2:rows]).split()]
            for of, label in zip(words[::4], words[1::4]):
                {7: mesh.node_sets, 8: mesh.element_sets}.get(of, defaultdict(list))[lines[1].strip()].append(label)
            lines = lines[rows:]


def by_meshio(path, mesh):
    import meshio
    dimensions = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "quad": 2, "quad8": 2, "quad9": 2}
    with contextlib.redirect_stdout(sys.stderr):
        if path.suffix.lower() in (".bdf", ".nas"):
            # meshio wants a whole deck; that of a mesh alone may lack its frame.
            text = path.read_text(errors="replace")
            deck = ("" if "BEGIN BULK" in text else "BEGIN BULK\n") + text + "\nENDDATA\n"
            read = meshio.nastran._nastran.read_buffer(io.StringIO(deck))
        else:
            read = meshio.read(path)
    mesh.nodes = {i: [*map(float, at), 0.0][:3] for i, at in enumerate(read.points, 1)}
    # The first array of whole numbers has the tags; of the two of gmsh this one has the names.
    whole = [name for name, parts in read.cell_data.items() if all(part.dtype.kind in "iu" for part in parts)]
    tags = read.cell_data[min(whole, key=lambda name: name != "gmsh:physical")] if whole else None
    names = {(int(dimension), int(tag)): name for name, (tag, dimension) in read.field_data.items()}
    families = getattr(read, "cell_tags", None)
    for block, cells in enumerate(read.cells):
        dimension = dimensions.get(cells.type, 3)
        for i, nodes in enumerate(cells.data if dimension else []):
            label, tag = len(mesh.elements) + 1, 0 if tags is None else int(tags[block][i])
            mesh.add(label, dimension, [int(node) + 1 for node in nodes])
            own = [names.get((dimension, tag), str(tag))] if tag else []
            for name in own if families is None else families.get(tag, []):
                mesh.element_sets[name].append(label)
    for node, tag in enumerate(read.point_data.get("point_tags", []), 1):
        for name in getattr(read, "point_tags", {}).get(int(tag), []):
            mesh.node_sets[name].append(node)


def halves(mesh, nodes):
    """Both triangles of a quadrilateral, cut along the shorter diagonal that lies inside."""
    corners, middles, centre = nodes[:4], nodes[4:8], nodes[8:]
    at = [mesh.nodes[node] for node in corners]
    area = lambda p, q, r: (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])
    turned = lambda k: [(k + i) % 4 for i in range(4)]
    outside = lambda p, q, r, s: area(p, q, r) * area(p, r, s) <= 0
    length = lambda k: sum((p - q) ** 2 for p, q in zip(at[k], at[k + 2]))
    a, b, c, d = turned(min((0, 1), key=lambda k: (outside(*(at[i] for i in turned(k))), length(k))))
    halves = [[corners[i] for i in of] for of in ((a, b, c), (a, c, d))]
    if middles:
        between = centre[0] if centre else max(mesh.nodes) + 1
        mesh.nodes.setdefault(between, [(p + q) / 2 for p, q in zip(at[a], at[c])])
        halves[0] += [middles[a], middles[b], between]
        halves[1] += [between, middles[c], middles[d]]
    return halves


def converted(mesh):
    """The text in MSH 4.1: an entity for each combination of groups."""
    faces = {label: nodes for label, (dimension, nodes) in mesh.elements.items() if dimension == 2}
    if not faces:
        sys.exit(f"there are no triangles or quadrilaterals; {PLANE}")
    for label, (_, nodes) in mesh.elements.items():
        if lost := set(nodes) - mesh.nodes.keys():
            sys.exit(f"element {label} refers to node {min(lost)}, which the file does not list")
    key = lambda edge: tuple(sorted(edge[:2]))
    edges = {}
    for label, nodes in faces.items():
        n = 3 if len(nodes) in (3, 6) else 4
        edges[label] = [[nodes[i], nodes[(i + 1) % n], *nodes[n + i:n + i + 1]] for i in range(n)]
    uses = Counter(key(edge) for sides in edges.values() for edge in sides)
    outer = lambda sides: [edge for edge in sides if uses[key(edge)] == 1]
    lines, curves, surfaces = {}, defaultdict(set), defaultdict(set)

    def name_edges(name, found):
        for a, b, *more in found:
            # In some formats the middle of a line of second order is its second node.
            edge = [a, *more, b] if more and key([a, b]) not in uses else [a, b, *more]
            lines[key(edge)] = edge
            curves[key(edge)].add(name)

    for name, labels in mesh.element_sets.items():
        own = [label for label in labels if label in mesh.elements]
        name_edges(name, [mesh.elements[label][1] for label in own if label not in faces])
        for label in faces.keys() & own:
            surfaces[label].add(name)
    for name, sides in mesh.sides.items():
        for label, side in sides:
            if label not in edges or side > len(edges[label]):
                sys.exit(f"surface {name}: element {label} is missing or has no side S{side}")
            name_edges(name, [edges[label][side - 1]] if side else outer(edges[label]))
    taken = set().union(*curves.values())
    for name, labels in mesh.node_sets.items():
        ends = set(labels) if name not in taken else set()
        name_edges(name, [edge for sides in edges.values() for edge in outer(sides) if ends.issuperset(edge[:2])])
    for label in faces.keys() - surfaces.keys() if surfaces else ():
        # Triangles in no physical surface would be left out.
        surfaces[label].add("other")
    triangles = [(part, surfaces[label]) for label, nodes in faces.items()
                 for part in ([nodes] if len(nodes) in (3, 6) else halves(mesh, nodes))]
    if count := len(triangles) - len(faces):
        print(f"note: its {count} quadrilaterals are cut into two triangles each", file=sys.stderr)

    names, entities, blocks, number = {}, {1: {}, 2: {}}, "", 0
    for dimension, items in {1: [(lines[of], groups) for of, groups in curves.items()], 2: triangles}.items():
        for number, (nodes, groups) in enumerate(items, number + 1):
            tags = tuple(names.setdefault((dimension, name), len(names) + 1) for name in sorted(groups))
            entity = entities[dimension].setdefault(tags, len(entities[dimension]) + 1)
            kind = {(1, 2): 1, (1, 3): 8, (2, 3): 2, (2, 6): 9}[dimension, len(nodes)]
            blocks += f"{dimension} {entity} {kind} 1\n{number} {' '.join(map(str, nodes))}\n"
    size = len(mesh.nodes)
    return "\n".join([
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat", "$PhysicalNames", str(len(names)),
        *(f'{dimension} {tag} "{name}"' for (dimension, name), tag in names.items()), "$EndPhysicalNames",
        "$Entities", f"0 {len(entities[1])} {len(entities[2])} 0",
        *(f"{entity} 0 0 0 0 0 0 {len(tags)} {' '.join(map(str, tags))} 0" for of in entities.values() for tags, entity in of.items()),
        "$EndEntities", "$Nodes", f"1 {size} 1 {max(mesh.nodes)}", f"2 1 0 {size}", *map(str, mesh.nodes),
        *(" ".join(map(repr, at)) for at in mesh.nodes.values()), "$EndNodes",
        "$Elements", f"{number} {number} 1 {number}", f"{blocks}$EndElements", ""])


path, mesh = Path(sys.argv[1]), Mesh()
try:
    {".inp": abaqus, ".unv": universal}.get(path.suffix.lower(), by_meshio)(path, mesh)
except ImportError as error:
    sys.exit(f"Python lacks {error.name}, which reads this file (Debian: apt install python3-{error.name}; or PYTHON=… for another Python)")
except (Exception, SystemExit) as error:
    # meshio ends the program where it cannot read a file; the messages of this script are texts.
    if isinstance(error, SystemExit) and isinstance(error.code, str):
        raise
    reason = f"{type(error).__name__}: {error}".splitlines()[0]
    sys.exit(f"it cannot be read as {path.suffix} ({reason}); export it as .inp, .unv or .msh")
sys.stdout.write(converted(mesh))
