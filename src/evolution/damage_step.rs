//! The damage step (28).

use super::{Phases, Setting};
use crate::{
    fem::{DamageSystem, source, source_load},
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Driving {
    /// The system was solved; with the least φ, 1/s.
    Solved(f64),
    /// No source and a uniform ζ: ζ_n = ζ_{n−1} without a solve.
    Nothing,
    /// The linear solver failed.
    Failed,
}

impl Driving {
    /// The least φ of the step, 1/s.
    pub(super) fn least_source(self) -> f64 {
        match self {
            Self::Solved(least) => least,
            Self::Nothing | Self::Failed => 0.0,
        }
    }
}

impl<'a> DamageStep<'a> {
    pub(super) fn new(session: &'a Session, setting: &'a Setting, phases: &'a Phases) -> Self {
        Self { session, setting, phases, law: setting.damage(), system: None }
    }

    /// The source load b of u and ζ, and its least φ, where there is a damage law.
    fn source(&self, u: &[f64], zeta: &[f64]) -> Option<(Vec<f64>, f64)> {
        let (law, body) = (self.law?, &self.setting.body);
        Some(self.phases.time("damage source", || {
            let strain = self.setting.elasticity.strain_squared(body, u);
            let phi = source(body, &law, &strain, zeta);
            let least = phi.iter().flatten().copied().fold(0.0, f64::min);
            let least = body.partition.ranks().min(least);
            (source_load(body, self.setting.mass(), &phi), least)
        }))
    }

    /// About the largest |dζ/dt| that the source of u and ζ causes, 1/s.
    pub(super) fn rate(&self, u: &[f64], zeta: &[f64]) -> f64 {
        let body = &self.setting.body;
        let (load, _) = self.source(u, zeta).unwrap_or_default();
        let rates = load.iter().zip(&body.node_area).map(|(b, a)| b.abs() / a);
        body.partition.ranks().max(rates.take(body.partition.owned()).fold(0.0, f64::max))
    }

    /// Replaces ζ_{n−1} by ζ_n, `step` s later.
    pub(super) fn advance(
        &mut self,
        u: &[f64],
        zeta: &mut [f64],
        step: f64,
    ) -> Result<Driving, PetscError> {
        let (Some(law), Some((load, least))) = (self.law, self.source(u, zeta)) else {
            return Ok(Driving::Nothing);
        };
        let partition = &self.setting.body.partition;
        let (low, high) = partition.extremes(zeta);
        if low == high && partition.ranks().all(load.iter().all(|&b| b == 0.0)) {
            return Ok(Driving::Nothing);
        }
        let mut system = match self.system.take() {
            Some((k, system)) if k == step => system,
            Some((_, mut system)) => {
                self.phases.time("damage factor", || system.set_step(step))?;
                system
            }
            None => self.phases.time("damage factor", || {
                let (body, mass) = (&self.setting.body, self.setting.mass());
                DamageSystem::new(self.session, body, mass, law.diffusion, step)
            })?,
        };
        let solved = self.phases.time("damage solve", || system.advance(&load, zeta))?;
        partition.update(zeta, 1)?;
        self.system = Some((step, system));
        Ok(if solved { Driving::Solved(least) } else { Driving::Failed })
    }
}
