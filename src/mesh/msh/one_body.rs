//! Checks that the triangles make one body.

use super::byte_reader::{Result, error_at};
use crate::mesh::{Side, extent, place};

/// Checks that the triangles are one body: connected through their `sides`.
pub fn check(nodes: &[[f64; 2]], triangles: &[[usize; 3]], sides: &[Side]) -> Result<()> {
    let neighbours = sides.windows(2).filter(|pair| pair[0].ends == pair[1].ends);
    let neighbours = neighbours.map(|pair| [pair[0].triangle(), pair[1].triangle()]);
    let part = components(triangles.len(), neighbours);
    if part.iter().all(|&part| part == 0) {
        return Ok(());
    }
    let middle =
        |t: usize| [0, 1].map(|k| triangles[t].map(|node| nodes[node][k] / 3.0).iter().sum());
    let pieces = (0..triangles.len()).filter(|&t| part[t] == t);
    let around = pieces.clone().take(2).map(|t| place(extent(nodes), middle(t)));
    let problem = format!(
        "the mesh has {} pieces without common edges, as around {}; join them along edges (gmsh: Coherence), or \
         solve them one by one",
        pieces.count(),
        around.collect::<Vec<_>>().join(" and ")
    );
    error_at(None, problem)
}

/// The sets into which `links` join the numbers below `count` (union–find). Per number: the smallest member
/// of its set.
fn components(count: usize, links: impl IntoIterator<Item = [usize; 2]>) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..count).collect();
    for link in links {
        let [a, b] = link.map(|mut i| {
            while parent[i] != i {
                parent[i] = parent[parent[i]];
                i = parent[i];
            }
            i
        });
        parent[a.max(b)] = a.min(b);
    }
    // Parents come before their children.
    (0..count).for_each(|i| parent[i] = parent[parent[i]]);
    parent
}
