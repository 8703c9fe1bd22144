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
    law: Option<DamageLaw>,
    /// M + kκL, made when a step needs it, and its k.
    system: Option<(f64, DamageSystem)>,
}

/// What became of a damage step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Driving {
    /// The system was solved.
    Solved,
    /// No source and a uniform ζ: ζ_n = ζ_{n−1} without a solve.
    Nothing,
    /// The linear solver failed.
    Failed,
}

impl<'a> DamageStep<'a> {
    pub(super) fn new(session: &'a Session, setting: &'a Setting, phases: &'a Phases) -> Self {
        Self { session, setting, phases, law: setting.damage(), system: None }
    }

    /// The source load b of u and ζ, where there is a damage law.
    fn source(&self, u: &[f64], zeta: &[f64]) -> Option<Vec<f64>> {
        let (law, body) = (self.law?, &self.setting.body);
        Some(self.phases.time("damage source", || {
            let strain = self.setting.elasticity.strain_squared(body, u);
            source_load(body, &law, &strain, zeta)
        }))
    }

    /// About the largest |dζ/dt| that the source of u and ζ causes, 1/s.
    pub(super) fn rate(&self, u: &[f64], zeta: &[f64]) -> f64 {
        let area = &self.setting.body.node_area;
        let load = self.source(u, zeta).unwrap_or_default();
        load.iter().zip(area).map(|(b, a)| b.abs() / a).fold(0.0, f64::max)
    }

    /// Replaces ζ_{n−1} by ζ_n, `step` s later.
    pub(super) fn advance(
        &mut self,
        u: &[f64],
        zeta: &mut [f64],
        step: f64,
    ) -> Result<Driving, PetscError> {
        let (Some(law), Some(load)) = (self.law, self.source(u, zeta)) else {
            return Ok(Driving::Nothing);
        };
        if load.iter().all(|&b| b == 0.0) && zeta.iter().all(|&z| z == zeta[0]) {
            return Ok(Driving::Nothing);
        }
        let mut system = match self.system.take() {
            Some((k, system)) if k == step => system,
            Some((_, mut system)) => {
                self.phases.time("damage factor", || system.set_step(step))?;
                system
            }
            None => self.phases.time("damage factor", || {
                DamageSystem::new(self.session, &self.setting.body, law.diffusion, step)
            })?,
        };
        let solved = self.phases.time("damage solve", || system.advance(&load, zeta))?;
        self.system = Some((step, system));
        Ok(if solved { Driving::Solved } else { Driving::Failed })
    }
}
