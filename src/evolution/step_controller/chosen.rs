//! Steps chosen by the estimated error of each.
//!
//! Two-step backward differences with an extrapolated source (Hairer, Nørsett, Wanner, *Solving
//! Ordinary Differential Equations I*, III.5): with the step k_n = ω k_{n−1},
//!
//! (M + k'κL) ζ_n = M (ζ̃_{n−1} + β (ζ̃_{n−1} − ζ̃_{n−2})) + k' b̂_n,
//! k' = k_n (1+ω)/(1+2ω), β = ω²/(1+2ω), b̂_n = b_{n−1} + ω (b_{n−1} − b_{n−2}),
//!
//! which is a step (28) of length k' from another start with another source. The first step has
//! ω = 0 and is Euler's. When u_n is known, so is b_n, and the error of the extrapolation b̂_n is
//! corrected in the next step: ζ̃_n = ζ_n + e_n with (M + k'κL) e_n = k' (b_n − b̂_n).

use super::{PlannedStep, StepController, Verdict, at_weakest_node, load_curve::LoadCurve};
use crate::{
    evolution::{
        DiscreteProblem, RunError, Step, StepFailure, Stop,
        bounds::{BoundViolation, Bounds},
        damage_step::{DamageSource, DamageStep, DamageUpdate},
    },
    fem::Body,
};

/// Chooses step lengths so that the error of ζ stays below a tolerance, and lands on ζ_*.
pub(super) struct ChosenSteps<'a> {
    body: &'a Body,
    /// The scene's: the error of ζ over the damage done.
    tolerance: f64,
    /// T, s.
    end: f64,
    /// ζ_*.
    threshold: f64,
    /// What steps must follow, where it depends on time.
    load_curve: Option<LoadCurve<'a>>,
    /// The length of the next step, s.
    next_length: f64,
    /// k_{n−1}; before the first step infinite, so that ω = 0.
    length: f64,
    /// ζ₀ and ζ̃_{n−1}.
    initial: Vec<f64>,
    zeta: Vec<f64>,
    /// ζ̃_{n−1} − ζ̃_{n−2}, and dζ/dt at t_{n−1} once there is a step, 1/s.
    change: Vec<f64>,
    rate: Option<Vec<f64>>,
    /// The damage source at t_{n−1}, and b_{n−1} − b_{n−2}, m²/s.
    source: DamageSource,
    load_change: Vec<f64>,
    /// Per node, the sum of the truncation errors, and of these over the rates: by how much the node
    /// reaches a given ζ too early, s. (An error δζ shifts an autonomous evolution by δζ/ζ', once
    /// and for all.)
    truncation: Vec<f64>,
    delay: Vec<f64>,
    /// [`ChosenSteps::norms`] of ζ_{n−1} − ζ₀ and of its estimated error.
    damage: [f64; 2],
    error: [f64; 2],
    bounds: Bounds,
    violation: BoundViolation,
}

/// The error of a step.
struct StepError {
    /// Over the allowed one.
    ratio: f64,
    truncation: Vec<f64>,
    /// dζ/dt at t_n, 1/s.
    rate: Vec<f64>,
    /// [`ChosenSteps::norms`] of ζ_n − ζ₀.
    damage: [f64; 2],
}

/// A chosen step is at most this part of the run.
const COARSEST: f64 = 0.05;
/// Steps that do not follow the loads are halved down to this part: no step follows a jump.
const FOLLOWING: f64 = 1.0 / 2000.0;
/// A run whose step falls below this part has failed.
const FINEST: f64 = 1e-12;
/// Damage below this is negligible: its error is judged as if it were so large.
const NEGLIGIBLE: f64 = 1e-6;
/// At the beginning of a run there is no damage yet to compare an error with, so what the present
/// rate will do in this part of the run is added to it …
const HORIZON: f64 = 0.1;
/// … but in no more than so many steps: the rate in a pulse, which takes short ones, does not last;
const STEPS: f64 = 20.0;
/// … and no more than this: a body that fails does so faster and faster, and early errors grow.
const FORESEEN: f64 = 0.1;
/// The error of a step may be this part of the tolerance, as truncation errors add up.
const SHARE: f64 = 0.25;
/// In a smooth evolution with equal steps the increments of the formula are off by ⅓ k³ζ‴, those of
/// the trapezoidal rule by 1/12: the first is this multiple of their difference.
const TRUNCATION: f64 = 4.0 / 3.0;

impl<'a> ChosenSteps<'a> {
    /// From ζ₀ = `zeta` at t = 0, with its damage source, to t = `end`.
    pub(super) fn new(
        problem: &'a DiscreteProblem,
        zeta: &[f64],
        source: DamageSource,
        tolerance: f64,
        end: f64,
    ) -> Self {
        let zeros = vec![0.0; zeta.len()];
        // The error of the first step may be half of what its last rate does in it.
        let first_length = 2.0 * SHARE * tolerance * HORIZON * end;
        Self {
            body: &problem.body,
            tolerance,
            end,
            threshold: problem.threshold(),
            load_curve: LoadCurve::new(problem),
            next_length: first_length.min(COARSEST * end),
            length: f64::INFINITY,
            initial: zeta.to_vec(),
            zeta: zeta.to_vec(),
            change: zeros.clone(),
            rate: None,
            source,
            load_change: zeros.clone(),
            truncation: zeros.clone(),
            delay: zeros,
            damage: [0.0; 2],
            error: [0.0; 2],
            bounds: Bounds::new(problem.body.partition.extremes(zeta)),
            violation: BoundViolation::default(),
        }
    }

    /// The end and the length, s, of the next step from `time`. The last two steps are equal rather
    /// than one of them small.
    fn next_step(&self, time: f64) -> (f64, f64) {
        let rest = self.end - time;
        match rest / self.next_length {
            steps if steps <= 1.0 => (self.end, rest),
            steps if steps < 2.0 => (time + 0.5 * rest, 0.5 * rest),
            _ => (time + self.next_length, self.next_length),
        }
    }

    /// Whether the loads are nearly linear in time from `start` to `end`.
    fn follows_loads(&mut self, start: f64, end: f64) -> bool {
        self.load_curve.as_mut().is_none_or(|curve| curve.is_nearly_linear(start, end))
    }

    /// ω and β of a step of `length` s.
    fn weights(&self, length: f64) -> [f64; 2] {
        let omega = length / self.length;
        [omega, omega * omega / (1.0 + 2.0 * omega)]
    }

    /// The error of ζ_n = `zeta`, from e_n = `correction`: the rate of the formula at t_n is compared
    /// with that of the trapezoidal rule.
    fn step_error(&self, planned: &PlannedStep, zeta: &[f64], correction: &[f64]) -> StepError {
        let nodes = 0..zeta.len();
        let [_, beta] = self.weights(planned.length);
        let change = |i: usize| zeta[i] + correction[i] - self.zeta[i];
        let rate: Vec<f64> =
            nodes.clone().map(|i| (change(i) - beta * self.change[i]) / planned.k).collect();
        // The rate before the first step is that of its source, which needs no correction.
        let rate_before = |i: usize| match &self.rate {
            Some(rate) => rate[i],
            None => rate[i] - correction[i] / planned.k,
        };
        let difference = |i: usize| 0.5 * planned.length * (rate_before(i) + rate[i]) - change(i);
        let truncation: Vec<f64> = nodes.map(|i| TRUNCATION * difference(i)).collect();

        let damage = self.norms(|i| zeta[i] - self.initial[i]);
        let error = self.norms(|i| correction[i] + truncation[i]);
        let rates = self.norms(|i| rate[i]);
        let ahead = (HORIZON * self.end).min(STEPS * planned.length).min(self.end - planned.time);
        let ratio = |j: usize| {
            let reference = damage[j] + (ahead * rates[j]).clamp(NEGLIGIBLE, FORESEEN);
            error[j] / (SHARE * self.tolerance * reference)
        };
        StepError { ratio: ratio(0).max(ratio(1)), truncation, rate, damage }
    }

    /// Keeps what the next step needs of an accepted one, with e_n = `correction`.
    fn accept(
        &mut self,
        planned: &PlannedStep,
        zeta: &[f64],
        correction: &[f64],
        error: StepError,
        source: DamageSource,
    ) {
        let StepError { ratio, truncation, rate, damage } = error;
        for i in 0..zeta.len() {
            let corrected = zeta[i] + correction[i];
            self.change[i] = corrected - self.zeta[i];
            self.zeta[i] = corrected;
            self.truncation[i] += truncation[i];
            self.delay[i] += if rate[i] == 0.0 { 0.0 } else { truncation[i] / rate[i] };
        }
        self.damage = damage;
        self.error = self.norms(|i| self.truncation[i] + correction[i]);
        self.load_change = difference(&source.load, &self.source.load);
        self.source = source;
        self.rate = Some(rate);
        self.length = planned.length;
        self.next_length = (planned.length * growth(ratio).min(2.0)).min(COARSEST * self.end);
    }

    /// A shorter step, unless steps have become hopelessly short.
    fn retry(&self, planned: &PlannedStep, factor: f64) -> Option<Verdict> {
        (planned.length * factor > FINEST * self.end).then_some(Verdict::Retry(factor))
    }

    /// max |·| over the nodes, and the mean of |·| over the body. Collective.
    fn norms(&self, field: impl Fn(usize) -> f64) -> [f64; 2] {
        let (mut max, mut integral) = (0.0_f64, 0.0);
        for i in 0..self.body.partition.owned() {
            let value = field(i).abs();
            max = max.max(value);
            integral += self.body.node_area[i] * value;
        }
        let comm = self.body.partition.comm();
        [comm.max(max), comm.total(integral) / self.body.area]
    }
}

impl StepController for ChosenSteps<'_> {
    fn plan(&mut self, last: &Step) -> Option<PlannedStep> {
        let start = last.state.time;
        if start >= self.end {
            return None;
        }
        let (mut time, mut length) = self.next_step(start);
        while !self.follows_loads(start, time) && length > FOLLOWING * self.end {
            self.next_length = 0.5 * length;
            (time, length) = self.next_step(start);
        }
        let [omega, beta] = self.weights(length);
        let k = length * (1.0 + omega) / (1.0 + 2.0 * omega);
        let shift: Vec<f64> = self.change.iter().map(|change| beta * change).collect();
        // φ ≤ 0, so b ≤ 0 and b̂_n ≥ (1 + ω) b_{n−1}.
        let extrapolated = |(b, change): (&f64, &f64)| (b + omega * change).min(0.0);
        Some(PlannedStep {
            n: last.record.step + 1,
            time,
            length,
            k,
            start: self.zeta.iter().zip(&shift).map(|(zeta, shift)| zeta + shift).collect(),
            load: self.source.load.iter().zip(&self.load_change).map(extrapolated).collect(),
            bounds: (self.bounds)
                .shifted(self.body.partition.extremes(&shift))
                .after((1.0 + omega) * self.source.min, k),
        })
    }

    fn judge_stop(&mut self, planned: &PlannedStep, damage: &DamageUpdate, last: &Step) -> Verdict {
        let (zeta_min, level) = (damage.min_max.0, self.threshold);
        let from = self.body.partition.extremes(&self.zeta).0;
        let part = if from > level { (from - level) / (from - zeta_min) } else { 0.0 };
        let landing = self.tolerance * self.damage[0].max(NEGLIGIBLE);
        // The last ζ that is written counts as well as its correction ζ̃.
        if from.max(last.record.zeta_min) - level > landing
            && let Some(shorter) = self.retry(planned, (0.9 * part).max(0.01))
        {
            return shorter;
        }
        let time = last.state.time + part * planned.length;
        self.violation.observe(planned, damage.min_max, time);
        let delay = at_weakest_node(&self.body.partition, &damage.zeta, &self.delay);
        Verdict::Stop(Stop {
            time,
            zeta_min,
            least_admissible: planned.bounds.lower,
            uncertainty: planned.length + delay.abs(),
        })
    }

    fn judge(
        &mut self,
        planned: &PlannedStep,
        damage: &DamageUpdate,
        step: Box<Step>,
        damage_step: &mut DamageStep,
    ) -> Result<Verdict, RunError> {
        let source = damage_step.source(&step.state);
        let load_error = difference(&source.load, &planned.load);
        let correction = damage_step.correction(planned, &load_error)?;
        let error = self.step_error(planned, &damage.zeta, &correction);
        if error.ratio > 1.0 {
            let factor = growth(error.ratio).clamp(0.2, 0.9);
            let shorter = self.retry(planned, factor);
            return shorter.ok_or_else(|| planned.failed(StepFailure::TooShort));
        }
        self.violation.observe(planned, damage.min_max, planned.time);
        let partition = &self.body.partition;
        self.bounds =
            planned.bounds.tightened(damage.min_max).shifted(partition.extremes(&correction));
        self.accept(planned, &damage.zeta, &correction, error, source);
        Ok(Verdict::Accept(step))
    }

    fn judge_failure(&self, planned: &PlannedStep, failure: RunError) -> Result<Verdict, RunError> {
        let shorter = self.retry(planned, 0.5).filter(|_| failure.is_of_a_solve());
        shorter.ok_or(failure)
    }

    fn shorten(&mut self, length: f64) {
        self.next_length = length;
    }

    fn bound_violation(&self) -> BoundViolation {
        self.violation
    }

    fn damage_error(&self) -> Option<f64> {
        let relative = |j: usize| self.error[j] / self.damage[j].max(NEGLIGIBLE);
        Some(relative(0).max(relative(1)))
    }
}

/// By this factor a step becomes one with the allowed error, of third order in its length, less a
/// margin. In 32nds: rounding, which differs with ranks and units, then hardly ever changes steps.
fn growth(error_ratio: f64) -> f64 {
    (32.0 * 0.9 / error_ratio.max(1e-300).cbrt()).floor() / 32.0
}

/// a − b.
fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}
