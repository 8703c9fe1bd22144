//! Certifies an answer from its displacements alone: KKT residuals and contact forces.

use super::{ContactStep, Reference};
use crate::{
    ROUNDING,
    contact::{Answer, Constraints, ContactPoint, Kkt, Scales},
    fem::RigidMotion,
    maximum,
    problem::LoadCase,
};

/// The cosine between u and its elastic forces is below this only if K is indefinite.
const NEGATIVE_ENERGY: f64 = -1e-10;

/// A candidate answer and the residuals by the certificate.
pub(super) struct Candidate {
    /// The displacements from the reference, m.
    pub(super) u: Vec<f64>,
    pub(super) kkt: Kkt,
    /// The scales of the residuals, over the run so far and this answer.
    pub(super) scales: Scales,
    /// The larger of ‖f‖₂ and ‖Ku‖₂, N per metre of thickness.
    pub(super) force: f64,
    /// The larger of Σ|f| and Σ|Ku| over all components, N per metre of thickness: the scale of resultants. It does not
    /// depend on the mesh, and does not vanish where forces balance.
    pub(super) forces: f64,
    /// Forces up to this are rounding, N per metre of thickness: all of them if the body only moves rigidly, without load.
    pub(super) rounding: f64,
    /// The cosine between u and its elastic forces: the sign of the energy.
    energy: f64,
    /// f − Ku, N per metre of thickness.
    pub(super) unbalanced: Vec<f64>,
    pub(super) contact: Vec<ContactPoint>,
    /// The nodes of Γ_C whose normal displacement is prescribed, without forces.
    pub(super) prescribed: Vec<ContactPoint>,
    /// The rigid part of u; max |·| of this part and of the rest, m.
    pub(super) rigid: RigidMotion,
    pub(super) rigid_max: f64,
    pub(super) elastic_max: f64,
}

impl Candidate {
    /// Does u show that K is not positive definite?
    pub(super) fn is_indefinite(&self) -> bool {
        self.energy < NEGATIVE_ENERGY
    }
}

impl ContactStep<'_> {
    /// The KKT residuals of u, measured from a reference. Forces are summed by the code of
    /// [`Elasticity`](crate::fem::Elasticity), not by the operator of the solvers.
    pub(super) fn certify(&self, reference: &Reference, u: Vec<f64>, case: &LoadCase) -> Candidate {
        let problem = self.problem;
        let (body, partition) = (&problem.body, &problem.body.nodes.partition);
        let rigid = RigidMotion::nearest(body, &u);
        let [rigid_max, elastic_max] = rigid.max_norms(body, &u);
        let mut unbalanced = problem.elasticity.internal_force(body, &self.zeta_at_points, &u);
        // |f|², |Ku|², u·Ku, |u|², Σ|f| and Σ|Ku|.
        let mut sums = [0.0; 6];
        let nodal = unbalanced.iter_mut().zip(&case.load).zip(&u);
        for ((r, f), u) in nodal.take(2 * partition.owned()) {
            let terms = [f * f, *r * *r, u * *r, u * u, f.abs(), r.abs()];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            *r = f - *r;
        }
        partition.comm().sum(&mut sums);
        let force = maximum(sums[0], sums[1]).sqrt();
        let [.., load, internal] = sums;
        let is_rigid = elastic_max <= self.rounding_of(reference, case).max(ROUNDING * rigid_max);
        let [forces, rounding] = match is_rigid && load == 0.0 {
            true => [0.0, f64::INFINITY],
            false => [load.max(internal), 0.0],
        };
        let scales = self.run_scales(Scales { force, displacement: elastic_max }, reference, case);
        let energy = sums[2] / (scales.force * sums[3].sqrt()).max(f64::MIN_POSITIVE);
        let answer = Answer {
            rigid: &reference.field,
            elastic: &u,
            unbalanced: &unbalanced,
            values: &case.values,
        };
        let comm = partition.comm();
        let (mut kkt, [contact, prescribed]) =
            problem.certificate.residuals(answer, partition.owned(), scales, comm);
        if !self.covered {
            kkt.stationarity = f64::NAN;
        }
        Candidate {
            u,
            kkt,
            scales,
            force,
            forces,
            rounding,
            energy,
            unbalanced,
            contact,
            prescribed,
            rigid,
            rigid_max,
            elastic_max,
        }
    }

    /// The scales of an answer, at least the scales of the run so far. They include the rounding of the reference
    /// motion, the only scale of a rigid body. The displacement scale is at least force scale / stiffness.
    pub(super) fn run_scales(
        &self,
        answer: Scales,
        reference: &Reference,
        case: &LoadCase,
    ) -> Scales {
        let (run, rounding) = (self.accepted.scales, self.rounding_of(reference, case));
        let force = answer.force.max(run.force).max(self.stiffness.scale * rounding);
        let min = rounding.max(force / self.stiffness.scale);
        Scales { force, displacement: answer.displacement.max(run.displacement).max(min) }
    }

    /// The rounding of the differences between the values of the rows and the reference motion, m. Where a row is in
    /// effect, both are equal but for the deformation. So the rounding is at most that of the values: a body without
    /// support may move further, which is no reason for larger scales. Collective.
    fn rounding_of(&self, reference: &Reference, case: &LoadCase) -> f64 {
        let partition = &self.problem.body.nodes.partition;
        if reference.is_zero() {
            return 0.0;
        }
        let value = case.values.iter().fold(0.0_f64, |max, value| max.max(value.abs()));
        ROUNDING * partition.max_norm(&reference.field).min(partition.comm().max(value))
    }
}

/// Per bound: 1 if a contact force above `limit`, N/m, acts on it, else 0.
pub(crate) fn active_bounds(of: &Constraints, contact: &[ContactPoint], limit: f64) -> Vec<f64> {
    let mut active = vec![0.0; of.bounds.len()];
    for point in contact.iter().filter(|point| point.active && point.force > limit) {
        if let Some(bound) = of.bound_along(point.node, point.normal) {
            active[bound] = 1.0;
        }
    }
    active
}
