"""Reads Nastran with pyNastran. A property is the set of its elements, with its number as name."""
import contextlib
import io
import re
import sys

from meshes.description import PLANE, refuse, text_of

# Elements by the number of corners.
FACES = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUADR": 4, "CQUAD8": 4, "CQUAD": 4}
LINES = {"CBAR", "CBEAM", "CROD", "CTUBE", "CONROD", "PLOTEL"}
# Cards that pyNastran reads for the places of nodes.
PLACES = {"GRID", "GRDSET", *(f"CORD{kind}{family}" for kind in "12" for family in "RCS")}
# Cards that make neither nodes nor elements with an extent: loads, supports, materials, properties, masses, springs, rigid
# connections, sets, tables, solution, optimisation, aerodynamics.
HARMLESS = re.compile(
    r"FORCE\w*|MOMENT\w*|PLOAD\w*|SLOAD|GRAV|ACCEL\w*|RFORCE\w*|LOAD\w*|LSEQ|DLOAD|DAREA|DELAY|DPHASE|TIC|[RT]LOAD\d|TEMP\w*"
    r"|QBDY\d|QVOL|QHBDY|CONV\w?|PCONV\w?|CHBDY\w|RAD\w+|VIEW\w*|SPC\w*|MPC\w*|SUPORT\w*|[ABCQUO](SET|SET1)|USET1?|DEFORM"
    r"|MAT\w+|CREEP|P(SHELL|COMP\w*|BAR\w*|BEAM\w*|BEND|ROD|TUBE|SHEAR|SOLID|LSOLID|LPLANE|PLANE|ELAS\w*|DAMP\w*|BUSH\w*|MASS|GAP"
    r"|VISC|WELD|FAST|ARAM|LOTEL)|NSM\w*|CONM\d|CMASS\d|CELAS\d|CDAMP\d|CBUSH\w*|CVISC|CGAP|CWELD|CFAST|BAROR|BEAMOR"
    r"|RBE\d|RBAR1?|RROD|RSPLINE|RTRPLT1?|SPOINT|EPOINT|SEQGP|SET\d|TABLE\w*|TAB\w+|EIG\w+|NLP\w+|TSTEP\w*|FREQ\d?|DTI|DM\w+|TF"
    r"|D(ESVAR|VPREL\d|VMREL\d|VCREL\d|VGRID|RESP\d|CON\w+|EQATN|LINK|OPTPRM|SCREEN|TABLE)|DOPTPRM|TOPVAR|MONPNT\d|ASSIGN"
    r"|AE\w+|CAERO\d|PAERO\d|SPLINE\d|FLUTTER|FLFACT|MKAERO\d|TRIM\d?|DIVERG|GUST|CSSCHD|BC\w+|BSURF\w*|BLSEG|BFRIC|BOUTPUT|GLUE"
    r"|MDLPRM|ECHO\w+|ENDDATA|INCLUDE")


def read(path, mesh):
    from pyNastran.bdf.bdf import BDF
    from pyNastran.bdf.cards.nodes import GRID

    class Grid(GRID):
        @classmethod
        def add_card(cls, card, comment=""):
            """A node; without a coordinate system of its own it has that of GRDSET, which pyNastran passes over."""
            node = GRID.add_card(card, comment)
            node.has_default_system = card.field(2) is None
            return node

    model = BDF(debug=None)
    model._card_parser["GRID"] = (Grid, model._card_parser["GRID"][1])
    text = text_of(path, "latin-1")
    try:
        with contextlib.redirect_stdout(sys.stderr):
            # Many programs write the bulk data alone, with or without its first line.
            is_whole = re.search(r"^\s*cend\b", text, re.I | re.M)
            bulk = re.split(r"^\s*begin\b.*\n", text, maxsplit=1, flags=re.I | re.M)
            source = path if is_whole or len(bulk) == 1 else io.StringIO(bulk[1])
            model.read_bdf(source, xref=False, validate=False, encoding="latin-1", punch=not is_whole)
            check_cards(model)
            for node in model.nodes.values():
                if model.grdset and node.has_default_system:
                    node.cp = model.grdset.cp
            model.cross_reference(xref_elements=False, xref_nodes_with_elements=False, xref_properties=False, xref_masses=False,
                                  xref_materials=False, xref_loads=False, xref_constraints=False, xref_aero=False, xref_sets=False,
                                  xref_optimization=False)
            places = {label: node.get_position() for label, node in model.nodes.items()}
    except Exception as error:
        sentence = " ".join(f"{error}".split()) or type(error).__name__
        refuse("", f"pyNastran does not read it: {sentence[:300]}")
    for label, at in places.items():
        mesh.add_node(label, at)
    for label, element in model.elements.items():
        if element.type not in FACES and element.type not in LINES:
            continue
        nodes = list(element.node_ids)
        if element.type in LINES:
            dimension, nodes = 1, nodes[:2]
        else:
            dimension, corners = 2, FACES[element.type]
            if all(node is None for node in nodes[corners:]):
                nodes = nodes[:corners]
            elif None in nodes[:2 * corners]:
                refuse(f"{element.type} {label}", "some of its sides have a middle and others have none; give all or none")
            nodes = [node for node in nodes if node is not None]
        mesh.add_element(label, element.type, dimension, nodes)
        # A plot element and a CONROD have no property.
        if (number := getattr(element, "pid", None)) is not None:
            mesh.element_sets[str(number)].append(([label], ""))


def check_cards(model):
    """Refuses cards that may make or move nodes or elements in a way that is not read here."""
    for name in model.card_count:
        if not (name in FACES or name in LINES or name in PLACES or HARMLESS.fullmatch(name)):
            refuse("", f"the card {name} is not read ({model.card_count[name]} in the file); {PLANE}")
