//! What an answer is worth, from the displacement alone: residuals, contact, figures.

use super::Equilibrium;
use crate::{
    contact::{self, ContactReport, Kkt, RigidMotion},
    evolution::{ContactPoint, Setting, State, StepRecord},
};

impl Equilibrium<'_> {
    /// The KKT residuals of u by element-wise forces, the cosine between u and these forces (the
    /// sign of the energy), and the state of contact they imply. `load_size` keeps the scale of
    /// forces where a prescribed displacement carries the body along without stress.
    pub(super) fn certify(
        &self,
        u: &[f64],
        external: &[f64],
        load_size: f64,
    ) -> (Kkt, f64, Vec<ContactPoint>) {
        let setting = self.setting;
        let (body, constraints) = (&setting.body, &setting.constraints);
        let internal = setting.elasticity.internal_force(body, &self.zeta_mean, u);
        let partition = &body.partition;
        let forces = partition.norm(external, 2).max(partition.norm(&internal, 2));
        let force_scale = forces.max(load_size);
        let size = partition.largest(u);
        let energy = partition.dot(&internal, u, 2)
            / (force_scale * partition.norm(u, 2)).max(f64::MIN_POSITIVE);

        let mut residual: Vec<f64> = internal.iter().zip(external).map(|(r, f)| r - f).collect();
        let mut c = u.to_vec();
        constraints.frames.force_to_frame(&mut residual);
        constraints.frames.displacement_to_frame(&mut c);
        let bounds = &constraints.bounds;
        let owned = &residual[..2 * partition.owned()];
        let prescribed = |dof: usize| self.prescribed[dof];
        let kkt = Kkt::of(owned, &c, bounds, prescribed, force_scale, size, partition.ranks());
        let points = bounds.iter().map(|bound| {
            let (force, gap) = (-residual[bound.dof], bound.gap - c[bound.dof]);
            let active = force * size > gap * force_scale;
            ContactPoint { node: bound.node, force, pressure: force / bound.weight, gap, active }
        });
        (kkt, energy, points.collect())
    }

    /// A rigid motion that the pressing nodes leave. A body without load rests where it is,
    /// which needs no holding.
    pub(super) fn unheld(&self, contact: &[ContactPoint], force_scale: f64) -> Option<RigidMotion> {
        // A residual at the tolerance does work of up to √N times that on a motion (Cauchy and
        // Schwarz), which at the lever of one mesh width, 1/√N of the body, is a force √N times
        // as large: a smaller one holds nothing for certain.
        let partition = &self.setting.body.partition;
        let nodes = partition.total() as f64;
        let least = nodes * self.setting.tolerance * force_scale;
        let pressing: Vec<bool> = contact.iter().map(|point| point.force > least).collect();
        let unheld = contact::unheld(partition.ranks(), &self.rigid, &pressing);
        let first = unheld.first().filter(|_| force_scale > 0.0)?;
        Some(self.setting.motions.combined(first))
    }
}

/// The row of an answer in the history.
pub(super) fn figures(
    setting: &Setting,
    step: usize,
    state: &State,
    external: &[f64],
    report: &ContactReport,
    kkt: &Kkt,
) -> StepRecord {
    let mut active: Vec<usize> =
        state.contact.iter().filter(|point| point.active).map(|point| point.node).collect();
    active.dedup();
    let partition = &setting.body.partition;
    let ranks = partition.ranks();
    StepRecord {
        step,
        time: state.time,
        zeta_min: partition.extremes(&state.zeta).0,
        zeta_mean: setting.body.mean(&state.zeta),
        displacement_max: partition.largest(&state.u),
        work: partition.dot(external, &state.u, 2),
        // An empty sum is -0.0, and so is one of reactions of nothing.
        contact_force: ranks.total(state.contact.iter().map(|point| point.force).sum()) + 0.0,
        active_nodes: ranks.count(active.len()),
        iterations: report.iterations,
        linear_iterations: report.linear_iterations,
        factorisations: report.factorisations,
        fallbacks: report.fallbacks,
        contraction: report.contraction,
        kkt_stationarity: kkt.stationarity,
        kkt_primal: kkt.primal,
        kkt_dual: kkt.dual,
        kkt_complementarity: kkt.complementarity,
        seconds: 0.0,
    }
}
