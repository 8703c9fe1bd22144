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
    observe::{ContactRow, rows_of},
};
use rustc_hash::FxHashMap as HashMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// The safety factor of a bar, and the larger one of the bar of a stress: on 40 bodies of a user 10 % of the bars of
/// extreme stresses failed with 1.5, and 7 % with 2.
///
/// Tuned on 720 bars of the handbook, of which 8 fail with 1.5 for all. 1: 127 fail. 3: four fail.
const SAFETY: [f64; 2] = [1.5, 2.0];
/// The largest r, that of h^0.23.
///
/// Tuned on 720 bars of the handbook. 0.7: the same bars hold. 0.925: the same bars hold.
const SLOWEST: f64 = 0.85;

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

    /// r.
    pub(super) fn rate(&self) -> f64 {
        self.rate
    }

    /// The bar with the factor `safety`, from the `difference` of a figure between an answer and the finest one, by their numbers.
    fn bar(&self, safety: f64, difference: impl Fn(usize, usize) -> f64) -> f64 {
        let (finest, own) = (self.answers.len() - 1, self.answers[self.answer].error);
        let weighted = (0..self.answer).map(|before| {
            let ratio = (own / self.answers[before].error).min(1.0);
            ratio * ratio * difference(before, finest)
        });
        let changes = (self.answer..finest).map(|answer| difference(answer, finest));
        let largest = changes.chain(weighted.reduce(f64::min)).fold(0.0, f64::max);
        let last = difference(self.bisected, finest);
        safety * (largest + last * self.rate / (1.0 - self.rate))
    }

    /// The bar of the figure `i`, which may be a stress.
    pub(super) fn error(&self, i: usize, is_stress: bool) -> f64 {
        let value = |k: usize| self.answers[k].values[i];
        self.bar(SAFETY[usize::from(is_stress)], |a, b| (value(a) - value(b)).abs())
    }

    /// The bar of the figure `i`, the length of contact of a `foundation` or of all. A change within the open parts is no error beyond
    /// them.
    pub(super) fn error_of_length(&self, i: usize, foundation: Option<&str>) -> f64 {
        let change = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|k| self.answers[k]);
            ((a.values[i] - b.values[i]).abs() - a.open - b.open).max(0.0)
        };
        let of_ends = SAFETY[0] * self.answers[self.answer].open;
        let of_lengths = of_ends + self.bar(SAFETY[0], change);
        of_lengths.max(self.grazing_length(foundation))
    }

    /// The largest part of the length of contact on a `foundation`, or on all, that the errors of u and p add or take away, m. The error
    /// δ of the opening o = g − u·ν may close a node with o ≤ δ; an active node with a pressure at most as large as its error may be open.
    ///
    /// Between two nodes the margins o − δ, and p minus its error, are linear: the foundation is open where the first one is positive, and
    /// closed where the second one is. An edge with one active node counts half in the length.
    fn grazing_length(&self, foundation: Option<&str>) -> f64 {
        let rows = |k: usize| {
            let rows = &self.answers[k].rows[..];
            foundation.map_or(rows, |name| rows_of(rows, name))
        };
        let key = |row: &ContactRow| (row.boundary.clone(), [row.x, row.y].map(f64::to_bits));
        let by_place = |k: usize| rows(k).iter().map(|row| (key(row), row)).collect();
        let by_place = (0..self.answers.len()).map(by_place);
        let by_place: Vec<HashMap<_, &ContactRow>> = by_place.collect();
        // The margins of the opening and of the pressure; that of the other state is zero without an error.
        let margins = |row: &ContactRow| {
            let of: [fn(&ContactRow) -> f64; 2] = [|row| row.gap, |row| row.pressure];
            of.map(|of| {
                let key = key(row);
                let value = |k: usize| by_place[k].get(&key).map(|row| of(row));
                let change =
                    |a, b| value(a).zip(value(b)).map_or(0.0, |(a, b): (f64, f64)| (a - b).abs());
                of(row) - self.bar(SAFETY[0], change)
            })
        };
        let margins = Vec::from_iter(rows(self.answer).iter().map(|row| (row, margins(row))));
        let [mut closing, mut opening] = [0.0, 0.0];
        for pair in margins.windows(2) {
            let [(a, of_a), (b, of_b)] = [pair[0], pair[1]];
            let length = b.arc_length - a.arc_length;
            if (&a.boundary, a.part) == (&b.boundary, b.part) && length > 0.0 {
                let closed = 0.5 * f64::from(a.active + b.active);
                let [open, sure] = [0, 1].map(|i| positive_part(of_a[i], of_b[i]));
                closing += length * (1.0 - open - closed).max(0.0);
                opening += length * (closed - sure).max(0.0);
            }
        }
        f64::max(closing, opening)
    }

    /// The bar of the time of ζ_*, and this time, s. It is infinite if the answer or a finer mesh does not stop; `None` if none
    /// of them stops.
    pub(super) fn stop(&self) -> Option<[f64; 2]> {
        let times = self.answers[self.answer..].iter().map(|answer| answer.stop);
        let time = times.clone().flatten().last()?;
        if times.clone().any(|time| time.is_none()) {
            return Some([f64::INFINITY, time]);
        }
        let stop = |k: usize| self.answers[k].stop;
        let change = |a, b| stop(a).zip(stop(b)).map_or(0.0, |(a, b): (f64, f64)| (a - b).abs());
        Some([self.bar(SAFETY[0], change), time])
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
            let change = self.answers[to].values[i] - self.answers[from].values[i];
            change.abs() / (sizes[from] / sizes[to]).log2()
        };
        let last = change(finest - 1, finest);
        if last <= SEEN * self.answers[finest].values[i].abs() {
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

/// The part of an edge on which the linear function with these values at its ends is positive.
fn positive_part(a: f64, b: f64) -> f64 {
    match [a > 0.0, b > 0.0] {
        [false, false] => 0.0,
        [true, true] => 1.0,
        _ => a.max(b) / (a - b).abs(),
    }
}
