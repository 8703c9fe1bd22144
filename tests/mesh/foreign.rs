//! Meshes of other programs: their sets are the physical groups of the same mesh from gmsh.

use crate::common::{check_laws, close, curve_length, curved_area, length, triangle_areas};
use signorini::{
    mesh::{Mesh, Order, bounds, distance, load, load_choosing, sorted},
    scene::Scene,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
    fs,
    path::Path,
    process::Command,
};

/// A bracket of two parts with a hole in one of them: area 3 − 0.09 π.
const BRACKET: &str = r#"
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 2, 1}; Rectangle(2) = {0, 1, 0, 1, 1}; Disk(3) = {1.5, 0.5, 0, 0.3};
BooleanDifference{ Surface{1}; Delete; }{ Surface{3}; Delete; }
Coherence;
e = 1e-6;
Physical Surface("arm") = Surface In BoundingBox{-e, -e, -e, 2+e, 1+e, e};
Physical Surface("wall") = Surface In BoundingBox{-e, 1-e, -e, 1+e, 2+e, e};
Physical Curve("base") = Curve In BoundingBox{-e, -e, -e, 2+e, e, e};
Physical Curve("top") = Curve In BoundingBox{-e, 2-e, -e, 1+e, 2+e, e};
Physical Curve("hole") = Curve In BoundingBox{1.2-e, 0.2-e, -e, 1.8+e, 0.8+e, e};
Mesh.MeshSizeMax = 0.3;
"#;

/// The mesh that gmsh makes of the bracket, and the same mesh in the format of another program.
fn made(folder: &Path, order: Order, extension: &str) -> [Mesh; 2] {
    let geo = folder.join("bracket.geo");
    fs::write(&geo, BRACKET).unwrap();
    let other = geo.with_extension(extension);
    let quadratic = if order == Order::Quadratic { "2" } else { "1" };
    let mut gmsh = Command::new("gmsh");
    gmsh.args(["-2", "-nt", "1", "-v", "1", "-order", quadratic]).arg(&geo).arg("-o").arg(&other);
    assert!(gmsh.status().unwrap().success());
    [load(&geo, &BTreeMap::new(), order).unwrap(), load(&other, &BTreeMap::new(), order).unwrap()]
}

/// The mesh of an Abaqus file.
fn abaqus(text: &str) -> Result<Mesh, String> {
    read("part.inp", text)
}

fn read(name: &str, text: &str) -> Result<Mesh, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    load(&path, &BTreeMap::new(), Order::Linear).map_err(|error| error.to_string())
}

/// Per name: the length of its curve, the area of its surface.
fn measures(mesh: &Mesh) -> [BTreeMap<&str, f64>; 2] {
    let areas: Vec<f64> = triangle_areas(mesh).collect();
    let curves = mesh.curves.iter().map(|(name, curve)| (&**name, length(mesh, &curve.edges)));
    let of = |triangles: &[usize]| triangles.iter().map(|&t| areas[t]).sum();
    let surfaces = mesh.surfaces.iter().map(|(name, triangles)| (&**name, of(triangles)));
    [curves.collect(), surfaces.collect()]
}

#[track_caller]
fn same(made: &Mesh, converted: &Mesh, digits: f64) {
    for (a, b) in measures(made).iter().zip(measures(converted)) {
        for (name, value) in a {
            assert!((value - b[name]).abs() <= digits, "{name}: {value} is not {}", b[name]);
        }
    }
    assert!(converted.curves.values().all(|curve| curve.other_edges == 0));
    assert!((curved_area(made) - curved_area(converted)).abs() <= digits);
}

#[test]
fn groups_of_gmsh_survive_the_formats_with_names() {
    for order in [Order::Linear, Order::Quadratic] {
        for extension in ["unv", "inp"] {
            let folder = tempfile::tempdir().unwrap();
            let [geo, other] = made(folder.path(), order, extension);
            same(&geo, &other, 1e-9);
            assert_eq!(other.curved.is_empty(), order == Order::Linear, "{extension}");
        }
    }
}

/// A mesh in VTK of a quadrilateral, a triangle and a line, with these types of cells and arrays of whole numbers.
fn vtu(types: [u8; 3], arrays: &[(&str, &str)]) -> String {
    let array = |name: &str, kind: &str, components: usize, of: &str| {
        format!(
            "<DataArray Name='{name}' type='{kind}' NumberOfComponents='{components}' format='ascii'>{of}</DataArray>"
        )
    };
    let types = types.map(|t| t.to_string()).join(" ");
    let cells: String =
        arrays.iter().map(|(name, values)| array(name, "Int64", 1, values)).collect();
    format!(
        "<?xml version='1.0'?><VTKFile type='UnstructuredGrid' version='0.1' byte_order='LittleEndian'>\
         <UnstructuredGrid><Piece NumberOfPoints='5' NumberOfCells='3'><Points>{}</Points><Cells>{}{}{}</Cells>\
         <CellData>{cells}</CellData></Piece></UnstructuredGrid></VTKFile>",
        array("Points", "Float64", 3, "0 0 0  2 0 0  2 1 0  0 1 0  1 2 0"),
        array("connectivity", "Int64", 1, "0 1 2 3  3 2 4  0 1"),
        array("offsets", "Int64", 1, "4 7 9"),
        array("types", "UInt8", 1, &types),
    )
}

#[test]
fn the_array_of_the_materials_is_no_list_of_ids_and_is_said() {
    let flat = [9, 5, 3];
    let ids = [
        ("GlobalCellIds", "11 12 13"),
        ("vtkGhostType", "0 0 0"),
        ("vtkOriginalCellIds", "1 2 3"),
        ("GlobalElementId", "1 2 3"),
        ("cell_id", "4 5 6"),
        ("vtkProcessId", "0 1 0"),
    ];
    for others in [&ids[..0], &ids[..1], &ids[..]] {
        // The number 0 is a material as well.
        for (values, quadrilateral) in [("7 8 9", "7"), ("0 8 9", "0")] {
            let text = vtu(flat, &[others, &[("part", values)]].concat());
            let mesh = read("part.vtu", &text).unwrap();
            let [curves, surfaces] = measures(&mesh);
            let found = (curves["9"], surfaces[quadrilateral], surfaces["8"]);
            assert_eq!(found, (2.0, 2.0, 1.0), "{others:?}");
            assert!(mesh.notes.iter().any(|note| note.contains("the array \"part\"")), "{mesh:?}");
        }
        let none = read("part.vtu", &vtu(flat, &[others, &[("part", "0 0 0")]].concat())).unwrap();
        assert!(none.surfaces.is_empty() && none.curves.is_empty(), "{none:?}");
    }
    let several = vtu(flat, &[("part", "7 8 9"), ("other", "1 1 2")]);
    let message = read("part.vtu", &several).unwrap_err();
    assert!(message.contains("(part, other): write mesh.materials = \"part\""), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.vtu");
    fs::write(&path, several).unwrap();
    let choosing = |name| load_choosing(&path, &BTreeMap::new(), Some(name), Order::Linear);
    for _ in 0..2 {
        let names = |name| choosing(name).unwrap().surfaces.into_keys().collect::<Vec<_>>();
        assert_eq!(
            (names("part"), names("other"), names("").len()),
            (vec!["7".into(), "8".into()], vec!["1".into()], 0)
        );
    }
    let unknown = choosing("there").unwrap_err().to_string();
    assert!(
        unknown
            .contains("\"there\" is no array of whole numbers on the cells (known: part, other)")
    );

    let ghosts = read("part.vtu", &vtu(flat, &[("vtkGhostType", "0 1 0")])).unwrap_err();
    assert!(ghosts.contains("1 of its cells are ghosts (vtkGhostType)"), "{ghosts}");
    let solid = read("part.vtu", &vtu([10, 5, 3], &[("part", "7 8 9")])).unwrap_err();
    assert!(solid.contains("cells of type tetra with 4 nodes are not read"), "{solid}");
}

#[test]
#[ignore = "PYTHON must name a Python with pyNastran: make nastran"]
fn nodes_of_nastran_stand_where_their_coordinate_system_puts_them() {
    // The square (1, 0) … (0, 2) in polar coordinates: by CP, by GRDSET, and by a system that is turned and moved.
    let face = "CQUAD4,1,,1,2,3,4,45.\nCROD,2,7,1,2\n";
    let polar = |system: &str, cp: &str, default: &str| {
        let nodes = [("1.", "0."), ("2.D+0", "0."), ("2.", "90."), ("1+0", "90.")];
        let grids =
            (1..).zip(nodes).map(|(i, (r, angle))| format!("GRID,{i},{cp},{r},{angle},0.\n"));
        format!("{system}\n{default}{}{face}", grids.collect::<String>())
    };
    let c = "CORD2C,1,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.";
    let r = "cord2r\t1\t\t5.\t0.\t0.\t5.\t0.\t1.\n\t5.\t1.\t0.";
    let plain = polar("", "", "").replace("2.,90.", "0.,2.").replace("1+0,90.", "0.,1.");
    for (text, shift) in [
        (plain, 0.0),
        (polar(c, "1", ""), 0.0),
        (polar(c, "", "GRDSET,,1\n"), 0.0),
        (polar(&c.to_lowercase(), "1", ""), 0.0),
        (polar(r, "1", "").replace("2.,90.", "0.,2.").replace("1+0,90.", "0.,1."), 5.0),
    ] {
        let mesh = read("part.bdf", &text).unwrap();
        close(triangle_areas(&mesh).sum(), 1.5);
        close(curve_length(&mesh, "7"), 1.0);
        assert_eq!(mesh.surfaces.keys().collect::<Vec<_>>(), ["1"]);
        let least = mesh.nodes.iter().map(|at| at[0]).fold(f64::MAX, f64::min);
        close(least, if shift == 0.0 { 0.0 } else { 3.0 });
    }
    for (text, fragment) in [
        ("GRID,1,,0.,0.,0.\nGMCORD,1\n", "the card GMCORD is not read"),
        ("GRID,1,,0.,0.,0.\nCHEXA,1,1,1,2,3,4,5,6\n,7,8\n", "the card CHEXA is not read"),
        ("GRID,1,9,0.,0.,0.\n", "pyNastran does not read it"),
        ("GRID,1,,0.,0.,0.\nGRID,1,,1.,0.,0.\n", "pyNastran does not read it"),
        ("GRID,1,,x,0.,0.\n", "must be a float"),
        ("CTRIA3,1,1,1,2,9\n", "refers to node 1"),
    ] {
        let message = read("part.bdf", text).unwrap_err();
        assert!(message.contains(fragment) && message.lines().count() == 1, "{message}");
    }
}

/// The nodes and elements of an n×n square of quadrilaterals in Abaqus, of order 1 or 2. Its nodes are moved by `at`.
fn quadrilaterals(n: usize, order: usize, at: impl Fn([f64; 2]) -> [f64; 2]) -> String {
    let points = order * n + 1;
    let mut text = "** a square,\n*Heading\n*Node\n".to_owned();
    let label = |i: usize, j: usize| 10 + i + 100 * j;
    for (i, j) in (0..points).flat_map(|j| (0..points).map(move |i| (i, j))) {
        let [x, y] = at([i, j].map(|k| k as f64 / (points - 1) as f64));
        writeln!(text, "{}, {x}, {y}, 0.", label(i, j)).unwrap();
    }
    writeln!(text, "*Element, type=CPE{}R, elset=Body", 4 * order).unwrap();
    let mut element = 0;
    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (order * i, order * j))) {
        element += 1;
        let o = order;
        let mut nodes = vec![[i, j], [i + o, j], [i + o, j + o], [i, j + o]];
        if o == 2 {
            nodes.extend([[i + 1, j], [i + 2, j + 1], [i + 1, j + 2], [i, j + 1]]);
        }
        let nodes: Vec<_> = nodes.into_iter().map(|[i, j]| label(i, j).to_string()).collect();
        // Lines may go on after a comma.
        writeln!(text, "{element}, {},\n {}", nodes[..3].join(", "), nodes[3..].join(", "))
            .unwrap();
    }
    let last = points - 1;
    write!(
        text,
        "*Nset, nset=BOTTOM, generate\n {}, {}, 1\n*Elset, elset=Right, generate\n {n}, {}, {n}\n\
         *Surface, type=ELEMENT, name=right\nRIGHT, S2\n*Surface, type=ELEMENT, name=top\n",
        label(0, 0),
        label(last, 0),
        n * n
    )
    .unwrap();
    (n * (n - 1) + 1..=n * n).for_each(|e| writeln!(text, "{e}, S3").unwrap());
    write!(text, "*Step\n*Static\n*Node output, nset=bottom\nU\n*End step\n").unwrap();
    text
}

#[test]
fn quadrilaterals_are_cut_along_their_shorter_diagonals() {
    for (n, order) in [(1, 1), (4, 1), (1, 2), (3, 2)] {
        for shear in [-0.4, 0.0, 0.7] {
            let mesh = abaqus(&quadrilaterals(n, order, |[x, y]| [x + shear * y, y])).unwrap();
            let side = 1.0_f64.hypot(shear);
            check_laws(&mesh, 1.0, 2.0 + 2.0 * side, 0);
            assert_eq!(mesh.triangles.len(), 2 * n * n);
            for (name, value) in [("BOTTOM", 1.0), ("right", side), ("top", 1.0)] {
                close(curve_length(&mesh, name), value);
            }
            assert_eq!(mesh.surfaces["Body"].len(), 2 * n * n);
            assert_eq!(mesh.surfaces["Right"].len(), 2 * n);
            // Each inner edge that is parallel to no side is the shorter diagonal.
            let shorter = 1.0_f64.hypot(1.0 - shear.abs()) / n as f64;
            let sides = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let edges: BTreeSet<[usize; 2]> = sides.map(sorted).collect();
            let lengths = edges.iter().map(|&[a, b]| distance(mesh.nodes[a], mesh.nodes[b]));
            let diagonals = lengths.filter(|length| (length - shorter).abs() < 1e-12).count();
            assert!(diagonals >= n * n, "{shear}: {diagonals} of {n}×{n} are short");
        }
    }
    // A dart: its shorter diagonal lies outside.
    let dart = "*NODE\n1, 0, 0\n2, 2, -1\n3, 0.5, 0\n4, 2, 1\n*ELEMENT, TYPE=S4\n1, 1, 2, 3, 4\n";
    let mesh = abaqus(dart).unwrap();
    close(triangle_areas(&mesh).sum(), 0.5);
}

#[test]
fn curved_sides_of_quadratic_elements_are_kept() {
    // The square is bent into a quarter of a ring with radii 1 and 2.
    let ring = |[x, y]: [f64; 2]| {
        let (sin, cos) = (y * std::f64::consts::FRAC_PI_2).sin_cos();
        [(1.0 + x) * cos, (1.0 + x) * sin]
    };
    let area = 0.75 * std::f64::consts::PI;
    let error = |order| {
        let mesh = abaqus(&quadrilaterals(8, order, ring)).unwrap();
        (curved_area(&mesh) - area).abs()
    };
    assert!(error(1) > 1e-2 && error(2) < 1e-4, "{} {}", error(1), error(2));
}

#[test]
fn sets_are_found_whatever_their_spelling() {
    let base = quadrilaterals(2, 1, |at| at);
    let within = |more: &str| abaqus(&format!("{base}{more}")).unwrap();
    let length = |mesh: &Mesh, name: &str| curve_length(mesh, name);
    // Sets of sets, of an instance, nodes of a surface, whole elements of a surface, and line elements.
    let mesh = within("*NSET,NSET=\"both sides\", unsorted\nbottom, 210, 211, 212\n");
    close(length(&mesh, "both sides"), 2.0);
    close(length(&within("*SURFACE, NAME=f, TYPE=NODE\nbottom,\n"), "f"), 1.0);
    close(length(&within("*Surface,\n type=element, name=all\nbody,\n"), "all"), 4.0);
    close(length(&within("*Element, type=T2D2, elset=bar\n99, 10, 11\n"), "bar"), 0.5);
    // Parts that the program made itself are no names.
    let hidden =
        within("*Elset, elset=_right_S2, internal\n 2, 4\n*Surface, name=r2\n_right_S2, S2\n");
    close(length(&hidden, "r2"), 1.0);
    assert!(!hidden.surfaces.contains_key("_right_S2"), "{:?}", hidden.surfaces.keys());
    // All elements belong to the body, in whatever set.
    let part = base.replace(", elset=Body", "");
    close(triangle_areas(&abaqus(&part).unwrap()).sum(), 1.0);
}

#[test]
fn malformed_files_are_refused_with_their_place() {
    let base = quadrilaterals(1, 1, |at| at);
    let plane = "the mesh must be plane";
    let cases: [(&str, &str, &[&str]); 14] = [
        ("a.inp", "", &["a.inp: there are no triangles or quadrilaterals", plane]),
        ("a.inp", "*NODE\n1, zero, 0\n", &["a.inp:2: `1, zero, 0` is wrong in *NODE"]),
        ("a.inp", "*ELEMENT\n1, 2, 3\n", &["a.inp:1: *ELEMENT needs the option TYPE"]),
        ("a.inp", "*ELEMENT, TYPE=C3D8\n1, 2, 3\n", &[":2: elements of type C3D8", plane]),
        (
            "a.inp",
            "*ELEMENT, TYPE=CAX4\n1, 2, 3\n",
            &[":2: elements of type CAX4 are axisymmetric"],
        ),
        ("a.inp", "*ELEMENT, TYPE=CPS3\n1, 2, 3, 4\n", &["element 1 refers to node 2"]),
        (
            "a.inp",
            "*ELEMENT, TYPE=CPS5\n1, 2, 3, 4, 5, 6\n",
            &["element 1 (CPS5) has 5 nodes", plane],
        ),
        ("a.inp", "*NSET, NSET=a\nb\n", &["a.inp:2: there is no set b of nodes above in the file"]),
        ("a.inp", "*INCLUDE, INPUT=lost.inp\n", &[":1: the file lost.inp does not exist"]),
        ("a.inp", "*PART, NAME=a\n*PART, NAME=b\n", &[":2: part a has no end above"]),
        ("a.inp", "\u{1}\u{0}", &["it is a binary file; export the mesh as text"]),
        ("a.unv", "    -1\n  2411\nx\n", &["a.unv:3: `x` is wrong in dataset 2411"]),
        ("a.vtu", "<VTKFile", &["a.vtu: it cannot be read as .vtu (ReadError", "export it as"]),
        ("a.vtk", "hello\n", &["a.vtk: it cannot be read as .vtk (ReadError: Illegal VTK header)"]),
    ];
    for (name, text, fragments) in cases {
        let message = read(name, text).unwrap_err();
        for fragment in fragments {
            assert!(message.contains(fragment), "`{fragment}` is not in `{message}` for {text}");
        }
        assert_eq!(message.lines().count(), 1, "{message}");
    }
    let tilted = abaqus(&base.replace("0.\n", "1.\n").replacen("1.\n", "2.\n", 1)).unwrap_err();
    assert!(tilted.contains("the body must lie in a plane of constant z"), "{tilted}");
}

/// A copy of the fixtures in a folder of its own, as meshes are kept beside them.
fn fixtures() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for name in FIXTURES {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/meshes").join(name);
        fs::copy(from, folder.path().join(name)).unwrap();
    }
    folder
}

const FIXTURES: [&str; 7] = [
    "cae.inp",
    "independent.inp",
    "calculix.inp",
    "shells.inp",
    "collapsed.inp",
    "salome.unv",
    "parts/nodes.inc",
];

/// Curves of a mesh, and the boxes around them.
type Boxes<'a> = &'a [(&'a str, [f64; 4])];

/// The box around a curve: x from, y from, x to, y to.
fn box_of(mesh: &Mesh, name: &str) -> [f64; 4] {
    let curve = mesh.curves.get(name).unwrap_or_else(|| panic!("{name}: {:?}", mesh.curves.keys()));
    let points: Vec<_> = curve.edges.as_flattened().iter().map(|&node| mesh.nodes[node]).collect();
    let [[x, v], [y, w]] = bounds(&points);
    [x, y, v, w]
}

#[test]
fn decks_of_every_kind_have_their_sets_in_place() {
    let folder = fixtures();
    let load = |name: &str, order| load(&folder.path().join(name), &BTreeMap::new(), order);
    let ring = 0.75 * std::f64::consts::PI;
    // A file, its area with curved sides and the error of this, and the boxes of its curves.
    let cases: [(&str, f64, f64, Boxes); 6] = [
        // The instance is moved by (0, 1) and turned by 90° about (0, 1).
        (
            "cae.inp",
            2.0,
            1e-12,
            &[
                ("Plate-1.Set-1", [0.0, 1.0, 0.0, 3.0]),
                ("Set-1", [-1.0, 3.0, 0.0, 3.0]),
                ("Left", [-1.0, 1.0, 0.0, 1.0]),
                ("Top", [-1.0, 1.0, -1.0, 3.0]),
                ("Both", [-1.0, 1.0, 0.0, 3.0]),
            ],
        ),
        (
            "independent.inp",
            2.0,
            1e-12,
            &[("the base", [10.0, 20.0, 12.0, 20.0]), ("side", [12.0, 20.0, 12.0, 21.0])],
        ),
        (
            "calculix.inp",
            ring,
            1e-2,
            &[
                ("BASE", [1.0, 0.0, 2.0, 0.0]),
                ("INNER", [0.0, 0.0, 1.0, 1.0]),
                ("OUTER", [0.0, 0.0, 2.0, 2.0]),
            ],
        ),
        (
            "shells.inp",
            3.0,
            1e-12,
            &[
                ("CALCULIX_BASE", [0.0, 0.0, 4.0, 0.0]),
                ("ABAQUS_BASE", [0.0, 0.0, 4.0, 0.0]),
                ("CALCULIX_LEFT", [0.0, 0.0, 0.0, 1.0]),
                ("ABAQUS_SLOPE", [2.0, 0.0, 4.0, 1.0]),
            ],
        ),
        (
            "collapsed.inp",
            2.0,
            1e-12,
            &[("RIGHT", [2.0, 0.0, 2.0, 1.0]), ("TOP", [0.0, 1.0, 2.0, 1.0])],
        ),
        (
            "salome.unv",
            2.0,
            1e-12,
            &[
                ("Base", [0.0, 0.0, 2.0, 0.0]),
                ("Corner", [0.0, 0.0, 2.0, 1.0]),
                ("Left", [0.0, 0.0, 0.0, 1.0]),
            ],
        ),
    ];
    for (file, area, error, curves) in cases {
        let mesh = load(file, Order::Quadratic).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!((curved_area(&mesh) - area).abs() <= error, "{file}: {}", curved_area(&mesh));
        for (name, expected) in curves {
            let found = box_of(&mesh, name);
            let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(near, "{file}: {name} lies in {found:?}, not in {expected:?}");
            assert_eq!(mesh.curves[*name].other_edges, 0, "{file}: {name}");
        }
    }
    // The notes are kept with the mesh: the second reading repeats them.
    for _ in 0..2 {
        let notes = load("cae.inp", Order::Linear).unwrap().notes.join("\n");
        for part in [
            "part Die has no triangles or quadrilaterals and is left out",
            "the name Set-1 is that of a set of the assembly; the set of part Plate is Plate-1.Set-1",
            "*RIGIDBODY (cae.inp, line 48), *TIE (cae.inp, line 75) are left out",
            "*BOUNDARY (cae.inp, line 91), *CONTACTPAIR (cae.inp, line 93), *DSLOAD (cae.inp, line 99) are not read: write",
            "no edge of the boundary is in the sets RP (0 nodes of the body)",
        ] {
            assert!(notes.contains(part), "`{part}` is not in {notes}");
        }
    }
}

#[test]
fn a_boundary_without_edges_says_what_its_set_has() {
    let deck = "*NODE\n1\n2, 1.\n3, 1., 1.\n4, 0., 1.\n*ELEMENT, TYPE=CPS4\n1,1,2,3,4\n*NSET, NSET=BASE\n1, 2\n\
                *NSET, NSET=PIN\n1\n*NSET, NSET=ENDS\n1, 3\n";
    let mesh = abaqus(deck).unwrap();
    for (name, words) in [
        ("PIN", "is a set of 1 node of the body, and a boundary is made of edges (known: BASE)"),
        ("ENDS", "is a set of 2 nodes of the body, and a boundary is made of edges"),
        ("TOP", "is no physical curve of the mesh (known: BASE)"),
    ] {
        let text = format!(
            "mesh.file = \"part.inp\"\nmaterial = {{ young = 1, poisson = 0, plane = \"stress\" }}\n\
             [[boundary]]\nname = \"BASE\"\ndisplacement = [0, 0]\n\
             [[boundary]]\nname = \"{name}\"\ntraction = [0, 1]\n"
        );
        let scene = Scene::parse(&text, Path::new("part.toml"), &[]).unwrap();
        let message = scene.check_mesh(&mesh).unwrap_err().to_string();
        assert!(message.contains(words), "`{words}` is not in {message}");
    }
}

#[test]
fn what_is_not_known_is_refused_by_name_and_line() {
    let cases = include_str!("refused_meshes.txt").lines().filter(|line| !line.starts_with('#'));
    for case in cases {
        let (file, rest) = case.split_once(": ").unwrap();
        let [old, new, fragments] = rest.split(" => ").collect::<Vec<_>>()[..] else {
            panic!("{case}")
        };
        let folder = fixtures();
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        let [old, new] = [old, new].map(|words| words.replace("\\n", "\n"));
        assert!(text.contains(&old), "`{old}` is not in {file}");
        fs::write(&path, text.replacen(&old, &new, 1)).unwrap();
        // The part of a deck is read through it.
        let deck = if file.starts_with("parts/") { "calculix.inp" } else { file };
        let read = load(&folder.path().join(deck), &BTreeMap::new(), Order::Linear);
        let message = read.err().unwrap_or_else(|| panic!("{case} is accepted")).to_string();
        for fragment in fragments.split(" & ") {
            assert!(message.contains(fragment), "`{fragment}` is not in `{message}` for {case}");
        }
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn a_bent_quadrilateral_is_cut_where_it_is() {
    // The element is bent so far that the middle of its straight diagonal lies outside.
    let bent = "*NODE\n1\n2, 4.\n3, 4., 1.\n4, 0., 1.\n5, 2., 1.5\n6, 4., 0.5\n7, 2., 2.5\n8, 0., 0.5\n\
                *ELEMENT, TYPE=CPE8\n1, 1, 2, 3, 4, 5, 6, 7, 8\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bent.inp");
    fs::write(&path, bent).unwrap();
    let mesh = load(&path, &BTreeMap::new(), Order::Quadratic).unwrap();
    close(curved_area(&mesh), 4.0);
    let inner: Vec<_> = mesh.curved.values().filter(|at| at[0] == 2.0).map(|at| at[1]).collect();
    assert!(inner.contains(&2.0), "{inner:?}");
}

#[test]
fn axisymmetric_types_of_meshio_are_plane() {
    let deck = "*HEADING\nAbaqus DataFile Version 6.14\nwritten by meshio v5.0.0\n*NODE\n1\n2, 1.\n3, 1., 1.\n4, 0., 1.\n\
                *ELEMENT, TYPE=CAX4P\n1,1,2,3,4\n*ELEMENT, TYPE=B31H\n2,1,2\n*ELSET, ELSET=base\n2,\n";
    let mesh = abaqus(deck).unwrap();
    close(curve_length(&mesh, "base"), 1.0);
    close(triangle_areas(&mesh).sum(), 1.0);
}

#[test]
fn a_name_of_sets_of_two_kinds_is_one_of_them() {
    let base = quadrilaterals(2, 1, |at| at);
    let mesh = abaqus(&format!("{base}*NSET, NSET=top\n10, 11, 12\n")).unwrap();
    close(curve_length(&mesh, "top"), 1.0);
    assert_eq!(box_of(&mesh, "top"), [0.0, 1.0, 1.0, 1.0]);
    assert!(mesh.notes.iter().any(|note| note.contains("that of nodes is not read")));
    // A range with gaps is as long as the nodes in it.
    let mesh = abaqus(&format!("{base}*NSET, NSET=all, GENERATE\n1, 1000000000, 1\n")).unwrap();
    close(curve_length(&mesh, "all"), 4.0);
    assert!(mesh.notes.iter().any(|note| note.contains("9 of the 1000000000 nodes")));
}

#[test]
fn a_conversion_is_kept_beside_the_file_until_this_changes() {
    let folder = tempfile::tempdir().unwrap();
    let [inp, kept] = ["part.inp", "part.inp.msh"].map(|name| folder.path().join(name));
    let convert = |n: usize| {
        fs::write(&inp, quadrilaterals(n, 1, |at| at)).unwrap();
        load(&inp, &BTreeMap::new(), Order::Quadratic).unwrap().triangles.len()
    };
    assert_eq!(convert(2), 8);
    let first = fs::metadata(&kept).unwrap().modified().unwrap();
    assert_eq!(convert(2), 8);
    assert_eq!(fs::metadata(&kept).unwrap().modified().unwrap(), first);
    assert_eq!(convert(3), 18);
    // Also where a file that it reads is changed.
    let nodes =
        quadrilaterals(1, 1, |at| at).replace("*Node\n", "*node,\n input = nodes.txt\n*Heading\n");
    for side in [1.0, 2.0] {
        let points = ["10, 0, 0", "11, SIDE, 0", "110, 0, SIDE", "111, SIDE, SIDE"].join("\n");
        fs::write(inp.with_file_name("nodes.txt"), points.replace("SIDE", &side.to_string()))
            .unwrap();
        fs::write(&inp, &nodes).unwrap();
        let mesh = load(&inp, &BTreeMap::new(), Order::Linear).unwrap();
        close(triangle_areas(&mesh).sum(), side * side);
    }
    // A file of the user stays.
    fs::write(&kept, "mine").unwrap();
    assert_eq!((convert(1), &*fs::read_to_string(&kept).unwrap()), (2, "mine"));
}
