//! What gmsh and CAD programs may leave in a mesh: noise of z, flat triangles, slits, parts without a name.

use crate::common::{check_laws, close, curve_length, msh::msh, read_bytes, triangle_areas};
use signorini::mesh::Mesh;
use std::f64::consts::PI;

const ANGLES: [f64; 4] = [0.0, PI / 2.0, 0.3, 2.5];

/// The lines of nodes in the order of their tags, turned by an angle and scaled.
fn nodes(points: &[[f64; 2]], angle: f64, scale: f64, z: impl Fn(usize) -> f64) -> Vec<String> {
    let (sin, cos) = angle.sin_cos();
    let turned = points.iter().map(|[x, y]| [x * cos - y * sin, x * sin + y * cos]);
    let lines = turned.enumerate().map(|(number, point)| {
        let [x, y] = point.map(|x| x * scale);
        format!("{} {x} {y} {}", number + 1, z(number))
    });
    lines.collect()
}

/// Two rows of squares, cut into triangles. Points of both rows at y = 0 are one if `are_one`; there the rows have
/// points at `lower` and `upper`, which are increasing from 0 to 2; from x = 1 on the upper row begins `open`·(x − 1) higher.
fn rows(
    lower: &[f64],
    upper: &[f64],
    open: f64,
    are_one: impl Fn(f64) -> bool,
) -> (Vec<[f64; 2]>, Vec<String>) {
    let (mut points, mut elements) = (Vec::new(), Vec::new());
    let mut tag = |point: [f64; 2], may_be_old: bool| {
        let old = points.iter().position(|other| may_be_old && *other == point);
        old.unwrap_or_else(|| {
            points.push(point);
            points.len() - 1
        }) + 1
    };
    let below: Vec<_> =
        lower.iter().map(|&x| [tag([x, -1.0], false), tag([x, 0.0], false)]).collect();
    let height = |x: f64| open * (x - 1.0).max(0.0);
    let above: Vec<_> =
        upper.iter().map(|&x| [tag([x, height(x)], are_one(x)), tag([x, 1.0], false)]).collect();
    for row in [below, above] {
        for pair in row.windows(2) {
            let [[a, d], [b, c]] = [pair[0], pair[1]];
            let number = elements.len() + 1;
            elements.push(format!("{number} 2 1 {a} {b} {c}"));
            elements.push(format!("{} 2 1 {a} {c} {d}", number + 1));
        }
    }
    (points, elements)
}

/// The places from 0 to 2 of `half` intervals up to 1 and of `other` ones from there.
fn places(half: usize, other: usize) -> Vec<f64> {
    let first = (0..half).map(|i| i as f64 / half as f64);
    first.chain((0..=other).map(|i| 1.0 + i as f64 / other as f64)).collect()
}

#[test]
fn a_plane_body_may_lie_at_any_z_and_have_noise_there() {
    let (points, elements) = rows(&places(3, 3), &places(3, 3), 0.0, |_| true);
    let read = |scale: f64, z: &dyn Fn(usize) -> f64| {
        read_bytes(msh(&[], &nodes(&points, 0.3, scale, z), &elements))
    };
    for scale in [1e-9, 1e-3, 1.0, 1e6] {
        let plane = read(scale, &|_| 0.0).unwrap();
        for height in [0.0, 1e-6, 1.0, -1e4] {
            for noise in [0.0, 1e-9, 1e-7] {
                let wave = |node: usize| scale * (height + noise * (node as f64).sin());
                assert!(read(scale, &wave).unwrap() == plane, "{scale} {height} {noise}");
            }
            let (low, high) = (scale * height, scale * (height + 1e-4));
            let tilted = |node: usize| low + (high - low) * points[node][0];
            let bent = |node: usize| if node == 5 { high } else { low };
            for error in [read(scale, &tilted), read(scale, &bent)] {
                let message = error.expect_err("it is not plane").to_string();
                assert!(message.contains("a plane of constant z"), "{message}");
            }
        }
    }
}

/// The boundary nodes between two others of a straight side make flat triangles with them, as gmsh makes them.
#[test]
fn flat_triangles_at_a_side_disappear() {
    let inner: [&[f64]; 5] =
        [&[0.5], &[0.1], &[0.3, 0.6], &[0.2, 0.4, 0.5], &[0.05, 0.1, 0.6, 0.95]];
    for (angle, scale, fractions) in ANGLES
        .iter()
        .flat_map(|angle| [1e-6, 1.0].map(|scale| (*angle, scale)))
        .flat_map(|(angle, scale)| inner.map(|fractions| (angle, scale, fractions)))
    {
        let (mut points, mut elements) = rows(&places(2, 3), &places(2, 3), 0.0, |_| true);
        let whole =
            read_bytes(msh(&[], &nodes(&points, angle, scale, |_| 0.0), &elements)).unwrap();
        // On the lower side from (1, −1) to (4/3, −1): the nodes are a fan, each but the first with the one before it
        // and the end.
        let [p, q] = [1.0, 4.0 / 3.0].map(|x: f64| {
            points.iter().position(|point| (point[0] - x).hypot(point[1] + 1.0) < 1e-9).unwrap()
        });
        let mut last = p;
        let mut lines = Vec::new();
        for fraction in fractions {
            points.push([points[p][0] + fraction * (points[q][0] - points[p][0]), -1.0]);
            let [a, b, c] = [last, points.len() - 1, q].map(|node| node + 1);
            elements.push(format!("{} 2 2 {c} {b} {a}", elements.len() + 1));
            lines.push(format!("{} 1 3 {a} {b}", 1000 + b));
            last = points.len() - 1;
        }
        lines.push(format!("999 1 3 {} {}", last + 1, q + 1));
        let elements = [lines, elements].concat();
        let bytes = msh(&["1 3 \"side\""], &nodes(&points, angle, scale, |_| 0.0), &elements);
        let mesh =
            read_bytes(bytes).unwrap_or_else(|error| panic!("{angle} {fractions:?}: {error}"));
        check_laws(&mesh, 4.0 * scale * scale, 8.0 * scale, 0);
        assert_eq!(mesh.triangles.len(), whole.triangles.len() + fractions.len());
        assert!(triangle_areas(&mesh).all(|area| area > 1e-4 * scale * scale));
        close(curve_length(&mesh, "side") / scale, 1.0 / 3.0);
        assert_eq!(mesh.curves["side"].other_edges, 0);
        // They belong to the surface of their neighbour.
        assert_eq!(mesh.surfaces["1"].len(), mesh.triangles.len());
        assert!(mesh.notes.is_empty());
    }
}

fn slit(mesh: &Mesh) -> Option<&String> {
    mesh.notes.iter().find(|note| note.contains("a slit"))
}

#[test]
fn sides_that_lie_on_each_other_are_noted() {
    for angle in ANGLES {
        for scale in [1e-6, 1.0, 1e5] {
            for (n, m) in [(1, 1), (2, 3), (4, 4), (7, 3), (40, 1), (1, 200)] {
                let read = |open: f64, until: f64| {
                    let (points, elements) =
                        rows(&places(2, n), &places(2, m), open, |x| x <= until);
                    read_bytes(msh(&[], &nodes(&points, angle, scale, |_| 0.0), &elements)).unwrap()
                };
                let doubled = read(0.0, 1.0);
                let note = slit(&doubled).unwrap_or_else(|| panic!("{angle} {scale} {n} {m}"));
                assert!(note.contains("Coherence"), "{note}");
                // An open slit, and one body.
                assert!(slit(&read(1e-2, 1.0)).is_none(), "{angle} {scale} {n} {m}");
                if n == m {
                    assert!(slit(&read(0.0, 2.0)).is_none(), "{angle} {scale} {n}");
                }
            }
        }
    }
}

/// A comb whose teeth make all of a mesh of 100,000 triangles boundary, on a single line.
#[test]
fn a_long_boundary_is_searched_quickly() {
    let (points, elements) = rows(&places(2, 25_000), &places(2, 25_000), 0.0, |x| x <= 1.0);
    let mesh = read_bytes(msh(&[], &nodes(&points, 0.3, 1.0, |_| 0.0), &elements)).unwrap();
    assert!(slit(&mesh).expect("a note").contains("50000 edges"), "{:?}", mesh.notes);
}

#[test]
fn parts_without_a_name_are_noted() {
    let (points, elements) = rows(&places(2, 3), &places(2, 3), 0.0, |_| true);
    for named in 1..=elements.len() {
        // The first ones are connected.
        let group = |(number, element): (usize, &String)| {
            if number < named { element.clone() } else { element.replacen(" 2 1 ", " 2 0 ", 1) }
        };
        let elements: Vec<_> = elements.iter().enumerate().map(group).collect();
        let Ok(mesh) =
            read_bytes(msh(&["2 1 \"body\""], &nodes(&points, 0.0, 1.0, |_| 0.0), &elements))
        else {
            // Two pieces.
            continue;
        };
        let count = elements.len() - named;
        let note = mesh.notes.iter().find(|note| note.contains("in no physical surface"));
        assert_eq!(note.is_some(), count > 0, "{:?}", mesh.notes);
        assert!(
            note.is_none_or(|note| note.starts_with(&format!("{count} triangles"))),
            "{note:?}"
        );
        assert!(
            note.is_none_or(|note| note.contains(" at (") && note.contains("Physical Surface"))
        );
    }
}
