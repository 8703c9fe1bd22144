"""Reads I-DEAS universal files (.unv), in which meshio loses the groups."""
import re


def read(path, mesh):
    for kind, text in re.findall(r"^ *-1\s*\n\s*(\d+)\s*\n(.*?)^ *-1\s*$", path.read_text(errors="replace"), re.S | re.M):
        lines = text.splitlines()
        while kind == "2411" and lines:
            label, at, *lines = lines
            mesh.add_node(int(label.split()[0]), [float(x.replace("D", "E")) for x in at.split()])
        while kind == "2412" and lines:
            label, of, *_, size = map(int, lines[0].split())
            is_beam, rows = of in (11, 21, 22, 23, 24), 1 + (size - 1) // 8
            nodes = [int(word) for word in " ".join(lines[1 + is_beam:1 + is_beam + rows]).split()]
            lines = lines[1 + is_beam + rows:]
            # Middles stand between the corners of the elements of second order.
            nodes = nodes[::2] + nodes[1::2] if size in (6, 8) or (size == 3 and is_beam) else nodes
            if size > 1:
                mesh.add_element(label, str(of), 1 if is_beam else 2 if of < 100 else 3, nodes)
        while kind in ("2435", "2452", "2467", "2477") and lines:
            rows = 2 + (int(lines[0].split()[7]) + 1) // 2
            words = [int(word) for word in " ".join(lines[2:rows]).split()]
            for of, label in zip(words[::4], words[1::4]):
                if sets := {7: mesh.node_sets, 8: mesh.element_sets}.get(of):
                    sets[lines[1].strip()].append(([label], ""))
            lines = lines[rows:]
