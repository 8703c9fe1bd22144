//! The damage step (28): ζ_n from ζ_{n−1} and u_{n−1}.

use super::{DiscreteProblem, RunError, State, Step, StepFailure, agreed};
use crate::{
    fem::{self, DamageCertificate, DamageSystem},
    linear::FactorState,
    model::ChosenSource,
    petsc::{PetscError, Session, stage},
};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use std::mem;

/// A planned step from t_{n−1} to t_n, with the damage system (M + kκL) ζ_n = M · `start` + k · `load`.
pub(crate) struct PlannedStep {
    pub(crate) n: usize,
    /// t_n, s.
    pub(crate) time: f64,
    /// k_n = t_n − t_{n−1}, s.
    pub(crate) length: f64,
    /// k of this formula, s.
    pub(crate) k: f64,
    /// ζ_{n−1}, or the start of a two-step formula.
    pub(crate) start: DVector<f64>,
    /// b_{n−1}, or the extrapolated source of a two-step formula, m²/s.
    pub(crate) load: DVector<f64>,
    /// The bounds on ζ_n of [`BoundViolation`](super::BoundViolation).
    pub(crate) bounds: (f64, f64),
}

impl PlannedStep {
    /// The rate of the formula at t_n, (ζ̃_n − `start`) / k, for ζ̃_n = `zeta`.
    pub(crate) fn rate(&self, zeta: &DVector<f64>) -> DVector<f64> {
        (zeta - &self.start) / self.k
    }

    /// The error of this step if it has no answer.
    pub(crate) fn failed(&self, source: StepFailure) -> RunError {
        RunError::Step { step: self.n, time: self.time, source }
    }
}

/// Solves the damage systems (M + kκL) ζ_n = M ζ_{n−1} + k b_{n−1} of a run.
pub(crate) struct DamageStep<'a> {
    pub(crate) session: &'a Session,
    pub(crate) problem: &'a DiscreteProblem,
    pub(crate) law: &'a ChosenSource,
    /// k and M + kκL, made by the first step that needs it.
    pub(crate) system: Option<(f64, DamageSystem)>,
    /// The factor of a checkpoint for that system.
    pub(crate) loaded: Option<FactorState>,
}

/// The damage source φ(ε(u), ζ) of a state; zero without a damage law.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct SourceLoad {
    /// b_i = ∫ φ λ_i, m²/s.
    pub(crate) load: DVector<f64>,
    /// min φ ≤ 0, 1/s.
    pub(crate) min: f64,
    /// The [share](Step::prescribed_share) of prescribed displacements and gaps in the strain energy, and twice this
    /// energy, spread over the vertices, N m per metre of thickness; empty if the share is 0.
    pub(crate) prescribed: (f64, Vec<f64>),
}

pub(crate) struct DamageUpdate {
    /// ζ_n at the nodes.
    pub(crate) zeta: DVector<f64>,
    /// min ζ_n and max ζ_n.
    pub(crate) min_max: (f64, f64),
    /// The accuracy of ζ_n. `None` if the solve was skipped: a uniform ζ_{n−1} without source does not change.
    pub(crate) certificate: Option<DamageCertificate>,
}

/// Maximum accepted [`DamageCertificate::balance`] of a step, relative to max |ζ|: far above rounding. A violation of
/// the bounds on ζ counts above it.
pub(super) const MAX_BALANCE: f64 = 1e-10;

impl DamageStep<'_> {
    /// The damage source of a step that the contact step returned. Collective.
    ///
    /// # Errors
    /// φ is positive or no number.
    pub(crate) fn source(&self, step: &mut Step) -> Result<SourceLoad, RunError> {
        let (problem, body) = (self.problem, &self.problem.body);
        let (strains, state) = (mem::take(&mut step.strains), &step.state);
        let Some(laws) = problem.damage() else {
            let load = DVector::zeros(state.zeta.len());
            return Ok(SourceLoad { load, ..SourceLoad::default() });
        };
        stage("damage source", || {
            let comm = body.comm();
            let phi = fem::source(body, (self.law, laws), &strains, &state.zeta);
            let failed = |source| RunError::Step {
                step: step.record.step,
                time: state.time,
                source: StepFailure::Source(source),
            };
            let phi = agreed(comm, phi.map_err(failed))?;
            // Three minima that do not wait for each other are faster than one.
            let min = phi.iter().fold([0.0; 3], |min, phi| [0, 1, 2].map(|q| phi[q].min(min[q])));
            let min = comm.min(min.into_iter().fold(0.0, f64::min));
            let load = fem::source_load(body, problem.mass(), &phi);
            let share = step.prescribed_share;
            let energies = if share > 0.0 { energies(problem, state) } else { Vec::new() };
            Ok(SourceLoad { load: DVector::from_vec(load), min, prescribed: (share, energies) })
        })
    }

    /// ζ_n of a planned step.
    ///
    /// # Errors
    /// The system has no finite solution, or was solved too inaccurately.
    pub(crate) fn solve(&mut self, planned: &PlannedStep) -> Result<DamageUpdate, RunError> {
        let problem = self.problem;
        let partition = &problem.body.vertices.partition;
        let (start, load) = (planned.start.as_slice(), planned.load.as_slice());
        let (mut zeta, min_max) = (planned.start.clone(), partition.min_max(start));
        if min_max.0 == min_max.1 && self.is_zero(load) {
            return Ok(DamageUpdate { zeta, min_max, certificate: None });
        }
        let system = self.system(planned.k)?;
        if !stage("damage solve", || system.advance(load, zeta.as_mut_slice()))? {
            return Err(planned.failed(StepFailure::Damage));
        }
        let largest_residual = system.largest_residual();
        partition.update(zeta.as_mut_slice(), 1)?;
        let certificate = stage("damage certificate", || {
            let (body, mass, fields) = (&problem.body, problem.mass(), [start, zeta.as_slice()]);
            DamageCertificate::of(body, mass, &problem.diffusions(), planned.k, load, fields)
        });
        let residual = certificate.residual;
        if !residual.is_finite() {
            return Err(planned.failed(StepFailure::Damage));
        }
        let min_max = partition.min_max(zeta.as_slice());
        let largest = min_max.0.abs().max(min_max.1);
        // If ζ is below ζ_* whatever the error of the solve is, the run stops as it should.
        let stops = min_max.0 + certificate.error <= problem.threshold();
        let is_exact = residual <= largest_residual && certificate.balance <= MAX_BALANCE * largest;
        if !is_exact && !stops {
            return Err(planned.failed(StepFailure::DamageResidual(residual)));
        }
        Ok(DamageUpdate { zeta, min_max, certificate: Some(certificate) })
    }

    /// (M + kκL)⁻¹ k b: the change of ζ_n in a planned step if its source load changes by b = `load`, m²/s. `None` if the
    /// system has no finite solution. Collective.
    pub(crate) fn correction(
        &mut self,
        planned: &PlannedStep,
        load: &[f64],
    ) -> Result<Option<DVector<f64>>, RunError> {
        let partition = &self.problem.body.vertices.partition;
        if self.is_zero(load) {
            return Ok(Some(DVector::zeros(planned.start.len())));
        }
        let system = self.system(planned.k)?;
        let Some(change) = stage("damage solve", || system.correction(load))? else {
            return Ok(None);
        };
        let change = partition.field(change, 1)?;
        let finite = partition.comm().all(change.iter().all(|z| z.is_finite()));
        Ok(finite.then(|| DVector::from_vec(change)))
    }

    /// Lets two `errors` δ of ζ diffuse in a planned step: δ becomes (M + kκL)⁻¹ Mδ. They are unchanged if a solve fails.
    /// Collective.
    pub(crate) fn diffuse(
        &mut self,
        planned: &PlannedStep,
        errors: &mut [DVector<f64>; 2],
    ) -> Result<(), RunError> {
        if errors.iter().all(|error| self.is_zero(error.as_slice())) {
            return Ok(());
        }
        let system = self.system(planned.k)?;
        let mut fields = errors.each_mut().map(|error| error.as_mut_slice());
        stage("damage solve", || system.diffuse(&mut fields))?;
        let partition = &self.problem.body.vertices.partition;
        errors.iter_mut().try_for_each(|error| partition.update(error.as_mut_slice(), 1))?;
        Ok(())
    }

    /// Is a source load zero on all ranks, as always without a damage law? Collective.
    fn is_zero(&self, load: &[f64]) -> bool {
        self.problem.body.comm().all(load.iter().all(|&b| b == 0.0))
    }

    /// The state of the factor for a checkpoint, if there is one.
    pub(crate) fn factor_state(&mut self) -> Option<FactorState> {
        let made = self.system.as_mut().map(|(_, system)| system.factor().state());
        made.or_else(|| self.loaded.clone())
    }

    /// The damage system of a step of `k` s, with a factor that still pays.
    fn system(&mut self, k: f64) -> Result<&mut DamageSystem, PetscError> {
        let (session, problem) = (self.session, self.problem);
        let mut system = match self.system.take() {
            Some((own, system)) if own == k => system,
            Some((_, mut system)) => {
                stage("damage matrix", || system.set_step(k))?;
                system
            }
            None => {
                let (body, mass, diffusions) =
                    (&problem.body, problem.mass(), problem.diffusions());
                let new = || DamageSystem::new(session, body, mass, &diffusions, k);
                let mut system = stage("damage matrix", new)?;
                if let Some(state) = self.loaded.take() {
                    system.factor().set_state(state);
                }
                system
            }
        };
        if system.factor().is_due() {
            stage("damage factor", || system.factorise())?;
        }
        Ok(&mut self.system.insert((k, system)).1)
    }
}

/// Twice the strain energy of the triangles of this rank, in equal parts at their vertices, N m per metre of thickness.
fn energies(problem: &DiscreteProblem, state: &State) -> Vec<f64> {
    let (body, mut at_vertices) = (&problem.body, vec![0.0; state.zeta.len()]);
    let zeta = problem.zeta_at_points(&state.zeta);
    let energies = problem.elasticity.energies(body, &zeta, &state.u);
    let of_triangles = energies.chunks(body.points_per_triangle()).take(body.own_triangles);
    for (nodes, energies) in body.mesh.triangles.iter().zip(of_triangles) {
        let part = energies.iter().sum::<f64>() / 3.0;
        nodes.iter().for_each(|&node| at_vertices[node] += part);
    }
    at_vertices
}
