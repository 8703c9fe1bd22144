//! The sums and extremes from which the figures of a state are taken.

use super::{SHOWN_AS_ZERO, Value};
use crate::{
    observe::{ContactFigures, ContactRow, NodalStress, ObservedProblem, Strained, rows_of},
    petsc::{Communicator, PetscError},
    problem::State,
};

/// The quantities from which figures take their values. All are sums or extremes over the
/// ranks.
pub(crate) struct Observation {
    /// min ζ.
    pub zeta_min: Value,
    /// ∫ζ / |Ω|.
    pub zeta_mean: f64,
    /// Maximum nodal |u|, m.
    pub displacement_max: Value,
    /// fᵀu, of the loads alone, J per metre of thickness.
    pub work: f64,
    /// Σ normal reactions of Γ_C, N per metre of thickness.
    pub contact_force: f64,
    /// The largest von Mises stress, the largest σ₁ and the smallest σ₂, Pa: first those of the body, then those of each
    /// material if there are several.
    pub stresses: Vec<[Value; 3]>,
    /// The same away from singular points.
    pub away: Vec<[Value; 3]>,
    /// The strains and ζ of the stresses. The strains are zero if the body only moves rigidly.
    pub strained: Strained,
    /// The figures of Γ_C, then those of each foundation.
    pub contact: Vec<ContactFigures>,
    /// Per support: F_x, F_y, N per metre of thickness, and the moment about the origin, N.
    pub resultants: Vec<[f64; 3]>,
    /// Per boundary of the scene: its mean displacement, and the travel of its foundation, m.
    pub means: Vec<[f64; 3]>,
    /// Per probe: u_x, u_y, m, ζ, σ_xx, σ_yy, σ_xy and the von Mises stress, Pa.
    pub probes: Vec<[f64; 7]>,
}

impl ObservedProblem {
    /// The observation of a state with the nodal loads `load` and the residual forces `unbalanced` = f − Ku, and its figures.
    /// Forces up to `rounding`, N per metre of thickness, are zero. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(crate) fn observe(
        &self,
        state: &State,
        load: &[f64],
        unbalanced: &[f64],
        rounding: f64,
    ) -> Result<(Observation, Vec<Value>), PetscError> {
        let seen = Observation::new(self, state, load, unbalanced)?;
        let displacement = SHOWN_AS_ZERO * seen.displacement_max.value;
        let values = self.without_rounding(self.figures.values(&seen), (rounding, displacement));
        Ok((seen, values))
    }
}

impl Observation {
    /// The observation of a state with the nodal loads `load` and the residual forces `unbalanced` = f − Ku. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(crate) fn new(
        problem: &ObservedProblem,
        state: &State,
        load: &[f64],
        unbalanced: &[f64],
    ) -> Result<Self, PetscError> {
        let (body, partition) = (&problem.body, &problem.body.nodes.partition);
        let comm = partition.comm();
        let stress = problem.stress_in(state);
        let mut resultants = problem.supports.resultants(body, state, unbalanced, stress);
        comm.sum(resultants.as_flattened_mut());
        let mut probes = problem.probes.values(problem, state);
        comm.sum(probes.as_flattened_mut());
        let (rows, _) = problem.supports.contact.rows(body, state);
        let of_rows = |rows: &[ContactRow]| problem.contact_figures(rows);
        let foundations = problem.foundations.iter().map(|of| of_rows(rows_of(&rows, of)));
        let nodes = state.u.chunks_exact(2).zip(&body.nodes.points).take(partition.owned());
        let farthest = greatest(comm, nodes.map(|(u, at)| (u[0] * u[0] + u[1] * u[1], *at)));
        let vertices =
            state.zeta.iter().zip(&body.mesh.nodes).take(body.vertices.partition.owned());
        let least = greatest(comm, vertices.map(|(zeta, at)| (-zeta, *at)));
        let strained = NodalStress::strained(problem, &problem.strained(state));
        let [stresses, away] = problem.extreme_stresses(&strained, &problem.rays(state))?;
        let active = state.of_contact().filter(|point| point.active);
        Ok(Self {
            zeta_min: Value { value: -least.value, ..least },
            zeta_mean: body.mean(&state.zeta),
            displacement_max: Value { value: farthest.value.sqrt(), ..farthest },
            work: partition.dot(load, &state.u, 2),
            // An empty sum is -0.0.
            contact_force: comm.total(active.map(|point| point.force).sum()) + 0.0,
            stresses,
            away,
            strained,
            contact: [of_rows(&rows)].into_iter().chain(foundations).collect(),
            resultants,
            means: problem.mean_displacements(state),
            probes,
        })
    }
}

/// The largest of the values of all ranks, with its place, m. Collective.
pub(crate) fn greatest(comm: Communicator, values: impl Iterator<Item = (f64, [f64; 2])>) -> Value {
    // The total order has a NaN with a sign below all numbers.
    let values = values.map(|(value, at)| (if value.is_nan() { f64::NAN } else { value }, at));
    let own = values.max_by(|a, b| a.0.total_cmp(&b.0));
    let (least, rank) = comm.min_with_rank(own.map_or(f64::INFINITY, |(value, _)| -value));
    let at = own.map_or([0.0; 2], |(_, at)| at).map(|x| comm.broadcast(rank, x));
    Value { value: -least, at: Some(at) }
}
