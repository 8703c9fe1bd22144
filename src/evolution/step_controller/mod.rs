//! Step control: how long each step is, and whether it is accepted.

mod chosen;
mod load_curve;
mod uniform;

use super::{
    DiscreteProblem, RunError, Step, StepFailure, Stop,
    bounds::{BoundViolation, Bounds},
    damage_step::{DamageSource, DamageStep, DamageUpdate},
};
use crate::{fem::Partition, scene::Stepping};

/// A step to be made from t_{n−1} to t_n. Its ζ_n is that of a damage step (28),
/// (M + kκL) ζ_n = M · `start` + k · `load`.
pub(super) struct PlannedStep {
    pub(super) n: usize,
    /// t_n, s.
    pub(super) time: f64,
    /// t_n − t_{n−1}, s.
    pub(super) length: f64,
    /// k, s.
    pub(super) k: f64,
    /// ζ_{n−1}, or what stands in its place.
    pub(super) start: Vec<f64>,
    /// The source load b_{n−1}, or what stands in its place, m²/s.
    pub(super) load: Vec<f64>,
    /// The bounds on ζ_n.
    pub(super) bounds: Bounds,
}

impl PlannedStep {
    /// The error of a step that has no answer.
    pub(super) fn failed(&self, source: StepFailure) -> RunError {
        RunError::Step { step: self.n, time: self.time, source }
    }
}

/// What becomes of a step.
pub(super) enum Verdict {
    /// It is accepted.
    Accept(Box<Step>),
    /// It is to be made again, shorter by this factor.
    Retry(f64),
    /// ζ_* is reached: the run ends before this step.
    Stop(Stop),
}

/// Plans the steps of a run and judges them. What it knows of the accepted steps it updates when it
/// answers [`Verdict::Accept`], and only then.
pub(super) trait StepController {
    /// The step after the accepted one `last`; `None` at the end of time.
    fn plan(&mut self, last: &Step) -> Option<PlannedStep>;

    /// Judges a step from `last` that reaches ζ_*: a stop, or a shorter step that lands nearer.
    fn judge_stop(&mut self, planned: &PlannedStep, damage: &DamageUpdate, last: &Step) -> Verdict;

    /// Judges a step whose ζ_n and u_n are known.
    ///
    /// # Errors
    /// The error is too large however short the step is, or a solve failed.
    fn judge(
        &mut self,
        planned: &PlannedStep,
        damage: &DamageUpdate,
        step: Box<Step>,
        damage_step: &mut DamageStep,
    ) -> Result<Verdict, RunError>;

    /// Judges a step whose solves failed: a shorter step may do better.
    ///
    /// # Errors
    /// `failure`, if a shorter step is not to be tried.
    fn judge_failure(&self, _: &PlannedStep, failure: RunError) -> Result<Verdict, RunError> {
        Err(failure)
    }

    /// Makes the next step `length` s long.
    fn shorten(&mut self, _length: f64) {}

    /// By how much the accepted steps violate the bounds on ζ.
    fn bound_violation(&self) -> BoundViolation;

    /// The estimated error of the last accepted ζ over the damage done, where steps are chosen.
    fn damage_error(&self) -> Option<f64> {
        None
    }
}

/// The step controller that the scene asks for, after (27) with `first` and its damage source.
pub(super) fn step_controller<'a>(
    problem: &'a DiscreteProblem,
    first: &Step,
    source: DamageSource,
) -> Box<dyn StepController + 'a> {
    let zeta = &first.state.zeta;
    match problem.scene().time.map(|grid| (grid, grid.stepping)) {
        Some((grid, Stepping::Auto { tolerance })) => {
            Box::new(chosen::ChosenSteps::new(problem, zeta, source, tolerance, grid.end))
        }
        uniform => {
            let grid = uniform.map(|(grid, _)| grid);
            Box::new(uniform::UniformSteps::new(&problem.body.partition, grid, zeta, source))
        }
    }
}

/// The value of a field at the node of least `zeta`. Collective.
fn at_weakest_node(partition: &Partition, zeta: &[f64], field: &[f64]) -> f64 {
    let weakest = (0..partition.owned()).min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
    let comm = partition.comm();
    let (_, rank) = comm.min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
    comm.broadcast(rank, weakest.map_or(0.0, |i| field[i]))
}
