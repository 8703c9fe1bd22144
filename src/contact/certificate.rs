//! Certifies an answer in global coordinates, by the conditions of the scene.
//!
//! This code uses no nodal basis, no bound on an unknown and no mask of prescribed unknowns of the solvers. A fault in any of these
//! makes u wrong, and the certificate shows it. The forces f − Ku come in from [`Elasticity`](crate::fem::Elasticity), whose comment
//! says what solvers share with it.

use super::{Kkt, NodalConstraint, Scales};
use crate::{ROUNDING, fem::Subdomain, maximum, petsc::Communicator};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The conditions at the nodes that this rank owns.
#[derive(Debug, Clone)]
pub struct Certificate {
    nodes: Vec<Conditions>,
    /// Conditions of the whole body.
    count: usize,
}

/// The conditions at a node.
#[derive(Debug, Clone, Default)]
struct Conditions {
    node: usize,
    /// Directions d in which u·d is prescribed, and the numbers of these rows.
    fixed: Vec<(Vector2<f64>, usize)>,
    /// The gap conditions and the numbers of these rows.
    gaps: Vec<(NodalConstraint, usize)>,
}

/// A gap condition at a node, with its gap and reaction.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ContactPoint {
    /// The node.
    pub node: usize,
    /// ν, towards the obstacle.
    pub normal: [f64; 2],
    /// Normal reaction p, N per metre of thickness; positive in compression.
    pub force: f64,
    /// The reaction over the node's tributary length, Pa. It is 0 at an inactive node, where p is rounding.
    pub pressure: f64,
    /// The remaining gap g − u·ν, m.
    pub gap: f64,
    /// Is the node active, p/F > (g − u·ν)/U?
    pub active: bool,
}

/// An answer: u = `rigid` + `elastic` at each node.
#[derive(Debug, Clone, Copy)]
pub struct Answer<'a> {
    /// A rigid motion of the body, m; empty if it is zero.
    pub rigid: &'a [f64],
    /// The rest of u, which causes the forces, m.
    pub elastic: &'a [f64],
    /// f − Ku, N per metre of thickness: the forces that supports and obstacles must balance.
    pub unbalanced: &'a [f64],
    /// The values of all rows at this time, m.
    pub values: &'a [f64],
}

/// A normal lies in the span of the prescribed directions if its part outside is below this.
const IN_SPAN: f64 = 1e-6;

impl Certificate {
    /// The certificate of the undivided body, from its rows.
    pub fn new(rows: &[NodalConstraint]) -> Self {
        let mut nodes = BTreeMap::<usize, Conditions>::new();
        for (number, row) in rows.iter().enumerate() {
            let at = nodes.entry(row.node).or_default();
            match row.is_gap() {
                true => at.gaps.push((*row, number)),
                false => at.fixed.push((row.direction.into(), number)),
            }
        }
        let nodes = nodes.into_iter().map(|(node, at)| Conditions { node, ..at }).collect();
        Self { nodes, count: rows.len() }
    }

    /// The conditions at the nodes that a rank owns.
    pub fn restrict(&self, subdomain: &Subdomain) -> Self {
        let local = |at: &Conditions| {
            let node = subdomain.owned(at.node)?;
            let gaps =
                at.gaps.iter().map(|&(gap, number)| (NodalConstraint { node, ..gap }, number));
            let gaps = gaps.collect();
            Some(Conditions { node, gaps, fixed: at.fixed.clone() })
        };
        let mut nodes: Vec<_> = self.nodes.iter().filter_map(local).collect();
        nodes.sort_by_key(|at| at.node);
        Self { nodes, count: self.count }
    }

    /// The residuals of an answer at the nodes `0..owned`, its gap conditions, and those at nodes whose normal displacement is
    /// prescribed, without forces. Collective.
    ///
    /// Reactions balance f − Ku at a node: those of prescribed directions its part along them, and those of gap
    /// conditions the part in the cone Σ p ν, p ≥ 0, of their normals. If the normals span the rest of the plane, the
    /// remainder counts as tension (dual). Otherwise its normal part is tension, and its tangential part is unbalanced.
    /// The residuals are NaN if a condition belongs to no rank.
    pub fn residuals(
        &self,
        answer: Answer,
        owned: usize,
        scales: Scales,
        comm: Communicator,
    ) -> (Kkt, [Vec<ContactPoint>; 2]) {
        let mut points = [Vec::new(), Vec::new()];
        let (mut stationarity, mut tangential, mut dual) = (0.0, 0.0, 0.0);
        let (mut primal, mut complementarity) = (0.0_f64, 0.0_f64);
        // Σ |f − Ku|² over nodes without conditions.
        let free = |from: usize, to: usize| {
            answer.unbalanced[2 * from..2 * to].iter().map(|f| f * f).sum::<f64>()
        };
        let mut next = 0;
        for at in &self.nodes {
            stationarity += free(next, at.node);
            next = at.node + 1;
            primal = maximum(primal, at.prescribed_error(answer, scales));
            let left = at.gaps_left(answer);
            let reaction = at.react(vector(answer.unbalanced, at.node), &left);
            dual += reaction.tension;
            tangential += reaction.tangential;
            for (((gap, number), left), force) in at.gaps.iter().zip(&left).zip(reaction.forces) {
                let width = answer.values[*number].abs();
                let is_prescribed = force.is_none();
                // NaN is neither shallow nor open.
                let is_shallow = is_prescribed && -left <= ROUNDING * width;
                let depth = if is_shallow || *left >= 0.0 { 0.0 } else { -left };
                primal = maximum(primal, scales.of_displacement(depth));
                let force = force.unwrap_or(0.0);
                if !is_prescribed {
                    complementarity = maximum(complementarity, scales.natural(force, *left));
                }
                let active = force > 0.0 && force * scales.displacement > left * scales.force;
                points[usize::from(is_prescribed)].push(ContactPoint {
                    node: at.node,
                    normal: gap.direction,
                    force,
                    pressure: gap.law.resists().filter(|_| active).map_or(0.0, |l| force / l),
                    gap: *left,
                    active,
                });
            }
        }
        stationarity += free(next, owned) + tangential;
        let checked: usize = self.nodes.iter().map(|at| at.fixed.len() + at.gaps.len()).sum();
        let mut sums = [stationarity, dual, checked as f64];
        comm.sum(&mut sums);
        if sums[2] as usize != self.count {
            return (Kkt::UNKNOWN, points);
        }
        let kkt = Kkt {
            stationarity: scales.of_force(sums[0].sqrt()),
            primal: comm.max(primal),
            dual: scales.of_force(sums[1].sqrt()),
            complementarity: comm.max(complementarity),
        };
        (kkt, points)
    }
}

/// The reactions of a node that balance f − Ku.
struct NodalReaction {
    /// p of each gap condition; `None` where the normal displacement is prescribed.
    forces: Vec<Option<f64>>,
    /// The square of the part that pulls along the normals, which no contact force balances.
    tension: f64,
    /// The square of the unbalanced part across the normals.
    tangential: f64,
}

impl Conditions {
    /// The largest |ū − u·d|/U of the node's prescribed rows u·d = ū. With the rigid part r and the elastic
    /// part e of u the difference is (ū − r·d) − e·d. Both ū and r·d may be much larger than U; a difference
    /// within their rounding counts as zero.
    fn prescribed_error(&self, answer: Answer, scales: Scales) -> f64 {
        let error = |(direction, row): &(Vector2<f64>, usize)| {
            let value = answer.values[*row];
            let rigid = direction.dot(&self.rigid(answer));
            let off = (value - rigid) - direction.dot(&vector(answer.elastic, self.node));
            let rounding = ROUNDING * value.abs().max(rigid.abs());
            scales.of_displacement(if off.abs() <= rounding { 0.0 } else { off.abs() })
        };
        self.fixed.iter().map(error).fold(0.0, maximum)
    }

    fn rigid(&self, answer: Answer) -> Vector2<f64> {
        match answer.rigid {
            [] => Vector2::zeros(),
            rigid => vector(rigid, self.node),
        }
    }

    /// g − u·ν of each gap condition. The rigid part is subtracted first: it is as large as a large gap.
    fn gaps_left(&self, answer: Answer) -> Vec<f64> {
        let (rigid, elastic) = (self.rigid(answer), vector(answer.elastic, self.node));
        let left = |(gap, number): &(NodalConstraint, usize)| {
            let normal = Vector2::from(gap.direction);
            (answer.values[*number] - normal.dot(&rigid)) - normal.dot(&elastic)
        };
        self.gaps.iter().map(left).collect()
    }

    /// The reactions of the conditions, whose gaps have `left`, to `force`.
    fn react(&self, force: Vector2<f64>, left: &[f64]) -> NodalReaction {
        // Reactions of prescribed directions balance all forces along them.
        let free: Vec<Vector2<f64>> = match self.fixed.split_first() {
            None => vec![Vector2::x(), Vector2::y()],
            Some(((d, _), others)) if others.iter().all(|(e, _)| d.perp(e).abs() <= IN_SPAN) => {
                vec![Vector2::new(-d.y, d.x)]
            }
            Some(_) => vec![],
        };
        let project = |v: Vector2<f64>| free.iter().map(|t| t * t.dot(&v)).sum::<Vector2<f64>>();
        let force = project(force);
        let normals: Vec<_> =
            self.gaps.iter().map(|(gap, _)| project(gap.direction.into())).collect();
        let bears = |i: &usize| normals[*i].norm() > IN_SPAN;
        let bearing: Vec<usize> = (0..normals.len()).filter(bears).collect();
        let (multipliers, rest) = cone(force, &normals, &bearing, left);
        let forces = (0..normals.len()).map(|i| bears(&i).then_some(multipliers[i])).collect();
        let along = match bearing[..] {
            [] => Vector2::zeros(),
            [first, ..] => {
                let n = normals[first].normalize();
                match bearing.iter().all(|&i| n.perp(&normals[i]).abs() <= IN_SPAN) {
                    true => n * n.dot(&rest),
                    false => rest,
                }
            }
        };
        NodalReaction {
            forces,
            tension: along.norm_squared(),
            tangential: (rest - along).norm_squared(),
        }
    }
}

/// Multipliers p ≥ 0 of the `bearing` normals such that Σ p ν is nearest to `force`, and the remainder. A
/// vector in the plane lies in the cone of at most two normals. Of several such pairs the function takes the
/// one with the smallest remaining gaps, `left`.
fn cone(
    force: Vector2<f64>,
    normals: &[Vector2<f64>],
    bearing: &[usize],
    left: &[f64],
) -> (Vec<f64>, Vector2<f64>) {
    let mut best = (vec![0.0; normals.len()], force, 0.0);
    let rounding = ROUNDING * force.norm();
    let mut offer = |multipliers: &[(usize, f64)]| {
        let carried: Vector2<f64> = multipliers.iter().map(|&(i, p)| normals[i] * p).sum();
        let rest = force - carried;
        let work: f64 = multipliers.iter().map(|&(i, p)| p * left[i].abs()).sum();
        let gain = best.1.norm() - rest.norm();
        if gain > rounding || (gain > -rounding && work < best.2) {
            let mut all = vec![0.0; normals.len()];
            multipliers.iter().for_each(|&(i, p)| all[i] = p);
            best = (all, rest, work);
        }
    };
    for (index, &i) in bearing.iter().enumerate() {
        offer(&[(i, (normals[i].dot(&force) / normals[i].norm_squared()).max(0.0))]);
        for &j in &bearing[..index] {
            let area = normals[i].perp(&normals[j]);
            let (p, q) = (force.perp(&normals[j]) / area, normals[i].perp(&force) / area);
            if p > 0.0 && q > 0.0 {
                offer(&[(i, p), (j, q)]);
            }
        }
    }
    (best.0, best.1)
}

fn vector(field: &[f64], node: usize) -> Vector2<f64> {
    Vector2::new(field[2 * node], field[2 * node + 1])
}
