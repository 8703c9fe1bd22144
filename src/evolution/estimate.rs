//! How much too late uniform steps reach a given ζ.

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

impl<'a> Estimate<'a> {
    /// Before any step.
    pub(super) fn new(partition: &'a Partition) -> Self {
        Self { partition, last: None, delay: Vec::new() }
    }

    /// A step of length `step` from `old` to `new` ζ is accepted. The source is taken at a step's
    /// beginning, so its rate tells the error ½ k (ζ'_n − ζ'_{n−1}) of the step before.
    pub(super) fn accept(&mut self, old: &[f64], new: &[f64], step: f64) {
        let rate: Vec<f64> = new.iter().zip(old).map(|(n, o)| (n - o) / step).collect();
        self.delay.resize(rate.len(), 0.0);
        if let Some((before, step_before)) = &self.last {
            for ((delay, rate), before) in self.delay.iter_mut().zip(&rate).zip(before) {
                let mean = 0.5 * (rate + before);
                *delay +=
                    if mean == 0.0 { 0.0 } else { 0.5 * step_before * (rate - before) / mean };
            }
        }
        self.last = Some((rate, step));
    }

    /// How late the node of least `zeta` is, s.
    pub(super) fn delay(&self, zeta: &[f64]) -> f64 {
        at_weakest(self.partition, zeta, &self.delay)
    }
}

/// The value at the node of least `zeta`, 0 where there is none. Collective.
pub(super) fn at_weakest(partition: &Partition, zeta: &[f64], values: &[f64]) -> f64 {
    let weakest = (0..partition.owned()).min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
    let value = weakest.and_then(|i| values.get(i)).copied().unwrap_or(0.0);
    let comm = partition.comm();
    let (_, rank) = comm.min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
    comm.broadcast(rank, value)
}
