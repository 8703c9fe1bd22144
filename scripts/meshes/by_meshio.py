"""Reads what meshio reads. Materials and curves have the numbers of the first array of whole numbers, or the names of groups."""
import contextlib
import io
import sys

DIMENSIONS = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "quad": 2, "quad8": 2, "quad9": 2}


def read(path, mesh):
    import meshio
    with contextlib.redirect_stdout(sys.stderr):
        if path.suffix.lower() in (".bdf", ".nas"):
            # meshio wants a whole deck; that of a mesh alone may lack its frame.
            text = path.read_text(errors="replace")
            deck = ("" if "BEGIN BULK" in text else "BEGIN BULK\n") + text + "\nENDDATA\n"
            read = meshio.nastran._nastran.read_buffer(io.StringIO(deck))
        else:
            read = meshio.read(path)
    for i, at in enumerate(read.points, 1):
        mesh.add_node(i, at)
    # The first array of whole numbers has the tags; of the two of gmsh this one has the names.
    whole = [name for name, parts in read.cell_data.items() if all(part.dtype.kind in "iu" for part in parts)]
    tags = read.cell_data[min(whole, key=lambda name: name != "gmsh:physical")] if whole else None
    names = {(int(dimension), int(tag)): name for name, (tag, dimension) in read.field_data.items()}
    families = getattr(read, "cell_tags", None)
    for block, cells in enumerate(read.cells):
        dimension = DIMENSIONS.get(cells.type, 3)
        for i, nodes in enumerate(cells.data if dimension else []):
            label, tag = len(mesh.elements) + 1, 0 if tags is None else int(tags[block][i])
            mesh.add_element(label, cells.type, dimension, [int(node) + 1 for node in nodes])
            own = [names.get((dimension, tag), str(tag))] if tag else []
            for name in own if families is None else families.get(tag, []):
                mesh.element_sets[name].append(([label], ""))
    for node, tag in enumerate(read.point_data.get("point_tags", []), 1):
        for name in getattr(read, "point_tags", {}).get(int(tag), []):
            mesh.node_sets[name].append(([node], ""))
