//! Certifies an answer by its displacements alone: residuals and contact forces.

use super::{Accuracy, ContactStep};
use crate::{
    contact::{Answer, Constraints, ContactError, ContactOptions, ContactPoint, Kkt, Scales},
    fem::RigidMotion,
    problem::LoadCase,
};

/// Residuals up to this multiple of the estimated rounding count as rounding.
const ROUNDED: f64 = 10.0;
/// Larger residuals are accepted only with a tolerance as large, or if the estimated error of u is small.
pub(super) const MOST_ROUNDING: f64 = 1e-6;
/// A deformation below this fraction of the datum is rounding.
const CARRIED: f64 = 1e-14;
/// If the cosine between u and its elastic forces is below this, K is indefinite.
const NEGATIVE_ENERGY: f64 = -1e-10;

/// An answer with its certificate.
pub(super) struct Judged {
    /// The displacements from the datum, m.
    pub(super) u: Vec<f64>,
    pub(super) kkt: Kkt,
    /// The scales of the residuals: of the run so far, this answer included.
    pub(super) scales: Scales,
    /// The larger of ‖f‖₂ and ‖Ku‖₂, N per metre of thickness.
    pub(super) force: f64,
    /// The cosine between u and its elastic forces: the sign of the energy.
    energy: f64,
    /// f − Ku, N per metre of thickness.
    pub(super) unbalanced: Vec<f64>,
    pub(super) contact: Vec<ContactPoint>,
    /// The rigid part of u, max |·| of it and of the rest, m.
    pub(super) rigid: RigidMotion,
    pub(super) rigid_max: f64,
    pub(super) elastic_max: f64,
}

impl Judged {
    /// Does u show that K is not positive definite?
    pub(super) fn is_indefinite(&self) -> bool {
        self.energy < NEGATIVE_ENERGY
    }
}

impl ContactStep<'_> {
    /// Certifies u, measured from the datum, by forces summed triangle by triangle, without the assembled K
    /// of the solvers.
    pub(super) fn certify(&self, u: Vec<f64>, case: &LoadCase) -> Judged {
        let problem = self.problem;
        let (body, partition) = (&problem.body, &problem.body.nodes.partition);
        let rigid = RigidMotion::nearest(body, &u);
        let [rigid_max, elastic_max] = rigid.max_norms(body, &u);
        let mut unbalanced = problem.elasticity.internal_force(body, &self.zeta_at_points, &u);
        // |f|², |Ku|², u·Ku and |u|².
        let mut sums = [0.0; 4];
        let nodal = unbalanced.iter_mut().zip(&case.load).zip(&u);
        for ((r, f), u) in nodal.take(2 * partition.owned()) {
            sums[0] += f * f;
            sums[1] += *r * *r;
            sums[2] += u * *r;
            sums[3] += u * u;
            *r = f - *r;
        }
        partition.comm().sum(&mut sums);
        let force = sums[0].max(sums[1]).sqrt();
        let scales = self.run_scales(Scales { force, displacement: elastic_max });
        let energy = sums[2] / (scales.force * sums[3].sqrt()).max(f64::MIN_POSITIVE);
        let answer = Answer {
            rigid: &self.next.datum.field,
            elastic: &u,
            unbalanced: &unbalanced,
            prescribed: &case.prescribed,
            gaps: &case.gaps,
        };
        let comm = partition.comm();
        let (mut kkt, contact) = problem.certificate.judge(answer, partition.owned(), scales, comm);
        if !self.covered {
            kkt.stationarity = f64::NAN;
        }
        Judged { u, kkt, scales, force, energy, unbalanced, contact, rigid, rigid_max, elastic_max }
    }

    /// The scales of an answer. Lower bounds are the scales of the run so far and the rounding of the datum:
    /// a body that only moves rigidly has no other scale. The displacement scale is at least what the forces
    /// cause.
    pub(super) fn run_scales(&self, answer: Scales) -> Scales {
        let (datum, run) = (&self.next.datum, self.accepted.scales);
        let rounding = match datum.is_zero() {
            true => 0.0,
            false => CARRIED * self.problem.body.nodes.partition.max_norm(&datum.field),
        };
        let force = answer.force.max(run.force).max(self.stiffness.scale * rounding);
        let least = rounding.max(force / self.stiffness.scale);
        Scales { force, displacement: answer.displacement.max(run.displacement).max(least) }
    }

    /// Adds to an error the tolerance that double precision allows, if the rounding of the internal forces of
    /// u explains the error.
    pub(super) fn limited(&self, error: ContactError, judged: &Judged) -> ContactError {
        let attainable = ROUNDED * self.rounding(judged);
        match attainable > self.problem.tolerance
            && judged.kkt.within(attainable)
            && attainable < 1.0
        {
            true => ContactError::Limited {
                source: Box::new(error),
                attainable,
                contrast: self.problem.contrast(),
            },
            false => error,
        }
    }

    /// Is u the exact answer for a stiffness whose entries differ by ε_machine? Its residuals must be at most
    /// `MOST_ROUNDING`, or its `error`, relative to the largest displacement, as small as promised. If the
    /// user asks for a smaller tolerance than the default, rounding is no excuse.
    pub(super) fn is_exact_to_rounding(&self, judged: &Judged, error: Option<f64>) -> bool {
        let tolerance = self.problem.tolerance;
        let is_small = |error| error <= Accuracy::promised(tolerance);
        tolerance >= ContactOptions::default().tolerance
            && self.is_rounding(judged)
            && (judged.kkt.within(MOST_ROUNDING) || error.is_some_and(is_small))
    }

    /// Are the residuals of u at most the rounding of its internal forces?
    pub(super) fn is_rounding(&self, judged: &Judged) -> bool {
        judged.kkt.within(self.rounding(judged))
    }

    /// The rounding of the internal forces of u, ε_machine ‖|K||u|‖₂ / F.
    fn rounding(&self, judged: &Judged) -> f64 {
        let body = &self.problem.body;
        let elasticity = &self.problem.elasticity;
        let rounding = elasticity.force_rounding(body, &self.zeta_at_points, &judged.u);
        body.nodes.partition.norm(&rounding, 2) / judged.scales.force
    }
}

/// Per bound: 1 if a contact force above `least`, N/m, acts on it, else 0.
pub(crate) fn active_bounds(of: &Constraints, contact: &[ContactPoint], least: f64) -> Vec<f64> {
    let mut active = vec![0.0; of.bounds.len()];
    for point in contact.iter().filter(|point| point.active && point.force > least) {
        if let Some(bound) = of.bound_along(point.node, point.normal) {
            active[bound] = 1.0;
        }
    }
    active
}
