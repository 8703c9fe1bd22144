"""Reads VTK, XDMF and MED with meshio. Materials and curves are the groups of a MED file, or the numbers of an array on the cells.

Of several arrays of whole numbers the key `mesh.materials` of the scene names the one. Our own frames have a node once for each
material; the array `global_node` joins them.
"""
import importlib
import re
from collections import Counter

from meshes.description import PLANE, refuse

DIMENSIONS = {"line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "quad": 2, "quad8": 2, "quad9": 2, "pixel": 2, "polygon": 2}
# Numbers that programs give to cells and that name no material, in small letters without other signs.
NO_MATERIALS = re.compile(
    r"(vtk)?(original|global|local|source|pedigree)?(cell|element|elem|face|node|point)?(ids?|index|indices|numbers?|side)"
    r"|vtkghost(type|levels)|vtkvalidpointmask|(vtk)?(process|partition|domain|block|composite|amr|rank)+(ids?|index|level)"
    r"|(mpi)?rank|partition|subdomain|owner|(gmsh|cell)?normals?")
GHOSTS = "vtkGhostType"


def read(path, mesh):
    read = importlib.import_module(f"meshio.{path.suffix.lower()[1:]}").read(path)
    check_ghosts(read)
    joined = joined_nodes(read.point_data.get("global_node"), read.points, mesh)
    for i, at in enumerate(read.points):
        mesh.add_node(joined[i], at)
    families = getattr(read, "cell_tags", None)
    name, tags = ("cell_tags", read.cell_data.get("cell_tags")) if families is not None else materials(read, mesh)
    used = Counter((DIMENSIONS.get(cells.type), int(tag)) for cells, of in zip(read.cells, tags or []) for tag in of)
    # The number 0 alone names nothing.
    is_named = {dimension: any(tag for of, tag in used if of == dimension) for dimension in (1, 2)}
    for block, cells in enumerate(read.cells):
        for i, nodes in enumerate(cells.data):
            if cells.type == "vertex":
                continue
            label, nodes = len(mesh.elements) + 1, [joined[node] for node in nodes]
            if cells.type not in DIMENSIONS or (cells.type == "polygon" and len(nodes) not in (3, 4)):
                refuse(f"cell {label}", f"cells of type {cells.type} with {len(nodes)} nodes are not read; {PLANE}")
            if cells.type == "pixel":
                nodes = [nodes[corner] for corner in (0, 1, 3, 2)]
            dimension = DIMENSIONS[cells.type]
            mesh.add_element(label, cells.type, dimension, nodes)
            tag = 0 if tags is None else int(tags[block][i])
            own = families.get(tag, []) if families is not None else [str(tag)] if tags and is_named[dimension] else []
            for of in own:
                mesh.element_sets[of].append(([label], ""))
    for node, tag in enumerate(read.point_data.get("point_tags", [])):
        for of in getattr(read, "point_tags", {}).get(int(tag), []):
            mesh.node_sets[of].append(([joined[node]], ""))
    if name and families is None and any(is_named.values()):
        mesh.notes.append(f'its materials are the numbers of the array "{name}" on the cells (mesh.materials names another one)')


def check_ghosts(read):
    ghosts = sum(int((part != 0).sum()) for part in read.cell_data.get(GHOSTS, []))
    if ghosts:
        refuse("", f"{ghosts} of its cells are ghosts ({GHOSTS}), which belong to other pieces or are hidden; write the whole mesh as "
                   "one piece without ghosts (ParaView: Merge Blocks, Clean to Grid, Threshold)")


def joined_nodes(numbers, points, mesh):
    """The label of each node: nodes with the same number in the whole body are one."""
    if numbers is None:
        return range(1, len(points) + 1)
    first, labels = {}, []
    for i, number in enumerate(map(int, numbers)):
        of = first.setdefault(number, i)
        if list(points[of]) != list(points[i]):
            refuse("", f"nodes {of} and {i} have the same global_node {number}, but stand apart; use scene.msh or mesh.msh of the run")
        labels.append(of + 1)
    mesh.notes.append("it is a frame of a run: nodes between materials are joined, and materials have numbers; the names are in "
                      "scene.msh or mesh.msh of the run")
    return labels


def is_whole(parts, kinds="iuf"):
    """Whether an array on the blocks of cells has one whole number a cell."""
    return all(part.size == len(part) and part.dtype.kind in kinds and (part == part.astype(int)).all() for part in parts)


def materials(read, mesh):
    """The name and the values of the array with the numbers of materials and curves."""
    arrays, chosen = read.cell_data, mesh.materials
    integer = [name for name, parts in arrays.items() if is_whole(parts, "iu")]
    numbers = lambda name: [part.astype(int).ravel() for part in arrays[name]]
    if chosen == "":
        return None, None
    if chosen is not None:
        if chosen not in arrays or not is_whole(arrays[chosen]):
            refuse("", f'mesh.materials = "{chosen}" is no array of whole numbers on the cells (known: {", ".join(integer) or "none"})')
        return chosen, numbers(chosen)
    found = [name for name in integer if not NO_MATERIALS.fullmatch(re.sub("[^a-z]", "", name.lower()))]
    if "gmsh:physical" in found:
        found = [name for name in found if name != "gmsh:geometrical"]
    if len(found) > 1:
        refuse("", f"several arrays on its cells may be the materials ({', '.join(found)}): write mesh.materials = \"{found[0]}\", or "
                   '"" for none')
    return (found[0], numbers(found[0])) if found else (None, None)
