"""Writes the description of a plane mesh as MSH 4.1.

Sets become physical groups. A set of faces is a surface, one of lines a curve. A set of sides is a curve; so is a set of nodes,
with the edges of the outer boundary that have both ends in the set.
"""
from collections import Counter, defaultdict

from meshes.description import PLANE, corners, refuse

# gmsh's element types, by dimension and number of nodes.
KINDS = {(1, 2): 1, (1, 3): 8, (2, 3): 2, (2, 6): 9, (2, 4): 3, (2, 8): 16, (2, 9): 10}


def edge_key(edge):
    """The ends of an edge, in increasing order."""
    return tuple(sorted(edge[:2]))


def sides(nodes):
    """The sides of a face, each with its ends, and its middle if there is one."""
    n = corners(nodes)
    return [[nodes[i], nodes[(i + 1) % n], *nodes[n + i:n + i + 1]] for i in range(n)]


def without_point_sides(element, label):
    """The nodes of a face. A quadrilateral with a side that is a point is a triangle."""
    kept = [side for side in sides(element.nodes) if side[0] != side[1]]
    ends = [side[0] for side in kept]
    if len(kept) < 3 or len(set(ends)) < len(ends):
        refuse(element.place, f"element {label} names node {Counter(ends or element.nodes).most_common(1)[0][0]} twice and has no area")
    return element.nodes if len(kept) == corners(element.nodes) else [*ends, *(side[2] for side in kept if side[2:])]


def curves_of(mesh, faces):
    """The edges in curves by their ends, and the names of the curves of each. A name of several kinds of sets is that of the sides,
    else of the lines, else of the nodes."""
    uses = Counter(edge_key(side) for nodes in faces.values() for side in sides(nodes))
    outer = [side for nodes in faces.values() for side in sides(nodes) if uses[edge_key(side)] == 1]
    lines, named, lost = {}, {}, []

    def name_edges(name, edges, what):
        found = {}
        for a, b, *more in edges:
            # In some formats the middle of a line of second order is its second node.
            edge = [a, *more, b] if more and edge_key([a, b]) not in uses else [a, b, *more]
            found[edge_key(edge)] = edge
        if not found:
            lost.append(f"{name} ({what})")
        elif named.setdefault(name, found).keys() != found.keys():
            mesh.notes.append(f"the name {name} is that of sets of two kinds with different edges; that of {what} is not read")
        lines.update(named.get(name, {}))

    for name, members in members_of(mesh, mesh.side_sets):
        found = []
        for label, side in members:
            edge = [] if side is None else sides(mesh.elements[label].nodes)[side]
            if edge and edge[0] == edge[1]:
                refuse(mesh.elements[label].place, f"side {side + 1} of element {label} is a point, and the surface {name} names it")
            found += [edge] if edge else [of for of in sides(faces[label]) if uses[edge_key(of)] == 1]
        name_edges(name, found, "0 sides of the body")
    for name, labels in members_of(mesh, mesh.element_sets):
        if not faces.keys() & labels or any(mesh.elements[label].dimension == 1 for label in labels):
            edges = [mesh.elements[label].nodes for label in labels if mesh.elements[label].dimension == 1]
            name_edges(name, edges, "lines" if edges else "0 lines of the body")
    for name, labels in members_of(mesh, mesh.node_sets):
        ends = set(labels)
        edges = [side for side in outer if ends.issuperset(side[:2])]
        name_edges(name, edges, "nodes" if edges else f"{len(ends)} node{'s' * (len(ends) != 1)} of the body")
        joined = {end for edge in edges for end in edge}
        left = [end for end in dict.fromkeys(of for side in outer for of in side[:2]) if end in ends - joined]
        if edges and left:
            x, y = mesh.nodes[left[0]].at[:2]
            mesh.notes.append(f"{len(left)} nodes of the set {name} on the boundary, as that at ({x:g}, {y:g}), are joined to no other one of it "
                              "by an edge, and are not read")
    if lost := [of for of in lost if of.partition(" (")[0] not in named]:
        mesh.notes.append(f"no edge of the boundary is in the sets {', '.join(dict.fromkeys(lost))}")
    curves = defaultdict(set)
    for name, found in named.items():
        for edge in found:
            curves[edge].add(name)
    return lines, curves


def members_of(mesh, sets):
    """Each set with all its members."""
    return [(name, [member for part, _ in parts for member in part]) for name, parts in sets.items() if name not in mesh.hidden]


def groups(mesh):
    """Lines and faces, each with the names of its groups."""
    faces = {label: without_point_sides(element, label) for label, element in mesh.elements.items() if element.dimension == 2}
    if not faces:
        refuse("", f"there are no triangles or quadrilaterals; {PLANE}")
    lines, curves = curves_of(mesh, faces)
    surfaces = defaultdict(set)
    for name, labels in members_of(mesh, mesh.element_sets):
        for label in faces.keys() & labels:
            surfaces[label].add(name)
    # Triangles in no physical surface would be left out.
    other = next(name for name in ("other", *(f"other-{i}" for i in range(2, len(mesh.element_sets) + 3)))
                 if name not in mesh.element_sets)
    for label in faces.keys() - surfaces.keys() if surfaces else ():
        surfaces[label].add(other)
    return [(lines[of], names) for of, names in curves.items()], [(nodes, surfaces[label]) for label, nodes in faces.items()]


def text(mesh):
    """The text in MSH 4.1: an entity for each combination of groups, and the notes as comments."""
    lines, faces = groups(mesh)
    names, entities, blocks, number = {}, {1: {}, 2: {}}, [], 0
    for dimension, items in {1: lines, 2: faces}.items():
        for number, (nodes, of) in enumerate(items, number + 1):
            tags = tuple(names.setdefault((dimension, name), len(names) + 1) for name in sorted(of))
            entity = entities[dimension].setdefault(tags, len(entities[dimension]) + 1)
            blocks.append(f"{dimension} {entity} {KINDS[dimension, len(nodes)]} 1\n{number} {' '.join(map(str, nodes))}")
    # A point of reference need not lie in the plane of the body.
    used = {label: mesh.nodes[label] for label in sorted({node for nodes, _ in (*lines, *faces) for node in nodes})}
    return "\n".join([
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat",
        *(f"$Comments\nnote {' '.join(note.replace('$', '').split())}\n$EndComments" for note in mesh.notes),
        "$PhysicalNames", str(len(names)),
        *(f'{dimension} {tag} "{name}"' for (dimension, name), tag in names.items()), "$EndPhysicalNames",
        "$Entities", f"0 {len(entities[1])} {len(entities[2])} 0",
        *(f"{entity} 0 0 0 0 0 0 {len(tags)} {' '.join(map(str, tags))} 0" for of in entities.values() for tags, entity in of.items()),
        "$EndEntities", "$Nodes", f"1 {len(used)} 1 {max(used)}", f"2 1 0 {len(used)}", *map(str, used),
        *(" ".join(map(repr, node.at)) for node in used.values()), "$EndNodes",
        "$Elements", f"{number} {number} 1 {number}", *blocks, "$EndElements", ""])
