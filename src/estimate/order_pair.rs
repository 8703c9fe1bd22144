//! The displacements of a state in P1 and in P2, for the same damage.

use super::fine_solve::FineSolve;
use crate::{
    contact::SOLVERS,
    evolution::{Compliance, ContactStep, Phases, RunError},
    mesh::Order,
    petsc::Session,
    problem::{DiscreteProblem, State},
};

/// A scene in P1 and in P2 on one mesh. One of the two is the problem of a run.
pub(super) struct OrderPair<'a> {
    run: &'a DiscreteProblem,
    other: &'a DiscreteProblem,
    solve: OtherOrder<'a>,
}

/// The solver for the displacements of the other order.
enum OtherOrder<'a> {
    /// In P1 by a contact step.
    Coarse(Box<ContactStep<'a>>),
    /// In P2 by conjugate gradients, because a factor in P2 would take several times the memory of the run.
    Fine(Box<FineSolve<'a>>),
}

impl<'a> OrderPair<'a> {
    /// From the problem of a run, with its K⁻¹ and its last state, and the same problem in the other order.
    pub(super) fn new(
        session: &'a Session,
        run: &'a DiscreteProblem,
        other: &'a DiscreteProblem,
        mut compliance: Compliance<'a>,
        last: &State,
        phases: &'a Phases,
    ) -> Result<Self, RunError> {
        let solve = match run.body.order() {
            Order::Linear => {
                // Frees K, because the elements of P2 need its memory.
                compliance.keep_factor(last)?;
                OtherOrder::Fine(Box::new(FineSolve::new(session, other, compliance, last)))
            }
            Order::Quadratic => {
                drop(compliance);
                let step = ContactStep::new(session, other, SOLVERS[0], phases)?;
                OtherOrder::Coarse(Box::new(step))
            }
        };
        Ok(Self { run, other, solve })
    }

    /// The problems in P1 and P2.
    pub(super) fn problems(&self) -> [&'a DiscreteProblem; 2] {
        match self.solve {
            OtherOrder::Coarse(_) => [self.other, self.run],
            OtherOrder::Fine(_) => [self.run, self.other],
        }
    }

    /// u₁ and u₂ of a state of the run. `None` if the active nodes do not support the body. Collective.
    ///
    /// # Errors
    /// PETSc or the contact step failed, or the scene contradicts itself at the other nodes.
    pub(super) fn displacements(
        &mut self,
        state: &State,
    ) -> Result<Option<[Vec<f64>; 2]>, RunError> {
        Ok(match &mut self.solve {
            OtherOrder::Coarse(step) => {
                let solved = step.solve(0, state.time, &state.zeta)?;
                step.accept(state.time)?;
                Some([solved.state.u, state.u.clone()])
            }
            OtherOrder::Fine(solve) => solve.displacement(state)?.map(|u2| [state.u.clone(), u2]),
        })
    }
}
