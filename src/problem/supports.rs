//! The boundaries that support the body and the forces they exert.

use super::{ContactLine, boundary_conditions::BoundaryConditions};
use crate::{
    contact::ContactPoint,
    fem::{Body, Subdomain},
    mesh::Lines,
    scene::{Boundary, Scene},
};
use std::collections::BTreeMap;

/// The boundaries with prescribed displacements or a gap, and the nodes of this rank on them.
#[derive(Debug, Clone, Default)]
pub struct Supports {
    /// Their names, in the order of the scene.
    pub names: Vec<String>,
    /// Per node with a prescribed displacement: its prescribed directions.
    prescribed: BTreeMap<usize, Vec<Prescribed>>,
    /// Γ_C.
    pub contact: ContactLine,
}

/// A force on the body, or a direction in which its displacement is prescribed, with the number of the boundary.
type Prescribed = (usize, [f64; 2]);

impl Supports {
    /// The supports of `scene` on the undivided `body`, with its `conditions` and the lines of its boundary.
    pub(super) fn new(
        scene: &Scene,
        body: &Body,
        conditions: &BoundaryConditions,
        lines: &Lines,
    ) -> Self {
        let mut supports = Self { names: conditions.supports.clone(), ..Self::default() };
        for (row, boundary) in conditions.rows.iter().zip(&conditions.prescribed_by) {
            supports.prescribed.entry(row.node).or_default().push((*boundary, row.direction));
        }
        let contact = scene.boundaries.iter().filter_map(|boundary @ Boundary { name, .. }| {
            let number = supports.names.iter().position(|other| other == name)?;
            let edges = body.edges(&body.mesh.curves.get(name)?.edges);
            Some((number, &**name, boundary.gap()?, edges))
        });
        supports.contact = ContactLine::new(contact, &body.nodes.points, lines);
        supports
    }

    pub(super) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let own = |node: &usize| subdomain.owned(*node);
        let prescribed = self.prescribed.iter();
        Self {
            names: self.names.clone(),
            prescribed: prescribed.filter_map(|(n, of)| Some((own(n)?, of.clone()))).collect(),
            contact: self.contact.restrict(own),
        }
    }

    /// Per boundary: (F_x, F_y, M), this rank's part, with F = Σ R_i, N per metre of thickness, and M = Σ x_i × R_i
    /// about the origin, positive anticlockwise, N.
    ///
    /// R_i = (Ku − f)_i is the force on the body at node i; `unbalanced` is f − Ku. At a prescribed node with a
    /// closed gap, the obstacle exerts the normal reaction and the other boundaries exert the rest.
    pub(super) fn resultants(
        &self,
        body: &Body,
        unbalanced: &[f64],
        (contact, t): (&[ContactPoint], f64),
    ) -> Vec<f64> {
        let mut sums = vec![0.0; 3 * self.names.len()];
        let mut add = |boundary: usize, node: usize, [fx, fy]: [f64; 2]| {
            let [x, y] = body.nodes.points[node];
            for (sum, part) in sums[3 * boundary..].iter_mut().zip([fx, fy, x * fy - y * fx]) {
                *sum += part;
            }
        };
        let mut rest: BTreeMap<usize, [f64; 2]> = (self.prescribed.keys())
            .map(|&node| (node, [-unbalanced[2 * node], -unbalanced[2 * node + 1]]))
            .collect();
        for point in contact {
            let force = point.normal.map(|n| -point.force * n);
            for share in self.contact.shares(point, t) {
                let boundary = self.contact.stations[share.station].boundary;
                add(boundary, point.node, force.map(|f| share.force * f));
            }
            if let Some([x, y]) = rest.get_mut(&point.node) {
                (*x, *y) = (*x - force[0], *y - force[1]);
            }
        }
        for (node, force) in rest {
            let parts = parts(&self.prescribed[&node], force);
            parts.into_iter().for_each(|(boundary, part)| add(boundary, node, part));
        }
        sums
    }
}

/// Divides the force F at a node, N/m, between the boundaries that prescribe its displacement. If two directions d and
/// e are prescribed, their boundaries exert αd and βe with F = αd + βe; a boundary that prescribes both exerts F.
/// Otherwise one exerts F.
fn parts(prescribed: &[Prescribed], force: [f64; 2]) -> Vec<Prescribed> {
    /// Directions are parallel if the sine of the angle between them is at most this.
    const SINE: f64 = 1e-6;
    let cross = |[a, b]: [f64; 2], [c, d]: [f64; 2]| a * d - b * c;
    let pairs = prescribed.iter().flat_map(|a| prescribed.iter().map(move |b| (*a, *b)));
    let mut pairs = pairs.filter(|((_, d), (_, e))| cross(*d, *e).abs() > SINE);
    match pairs.clone().find(|(a, b)| a.0 == b.0).or_else(|| pairs.next()) {
        None => vec![(prescribed[0].0, force)],
        Some(((first, d), (other, e))) => {
            let (along_d, along_e) = (cross(force, e) / cross(d, e), cross(d, force) / cross(d, e));
            vec![(first, d.map(|d| along_d * d)), (other, e.map(|e| along_e * e))]
        }
    }
}
