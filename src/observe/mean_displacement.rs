//! The mean displacement of each boundary of the scene, and the travel of its foundation.

use super::ObservedProblem;
use crate::{
    fem::{Body, Subdomain},
    mesh::Lines,
    problem::State,
    scene::Scene,
};
use std::collections::BTreeMap;

/// Per boundary of the scene: its nodes on this rank, with their tributary lengths ∫φ_i, m.
#[derive(Debug)]
pub(super) struct Means(Vec<BTreeMap<usize, f64>>);

impl Means {
    pub(super) fn new(scene: &Scene, body: &Body, lines: &Lines) -> Self {
        let of_boundary = |name: &String| {
            let mut lengths = BTreeMap::new();
            for edge in body.edges(body.mesh.edges_of(name)) {
                for (node, face) in edge.faces(&body.nodes.points, lines) {
                    *lengths.entry(node).or_insert(0.0) += face.length;
                }
            }
            lengths
        };
        Self(scene.boundaries.iter().map(|of| of_boundary(&of.name)).collect())
    }

    pub(super) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let own = |(&node, &length): (&usize, &f64)| Some((subdomain.owned(node)?, length));
        Self(self.0.iter().map(|lengths| lengths.iter().filter_map(own).collect()).collect())
    }
}

impl ObservedProblem {
    /// Per boundary Γ with a table: ∫u/|Γ|, and ∫(g(x, 0) − g(x, t))/|Γ|, how far the foundation has moved towards the body; 0
    /// without one, m. Collective.
    pub(super) fn mean_displacements(&self, state: &State) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 4]; self.means.0.len()];
        for ((lengths, boundary), sums) in
            self.means.0.iter().zip(&self.scene().boundaries).zip(&mut sums)
        {
            let gap = boundary.gap().filter(|gap| gap.distance.depends_on_time());
            for (&node, length) in lengths {
                let [x, y] = self.body.nodes.points[node];
                let gap = |t: f64| gap.map_or(0.0, |gap| gap.distance.eval(x, y, t));
                let travel = gap(self.scene().start()) - gap(state.time);
                let values = [state.u[2 * node], state.u[2 * node + 1], travel, 1.0];
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += length * value);
            }
        }
        self.body.comm().sum(sums.as_flattened_mut());
        let mean = |[x, y, travel, length]: [f64; 4]| [x, y, travel].map(|sum| sum / length);
        sums.into_iter().map(mean).collect()
    }
}
