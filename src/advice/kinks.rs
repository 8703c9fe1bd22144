//! Kinks of the gap in closed contact, which make the contact pressure infinite.
//!
//! Where the slope of the gap changes by Δ on a smooth boundary, the pressure is
//!
//! p = (E* ζ Δ/2π) ln(2a/r) + …,   E* = E in plane stress and E/(1 − ν²) in plane strain,
//!
//! at the distance r, with the half length a of contact (Johnson, Contact Mechanics, 5.2). This is the field of a wedge
//! disclination: two sliding sides that enclose the angle α of the body, and leave its corner with gaps of the slopes g₁ and g₂, turn
//! it by g₁ + g₂. So the factor is E* ζ (g₁ + g₂)/2α; smooth boundaries have α = π. A symmetric side has g = 0.
//!
//! A mesh shows the pressure at about r = h. Each bisection adds the factor times ln 2, so that all bisections down to the rounding r₀ of the
//! coordinates add the factor times ln(h/r₀).

use crate::{
    ROUNDING,
    mesh::{Lines, SAME_DIRECTION, distance, extent},
    observe::ContactRow,
    problem::{DiscreteProblem, State},
    scene::Condition,
};
use rustc_hash::FxHashMap as HashMap;
use std::f64::consts::TAU;

/// A kink of the gap in closed contact.
#[derive(Debug, Clone)]
pub(crate) struct Kink {
    /// The boundary, and the place, m.
    pub(crate) boundary: String,
    pub(crate) at: [f64; 2],
    /// The nodes of its edge, or its node, m.
    pub(crate) nodes: Vec<[f64; 2]>,
    /// (g₁ + g₂)/2α.
    change: f64,
    /// h, m.
    edge: f64,
    /// The pressure there that the mesh shows, Pa, and then what all further bisections would show.
    pub(crate) pressure: f64,
}

impl DiscreteProblem {
    /// The kinks of the gap in closed contact at which the pressure grows, by the `rows` of Γ_C in a `state`. Collective.
    pub(crate) fn kinks(&self, state: &State, rows: &[ContactRow]) -> Vec<Kink> {
        let mut pressed = HashMap::default();
        for row in rows.iter().filter(|row| row.active == 1) {
            let most = pressed.entry(bits([row.x, row.y])).or_insert(row.pressure);
            *most = row.pressure.max(*most);
        }
        let pressure = |node: usize| pressed.get(&bits(self.mesh().nodes[node])).copied();
        let time = state.time;
        let mut kinks = self.kinks_of_edges(time, pressure);
        kinks.extend(self.kinks_at_vertices(time, pressure));
        kinks.retain(|kink| kink.change > 0.0);
        let moduli = self.moduli_at(state, &kinks);
        let least = ROUNDING * extent(&self.mesh().nodes);
        for (kink, modulus) in kinks.iter_mut().zip(moduli) {
            kink.pressure += modulus * kink.change * (kink.edge / least).ln();
        }
        kinks
    }

    /// The kinks within edges that are closed at both ends, where nodes have a `pressure`.
    fn kinks_of_edges(&self, time: f64, pressure: impl Fn(usize) -> Option<f64>) -> Vec<Kink> {
        let mut kinks = Vec::new();
        for boundary in &self.scene().boundaries {
            let Some(gap) = boundary.gap() else { continue };
            for &[a, b] in self.mesh().edges_of(&boundary.name) {
                let Some((of_a, of_b)) = pressure(a).zip(pressure(b)) else { continue };
                let [p, q] = [a, b].map(|node| self.mesh().nodes[node]);
                let edge = distance(p, q);
                kinks.extend(gap.distance.kinks([p, q], time).into_iter().map(|(s, change)| {
                    Kink {
                        boundary: boundary.name.clone(),
                        at: [0, 1].map(|i| p[i] + s * (q[i] - p[i])),
                        nodes: vec![p, q],
                        change: change / edge / TAU,
                        edge,
                        pressure: (1.0 - s) * of_a + s * of_b,
                    }
                }));
            }
        }
        kinks
    }

    /// The kinks at closed vertices with two sliding sides.
    fn kinks_at_vertices(&self, time: f64, pressure: impl Fn(usize) -> Option<f64>) -> Vec<Kink> {
        let (mesh, supports) = (self.mesh(), self.supports_of_edges());
        let lines = Lines::boundary(mesh);
        let at_node = |(&node, ends): (&usize, &Vec<usize>)| {
            let (shown, &[p, q]) = (pressure(node)?, &ends[..]) else { return None };
            let at = mesh.nodes[node];
            // Per side: its boundary, if this is a foundation, the slope of its gap, and the direction in which it leaves the node.
            let side = |end: usize| {
                let (condition, boundary) =
                    [[node, end], [end, node]].iter().find_map(|edge| supports.get(edge))?;
                let [x, y] = lines.tangent(node, end);
                let (norm, edge) = (x.hypot(y), distance(at, mesh.nodes[end]));
                let along = [x, y].map(|x| edge * x / norm);
                match condition {
                    Condition::Gap(gap) => {
                        pressure(end)?;
                        let slope = |along| gap.distance.slope(at, along, time) / edge;
                        Some((Some(&boundary.name), slope(along), edge, along))
                    }
                    Condition::Symmetry => Some((None, 0.0, 0.0, along)),
                    Condition::Displacement(of) => {
                        // It is prescribed along the normal alone.
                        let slides =
                            |k: usize| of[k].is_none() == (along[k].abs() > SAME_DIRECTION * edge);
                        (slides(0) && slides(1)).then_some((None, 0.0, 0.0, along))
                    }
                    Condition::Load(_) => None,
                }
            };
            let [a, b] = [side(p)?, side(q)?];
            let turn = b.3[1].atan2(b.3[0]) - a.3[1].atan2(a.3[0]);
            // The body is on the left of the side that leaves the node.
            let leaves = supports.contains_key(&[node, p]);
            let angle = if leaves { turn } else { -turn }.rem_euclid(TAU);
            Some(Kink {
                boundary: a.0.or(b.0)?.clone(),
                at,
                nodes: vec![at],
                change: (a.1 + b.1) / (2.0 * angle),
                edge: a.2.max(b.2),
                pressure: shown,
            })
        };
        lines.ends.iter().filter_map(at_node).collect()
    }

    /// The largest E* ζ at the nodes of each kink, Pa. Collective.
    fn moduli_at(&self, state: &State, kinks: &[Kink]) -> Vec<f64> {
        let body = &self.body;
        let moduli = Vec::from_iter(self.scene().materials().map(|of| {
            let stiffness = of.stiffness();
            stiffness[(0, 0)] - stiffness[(0, 1)].powi(2) / stiffness[(0, 0)]
        }));
        let nodes = kinks.iter().flat_map(|kink| &kink.nodes);
        let mut largest = HashMap::from_iter(nodes.map(|at| (bits(*at), 0.0_f64)));
        for (t, triangle) in body.mesh.triangles.iter().enumerate() {
            for &node in triangle {
                let modulus = moduli[body.material(t)] * self.truncated(state.zeta[node]);
                let known = largest.entry(bits(body.mesh.nodes[node]));
                known.and_modify(|most| *most = most.max(modulus));
            }
        }
        let most =
            |kink: &Kink| kink.nodes.iter().map(|at| largest[&bits(*at)]).fold(0.0, f64::max);
        let own = Vec::from_iter(kinks.iter().map(most));
        let all = body.comm().gather(&own);
        let of_ranks =
            |i: usize| all.iter().skip(i).step_by(own.len()).copied().fold(0.0, f64::max);
        (0..own.len()).map(of_ranks).collect()
    }
}

/// A place as the key of a map.
fn bits(at: [f64; 2]) -> [u64; 2] {
    at.map(f64::to_bits)
}
