//! Checks that the triangles make one body.

use super::byte_reader::{Result, error_at};
use crate::mesh::{Side, extent, place};

/// Checks that the triangles are one body: connected through their `sides`.
pub fn check(nodes: &[[f64; 2]], triangles: &[[usize; 3]], sides: &[Side]) -> Result<()> {
    let neighbours = sides.windows(2).filter(|pair| pair[0].edge == pair[1].edge);
    let neighbours = neighbours.map(|pair| [pair[0].triangle, pair[1].triangle]);
    let part = components(triangles.len(), neighbours);
    if part.iter().all(|&part| part == 0) {
        return Ok(());
    }
    // Triangles that are connected through nodes make one piece.
    let mut first = vec![None; nodes.len()];
    let corners = triangles.iter().enumerate().flat_map(|(t, nodes)| nodes.map(|node| (node, t)));
    let meeting = corners.map(|(node, t)| (node, [*first[node].get_or_insert(t), t]));
    let meeting: Vec<(usize, [usize; 2])> = meeting.collect();
    let piece = components(triangles.len(), meeting.iter().map(|(_, pair)| *pair));
    let pieces: Vec<usize> = (0..triangles.len()).filter(|&t| piece[t] == t).collect();
    let place = |at: [f64; 2]| place(extent(nodes), at);
    let middle =
        |t: usize| [0, 1].map(|k| triangles[t].map(|node| nodes[node][k] / 3.0).iter().sum());
    let problem = if let [a, b, more @ ..] = &pieces[..] {
        let (count, two) = (pieces.len(), if more.is_empty() { "" } else { " two of them" });
        let [a, b] = [a, b].map(|t| place(middle(*t)));
        format!("the mesh has {count} pieces,{two} around {a} and {b}; join them (gmsh: Coherence)")
    } else {
        let hinge = meeting.iter().find(|(_, [a, b])| part[*a] != part[*b]);
        let at = hinge.map_or_else(String::new, |&(node, _)| place(nodes[node]));
        format!("parts of the mesh meet in a single node only, at {at}; join them along an edge")
    };
    error_at(None, problem + ", or solve them one by one")
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
