//! Edges on which a traction or a gap varies by more than the mesh shows.

use crate::{
    fem::{gauss_points, parabola},
    mesh::{Curve, Mesh, sorted},
    scene::{Expression, Scene, SurfaceLoad},
};
use std::collections::HashSet;

/// Points at which the functions are sampled in an edge.
const SAMPLES: usize = 64;
/// Times at which a traction or a gap is sampled, about.
pub(super) const TIMES: usize = 8;
/// A load jumps if it changes by more than this part of its largest value from one sample of an edge to the
/// next, at one of about so many times; edges are then integrated in so many parts.
const JUMP: f64 = 0.25;
const JUMP_TIMES: usize = 13;
const PARTS: usize = 16;
/// What a single edge may lose of the accuracy asked for.
const SHARE: f64 = 0.1;
/// Gaps count where they are less than this many times the largest displacement.
const NEAR: f64 = 2.0;

/// The edges, by their ends in increasing order, that must be halved for a relative `accuracy`, with
/// `displacement` the largest |u|, m:
///
/// - those on which the two Gauss points of a traction f miss more than a tenth of `accuracy` ∫|f|;
/// - those near the foundation on which g is further than `accuracy` · `displacement` from its
///   interpolation at ends and middle.
pub(super) fn unresolved(
    scene: &Scene,
    mesh: &Mesh,
    accuracy: f64,
    displacement: f64,
) -> HashSet<[usize; 2]> {
    let mut found = HashSet::new();
    for boundary in &scene.boundaries {
        let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
        if let Some(gap) = boundary.gap() {
            let near = |edge: [usize; 2], t: f64| {
                let at = |s: f64| {
                    let [x, y] = place(mesh, edge, s);
                    gap.distance.eval(x, y, t)
                };
                let [a, m, b] = [0.0, 0.5, 1.0].map(at);
                let mut least = f64::INFINITY;
                let mut deviation = 0.0_f64;
                for s in samples() {
                    let [shown] = parabola([[a], [m], [b]], s);
                    let g = at(s);
                    least = least.min(g).min(shown);
                    deviation = deviation.max((g - shown).abs());
                }
                least < NEAR * displacement && deviation > accuracy * displacement
            };
            let mut times = scene.sample_times(TIMES);
            times.truncate(if gap.distance.depends_on_time() { usize::MAX } else { 1 });
            let near = |edge: &&[usize; 2]| times.iter().any(|&t| near(**edge, t));
            found.extend(curve.edges.iter().filter(near).copied().map(sorted));
        }
        for load in boundary.loads() {
            found.extend(unresolved_load(scene, mesh, curve, load, accuracy));
        }
    }
    found
}

/// The edges of a curve on which the two Gauss points of a `load` miss too much of it.
fn unresolved_load(
    scene: &Scene,
    mesh: &Mesh,
    curve: &Curve,
    load: &SurfaceLoad,
    accuracy: f64,
) -> HashSet<[usize; 2]> {
    let mut found = HashSet::new();
    if !load.expressions().iter().any(Expression::depends_on_space) {
        return found;
    }
    for t in scene.sample_times(TIMES) {
        let parts = curve.edges.iter().map(|&edge| {
            let [coarse, fine] = integrals(mesh, load, 1, edge, t);
            (edge, (fine[0] - coarse[0]).hypot(fine[1] - coarse[1]), fine[2])
        });
        let parts: Vec<_> = parts.collect();
        let total: f64 = parts.iter().map(|part| part.2).sum();
        let lost = parts.iter().filter(|part| part.1 > SHARE * accuracy * total);
        found.extend(lost.map(|part| sorted(part.0)));
    }
    found
}

fn samples() -> impl Iterator<Item = f64> {
    (0..SAMPLES).map(|i| (i as f64 + 0.5) / SAMPLES as f64)
}

/// Into how many parts the edges of a curve are divided where a `load` is integrated: more than one if it
/// jumps within an edge, at some time. By two Gauss points a jump that moves would cross an edge in two leaps.
pub(super) fn parts_of_edges(
    scene: &Scene,
    mesh: &Mesh,
    curve: &Curve,
    load: &SurfaceLoad,
) -> usize {
    let f = load.expressions();
    if !f.iter().any(Expression::depends_on_space) {
        return 1;
    }
    let mut times = scene.sample_times(JUMP_TIMES);
    times.truncate(if f.iter().any(Expression::depends_on_time) { usize::MAX } else { 1 });
    let (mut largest, mut jump) = (0.0_f64, 0.0_f64);
    for (&edge, &t) in curve.edges.iter().flat_map(|edge| times.iter().map(move |t| (edge, t))) {
        let normal = mesh.edge_normal(edge).0;
        let at = |s: f64| load.at(place(mesh, edge, s), normal, t);
        let values: Vec<[f64; 2]> = samples().map(at).collect();
        for pair in values.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            largest = largest.max(b[0].hypot(b[1]));
            jump = jump.max((b[0] - a[0]).hypot(b[1] - a[1]));
        }
    }
    if jump > JUMP * largest { PARTS } else { 1 }
}

/// ∫f_x, ∫f_y and ∫|f| of a load over an edge at time t: by the Gauss points of
/// [`add_traction`](crate::fem::add_traction), and by many midpoints.
pub(super) fn integrals(
    mesh: &Mesh,
    load: &SurfaceLoad,
    parts: usize,
    edge: [usize; 2],
    t: f64,
) -> [[f64; 3]; 2] {
    let (normal, length) = mesh.edge_normal(edge);
    let gauss = gauss_points([0.0; 2], [1.0, 0.0]).map(|[s, _]| s);
    let gauss = (0..parts).flat_map(|i| gauss.map(|s| (i as f64 + s) / parts as f64));
    [gauss.collect(), samples().collect()].map(|parts: Vec<f64>| {
        let values = parts.iter().map(|&s| load.at(place(mesh, edge, s), normal, t));
        let sum =
            values.fold([0.0; 3], |[x, y, all], [fx, fy]| [x + fx, y + fy, all + fx.hypot(fy)]);
        sum.map(|sum| sum * length / parts.len() as f64)
    })
}

/// The point x(s) of an edge, 0 ≤ s ≤ 1, m.
fn place(mesh: &Mesh, [a, b]: [usize; 2], s: f64) -> [f64; 2] {
    parabola([mesh.nodes[a], mesh.midpoint([a, b]), mesh.nodes[b]], s)
}
