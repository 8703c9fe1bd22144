//! The rigid motions that prescribed displacements allow: the null space of K. Contact constrains some of them.

mod least;
mod load;
mod nonnegative;
mod until_contact;

pub(crate) use least::least_motion;
pub use load::DrivenMotion;
pub use nonnegative::nonnegative;
pub(crate) use until_contact::{rigid_motion_until_contact, unconstrained_motions};

use super::{Bound, Constraints, NodalConstraint};
use crate::fem::{Body, RigidMotion, resultant};
use nalgebra::{DMatrix, DVector};

/// The rigid motions that prescribed displacements allow, orthonormal with respect to ∫u·v/|Ω|.
#[derive(Debug, Clone)]
pub struct RigidMotions {
    /// Free motions: contact constrains them in neither sense.
    pub free: Vec<RigidMotion>,
    /// Per free motion: the largest |u·ν| at axes and gaps, which is the uncertainty of the motion.
    free_errors: Vec<f64>,
    /// Resisted motions: contact resists them in one sense.
    pub resisted: Vec<RigidMotion>,
    /// u·ν of the resisted motions, one row per gap condition of the undivided body.
    normal: DMatrix<f64>,
}

/// Relative squares of motions below this count as zero, that is motions below 3e-5. They lie between the
/// accuracy of gmsh's circles, 1e-8, and a motion that one node in a thousand stops, 1e-3.
const UNRESISTED: f64 = 1e-9;
/// Relative squares of motions above this are prevented. Below it they are rounding of the Gram matrix and
/// its eigenvalues. A clamp of 1e-6 of the body's length prevents its rotation.
const PREVENTED: f64 = 1e-14;

impl RigidMotions {
    /// From the rows of a body, with joined gap conditions. `normal_errors` bounds the angle between the
    /// normals of mesh and geometry at each node, rad. A motion u along a curved boundary is free although
    /// |u·ν| may be this angle times |u|.
    ///
    /// Prescribed displacements are rows r·v = 0 for the coordinates v of a motion
    /// ([`RigidMotion::new`]). They allow the null space of Σ r rᵀ. The free motions in it are also in the null space of u·ν at the
    /// gap conditions.
    pub fn new(body: &Body, rows: &[NodalConstraint], normal_errors: &[f64]) -> Self {
        let points = &body.nodes.points;
        let ([cx, cy], radius) = (body.centroid, body.radius_of_gyration());
        let mut gram = DMatrix::zeros(3, 3);
        let of = |row: &NodalConstraint| (row.node, row.direction);
        let axes: Vec<_> = rows.iter().filter(|row| !row.is_gap()).map(of).collect();
        let normals: Vec<_> = rows.iter().filter(|row| row.is_gap()).map(of).collect();
        for &(node, d) in &axes {
            let [x, y] = points[node];
            let turn = ((x - cx) * d[1] - (y - cy) * d[0]) / radius;
            // An axis is exact, the normal of a polygon is not.
            let uncertain = UNRESISTED + normal_errors[node].powi(2);
            let weight = if d.contains(&0.0) { 1.0 } else { (PREVENTED / uncertain).sqrt() };
            let row = DVector::from_row_slice(&[d[0], d[1], turn]) * weight;
            gram.ger(1.0, &row, &row, 1.0);
        }
        let basis = null_space(gram, PREVENTED * axes.len() as f64);
        if basis.is_empty() {
            let (free, free_errors, resisted) = Default::default();
            return Self { free, free_errors, resisted, normal: DMatrix::zeros(normals.len(), 0) };
        }
        let motion = |v: &DVector<f64>| RigidMotion::new(body, [v[0], v[1], v[2]]);
        let left: Vec<_> = basis.iter().map(motion).collect();
        let contact = normal_displacements(points, &left, &normals);
        let eigen = (contact.transpose() * &contact).symmetric_eigen();
        let (mut free, mut resisted) = (Vec::new(), Vec::new());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let v: DVector<f64> = basis.iter().zip(vector.iter()).map(|(m, c)| m * *c).sum();
            let motion = motion(&v);
            let tangential = |&(node, [nx, ny]): &(usize, [f64; 2])| {
                let [x, y] = motion.at(points[node]);
                (x * nx + y * ny).abs() <= UNRESISTED.sqrt() + normal_errors[node] * x.hypot(y)
            };
            match *value > UNRESISTED * normals.len() as f64 && !normals.iter().all(tangential) {
                true => resisted.push(motion),
                false => free.push(motion),
            }
        }
        let conditions: Vec<_> = normals.iter().copied().chain(axes).collect();
        let errors = normal_displacements(points, &free, &conditions);
        let free_errors = errors.column_iter().map(|column| column.amax()).collect();
        let normal = normal_displacements(points, &resisted, &normals);
        Self { free, free_errors, resisted, normal }
    }

    /// The null space of the present K with pinned free motions: as no law of a gap has a stiffness, all resisted motions.
    pub fn null_space(&self) -> &[RigidMotion] {
        &self.resisted
    }

    /// Are all rigid motions prevented? K is then positive definite.
    pub fn all_prevented(&self) -> bool {
        self.free.is_empty() && self.resisted.is_empty()
    }

    /// Σ a_i m_i of the motions m_i that contact alone constrains, with these amplitudes a.
    pub fn combined(&self, body: &Body, amplitudes: &DVector<f64>) -> RigidMotion {
        let motions = self.resisted.iter().copied();
        RigidMotion::combination(body, amplitudes.iter().copied().zip(motions))
    }

    /// u·ν at `bounds` (rows) of the null space of K (columns).
    pub fn normal_at(&self, body: &Body, bounds: &[Bound]) -> DMatrix<f64> {
        let normals: Vec<_> = bounds.iter().map(|bound| (bound.node, bound.normal)).collect();
        normal_displacements(&body.nodes.points, self.null_space(), &normals)
    }

    /// ∫u·m/|Ω| of each motion m that contact alone constrains. Collective.
    pub fn amplitudes(&self, body: &Body, u: &[f64]) -> DVector<f64> {
        let weights = &body.nodes.weights;
        self.work(body, |i| [u[2 * i], u[2 * i + 1]].map(|u| weights[i] * u)) / body.area
    }

    /// ν at a node without its component along a free motion u, if u·ν is within rounding or the `error` of
    /// ν, rad. The motion then changes neither contact nor symmetry conditions.
    pub fn tangential(&self, body: &Body, node: usize, normal: [f64; 2], error: f64) -> [f64; 2] {
        self.free.iter().fold(normal, |[nx, ny], motion| {
            let [x, y] = motion.at(body.nodes.points[node]);
            let (along, speed) = (x * nx + y * ny, x.hypot(y));
            if along.abs() <= 1e-14 || along.abs() > UNRESISTED.sqrt() + error * speed {
                return [nx, ny];
            }
            let [nx, ny] = [nx - along / speed * (x / speed), ny - along / speed * (y / speed)];
            let length = nx.hypot(ny);
            [nx / length, ny / length]
        })
    }

    /// Pins one unknown for each free motion. A balanced load causes no force in the pins, so the solution is
    /// exact up to the motion, which [`Self::remove_free`] removes.
    pub fn pin_free(&self, body: &Body, constraints: &mut Constraints) {
        let mut fields: Vec<Vec<f64>> = self.free.iter().map(|m| m.field(body)).collect();
        fields.iter_mut().for_each(|f| constraints.bases.displacement_to_local(f));
        // Gaussian elimination on the motions, the largest remaining entry as pivot.
        while let Some(pivot_field) = fields.pop() {
            let fixed = constraints.bases.fixed();
            let largest = (0..pivot_field.len())
                .filter(|&dof| !fixed[dof])
                .max_by(|&a, &b| pivot_field[a].abs().total_cmp(&pivot_field[b].abs()));
            let Some(dof) = largest else { return };
            for field in &mut fields {
                let factor = field[dof] / pivot_field[dof];
                field.iter_mut().zip(&pivot_field).for_each(|(v, p)| *v -= factor * p);
            }
            constraints.bases.fix(dof);
        }
    }

    /// Removes the free motions from u: the answer with the minimum ∫|u|².
    pub fn remove_free(&self, body: &Body, u: &mut [f64]) {
        if !self.free.is_empty() {
            let weights = &body.nodes.weights;
            let removed =
                self.projection(body, |i| [u[2 * i], u[2 * i + 1]].map(|u| weights[i] * u));
            u.iter_mut().zip(removed.field(body)).for_each(|(u, m)| *u -= m);
        }
    }

    /// `load` (nodal forces, N) minus the body force that does the same work on free motions. If
    /// [`Self::check`] accepts the load, this work is the error of its integration; without it the pins carry no force.
    pub fn balanced(&self, body: &Body, mut load: Vec<f64>) -> Vec<f64> {
        if !self.free.is_empty() {
            let balance = self.projection(body, |i| [load[2 * i], load[2 * i + 1]]).field(body);
            let areas = body.nodes.weights.iter().flat_map(|area| [area; 2]);
            load.iter_mut().zip(balance).zip(areas).for_each(|((f, m), area)| *f -= area * m);
        }
        load
    }

    /// The combination m of free motions with ∫m·v = f·v for all free motions v: they are orthonormal, so
    /// m = Σ (f·v/|Ω|) v. Collective.
    fn projection(&self, body: &Body, force: impl Fn(usize) -> [f64; 2]) -> RigidMotion {
        let sums = resultant(body, force);
        let term = |motion: &RigidMotion| (motion.work(sums) / body.area, *motion);
        RigidMotion::combination(body, self.free.iter().map(term))
    }
}

/// u·ν at nodes with these normals (rows) of `motions` (columns).
fn normal_displacements(
    points: &[[f64; 2]],
    motions: &[RigidMotion],
    normals: &[(usize, [f64; 2])],
) -> DMatrix<f64> {
    DMatrix::from_fn(normals.len(), motions.len(), |i, j| {
        let (node, [nx, ny]) = normals[i];
        let [x, y] = motions[j].at(points[node]);
        x * nx + y * ny
    })
}

/// An orthonormal basis of the eigenvectors of a Gram matrix with eigenvalues up to `cut`.
fn null_space(gram: DMatrix<f64>, cut: f64) -> Vec<DVector<f64>> {
    let eigen = gram.symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value <= cut).map(|(_, v)| v.into_owned()).collect()
}
