//! The errors of ζ from the time steps, and their growth.

use super::{DamageStep, PlannedStep, RunError, StepController};
use crate::maximum;
use nalgebra::DVector;

impl StepController<'_> {
    /// The estimated error E of the last accepted ζ from the time steps, at the nodes.
    pub(crate) fn step_error(&self) -> DVector<f64> {
        &self.history.error + &self.history.last_error
    }

    /// The error bar of ζ from the time steps, at the nodes: |E| + Σ|d| with the doubts d of the steps. The errors of loads
    /// that rise and fall cancel in E, their doubts do not.
    pub(crate) fn step_bar(&self) -> DVector<f64> {
        self.step_error().abs() + &self.history.doubt
    }

    /// After the last step: adds the error of Euler's last step, which the rate of one more step shows. Collective.
    ///
    /// # Errors
    /// That step has no answer.
    pub(crate) fn add_last_error(&mut self, damage_step: &mut DamageStep) -> Result<(), RunError> {
        let length = self.history.length;
        if self.two_step || length.is_infinite() {
            return Ok(());
        }
        let (start, load) = (self.history.zeta.clone(), self.history.source.load.clone());
        let (n, time, bounds) = (0, 0.0, self.history.bounds);
        let planned = PlannedStep { n, time, length, k: length, start, load, bounds };
        let zeta = damage_step.solve(&planned)?.zeta;
        self.add_euler_error(&planned, &planned.rate(&zeta));
        Ok(())
    }

    /// Adds the error of the previous Euler step; `rate` is the rate of this step: (28) takes the source at the
    /// beginning of a step, so the error is ½ k (ζ'_n − ζ'_{n−1}).
    pub(super) fn add_euler_error(&mut self, planned: &PlannedStep, rate: &DVector<f64>) {
        if let Some(before) = &self.history.rate {
            let error = 0.5 * planned.k * (rate - before);
            let (zeta, mean) = (self.history.zeta.clone(), 0.5 * (rate + before));
            self.add_error(planned.length, &error, &error, &zeta, &mean);
        }
    }

    /// Adds the `error` of a step of `length` s to `zeta` with the mean `rate`, and its `doubt`. Earlier errors grow by
    /// the smaller one of two ratios:
    ///
    /// - exp(∫g), with g from [`error_growth`](crate::model::DamageSource::error_growth) of the damage source, by the trapezoidal
    ///   rule, for strains proportional to 1/ζ. Prescribed displacements prevent such strains.
    /// - ζ'_n / ζ'_{n−1}, at least 1. An error δζ of ζ' = φ(ζ) grows like ζ', and the rise of a load adds to this.
    pub(super) fn add_error(
        &mut self,
        length: f64,
        error: &DVector<f64>,
        doubt: &DVector<f64>,
        zeta: &DVector<f64>,
        rate: &DVector<f64>,
    ) {
        if let (Some(laws), Some(before)) = (self.problem.damage(), &self.history.rate) {
            // A node may belong to several materials.
            let growth = |zeta: f64, rate: f64| {
                let of_laws =
                    laws.iter().map(|law| self.law.error_growth(law, zeta, rate.min(0.0)));
                of_laws.fold(0.0, maximum)
            };
            for i in (0..zeta.len()).filter(|&i| before[i] < 0.0 || rate[i] < 0.0) {
                let start = growth(self.history.zeta[i], before[i]);
                let mut ratio = (0.5 * length * (start + growth(zeta[i], rate[i]))).exp();
                if before[i] < 0.0 {
                    ratio = -maximum(-ratio, -(rate[i] / before[i]).max(1.0));
                }
                self.history.error[i] *= ratio;
                self.history.doubt[i] *= ratio;
            }
        }
        self.history.error += error;
        self.history.doubt += doubt.abs();
    }

    /// At the node of minimum `zeta`: its error bar, and ζ′ in this step (`rate`) and in the one before, 1/s. Collective.
    pub(super) fn at_weakest_node(&self, zeta: &DVector<f64>, rate: &DVector<f64>) -> [f64; 3] {
        let partition = &self.problem.body.vertices.partition;
        let weakest = (0..partition.owned()).min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
        let (_, rank) = partition.comm().min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
        let before = self.history.rate.as_ref().unwrap_or(rate);
        let bar = self.step_bar();
        let values = weakest.map_or([0.0; 3], |i| [bar[i], rate[i], before[i]]);
        values.map(|value| partition.comm().broadcast(rank, value))
    }
}
