//! Quantities read from a state: figures with their places, contact along its line, forces of supports, stresses.
//!
//! - [`ObservedProblem`]: a discrete problem with the figures, supports and probes that a run reads from its states;
//! - [`Figures`]: the list of all printed numbers; [`Bar`]: the error bar of such a number;
//! - [`Supports`] with the [`ContactLine`]: resultants, and the rows of `contact.csv`;
//! - [`NodalStress`]: continuous stresses, for extremes and pictures.
//!
//! What crosses the door: `evolution` observes each step, and `output` writes fields and rows of contact. Nothing here changes a
//! state. [`Supports`] divide the reaction at a node between boundaries.

mod away;
mod contact_figures;
mod contact_line;
mod corners;
mod figures;
mod first_contact;
mod mean_displacement;
mod nodal_stress;
mod probe;
mod supports;

pub(crate) use contact_figures::{ContactFigures, rows_of};
pub use contact_line::{ContactLine, ContactRow};
pub use corners::Rays;
pub use figures::{Bar, Dimension, FIRST_CONTACT, Figure, Figures, Of, Value, in_words};
pub(crate) use figures::{NEGLIGIBLE_DAMAGE, Observation, SHOWN_AS_ZERO};
pub use first_contact::FirstContact;
pub use nodal_stress::{NodalStress, Strained, principal, principal_direction};
pub use supports::Supports;

use crate::{
    fem::Subdomain,
    mesh::{Lines, Mesh},
    petsc::{PetscError, Session},
    problem::{DiscreteProblem, SetupError},
    scene::Scene,
};
use away::Region;
use corners::LoadedCorner;
use mean_displacement::Means;
use probe::Probes;
use std::{
    ops::{Deref, DerefMut},
    sync::{Arc, OnceLock},
};

/// A discrete problem with its figures, supports and probes. It dereferences to the [`DiscreteProblem`].
#[derive(Debug)]
pub struct ObservedProblem {
    problem: DiscreteProblem,
    /// The boundaries that support the body.
    pub supports: Supports,
    probes: Probes,
    means: Means,
    /// Everything that a run prints.
    pub figures: Figures,
    /// Where the figures `…_away` are taken.
    away: Region,
    nodal_stress: OnceLock<Arc<NodalStress>>,
    /// The corners at which stresses may depend on the direction.
    corners: OnceLock<Vec<LoadedCorner>>,
}

impl ObservedProblem {
    /// Binds `scene` to `mesh`, see [`DiscreteProblem::new`], and finds its supports and probes there.
    ///
    /// # Errors
    /// The scene does not fit the mesh, contradicts itself, or its load drives a rigid motion from the start.
    pub fn new(scene: Scene, mesh: Mesh) -> Result<Self, SetupError> {
        let problem = DiscreteProblem::new(scene, mesh)?;
        let lines = Lines::boundary(&problem.body.mesh);
        let supports = Supports::new(&problem, &lines);
        let away = Region::new(&problem)?;
        Ok(Self {
            probes: Probes::new(problem.scene(), &problem.body)?,
            means: Means::new(problem.scene(), &problem.body, &lines),
            figures: Figures::of(&problem, &supports, &away),
            away,
            nodal_stress: OnceLock::new(),
            corners: OnceLock::new(),
            supports,
            problem,
        })
    }

    /// Restricts a problem that every rank has made to this rank's subdomain. Collective.
    ///
    /// # Errors
    /// PETSc cannot divide the mesh.
    pub fn restrict(self, session: &Session) -> Result<Self, PetscError> {
        let Some(subdomain) = Subdomain::new(session, &self.body)? else { return Ok(self) };
        Ok(Self {
            supports: self.supports.restrict(&subdomain),
            probes: self.probes.restrict(&self.body, &subdomain),
            means: self.means.restrict(&subdomain),
            nodal_stress: OnceLock::new(),
            corners: OnceLock::new(),
            problem: self.problem.restrict(subdomain),
            ..self
        })
    }
}

impl Deref for ObservedProblem {
    type Target = DiscreteProblem;

    fn deref(&self) -> &DiscreteProblem {
        &self.problem
    }
}

impl DerefMut for ObservedProblem {
    fn deref_mut(&mut self) -> &mut DiscreteProblem {
        &mut self.problem
    }
}
