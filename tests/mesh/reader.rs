//! What every mesh file must give, whatever its version, its form and its writer.

use crate::common::{check_laws, close, curve_length, curved_area, fixture, msh::msh, read_bytes};
use signorini::mesh::{Curve, Mesh, read};
use std::fs;

/// The forms of a file besides version 4.1 as text.
const OTHER_FORMS: [&str; 3] = ["41-binary", "22", "22-binary"];

/// The mesh with nodes sorted by place, and triangles and edges by their nodes.
fn sorted(mesh: Mesh) -> Mesh {
    let mut order: Vec<usize> = (0..mesh.nodes.len()).collect();
    let place = |i: &usize| mesh.nodes[*i].map(|x| (1e9 * x).round() as i64);
    order.sort_by_key(place);
    let mut number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| number[old] = new);
    let renumbered = |triangle: &[usize; 3]| {
        let mut nodes = triangle.map(|node| number[node]);
        let least = (0..3).min_by_key(|&i| nodes[i]).unwrap();
        nodes.rotate_left(least);
        nodes
    };
    let all: Vec<_> = mesh.triangles.iter().map(renumbered).collect();
    let mut triangles = all.clone();
    triangles.sort_unstable();
    let place = |t: &usize| triangles.binary_search(&all[*t]).unwrap();
    let surface = |(name, old): (&String, &Vec<usize>)| {
        let mut new: Vec<usize> = old.iter().map(place).collect();
        new.sort_unstable();
        (name.clone(), new)
    };
    let curve = |(name, old): (&String, &Curve)| {
        let mut edges: Vec<_> = old.edges.iter().map(|e| e.map(|node| number[node])).collect();
        edges.sort_unstable();
        (name.clone(), Curve { edges, ..*old })
    };
    let midpoint = |(&[a, b], &x): (&[usize; 2], &[f64; 2])| {
        let [a, b] = [number[a], number[b]];
        ([a.min(b), a.max(b)], x)
    };
    Mesh {
        nodes: order.iter().map(|&old| mesh.nodes[old]).collect(),
        surfaces: mesh.surfaces.iter().map(surface).collect(),
        curves: mesh.curves.iter().map(curve).collect(),
        points: mesh.points.iter().map(|&node| number[node]).collect(),
        curved: mesh.curved.iter().map(midpoint).collect(),
        triangles,
        gmsh: mesh.gmsh,
        notes: mesh.notes,
    }
}

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
        assert_eq!(mesh.curves[name].other_edges, interior, "{name}");
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
        let mesh = sorted(read(&fixture(&format!("{writer}-41"))).unwrap());
        check_plate(&mesh);
        for form in OTHER_FORMS {
            let other = sorted(read(&fixture(&format!("{writer}-{form}"))).unwrap());
            // Text keeps 16 digits.
            for (p, q) in mesh.nodes.iter().flatten().zip(other.nodes.iter().flatten()) {
                assert!((p - q).abs() < 1e-15, "{writer}-{form}: {p} is not {q}");
            }
            // Only MSH 4 names the points of the geometry.
            let points = if form.starts_with("22") { &mesh.points } else { &other.points }.clone();
            let other = Mesh { nodes: mesh.nodes.clone(), points, ..other };
            assert!(mesh == other && !mesh.points.is_empty(), "{writer}-{form}");
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
    for other in ["save-all-22", "parametric-22", "version-40"] {
        check_laws(&read(&fixture(other)).unwrap(), 1.75, 8.0, 1);
    }
    // MSH 1 has no names.
    let mesh = read(&fixture("version-1")).unwrap();
    check_laws(&mesh, 1.75, 8.0, 1);
    assert_eq!(mesh.curves["77"].edges.len(), 2);
}

#[test]
fn second_order_keeps_the_midpoints_of_curved_edges_only() {
    assert!(read(&fixture("second-order")).unwrap() == read(&fixture("plate-41")).unwrap());
    let binary = read(&fixture("second-order-22-binary")).unwrap();
    assert!(sorted(binary) == sorted(read(&fixture("plate-22-binary")).unwrap()));

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
    let disc = sorted(disc);
    for form in OTHER_FORMS {
        let other = sorted(read(&fixture(&format!("disc-{form}"))).unwrap());
        for (p, q) in disc.curved.values().flatten().zip(other.curved.values().flatten()) {
            assert!((p - q).abs() < 1e-15, "{form}: {p} is not {q}");
        }
        assert_eq!(disc.curved.len(), other.curved.len());
        assert_eq!(disc.triangles, other.triangles);
    }
}

/// The square of two quadrilaterals and the triangles of a corner, and how MSH 4.1 lists it.
#[test]
fn quadrilaterals_are_two_triangles() {
    let mesh = read(&fixture("quadrangles")).unwrap();
    check_laws(&mesh, 1.75, 8.0, 1);
    assert!(mesh.notes[0].contains("quadrilaterals are cut into two triangles each"), "{mesh:?}");
    for (name, length) in [("bottom", 2.0), ("outer sides", 6.0), ("hole", 2.0)] {
        close(curve_length(&mesh, name), length);
    }
    // A square in second order whose right side is an arc, from either diagonal and direction, listed for two groups.
    let nodes = [
        "1 0 0 0",
        "2 1 0 0",
        "3 1 1 0",
        "4 0 1 0",
        "5 0.5 0 0",
        "6 1.2 0.5 0",
        "7 0.5 1 0",
        "8 0 0.5 0",
        "9 0.55 0.5 0",
    ];
    let area = 1.0 + 2.0 / 3.0 * 0.2;
    for (kind, last) in [(16, ""), (10, " 9")] {
        for turned in ["1 2 3 4 5 6 7 8", "2 3 4 1 6 7 8 5", "4 3 2 1 7 6 5 8"] {
            let elements =
                [format!("1 {kind} 1 {turned}{last}"), format!("2 {kind} 2 {turned}{last}")];
            let elements: Vec<&str> = elements.iter().map(|element| &**element).collect();
            let mesh = read_bytes(msh(&["2 1 \"a\"", "2 2 \"b\""], &nodes, &elements)).unwrap();
            assert_eq!((mesh.triangles.len(), mesh.surfaces["a"].len()), (2, 2));
            close(curved_area(&mesh), area);
            // The diagonal goes through the centre, which the nodes of the sides place at (0.6, 0.5).
            let [x, y] = mesh.curved.iter().find(|(_, at)| at[1] == 0.5 && at[0] < 1.0).unwrap().1;
            close(*x, if kind == 16 { 0.6 } else { 0.55 });
            close(*y, 0.5);
        }
    }
    // A corner listed twice makes a triangle, in both orders.
    for twice in
        ["1 3 1 1 2 3 3", "1 3 1 3 3 1 2", "1 16 1 1 2 3 3 5 6 3 9", "1 10 1 3 1 2 3 9 5 6 3 9"]
    {
        let mesh = read_bytes(msh(&[], &nodes, &[twice])).unwrap();
        assert_eq!(mesh.triangles.len(), 1, "{twice}");
    }
}

#[test]
fn the_order_of_bytes_does_not_matter() {
    // `plate-22-binary`: integers of four bytes, and tags with three reals.
    let bytes = fs::read(fixture("plate-22-binary")).unwrap();
    let after =
        |text: &[u8]| bytes.windows(text.len()).position(|w| w == text).unwrap() + text.len();
    let mut swapped = bytes.clone();
    let mut swap = |at: usize, width: usize| swapped[at..at + width].reverse();
    swap(after(b"2.2 1 8\n"), 4);
    let nodes = after(b"$Nodes\n21\n");
    for node in 0..21 {
        swap(nodes + 28 * node, 4);
        (0..3).for_each(|k| swap(nodes + 28 * node + 4 + 8 * k, 8));
    }
    let elements = after(b"$Elements\n");
    let start = elements + bytes[elements..].iter().position(|&b| b == b'\n').unwrap() + 1;
    let end = after(b"$EndElements") - "\n$EndElements".len();
    (start..end).step_by(4).for_each(|at| swap(at, 4));
    assert!(read_bytes(swapped).unwrap() == read_bytes(bytes).unwrap());
}

/// Two triangles on a square, one of them clockwise; stray tags and an unused node. The second triangle is in
/// the surface `second`.
fn square(second: usize) -> String {
    let names = ["1 5 \"ground floor\"", "1 6 \"ground floor\"", "2 1 \"body\""];
    let nodes = ["40 0 0 0", "7 1 0 1e-17", "1000000 1 1 0", "3 0 1 0", "99 5 5 5"];
    let last = format!("6 2 {second} 40 1000000 3");
    let elements = [
        "1 15 1 40",
        "2 1 5 7 40",
        "3 1 8 7 1000000",
        "4 1 6 40 7",
        "5 2 1 40 1000000 7",
        &last,
        "9 1 8 40 1000000",
    ];
    let mesh = msh(&names, &nodes, &elements);
    let mesh = mesh.replace("$Elements", "$Periodic\n0\n$EndPeriodic\n$Elements");
    format!("$Comments\nanything $Nodes at all\n$EndComments\n{mesh}")
}

#[test]
fn tags_orientation_and_unused_nodes() {
    let mesh = read_bytes(square(1)).unwrap();
    check_laws(&mesh, 1.0, 4.0, 0);
    assert_eq!(mesh.nodes, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let names: Vec<_> = mesh.curves.keys().collect();
    assert_eq!(names, ["8", "ground floor"]);
    // Groups of one name are one curve, with each edge once.
    assert_eq!(mesh.curves["ground floor"].edges.len(), 1);
    close(curve_length(&mesh, "ground floor"), 1.0);
    assert_eq!(mesh.curves["8"].edges.len(), 1);
    assert_eq!(mesh.curves["8"].other_edges, 1);
}

#[test]
fn line_ends_and_a_missing_last_one_do_not_matter() {
    let text = square(1);
    let mesh = read_bytes(&text).unwrap();
    assert!(mesh == read_bytes(text.replace('\n', "\r\n")).unwrap());
    assert!(mesh == read_bytes(text.trim_end()).unwrap());
    assert!(mesh == read_bytes(format!("\n\n{text}\n\n")).unwrap());
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
    let named = read_bytes(square(1)).unwrap();
    assert!(named.surfaces.values().eq([&vec![0, 1]]));
    let free = square(0).replace("5 2 1 40", "5 2 0 40").replace("2 1 2 1\n5", "2 0 2 1\n5");
    let free = read_bytes(free).unwrap();
    assert!(free.surfaces.is_empty() && free.triangles.len() == 2);
    // With them only theirs, and the diagonal becomes boundary.
    let mesh = read_bytes(square(0)).unwrap();
    check_laws(&mesh, 0.5, 2.0 + 2.0_f64.sqrt(), 0);
    assert_eq!(mesh.curves["8"].edges.len(), 2);
}
