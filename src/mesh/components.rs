//! The connected components of a mesh: pieces, which share no node, and the parts of a piece, which
//! share single nodes only.

use super::Mesh;

/// The connected components of a triangulation.
///
/// The triangles of a *part* are connected through edges: it moves without strain only as a rigid
/// body. The triangles of a *piece* are connected through nodes: it is one part, or several that
/// meet in hinges.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// The part of each node; of a hinge one of its parts.
    pub part_of_node: Vec<usize>,
    /// The parts of each piece, in increasing order.
    pub pieces: Vec<Vec<usize>>,
    /// The nodes in which parts meet, each with the node's own part and another one.
    pub hinges: Vec<(usize, [usize; 2])>,
}

const NONE: usize = usize::MAX;

impl Mesh {
    /// The components of this mesh, numbered as its triangles first meet them.
    #[must_use]
    pub fn components(&self) -> Components {
        let (part_of_triangle, parts) = numbered(self.edge_connected());
        let mut part_of_node = vec![NONE; self.nodes.len()];
        let mut hinges = Vec::new();
        for (&part, &node) in part_of_triangle
            .iter()
            .zip(&self.triangles)
            .flat_map(|(part, nodes)| nodes.iter().map(move |node| (part, node)))
        {
            match part_of_node[node] {
                NONE => part_of_node[node] = part,
                own if own != part => hinges.push((node, [own, part])),
                _ => {}
            }
        }
        hinges.sort_unstable();
        hinges.dedup();

        let mut joined: Vec<usize> = (0..parts).collect();
        hinges.iter().for_each(|&(_, [a, b])| join(&mut joined, a, b));
        let (piece_of_part, count) = numbered(joined);
        let mut pieces = vec![Vec::new(); count];
        piece_of_part.iter().enumerate().for_each(|(part, &piece)| pieces[piece].push(part));
        Components { part_of_node, pieces, hinges }
    }

    /// A union–find forest of the triangles, joined across common edges.
    fn edge_connected(&self) -> Vec<usize> {
        let mut forest: Vec<usize> = (0..self.triangles.len()).collect();
        let mut edges: Vec<([usize; 2], usize)> = (self.triangles.iter().enumerate())
            .flat_map(|(t, &[a, b, c])| {
                [[a, b], [b, c], [c, a]].map(|[p, q]| ([p.min(q), p.max(q)], t))
            })
            .collect();
        edges.sort_unstable();
        for same in edges.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            join(&mut forest, same[0].1, same[1].1);
        }
        forest
    }
}

/// Joins the sets of `a` and `b`; the smaller root stays one.
fn join(forest: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(forest, a), root(forest, b));
    forest[a.max(b)] = a.min(b);
}

fn root(forest: &mut [usize], mut i: usize) -> usize {
    while forest[i] != i {
        forest[i] = forest[forest[i]];
        i = forest[i];
    }
    i
}

/// The number of each element's set, counted in the order of their first elements, and how many
/// sets there are.
fn numbered(mut forest: Vec<usize>) -> (Vec<usize>, usize) {
    let mut count = 0;
    for i in 0..forest.len() {
        // The root comes first: it is the smallest of its set, and numbered already.
        let parent = forest[i];
        if parent == i {
            forest[i] = count;
            count += 1;
        } else {
            forest[i] = forest[parent];
        }
    }
    (forest, count)
}
