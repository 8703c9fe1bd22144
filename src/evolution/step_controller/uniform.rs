//! Uniform steps, t_n = nk as in (25).

use super::{PlannedStep, StepController, Verdict, at_weakest_node};
use crate::{
    evolution::{
        RunError, Step, Stop,
        bounds::{BoundViolation, Bounds},
        damage_step::{DamageSource, DamageStep, DamageUpdate},
    },
    fem::Partition,
    scene::{Stepping, TimeGrid},
};

/// Makes the steps of (25) and accepts them all; ends at the first ζ_n ≤ ζ_*.
pub(super) struct UniformSteps<'a> {
    partition: &'a Partition,
    /// `None` where there is no time, and so no step.
    grid: Option<TimeGrid>,
    /// The damage source of the last accepted step.
    source: DamageSource,
    /// dζ/dt in the last accepted step, 1/s.
    rate: Option<Vec<f64>>,
    /// Per node, Σ local error / rate: how late it reaches a given ζ, s. (An error δζ delays an
    /// autonomous evolution by δζ/ζ', once and for all.)
    delay: Vec<f64>,
    bounds: Bounds,
    violation: BoundViolation,
}

impl<'a> UniformSteps<'a> {
    pub(super) fn new(
        partition: &'a Partition,
        grid: Option<TimeGrid>,
        zeta: &[f64],
        source: DamageSource,
    ) -> Self {
        Self {
            partition,
            grid,
            source,
            rate: None,
            delay: vec![0.0; zeta.len()],
            bounds: Bounds::new(partition.extremes(zeta)),
            violation: BoundViolation::default(),
        }
    }

    /// Adds the delay of the step before the one from `planned.start` to `zeta`. (28) takes the
    /// source at the beginning of a step, so its local error is ½ k (ζ'_n − ζ'_{n−1}).
    fn add_delay(&mut self, planned: &PlannedStep, zeta: &[f64]) {
        let k = planned.k;
        let rate: Vec<f64> = zeta.iter().zip(&planned.start).map(|(n, o)| (n - o) / k).collect();
        if let Some(before) = &self.rate {
            for ((delay, rate), before) in self.delay.iter_mut().zip(&rate).zip(before) {
                let mean = 0.5 * (rate + before);
                *delay += if mean == 0.0 { 0.0 } else { 0.5 * k * (rate - before) / mean };
            }
        }
        self.rate = Some(rate);
    }
}

impl StepController for UniformSteps<'_> {
    fn plan(&mut self, last: &Step) -> Option<PlannedStep> {
        let grid = self.grid?;
        let Stepping::Uniform { steps } = grid.stepping else { return None };
        let (n, k) = (last.record.step + 1, grid.end / steps as f64);
        (n <= steps).then(|| PlannedStep {
            n,
            time: grid.time(n, steps),
            length: k,
            k,
            start: last.state.zeta.clone(),
            load: self.source.load.clone(),
            bounds: self.bounds.after(self.source.min, k),
        })
    }

    fn judge_stop(&mut self, planned: &PlannedStep, damage: &DamageUpdate, _: &Step) -> Verdict {
        // This step tells the error of the one before.
        self.add_delay(planned, &damage.zeta);
        self.violation.observe(planned, damage.min_max, planned.time);
        let delay = at_weakest_node(self.partition, &damage.zeta, &self.delay);
        Verdict::Stop(Stop {
            time: planned.time,
            zeta_min: damage.min_max.0,
            least_admissible: planned.bounds.lower,
            uncertainty: planned.length + 2.0 * delay.abs(),
        })
    }

    fn judge(
        &mut self,
        planned: &PlannedStep,
        damage: &DamageUpdate,
        step: Box<Step>,
        damage_step: &mut DamageStep,
    ) -> Result<Verdict, RunError> {
        self.add_delay(planned, &damage.zeta);
        self.violation.observe(planned, damage.min_max, planned.time);
        self.bounds = planned.bounds.tightened(damage.min_max);
        self.source = damage_step.source(&step.state);
        Ok(Verdict::Accept(step))
    }

    fn bound_violation(&self) -> BoundViolation {
        self.violation
    }
}
