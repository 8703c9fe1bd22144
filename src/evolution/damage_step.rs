//! The damage step (28).

use super::{DiscreteProblem, Phases};
use crate::{
    fem::{self, DamageCertificate, DamageSystem},
    model::DamageLaw,
    petsc::{PetscError, Session},
};

/// ζ_n from ζ_{n−1} and u_{n−1}; does nothing for a material that is not damaged.
pub(super) struct DamageStep<'a> {
    session: &'a Session,
    problem: &'a DiscreteProblem,
    phases: &'a Phases,
    law: Option<DamageLaw>,
    /// M + kκL, made when a step needs it, and its k.
    system: Option<(f64, DamageSystem)>,
}

/// The source of a state.
pub(super) struct Source {
    /// b, m²/s.
    pub(super) load: Vec<f64>,
    /// The least φ, 1/s.
    pub(super) least: f64,
}

/// What became of a damage step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DamageUpdate {
    /// The system was solved; what the solution is worth.
    Solved(DamageCertificate),
    /// No source and a uniform ζ: ζ_n = ζ_{n−1} without a solve.
    Nothing,
    /// The linear solver failed.
    Failed,
    /// The solution misses the tolerance by this residual.
    Missed(f64),
}

impl DamageUpdate {
    /// What ζ_n is worth; without a solve it is exact.
    pub(super) fn certificate(self) -> DamageCertificate {
        match self {
            Self::Solved(certificate) => certificate,
            Self::Nothing | Self::Failed | Self::Missed(_) => DamageCertificate::default(),
        }
    }
}

impl<'a> DamageStep<'a> {
    pub(super) fn new(
        session: &'a Session,
        problem: &'a DiscreteProblem,
        phases: &'a Phases,
    ) -> Self {
        Self { session, problem, phases, law: problem.damage(), system: None }
    }

    /// The source of u and ζ, where there is a damage law.
    pub(super) fn source(&self, u: &[f64], zeta: &[f64]) -> Option<Source> {
        let (law, body) = (self.law?, &self.problem.body);
        Some(self.phases.time("damage source", || {
            let strain = self.problem.elasticity.strain_squared(body, u);
            let phi = fem::source(body, &law, &strain, zeta);
            let least = phi.iter().flatten().copied().fold(0.0, f64::min);
            let least = body.partition.comm().min(least);
            Source { load: fem::source_load(body, self.problem.mass(), &phi), least }
        }))
    }

    /// ζ_n, `step` s after ζ_{n−1} = `start`, for the source load b = `load`.
    pub(super) fn advance(
        &mut self,
        load: Option<&[f64]>,
        start: &[f64],
        step: f64,
    ) -> Result<(Vec<f64>, DamageUpdate), PetscError> {
        let mut zeta = start.to_vec();
        let (Some(law), Some(load)) = (self.law, load) else {
            return Ok((zeta, DamageUpdate::Nothing));
        };
        let problem = self.problem;
        let partition = &problem.body.partition;
        let (low, high) = partition.extremes(start);
        if low == high && partition.comm().all(load.iter().all(|&b| b == 0.0)) {
            return Ok((zeta, DamageUpdate::Nothing));
        }
        let phases = self.phases;
        let system = self.system(&law, step)?;
        if !phases.time("damage solve", || system.advance(load, &mut zeta))? {
            return Ok((zeta, DamageUpdate::Failed));
        }
        let largest = system.largest_residual()?;
        partition.update(&mut zeta, 1)?;
        let certificate = phases.time("damage certificate", || {
            let (body, fields) = (&problem.body, [start, &zeta]);
            DamageCertificate::of(body, problem.mass(), law.diffusion, step, load, fields)
        });
        let driving = match certificate.residual {
            residual if !residual.is_finite() => DamageUpdate::Failed,
            residual if residual > largest => DamageUpdate::Missed(residual),
            _ => DamageUpdate::Solved(certificate),
        };
        Ok((zeta, driving))
    }

    /// By how much ζ_n changes if the source load of a step of `step` s changes by `load`. `None` if
    /// that has no finite answer.
    pub(super) fn correction(
        &mut self,
        load: &[f64],
        step: f64,
    ) -> Result<Option<Vec<f64>>, PetscError> {
        let partition = &self.problem.body.partition;
        let nothing = partition.comm().all(load.iter().all(|&b| b == 0.0));
        let Some(law) = self.law.filter(|_| !nothing) else {
            return Ok(Some(vec![0.0; partition.local()]));
        };
        let phases = self.phases;
        let system = self.system(&law, step)?;
        let solved = phases.time("damage solve", || system.correction(load))?;
        let Some(mut change) = solved else { return Ok(None) };
        change.resize(partition.local(), 0.0);
        partition.update(&mut change, 1)?;
        let finite = partition.comm().all(change.iter().all(|z| z.is_finite()));
        Ok(finite.then_some(change))
    }

    /// The damage system of a step of `step` s.
    fn system(&mut self, law: &DamageLaw, step: f64) -> Result<&mut DamageSystem, PetscError> {
        let (session, problem, phases) = (self.session, self.problem, self.phases);
        let made = match self.system.take() {
            Some((k, system)) if k == step => system,
            Some((_, mut system)) => {
                phases.time("damage factor", || system.set_step(step))?;
                system
            }
            None => phases.time("damage factor", || {
                let (body, mass) = (&problem.body, problem.mass());
                DamageSystem::new(session, body, mass, law.diffusion, step)
            })?,
        };
        Ok(&mut self.system.insert((step, made)).1)
    }
}
