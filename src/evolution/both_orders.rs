//! Displacements of both orders for the damage and the active nodes of a state.

mod fixed;

use super::{
    DiscreteProblem, Phases, RunError, State,
    contact_step::{Compliance, ContactStep, active_bounds},
};
use crate::{
    contact::{ContactPoint, SOLVERS},
    fem::{Cells, Elements},
    mesh::Order,
    petsc::{Operator, PetscError, Session, solve_by_energy},
};
use fixed::Fixed;

/// A scene in P1 and in P2 on one mesh, one of them that of a run.
pub(super) struct BothOrders<'a> {
    session: &'a Session,
    /// The order of the run.
    order: Order,
    coarse: &'a DiscreteProblem,
    fine: &'a DiscreteProblem,
    /// K⁻¹ in P1, of about the last state of the run.
    compliance: Compliance<'a>,
    /// The node of P2 at each vertex.
    node_of_vertex: Vec<usize>,
    /// The node of P2 in the middle of each edge, and the vertices at its ends.
    middles: Vec<(usize, [usize; 2])>,
    /// Where P2 is solved for, the mean diagonal entry of the last K at each of its nodes, N/m.
    diagonal: Vec<f64>,
    /// u₂ − u₁ of the last state, or u₁ − Iu₂, in the unknowns of the order that is solved for.
    correction: Option<Vec<f64>>,
}

/// The part of the energy of a correction that the iteration may leave;
/// iterations at most.
const REST: f64 = 0.004;
const ITERATIONS: usize = 30;

impl<'a> BothOrders<'a> {
    /// From the problem of a run with its K⁻¹ and its last state, and the same problem in the other order;
    /// `None` where the triangle has no other order.
    pub(super) fn new(
        session: &'a Session,
        run: &'a DiscreteProblem,
        other: &'a DiscreteProblem,
        mut compliance: Compliance<'a>,
        last: &State,
        phases: &'a Phases,
    ) -> Result<Option<Self>, RunError> {
        let order = run.body.order();
        let (coarse, fine) = match order {
            Order::Linear => (run, other),
            Order::Quadratic => (other, run),
        };
        let Elements::Quadratic(cells) = fine.body.elements() else { return Ok(None) };
        let mut node_of_vertex = vec![0; fine.body.mesh.nodes.len()];
        let mut ends = vec![None; fine.body.nodes.points.len()];
        for (&[a, b, c], nodes) in fine.body.mesh.triangles.iter().zip(cells.nodes) {
            [a, b, c].iter().zip(nodes).for_each(|(&vertex, &node)| node_of_vertex[vertex] = node);
            let sides = [[a, b], [b, c], [c, a]].into_iter().zip(&nodes[3..]);
            sides.for_each(|(side, &middle)| ends[middle] = Some(side));
        }
        let middles = ends.into_iter().enumerate();
        let middles = middles.filter_map(|(middle, ends)| Some((middle, ends?))).collect();
        let mut diagonal = Vec::new();
        if order == Order::Linear {
            diagonal = stiffness_diagonal(fine, &cells, last);
        } else {
            // Makes room for another factor.
            drop(compliance);
            compliance = ContactStep::new(session, other, SOLVERS[0], phases)?.into_compliance()?;
            let contact = at_vertices(&node_of_vertex, &last.contact);
            compliance.keep_factor(&State { contact, ..last.clone() })?;
        }
        let correction = None;
        Ok(Some(Self {
            session,
            order,
            coarse,
            fine,
            compliance,
            node_of_vertex,
            middles,
            diagonal,
            correction,
        }))
    }

    /// The problems in P1 and P2.
    pub(super) fn problems(&self) -> [&'a DiscreteProblem; 2] {
        [self.coarse, self.fine]
    }

    /// u₁ and u₂ of a state of the run; `None` where the active nodes do not support the body.
    /// Collective.
    ///
    /// # Errors
    /// PETSc failed, or the scene contradicts itself at the other nodes.
    pub(super) fn displacements(
        &mut self,
        state: &State,
    ) -> Result<Option<[Vec<f64>; 2]>, RunError> {
        Ok(match self.order {
            Order::Linear => self.finer(state)?.map(|u2| [state.u.clone(), u2]),
            Order::Quadratic => self.coarser(state)?.map(|u1| [u1, state.u.clone()]),
        })
    }

    /// u₁ from Iu₂, the values of u₂ at the vertices.
    fn coarser(&mut self, state: &State) -> Result<Option<Vec<f64>>, RunError> {
        let contact = at_vertices(&self.node_of_vertex, &state.contact);
        self.compliance.set(&state.zeta, &contact)?;
        let problem = self.coarse;
        let flags = active_bounds(&problem.constraints, &contact, 0.0);
        let fixed = Fixed {
            problem,
            zeta_at_points: problem.zeta_at_points(&state.zeta),
            active: flags.into_iter().map(|flag| flag > 0.0).collect(),
        };
        self.solve(&fixed, state.time, self.at_vertices(&state.u))
    }

    /// u₂ from u₁.
    fn finer(&mut self, state: &State) -> Result<Option<Vec<f64>>, RunError> {
        self.compliance.set(&state.zeta, &state.contact)?;
        let fixed = Fixed::finer(self, state)?;
        self.solve(&fixed, state.time, self.prolonged(&state.u))
    }

    /// u at `time` by conjugate gradients from another field u, after a step along the correction of the last
    /// state.
    fn solve(
        &mut self,
        fixed: &Fixed,
        time: f64,
        u: Vec<f64>,
    ) -> Result<Option<Vec<f64>>, RunError> {
        let DiscreteProblem { body, constraints, .. } = fixed.problem;
        let partition = &body.nodes.partition;
        let (start, mut residual) = {
            let case = fixed.problem.load_case(time)?;
            (fixed.start(&case, u), case.load)
        };
        constraints.bases.force_to_local(&mut residual);
        add(&mut residual, -1.0, &fixed.product(&start)?);
        fixed.clear_fixed(&mut residual);
        let (mut correction, mut gained) = (vec![0.0; start.len()], 0.0);
        if let Some(mut last) = self.correction.take() {
            fixed.clear_fixed(&mut last);
            let image = fixed.free_product(&last)?;
            let (work, stiffness) =
                (partition.dot(&last, &residual, 2), partition.dot(&last, &image, 2));
            if stiffness > 0.0 {
                add(&mut correction, work / stiffness, &last);
                add(&mut residual, -work / stiffness, &image);
                gained = work * work / stiffness;
            }
        }
        let session = self.session;
        let owned = 2 * partition.owned();
        let mut of_state = OfState { orders: self, fixed, gained, supported: true };
        let found = solve_by_energy(session, &mut of_state, &residual[..owned], ITERATIONS)?;
        let Some(found) = found.filter(|_| of_state.supported) else { return Ok(None) };
        correction.iter_mut().zip(found).for_each(|(u, found)| *u += found);
        let mut u = start;
        add(&mut u, 1.0, &correction);
        self.correction = Some(correction);
        constraints.bases.displacement_to_global(&mut u);
        partition.update(&mut u, 2)?;
        Ok(Some(u))
    }

    /// The preconditioner's answer to a residual, both in the unknowns of the order that is solved for;
    /// `None` where the active nodes do not support the body. For P2 it is the sum of two corrections, K₁⁻¹
    /// of the forces as P1 sees them and the residual over the diagonal of K (Xu, SIAM Review 34, 1992).
    fn preconditioned(
        &mut self,
        fixed: &Fixed,
        residual: &[f64],
    ) -> Result<Option<Vec<f64>>, PetscError> {
        let DiscreteProblem { body, constraints, .. } = fixed.problem;
        let mut forces = residual.to_vec();
        constraints.bases.force_to_global(&mut forces);
        body.nodes.partition.update(&mut forces, 2)?;
        let z = match self.order {
            Order::Linear => {
                let coarse = self.restricted(&forces);
                self.compliance.displacement(coarse)?.map(|coarse| self.prolonged(&coarse))
            }
            Order::Quadratic => self.compliance.displacement(forces)?,
        };
        let Some(mut z) = z else { return Ok(None) };
        constraints.bases.displacement_to_local(&mut z);
        for (node, diagonal) in self.diagonal.iter().enumerate() {
            (2 * node..2 * node + 2).for_each(|dof| z[dof] += residual[dof] / diagonal);
        }
        fixed.clear_fixed(&mut z);
        Ok(Some(z))
    }

    /// A field at the vertices in P2.
    fn prolonged(&self, coarse: &[f64]) -> Vec<f64> {
        let mut fine = vec![0.0; 2 * self.fine.body.nodes.points.len()];
        for (vertex, &node) in self.node_of_vertex.iter().enumerate() {
            (0..2).for_each(|k| fine[2 * node + k] = coarse[2 * vertex + k]);
        }
        for &(middle, [a, b]) in &self.middles {
            let mean = |k: usize| 0.5 * (coarse[2 * a + k] + coarse[2 * b + k]);
            (0..2).for_each(|k| fine[2 * middle + k] = mean(k));
        }
        fine
    }

    /// Forces at the nodes of P2 as P1 sees them: the transpose of [`Self::prolonged`].
    fn restricted(&self, fine: &[f64]) -> Vec<f64> {
        let mut coarse = self.at_vertices(fine);
        for &(middle, ends) in &self.middles {
            for (vertex, k) in ends.into_iter().flat_map(|vertex| [(vertex, 0), (vertex, 1)]) {
                coarse[2 * vertex + k] += 0.5 * fine[2 * middle + k];
            }
        }
        coarse
    }

    /// The values of a field in P2 at the vertices.
    fn at_vertices(&self, fine: &[f64]) -> Vec<f64> {
        let values = |&node: &usize| [fine[2 * node], fine[2 * node + 1]];
        self.node_of_vertex.iter().flat_map(values).collect()
    }
}

/// The linear problem of a state as conjugate gradients see it.
struct OfState<'s, 'a> {
    orders: &'s mut BothOrders<'a>,
    fixed: &'s Fixed<'s>,
    /// The energy of the correction before the iteration.
    gained: f64,
    /// Whether the active nodes support the body.
    supported: bool,
}

impl Operator for OfState<'_, '_> {
    fn multiply(&mut self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError> {
        let image = self.fixed.free_product(&self.fixed.extended(x))?;
        y.copy_from_slice(&image[..y.len()]);
        Ok(())
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<(), PetscError> {
        let answer = self.orders.preconditioned(self.fixed, &self.fixed.extended(r))?;
        self.supported = answer.is_some();
        match answer {
            Some(answer) => z.copy_from_slice(&answer[..z.len()]),
            None => z.fill(0.0),
        }
        Ok(())
    }

    fn is_enough(&self, gained: f64, left: f64) -> bool {
        left <= REST * (self.gained + gained)
    }
}

/// The mean diagonal entries of K at the nodes of P2, N/m, in a state.
fn stiffness_diagonal(problem: &DiscreteProblem, cells: &Cells<6, 3>, state: &State) -> Vec<f64> {
    let mut diagonal = vec![0.0; problem.body.nodes.points.len()];
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

/// a ← a + factor · b.
fn add(a: &mut [f64], factor: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

/// The contact points at vertices, by these.
fn at_vertices(node_of_vertex: &[usize], contact: &[ContactPoint]) -> Vec<ContactPoint> {
    let last = node_of_vertex.iter().copied().max().unwrap_or(0);
    let mut vertex_of_node = vec![None; last + 1];
    let vertices = node_of_vertex.iter().enumerate();
    vertices.for_each(|(vertex, &node)| vertex_of_node[node] = Some(vertex));
    let vertex = |node: usize| vertex_of_node.get(node).copied().flatten();
    let at_vertex =
        |point: &ContactPoint| Some(ContactPoint { node: vertex(point.node)?, ..*point });
    contact.iter().filter_map(at_vertex).collect()
}
