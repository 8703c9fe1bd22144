//! The error of a time step in ζ, and what it means for the time of failure.

use crate::fem::Partition;

/// Rates of ζ of the last accepted step, for the estimate of the next.
#[derive(Debug)]
pub(super) struct Estimate<'a> {
    partition: &'a Partition,
    /// dζ/dt at the nodes, 1/s, and the step it was taken over, s.
    last: Option<(Vec<f64>, f64)>,
    /// Of each node, Σ of local errors over rates: how late it reaches a given ζ, s. (An error
    /// δζ delays an autonomous evolution by δζ/ζ', once and for all.)
    delay: Vec<f64>,
}

/// The error of one step.
pub(super) struct StepError {
    /// Largest |error| of ζ over the nodes.
    pub(super) largest: f64,
    rate: Vec<f64>,
    step: f64,
}

impl<'a> Estimate<'a> {
    /// Before any step.
    pub(super) fn new(partition: &'a Partition) -> Self {
        Self { partition, last: None, delay: Vec::new() }
    }

    /// ½ k² ζ'' of the Euler step from `old` to `new` of length `step`. The source is taken at a
    /// step's beginning, so the rates of two steps are as far apart as the first is long.
    /// Nothing is known of the first step.
    pub(super) fn of(&self, old: &[f64], new: &[f64], step: f64) -> StepError {
        let rate: Vec<f64> = new.iter().zip(old).map(|(n, o)| (n - o) / step).collect();
        let largest = match &self.last {
            None => 0.0,
            Some((before, step_before)) => {
                let curvature = |(r, b): (&f64, &f64)| (r - b).abs() / step_before;
                let largest = rate.iter().zip(before).map(curvature).fold(0.0, f64::max);
                0.5 * step * step * self.partition.ranks().max(largest)
            }
        };
        StepError { largest, rate, step }
    }

    /// The step is accepted. Its rate tells the error ½ k (ζ'_n − ζ'_{n−1}) of the step before.
    pub(super) fn accept(&mut self, step: StepError) {
        self.delay.resize(step.rate.len(), 0.0);
        if let Some((before, step_before)) = &self.last {
            for ((delay, rate), before) in self.delay.iter_mut().zip(&step.rate).zip(before) {
                let mean = 0.5 * (rate + before);
                *delay +=
                    if mean == 0.0 { 0.0 } else { 0.5 * step_before * (rate - before) / mean };
            }
        }
        self.last = Some((step.rate, step.step));
    }

    /// How late the node of least `zeta` is, s.
    pub(super) fn delay(&self, zeta: &[f64]) -> f64 {
        let owned = 0..self.partition.owned();
        let weakest = owned.min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
        let delay = weakest.and_then(|i| self.delay.get(i)).copied().unwrap_or(0.0);
        let ranks = self.partition.ranks();
        let (_, rank) = ranks.least(weakest.map_or(f64::INFINITY, |i| zeta[i]));
        ranks.value_of(rank, delay)
    }
}
