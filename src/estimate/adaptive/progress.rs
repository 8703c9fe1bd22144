//! Progress of the rounds: is it worth to go on?

use super::measurement::{MeasuredError, Measurement};
use std::collections::{BTreeMap, BTreeSet};

/// An error is compared with those of this number of measurements before it.
///
/// Tuned on 273 runs of the handbook. Half: five end with "NOT reached", although finer meshes reach the accuracy.
/// Twice: nothing changes in the 13 adapted runs.
const BEFORE: usize = 4;

/// The errors of the rounds so far, over the errors that the accuracy allows.
pub(super) struct Progress {
    accuracy: f64,
    /// Per round whose mesh resolves the data of the scene: the triangles and the estimated error.
    estimates: Vec<(usize, f64)>,
    /// Per measurement: the triangles and the measured errors.
    excesses: Vec<(usize, BTreeMap<String, f64>)>,
    /// The extremes whose errors stay while the mesh becomes finer.
    unsettled: BTreeSet<String>,
}

impl Progress {
    pub(super) fn new(accuracy: f64) -> Self {
        let (estimates, excesses, unsettled) = Default::default();
        Self { accuracy, estimates, excesses, unsettled }
    }

    /// Adds a round on `triangles` with its estimated error, if its mesh resolves the data.
    pub(super) fn estimated(&mut self, triangles: usize, error: Option<f64>) {
        self.estimates.extend(error.map(|error| (triangles, error / self.accuracy)));
    }

    /// Adds a measurement of a round on `triangles`. Extremes whose errors stay grow as the mesh is refined.
    pub(super) fn measured(&mut self, triangles: usize, mut measured: Measurement) -> Measurement {
        let errors = measured.errors(&[]).into_iter();
        let errors = errors.map(|error| (error.excess(self.accuracy), error.name));
        self.excesses.push((triangles, errors.map(|(excess, name)| (name, excess)).collect()));
        let stay = measured.extremes().iter().filter(|name| self.stays(name));
        let stay: Vec<String> = stay.cloned().collect();
        self.unsettled.extend(stay);
        measured.leave_out(&Vec::from_iter(self.unsettled.iter().cloned()));
        measured
    }

    /// Why no more rounds can reach the accuracy, if the largest error stays.
    pub(super) fn stuck(&self, errors: &[MeasuredError]) -> Option<String> {
        let is_missed = |error: &&MeasuredError| error.excess(self.accuracy) > 1.0;
        let Some(worst) = errors.first().filter(is_missed) else { return self.not_of_the_mesh() };
        self.stays(&worst.name).then(|| {
            format!(
                "the error of {} stays while the mesh becomes finer; \
                 --accuracy-of NAME,… asks for others",
                worst.name
            )
        })
    }

    /// Whether the error of `name` is too large and has not become half of what it was with an eighth of the triangles,
    /// or in some measurements before. Only measurements count in which it was too large: after each of them the triangles
    /// that cause it became smaller. Of first order it would be a third.
    fn stays(&self, name: &str) -> bool {
        let [earlier @ .., (triangles, last)] = &self.excesses[..] else { return false };
        let missed = |of: &BTreeMap<String, f64>| of.get(name).copied().filter(|of| *of > 1.0);
        let Some(last) = missed(last) else { return false };
        let earlier = earlier.iter().filter_map(|(count, of)| Some((*count, missed(of)?)));
        let earlier: Vec<(usize, f64)> = earlier.collect();
        let much_coarser = earlier.iter().filter(|(count, _)| 8 * count <= *triangles);
        let some = earlier.len().checked_sub(BEFORE).map_or(&[][..], |first| &earlier[first..]);
        let before = much_coarser.chain(some).map(|(_, excess)| *excess);
        before.reduce(f64::max).is_some_and(|largest| last > 0.5 * largest)
    }

    /// Whether the estimated error has not become half of what it was with a sixty-fourth of the triangles. A mesh that misses
    /// data of the scene, such as a peak of a foundation, estimates the error of another problem and does not count.
    fn not_of_the_mesh(&self) -> Option<String> {
        let (triangles, last) = *self.estimates.last().filter(|(_, excess)| *excess > 1.0)?;
        let before = self.estimates.iter().filter(|(count, _)| 64 * count <= triangles);
        let largest = before.map(|(_, excess)| *excess).reduce(f64::max)?;
        (last > 0.5 * largest).then(|| {
            "the estimated error does not fall as the mesh becomes finer: rounding or the time steps cause it"
                .to_owned()
        })
    }
}
