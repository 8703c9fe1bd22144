//! (26) in the form for its solver: in the unknowns c, with all loads on the free unknowns.

use super::{Attempt, ContactStep};
use crate::{
    contact::{Bound, ContactError, ContactProblem, ContactReport, Scales},
    evolution::{DiscreteProblem, LoadCase},
    petsc::{PetscError, Vector, stage},
};

/// The force scale is at least this fraction of the forces if prescribed displacements or obstacles move their own
/// nodes alone. Smaller forces are rounding.
const MOVED_ALONE: f64 = 1e-2;

impl ContactStep<'_> {
    /// Replaces c by the solution of (26) for the load f − K u_D, with u_D the prescribed unknowns, and returns u. It also
    /// returns the error of a solver that stopped short of its tolerance: all ranks know this error. Any other error may
    /// concern one rank only.
    ///
    /// The certificate of the answer before may give the force scale F and the residual forces f − Ku. The load is then
    /// K c + (f − Ku), so that rounding of the assembled K cancels.
    pub(super) fn minimise(
        &mut self,
        attempt: &mut Attempt,
        case: &LoadCase,
    ) -> Result<(Vec<f64>, Option<ContactError>), ContactError> {
        let (c_prescribed, bounds) =
            attempt.next.reference.prescribed_and_bounds(&self.problem.constraints, case);
        let (spent, stopped) = match self.solve_contact(attempt, case, &c_prescribed, &bounds) {
            Ok(spent) => (spent, None),
            Err(error) => match error {
                ContactError::NotConverged { ref report, .. } => (**report, Some(error)),
                other => return Err(other),
            },
        };
        attempt.spent = spent;
        Ok((displacement(self.problem, c_prescribed, &self.c)?, stopped))
    }

    fn solve_contact(
        &mut self,
        attempt: &mut Attempt,
        case: &LoadCase,
        c_prescribed: &[f64],
        bounds: &[Bound],
    ) -> Result<ContactReport, ContactError> {
        let comm = self.problem.body.comm();
        let admits_zero = |bound: &Bound| bound.nearest(0.0) == 0.0;
        let overlaps = comm.any(!bounds.iter().all(admits_zero));
        let (load, force) =
            self.load_and_scale(&case.load, c_prescribed, overlaps.then_some(bounds));
        let force = attempt.force_scale.map_or(force, |known| force.min(known));
        let bases = &self.problem.constraints.bases;
        let in_unknowns = |mut force: Vec<f64>| {
            bases.force_to_local(&mut force);
            bases.zero_fixed(&mut force);
            force.truncate(self.c.owned());
            force
        };
        let load = in_unknowns(load);
        self.load.set(&load)?;
        if !overlaps && comm.all(load.iter().all(|&f| f == 0.0)) {
            self.c.write(|c| c.fill(0.0))?;
            return Ok(ContactReport::default());
        }
        if let Some([_, unbalanced]) = &attempt.refined {
            let unbalanced = in_unknowns(unbalanced.clone());
            self.stiffness.matrix.multiply(&self.c, &mut self.load)?;
            self.load.write(|load| load.iter_mut().zip(&unbalanced).for_each(|(f, r)| *f += r))?;
        }
        let contact = ContactProblem {
            session: self.session,
            stiffness: &self.stiffness.matrix,
            stiffness_scale: self.stiffness.scale,
            load: &self.load,
            bounds,
            rigid: &self.rigid,
            work: &case.work,
            scales: self.run_scales(
                Scales { force, displacement: 0.0 },
                &attempt.next.reference,
                case,
            ),
            tolerance: attempt.tolerance,
            comm,
        };
        let bounded = bounds.iter().map(|bound| bound.dof);
        self.elastic.factor().set_condensed(contact.stiffness, bounded)?;
        let Self { solvers, elastic, c, .. } = self;
        let (solver, warm_start) = (&solvers[attempt.solver], &mut attempt.next.warm_start);
        stage("contact", || solver.solve(&contact, elastic, warm_start, c))
    }

    /// The load f − K u_D, and its scale F: ‖f‖₂ or, if larger, a fraction of ‖f − K u_D‖₂ or of ‖K v‖₂. u_D is
    /// `c_prescribed`. v moves the nodes that overlap an obstacle out of it and no other node. Collective.
    fn load_and_scale(
        &self,
        load: &[f64],
        c_prescribed: &[f64],
        overlapping: Option<&[Bound]>,
    ) -> (Vec<f64>, f64) {
        let body = &self.problem.body;
        let partition = &body.nodes.partition;
        let internal_force = |mut u: Vec<f64>| {
            self.problem.constraints.bases.displacement_to_global(&mut u);
            self.problem.elasticity.internal_force(body, &self.zeta_at_points, &u)
        };
        let (mut load, mut scale) = (load.to_vec(), partition.norm(load, 2));
        if partition.comm().any(c_prescribed.iter().any(|&v| v != 0.0)) {
            let internal = internal_force(c_prescribed.to_vec());
            load.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
            scale = scale.max(MOVED_ALONE * partition.norm(&load, 2));
        }
        if let Some(bounds) = overlapping {
            let mut u = vec![0.0; c_prescribed.len()];
            bounds.iter().for_each(|bound| u[bound.dof] = bound.nearest(0.0));
            scale = scale.max(MOVED_ALONE * partition.norm(&internal_force(u), 2));
        }
        (load, scale)
    }
}

/// u from the unknowns c and the prescribed ones, `c_prescribed`, without free rigid motions. Collective.
pub(super) fn displacement(
    problem: &DiscreteProblem,
    c_prescribed: Vec<f64>,
    c: &Vector,
) -> Result<Vec<f64>, PetscError> {
    let mut u = c_prescribed;
    c.read(|c| u.iter_mut().zip(c).for_each(|(u, c)| *u += c))?;
    problem.constraints.bases.displacement_to_global(&mut u);
    problem.body.nodes.partition.update(&mut u, 2)?;
    problem.motions.remove_free(&problem.body, &mut u);
    Ok(u)
}
