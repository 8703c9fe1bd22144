//! The errors of ζ from the time steps, and their growth.

use super::{PlannedStep, StepController};
use nalgebra::DVector;

impl StepController<'_> {
    /// The estimated error of the last accepted ζ from the time steps, at the nodes. `None` before the first step,
    /// and before Euler's second step, which shows the error of the first.
    pub(crate) fn step_error(&self) -> Option<DVector<f64>> {
        Some(&self.memory.error + self.memory.last_error.as_ref()?)
    }

    /// ∫ ζ' over a step of k = `length`, s, from its rate f_n and f_n − f_{n−1} = `change` to third order:
    /// k (f_n − ½ (f_n − f_{n−1}) − ω/(6 (1+ω)) ((f_n − f_{n−1}) − ω (f_{n−1} − f_{n−2}))).
    pub(super) fn integrated(
        &self,
        length: f64,
        rate: &DVector<f64>,
        change: &DVector<f64>,
    ) -> DVector<f64> {
        let omega = length / self.memory.length;
        let curvature = change - omega * &self.memory.rate_change;
        length * (rate - 0.5 * change - omega / (6.0 * (1.0 + omega)) * curvature)
    }

    /// Adds the error of the previous Euler step; `rate` is the rate of this step: (28) takes the source at the
    /// beginning of a step, so the error is ½ k (ζ'_n − ζ'_{n−1}).
    pub(super) fn add_euler_error(&mut self, planned: &PlannedStep, rate: &DVector<f64>) {
        if let Some(before) = &self.memory.rate {
            let error = 0.5 * planned.k * (rate - before);
            let (zeta, mean) = (self.memory.zeta.clone(), 0.5 * (rate + before));
            self.add_error(planned.length, &error, &zeta, &mean);
            self.memory.last_error = Some(error);
        }
    }

    /// Adds the `error` of a step of `length` s to `zeta` with the mean `rate`. Earlier errors grow by the factor
    /// exp(∫g), with g from [`error_growth`](crate::model::DamageLaw::error_growth) of the damage law, by the trapezoidal
    /// rule.
    pub(super) fn add_error(
        &mut self,
        length: f64,
        error: &DVector<f64>,
        zeta: &DVector<f64>,
        rate: &DVector<f64>,
    ) {
        let delay = error.zip_map(rate, |e, rate| if rate == 0.0 { 0.0 } else { e / rate });
        self.memory.delay += delay;
        if let (Some(laws), Some(before)) = (self.problem.damage(), &self.memory.rate) {
            // A node may belong to several materials.
            let growth = |zeta: f64, rate: f64| {
                let of_laws = laws.iter().map(|law| law.error_growth(zeta, rate.min(0.0)));
                of_laws.fold(0.0, f64::max)
            };
            for (i, own) in self.memory.error.iter_mut().enumerate() {
                if before[i] < 0.0 || rate[i] < 0.0 {
                    let start = growth(self.memory.zeta[i], before[i]);
                    *own *= (0.5 * length * (start + growth(zeta[i], rate[i]))).exp();
                }
            }
        }
        self.memory.error += error;
        self.memory.added += error.abs();
    }

    /// The error of the steps had it not grown, over the estimated one: at most 1. Collective.
    pub(crate) fn ungrown(&self) -> f64 {
        let partition = &self.problem.body.vertices.partition;
        let [added, error] = [&self.memory.added, &self.memory.error]
            .map(|field| partition.comm().max(field.rows(0, partition.owned()).amax()));
        if added < error { added / error } else { 1.0 }
    }

    /// At the node of minimum `zeta`: the error of ζ̃, the delay, s, and ζ′ in this step (`rate`) and in the one before, 1/s.
    /// Collective.
    pub(super) fn at_weakest_node(&self, zeta: &DVector<f64>, rate: &DVector<f64>) -> [f64; 4] {
        let partition = &self.problem.body.vertices.partition;
        let weakest = (0..partition.owned()).min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
        let (_, rank) = partition.comm().min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
        let before = self.memory.rate.as_ref().unwrap_or(rate);
        let values = |i: usize| [self.memory.error[i], self.memory.delay[i], rate[i], before[i]];
        let values = weakest.map_or([0.0; 4], values);
        values.map(|value| partition.comm().broadcast(rank, value))
    }
}
