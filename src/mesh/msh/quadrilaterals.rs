//! Quadrilaterals, which become two triangles each.

use super::{
    body::missing_node,
    byte_reader::Result,
    contents::{Contents, Element, Node},
};
use crate::mesh::{distance, midpoint, quadratic::is_unfolded, twice_area};
use rustc_hash::{FxHashMap as HashMap, FxHashSet as HashSet};
use std::mem::take;

/// The distance of the middle of a straight side from the mean of its ends, over its length. Files have few digits.
const STRAIGHT_SIDE: f64 = 1e-5;

/// Divides the quadrilaterals of a file along their shorter diagonals. The longer one is taken where the shorter one
/// leaves the quadrilateral. A quadrilateral with a corner twice is a triangle.
///
/// The middle of the diagonal of an element of second order is its centre: its ninth node, or with eight nodes and a curved side
/// x(0, 0) = −¼ Σ corners + ½ Σ middles of the sides. Otherwise the diagonal is straight.
pub fn divide(contents: &mut Contents) -> Result<()> {
    let quadrilaterals = take(&mut contents.quadrilaterals);
    if quadrilaterals.is_empty() {
        return Ok(());
    }
    let point = |node: &Node| (node.tag, node.point);
    let points: HashMap<u64, [f64; 3]> = contents.nodes.iter().map(point).collect();
    let mut next = 1 + contents.nodes.iter().map(|node| node.tag).max().unwrap_or(0);
    let mut divided = HashSet::default();
    for (Element { tag, group, nodes: mut corners, at }, centre) in quadrilaterals {
        let triangle = |nodes| Element { tag, group, nodes, at };
        if let Some(twice) = (0..4).find(|&i| corners[i] == corners[(i + 1) % 4]) {
            corners.rotate_left(twice);
            contents.triangles.push(triangle([corners[1], corners[2], corners[3]]));
            continue;
        }
        let middles = [0, 1, 2, 3].map(|i| contents.midpoint([corners[i], corners[(i + 1) % 4]]));
        let middles: Option<Vec<u64>> = middles.into_iter().collect();
        let used = corners.iter().chain(middles.iter().flatten()).chain(&centre);
        if let Some(missing) = used.into_iter().find(|node| !points.contains_key(node)) {
            return missing_node(tag, *missing, at);
        }
        let place = |node: u64| [points[&node][0], points[&node][1]];
        let [a, b, c, d] = corners.map(place);
        let middle = centre.map(place).or_else(|| {
            let middles: Vec<[f64; 2]> =
                middles.iter().flatten().map(|&node| place(node)).collect();
            let (p, q) = ([a, b, c, d], [b, c, d, a]);
            let is_straight = |i: usize| {
                distance(middles[i], midpoint(p[i], q[i])) <= STRAIGHT_SIDE * distance(p[i], q[i])
            };
            let sum = |points: &[[f64; 2]], k: usize| points.iter().map(|at| at[k]).sum::<f64>();
            let is_curved = (0..middles.len()).any(|i| !is_straight(i));
            is_curved.then(|| [0, 1].map(|k| 0.5 * sum(&middles, k) - 0.25 * sum(&p, k)))
        });
        if twice_area(a, b, c) + twice_area(a, c, d) < 0.0 {
            corners.reverse();
        }
        let is_inside = |[a, b, c]: [u64; 3], diagonal: [f64; 2]| {
            let side = |ends: [u64; 2]| match contents.midpoint(ends) {
                Some(node) if middles.is_some() => place(node),
                _ => midpoint(place(ends[0]), place(ends[1])),
            };
            let [p, q, r] = [a, b, c].map(place);
            is_unfolded(&[p, q, r, side([a, b]), side([b, c]), diagonal], 0.0)
        };
        // Tags decide between equal lengths, so that listing an element again changes nothing.
        let order = |[a, b, c, d]: [u64; 4]| {
            let diagonal = middle.unwrap_or_else(|| midpoint(place(a), place(c)));
            let leaves = !is_inside([a, b, c], diagonal) || !is_inside([c, d, a], diagonal);
            (leaves, distance(place(a), place(c)).to_bits(), a.min(c))
        };
        let [a, b, c, d] = corners;
        let [a, b, c, d] =
            [[a, b, c, d], [b, c, d, a]].into_iter().min_by_key(|&q| order(q)).unwrap_or(corners);
        contents.triangles.extend([[a, b, c], [c, d, a]].map(triangle));
        corners.sort_unstable();
        if divided.insert(corners) && middles.is_some() {
            let node = centre.unwrap_or_else(|| {
                let [x, y] = middle.unwrap_or_else(|| midpoint(place(a), place(c)));
                let z = points[&a][2];
                contents.nodes.push(Node { tag: next, point: [x, y, z], is_point: false, at });
                next += 1;
                next - 1
            });
            contents.midpoints.insert([a.min(c), a.max(c)], node);
        }
    }
    contents.divided = divided.len();
    Ok(())
}
