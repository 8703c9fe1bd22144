//! What becomes of the motions that nothing prevents and nothing drives.

use super::{RigidMotion, RigidMotions};
use crate::{contact::Constraints, fem::Body};
use nalgebra::DVector;

/// Exact normals turn by at most this (rad) to be tangential to free motions.
const TURN: f64 = 1e-3;

impl RigidMotions {
    /// ν at a node without its component along a free motion u where u·ν is so small that it is rounding
    /// or within the `error` of ν, rad: the motion then leaves contact and symmetry axes exactly as they are.
    pub fn tangential(&self, body: &Body, node: usize, normal: [f64; 2], error: f64) -> [f64; 2] {
        self.free.iter().fold(normal, |[nx, ny], motion| {
            let [x, y] = self.at(motion, &body.nodes.points, node);
            let (along, speed) = (x * nx + y * ny, x.hypot(y));
            if along.abs() <= 1e-14 || along.abs() > TURN.max(error) * speed {
                return [nx, ny];
            }
            let [nx, ny] = [nx - along / speed * (x / speed), ny - along / speed * (y / speed)];
            let length = nx.hypot(ny);
            [nx / length, ny / length]
        })
    }

    /// Pins one unknown for each free motion. The load being balanced, the pins carry no
    /// force: any solution so found is exact up to the motion, which [`Self::remove_free`] takes out.
    pub fn pin_free(&self, body: &Body, constraints: &mut Constraints) {
        let mut fields: Vec<Vec<f64>> = self.free.iter().map(|m| self.field(m, body)).collect();
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

    /// Removes the free motions from u: the answer of least ∫|u|².
    pub fn remove_free(&self, body: &Body, u: &mut [f64]) {
        if !self.free.is_empty() {
            let momentum = |i: usize| [u[2 * i], u[2 * i + 1]].map(|u| body.nodes.weights[i] * u);
            let removed = self.projection(body, momentum);
            u.iter_mut().zip(removed).for_each(|(u, m)| *u -= m);
        }
    }

    /// `load` (nodal forces, N) less the body force that does the same work on free motions. That
    /// work is rounding where [`Self::check`] accepts the load, and no pin then carries it.
    pub fn balanced(&self, body: &Body, mut load: Vec<f64>) -> Vec<f64> {
        if !self.free.is_empty() {
            let balance = self.projection(body, |i| [load[2 * i], load[2 * i + 1]]);
            let areas = body.nodes.weights.iter().flat_map(|area| [area; 2]);
            load.iter_mut().zip(balance).zip(areas).for_each(|((f, m), area)| *f -= area * m);
        }
        load
    }

    /// ∫u·m / ∫m·m of each motion m that contact alone constrains, and ∫m·m, m². Collective.
    pub fn amplitudes(&self, body: &Body, u: &[f64]) -> (DVector<f64>, DVector<f64>) {
        let momentum = |i: usize| [u[2 * i], u[2 * i + 1]].map(|u| body.nodes.weights[i] * u);
        let sums = self.resultants(body, momentum);
        let squares = self.resisted.iter().map(|motion| self.square(motion));
        let squares = DVector::from_iterator(self.resisted.len(), squares);
        let along = |j: usize, _| self.resisted[j].work(&sums) / squares[j];
        (DVector::from_fn(self.resisted.len(), along), squares)
    }

    /// ∫m·m, m².
    fn square(&self, motion: &RigidMotion) -> f64 {
        motion.parts.iter().map(|part| self.parts[part.part].area * part.mean_square()).sum()
    }

    /// The nodal displacements of the combination m of free motions with ∫m·v = f·v for all free
    /// motions v: they are orthogonal, so m = Σ (f·v/∫v·v) v. Collective.
    fn projection(&self, body: &Body, force: impl Fn(usize) -> [f64; 2]) -> Vec<f64> {
        let sums = self.resultants(body, force);
        let still = self.parts.iter().enumerate().map(|(i, part)| part.motion(i, &[0.0; 3]));
        let mut parts: Vec<_> = still.collect();
        for motion in &self.free {
            let amplitude = motion.work(&sums) / self.square(motion);
            motion.parts.iter().for_each(|part| parts[part.part].add(amplitude, part));
        }
        let nodes = self.part_of_node.iter().zip(&body.nodes.points);
        nodes.flat_map(|(&part, &x)| parts[part].at(x)).collect()
    }
}
