//! Does the loop go on? The errors so far say so, and the reason why it ends is one value.

use super::{
    marking::Estimate,
    measurement::{MeasuredError, Measurement},
};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of meshes.
const MAX_ROUNDS: usize = 25;
/// An error is compared with those of this number of measurements before it.
///
/// Tuned on 273 runs of the handbook. Half: five end with "NOT reached", although finer meshes reach the accuracy.
/// Twice: nothing changes in the 13 adapted runs.
const BEFORE: usize = 4;

/// The reason why the loop ends. Its message says why the accuracy is not reached.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum End {
    /// All measured errors are within the accuracy.
    #[error("the accuracy is reached")]
    Reached,
    /// A finer mesh would take more memory or time than is allowed.
    #[error("{0}")]
    Limit(String),
    /// A run on a finer mesh failed, or a triangle cannot be divided.
    #[error("{0}")]
    Failed(String),
    /// An accuracy is required of an extreme that does not converge over the meshes.
    #[error("{0} changes with every finer mesh, as a singular stress does; ask for other figures")]
    NotConverged(String),
    /// The error of a figure stays.
    #[error(
        "the error of {0} stays while the mesh becomes finer; --accuracy-of NAME,… asks for others"
    )]
    Stays(String),
    /// The estimated error stays.
    #[error(
        "the estimated error does not fall as the mesh becomes finer: rounding or the time steps cause it"
    )]
    NotOfTheMesh,
    /// There were too many meshes.
    #[error("the limit on rounds is reached")]
    Rounds,
}

/// The errors so far, over the errors that the accuracy allows.
pub(super) struct Progress {
    accuracy: f64,
    /// Per mesh that resolves the data of the scene: the triangles and the estimated error.
    estimates: Vec<(usize, f64)>,
    /// Per measurement: the triangles and the measured errors.
    errors: Vec<(usize, BTreeMap<String, f64>)>,
    /// The extremes whose errors stay while the mesh becomes finer.
    not_converged: BTreeSet<String>,
}

impl Progress {
    pub(super) fn new(accuracy: f64) -> Self {
        let (estimates, errors, not_converged) = Default::default();
        Self { accuracy, estimates, errors, not_converged }
    }

    /// Adds a mesh with its estimated error, if it resolves the data.
    pub(super) fn estimated(&mut self, estimate: &Estimate) {
        if estimate.resolves_data() {
            let triangles = estimate.mesh.triangles.len();
            self.estimates.push((triangles, estimate.error / self.accuracy));
        }
    }

    /// Adds a measurement on the mesh of an estimate. Extremes whose errors stay grow as the mesh is refined.
    pub(super) fn measured(
        &mut self,
        Estimate { mesh, run, .. }: &Estimate,
        mut measured: Measurement,
    ) -> Measurement {
        let errors = measured.errors(&[]).into_iter();
        let errors = errors.map(|error| (error.over_accuracy(self.accuracy), error.name));
        let errors = (mesh.triangles.len(), errors.map(|(over, name)| (name, over)).collect());
        self.errors.push(errors);
        let extremes = run.problem.figures.iter().filter(|of| of.is_extreme());
        let stay = extremes.map(|of| &of.name).filter(|name| self.stays(name));
        let stay = Vec::from_iter(stay.cloned());
        self.not_converged.extend(stay);
        measured.leave_out(&Vec::from_iter(self.not_converged.iter().cloned()), run);
        measured
    }

    /// Does the loop go on from a mesh with these errors, number `rounds` of those tried? If not, this is the reason.
    pub(super) fn verdict(
        &self,
        estimate: &Estimate,
        measured: Option<&Measurement>,
        rounds: usize,
    ) -> Result<(), End> {
        let names = &estimate.scene().accuracy_of;
        let errors = measured.map_or_else(Vec::new, |of| of.errors(names));
        let not_converged = measured.and_then(|of| of.without_accuracy(names));
        let within = errors.first().is_some_and(|worst| worst.over_accuracy(self.accuracy) <= 1.0);
        match not_converged
            .or_else(|| if within { Some(End::Reached) } else { self.stuck(&errors) })
        {
            Some(end) => Err(end),
            None if rounds >= MAX_ROUNDS => Err(End::Rounds),
            None => Ok(()),
        }
    }

    /// Why no further mesh can reach the accuracy, if the largest error stays.
    fn stuck(&self, errors: &[MeasuredError]) -> Option<End> {
        let is_missed = |error: &&MeasuredError| error.over_accuracy(self.accuracy) > 1.0;
        match errors.first().filter(is_missed) {
            Some(worst) => self.stays(&worst.name).then(|| End::Stays(worst.name.clone())),
            None => self.is_not_of_the_mesh().then_some(End::NotOfTheMesh),
        }
    }

    /// Whether the error of `name` is too large and has not become half of what it was with an eighth of the triangles,
    /// or in some measurements before. Only measurements count in which it was too large: after each of them the triangles
    /// that cause it became smaller. Of first order it would be a third.
    fn stays(&self, name: &str) -> bool {
        let [earlier @ .., (triangles, last)] = &self.errors[..] else { return false };
        let missed = |of: &BTreeMap<String, f64>| of.get(name).copied().filter(|of| *of > 1.0);
        let Some(last) = missed(last) else { return false };
        let earlier = earlier.iter().filter_map(|(count, of)| Some((*count, missed(of)?)));
        let earlier: Vec<(usize, f64)> = earlier.collect();
        let much_coarser = earlier.iter().filter(|(count, _)| 8 * count <= *triangles);
        let some = earlier.len().checked_sub(BEFORE).map_or(&[][..], |first| &earlier[first..]);
        let before = much_coarser.chain(some).map(|(_, over)| *over);
        before.reduce(f64::max).is_some_and(|largest| last > 0.5 * largest)
    }

    /// Whether the estimated error has not become half of what it was with a sixty-fourth of the triangles. A mesh that misses
    /// data of the scene, such as a peak of a foundation, estimates the error of another problem and does not count.
    fn is_not_of_the_mesh(&self) -> bool {
        let Some(&(triangles, last)) = self.estimates.last() else { return false };
        let before = self.estimates.iter().filter(|(count, _)| 64 * count <= triangles);
        let largest = before.map(|(_, over)| *over).reduce(f64::max);
        last > 1.0 && largest.is_some_and(|largest| last > 0.5 * largest)
    }
}
