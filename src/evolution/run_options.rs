//! The exchangeable parts of a run.

use crate::{
    contact::{ChosenSolver, ContactSolver},
    model::{ChosenSource, DamageSource},
    scene::Scene,
};
use std::rc::Rc;

/// The contact solver and the damage source of a run: ours, or those of other authors. Runs of one scene on several
/// meshes share them.
#[derive(Clone)]
pub struct RunOptions {
    pub(crate) solver: ChosenSolver,
    /// The damage source.
    pub source: ChosenSource,
}

impl RunOptions {
    /// The solver that the scene names, or the default one, and the paper's damage source. A scene that names its damage
    /// source would choose it here. A run reports an error if there is no solver of this name.
    pub fn of(scene: &Scene) -> Self {
        let solver = ChosenSolver::Named(scene.contact.solver_name().to_owned());
        Self { solver, source: ChosenSource::Fremond }
    }

    /// These options with the contact solver called `name`.
    #[must_use]
    pub fn solver_named(self, name: &str) -> Self {
        Self { solver: ChosenSolver::Named(name.to_owned()), ..self }
    }

    /// These options with a contact solver that another author wrote.
    #[must_use]
    pub fn solver(self, solver: Box<dyn ContactSolver>) -> Self {
        Self { solver: ChosenSolver::Own(Rc::from(solver)), ..self }
    }

    /// These options with a damage source that another author wrote.
    #[must_use]
    pub fn law(self, source: Box<dyn DamageSource>) -> Self {
        Self { source: ChosenSource::Own(Rc::from(source)), ..self }
    }
}
