//! What an answer is worth, from the displacement alone: residuals, contact, figures.

use super::{ContactStep, ROUNDED};
use crate::{
    contact::{self, Answer, ContactError, ContactPoint, ContactReport, Kkt, RigidMotion, Scales},
    evolution::{DiscreteProblem, State, StepRecord},
    fem::RigidPart,
};

/// What the certificate found.
pub(super) struct Judged {
    pub(super) kkt: Kkt,
    /// The scales of the residuals: of the run so far, this answer included.
    pub(super) scales: Scales,
    /// The size of the forces of this answer, N per metre of thickness.
    pub(super) force: f64,
    /// The cosine between u and its elastic forces: the sign of the energy.
    pub(super) energy: f64,
    pub(super) contact: Vec<ContactPoint>,
    /// The rigid part of u, and the sizes of it and of the rest, m.
    pub(super) rigid: RigidPart,
    pub(super) sizes: [f64; 2],
}

impl ContactStep<'_> {
    /// Judges u, measured from the datum, by element-wise forces.
    pub(super) fn certify(&self, u: &[f64], external: &[f64], prescribed: &[f64]) -> Judged {
        let problem = self.problem;
        let (body, partition) = (&problem.body, &problem.body.partition);
        let internal = problem.elasticity.internal_force(body, &self.zeta_mean, u);
        let rigid = RigidPart::of(body, u);
        let sizes = rigid.sizes(body, u);
        // |f|², |Ku|², u·Ku and |u|².
        let mut sums = [0.0; 4];
        let mut unbalanced = internal;
        for ((r, f), u) in unbalanced.iter_mut().zip(external).zip(u).take(2 * partition.owned()) {
            sums[0] += f * f;
            sums[1] += *r * *r;
            sums[2] += u * *r;
            sums[3] += u * u;
            *r = f - *r;
        }
        partition.comm().sum(&mut sums);
        let force = sums[0].max(sums[1]).sqrt();
        let scales = self.with_floors(Scales { force, displacement: sizes[1] });
        let energy = sums[2] / (scales.force * sums[3].sqrt()).max(f64::MIN_POSITIVE);
        let answer =
            Answer { rigid: &self.datum.field, elastic: u, unbalanced: &unbalanced, prescribed };
        let comm = partition.comm();
        let (mut kkt, contact) = problem.certificate.judge(answer, partition.owned(), scales, comm);
        if !self.covered {
            kkt.stationarity = f64::NAN;
        }
        Judged { kkt, scales, force, energy, contact, rigid, sizes }
    }

    /// Adds to an error what double precision can reach, where that is less than was asked for and
    /// what was reached: the rounding of the internal forces of u alone.
    pub(super) fn limited(&self, error: ContactError, judged: &Judged, u: &[f64]) -> ContactError {
        let problem = self.problem;
        let rounding = problem.elasticity.force_rounding(&problem.body, &self.zeta_mean, u);
        let rounding = problem.body.partition.norm(&rounding, 2) / judged.scales.force;
        let attainable = ROUNDED * rounding;
        match attainable > problem.tolerance && judged.kkt.within(attainable) && attainable < 1.0 {
            true => ContactError::Limited { source: Box::new(error), attainable },
            false => error,
        }
    }

    /// Which bounds a contact force above `least`, N/m, acts on.
    pub(super) fn active_bounds(&self, contact: &[ContactPoint], least: f64) -> Vec<bool> {
        let constraints = &self.problem.constraints;
        let mut active = vec![false; constraints.bounds.len()];
        for point in contact.iter().filter(|point| point.active && point.force > least) {
            if let Some(bound) = constraints.bound_along(point.node, point.normal) {
                active[bound] = true;
            }
        }
        active
    }

    /// A rigid motion that the pressing nodes leave. A body without load rests where it is,
    /// which needs no holding.
    pub(super) fn unheld(&self, contact: &[ContactPoint], force_scale: f64) -> Option<RigidMotion> {
        // A residual at the tolerance does work of up to √N times that on a motion (Cauchy and
        // Schwarz), which at the lever of one mesh width, 1/√N of the body, is a force √N times
        // as large: a smaller one holds nothing for certain.
        let partition = &self.problem.body.partition;
        let nodes = partition.total() as f64;
        let least = nodes * self.problem.tolerance * force_scale;
        let pressing = self.active_bounds(contact, least);
        let unheld = contact::unconstrained_motions(partition.comm(), &self.rigid, &pressing);
        let first = unheld.first().filter(|_| force_scale > 0.0)?;
        Some(self.problem.motions.combined(first))
    }
}

/// The row of an answer in the history.
pub(super) fn figures(
    problem: &DiscreteProblem,
    step: usize,
    state: &State,
    external: &[f64],
    report: &ContactReport,
    kkt: &Kkt,
) -> StepRecord {
    let mut active: Vec<usize> =
        state.contact.iter().filter(|point| point.active).map(|point| point.node).collect();
    active.dedup();
    let partition = &problem.body.partition;
    let comm = partition.comm();
    StepRecord {
        step,
        time: state.time,
        zeta_min: partition.extremes(&state.zeta).0,
        zeta_mean: problem.body.mean(&state.zeta),
        displacement_max: partition.largest(&state.u),
        work: partition.dot(external, &state.u, 2),
        // An empty sum is -0.0, and so is one of reactions of nothing.
        contact_force: comm.total(state.contact.iter().map(|point| point.force).sum()) + 0.0,
        active_nodes: comm.count(active.len()),
        iterations: report.iterations,
        linear_iterations: report.linear_iterations,
        factorisations: report.factorisations,
        fallbacks: report.fallbacks,
        contraction: report.contraction,
        kkt_stationarity: kkt.stationarity,
        kkt_primal: kkt.primal,
        kkt_dual: kkt.dual,
        kkt_complementarity: kkt.complementarity,
        zeta_residual: 0.0,
        zeta_error: 0.0,
        seconds: 0.0,
    }
}
