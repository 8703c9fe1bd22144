//! The pieces of a body over all ranks, and means over them.

use super::Body;
use crate::petsc::{Communicator, PetscError};

/// The pieces of a body, which share no node: no diffusion passes from one to another.
pub(super) struct Pieces {
    comm: Communicator,
    /// Per owned vertex: its area, m², and the number of its piece.
    nodes: Vec<(f64, usize)>,
    /// Per piece: its area, m².
    areas: Vec<f64>,
}

impl Pieces {
    /// The pieces of the undivided body. Collective.
    pub(super) fn of(body: &Body) -> Result<Self, PetscError> {
        let (partition, components) = (&body.vertices.partition, body.mesh.components());
        let (comm, owned) = (partition.comm(), partition.owned());
        let mut piece_of_part = vec![0; components.pieces.iter().map(Vec::len).sum()];
        for (piece, parts) in components.pieces.iter().enumerate() {
            parts.iter().for_each(|&part| piece_of_part[part] = piece);
        }
        let here: Vec<usize> =
            components.part_of_node.iter().map(|&part| piece_of_part[part]).collect();
        // Every node takes the least global index in its piece of this rank, and ghosts hand it on to the
        // other ranks, until no node has a smaller one to take.
        let own = |node: usize| f64::from(partition.global(node, 1, 0));
        let mut least: Vec<f64> = (0..partition.local()).map(own).collect();
        loop {
            let mut of_piece = vec![f64::INFINITY; components.pieces.len()];
            here.iter().zip(&least).for_each(|(&p, &l)| of_piece[p] = of_piece[p].min(l));
            let mut next: Vec<f64> = here.iter().map(|&piece| of_piece[piece]).collect();
            partition.update(&mut next, 1)?;
            let changed = comm.any(next != least);
            least = next;
            if !changed {
                break;
            }
        }
        let first: Vec<f64> =
            (0..owned).filter(|&node| least[node] == own(node)).map(own).collect();
        let mut first = comm.gather(&first);
        first.sort_by(f64::total_cmp);
        let number = |node: usize| first.partition_point(|&other| other < least[node]);
        let nodes = (0..owned).map(|node| (body.vertices.weights[node], number(node))).collect();
        let mut pieces = Self { comm, nodes, areas: vec![1.0; first.len()] };
        pieces.areas = pieces.means(&vec![1.0; owned], |area, _| area);
        Ok(pieces)
    }

    /// Per piece Σ `term`(area of the node, value) over its nodes, over its area. Collective.
    pub(super) fn means(&self, values: &[f64], term: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.areas.len()];
        for (&(area, piece), &value) in self.nodes.iter().zip(values) {
            sums[piece] += term(area, value);
        }
        self.comm.sum(&mut sums);
        sums.iter().zip(&self.areas).map(|(sum, area)| sum / area).collect()
    }

    /// Adds `term`(area of the node, the number of its piece) to each of `values`.
    pub(super) fn add(&self, values: &mut [f64], term: impl Fn(f64, usize) -> f64) {
        let nodes = values.iter_mut().zip(&self.nodes);
        nodes.for_each(|(value, &(area, piece))| *value += term(area, piece));
    }
}
