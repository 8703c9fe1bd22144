//! The connected components of a mesh: pieces, which share no node, and the parts of a piece, which
//! share single nodes only.

use super::{Mesh, sorted};
use rustc_hash::FxHashMap;

/// The connected components of a triangulation.
///
/// The triangles of a *part* are connected through edges: it moves without strain only as a rigid
/// body. The triangles of a *piece* are connected through nodes: it is one part, or several that
/// meet in hinges.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// The part of each triangle.
    pub part_of_triangle: Vec<usize>,
    /// The part of each node; of a hinge one of its parts.
    pub part_of_node: Vec<usize>,
    /// The parts of each piece, in increasing order.
    pub pieces: Vec<Vec<usize>>,
    /// The nodes in which parts meet, each with the node's own part and another one.
    pub hinges: Vec<(usize, [usize; 2])>,
}

impl Mesh {
    /// The components of this mesh, numbered as its triangles first meet them.
    pub fn components(&self) -> Components {
        let sides = (self.triangles.iter().enumerate())
            .flat_map(|(t, &[a, b, c])| [[a, b], [b, c], [c, a]].map(|edge| (sorted(edge), t)));
        let count = 3 * self.triangles.len() / 2;
        let mut met = FxHashMap::with_capacity_and_hasher(count, Default::default());
        let neighbours = sides.filter_map(|(edge, t)| Some([met.insert(edge, t)?, t]));
        let (part_of_triangle, parts) = connected(self.triangles.len(), neighbours);

        let mut part_of_node = vec![None; self.nodes.len()];
        let mut hinges = Vec::new();
        for (&part, triangle) in part_of_triangle.iter().zip(&self.triangles) {
            for &node in triangle {
                let own = *part_of_node[node].get_or_insert(part);
                if own != part {
                    hinges.push((node, [own, part]));
                }
            }
        }
        hinges.sort_unstable();
        hinges.dedup();

        let (piece_of_part, count) = connected(parts, hinges.iter().map(|hinge| hinge.1));
        let mut pieces = vec![Vec::new(); count];
        piece_of_part.iter().enumerate().for_each(|(part, &piece)| pieces[piece].push(part));
        Components {
            part_of_triangle,
            part_of_node: part_of_node.into_iter().flatten().collect(),
            pieces,
            hinges,
        }
    }
}

/// The sets into which `links` join the numbers below `count`, by union–find: the set of each
/// number, counted in the order of their first members, and how many sets there are.
fn connected(count: usize, links: impl IntoIterator<Item = [usize; 2]>) -> (Vec<usize>, usize) {
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
    let mut sets = 0;
    for i in 0..count {
        // Parents come before their children: they have the number of their set already.
        if parent[i] == i {
            parent[i] = sets;
            sets += 1;
        } else {
            parent[i] = parent[parent[i]];
        }
    }
    (parent, sets)
}
