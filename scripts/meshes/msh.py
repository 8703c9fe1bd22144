"""Writes the description of a plane mesh as MSH 4.1.

Sets become physical groups. A set of faces is a surface, one of lines a curve. A set of sides is a curve; so is a set of nodes,
with the edges of the outer boundary that have both ends in the set.
"""
from collections import Counter, defaultdict

from meshes.description import PLANE, corners, refuse

# gmsh's element types, by dimension and number of nodes.
KINDS = {(1, 2): 1, (1, 3): 8, (2, 3): 2, (2, 6): 9, (2, 4): 3, (2, 8): 16, (2, 9): 10}


def groups(mesh):
    """Lines and faces, each with the names of its groups."""
    faces = {label: element.nodes for label, element in mesh.elements.items() if element.dimension == 2}
    if not faces:
        refuse("", f"there are no triangles or quadrilaterals; {PLANE}")
    key = lambda edge: tuple(sorted(edge[:2]))
    edges = {}
    for label, nodes in faces.items():
        n = corners(nodes)
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

    members = lambda sets: [(name, [member for part, _ in parts for member in part])
                            for name, parts in sets.items() if name not in mesh.hidden]
    for name, labels in members(mesh.element_sets):
        name_edges(name, [mesh.elements[label].nodes for label in labels if label not in faces])
        for label in faces.keys() & labels:
            surfaces[label].add(name)
    for name, sides in members(mesh.side_sets):
        for label, side in sides:
            name_edges(name, outer(edges[label]) if side is None else [edges[label][side]])
    taken = set().union(*curves.values())
    for name, labels in members(mesh.node_sets):
        ends = set(labels) if name not in taken else set()
        name_edges(name, [edge for sides in edges.values() for edge in outer(sides) if ends.issuperset(edge[:2])])
    for label in faces.keys() - surfaces.keys() if surfaces else ():
        # Triangles in no physical surface would be left out.
        surfaces[label].add("other")
    return [(lines[of], names) for of, names in curves.items()], [(nodes, surfaces[label]) for label, nodes in faces.items()]


def text(mesh):
    """The text in MSH 4.1: an entity for each combination of groups, and the notes as comments."""
    lines, faces = groups(mesh)
    names, entities, blocks, number = {}, {1: {}, 2: {}}, "", 0
    for dimension, items in {1: lines, 2: faces}.items():
        for number, (nodes, of) in enumerate(items, number + 1):
            tags = tuple(names.setdefault((dimension, name), len(names) + 1) for name in sorted(of))
            entity = entities[dimension].setdefault(tags, len(entities[dimension]) + 1)
            kind = KINDS[dimension, len(nodes)]
            blocks += f"{dimension} {entity} {kind} 1\n{number} {' '.join(map(str, nodes))}\n"
    size = len(mesh.nodes)
    return "\n".join([
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat",
        *(f"$Comments\nnote {' '.join(note.split())}\n$EndComments" for note in mesh.notes),
        "$PhysicalNames", str(len(names)),
        *(f'{dimension} {tag} "{name}"' for (dimension, name), tag in names.items()), "$EndPhysicalNames",
        "$Entities", f"0 {len(entities[1])} {len(entities[2])} 0",
        *(f"{entity} 0 0 0 0 0 0 {len(tags)} {' '.join(map(str, tags))} 0" for of in entities.values() for tags, entity in of.items()),
        "$EndEntities", "$Nodes", f"1 {size} 1 {max(mesh.nodes)}", f"2 1 0 {size}", *map(str, mesh.nodes),
        *(" ".join(map(repr, node.at)) for node in mesh.nodes.values()), "$EndNodes",
        "$Elements", f"{number} {number} 1 {number}", f"{blocks}$EndElements", ""])
