//! Refinement: what bisection must keep, whatever is marked.

use crate::common::{
    Random, check_laws, close, curve_length, curved_area, fixture, length, smallest_angle,
    triangle_areas,
};
use signorini::mesh::{Mesh, Order, Refinement, load, read};
use std::{collections::BTreeMap, fs};

/// The triangles with a node at a point.
fn at(mesh: &Mesh, point: [f64; 2]) -> Vec<bool> {
    mesh.triangles.iter().map(|t| t.iter().any(|&node| mesh.nodes[node] == point)).collect()
}

/// The nodal values of a P1 function with `block` components, carried over from the mesh before.
fn carried(refined: &Refinement, values: &[f64], block: usize) -> Vec<f64> {
    let mean = |&[a, b]: &[usize; 2]| {
        (0..block).map(move |i| 0.5 * (values[block * a + i] + values[block * b + i]))
    };
    values.iter().copied().chain(refined.halved_edges.iter().flat_map(mean)).collect()
}

/// Rounds of refinement of about every `one_in`-th triangle.
fn random_rounds(mesh: Mesh, rounds: usize, one_in: usize) -> Vec<(Vec<bool>, Refinement)> {
    let mut random = Random::new(7);
    let mut refined = Refinement::start(mesh);
    let mut history = Vec::new();
    for _ in 0..rounds {
        let count = refined.mesh.triangles.len();
        let marked: Vec<bool> = (0..count).map(|_| random.below(one_in) == 0).collect();
        refined = refined.refine(&marked).unwrap();
        history.push((marked, refined.clone()));
    }
    history
}

#[test]
fn a_refined_mesh_is_conforming_and_covers_the_same_body() {
    let coarse = read(&fixture("plate-41")).unwrap();
    let mut before = Refinement::start(coarse.clone()).mesh;
    for (marked, refined) in random_rounds(coarse.clone(), 8, 3) {
        let mesh = &refined.mesh;
        check_laws(mesh, 1.75, 8.0, 1);
        for (name, curve) in &coarse.curves {
            close(curve_length(mesh, name), length(&coarse, &curve.edges));
            assert_eq!(mesh.curves[name].other_edges, curve.other_edges);
        }
        let mut parts = vec![0; before.triangles.len()];
        let mut areas = vec![0.0; before.triangles.len()];
        for (area, &parent) in triangle_areas(mesh).zip(&refined.parent_of_triangle) {
            parts[parent] += 1;
            areas[parent] += area;
        }
        for (parent, area) in triangle_areas(&before).enumerate() {
            close(areas[parent], area);
            assert!((1..=4).contains(&parts[parent]));
            assert!(!marked[parent] || parts[parent] > 1, "a marked triangle is left whole");
        }
        before = mesh.clone();
    }
    assert!(before.triangles.len() > 500);
    let [again, first] = [0, 1].map(|_| random_rounds(coarse.clone(), 4, 4));
    assert!(again == first, "not the same again");
}

#[test]
fn nothing_marked_changes_nothing() {
    let start = Refinement::start(read(&fixture("disc-41")).unwrap());
    let refined = start.refine(&vec![false; start.mesh.triangles.len()]).unwrap();
    assert!(refined == start);
}

#[test]
fn new_nodes_halve_edges_and_linear_functions_stay_linear() {
    let linear = |mesh: &Mesh| -> Vec<f64> {
        mesh.nodes.iter().flat_map(|[x, y]| [1.0 + x + 2.0 * y, x - 3.0 * y]).collect()
    };
    let mut values = linear(&Mesh::rectangle(1.0, 1.0, 4, 4));
    for (_, refined) in random_rounds(Mesh::rectangle(1.0, 1.0, 4, 4), 5, 4) {
        values = carried(&refined, &values, 2);
        assert_eq!(values, linear(&refined.mesh));
    }
}

#[test]
fn right_isosceles_triangles_stay_so_and_the_area_is_exact() {
    for (_, refined) in random_rounds(Mesh::rectangle(1.0, 1.0, 8, 8), 8, 4) {
        let mesh = refined.mesh;
        assert_eq!(triangle_areas(&mesh).sum::<f64>(), 1.0);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|node| mesh.nodes[node]);
            let squared = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2);
            assert_eq!(squared(a, b), 2.0 * squared(b, c));
            assert_eq!(squared(b, c), squared(c, a));
        }
    }
}

#[test]
fn towards_a_corner_angles_stay_and_triangles_are_few() {
    let plate = read(&fixture("plate-41")).unwrap();
    for (mesh, point) in [(plate, [0.25, 0.25]), (Mesh::rectangle(1.0, 1.0, 4, 4), [1.0, 0.0])] {
        let mut refined = Refinement::start(mesh);
        let (angle, count) = (smallest_angle(&refined.mesh), refined.mesh.triangles.len());
        for round in 1..=20 {
            refined = refined.refine(&at(&refined.mesh, point)).unwrap();
            assert!(smallest_angle(&refined.mesh) >= 0.5 * angle - 1e-10);
            assert!(refined.mesh.triangles.len() < count + 30 * round, "round {round}");
        }
        let finest = triangle_areas(&refined.mesh).fold(1.0, f64::min);
        assert!(finest < 1e-6, "{finest}");
    }
}

#[test]
fn halves_of_a_curved_side_lie_on_the_circle_through_its_ends_and_its_midpoint() {
    let mut mesh = Mesh {
        nodes: vec![[0.0, 0.0], [2.0, 0.0], [0.5, 1.5]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    for (i, offset) in [[0.1, -0.2], [0.15, 0.1], [0.1, -0.05]].into_iter().enumerate() {
        mesh.set_offset([i, (i + 1) % 3], offset);
    }
    let circles = [[0, 1], [1, 2], [2, 0]]
        .map(|side| circle([mesh.nodes[side[0]], mesh.midpoint(side), mesh.nodes[side[1]]]));
    let mut count = 0;
    for (_, refined) in random_rounds(mesh, 9, 2) {
        let mesh = &refined.mesh;
        for [a, b] in mesh.boundary_edges() {
            let on_one = |points: [[f64; 2]; 3]| {
                let off = |([x, y], radius): ([f64; 2], f64)| {
                    let off = |p: [f64; 2]| ((p[0] - x).hypot(p[1] - y) - radius).abs();
                    points.into_iter().map(off).fold(0.0, f64::max)
                };
                circles.into_iter().map(off).fold(f64::INFINITY, f64::min) < 1e-12
            };
            assert!(on_one([mesh.nodes[a], mesh.midpoint([a, b]), mesh.nodes[b]]));
            count += 1;
        }
        assert!(triangle_areas(mesh).all(|area| area > 0.0));
    }
    assert!(count > 50, "{count}");
}

/// The centre and the radius of the circle through three points.
fn circle([a, b, c]: [[f64; 2]; 3]) -> ([f64; 2], f64) {
    let ([p, q], [r, s]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let (of_b, of_c, twice) = (p * p + q * q, r * r + s * s, 2.0 * (p * s - q * r));
    let [x, y] = [(s * of_b - q * of_c) / twice, (p * of_c - r * of_b) / twice];
    ([a[0] + x, a[1] + y], x.hypot(y))
}

#[test]
fn a_triangle_too_curved_to_be_refined_is_an_error() {
    let mut mesh = Mesh {
        nodes: vec![[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    // The middle of the right side lies on the left of the line through apex and foot.
    mesh.set_offset([1, 2], [-0.6, -0.3]);
    let halves = Refinement::start(mesh).refine(&[true]).unwrap();
    let message = halves.refine(&[true, true]).unwrap_err().to_string();
    assert!(message.contains("is too curved; start from a finer mesh"), "{message}");
}

#[test]
fn a_refined_disc_stays_round_and_its_area_is_of_fourth_order() {
    let folder = tempfile::tempdir().unwrap();
    let geo = folder.path().join("disc.geo");
    fs::copy(fixture("disc").with_extension("geo"), &geo).unwrap();
    let disc = load(&geo, &BTreeMap::from([("size".to_owned(), 0.5)]), Order::Quadratic).unwrap();
    assert!(disc.kinks().iter().all(|kink| kink.angle < 1e-9), "arcs of a circle have no kinks");
    let is_round = |mesh: &Mesh| {
        let rim = &mesh.curves["rim"].edges;
        let points = rim.iter().flat_map(|&[a, b]| [mesh.nodes[a], mesh.midpoint([a, b])]);
        points.into_iter().all(|p| (p[0].hypot(p[1]) - 1.0).abs() < 1e-9)
    };
    for (_, refined) in random_rounds(disc.clone(), 3, 3) {
        assert!(is_round(&refined.mesh) && triangle_areas(&refined.mesh).all(|area| area > 0.0));
    }
    let mut refined = Refinement::start(disc);
    let errors = [(); 3].map(|()| {
        let error = (curved_area(&refined.mesh) - std::f64::consts::PI).abs();
        refined = refined.refine_everywhere().unwrap();
        assert!(is_round(&refined.mesh));
        error
    });
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.8..4.2).contains(&order), "{errors:?}");
    }
}

/// Equilateral triangles: their sides are equal up to rounding, which differs with the unit.
#[test]
fn equal_sides_are_bisected_alike_in_all_units() {
    let equilateral = |unit: f64| {
        let mut mesh = Mesh::rectangle(4.0, 4.0, 4, 4);
        for [x, y] in &mut mesh.nodes {
            [*x, *y] = [unit * (*x - 0.5 * *y), unit * (*y * 0.75_f64.sqrt())];
        }
        random_rounds(mesh, 4, 3).pop().unwrap().1.mesh.triangles
    };
    let metres = equilateral(1.0);
    for unit in [1e3, 1.0 / 3.0, 7e-3, 39.3701] {
        assert_eq!(equilateral(unit), metres, "{unit}");
    }
}
