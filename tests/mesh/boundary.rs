//! Normals and tributary lengths at the nodes of a boundary.

use crate::{BoundaryNode, boundary_nodes, common::length};
use signorini::mesh::{Lines, Mesh, place};

/// A polygon around its first node, the centre; boundary edges counter-clockwise.
fn fan(points: &[[f64; 2]], centre: [f64; 2]) -> (Mesh, Vec<[usize; 2]>) {
    let n = points.len();
    let edges: Vec<_> = (0..n).map(|i| [1 + i, 1 + (i + 1) % n]).collect();
    let mesh = Mesh {
        nodes: std::iter::once(centre).chain(points.iter().copied()).collect(),
        triangles: edges.iter().map(|&[a, b]| [0, a, b]).collect(),
        ..Mesh::default()
    };
    (mesh, edges)
}

fn total(nodes: &[BoundaryNode]) -> f64 {
    nodes.iter().flat_map(|n| &n.faces).map(|f| f.length).sum()
}

#[track_caller]
fn close(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-14, "{a} is not {b}");
}

#[test]
fn a_place_is_printed_in_proportion_to_the_body() {
    assert_eq!(place(8.0, [6.0, -1e-9]), "(6.0000, 0.0000)");
    assert_eq!(place(0.05, [0.01, 0.0]), "(0.010000, 0.000000)");
    assert_eq!(place(200.0, [130.0, 40.0]), "(130.00, 40.00)");
    assert_eq!(place(5e-7, [2.5e-7, 0.0]), "(2.5000, 0.0000)e-7");
}

#[test]
fn a_flat_bottom_points_down_with_tributary_lengths() {
    let points = [[0.0, 0.0], [0.3, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let (mesh, edges) = fan(&points, [0.5, 0.5]);
    let bottom = boundary_nodes(&mesh, &edges[..2]);
    assert_eq!(bottom.iter().map(|n| n.node).collect::<Vec<_>>(), [1, 2, 3]);
    for (node, length) in bottom.iter().zip([0.15, 0.5, 0.35]) {
        let [face] = node.faces[..] else { panic!("one face, not {:?}", node.faces) };
        assert_eq!(face.normal, [0.0, -1.0]);
        close(face.length, length);
    }
    close(total(&bottom), 1.0);
}

#[test]
fn a_corner_keeps_both_normals() {
    let points = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    let (mesh, edges) = fan(&points, [1.0, 0.5]);
    let nodes = boundary_nodes(&mesh, &edges[..2]);
    let corner = &nodes[1];
    assert_eq!(corner.node, 2);
    let faces: Vec<_> = corner.faces.iter().map(|f| (f.normal, f.length)).collect();
    assert_eq!(faces, [([0.0, -1.0], 1.0), ([1.0, 0.0], 0.5)]);
    // The ends of an open boundary see only their own edge.
    assert_eq!(nodes[0].faces.len(), 1);
    assert_eq!(nodes[2].faces.len(), 1);
    close(total(&nodes), 3.0);
    // A closed loop has a corner at every node.
    let all = boundary_nodes(&mesh, &edges);
    assert!(all.iter().all(|n| n.faces.len() == 2));
    close(total(&all), 6.0);
}

#[test]
fn a_polygonal_circle_points_radially() {
    // Twelve edges turn by exactly the limit: still no corner.
    for n in [12, 13, 64] {
        let point = |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            [0.05 * angle.cos(), 0.05 * angle.sin()]
        };
        let points: Vec<_> = (0..n).map(point).collect();
        let (mesh, edges) = fan(&points, [0.0, 0.0]);
        let nodes = boundary_nodes(&mesh, &edges);
        assert_eq!(nodes.len(), points.len());
        for (node, point) in nodes.iter().zip(&points) {
            assert_eq!(node.faces.len(), 1, "n = {n}");
            close(node.faces[0].normal[0], point[0] / 0.05);
            close(node.faces[0].normal[1], point[1] / 0.05);
        }
        close(total(&nodes), length(&mesh, &edges));
    }
    let points: Vec<_> = (0..11)
        .map(|i| (std::f64::consts::TAU * f64::from(i) / 11.0).sin_cos().into())
        .map(|[y, x]: [f64; 2]| [x, y])
        .collect();
    let (mesh, edges) = fan(&points, [0.0, 0.0]);
    assert!(boundary_nodes(&mesh, &edges).iter().all(|n| n.faces.len() == 2));
}

#[test]
fn unequal_edges_weigh_by_length() {
    let tilt = [1.0 + 3.0 * 0.1_f64.cos(), 3.0 * 0.1_f64.sin()];
    let points = [[0.0, 0.0], [1.0, 0.0], tilt, [0.0, 5.0]];
    let (mesh, edges) = fan(&points, [1.0, 1.0]);
    let nodes = boundary_nodes(&mesh, &edges[..2]);
    let normal = nodes[1].faces[0].normal;
    let expected = [3.0 * 0.1_f64.sin(), -1.0 - 3.0 * 0.1_f64.cos()];
    close(normal[0] * expected[1], normal[1] * expected[0]);
    close(normal[0].hypot(normal[1]), 1.0);
    close(nodes[1].faces[0].length, 2.0);
}

/// A point of a line from the origin at the distance s along it.
type Side = fn(f64) -> [f64; 2];

/// Is a line of two sides with these numbers of edges, which meet in a corner of `angle` degrees, smooth at the origin? And
/// is it smooth at all other nodes? The edges are chords of 15° on circles of radius 1.
fn is_smooth(
    [left, right]: [Side; 2],
    angle: f64,
    counts: [usize; 2],
    [quadratic, is_known]: [bool; 2],
) -> [bool; 2] {
    let at = |k: f64| {
        let s = k * std::f64::consts::PI / 12.0;
        let (sine, cosine) = angle.to_radians().sin_cos();
        let [x, y] = if s < 0.0 { left(s) } else { right(s) };
        if s < 0.0 { [cosine * x + sine * y, cosine * y - sine * x] } else { [x, y] }
    };
    let [before, after] = counts;
    let mut points: Vec<_> = (0..=before + after).map(|i| at(i as f64 - before as f64)).collect();
    // Sharp corners at both ends.
    let [[x, y], [to_x, to_y]] = [points[0], points[before + after]];
    points.extend([[to_x - 5.0, to_y], [x + 5.0, y]]);
    let (mut mesh, edges) = fan(&points, [0.0, 20.0]);
    for (i, edge) in edges.iter().enumerate().take(if quadratic { before + after } else { 0 }) {
        let [p, q] = edge.map(|node| mesh.nodes[node]);
        let [x, y] = at(i as f64 - before as f64 + 0.5);
        mesh.set_offset(*edge, [x - 0.5 * (p[0] + q[0]), y - 0.5 * (p[1] + q[1])]);
    }
    let [first, joint, last] = [1, 1 + before, 1 + before + after];
    if is_known {
        mesh.points = [first, joint, last].into();
    }
    let lines = Lines::boundary(&mesh);
    let smooth = |node: usize| lines.is_smooth(node, [node - 1, node + 1]);
    [smooth(joint), (first + 1..last).all(|node| node == joint || smooth(node))]
}

const STRAIGHT: Side = |s| [s, 0.0];
const CONVEX: Side = |s| [s.sin(), 1.0 - s.cos()];
const CONCAVE: Side = |s| [s.sin(), s.cos() - 1.0];
/// A logarithmic spiral with the curvature 1/(1 − 0.3 s).
const SPIRAL: Side = |s| {
    let (b, w) = (0.3, 1.0 - 0.3 * s);
    let (sine, cosine) = (w.ln() / b).sin_cos();
    let [re, im] = [1.0 - w * cosine, w * sine];
    [(b * re - im) / (b * b + 1.0), (re + b * im) / (b * b + 1.0)]
};

#[test]
fn lines_and_arcs_that_meet_at_an_angle_have_a_corner_however_small_it_is() {
    for sides in [[STRAIGHT; 2], [STRAIGHT, CONVEX], [CONVEX; 2], [CONCAVE; 2], [CONVEX, CONCAVE]] {
        for angle in [0.1, 2.0, 10.0, 29.0, 31.0, 45.0, -0.1, -2.0, -10.0, -29.0, -45.0_f64] {
            for (counts, quadratic) in
                [([2, 2], false), ([2, 3], false), ([5, 4], false), ([1, 1], true), ([3, 2], true)]
            {
                let found = is_smooth(sides, angle, counts, [quadratic, true]);
                assert_eq!(found, [false, true], "{angle}° {counts:?} {quadratic}");
                // Without points, the edges of both sides must be enough, and the angle more than rounding.
                if counts == [5, 4] && angle.abs() > 2.0 {
                    let found = is_smooth(sides, angle, counts, [quadratic, false]);
                    assert_eq!(found, [false, true], "{angle}° {counts:?} without points");
                }
            }
        }
    }
    // Sides of one edge are straight lines.
    assert_eq!(is_smooth([STRAIGHT; 2], 2.0, [1, 1], [false, true]), [false, true]);
}

#[test]
fn arcs_fillets_and_other_curves_that_meet_smoothly_have_no_corner() {
    let pairs = [
        [STRAIGHT; 2],
        [STRAIGHT, CONVEX],
        [CONVEX; 2],
        [CONCAVE; 2],
        [CONVEX, CONCAVE],
        [SPIRAL; 2],
        [CONVEX, SPIRAL],
    ];
    for (i, sides) in pairs.into_iter().enumerate() {
        for (counts, quadratic) in
            [([3, 3], false), ([3, 4], false), ([6, 5], false), ([2, 2], true), ([3, 5], true)]
        {
            for is_known in [true, false] {
                // One millionth of a degree is rounding.
                let found = is_smooth(sides, 1e-6, counts, [quadratic, is_known]);
                assert_eq!(found, [true; 2], "pair {i}, {counts:?} {quadratic} {is_known}");
            }
        }
    }
}
