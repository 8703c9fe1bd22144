//! Error bars of the figures, from their values on a sequence of meshes.
//!
//! With F_1 … F_m on ever finer meshes, on which u has the relative errors η_1 … η_m in the energy norm, the bar of the
//! figure F_n on the mesh of the answer is
//!
//! 1.5 (max(|F_n − F_m|, |F_{m−1} − F_m|, min_{i<n} ρ_i |F_i − F_m|) + |F_m − F_{m−1}| r/(1 − r)),
//! r = η_m/η_{m−1},   ρ_i = min(1, (η_n/η_i)²).
//!
//! The answer on the finest mesh may be kept from the measurement before. Then F_{m−1} is the figure on the mesh that was bisected for that
//! measurement, which is older than the mesh n.
//!
//! The last term is the sum of all further changes if they fall like η. The error of a figure is a product of two errors in
//! the energy norm, hence ρ. The change between two meshes may vanish by chance, but hardly that from all meshes before.

use super::{Answer, Extreme, sizes::size_at};
use crate::{
    advice::SEEN,
    observe::{Dimension, Figure},
};
use std::f64::consts::FRAC_1_SQRT_2;

/// The safety factor of a bar, and the larger one of the bar of a stress: on 40 bodies of a user 10 % of the bars of
/// extreme stresses failed with 1.5, and 7 % with 2.
///
/// Tuned on 720 bars of the handbook, of which 8 fail with 1.5 for all. 1: 127 fail. 3: four fail.
const SAFETY: [f64; 2] = [1.5, 2.0];
/// The largest r, 2^(−1/4): at the tip of a slit with one clamped and one free side u ~ r^λ has Re λ = 1/4 (Williams, J. Appl. Mech.
/// 19, 1952), the least of one material, and the error in the energy norm falls like h^λ.
const SLOWEST: f64 = 0.840_896_415_253_714_5;

/// The answers on meshes from the coarsest to the finest one.
pub(super) struct Sequence<'a> {
    answers: Vec<&'a Answer>,
    /// The number of the mesh of the answer, and of the mesh that was bisected to the finest one.
    answer: usize,
    bisected: usize,
    /// r.
    rate: f64,
}

impl<'a> Sequence<'a> {
    /// From the answers on the meshes `before` that of the `answer`, on this one and on the `finer` ones, at least one. Meshes
    /// on which a run stops, and this one not, do not count. The mesh of the answer, or else the last one `before` it, was
    /// bisected to the first finer one.
    pub(super) fn new(
        before: &'a [Answer],
        answer: &'a Answer,
        finer: &'a [Answer],
        is_bisected: bool,
    ) -> Self {
        let is_like = |other: &&Answer| other.stop.is_some() == answer.stop.is_some();
        let mut answers: Vec<&Answer> = before.iter().filter(is_like).collect();
        let number = answers.len();
        answers.push(answer);
        answers.extend(finer);
        let bisected = answers.len() - if is_bisected { 2 } else { 3 };
        let [coarse, fine] = [bisected, answers.len() - 1].map(|number| answers[number].error);
        let rate = if fine < SLOWEST * coarse { fine / coarse } else { SLOWEST };
        Self { answers, answer: number, bisected, rate }
    }

    /// The same meshes, if the changes fall like h^½ at most, as at a crack: two meshes alone do not show how they fall.
    pub(super) fn slower(&self) -> Self {
        Self { answers: self.answers.clone(), rate: self.rate.max(FRAC_1_SQRT_2), ..*self }
    }

    /// Is a mesh before so much coarser that it is the third one? With 1 in place of 2, four more of those 720 bars fail.
    pub(super) fn has_coarser(&self) -> bool {
        let [before @ .., answer] = &self.answers[..=self.answer] else { return false };
        before.iter().any(|other| other.error >= 2.0 * answer.error)
    }

    /// The answer whose bars these are.
    pub(super) fn answer(&self) -> &Answer {
        self.answers[self.answer]
    }

    /// r.
    pub(super) fn rate(&self) -> f64 {
        self.rate
    }

    /// The bar with the factor `safety`, from the `difference` of a figure between an answer and the finest one.
    fn bar(&self, safety: f64, difference: impl Fn(&Answer, &Answer) -> f64) -> f64 {
        let [coarser @ .., finest] = &self.answers[..] else { return 0.0 };
        let (before, from_answer) = coarser.split_at(self.answer);
        let weighted = before.iter().map(|answer| {
            let ratio = (from_answer[0].error / answer.error).min(1.0);
            ratio * ratio * difference(answer, finest)
        });
        let changes = from_answer.iter().map(|answer| difference(answer, finest));
        let largest = changes.chain(weighted.reduce(f64::min)).fold(0.0, f64::max);
        let last = difference(self.answers[self.bisected], finest);
        safety * (largest + last * self.rate / (1.0 - self.rate))
    }

    /// The bar of the `figure` of number `i`. A largest value changes where it is found, too: where many points have equal values, the
    /// largest ones on two meshes may be equally wrong.
    pub(super) fn error(&self, i: usize, figure: &Figure) -> f64 {
        let safety = SAFETY[usize::from(figure.dimension == Dimension::Stress)];
        self.bar(safety, |coarse, fine| {
            let [a, b] = [coarse, fine].map(|of| of.values[i].value);
            // A first contact is missing on both meshes, or on one of them.
            if a.is_nan() || b.is_nan() {
                return if a.is_nan() == b.is_nan() { 0.0 } else { f64::INFINITY };
            }
            let there = fine.points[i].iter().filter(|(at, _)| Some(*at) == coarse.values[i].at);
            let there = there.map(|(_, size)| (figure.size(a) - size).abs()).reduce(f64::min);
            (a - b).abs().max(there.unwrap_or(0.0))
        })
    }

    /// The bar of the figure `i`, a length of contact. A change within the open parts is no error beyond them.
    pub(super) fn error_of_length(&self, i: usize) -> f64 {
        let change = |a: &Answer, b: &Answer| {
            (a.values[i].value - b.values[i].value).abs() - a.open - b.open
        };
        SAFETY[0] * self.answers[self.answer].open
            + self.bar(SAFETY[0], |a, b| change(a, b).max(0.0))
    }

    /// The bar of the time of ζ_*, and this time, s. It is infinite if the answer or a finer mesh does not stop; `None` if none
    /// of them stops.
    pub(super) fn stop(&self) -> Option<[f64; 2]> {
        let times = self.answers[self.answer..].iter().map(|answer| answer.stop);
        let time = times.clone().flatten().last()?;
        if times.clone().any(|time| time.is_none()) {
            return Some([f64::INFINITY, time]);
        }
        Some([
            self.bar(SAFETY[0], |a, b| a.stop.zip(b.stop).map_or(0.0, |(a, b)| (a - b).abs())),
            time,
        ])
    }

    /// Does the figure `i` converge over the meshes, an extreme at the place of `extreme` on the finest mesh? Its change per halving of the size
    /// of the triangles there is small, or falls: for a singular stress r^(λ−1) it grows, and for ln r it stays. Near a
    /// singular point only meshes bisected everywhere contradict theory. Elsewhere an extreme converges until meshes of
    /// different sizes show that it grows.
    pub(super) fn converges(&self, i: usize, extreme: &Extreme) -> bool {
        if extreme.unresolved.is_some() {
            return false;
        }
        let sizes = self.answers.iter().map(|answer| size_at(&answer.mesh, extreme.at));
        let (sizes, finest) = (Vec::from_iter(sizes), self.answers.len() - 1);
        let change = |from: usize, to: usize| {
            let change = self.answers[to].values[i].value - self.answers[from].values[i].value;
            change.abs() / (sizes[from] / sizes[to]).log2()
        };
        let last = change(finest - 1, finest);
        if last <= SEEN * self.answers[finest].values[i].value.abs() {
            return true;
        }
        let first = if extreme.singular.is_some() { self.answer } else { 0 };
        let coarser = |k: &usize| sizes[*k] > 1.5 * sizes[finest - 1];
        match (first..finest - 1).rev().find(coarser) {
            Some(before) => last <= SLOWEST * change(before, finest - 1),
            None => extreme.singular.is_none(),
        }
    }
}
