//! Jumps of gaps and surface loads along a smooth boundary.

use crate::{
    mesh::{Lines, Mesh, sorted},
    scene::{Scene, SurfaceLoad},
};
use std::collections::{BTreeMap, BTreeSet};

/// A change is a jump if bisection leaves more than this fraction of the largest change on its way: of a continuous one it leaves
/// 2⁻⁵⁰.
const JUMP: f64 = 1e-6;

/// The jump of the function `value`(side, place) between the middles of the edges pq (side 0) and qr (side 1); 0 if it is
/// continuous. Bisection follows the half with the larger change: the change of a continuous function vanishes, a jump stays.
pub(crate) fn jump<const N: usize>(
    [p, q, r]: [[f64; 2]; 3],
    value: impl Fn(usize, [f64; 2]) -> [f64; N],
) -> [f64; N] {
    let at = |s: f64| {
        let (side, end) = if s < 0.0 { (0, p) } else { (1, r) };
        value(side, [0, 1].map(|i| q[i] + 0.5 * s.abs() * (end[i] - q[i])))
    };
    let change = |[a, b]: [f64; 2]| {
        let (a, b) = (at(a), at(b));
        std::array::from_fn(|i| b[i] - a[i])
    };
    let size = |part| norm(&change(part));
    let (part, largest) = (0..50).fold(([-1.0, 1.0], 0.0), |([low, high], largest), _| {
        let halves = [[low, 0.5 * (low + high)], [0.5 * (low + high), high]];
        let [a, b] = halves.map(size);
        (halves[usize::from(b > a)], f64::max(largest, a.max(b)))
    });
    let rounding = 1e-9 * part.map(|s| norm(&at(s))).into_iter().fold(0.0, f64::max);
    if size(part) > rounding.max(JUMP * largest) { change(part) } else { [0.0; N] }
}

fn norm<const N: usize>(values: &[f64; N]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Per vertex: is it in a triangle at a jump of a surface load? Empty without jumps.
pub(crate) fn near_jumps(scene: &Scene, mesh: &Mesh, lines: &Lines) -> Vec<bool> {
    let jumps: BTreeSet<usize> =
        load_jumps(scene, mesh, lines).into_iter().map(|(v, _)| v).collect();
    let mut near = vec![false; if jumps.is_empty() { 0 } else { mesh.nodes.len() }];
    let at_jump = |triangle: &&[usize; 3]| triangle.iter().any(|vertex| jumps.contains(vertex));
    let here = mesh.triangles.iter().filter(|_| !jumps.is_empty()).filter(at_jump);
    here.flatten().for_each(|&vertex| near[vertex] = true);
    near
}

/// The vertices of smooth free boundaries at which, or within half of an edge of which, a surface load jumps; each with the
/// largest jump (t_x, t_y, pressure), Pa. The sides of a support are left out: its reaction is not known.
pub(crate) fn load_jumps(scene: &Scene, mesh: &Mesh, lines: &Lines) -> Vec<(usize, [f64; 3])> {
    // Per edge its loads; `None` if it is supported.
    let mut edges = BTreeMap::<[usize; 2], Option<Vec<&SurfaceLoad>>>::new();
    for boundary in &scene.boundaries {
        for edge in mesh.edges_of(&boundary.name) {
            let known = edges.entry(sorted(*edge)).or_insert_with(|| Some(Vec::new()));
            *known = known.take().filter(|_| !boundary.is_support());
            known.iter_mut().for_each(|of| of.extend(boundary.loads()));
        }
    }
    let loads =
        |edge: [usize; 2]| edges.get(&sorted(edge)).map_or(Some(&[][..]), |of| of.as_deref());
    let found = lines.ends.iter().filter_map(|(&node, ends)| {
        let &[p, r] = &ends[..] else { return None };
        let sides = [loads([p, node])?, loads([node, r])?];
        let is_loaded = sides.iter().any(|side| !side.is_empty());
        if !is_loaded || !lines.is_smooth(node, [p, r]) {
            return None;
        }
        let jump = scene.sample_times(1).into_iter().map(|t| {
            let value = |side: usize, [x, y]: [f64; 2]| {
                sides[side].iter().fold([0.0; 3], |[a, b, c], load| match load {
                    SurfaceLoad::Traction([f, g]) => [a + f.eval(x, y, t), b + g.eval(x, y, t), c],
                    SurfaceLoad::Pressure(p) => [a, b, c + p.eval(x, y, t)],
                })
            };
            let points = [p, node, r].map(|node| mesh.nodes[node]);
            jump(points, value)
        });
        let largest = jump.max_by(|a, b| norm(a).total_cmp(&norm(b)))?;
        (norm(&largest) > 0.0).then_some((node, largest))
    });
    found.collect()
}
