//! Straight sides as chords of smooth curves: circles are found, polygons stay polygons.

use crate::common::curved_area;
use signorini::mesh::{Mesh, Refinement};
use std::f64::consts::{FRAC_PI_2, PI};

/// The sector 1 ≤ r ≤ 1 + `thickness`, 0 ≤ θ ≤ π/2, in n × m cells; its arcs are `left` and `right`.
fn sector(thickness: f64, n: usize, m: usize) -> Mesh {
    let mut mesh = Mesh::rectangle(thickness, 1.0, n, m);
    for node in &mut mesh.nodes {
        let (r, (sine, cosine)) = (1.0 + node[0], (FRAC_PI_2 * node[1]).sin_cos());
        *node = [r * cosine, r * sine];
    }
    mesh
}

/// The polygon with these corners around the origin, `parts` edges on each side, divided towards the origin.
fn polygon(corners: &[[f64; 2]], parts: usize) -> Mesh {
    let next = corners.iter().cycle().skip(1);
    let side = |([ax, ay], [bx, by]): (&[f64; 2], &[f64; 2])| {
        let part = move |k: usize| k as f64 / parts as f64;
        let [ax, ay, bx, by] = [*ax, *ay, *bx, *by];
        (0..parts).map(move |k| [ax + part(k) * (bx - ax), ay + part(k) * (by - ay)])
    };
    let outer = Vec::from_iter(corners.iter().zip(next).flat_map(side));
    let count = outer.len();
    let inner = outer.iter().map(|x| x.map(|x| 0.5 * x));
    let nodes = outer.iter().copied().chain(inner).chain([[0.0, 0.0]]).collect();
    let around = (0..count).map(|i| (i, (i + 1) % count));
    let triangles = around.flat_map(|(a, b)| {
        [[a, b, count + b], [a, count + b, count + a], [2 * count, count + a, count + b]]
    });
    Mesh { triangles: triangles.collect(), nodes, ..Mesh::default() }
}

#[test]
fn chords_of_circles_get_their_arcs_and_a_note_says_what_is_assumed() {
    let straight = sector(1.0, 2, 4);
    let (mesh, notes) = straight.on_smooth_curves();
    assert_eq!((&mesh.nodes, &mesh.triangles), (&straight.nodes, &straight.triangles));
    for (name, radius) in [("left", 1.0), ("right", 2.0)] {
        for &edge in mesh.edges_of(name) {
            let [x, y] = mesh.midpoint(edge);
            assert!((x.hypot(y) - radius).abs() < 1e-14, "{name}: {x}, {y}");
        }
    }
    assert_eq!(mesh.curved.len(), 8, "{:?}", mesh.curved);
    assert!(notes.len() == 1 && notes[0].contains("`left`, `right`"), "{notes:?}");

    // Where the points of the geometry are known, nothing is assumed.
    let corners = [0, 2, 12, 14].into();
    let (known, notes) = Mesh { points: corners, ..straight }.on_smooth_curves();
    assert!(notes.is_empty() && known.curved.keys().eq(mesh.curved.keys()), "{notes:?}");
    assert!(mesh.on_smooth_curves().0 == mesh, "curved sides stay");
}

#[test]
fn refined_chords_follow_other_smooth_curves_in_fourth_order() {
    let errors = [8, 16, 32].map(|m| {
        let mut mesh = sector(1.0, m / 4, m);
        mesh.nodes.iter_mut().for_each(|node| node[1] *= 0.6);
        (curved_area(&mesh.on_smooth_curves().0) - 0.6 * 0.75 * PI).abs()
    });
    println!("{errors:?}");
    assert!(
        errors[0] < 1e-2 && errors.windows(2).all(|pair| 7.0 * pair[1] < pair[0]),
        "{errors:?}"
    );
}

#[test]
fn polygons_stay_as_they_are() {
    let regular = |corners: usize| {
        let corner = |k: usize| {
            let (sine, cosine) = (2.0 * PI * (k as f64 + 0.3) / corners as f64).sin_cos();
            [3.0 * cosine, 3.0 * sine]
        };
        Vec::from_iter((0..corners).map(corner))
    };
    let flat = |degrees: f64| {
        let ridge = 2.0 + 2.0 * (0.5 * degrees).to_radians().tan();
        vec![[2.0, -2.0], [2.0, 2.0], [0.0, ridge], [-2.0, 2.0], [-2.0, -2.0]]
    };
    let end = 2.0 + 0.2 * 10_f64.to_radians().tan();
    let left = end + 3.8 * 20_f64.to_radians().tan();
    let uneven = vec![[2.0, -2.0], [2.0, 2.0], [1.8, end], [-2.0, left], [-2.0, -2.0]];
    let cases = [
        ("a corner of 10° between short and long edges", uneven, 3),
        ("an octagon", regular(8), 1),
        ("an octagon", regular(8), 3),
        ("corners of 5°", regular(72), 2),
        ("corners of 5°", regular(72), 5),
        ("one corner of 5°", flat(5.0), 2),
        ("one corner of 5°", flat(5.0), 4),
        ("one corner of 25°", flat(25.0), 4),
    ];
    for (name, corners, parts) in cases {
        let mesh = polygon(&corners, parts);
        let (same, notes) = mesh.on_smooth_curves();
        assert!(same == mesh && notes.is_empty(), "{name}, {parts}: {:?}", same.curved);
    }
    // A corner that turns as much as the chords beside it is none.
    assert_eq!(polygon(&regular(72), 1).on_smooth_curves().0.curved.len(), 72);
}

#[test]
fn no_triangle_turns_over() {
    for (thickness, m) in [(0.5, 4), (0.1, 4), (0.05, 8), (0.01, 6), (0.001, 12)] {
        let (mesh, notes) = sector(thickness, 1, m).on_smooth_curves();
        let stays = notes.iter().any(|note| note.contains("curved sides stay straight"));
        assert_eq!(stays, mesh.curved.len() < 2 * m, "{thickness}: {notes:?}");
        let mut refined = Refinement::start(mesh);
        for _ in 0..3 {
            refined = refined.refine_everywhere().unwrap_or_else(|error| panic!("{error}"));
            let mesh = &refined.mesh;
            let area = |t: &[usize; 3]| {
                let [[a, b], [c, d], [e, f]] = t.map(|node| mesh.nodes[node]);
                (c - a) * (f - b) - (e - a) * (d - b)
            };
            assert!(mesh.triangles.iter().all(|t| area(t) > 0.0), "{thickness}, {m}");
        }
    }
}
