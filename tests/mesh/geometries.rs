//! The geometries of the examples, as gmsh meshes them, and the running of gmsh itself.

use std::{
    collections::{BTreeMap, HashSet},
    f64::consts::PI,
    fs,
    path::{Path, PathBuf},
    thread,
};

use crate::boundary_nodes;
use crate::common::{check_laws, close, curve_length, edges, parameters, smallest_angle};
use signorini::{
    mesh::{Mesh, MeshError, Order, extent, load},
    scene::{MeshSource, Scene},
};
use tempfile::TempDir;

/// A copy of one of the geometries in a folder of its own: meshes appear beside them.
fn copy(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let geo = folder.path().join(name).with_extension("geo");
    let original = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo").join(name);
    fs::copy(original.with_extension("geo"), &geo).unwrap();
    (folder, geo)
}

fn mesh<const N: usize>(name: &str, pairs: [(&str, f64); N]) -> Mesh {
    let (_folder, geo) = copy(name);
    load(&geo, &parameters(pairs), Order::Linear).unwrap()
}

fn node_count(mesh: &Mesh, curve: &str) -> usize {
    boundary_nodes(mesh, &mesh.curves[curve].edges).len()
}

/// Length of the longest edge at the node nearest to a point.
fn edge_at(mesh: &Mesh, [x, y]: [f64; 2]) -> f64 {
    let distance = |i: &usize| (mesh.nodes[*i][0] - x).hypot(mesh.nodes[*i][1] - y);
    let node = (0..mesh.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
    let edges = edges(mesh).into_keys().filter(|edge| edge.contains(&node));
    edges.map(|edge| mesh.edge_normal(edge).1).fold(0.0, f64::max)
}

#[test]
fn square() {
    for (pairs, nodes, n) in [
        ([("size", 0.125), ("grading", 1.0), ("diagonal", 0.0)], 81, 8),
        ([("n", 5.0), ("grading", 1.0), ("diagonal", 1.0)], 36, 5),
        ([("n", 7.0), ("grading", 6.0), ("diagonal", 2.0)], 64, 7),
        ([("n", 1.0), ("grading", 2.0), ("diagonal", 0.0)], 4, 1),
    ] {
        let mesh = mesh("square", pairs);
        check_laws(&mesh, 1.0, 4.0, 0);
        assert_eq!((mesh.nodes.len(), mesh.triangles.len()), (nodes, 2 * n * n));
        for name in ["left", "right", "top", "bottom"] {
            close(curve_length(&mesh, name), 1.0);
            assert_eq!(mesh.curves[name].edges.len(), n);
        }
        let grading = pairs[1].1;
        let widths = mesh.curves["bottom"].edges.iter().map(|&edge| mesh.edge_normal(edge).1);
        let (low, high) = widths.fold((1.0, 0.0), |(l, h), w| (w.min(l), w.max(h)));
        if n > 1 {
            close(high / low, grading);
        }
    }
}

#[test]
fn diagonals_of_the_square() {
    let slopes = |diagonal| {
        let mesh = mesh("square", [("n", 4.0), ("diagonal", diagonal)]);
        let slope = |[a, b]: [usize; 2]| {
            let (a, b) = (mesh.nodes[a], mesh.nodes[b]);
            ((b[0] - a[0]) * (b[1] - a[1]) * 16.0).round()
        };
        edges(&mesh).into_keys().map(slope).sum::<f64>()
    };
    assert_eq!([slopes(0.0), slopes(1.0), slopes(2.0)], [16.0, -16.0, 0.0]);
}

/// A body of this size, area and perimeter, with curves of these lengths, whose edges are shorter by the grading at these
/// points.
fn check_graded(
    name: &str,
    size: f64,
    [area, perimeter]: [f64; 2],
    lengths: [(&str, f64); 3],
    points: &[[f64; 2]],
) -> Mesh {
    let uniform = mesh(name, [("size", size), ("grading", 1.0)]);
    let foundation = curve_length(&uniform, "foundation");
    assert_eq!(node_count(&uniform, "foundation") as f64, 1.0 + foundation / size);
    let graded = mesh(name, [("size", size), ("grading", 8.0)]);
    for mesh in [&uniform, &graded] {
        check_laws(mesh, area, perimeter, 0);
        lengths.iter().for_each(|(curve, length)| close(curve_length(mesh, curve), *length));
        assert!(smallest_angle(mesh) > 25.0);
    }
    for point in points {
        let edge = edge_at(&graded, *point) * 8.0 / size;
        assert!((0.6..1.6).contains(&edge), "{edge} at {point:?}");
    }
    graded
}

#[test]
fn lshape_and_beam() {
    let lengths = [("clamp", 2.0), ("foundation", 2.0), ("load", 8.0)];
    let points = [[2.0, 4.0], [6.0, 4.0], [8.0, 4.0], [0.0, 0.0], [2.0, 0.0]];
    let graded = check_graded("lshape", 0.25, [24.0, 28.0], lengths, &points);
    assert!(edge_at(&graded, [8.0, 6.0]) > 0.2);
    let lengths = [("clamp", 1.0), ("foundation", 8.0), ("load", 8.0)];
    let points = [[0.0, 0.0], [8.0, 0.0], [8.0, 0.5], [0.0, 0.5]];
    check_graded("beam", 0.125, [4.0, 17.0], lengths, &points);
}

/// Nodes by their coordinates, rounded to 10⁻⁹ m, and triangles as sorted triples of these.
fn canonical(mesh: &Mesh, place: impl Fn([f64; 2]) -> [f64; 2]) -> HashSet<[[i64; 2]; 3]> {
    let round = |i: usize| place(mesh.nodes[i]).map(|x| (x * 1e9).round() as i64);
    let triangle = |t: &[usize; 3]| {
        let mut corners = t.map(round);
        corners.sort_unstable();
        corners
    };
    mesh.triangles.iter().map(triangle).collect()
}

#[test]
fn bridge_is_two_mirrored_halves() {
    for (size, grading) in [(0.25, 1.0), (0.25, 5.0), (0.13, 2.0)] {
        let pairs = [("size", size), ("grading", grading)];
        let (half, full) = (mesh("bridge-half", pairs), mesh("bridge", pairs));
        check_laws(&half, 20.0, 24.0, 0);
        check_laws(&full, 40.0, 44.0, 0);
        for name in ["foundation", "load", "axis"] {
            close(curve_length(&half, name), 2.0);
        }
        for name in ["foundation", "load"] {
            close(curve_length(&full, name), 4.0);
        }
        assert!(smallest_angle(&half) > 25.0);

        let axis = node_count(&half, "axis");
        assert_eq!(full.nodes.len(), 2 * half.nodes.len() - axis);
        assert_eq!(full.triangles.len(), 2 * half.triangles.len());
        for node in &full.nodes {
            let image = [12.0 - node[0], node[1]];
            let same = |p: &[f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-12;
            assert!(full.nodes.iter().any(|p| same(p, image)), "no image of {node:?}");
            let left = [node[0].min(image[0]), node[1]];
            assert!(half.nodes.iter().any(|p| same(p, left)), "not in the half: {node:?}");
        }
        let (left, right) = (canonical(&half, |p| p), canonical(&half, |[x, y]| [12.0 - x, y]));
        let both: HashSet<_> = left.union(&right).copied().collect();
        assert!(canonical(&full, |p| p) == both);

        if grading == 1.0 {
            assert_eq!((node_count(&half, "foundation"), node_count(&full, "foundation")), (9, 18));
        } else {
            for point in [[2.0, 4.0], [0.0, 0.0], [2.0, 0.0]] {
                let edge = edge_at(&half, point) * grading / size;
                assert!((0.6..1.6).contains(&edge), "{edge} at {point:?}");
            }
        }
    }
}

#[test]
fn hertz() {
    let mesh = mesh("hertz", []);
    let radius = 0.05;
    assert!((1000..6000).contains(&mesh.nodes.len()), "{} nodes", mesh.nodes.len());
    // Half of ∮ x × dx over the curves, which make the whole boundary.
    let cross = |[a, b]: [[f64; 2]; 2]| 0.5 * (a[0] * b[1] - a[1] * b[0]);
    let edges = mesh.curves.values().flat_map(|curve| &curve.edges);
    let polygon: f64 = edges.map(|edge| cross(edge.map(|node| mesh.nodes[node]))).sum();
    check_laws(&mesh, polygon, mesh.curves.keys().map(|name| curve_length(&mesh, name)).sum(), 0);
    assert!((polygon / (PI * radius * radius / 4.0) - 1.0).abs() < 1e-3);
    assert!(smallest_angle(&mesh) > 25.0);
    close(curve_length(&mesh, "top"), radius);
    close(curve_length(&mesh, "axis"), radius);

    for name in ["foundation", "side"] {
        for node in boundary_nodes(&mesh, &mesh.curves[name].edges) {
            let [x, y] = mesh.nodes[node.node];
            assert!((x.hypot(y - radius) - radius).abs() < 1e-12);
            assert_eq!(node.faces.len(), 1);
            // Unequal edges of the polygon tilt the normal a little.
            let [nx, ny] = node.faces[0].normal;
            assert!((nx * (y - radius) - ny * x).abs() < 0.06 * radius);
        }
    }
    for &[a, b] in &mesh.curves["foundation"].edges {
        if mesh.nodes[a][0].min(mesh.nodes[b][0]) < 0.0075 {
            let length = mesh.edge_normal([a, b]).1;
            assert!((0.0001..0.0002).contains(&length), "{length}");
        }
    }
}

#[test]
fn second_order_adds_midpoints_and_changes_nothing_else() {
    let (folder, geo) = copy("hertz");
    let linear = load(&geo, &BTreeMap::new(), Order::Linear).unwrap();
    let quadratic = load(&geo, &BTreeMap::new(), Order::Quadratic).unwrap();
    assert!(folder.path().join("hertz.msh").exists());
    assert!(folder.path().join("hertz.order2.msh").exists());
    assert!(linear.curved.is_empty());
    let version = linear.gmsh.as_deref().expect("gmsh writes its version");
    assert!(version.split('.').all(|number| number.parse::<u32>().is_ok()), "{version}");
    let arcs = ["foundation", "side"].into_iter().flat_map(|name| &linear.curves[name].edges);
    assert_eq!(quadratic.curved.len(), arcs.clone().count());
    for edge in arcs {
        let [x, y] = quadratic.midpoint(*edge);
        assert!((x.hypot(y - 0.05) - 0.05).abs() < 1e-12);
    }
    assert!(Mesh { curved: BTreeMap::new(), ..quadratic } == linear);

    let (_folder, geo) = copy("square");
    let graded = parameters([("n", 16.0), ("grading", 8.0)]);
    let [linear, quadratic] =
        [Order::Linear, Order::Quadratic].map(|order| load(&geo, &graded, order).unwrap());
    assert!(linear == quadratic);

    let (_folder, geo) = copy("hertz");
    let text = fs::read_to_string(&geo).unwrap();
    fs::write(&geo, format!("{text}Mesh.ElementOrder = 1;\n")).unwrap();
    assert!(!load(&geo, &BTreeMap::new(), Order::Quadratic).unwrap().curved.is_empty());
}

#[test]
fn meshes_are_named() {
    let (folder, geo) = copy("square");
    let sized = parameters([("size", 0.25), ("grading", 3.0)]);
    for (parameters, name) in
        [(BTreeMap::new(), "square.msh"), (sized, "square-grading=3-size=0.25.msh")]
    {
        let meshed = load(&geo, &parameters, Order::Linear).unwrap();
        let path = folder.path().join(name);
        assert_eq!(load(&path, &BTreeMap::new(), Order::Linear).unwrap(), meshed);
        assert_eq!(load(&geo, &parameters, Order::Linear).unwrap(), meshed);
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 3, "something was left behind");
}

/// The meshes of the shipped scenes at twelve sizes, in elements of the first and of the second order by turns.
#[test]
fn every_scene_has_a_mesh_at_every_size() {
    const SIZES: [f64; 12] = [4., 6., 8., 11., 16., 20., 25., 32., 40., 50., 64., 80.];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let scenes = files.filter(|path| path.extension().is_some_and(|kind| kind == "toml"));
    let mut bodies: Vec<_> = scenes
        .map(|path| Scene::read(&path, &[]).unwrap().mesh)
        .map(|MeshSource { file, mut parameters, .. }| {
            parameters.remove("size");
            (file.file_stem().unwrap().to_str().unwrap().to_owned(), parameters)
        })
        .collect();
    bodies.sort_by_key(|body| format!("{body:?}"));
    bodies.dedup();
    assert!(bodies.len() > 6);
    let check = |(name, parameters): &(String, BTreeMap<String, f64>)| {
        let (_folder, geo) = copy(name);
        let size = extent(&load(&geo, parameters, Order::Linear).unwrap().nodes);
        // gmsh takes six times as long for order 2.
        let both = [(Order::Linear, 1.0), (Order::Quadratic, 0.5)];
        for (cells, (order, part)) in SIZES.iter().flat_map(|cells| both.map(|of| (cells, of))) {
            let mut parameters = parameters.clone();
            parameters.insert("size".to_owned(), size / (part * cells));
            let mesh = load(&geo, &parameters, order);
            let mesh = mesh.unwrap_or_else(|error| panic!("{parameters:?} {order:?}: {error}"));
            assert!(mesh.notes.is_empty(), "{name}: {:?}", mesh.notes);
        }
    };
    thread::scope(|scope| {
        let (some, others) = bodies.split_at(bodies.len() / 2);
        scope.spawn(|| others.iter().for_each(check));
        some.iter().for_each(check);
    });
}

#[test]
fn messages_of_gmsh_have_no_colours() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part.step");
    let header = "HEADER;\nFILE_DESCRIPTION((\"\"),\"2;1\");\nENDSEC;";
    let text =
        format!("ISO-10303-21;\n{header}\nDATA;\n#1=GARBAGE(;\nENDSEC;\nEND-ISO-10303-21;\n");
    fs::write(&part, text).unwrap();
    let message = load(&part, &BTreeMap::new(), Order::Linear).unwrap_err().to_string();
    assert!(message.contains("part.step") && !message.contains('\x1b'), "{message:?}");
}

#[test]
fn what_gmsh_rejects_is_told() {
    let (folder, geo) = copy("square");
    let fails = |pairs: &[(&str, f64)]| {
        let parameters = pairs.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        load(&geo, &parameters, Order::Linear).unwrap_err().to_string()
    };
    assert!(fails(&[("n", 0.0)]).contains("n must be at least 1"));
    assert!(
        fails(&[("grdaing", 2.0)]).contains("`grdaing` = 2: the .geo file has no such parameter")
    );
    assert!(fails(&[("size", -1.0)]).contains("must be positive"));
    // gmsh would not end.
    assert!(fails(&[("n", f64::NAN)]).contains("must be finite"));
    assert!(fails(&[("../n", 1.0)]).contains("letters, digits"));

    // gmsh would work for hours, whether `size` alone bounds the triangles or the geometry itself.
    let sides = "Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 1}; Curve Loop(1) = {1, 2, 3};";
    let points = "Point(1) = {0, 0, 0}; Point(2) = {2, 0, 0}; Point(3) = {0, 1, 0};";
    fs::write(&geo, format!("{points}\n{sides}\nPlane Surface(1) = {{1}};\n")).unwrap();
    let message = fails(&[("size", 1e-6)]);
    assert!(message.contains("size = 1e-06 is too small for a body of 2 by 1"), "{message}");
    for bound in ["Mesh.MeshSizeMax = 1e-7;", "Mesh.CharacteristicLengthMax = size / 10;"] {
        let size = "DefineConstant[ size = 1e-6 ];";
        let text = format!("{size}\n{points}\n{sides}\nPlane Surface(1) = {{1}};\n{bound}\n");
        fs::write(&geo, text).unwrap();
        for parameters in [&[][..], &[("size", 1e-6)]] {
            let message = fails(parameters);
            assert!(message.contains("is too small for a body of 2 by 1"), "{bound}: {message}");
        }
    }

    fs::write(&geo, "Point(1) = {0, 0, 0};\nLine(1) = {1, ;\n").unwrap();
    let message = fails(&[]);
    assert!(message.contains("gmsh could not mesh it") && message.contains("line 2"), "{message}");
    fs::write(&geo, "Point(1) = {0, 0, 0};\n").unwrap();
    assert!(
        fails(&[]).contains("there are no triangles"),
        "an empty mesh is the reader's to refuse"
    );
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "something was left behind");

    let none = load(&folder.path().join("none.geo"), &BTreeMap::new(), Order::Linear).unwrap_err();
    assert!(matches!(none, MeshError::Io { .. }));
    let other = load(Path::new("body.stl"), &BTreeMap::new(), Order::Linear).unwrap_err();
    assert_eq!(
        other.to_string(),
        "body.stl: a mesh is a .msh, a geometry for gmsh (.geo .step .stp .brep .iges .igs), or a mesh of another program \
         (.inp .unv .med .bdf .nas .vtu .vtk .xdmf)"
    );
}

#[test]
fn a_constant_that_the_file_assigns_itself_is_no_parameter() {
    let (_folder, geo) = copy("square");
    // It would overrule the parameter without a word.
    for (text, overruled) in [
        ("w = 1;\n", true),
        ("a = 2; /* w */ w=1; // c\n", true),
        ("// w = 1;\nDefineConstant[ w = 1 ];\n", false),
        ("/* w = 1; */ DefineConstant[ v = 1,\n w = 1 ];\n", false),
        ("If (!Exists(w))\n w = 1;\nEndIf\n", false),
        ("If (!Exists(w))\n v = 2;\n w = 1;\nEndIf\n", false),
        ("If (w == 1)\nEndIf\n", false),
        ("If (1)\nEndIf\nw = 1;\n", true),
    ] {
        fs::write(&geo, text).unwrap();
        let read = load(&geo, &parameters([("w", 3.0)]), Order::Linear);
        let told = read.is_err_and(|e| e.to_string().contains("assigns it, which overrules"));
        assert_eq!(told, overruled, "{text}");
    }
}

#[test]
fn the_size_overrules_a_bound_that_the_file_sets() {
    let text =
        "Point(1) = {0,0,0,1}; Point(2) = {1,0,0,1}; Point(3) = {1,1,0,1}; Point(4) = {0,1,0,1};
        Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
        Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Physical Surface(\"body\") = {1};
        Physical Curve(\"bottom\") = {1};\n";
    let folder = tempfile::tempdir().unwrap();
    for (number, (bound, size, edges)) in [
        ("Mesh.MeshSizeMax = 0.1;", 0.5, 2),
        ("Mesh.CharacteristicLengthMax = 0.5;", 0.1, 10),
        // A bound of the size itself stays.
        ("DefineConstant[ size = 1 ]; Mesh.MeshSizeMax = size/2;", 0.5, 4),
    ]
    .into_iter()
    .enumerate()
    {
        let geo = folder.path().join(format!("bound{number}.geo"));
        fs::write(&geo, format!("{text}{bound}\n")).unwrap();
        let mesh = load(&geo, &parameters([("size", size)]), Order::Linear).unwrap();
        assert_eq!(mesh.curves["bottom"].edges.len(), edges, "{bound}");
    }
}
