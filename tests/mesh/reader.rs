//! What every mesh file must give, whatever its version, its form and its writer.

use crate::common::{check_laws, close, curve_length, fixture, read_bytes};
use signorini::mesh::{Mesh, read};
use std::{collections::BTreeMap, fs};

/// The forms of a file besides version 4.1 as text.
const OTHER_FORMS: [&str; 3] = ["41-binary", "22", "22-binary"];

fn check_plate(mesh: &Mesh) {
    check_laws(mesh, 1.75, 8.0, 1);
    let lengths = [
        ("bottom", 2.0),
        ("top", 2.0),
        ("outer sides", 6.0),
        ("77", 1.0),
        ("hole", 2.0),
        ("left square", 3.0),
    ];
    let names: Vec<_> = mesh.curves.keys().map(String::as_str).collect();
    assert_eq!(names.len(), lengths.len(), "{names:?}");
    for (name, length) in lengths {
        close(curve_length(mesh, name), length);
        let interior = if name == "left square" { 2 } else { 0 };
        assert_eq!(mesh.curves[name].interior_edges, interior, "{name}");
    }
    // The normals point out of the body.
    for (name, normal) in [("bottom", [0.0, -1.0]), ("top", [0.0, 1.0]), ("77", [1.0, 0.0])] {
        for &edge in &mesh.curves[name].edges {
            let (found, _) = mesh.edge_normal(edge);
            close(found[0], normal[0]);
            close(found[1], normal[1]);
        }
    }
    for &edge in &mesh.curves["hole"].edges {
        let ([nx, ny], _) = mesh.edge_normal(edge);
        let [x, y] = mesh.nodes[edge[0]];
        assert!(nx * (0.5 - x) + ny * (0.5 - y) > 0.0, "out of the body is into the hole");
    }
}

#[test]
fn every_form_gives_the_same_mesh() {
    for writer in ["plate", "newer"] {
        let mesh = read(&fixture(&format!("{writer}-41"))).unwrap();
        check_plate(&mesh);
        for form in OTHER_FORMS {
            let other = read(&fixture(&format!("{writer}-{form}"))).unwrap();
            // Text keeps 16 digits.
            for (p, q) in mesh.nodes.iter().flatten().zip(other.nodes.iter().flatten()) {
                assert!((p - q).abs() < 1e-15, "{writer}-{form}: {p} is not {q}");
            }
            let other = Mesh { nodes: mesh.nodes.clone(), ..other };
            assert!(mesh == other, "{writer}-{form}");
        }
    }
}

#[test]
fn parametric_nodes_and_saved_extras_change_nothing() {
    let mesh = read(&fixture("plate-41")).unwrap();
    assert!(mesh == read(&fixture("parametric-41")).unwrap());
    let mesh = read(&fixture("plate-41-binary")).unwrap();
    assert!(mesh == read(&fixture("parametric-41-binary")).unwrap());
    check_plate(&read(&fixture("save-all-41-binary")).unwrap());
    check_laws(&read(&fixture("save-all-22")).unwrap(), 1.75, 8.0, 1);
}

#[test]
fn second_order_keeps_the_midpoints_of_curved_edges_only() {
    assert!(read(&fixture("second-order")).unwrap() == read(&fixture("plate-41")).unwrap());
    let binary = read(&fixture("second-order-22-binary")).unwrap();
    assert!(binary == read(&fixture("plate-22-binary")).unwrap());

    let disc = read(&fixture("disc-41")).unwrap();
    let rim = &disc.curves["rim"].edges;
    let curved: Vec<_> = disc.curved.keys().copied().collect();
    let mut expected: Vec<_> = rim.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    expected.sort_unstable();
    assert_eq!(curved, expected);
    for edge in rim {
        let [x, y] = disc.midpoint(*edge);
        close(x.hypot(y), 1.0);
    }
    for form in OTHER_FORMS {
        let other = read(&fixture(&format!("disc-{form}"))).unwrap();
        for (p, q) in disc.curved.values().flatten().zip(other.curved.values().flatten()) {
            assert!((p - q).abs() < 1e-15, "{form}: {p} is not {q}");
        }
        assert_eq!(disc.curved.len(), other.curved.len());
        assert_eq!(disc.triangles, other.triangles);
    }
}

/// Two triangles on a square, one of them clockwise; stray tags and an unused node.
const SQUARE: &str = "\
$Comments
anything $Nodes at all
$EndComments
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 5 \"ground floor\"
1 6 \"ground floor\"
2 1 \"body\"
$EndPhysicalNames
$Nodes
5
40 0 0 0
7 1 0 1e-17
1000000 1 1 0
3 0 1 0
99 5 5 5
$EndNodes
$Periodic
0
$EndPeriodic
$Elements
7
1 15 2 1 1 40
2 1 2 5 1 7 40
3 1 2 8 1 7 1000000
4 1 2 6 1 40 7
5 2 2 1 1 40 1000000 7
6 2 2 1 1 40 1000000 3
9 1 2 8 1 40 1000000
$EndElements
";

#[test]
fn tags_orientation_and_unused_nodes() {
    let mesh = read_bytes(SQUARE).unwrap();
    check_laws(&mesh, 1.0, 4.0, 0);
    assert_eq!(mesh.nodes, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let names: Vec<_> = mesh.curves.keys().collect();
    assert_eq!(names, ["8", "ground floor"]);
    // Groups of one name are one curve, with each edge once.
    assert_eq!(mesh.curves["ground floor"].edges, [[0, 1]]);
    assert_eq!(mesh.curves["8"].edges, [[1, 2]]);
    assert_eq!(mesh.curves["8"].interior_edges, 1);
}

#[test]
fn line_ends_and_a_missing_last_one_do_not_matter() {
    let mesh = read_bytes(SQUARE).unwrap();
    assert!(mesh == read_bytes(SQUARE.replace('\n', "\r\n")).unwrap());
    assert!(mesh == read_bytes(SQUARE.trim_end()).unwrap());
    assert!(mesh == read_bytes(format!("\n\n{SQUARE}\n\n")).unwrap());
}

#[test]
fn the_order_of_sections_does_not_matter() {
    let text = fs::read_to_string(fixture("plate-41")).unwrap();
    let (before, rest) = text.split_once("$Entities\n").unwrap();
    let (entities, after) = rest.split_once("$EndEntities\n").unwrap();
    let late = format!("{before}{after}$Entities\n{entities}$EndEntities\n");
    assert!(read_bytes(text).unwrap() == read_bytes(late).unwrap());
}

#[test]
fn without_physical_surfaces_all_triangles_are_the_body() {
    let free = SQUARE.replace(" 2 2 1 1 ", " 2 2 0 1 ");
    let named = read_bytes(SQUARE).unwrap();
    assert!(named.surfaces.values().eq([&vec![0, 1]]));
    assert!(Mesh { surfaces: BTreeMap::new(), ..named } == read_bytes(free).unwrap());
    // With them only theirs, and the diagonal becomes boundary.
    let half = SQUARE.replace("6 2 2 1 1", "6 2 2 0 1");
    let mesh = read_bytes(half).unwrap();
    check_laws(&mesh, 0.5, 2.0 + 2.0_f64.sqrt(), 0);
    assert_eq!(mesh.curves["8"].edges, [[1, 2], [2, 0]]);
}
