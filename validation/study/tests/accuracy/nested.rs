//! Refined meshes: the laws of a triangulation, nested, and on the square the paper's.

#[path = "../../../../tests/common/mod.rs"]
mod common;

use super::Study;
use signorini::mesh::{self, Mesh, Order};
use signorini_study::{longest_edge, refined};
use std::collections::{BTreeMap, BTreeSet};

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

/// The paper's meshes of n = 4, 8, …: right triangles, every side cut into n equal parts.
#[test]
fn refinements_of_the_square_are_its_meshes_of_twice_as_many_cells() {
    let study = Study::of("square-table1", "square.geo");
    let geo = study.folder.path().join("square.geo");
    let mut nested = mesh::load(&geo, &[("n".to_owned(), 4.0)].into(), Order::Linear).unwrap();
    for n in [8, 16, 32] {
        nested = refined(&nested);
        let direct = mesh::load(&geo, &[("n".to_owned(), n as f64)].into(), Order::Linear).unwrap();
        assert_eq!(triangles(&nested), triangles(&direct), "n = {n}: gmsh");
        assert_eq!(
            triangles(&nested),
            triangles(&Mesh::rectangle(1.0, 1.0, n, n)),
            "n = {n}: ours"
        );
        assert!((longest_edge(&nested) - 2.0_f64.sqrt() / n as f64).abs() < 1e-12);
        for (name, curve) in &direct.curves {
            let ends = |mesh: &Mesh, edges: &[[usize; 2]]| -> BTreeSet<_> {
                let point = |node: usize| mesh.nodes[node].map(|x| (x * 1e9).round() as i64);
                edges.iter().map(|edge| edge.map(point)).collect()
            };
            let (ours, theirs) = (&nested.curves[name].edges, &curve.edges);
            assert_eq!(ends(&nested, ours), ends(&direct, theirs), "n = {n}: {name}");
        }
    }
}

#[test]
fn refinement_keeps_the_body_the_curves_and_the_laws_of_a_triangulation() {
    let study = Study::of("lshape", "lshape.geo");
    let geo = study.folder.path().join("lshape.geo");
    let parameters = BTreeMap::from([("size".to_owned(), 1.0), ("grading".to_owned(), 3.0)]);
    let coarse = mesh::load(&geo, &parameters, Order::Linear).unwrap();
    let fine = refined(&coarse);
    common::check_laws(&fine, common::triangle_areas(&coarse).sum(), 28.0, 0);
    assert_eq!(fine.triangles.len(), 4 * coarse.triangles.len());
    assert_eq!(fine.nodes[..coarse.nodes.len()], coarse.nodes, "nodes keep their numbers");
    assert!((longest_edge(&fine) - 0.5 * longest_edge(&coarse)).abs() < 1e-12);
    for (name, curve) in &coarse.curves {
        let halves = &fine.curves[name];
        assert_eq!(halves.edges.len(), 2 * curve.edges.len());
        assert!(
            (common::length(&fine, &halves.edges) - common::length(&coarse, &curve.edges)).abs()
                < 1e-12
        );
        assert_eq!(halves.interior_edges, 2 * curve.interior_edges);
    }
}

#[test]
fn refinement_keeps_quadratic_edges() {
    let study = Study::of("hertz", "hertz.geo");
    let geo = study.folder.path().join("hertz.geo");
    let coarse = mesh::load(&geo, &BTreeMap::new(), Order::Quadratic).unwrap();
    assert!(!coarse.curved.is_empty());
    let finer = refined(&refined(&coarse));
    common::close(common::curved_area(&finer), common::curved_area(&coarse));
    let is_curved = |&[a, b]: &[usize; 2]| finer.curved.contains_key(&[a.min(b), a.max(b)]);
    assert!(finer.curves["foundation"].edges.iter().all(is_curved));
}
