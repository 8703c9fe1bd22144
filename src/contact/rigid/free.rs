//! What becomes of the motions that nothing prevents and nothing drives.

use super::{PartMotion, RigidMotions, load::Resultant};
use crate::{contact::Constraints, fem::Body};

/// Normals turn by at most this (rad) to be tangential to free motions.
const TURN: f64 = 1e-3;

impl RigidMotions {
    /// The direction ν at a node without what is rounding of u·ν for the free motions u, so that
    /// they leave contact and symmetry axes exactly as they are.
    pub fn tangential(&self, body: &Body, node: usize, normal: [f64; 2]) -> [f64; 2] {
        self.free.iter().fold(normal, |[nx, ny], motion| {
            let [x, y] = self.at(motion, &body.mesh.nodes, node);
            let (along, speed) = (x * nx + y * ny, x.hypot(y));
            if along.abs() <= 1e-14 || along.abs() > TURN * speed {
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
        for piece in &self.movable {
            let motions = self.free[piece.free.clone()].iter();
            let mut fields: Vec<Vec<f64>> = motions.map(|m| self.field(m, body)).collect();
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
    }

    /// Removes the free motions from u: the answer of least ∫|u|².
    pub fn remove_free(&self, body: &Body, u: &mut [f64]) {
        if self.free.is_empty() {
            return;
        }
        let momentum = |i: usize| [u[2 * i], u[2 * i + 1]].map(|u| body.node_area[i] * u);
        let removed = self.projection(&self.resultants(body, momentum));
        for (node, u) in u.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let [x, y] = removed[self.part_of_node[node]].at(body.mesh.nodes[node]);
            *u = [u[0] - x, u[1] - y];
        }
    }

    /// `load` (nodal forces, N) less the body force that does the same work on free motions. That
    /// work is rounding where [`Self::check`] accepts the load, and no pin then carries it.
    pub fn balanced(&self, body: &Body, mut load: Vec<f64>) -> Vec<f64> {
        if self.free.is_empty() {
            return load;
        }
        let balance = self.projection(&self.resultants(body, |i| [load[2 * i], load[2 * i + 1]]));
        for (node, f) in load.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let [x, y] = balance[self.part_of_node[node]].at(body.mesh.nodes[node]);
            let area = body.node_area[node];
            *f = [f[0] - area * x, f[1] - area * y];
        }
        load
    }

    /// Part by part the combination m of free motions with ∫m·v = f·v for all free motions v, from
    /// the resultants of f: they are orthogonal, so m = Σ (f·v/∫v·v) v.
    fn projection(&self, sums: &[Resultant]) -> Vec<PartMotion> {
        let still = self.parts.iter().enumerate().map(|(i, part)| part.motion(i, [0.0; 2], 0.0));
        let mut parts: Vec<_> = still.collect();
        for motion in &self.free {
            let square = |part: &PartMotion| self.parts[part.part].area * part.mean_square();
            let amplitude = motion.work(sums) / motion.parts.iter().map(square).sum::<f64>();
            motion.parts.iter().for_each(|part| parts[part.part].add(amplitude, part));
        }
        parts
    }
}
