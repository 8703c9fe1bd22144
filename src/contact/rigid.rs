//! Rigid motions that nothing holds, that only contact holds, and whether the load drives them.

use super::{Bound, Constraints, GapRow, nonnegative::nonnegative};
use crate::fem::Body;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::fmt;

/// An infinitesimal rigid motion u(x) = a + θ e_z × (x − centre).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// a, m.
    pub translation: [f64; 2],
    /// θ, rad.
    pub rotation: f64,
    /// The point that only translates, m.
    pub centre: [f64; 2],
}

impl RigidMotion {
    /// The displacement at a point.
    pub fn at(&self, x: [f64; 2]) -> [f64; 2] {
        [
            self.translation[0] - self.rotation * (x[1] - self.centre[1]),
            self.translation[1] + self.rotation * (x[0] - self.centre[0]),
        ]
    }

    /// Its values at all nodes.
    fn field(&self, nodes: &[[f64; 2]]) -> Vec<f64> {
        nodes.iter().flat_map(|&x| self.at(x)).collect()
    }

    /// The work of nodal forces on it.
    fn work(&self, body: &Body, load: &[f64]) -> f64 {
        body.partition.dot(&self.field(&body.mesh.nodes), load, 2)
    }
}

impl fmt::Display for RigidMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [ax, ay] = self.translation;
        let size = ax.hypot(ay);
        if self.rotation == 0.0 {
            match (ax.abs() > 1e-6 * size, ay.abs() > 1e-6 * size) {
                (true, false) => write!(f, "the horizontal translation"),
                (false, _) => write!(f, "the vertical translation"),
                _ => write!(f, "the translation along ({:.3}, {:.3})", ax / size, ay / size),
            }
        } else {
            // Where the motion is at rest: a + θ e_z × (x − centre) = 0.
            let (dx, dy) = (-ay / self.rotation, ax / self.rotation);
            // Rounded before it is printed: no -0.0000.
            let [x, y] =
                [self.centre[0] + dx, self.centre[1] + dy].map(|v| (1e4 * v).round() / 1e4 + 0.0);
            write!(f, "the rotation about ({x:.4}, {y:.4})")
        }
    }
}

/// The load does work on a rigid motion that nothing holds.
#[derive(Debug, Clone, Copy, thiserror::Error)]
#[error(
    "nothing holds the body against {motion}, and the load drives it (resultant {force:.4e} N/m, \
     moment about the body's centre {moment:.4e} N): hold it by a `displacement`, a `symmetry` \
     axis or a `gap`, or balance the load"
)]
pub struct DrivenMotion {
    /// The motion.
    pub motion: RigidMotion,
    /// Size of the load's resultant, N per metre of thickness.
    pub force: f64,
    /// The load's moment about the centre, N m per metre of thickness.
    pub moment: f64,
}

/// The rigid motions that prescribed displacements leave free.
#[derive(Debug, Clone)]
pub struct RigidMotions {
    /// Held by nothing, not even contact in either sense; orthonormal with respect to ∫u·v.
    pub free: Vec<RigidMotion>,
    /// Directions of motion that contact resists in one sense.
    resisted: Vec<RigidMotion>,
    /// u·ν of `resisted` at the contact nodes, one row per gap condition.
    normal: DMatrix<f64>,
    centre: [f64; 2],
    /// Radius of gyration, m.
    radius: f64,
}

/// Motions are compared after scaling to unit size: below this they are zero.
const ROUNDING: f64 = 1e-9;

impl RigidMotions {
    /// From the fixed directions (node, d) and the gap conditions.
    pub fn new(body: &Body, fixed: &[(usize, [f64; 2])], gaps: &[GapRow]) -> Self {
        let nodes = &body.mesh.nodes;
        let area: f64 = body.node_area.iter().sum();
        let mean = |f: &dyn Fn(usize) -> f64| {
            (0..nodes.len()).map(|i| body.node_area[i] * f(i)).sum::<f64>() / area
        };
        let centre = [mean(&|i| nodes[i][0]), mean(&|i| nodes[i][1])];
        // Radius of gyration: a unit rotation then moves the body as far as a translation.
        let radius =
            mean(&|i| (nodes[i][0] - centre[0]).powi(2) + (nodes[i][1] - centre[1]).powi(2)).sqrt();
        let motion = |v: &Vector3<f64>| RigidMotion {
            translation: [v[0], v[1]],
            rotation: if v[2].abs() < ROUNDING { 0.0 } else { v[2] / radius },
            centre,
        };
        let row = |node: usize, d: [f64; 2]| {
            let [x, y] = nodes[node];
            Vector3::new(d[0], d[1], ((x - centre[0]) * d[1] - (y - centre[1]) * d[0]) / radius)
        };

        let gram = |rows: &mut dyn Iterator<Item = Vector3<f64>>| {
            rows.fold(Matrix3::zeros(), |sum, r| sum + r * r.transpose())
        };
        let unheld = null_space(&gram(&mut fixed.iter().map(|(node, d)| row(*node, *d))));
        if unheld.is_empty() {
            let normal = DMatrix::zeros(0, 0);
            return Self { free: vec![], resisted: vec![], normal, centre, radius };
        }
        let contact = DMatrix::from_row_iterator(
            gaps.len(),
            unheld.len(),
            gaps.iter().flat_map(|g| {
                let r = row(g.node, g.normal);
                unheld.iter().map(move |m| r.dot(m)).collect::<Vec<_>>()
            }),
        );
        let (mut free, mut resisted) = (Vec::new(), Vec::new());
        let eigen = (contact.transpose() * &contact).symmetric_eigen();
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let v: Vector3<f64> = unheld.iter().zip(vector.iter()).map(|(m, c)| m * *c).sum();
            match *value > ROUNDING * gaps.len() as f64 {
                true => resisted.push(motion(&v)),
                false => free.push(motion(&v)),
            }
        }
        let along = |m: &RigidMotion, g: &GapRow| {
            let u = m.at(nodes[g.node]);
            u[0] * g.normal[0] + u[1] * g.normal[1]
        };
        let normal =
            DMatrix::from_fn(gaps.len(), resisted.len(), |i, j| along(&resisted[j], &gaps[i]));
        Self { free, resisted, normal, centre, radius }
    }

    /// Whether prescribed displacements alone hold the body (K is then positive definite).
    pub fn held(&self) -> bool {
        self.free.is_empty() && self.resisted.is_empty()
    }

    /// Number of motions that contact alone holds: the dimension of K's null space.
    pub fn resisted(&self) -> usize {
        self.resisted.len()
    }

    /// u·ν at `bounds` (rows) of the motions that only contact holds (columns).
    pub fn normal_at(&self, body: &Body, bounds: &[Bound]) -> DMatrix<f64> {
        DMatrix::from_fn(bounds.len(), self.resisted.len(), |i, j| {
            let u = self.resisted[j].at(body.mesh.nodes[bounds[i].node]);
            u[0] * bounds[i].normal[0] + u[1] * bounds[i].normal[1]
        })
    }

    /// The work of `load` (nodal forces) on the motions that only contact holds.
    pub fn work(&self, body: &Body, load: &[f64]) -> DVector<f64> {
        let work = |i: usize, _| self.resisted[i].work(body, load);
        DVector::from_fn(self.resisted.len(), work)
    }

    /// Checks that `load` (nodal forces) does no work on free motions and can be balanced by
    /// contact forces p ≥ 0 on the resisted ones: the nearest such forces leave no remainder
    /// (Farkas; the remainder itself is the motion that the load drives).
    pub fn check(&self, body: &Body, load: &[f64]) -> Result<(), DrivenMotion> {
        if self.held() {
            return Ok(());
        }
        let ranks = body.partition.ranks();
        let owned = &load[..2 * body.partition.owned()];
        let size = ranks.total(owned.chunks(2).map(|f| f[0].hypot(f[1])).sum());
        let work = |m: &RigidMotion| m.work(body, load);
        let driven = |motion: RigidMotion| {
            let sum = |k: usize| ranks.total(owned.iter().skip(k).step_by(2).sum());
            let turn = RigidMotion { translation: [0.0, 0.0], rotation: 1.0, centre: self.centre };
            DrivenMotion { motion, force: sum(0).hypot(sum(1)), moment: work(&turn) }
        };
        if let Some(motion) = self.free.iter().find(|m| work(m).abs() > ROUNDING * size) {
            return Err(driven(*motion));
        }
        let work = self.work(body, load);
        let remainder = &work - self.normal.transpose() * nonnegative(&self.normal, &work);
        if remainder.norm() <= 1e-8 * size {
            return Ok(());
        }
        Err(driven(self.combined(&remainder.normalize())))
    }

    /// The motion whose shares (a unit vector) of those that only contact holds are given.
    pub fn combined(&self, shares: &DVector<f64>) -> RigidMotion {
        let mut motion = RigidMotion { translation: [0.0; 2], rotation: 0.0, centre: self.centre };
        for (m, c) in self.resisted.iter().zip(shares.iter()) {
            motion.translation[0] += c * m.translation[0];
            motion.translation[1] += c * m.translation[1];
            motion.rotation += c * m.rotation;
        }
        if (motion.rotation * self.radius).abs() < ROUNDING {
            motion.rotation = 0.0;
        }
        motion
    }

    /// Pins one unknown for each free motion. The load being balanced, the pins carry no
    /// force: any solution so found is exact up to the motion, which [`Self::remove_free`] takes out.
    pub fn pin_free(&self, body: &Body, constraints: &mut Constraints) {
        let mut fields: Vec<Vec<f64>> = self
            .free
            .iter()
            .map(|m| {
                let mut field = m.field(&body.mesh.nodes);
                constraints.frames.displacement_to_frame(&mut field);
                field
            })
            .collect();
        // Gaussian elimination on the motions, the largest remaining entry as pivot.
        while let Some(pivot_field) = fields.pop() {
            let fixed = constraints.frames.fixed();
            let largest = (0..pivot_field.len())
                .filter(|&dof| !fixed[dof])
                .max_by(|&a, &b| pivot_field[a].abs().total_cmp(&pivot_field[b].abs()));
            let Some(dof) = largest else { return };
            for field in &mut fields {
                let factor = field[dof] / pivot_field[dof];
                field.iter_mut().zip(&pivot_field).for_each(|(v, p)| *v -= factor * p);
            }
            constraints.frames.fix(dof);
        }
    }

    /// Removes the free motions from u: the answer of least ∫|u|².
    pub fn remove_free(&self, body: &Body, u: &mut [f64]) {
        for motion in &self.free {
            let field = motion.field(&body.mesh.nodes);
            let weighted: Vec<f64> =
                field.iter().enumerate().map(|(i, r)| body.node_area[i / 2] * r).collect();
            let dot = |v: &[f64]| body.partition.dot(&weighted, v, 2);
            let share = dot(u) / dot(&field);
            u.iter_mut().zip(&field).for_each(|(v, r)| *v -= share * r);
        }
    }
}

/// An orthonormal basis of the null space of a Gram matrix of unit-sized rows.
fn null_space(gram: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let eigen = gram.symmetric_eigen();
    let cut = ROUNDING * gram.trace().max(f64::MIN_POSITIVE);
    let vectors = eigen.eigenvectors.column_iter();
    eigen
        .eigenvalues
        .iter()
        .zip(vectors)
        .filter(|(v, _)| **v <= cut)
        .map(|(_, v)| v.into())
        .collect()
}
