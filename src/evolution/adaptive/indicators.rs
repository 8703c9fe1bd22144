//! How the error of u in a run with few time steps is spread over the triangles.

use super::super::{DiscreteProblem, Outcome, Phases, RunError, State, run};
use crate::{
    fem::RecoveredStrains,
    petsc::{PetscError, Session},
};

/// Steps of the run; so many times, about, at which errors are estimated.
pub(super) const INSTANTS: usize = 12;
/// At the end, errors are relative to no less than this part of the largest ‖u‖².
const UNLOADED: f64 = 1e-4;

/// The errors of a run, triangle by triangle of the undivided mesh.
pub(super) struct Indicators<'a> {
    problem: &'a DiscreteProblem,
    last: Option<f64>,
    /// max_t ‖ε* − ε(u)‖²_T, and the largest sum over T at any time.
    squares: Vec<f64>,
    worst: f64,
    /// max_t ‖u‖², and the largest |u| at any time, m.
    energy: f64,
    pub(super) displacement: f64,
    /// ‖ε* − ε(u)‖²_T, their sum and ‖u‖² at the last time.
    end: (Vec<f64>, f64, f64),
}

impl<'a> Indicators<'a> {
    /// Runs `problem` on a mesh of so many triangles. Collective.
    pub(super) fn of_run(
        session: &Session,
        problem: &'a DiscreteProblem,
        solver: &str,
        triangles: usize,
    ) -> Result<(Outcome, Self), RunError> {
        let mut indicators = Self {
            problem,
            last: None,
            squares: vec![0.0; triangles],
            worst: 0.0,
            energy: 0.0,
            displacement: 0.0,
            end: Default::default(),
        };
        let outcome = run(session, problem, solver, &Phases::default(), &mut |step| {
            Ok(indicators.observe(&step.state, false)?)
        })?;
        indicators.observe(&outcome.last.state, true)?;
        Ok((outcome, indicators))
    }

    /// Sees an accepted state; `at_end` says that it is the last one. Collective.
    fn observe(&mut self, state: &State, at_end: bool) -> Result<(), PetscError> {
        let problem = self.problem;
        let end = problem.scene().time.map_or(1.0, |grid| grid.end);
        let part = |time: f64| (INSTANTS as f64 * time / end + 1e-9).floor();
        let due = match self.last {
            None => true,
            Some(before) => state.time > before && (at_end || part(state.time) > part(before)),
        };
        if !due {
            return Ok(());
        }
        self.last = Some(state.time);
        let body = &problem.body;
        let zeta = problem.zeta_at_points(&state.zeta);
        let recovered = RecoveredStrains::new(body, &state.u)?;
        let error = recovered.energy_error(&problem.elasticity, &zeta, &state.u);
        let squares = self.gathered(&error.squares);
        self.squares.iter_mut().zip(&squares).for_each(|(max, square)| *max = max.max(*square));
        self.end = (squares, error.error, error.energy);
        self.worst = self.worst.max(error.error);
        self.energy = self.energy.max(error.energy);
        self.displacement = self.displacement.max(body.nodes.partition.max_norm(&state.u));
        Ok(())
    }

    /// Values of this rank's triangles for all triangles of the undivided mesh. Collective.
    pub(super) fn gathered(&self, own: &[f64]) -> Vec<f64> {
        let body = &self.problem.body;
        let mut values = vec![0.0; self.squares.len()];
        for (&triangle, value) in body.global_triangles.iter().zip(own) {
            values[triangle] = *value;
        }
        body.nodes.partition.comm().sum(&mut values);
        values
    }

    /// The relative error at the worst time, and the shares m_T of its square.
    pub(super) fn relative(&self) -> (f64, Vec<f64>) {
        if self.worst == 0.0 {
            return (0.0, vec![0.0; self.squares.len()]);
        }
        // What is left after unloading need not be exact.
        let (squares, error, energy) = &self.end;
        let energy = energy.max(UNLOADED * self.energy);
        let share = |(max, end): (&f64, &f64)| (max / self.energy).max(end / energy);
        let shares = self.squares.iter().zip(squares).map(share).collect();
        ((self.worst / self.energy).max(error / energy).sqrt(), shares)
    }
}
