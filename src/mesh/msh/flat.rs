//! Triangles without area.

use crate::mesh::{Side, distance, longest_side, sides, sorted, twice_area};
use std::collections::BTreeMap;

/// Twice the area over the square of the longest side: below this value a triangle is flat.
const FLAT: f64 = 1e-10;
/// The rounding error of a difference of coordinates, over their size.
const OF_COORDINATES: f64 = 4.0 * f64::EPSILON;

/// The largest twice the area (m²) of a flat triangle with these vertices.
pub fn bound([a, b, c]: [[f64; 2]; 3]) -> f64 {
    let longest = distance(a, b).max(distance(b, c)).max(distance(c, a));
    let coordinate = [a, b, c].as_flattened().iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    longest * (FLAT * longest + OF_COORDINATES * coordinate)
}

/// Gives area to flat triangles. At strong gradings gmsh makes such triangles of three consecutive nodes p, m, q on
/// a straight line. The neighbour p, q, c at the longest side is then split at m: both become p, m, c and
/// m, q, c, in the surfaces of the neighbour. Returns the removed edges pq, or a flat triangle for which this fails.
pub fn mend(
    nodes: &[[f64; 2]],
    triangles: &mut [[usize; 3]],
    surfaces: &mut BTreeMap<String, Vec<usize>>,
) -> Result<Vec<[usize; 2]>, usize> {
    let is_flat = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|node| nodes[node]);
        let twice = twice_area(a, b, c);
        // The area of a triangle with huge coordinates overflows.
        twice.abs() <= bound([a, b, c]) || !twice.is_finite()
    };
    let mut removed = Vec::new();
    let mut flat: Vec<usize> = (0..triangles.len()).filter(|&t| is_flat(&triangles[t])).collect();
    while !flat.is_empty() {
        let (count, sides) = (flat.len(), sides(triangles));
        flat.retain(|&t| {
            let (edge, m) = longest_side(nodes, triangles[t]);
            let first = sides.partition_point(|side| side.edge() < edge);
            let around: Vec<&Side> =
                sides[first..].iter().take_while(|side| side.edge() == edge).collect();
            let [own, other] = around[..] else { return true };
            let neighbour = own.triangle() + other.triangle() - t;
            // It has these three nodes unless it was split before.
            let Some(at) = (0..3).find(|&k| !edge.contains(&triangles[neighbour][k])) else {
                return true;
            };
            let [c, p, q] = [0, 1, 2].map(|k| triangles[neighbour][(at + k) % 3]);
            let halves = [[p, m, c], [m, q, c]];
            if sorted([p, q]) != edge || halves.iter().any(is_flat) {
                return true;
            }
            [triangles[t], triangles[neighbour]] = halves;
            for members in surfaces.values_mut() {
                members.retain(|&member| member != t);
                if members.contains(&neighbour) {
                    members.push(t);
                    members.sort_unstable();
                }
            }
            removed.push(edge);
            false
        });
        if flat.len() == count {
            return Err(flat[0]);
        }
    }
    Ok(removed)
}
