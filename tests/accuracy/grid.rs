//! Structured grids are those of geo/square.geo, and points are found in them.

use signorini::{
    mesh::{self, Mesh},
    study::Grid,
};
use std::{collections::BTreeSet, fs, path::Path};

/// Triangles as sorted triples of corners rounded to 10⁻⁹ m.
fn triangles(mesh: &Mesh) -> BTreeSet<[[i64; 2]; 3]> {
    let corner = |node: usize| mesh.nodes[node].map(|x| (x * 1e9).round() as i64);
    let sorted = |t: &[usize; 3]| {
        let mut corners = t.map(corner);
        corners.sort_unstable();
        corners
    };
    mesh.triangles.iter().map(sorted).collect()
}

#[test]
fn squares_are_those_of_gmsh_with_their_sides() {
    let folder = tempfile::tempdir().unwrap();
    let geo = folder.path().join("square.geo");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("geo/square.geo"), &geo).unwrap();
    for (n, grading) in [(4, 1.0), (7, 6.0), (8, 3.0), (1, 2.0)] {
        let parameters = [("n".to_owned(), n as f64), ("grading".to_owned(), grading)].into();
        let theirs = mesh::load(&geo, &parameters).unwrap();
        let ours = Grid::square(n, grading).mesh();
        assert_eq!(triangles(&ours), triangles(&theirs), "n = {n}, grading {grading}");
        for (name, curve) in &theirs.curves {
            let length = ours.length(&ours.curves[name].edges);
            assert!((length - theirs.length(&curve.edges)).abs() < 1e-9, "{name}");
        }
    }
}

#[test]
fn the_triangle_of_a_point_and_its_coordinates_give_the_point_back() {
    let grid = Grid::square(9, 5.0);
    let mesh = grid.mesh();
    for i in 0..=40 {
        for j in 0..=40 {
            let point = [i as f64 / 40.0, j as f64 / 40.0];
            let (triangle, place) = grid.locate(point);
            assert!(place.iter().all(|&weight| weight > -1e-12), "{point:?}: {place:?}");
            for axis in 0..2 {
                let corners = mesh.triangles[triangle].map(|node| mesh.nodes[node][axis]);
                let back: f64 = place.iter().zip(corners).map(|(w, x)| w * x).sum();
                assert!((back - point[axis]).abs() < 1e-14, "{point:?}");
            }
        }
    }
}
