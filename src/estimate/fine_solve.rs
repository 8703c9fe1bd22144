//! The displacements in P2 for the damage and the active nodes of a state in P1.

use crate::{
    contact::ContactPoint,
    evolution::{Compliance, RunError, active_bounds},
    fem::Elements,
    petsc::{Operator, PetscError, Session, solve_by_energy},
    problem::{DiscreteProblem, LoadCase, State},
};

/// A problem in P2, solved by conjugate gradients. They start from u in P1, plus a step along the last change.
///
/// The preconditioner is the sum of two corrections: K₁⁻¹ times the forces transferred to P1, and the residual over
/// the diagonal of K (Xu, SIAM Review 34, 1992).
pub(super) struct FineSolve<'a> {
    session: &'a Session,
    problem: &'a DiscreteProblem,
    /// K₁⁻¹, for a state near the end of the run.
    compliance: Compliance<'a>,
    /// The node of P2 at each vertex.
    node_of_vertex: Vec<usize>,
    /// The node of P2 in the middle of each edge, and the vertices at the ends of the edge.
    middles: Vec<(usize, [usize; 2])>,
    /// The mean diagonal entry of K at each node of P2 in the last state, N/m.
    diagonal: Vec<f64>,
    /// The change of c by the last solve.
    change: Option<Vec<f64>>,
}

/// The fraction of the energy of u₂ − u₁ that the iteration may leave, and the maximum number of iterations.
const REST: f64 = 0.004;
const ITERATIONS: usize = 30;

impl<'a> FineSolve<'a> {
    /// For the problem in P2, with K⁻¹ and the last state of a run in P1.
    pub(super) fn new(
        session: &'a Session,
        problem: &'a DiscreteProblem,
        compliance: Compliance<'a>,
        last: &State,
    ) -> Self {
        let body = &problem.body;
        let mut ends = vec![None; body.nodes.points.len()];
        for (&[a, b, c], nodes) in
            body.mesh.triangles.iter().zip(body.quadratic_nodes().unwrap_or_default())
        {
            let sides = [[a, b], [b, c], [c, a]].into_iter().zip(&nodes[3..]);
            sides.for_each(|(side, &middle)| ends[middle] = Some(side));
        }
        let middles = ends.into_iter().enumerate();
        let middles = middles.filter_map(|(middle, ends)| Some((middle, ends?))).collect();
        let diagonal = stiffness_diagonal(problem, last);
        let node_of_vertex = body.node_of_vertex();
        Self { session, problem, compliance, node_of_vertex, middles, diagonal, change: None }
    }

    /// u₂ of a state in P1. `None` if the active nodes do not support the body. Collective.
    pub(super) fn displacement(&mut self, state: &State) -> Result<Option<Vec<f64>>, RunError> {
        self.compliance.set(&state.zeta, &state.contact)?;
        let DiscreteProblem { body, constraints, .. } = self.problem;
        let partition = &body.nodes.partition;
        let case = self.problem.load_case(state.time)?;
        let mut system = System {
            zeta_at_points: self.problem.zeta_at_points(&state.zeta),
            active: self.active_bounds(state)?,
            gained: 0.0,
            supported: true,
            solve: self,
        };
        let mut c = system.start(state, &case);
        let mut residual = case.load;
        constraints.bases.force_to_local(&mut residual);
        residual.iter_mut().zip(system.product(&c)?).for_each(|(f, image)| *f -= image);
        system.clear_fixed(&mut residual);
        let along = system.along_last_change(&mut residual)?;
        let (session, owned) = (system.solve.session, 2 * partition.owned());
        let change = solve_by_energy(session, &mut system, &residual[..owned], ITERATIONS)?;
        let Some(mut change) = change.filter(|_| system.supported) else { return Ok(None) };
        change.iter_mut().zip(along).for_each(|(change, along)| *change += along);
        c.iter_mut().zip(&change).for_each(|(c, change)| *c += change);
        self.change = Some(change);
        constraints.bases.displacement_to_global(&mut c);
        partition.update(&mut c, 2)?;
        Ok(Some(c))
    }

    /// Per bound in P2: is it active? Active are the vertices that are active in `state`, and the
    /// midpoints between two of them. Collective.
    fn active_bounds(&self, state: &State) -> Result<Vec<bool>, PetscError> {
        let (body, constraints) = (&self.problem.body, &self.problem.constraints);
        let points = state.contact.iter().filter(|point| point.active);
        let at_node = |p: &ContactPoint| ContactPoint { node: self.node_of_vertex[p.node], ..*p };
        let points: Vec<_> = points.map(at_node).collect();
        let mut active = vec![0.0; body.nodes.points.len()];
        points.iter().for_each(|point| active[point.node] = 1.0);
        body.nodes.partition.update(&mut active, 1)?;
        let mut between = vec![false; active.len()];
        for &(middle, ends) in &self.middles {
            between[middle] = ends.iter().all(|&end| active[self.node_of_vertex[end]] > 0.0);
        }
        let flags = active_bounds(constraints, &points, 0.0);
        let bounds = constraints.bounds.iter().zip(flags);
        Ok(bounds.map(|(bound, flag)| flag > 0.0 || between[bound.node]).collect())
    }

    /// Transfers forces from the nodes of P2 to P1: each end of an edge gets half of the force at the midpoint.
    fn at_vertices(&self, fine: &[f64]) -> Vec<f64> {
        let own = self.node_of_vertex.iter().flat_map(|&node| [fine[2 * node], fine[2 * node + 1]]);
        let mut coarse: Vec<f64> = own.collect();
        for &(middle, ends) in &self.middles {
            for (vertex, k) in ends.into_iter().flat_map(|vertex| [(vertex, 0), (vertex, 1)]) {
                coarse[2 * vertex + k] += 0.5 * fine[2 * middle + k];
            }
        }
        coarse
    }
}

/// The linear problem of a state, in the unknowns c of P2 that are neither prescribed nor at an active bound.
struct System<'s, 'a> {
    solve: &'s mut FineSolve<'a>,
    zeta_at_points: Vec<f64>,
    /// Per bound: is it active?
    active: Vec<bool>,
    /// The energy of the change before the iteration, N m per metre of thickness.
    gained: f64,
    /// Do the active nodes support the body?
    supported: bool,
}

impl System<'_, '_> {
    /// The indices of the active bounds.
    fn active(&self) -> impl Iterator<Item = usize> {
        (0..self.active.len()).filter(|&place| self.active[place])
    }

    /// The initial unknowns: u₁, except at prescribed unknowns and active bounds.
    fn start(&self, state: &State, case: &LoadCase) -> Vec<f64> {
        let DiscreteProblem { body, constraints, .. } = self.solve.problem;
        let mut c = body.at_nodes(&state.u, 2);
        constraints.bases.displacement_to_local(&mut c);
        constraints.prescribed().for_each(|dof| c[dof] = case.lift[dof]);
        self.active().for_each(|place| c[case.bounds[place].dof] = case.bounds[place].upper);
        c
    }

    /// Sets the entries of the unknowns that are prescribed or at an active bound to 0.
    fn clear_fixed(&self, field: &mut [f64]) {
        let constraints = &self.solve.problem.constraints;
        constraints.bases.zero_fixed(field);
        self.active().for_each(|place| field[constraints.bounds[place].dof] = 0.0);
    }

    /// The step (d·r / d·Kd) d along the change d of the last state, because d hardly changes its shape between two
    /// states. Subtracts the forces of the step from the `residual` r. Collective.
    fn along_last_change(&mut self, residual: &mut [f64]) -> Result<Vec<f64>, PetscError> {
        let Some(last) = self.solve.change.take() else { return Ok(vec![0.0; residual.len()]) };
        let mut d = self.extended(&last);
        self.clear_fixed(&mut d);
        let mut image = self.product(&d)?;
        self.clear_fixed(&mut image);
        let partition = &self.solve.problem.body.nodes.partition;
        let (work, stiffness) = (partition.dot(&d, residual, 2), partition.dot(&d, &image, 2));
        let step = if stiffness > 0.0 { work / stiffness } else { 0.0 };
        residual.iter_mut().zip(image).for_each(|(r, image)| *r -= step * image);
        d.iter_mut().for_each(|d| *d *= step);
        self.gained = step * work;
        Ok(d)
    }

    /// K c, element by element.
    fn product(&self, c: &[f64]) -> Result<Vec<f64>, PetscError> {
        let DiscreteProblem { body, constraints, elasticity, .. } = self.solve.problem;
        let mut u = c.to_vec();
        constraints.bases.displacement_to_global(&mut u);
        body.nodes.partition.update(&mut u, 2)?;
        let mut forces = elasticity.internal_force(body, &self.zeta_at_points, &u);
        constraints.bases.force_to_local(&mut forces);
        Ok(forces)
    }

    /// The owned entries of a field with room for the entries of other ranks.
    fn extended(&self, owned: &[f64]) -> Vec<f64> {
        let mut field = owned.to_vec();
        field.resize(2 * self.solve.problem.body.nodes.points.len(), 0.0);
        field
    }
}

impl Operator for System<'_, '_> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let mut forces = self.product(&self.extended(x))?;
        self.clear_fixed(&mut forces);
        y.copy_from_slice(&forces[..y.len()]);
        Ok(())
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError> {
        let mut forces = self.extended(r);
        let DiscreteProblem { body, constraints, .. } = self.solve.problem;
        constraints.bases.force_to_global(&mut forces);
        body.nodes.partition.update(&mut forces, 2)?;
        let coarse = self.solve.at_vertices(&forces);
        let Some(coarse) = self.solve.compliance.displacement(coarse)? else {
            self.supported = false;
            z.fill(0.0);
            return Ok(());
        };
        let mut answer = body.at_nodes(&coarse, 2);
        constraints.bases.displacement_to_local(&mut answer);
        for (dof, (answer, r)) in answer.iter_mut().zip(r).enumerate() {
            *answer += r / self.solve.diagonal[dof / 2];
        }
        self.clear_fixed(&mut answer);
        z.copy_from_slice(&answer[..z.len()]);
        Ok(())
    }

    fn is_enough(&self, gained: f64, left: f64) -> bool {
        left <= REST * (self.gained + gained)
    }
}

/// The mean diagonal entry of K at each node of P2 in a state, N/m.
fn stiffness_diagonal(problem: &DiscreteProblem, state: &State) -> Vec<f64> {
    let mut diagonal = vec![0.0; problem.body.nodes.points.len()];
    let Elements::Quadratic(cells) = problem.body.elements() else { return diagonal };
    let zeta = problem.zeta_at_points(&state.zeta);
    let elements = cells.nodes.iter().zip(cells.elements).zip(zeta.as_chunks().0);
    for (t, ((nodes, element), zeta)) in elements.enumerate() {
        let d = problem.elasticity.d(&problem.body, t);
        for (i, &node) in nodes.iter().enumerate() {
            diagonal[node] += 0.5 * element.stiffness(d, zeta, i, i).trace();
        }
    }
    diagonal
}
