"""Reads input files of Abaqus and CalculiX (.inp), in which meshio loses the surfaces."""
import re
import sys
from collections import Counter

from meshes.description import PLANE


def lines_of(path):
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
            yield from lines_of(path.with_name(name[1]))


def read(path, mesh):
    keyword, options, words, spelled, shift, hidden, count = "", {}, [], {}, (0, 0, 0), {""}, Counter()

    def own(sets, option):
        """The set with the name of this option, whose case does not matter."""
        name = options.get(option, "")
        return sets[spelled.setdefault((id(sets), name.upper()), name)]

    def members(sets, word):
        name = word.rsplit(".", 1)[-1].upper()
        if not word.isdigit() and (id(sets), name) not in spelled:
            sys.exit(f"{place}: there is no set {word} above")
        return [int(word)] if word.isdigit() else [label for part, _ in sets[spelled[id(sets), name]] for label in part]

    for place, line in lines_of(path):
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
                mesh.add_node(int(words[0]), [float(x or 0) for x in [*words[1:4], 0, 0][:3]], place)
                own(mesh.node_sets, "NSET").append(([int(words[0])], place))
            elif keyword == "*ELEMENT" and not re.match("MASS|ROTARYI|SPRING|DASHPOT", options["TYPE"].upper()):
                kind = options["TYPE"].upper()
                face = re.match(r"(?:CPEG?|CPS|M3D|D?S|R3D|DC2D|AC2D|STRI)(\d)", kind)
                beam = re.match(r"(?:T[23]D|R2D)(\d)|B[23](\d)", kind)
                if not (face or beam):
                    sys.exit(f"{place}: elements of type {kind} are not read; {PLANE}")
                if len(words) <= int(face[1] if face else beam[1] or 1 + int(beam[2])) and line.endswith(","):
                    continue
                mesh.add_element(int(words[0]), kind, 2 if face else 1, [int(word) for word in words[1:]], place)
                own(mesh.element_sets, "ELSET").append(([int(words[0])], place))
            elif keyword in ("*NSET", "*ELSET"):
                sets = mesh.node_sets if keyword == "*NSET" else mesh.element_sets
                if "GENERATE" in options:
                    first, last, *step = map(int, words)
                    words = map(str, range(first, last + 1, *step))
                own(sets, keyword[1:]).append(([label for word in words for label in members(sets, word)], place))
            elif keyword == "*SURFACE" and options.get("TYPE", "").upper() == "NODE":
                own(mesh.node_sets, "NAME").append((members(mesh.node_sets, words[0]), place))
            elif keyword == "*SURFACE":
                side = int("".join(words[1:]).upper().replace("S", "") or 0)
                labels = members(mesh.element_sets, words[0])
                own(mesh.side_sets, "NAME").append(([(label, side - 1 if side else None) for label in labels], place))
            elif keyword == "*INSTANCE":
                if any(shift):
                    sys.exit(f"{place}: the instance is rotated; write the mesh in its place")
                shift = [float(x) for x in words]
            words = []
        except (ValueError, IndexError, KeyError) as error:
            sys.exit(f"{place}: `{line}` is wrong in {keyword or 'a file of Abaqus'} ({type(error).__name__} {error})")
    for node in mesh.nodes.values():
        node.at = [a + b for a, b in zip(node.at, shift)]
    mesh.hidden = hidden
