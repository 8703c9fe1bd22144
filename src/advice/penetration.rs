//! Penetration: u·ν ≤ g holds at the nodes of Γ_C. Between them the body may penetrate the foundation by
//!
//! p(s) = (u·ν)(s) − g(x(s), t), 0 < s < 1,
//!
//! if the gap is narrower or more curved than an edge can resolve.

use crate::{
    fem::{Edge, parabola},
    mesh::{bounds, sorted},
    observe::{ObservedProblem, rows_of},
    problem::{NOTED, State},
    scene::Gap,
};

/// The error of penetrations, as a fraction of the maximum displacement …
const RESOLVED: f64 = 1e-3;
/// … except at peaks of the foundation that are narrower than this fraction of an edge.
const NARROWEST: f64 = 1e-5;

/// The penetration of the foundation between the nodes of an edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Penetration {
    /// The triangle of the edge, in the undivided mesh.
    pub(crate) triangle: usize,
    /// The maximum p(s) of the edge, m.
    pub(crate) depth: f64,
    /// Where it is, m.
    at: [f64; 2],
    /// The number of the boundary in the scene.
    boundary: usize,
}

impl ObservedProblem {
    /// The penetrations of the foundation between the nodes of Γ_C, in a state. Collective.
    pub(crate) fn penetrations(&self, state: &State) -> Vec<Penetration> {
        let (body, node, mut own) = (&self.body, self.body.node_of_vertex(), Vec::new());
        let displacement = self.body.nodes.partition.max_norm(&state.u);
        let boundaries = self.scene().boundaries.iter().enumerate();
        for (number, boundary) in boundaries {
            let Some(gap) = boundary.gap() else { continue };
            let edges = body.mesh.edges_of(&boundary.name);
            let triangles = body.mesh.triangles_at(edges);
            for edge in edges {
                let (t, side) = triangles[&sorted(*edge)];
                let middle = body.quadratic_nodes().map(|nodes| nodes[t][3 + side]);
                let edge = Edge { ends: edge.map(|vertex| node[vertex]), middle };
                let (depth, [x, y]) = self.deepest(gap, &edge, state, displacement);
                if depth > 0.0 {
                    let triangle = body.global_triangles[t];
                    own.push([triangle as f64, depth, x, y, number as f64]);
                }
            }
        }
        let all = self.body.comm().gather(own.as_flattened());
        let penetration = |&[triangle, depth, x, y, boundary]: &[f64; 5]| Penetration {
            triangle: triangle as usize,
            depth,
            at: [x, y],
            boundary: boundary as usize,
        };
        all.as_chunks().0.iter().map(penetration).collect()
    }

    /// The maximum penetration between the nodes of an edge and its place, m, to [`RESOLVED`] of the
    /// `displacement`. It is measured from the line between the penetrations at the ends. These need not be zero,
    /// because the normal at a node is the mean of the normals of two edges.
    ///
    /// Branch and bound: a part of the edge is halved while max u·ν − min g there may exceed the depth found so
    /// far; see [`Expression::range`](crate::scene::Expression::range).
    fn deepest(&self, gap: &Gap, edge: &Edge, state: &State, displacement: f64) -> (f64, [f64; 2]) {
        let (points, t) = (&self.body.nodes.points, state.time);
        let u = |node: usize| [state.u[2 * node], state.u[2 * node + 1]];
        let [p, q] = edge.ends.map(u);
        let middle = edge.middle.map_or([0, 1].map(|k| 0.5 * (p[k] + q[k])), u);
        let normal_displacement = |s: f64| {
            let normal = gap.normal.unwrap_or_else(|| {
                let [tx, ty] = edge.tangent(points, s);
                let length = tx.hypot(ty);
                [ty / length, -tx / length]
            });
            let u = parabola([p, middle, q], s);
            u[0] * normal[0] + u[1] * normal[1]
        };
        let depth = |s: f64| {
            let [x, y] = edge.at(points, s);
            normal_displacement(s) - gap.distance.eval(x, y, t)
        };
        let [first, last] = [0.0, 1.0].map(|s| depth(s).max(0.0));
        let beyond = |s: f64| depth(s) - (first + s * (last - first));
        let mut deepest = (0.0, 0.0);
        let mut parts = vec![[0.0, 1.0]];
        while let Some([from, to]) = parts.pop() {
            let half = 0.5 * (from + to);
            if beyond(half) > deepest.0 {
                deepest = (beyond(half), half);
            }
            let along = [from, half, to];
            let [a, m, b] = along.map(normal_displacement);
            let max = a.max(m).max(b) + 0.25 * (a - 2.0 * m + b).abs();
            let [x, y] = bounds(&along.map(|s| edge.at(points, s)));
            let [min, _] = gap.distance.range([x, y, [t; 2]]);
            let hidden = max - min - deepest.0 > RESOLVED * displacement;
            if hidden && to - from > NARROWEST {
                parts.extend([[from, half], [half, to]]);
            }
        }
        (deepest.0, edge.at(points, deepest.1))
    }

    /// A note on contact between the nodes in some states of a run: if there is much, or if no node of the foundation
    /// touches. Collective.
    pub(crate) fn penetration_note(&self, states: &[&State]) -> Option<String> {
        if !self.has_contact() {
            return None;
        }
        let (mut all, mut displacement) = (Vec::new(), 0.0_f64);
        for state in states {
            let (rows, _) = self.supports.contact.rows(&self.body, state);
            let limit = |of: &Penetration| {
                let rows = rows_of(&rows, &self.scene().boundaries[of.boundary].name);
                if rows.iter().any(|row| row.active == 1) { NOTED } else { RESOLVED }
            };
            all.extend(self.penetrations(state).into_iter().map(|of| (of.depth / limit(&of), of)));
            displacement = displacement.max(self.body.nodes.partition.max_norm(&state.u));
        }
        let (noted_below, deepest) = all.into_iter().max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let Penetration { depth, at, boundary, .. } = deepest;
        (noted_below > displacement).then(|| {
            format!(
                "between its nodes, boundary \"{}\" enters the foundation by {depth:.1e} at {}, {:.2} % of the largest \
                 displacement, so that displacements and forces may be far off; refine the mesh there, or set accuracy \
                 (explain penetration)",
                self.scene().boundaries[boundary].name,
                self.mesh().place(at),
                100.0 * depth / displacement
            )
        })
    }
}
