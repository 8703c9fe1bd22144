//! Progress of the rounds: is it worth to go on?

use super::{
    AdaptError,
    measurement::{MeasuredError, Measurement},
};
use crate::{
    memory,
    petsc::{PetscError, Session},
};
use std::collections::{BTreeMap, BTreeSet};

/// Number of measurements between two errors that are compared. With half of it extremes are
/// left out sooner; with twice, rounds go on for errors that stay, and some end without their accuracy.
const BETWEEN: usize = 2;

/// The errors of the rounds so far, over the errors that the accuracy allows.
pub(super) struct Progress<'a> {
    session: &'a Session,
    accuracy: f64,
    /// The largest number of triangles of a run so far.
    most: usize,
    /// Per round whose mesh resolves the data of the scene: the triangles and the estimated error.
    estimates: Vec<(usize, f64)>,
    /// Per measurement: the triangles and the measured errors.
    excesses: Vec<(usize, BTreeMap<String, f64>)>,
    /// The extremes whose errors stay while the mesh becomes finer.
    grows: BTreeSet<String>,
}

impl<'a> Progress<'a> {
    pub(super) fn new(session: &'a Session, accuracy: f64) -> Self {
        let (estimates, excesses, grows) = Default::default();
        Self { session, accuracy, most: 0, estimates, excesses, grows }
    }

    /// Adds a round on `triangles` with its estimated error, if its mesh resolves the data.
    pub(super) fn estimated(&mut self, triangles: usize, error: Option<f64>) {
        self.most = self.most.max(triangles);
        self.estimates.extend(error.map(|error| (triangles, error / self.accuracy)));
    }

    /// Adds a measurement of a round on `triangles`. Extremes whose errors stay grow as the mesh is refined.
    pub(super) fn measured(&mut self, triangles: usize, mut measured: Measurement) -> Measurement {
        self.most = self.most.max(4 * triangles);
        let errors = measured.errors(&[]).into_iter();
        let errors = errors.map(|error| (error.excess(self.accuracy), error.name));
        self.excesses.push((triangles, errors.map(|(excess, name)| (name, excess)).collect()));
        let stay = measured.extremes().iter().filter(|name| self.stays(name));
        let stay: Vec<String> = stay.cloned().collect();
        self.grows.extend(stay);
        measured.leave_out(&self.grows);
        measured
    }

    /// Why no more rounds can reach the accuracy, if the largest error stays.
    pub(super) fn stuck(&self, errors: &[MeasuredError]) -> Option<String> {
        let is_missed = |error: &&MeasuredError| error.excess(self.accuracy) > 1.0;
        let Some(worst) = errors.first().filter(is_missed) else { return self.not_of_the_mesh() };
        self.stays(&worst.name).then(|| {
            format!(
                "the error of {} stays while the mesh becomes finer, as at a singular point; \
                 --accuracy-of NAME,… asks for others",
                worst.name
            )
        })
    }

    /// Whether the error of `name` is too large and has not become half of what it was with an eighth of the triangles,
    /// or two measurements before. Only measurements count in which it was too large: after each of them the triangles
    /// that cause it became smaller. Of first order it would be a third.
    fn stays(&self, name: &str) -> bool {
        let [earlier @ .., (triangles, last)] = &self.excesses[..] else { return false };
        let missed = |of: &BTreeMap<String, f64>| of.get(name).copied().filter(|of| *of > 1.0);
        let Some(last) = missed(last) else { return false };
        let earlier = earlier.iter().filter_map(|(count, of)| Some((*count, missed(of)?)));
        let earlier: Vec<(usize, f64)> = earlier.collect();
        let much_coarser = earlier.iter().filter(|(count, _)| 8 * count <= *triangles);
        let some_before = earlier.len().checked_sub(BETWEEN).map(|i| &earlier[i]);
        let before = much_coarser.chain(some_before).map(|(_, excess)| *excess);
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

    /// Checks that a run on `triangles` fits into the memory. Earlier runs have needed the peak memory of this process,
    /// and the need grows in proportion. Collective.
    pub(super) fn check_memory(&self, triangles: usize) -> Result<(), AdaptError> {
        /// Below this number most memory is that of the libraries.
        const MANY: usize = 20_000;
        let comm = self.session.comm();
        let growth = (triangles as f64 / self.most as f64 - 1.0) * comm.total(memory::peak());
        let missing = growth - comm.total(memory::available());
        let missing = if self.most >= MANY { missing } else { 0.0 };
        Ok(PetscError::if_short(missing, &format!("for a mesh of {triangles} triangles"))?)
    }
}
