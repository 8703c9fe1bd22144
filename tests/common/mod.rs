//! What several test programs share.
#![allow(dead_code, reason = "each test program uses its part")]

pub mod msh;

use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};
use signorini::mesh::{Mesh, MeshError, read, twice_area};
use std::{
    collections::{BTreeMap, HashMap},
    fs,
    path::{Path, PathBuf},
};

pub fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/msh");
    folder.join(name).with_extension("msh")
}

/// Reads the bytes as a file called `x.msh`.
pub fn read_bytes(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.msh");
    fs::write(&path, bytes).unwrap();
    read(&path)
}

/// How many triangles each edge has.
pub fn edges(mesh: &Mesh) -> HashMap<[usize; 2], usize> {
    let mut edges = HashMap::new();
    for [a, b, c] in &mesh.triangles {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            *edges.entry([*p.min(q), *p.max(q)]).or_default() += 1;
        }
    }
    edges
}

/// What every mesh must satisfy.
pub fn check_laws(mesh: &Mesh, area: f64, perimeter: f64, holes: isize) {
    assert!(triangle_areas(mesh).all(|area| area > 0.0));
    close(triangle_areas(mesh).sum(), area);

    let mut used = vec![false; mesh.nodes.len()];
    mesh.triangles.iter().flatten().for_each(|&i| used[i] = true);
    assert!(used.iter().all(|&used| used), "a node belongs to no triangle");

    let edges = edges(mesh);
    assert!(edges.values().all(|&count| count <= 2));
    let boundary: Vec<_> = edges.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
    close(length(mesh, &boundary), perimeter);
    let [v, e, f] = [mesh.nodes.len(), edges.len(), mesh.triangles.len()].map(usize::cast_signed);
    assert_eq!(v - e + f, 1 - holes, "Euler characteristic");

    // The triangle of a boundary edge must lie on its left.
    for edge in mesh.curves.values().flat_map(|curve| &curve.edges) {
        let [a, b] = *edge;
        assert_eq!(edges[&[a.min(b), a.max(b)]], 1, "an inner edge among a curve's edges");
        let left = |t: &&[usize; 3]| (0..3).any(|i| [t[i], t[(i + 1) % 3]] == *edge);
        assert!(mesh.triangles.iter().any(|t| left(&t)), "the body is not on the left");
    }
}

pub fn curve_length(mesh: &Mesh, name: &str) -> f64 {
    length(mesh, &mesh.curves[name].edges)
}

/// Total length of a set of edges.
pub fn length(mesh: &Mesh, edges: &[[usize; 2]]) -> f64 {
    edges.iter().map(|&edge| mesh.edge_normal(edge).1).sum()
}

/// The area of each triangle.
pub fn triangle_areas(mesh: &Mesh) -> impl Iterator<Item = f64> {
    let corners = mesh.triangles.iter().map(|t| t.map(|node| mesh.nodes[node]));
    corners.map(|[a, b, c]| 0.5 * twice_area(a, b, c))
}

/// The area within quadratic edges: of each triangle ½ (b−a)×(c−a) + ⅔ Σ d×(q−p), over its sides pq
/// with offsets d.
pub fn curved_area(mesh: &Mesh) -> f64 {
    let segments = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|node| mesh.nodes[node]);
        let sides = [[a, b], [b, c], [c, a]].into_iter().zip(mesh.offsets(*triangle));
        sides.map(|([p, q], [dx, dy])| dx * (q[1] - p[1]) - dy * (q[0] - p[0])).sum::<f64>()
    };
    let straight: f64 = triangle_areas(mesh).sum();
    straight + 2.0 / 3.0 * mesh.triangles.iter().map(segments).sum::<f64>()
}

/// The smallest angle of the triangulation, in degrees.
pub fn smallest_angle(mesh: &Mesh) -> f64 {
    let angle = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(|i| mesh.nodes[i]);
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1])
    };
    let corners = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]);
    corners.map(angle).fold(f64::INFINITY, f64::min).to_degrees()
}

#[track_caller]
pub fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{a} is not {b}");
}

/// Mesh parameters from pairs.
pub fn parameters<const N: usize>(pairs: [(&str, f64); N]) -> BTreeMap<String, f64> {
    pairs.map(|(name, value)| (name.to_owned(), value)).into()
}

/// Numbers between −1 and 1, the same at every run.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    pub fn next(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// An index below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub fn field(&mut self, length: usize) -> Vec<f64> {
        (0..length).map(|_| self.next()).collect()
    }
}

/// The unit square, n×n cells cut along the rising diagonal, with its four sides.
pub fn square(n: usize) -> Mesh {
    Mesh::rectangle(1.0, 1.0, n, n)
}
