//! Slits: edges of the boundary that lie on each other.

use crate::mesh::{bounds, extent, place};
use rustc_hash::FxHashMap as HashMap;

/// The largest distance of edges that lie on each other, and the smallest length on which they do, over the
/// length of the shorter edge. The points of CAD programs are exact to 1e-7 of the body, which may be a thousand
/// edges long.
const TOLERANCE: f64 = 1e-4;

/// A note on edges of the boundary that lie on each other, though they need not have nodes in common.
///
/// For each power of two there is a grid with this width. It has the edges that are at most as long and longer
/// than half of it. So an edge lies in at most four cells of each grid that is as wide or wider, and only edges of
/// these cells can be longer and lie on it.
pub fn note(nodes: &[[f64; 2]], edges: &[[usize; 2]]) -> Option<String> {
    let segments = Vec::from_iter(edges.iter().map(|edge| edge.map(|node| nodes[node])));
    let level = |&[a, b]: &[[f64; 2]; 2]| (b[0] - a[0]).hypot(b[1] - a[1]).log2().ceil() as i32;
    let mut grids: HashMap<i32, HashMap<[i64; 2], Vec<usize>>> = HashMap::default();
    for (number, segment) in segments.iter().enumerate() {
        let grid = grids.entry(level(segment)).or_default();
        cells(segment, level(segment)).for_each(|cell| grid.entry(cell).or_default().push(number));
    }
    let is_doubled = |number: &usize| {
        let (own, segment) = (level(&segments[*number]), &segments[*number]);
        grids.iter().filter(|(level, _)| **level >= own).any(|(&level, grid)| {
            let near = cells(segment, level).filter_map(|cell| grid.get(&cell)).flatten();
            near.into_iter().any(|other| other != number && lies_on(segment, &segments[*other]))
        })
    };
    let doubled = Vec::from_iter((0..segments.len()).filter(is_doubled));
    let [a, b] = segments[*doubled.first()?];
    let at = place(extent(nodes), [0, 1].map(|k| 0.5 * (a[k] + b[k])));
    Some(format!(
        "the body has a slit: {} edges of its boundary lie on others, as at {at}; unless it is meant, join the \
         parts there (gmsh: Coherence)",
        doubled.len()
    ))
}

/// The cells of width 2^`level` that the box around a segment meets, a little widened.
fn cells(segment: &[[f64; 2]; 2], level: i32) -> impl Iterator<Item = [i64; 2]> {
    let width = 2_f64.powi(level);
    let [x, y] = bounds(segment).map(|[low, high]| {
        (low / width - TOLERANCE).floor() as i64..=(high / width + TOLERANCE).floor() as i64
    });
    x.flat_map(move |x| y.clone().map(move |y| [x, y]))
}

/// Whether a segment lies on a part of another one that is at least as long.
fn lies_on(segment: &[[f64; 2]; 2], [p, q]: &[[f64; 2]; 2]) -> bool {
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let length = dx.hypot(dy);
    // Along and across the other one.
    let [[s, d], [t, e]] = segment.map(|[x, y]| {
        let (x, y) = (x - p[0], y - p[1]);
        [(x * dx + y * dy) / length, (y * dx - x * dy) / length]
    });
    let tolerance = TOLERANCE * (t - s).abs();
    let common = s.max(t).min(length) - s.min(t).max(0.0);
    common > tolerance && d.abs().max(e.abs()) <= tolerance
}
