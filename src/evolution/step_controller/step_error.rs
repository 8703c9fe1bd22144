//! What time steps do to ζ: the errors that they add, and how these grow.

use super::{PlannedStep, StepController};
use crate::model::DamageLaw;
use nalgebra::DVector;

/// The errors of steps grow this part of a run at a time.
const GROWTH_STEP: f64 = 1.0 / 32.0;

impl StepController<'_> {
    /// The estimated error of the last accepted ζ from the time steps, at the nodes; `None` before the
    /// first step, or of Euler's before the second, which tells the error of the first.
    pub(crate) fn step_error(&self) -> Option<DVector<f64>> {
        Some(&self.error + self.last_error.as_ref()?)
    }

    /// ∫ ζ' over a step of k = `length`, s, from its rate f_n and f_n − f_{n−1} = `change` to third order:
    /// k (f_n − ½ (f_n − f_{n−1}) − ω/(6 (1+ω)) ((f_n − f_{n−1}) − ω (f_{n−1} − f_{n−2}))).
    pub(super) fn integrated(
        &self,
        length: f64,
        rate: &DVector<f64>,
        change: &DVector<f64>,
    ) -> DVector<f64> {
        let omega = length / self.length;
        let curvature = change - omega * &self.rate_change;
        length * (rate - 0.5 * change - omega / (6.0 * (1.0 + omega)) * curvature)
    }

    /// Adds the delay of the Euler step before the one with this `rate`: (28) takes the source at the
    /// beginning of a step, so its error is ½ k (ζ'_n − ζ'_{n−1}).
    pub(super) fn add_euler_delay(&mut self, planned: &PlannedStep, rate: &DVector<f64>) {
        if let Some(before) = &self.rate {
            let error = 0.5 * planned.k * (rate - before);
            add_delay(&mut self.delay, &error, &(0.5 * (rate + before)));
            self.grow_error(planned.length, &error);
            self.last_error = Some(error);
        }
    }

    /// Adds the error of a step of `length` s to those before, which grow, every few steps: with
    /// r = −ζ', an error δζ changes the source φ = −(λ_D (1−ζ)/ζ + ½ λ_U |ε|² − λ_W) by
    /// λ_D/ζ² δζ, and under a given load, where |ε| ~ 1/ζ, by 2 (r − λ_D (1−ζ)/ζ + λ_W)/ζ δζ more.
    pub(super) fn grow_error(&mut self, length: f64, error: &DVector<f64>) {
        self.not_grown += length;
        let end = self.problem.scene().time.map_or(0.0, |grid| grid.end);
        let (laws, rate) = match (self.problem.damage(), &self.rate) {
            (Some(laws), Some(rate)) if self.not_grown > GROWTH_STEP * end => (laws, rate),
            _ => {
                self.error += error;
                return;
            }
        };
        let length = std::mem::take(&mut self.not_grown);
        for (i, own) in self.error.iter_mut().enumerate() {
            let growth = |law: &DamageLaw| {
                let zeta = law.truncate(self.zeta[i]);
                let internal = law.lambda_d * (1.0 - zeta) / zeta;
                let external = (law.lambda_w - rate[i] - internal).max(0.0);
                law.lambda_d / (zeta * zeta) + 2.0 * external / zeta
            };
            // A node may be of several materials.
            let growth = match rate[i] < 0.0 {
                true => laws.iter().map(growth).fold(0.0, f64::max),
                false => 0.0,
            };
            *own = *own * (1.0 + length * growth) + error[i];
        }
    }

    /// The delay at the node of least `zeta`. Collective.
    pub(super) fn delay_at_weakest_node(&self, zeta: &[f64]) -> f64 {
        let nodes = 0..self.problem.body.vertices.partition.owned();
        let weakest = nodes.min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
        let comm = self.problem.body.vertices.partition.comm();
        let (_, rank) = comm.min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
        comm.broadcast(rank, weakest.map_or(0.0, |i| self.delay[i]))
    }
}

/// Adds error / rate per node; nodes at rest have no delay.
pub(super) fn add_delay(delay: &mut DVector<f64>, error: &DVector<f64>, rate: &DVector<f64>) {
    *delay += error.zip_map(rate, |error, rate| if rate == 0.0 { 0.0 } else { error / rate });
}
