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
pub struct Choices {
    pub(crate) solver: ChosenSolver,
    /// The damage source.
    pub source: ChosenSource,
}

impl Choices {
    /// The solver that the scene names, or the default one, and the paper's damage source. A scene that names its damage
    /// source would choose it here.
    pub fn of(scene: &Scene) -> Self {
        Self::named(scene.contact.solver_name())
    }

    /// The solver called `name` and the paper's damage source. A run tells whether there is a solver of this name.
    pub fn named(name: &str) -> Self {
        Self { solver: ChosenSolver::Named(name.to_owned()), source: ChosenSource::Fremond }
    }

    /// These choices with the contact solver called `name`.
    #[must_use]
    pub fn solver_named(self, name: &str) -> Self {
        Self { solver: ChosenSolver::Named(name.to_owned()), ..self }
    }

    /// These choices with a contact solver that another author wrote.
    #[must_use]
    pub fn solver(self, solver: Box<dyn ContactSolver>) -> Self {
        Self { solver: ChosenSolver::Own(Rc::from(solver)), ..self }
    }

    /// These choices with a damage source that another author wrote.
    #[must_use]
    pub fn law(self, source: Box<dyn DamageSource>) -> Self {
        Self { source: ChosenSource::Own(Rc::from(source)), ..self }
    }
}
