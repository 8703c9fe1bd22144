//! The linear problem of u at the damage and the active nodes of a state.

use super::BothOrders;
use crate::{
    contact::ContactPoint,
    evolution::{DiscreteProblem, State, contact_step::active_bounds, discrete_problem::LoadCase},
    petsc::PetscError,
};

/// A state in the order that is solved for.
pub(super) struct Fixed<'a> {
    pub(super) problem: &'a DiscreteProblem,
    pub(super) zeta_at_points: Vec<f64>,
    /// Of each bound whether it is active.
    pub(super) active: Vec<bool>,
}

impl<'a> Fixed<'a> {
    /// In P2. Active are the same vertices as in `state`, and the midpoints between two of them. Collective.
    pub(super) fn finer(orders: &BothOrders<'a>, state: &State) -> Result<Self, PetscError> {
        let problem = orders.fine;
        let (body, constraints) = (&problem.body, &problem.constraints);
        let node_of = |point: &ContactPoint| orders.node_of_vertex[point.node];
        let points = state.contact.iter().filter(|point| point.active);
        let points: Vec<_> = points.map(|p| ContactPoint { node: node_of(p), ..*p }).collect();
        let mut active = vec![0.0; body.nodes.points.len()];
        points.iter().for_each(|point| active[point.node] = 1.0);
        body.nodes.partition.update(&mut active, 1)?;
        let mut between = vec![false; active.len()];
        for &(middle, ends) in &orders.middles {
            between[middle] = ends.iter().all(|&end| active[orders.node_of_vertex[end]] > 0.0);
        }
        let flags = active_bounds(constraints, &points, 0.0);
        let bounds = constraints.bounds.iter().zip(flags);
        let active = bounds.map(|(bound, flag)| flag > 0.0 || between[bound.node]).collect();
        let zeta_at_points = problem.zeta_at_points(&state.zeta);
        Ok(Self { problem, zeta_at_points, active })
    }

    /// The places of the active bounds.
    fn active(&self) -> impl Iterator<Item = usize> {
        (0..self.active.len()).filter(|&place| self.active[place])
    }

    /// Sets the entries of the unknowns that are prescribed or at an active bound to 0.
    pub(super) fn clear_fixed(&self, field: &mut [f64]) {
        let constraints = &self.problem.constraints;
        constraints.bases.zero_fixed(field);
        self.active().for_each(|place| field[constraints.bounds[place].dof] = 0.0);
    }

    /// The unknowns of a field u, but for those that are prescribed or at an active bound.
    pub(super) fn start(&self, case: &LoadCase, mut u: Vec<f64>) -> Vec<f64> {
        let constraints = &self.problem.constraints;
        constraints.bases.displacement_to_local(&mut u);
        constraints.prescribed().for_each(|dof| u[dof] = case.lift[dof]);
        self.active().for_each(|place| u[case.bounds[place].dof] = case.bounds[place].upper);
        u
    }

    /// K c, element by element.
    pub(super) fn product(&self, c: &[f64]) -> Result<Vec<f64>, PetscError> {
        let DiscreteProblem { body, constraints, elasticity, .. } = self.problem;
        let mut u = c.to_vec();
        constraints.bases.displacement_to_global(&mut u);
        body.nodes.partition.update(&mut u, 2)?;
        let mut forces = elasticity.internal_force(body, &self.zeta_at_points, &u);
        constraints.bases.force_to_local(&mut forces);
        Ok(forces)
    }

    /// The same for fields, and forces, without the unknowns that are prescribed or at an active bound.
    pub(super) fn free_product(&self, c: &[f64]) -> Result<Vec<f64>, PetscError> {
        let mut forces = self.product(c)?;
        self.clear_fixed(&mut forces);
        Ok(forces)
    }

    /// A field of the owned unknowns, with room for those of other ranks.
    pub(super) fn extended(&self, owned: &[f64]) -> Vec<f64> {
        let mut field = owned.to_vec();
        field.resize(2 * self.problem.body.nodes.points.len(), 0.0);
        field
    }
}
