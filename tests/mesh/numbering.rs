//! Another order of nodes and triangles is the same mesh, with what is near in it near in memory.

use crate::common::{fixture, square};
use signorini::mesh::{Mesh, read};

/// The corners of each triangle, the ends of each edge of a curve, the corners of each triangle of a surface
/// and the ends and midpoints of curved edges, as numbers, each kind sorted.
fn places(mesh: &Mesh) -> Vec<Vec<Vec<u64>>> {
    let at = |nodes: &[usize]| -> Vec<u64> {
        nodes.iter().flat_map(|&node| mesh.nodes[node].map(f64::to_bits)).collect()
    };
    let triangles = mesh.triangles.iter().map(|nodes| at(nodes)).collect();
    let mut kinds: Vec<Vec<Vec<u64>>> = vec![triangles];
    kinds.extend(mesh.curves.values().map(|curve| curve.edges.iter().map(|e| at(e)).collect()));
    let surface = |surface: &Vec<usize>| surface.iter().map(|&t| at(&mesh.triangles[t])).collect();
    kinds.extend(mesh.surfaces.values().map(surface));
    let curved = mesh.curved.iter().map(|([a, b], middle)| {
        let mut ends = [at(&[*a]), at(&[*b])];
        ends.sort();
        [ends.concat(), middle.map(f64::to_bits).to_vec()].concat()
    });
    kinds.push(curved.collect());
    kinds.iter_mut().for_each(|kind| kind.sort());
    kinds
}

#[test]
fn an_ordered_mesh_is_the_same_mesh() {
    for name in ["plate-41", "disc-41"] {
        let mesh = read(&fixture(name)).unwrap();
        let ordered = mesh.clone().in_morton_order();
        assert_ne!(ordered.nodes, mesh.nodes);
        assert_eq!(places(&ordered), places(&mesh), "{name}");
        assert!(ordered.surfaces.values().all(|surface| surface.is_sorted()));
        assert!(ordered.curved.keys().all(|[a, b]| a < b));
        // An adapted mesh that is kept and read again gives the same results.
        assert_eq!(ordered.clone().in_morton_order(), ordered, "{name}");
    }
}

#[test]
fn neighbours_are_near_in_memory() {
    let n = 64;
    let mut mesh = square(n);
    // 1002 and the number of nodes, 65², have no common factor.
    let number = |node: usize| node * 1002 % mesh.nodes.len();
    let mut nodes = mesh.nodes.clone();
    (0..mesh.nodes.len()).for_each(|node| nodes[number(node)] = mesh.nodes[node]);
    let triangles: Vec<_> = mesh.triangles.iter().rev().map(|t| t.map(number)).collect();
    mesh = Mesh { nodes, triangles, ..Mesh::default() }.in_morton_order();
    let span = |numbers: &[usize]| numbers.iter().max().unwrap() - numbers.iter().min().unwrap();
    let mut spans: Vec<usize> = mesh.triangles.iter().map(|triangle| span(triangle)).collect();
    spans.sort_unstable();
    // Row by row the span of every triangle is n + 1 or n + 2.
    assert!(spans[spans.len() / 2] < n / 4, "{}", spans[spans.len() / 2]);
    let least = |t: &[usize; 3]| t.iter().min().copied();
    assert!(mesh.triangles.is_sorted_by_key(least));
}
