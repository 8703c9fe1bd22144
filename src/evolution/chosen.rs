//! Chosen steps: a formula of second order in time, and the error of each step.
//!
//! Two-step backward differences with an extrapolated source (Hairer, Nørsett, Wanner, *Solving
//! Ordinary Differential Equations I*, III.5): with the step k after one of k/ω,
//!
//! (M + k'κL) ζ_n = M (ζ̃_{n−1} + β (ζ̃_{n−1} − ζ̃_{n−2})) + k' b̂_n,
//! k' = k (1+ω)/(1+2ω), β = ω²/(1+2ω), b̂_n = b_{n−1} + ω (b_{n−1} − b_{n−2}),
//!
//! which is a step (28) of length k' from another start with another source. The first step is
//! Euler's. When u_n is known, so is b_n, and what the extrapolation missed is made good in the
//! next step: ζ̃_n = ζ_n + e_n with (M + k'κL) e_n = k' (b_n − b̂_n).

use super::estimate::at_weakest;
use crate::fem::Body;

/// The state of a formula of two steps, and what is known of its errors.
pub(super) struct Chosen<'a> {
    body: &'a Body,
    tolerance: f64,
    end: f64,
    initial: Vec<f64>,
    /// ζ̃_{n−1}.
    start: Vec<f64>,
    last: Option<Last>,
    /// The sum of all truncation errors.
    left: Vec<f64>,
    /// [`Chosen::norms`] of ζ_{n−1} − ζ₀ and of its estimated error.
    damage: [f64; 2],
    error: [f64; 2],
    /// Per node, the sum of the truncation errors over the rates: by how much it reaches a given ζ too
    /// early, s. (An error δζ shifts an autonomous evolution by δζ/ζ', once and for all.)
    delay: Vec<f64>,
}

/// The step before, of length k_{n−1}.
struct Last {
    step: f64,
    /// ζ̃_{n−1} − ζ̃_{n−2}, the rate dζ/dt at t_{n−1}, and b_{n−1} − b_{n−2}.
    change: Vec<f64>,
    rate: Vec<f64>,
    load_change: Vec<f64>,
}

/// A step (28) to be made.
pub(super) struct Plan {
    /// k', s.
    pub(super) step: f64,
    /// What to start from, and its difference from ζ̃_{n−1}.
    pub(super) start: Vec<f64>,
    pub(super) shift: Vec<f64>,
    /// b̂_n.
    pub(super) load: Vec<f64>,
    /// b̂_n is at most so many times b_{n−1}.
    pub(super) growth: f64,
}

/// The error of a step.
pub(super) struct StepError {
    /// Over the allowed one.
    pub(super) ratio: f64,
    truncation: Vec<f64>,
    rate: Vec<f64>,
}

/// Damage below this is negligible: its error is judged as if it were so large.
const NEGLIGIBLE: f64 = 1e-6;
/// An error is compared with the damage that the present rate will have done after this part of the
/// run: at its beginning there is none yet.
const HORIZON: f64 = 0.1;
/// … but of no more than so many steps: the rate in a pulse, which takes short ones, does not last;
const STEPS: f64 = 20.0;
/// … which is at most this: a body that fails does so faster and faster, and early errors grow.
const FORESEEN: f64 = 0.1;
/// The error of a step may be this part of the tolerance, as truncation errors add up.
const SHARE: f64 = 0.25;
/// In a smooth evolution with equal steps the increments of the formula are off by ⅓ k³ζ‴, those of
/// the trapezoidal rule by 1/12: of their difference the first is this part.
const TRUNCATION: f64 = 4.0 / 3.0;

impl<'a> Chosen<'a> {
    /// From ζ₀ at t = 0 to t = `end`, for a relative `tolerance`.
    pub(super) fn new(body: &'a Body, initial: &[f64], tolerance: f64, end: f64) -> Self {
        let (initial, start) = (initial.to_vec(), initial.to_vec());
        let delay = vec![0.0; start.len()];
        let left = delay.clone();
        let (damage, error) = ([0.0; 2], [0.0; 2]);
        Self { body, tolerance, end, initial, start, last: None, left, damage, error, delay }
    }

    /// The first step to try, s: its error may be half of what its last rate does in it.
    pub(super) fn first_step(&self) -> f64 {
        2.0 * SHARE * self.tolerance * HORIZON * self.end
    }

    /// ζ̃_{n−1}.
    pub(super) fn start(&self) -> &[f64] {
        &self.start
    }

    /// How near ζ_* a run must land.
    pub(super) fn landing(&self) -> f64 {
        self.tolerance * self.damage[0].max(NEGLIGIBLE)
    }

    /// The step of `step` s from the source load b_{n−1} = `load`.
    pub(super) fn plan(&self, step: f64, load: &[f64]) -> Plan {
        let Some(last) = &self.last else {
            let (start, shift) = (self.start.clone(), vec![0.0; self.start.len()]);
            return Plan { step, start, shift, load: load.to_vec(), growth: 1.0 };
        };
        let ratio = step / last.step;
        let beta = ratio * ratio / (1.0 + 2.0 * ratio);
        let shift: Vec<f64> = last.change.iter().map(|change| beta * change).collect();
        let start = self.start.iter().zip(&shift).map(|(z, shift)| z + shift).collect();
        // Nothing heals: φ ≤ 0, so b ≤ 0.
        let ahead = |(b, change): (&f64, &f64)| (b + ratio * change).min(0.0);
        let load = load.iter().zip(&last.load_change).map(ahead).collect();
        let step = step * (1.0 + ratio) / (1.0 + 2.0 * ratio);
        Plan { step, start, shift, load, growth: 1.0 + ratio }
    }

    /// The error of ζ_n = `zeta` after a step of `step` s to `time` by `plan`, with e_n = `missed`.
    pub(super) fn judge(
        &self,
        plan: &Plan,
        zeta: &[f64],
        missed: &[f64],
        [step, time]: [f64; 2],
    ) -> StepError {
        // The rate of the formula, and its distance from the trapezoidal rule.
        let change = |i: usize| zeta[i] + missed[i] - self.start[i];
        let rate: Vec<f64> =
            (0..zeta.len()).map(|i| (change(i) - plan.shift[i]) / plan.step).collect();
        // That before the first step is what its source did, as the next source is not missed there.
        let before = |i: usize| match &self.last {
            Some(last) => last.rate[i],
            None => rate[i] - missed[i] / plan.step,
        };
        let distance = |i: usize| 0.5 * step * (before(i) + rate[i]) - change(i);
        let truncation: Vec<f64> = (0..zeta.len()).map(|i| TRUNCATION * distance(i)).collect();

        let damage = self.norms(|i| zeta[i] - self.initial[i]);
        let size = self.norms(|i| missed[i] + truncation[i]);
        let rates = self.norms(|i| rate[i]);
        let ahead = (HORIZON * self.end).min(STEPS * step).min(self.end - time);
        let ratio = |j: usize| {
            let reference = damage[j] + (ahead * rates[j]).clamp(NEGLIGIBLE, FORESEEN);
            size[j] / (SHARE * self.tolerance * reference)
        };
        StepError { ratio: ratio(0).max(ratio(1)), truncation, rate }
    }

    /// The step is accepted; b changed by `load_change`.
    pub(super) fn accept(
        &mut self,
        zeta: &[f64],
        missed: &[f64],
        error: StepError,
        step: f64,
        load_change: Vec<f64>,
    ) {
        let StepError { truncation, rate, .. } = error;
        let mut change = vec![0.0; zeta.len()];
        for i in 0..zeta.len() {
            let corrected = zeta[i] + missed[i];
            change[i] = corrected - self.start[i];
            self.start[i] = corrected;
            self.left[i] += truncation[i];
            self.delay[i] += if rate[i] == 0.0 { 0.0 } else { truncation[i] / rate[i] };
        }
        self.damage = self.norms(|i| zeta[i] - self.initial[i]);
        self.error = self.norms(|i| self.left[i] + missed[i]);
        self.last = Some(Last { step, change, rate, load_change });
    }

    /// The estimated error of the last accepted ζ over the damage done.
    pub(super) fn relative_error(&self) -> f64 {
        let relative = |j: usize| self.error[j] / self.damage[j].max(NEGLIGIBLE);
        relative(0).max(relative(1))
    }

    /// By how much the node of least `zeta` may be early or late, s.
    pub(super) fn delay(&self, zeta: &[f64]) -> f64 {
        at_weakest(&self.body.partition, zeta, &self.delay).abs()
    }

    /// The largest |·| over the nodes and the mean |·| over the body of a field. Collective.
    fn norms(&self, field: impl Fn(usize) -> f64) -> [f64; 2] {
        let (mut largest, mut integral) = (0.0_f64, 0.0);
        for i in 0..self.body.partition.owned() {
            let size = field(i).abs();
            largest = largest.max(size);
            integral += self.body.node_area[i] * size;
        }
        let comm = self.body.partition.comm();
        [comm.max(largest), comm.total(integral) / self.body.area]
    }
}
