//! The loads, prescribed displacements and gaps at one time.

use super::{DiscreteProblem, SetupError};
use crate::{ROUNDING, contact::Bound};
use nalgebra::DVector;

/// The data of the contact problem (26) at one time.
#[derive(Debug)]
pub(crate) struct LoadCase {
    /// t, s.
    pub(crate) time: f64,
    /// Nodal loads f, N per metre of thickness, and their work on the motions that contact resists.
    pub(crate) load: Vec<f64>,
    pub(crate) work: DVector<f64>,
    /// The values of all constraints, m, and the unknowns c that they prescribe, 0 elsewhere.
    pub(crate) values: Vec<f64>,
    pub(crate) c_prescribed: Vec<f64>,
    /// The bounds on the other unknowns.
    pub(crate) bounds: Vec<Bound>,
}

impl DiscreteProblem {
    /// Nodal loads at `time`, N per metre of thickness. Rounding, as in sin(pi) = 1.2e-16, counts as zero.
    pub fn load(&self, time: f64) -> Vec<f64> {
        let mut load = self.loads.at(&self.body, time);
        if self.body.nodes.partition.norm(&load, 2) <= ROUNDING * self.largest_load {
            load.fill(0.0);
        }
        load
    }

    /// The data of (26) at `time`.
    ///
    /// # Errors
    /// The load is not finite or drives an unconstrained rigid motion; prescribed values are not finite, contradict
    /// each other or penetrate the obstacle; or the obstacles leave a node no space.
    pub(crate) fn load_case(&self, time: f64) -> Result<LoadCase, SetupError> {
        let load = self.motions.balanced(&self.body, self.checked_load(time)?);
        let work = self.motions.work(&self.body, |i| [load[2 * i], load[2 * i + 1]]);
        let values = self.loads.values_at(time);
        let (c_prescribed, bounds) = self.prescribed_and_bounds(time, &values)?;
        Ok(LoadCase { time, load, work, values, c_prescribed, bounds })
    }

    /// The nodal loads at `time`, if they are finite and drive no unconstrained rigid motion. Collective.
    pub(super) fn checked_load(&self, time: f64) -> Result<Vec<f64>, SetupError> {
        let load = self.load(time);
        if !self.body.nodes.partition.comm().all(load.iter().all(|f| f.is_finite())) {
            return Err(self.not_finite(time));
        }
        let driven = |source| SetupError::Driven { scene: self.scene.path.clone(), time, source };
        let error = || self.loads.resultant_error(&self.body, time);
        self.motions.check(&self.body, &load, error).map_err(driven)?;
        Ok(load)
    }

    /// The error for a value that is not finite at `time`. It names the value if this rank finds it.
    fn not_finite(&self, time: f64) -> SetupError {
        match self.scene.check_values(&self.body.mesh, &[time]) {
            Err(error) => error.into(),
            Ok(()) => SetupError::NotFinite { scene: self.scene.path.clone(), time },
        }
    }

    /// The prescribed unknowns and the bounds on the others at `time`, from the values of all rows.
    pub(super) fn prescribed_and_bounds(
        &self,
        time: f64,
        values: &[f64],
    ) -> Result<(Vec<f64>, Vec<Bound>), SetupError> {
        if !values.iter().all(|value| value.is_finite()) {
            return Err(self.not_finite(time));
        }
        let (scene, time) = (self.scene.path.clone(), self.scene.time.map(|_| time));
        let constraint = |source| SetupError::Constraint { scene, time, source };
        self.constraints.prescribed_and_bounds(values, &self.body.nodes.points).map_err(constraint)
    }
}
