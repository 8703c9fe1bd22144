//! The damage step (28).

use super::{Phases, Setting};
use crate::{
    fem::{DamageSystem, source_load},
    model::DamageLaw,
    petsc::{PetscError, Session},
};

/// ζ_n from ζ_{n−1} and u_{n−1}; does nothing for a material that is not damaged.
pub(super) struct DamageStep<'a> {
    session: &'a Session,
    setting: &'a Setting,
    phases: &'a Phases,
    law: Option<(DamageLaw, f64)>,
    /// M + kκL, made when the first step needs it.
    system: Option<DamageSystem>,
}

/// What became of a damage step.
pub(super) enum Driving {
    /// The system was solved.
    Solved,
    /// No source and a uniform ζ: ζ_n = ζ_{n−1} without a solve.
    Nothing,
    /// The linear solver failed.
    Failed,
}

impl<'a> DamageStep<'a> {
    pub(super) fn new(
        session: &'a Session,
        setting: &'a Setting,
        phases: &'a Phases,
    ) -> Result<Self, PetscError> {
        Ok(Self { session, setting, phases, law: setting.damage(), system: None })
    }

    /// Replaces ζ_{n−1} by ζ_n.
    pub(super) fn advance(&mut self, u: &[f64], zeta: &mut [f64]) -> Result<Driving, PetscError> {
        let Some((law, step)) = self.law else { return Ok(Driving::Nothing) };
        let body = &self.setting.body;
        let load = self.phases.time("damage source", || {
            let strain = self.setting.elasticity.strain_squared(body, u);
            source_load(body, &law, &strain, zeta)
        });
        if load.iter().all(|&b| b == 0.0) && zeta.iter().all(|&z| z == zeta[0]) {
            return Ok(Driving::Nothing);
        }
        let system = match self.system.take() {
            Some(system) => system,
            None => self.phases.time("damage factor", || {
                DamageSystem::new(self.session, body, law.diffusion, step)
            })?,
        };
        let system = self.system.insert(system);
        let solved = self.phases.time("damage solve", || system.advance(&load, zeta))?;
        Ok(if solved { Driving::Solved } else { Driving::Failed })
    }
}
