//! SOLVE: a run with few time steps, the error of u and the penetration on each triangle, and the answer that stays.

use super::{Extremes, extremes::points_of_ranks};
use crate::{
    estimate::{RecoveredStrains, UNLOADED},
    evolution::{Outcome, RunError, RunOptions, Step, all_steps},
    mesh::Mesh,
    observe::{ObservedProblem, Value},
    petsc::{PetscError, Session},
    problem::State,
};
use nalgebra::Vector3;

/// Number of steps of the run, and of evenly spread times at which its errors are estimated.
///
/// Tuned on the 13 adapted runs. Half: 15 % more steps. Twice: 2 % fewer triangles and steps, and a bar of six other
/// bodies fails.
pub const INSTANTS: usize = 8;
/// Number of these times in a run that is only compared with another.
pub(super) const FEW: usize = 3;
/// Between these times, errors are estimated where max |u| exceeds its maximum at them by this factor: a short pulse.
const LARGER: f64 = 1.5;

/// A run with few steps, and its errors on each triangle of the undivided mesh.
pub(super) struct FewStepRun<'a> {
    pub(super) problem: &'a ObservedProblem,
    pub(super) outcome: Outcome,
    /// The extremes at the end.
    pub(super) extremes: Extremes<'a>,
    pub(super) history: History,
}

/// The figures and the estimated errors of the steps of a run.
#[derive(Default)]
pub(super) struct History {
    /// The number of times at which errors are estimated, and the last such time so far, s.
    instants: usize,
    last: Option<f64>,
    /// max_t ‖ε* − ε(u)‖²_T, and the maximum sum over T at any time.
    squares: Vec<f64>,
    worst: f64,
    /// max_t ‖u‖², N m per metre of thickness, and the maximum |u| at any time, m.
    pub(super) energy: f64,
    pub(super) displacement: f64,
    /// At the last time, with the recovered strains ε*: ‖ε* − ε(u)‖²_T per triangle, their sum, and ‖u‖².
    end: (Vec<f64>, f64, f64),
    /// The maximum penetration at an edge of each triangle at any time, m.
    pub(super) depths: Vec<f64>,
    /// The times at which steps end, s.
    pub(super) times: Vec<f64>,
}

impl<'a> FewStepRun<'a> {
    /// Runs `problem`, with estimates at about `instants` times. Adaptive steps end at
    /// the times `followed` of the run with which this one is compared. Collective.
    pub(super) fn run(
        session: &Session,
        problem: &'a ObservedProblem,
        run_options: &RunOptions,
        instants: usize,
        followed: &[f64],
    ) -> Result<Self, RunError> {
        let mut history = History::new(instants, problem.mesh().triangles.len());
        let mut observe = |step: &Step| Ok(history.observe(problem, step)?);
        let run = all_steps(session, problem, run_options, &mut observe, None, followed)?;
        let outcome = run.outcome;
        if history.last != Some(outcome.last.state.time) {
            history.estimate(problem, &outcome.last.state)?;
        }
        let Step { state, figures, .. } = &outcome.last;
        let extremes = Extremes::new(problem, state, figures)?;
        Ok(Self { problem, outcome, extremes, history })
    }

    /// The time at which ζ_* was reached, s.
    pub(super) fn stop(&self) -> Option<f64> {
        self.outcome.stopped.as_ref().map(|stop| stop.time)
    }

    /// Do the errors of the time steps leave open whether ζ_* is reached before the end of the scene?
    pub(super) fn is_undecided(&self) -> bool {
        let end = self.problem.scene().time.map_or(f64::INFINITY, |grid| grid.end);
        match self.outcome.stopped {
            Some(stop) => stop.time + stop.uncertainty > end,
            None => self.outcome.may_stop.is_some(),
        }
    }

    /// max (ζ₀ − ζ) at the end and its mean over the body; 0 if ζ_* was reached. Collective.
    pub(super) fn damage(&self) -> [f64; 2] {
        if self.outcome.stopped.is_some() {
            return [0.0; 2];
        }
        let (body, zeta) = (&self.problem.body, &self.outcome.last.state.zeta);
        let initial = self.problem.initial_damage();
        let done: Vec<f64> = initial.iter().zip(zeta).map(|(from, zeta)| from - zeta).collect();
        [body.vertices.partition.min_max(&done).1, body.mean(&done)].map(|damage| damage.max(0.0))
    }

    /// The scales of the figures. An extreme that has `not_converged` is no scale of the others.
    pub(super) fn scales(&self, not_converged: &[String]) -> Vec<f64> {
        let (sizes, forces) = (self.outcome.sizes(self.problem), self.outcome.last.forces);
        self.problem.figure_scales(&sizes, not_converged, self.history.energy, forces)
    }

    /// The length of the part of Γ_C on which the ends of contact may lie, m: half of an edge for each end.
    pub(super) fn open_length(&self) -> f64 {
        let half = |[[ax, ay], [bx, by]]: &[[f64; 2]; 2]| 0.5 * (bx - ax).hypot(by - ay);
        self.extremes.ends.iter().map(half).sum()
    }

    /// [`Self::open_length`] relative to the largest length of contact in the run; 0 without contact ends.
    pub(super) fn open(&self) -> f64 {
        let length = self.problem.figures.number("contact_length");
        let length = length.map(|number| self.outcome.sizes(self.problem)[number]);
        length.filter(|length| *length > 0.0).map_or(0.0, |length| self.open_length() / length)
    }

    /// ζ at the end at the vertices of each triangle of the undivided mesh. Collective.
    pub(super) fn zeta(&self) -> [Vec<f64>; 3] {
        let (triangles, zeta) = (&self.problem.body.mesh.triangles, &self.outcome.last.state.zeta);
        let own = |i: usize| triangles.iter().map(|nodes| zeta[nodes[i]]).collect::<Vec<_>>();
        [0, 1, 2].map(|i| gathered(self.problem, &own(i)))
    }

    /// ε(u) at the end at the six [`nodes`](crate::fem::Body::nodal_strains) of each triangle of this rank.
    pub(super) fn own_strains(&self) -> Vec<[Vector3<f64>; 6]> {
        let (body, state) = (&self.problem.body, &self.outcome.last.state);
        let u = &self.problem.strained(state).u;
        (0..body.triangles.len()).map(|t| body.nodal_strains(t, u)).collect()
    }

    /// The same for each triangle of the undivided mesh. Collective.
    pub(super) fn strains(&self) -> Vec<[Vector3<f64>; 6]> {
        let own = self.own_strains();
        let mut strains = vec![[Vector3::zeros(); 6]; self.history.squares.len()];
        for (i, component) in (0..6).flat_map(|i| (0..3).map(move |component| (i, component))) {
            let values = Vec::from_iter(own.iter().map(|strains| strains[i][component]));
            let values = gathered(self.problem, &values);
            strains.iter_mut().zip(values).for_each(|(of, value)| of[i][component] = value);
        }
        strains
    }

    /// ‖u‖² at the end by which its error is divided, N m per metre of thickness. After unloading, the remaining deformation need
    /// not be exact.
    pub(super) fn energy(&self) -> f64 {
        self.history.end.2.max(UNLOADED.powi(2) * self.history.energy)
    }

    /// The relative error of u at the worst time, and the shares m_T of its square.
    pub(super) fn relative(&self) -> (f64, Vec<f64>) {
        let History { squares, worst, energy, end: (last, error, _), .. } = &self.history;
        if *worst == 0.0 {
            return (0.0, vec![0.0; squares.len()]);
        }
        let of_last = self.energy();
        let share = |(max, end): (&f64, &f64)| (max / energy).max(end / of_last);
        let shares = squares.iter().zip(last).map(share).collect();
        ((worst / energy).max(error / of_last).sqrt(), shares)
    }
}

/// The answer of a run on a mesh.
pub(super) struct Answer {
    pub(super) mesh: Mesh,
    /// ζ at the end, at the nodes of the mesh.
    pub(super) zeta: Vec<f64>,
    /// The times at which steps end, s.
    pub(super) times: Vec<f64>,
    /// The estimated relative error of u in the energy norm, η of [`Sequence`](super::sequence).
    pub(super) error: f64,
    /// The figures at the end.
    pub(super) values: Vec<Value>,
    /// Per figure that is a largest value over points: these, m, and the sizes of the values there at the end.
    pub(super) points: Vec<Vec<([f64; 2], f64)>>,
    /// The length of the part of Γ_C on which the ends of contact may lie, m.
    pub(super) open: f64,
    /// The time of ζ_*, s.
    pub(super) stop: Option<f64>,
}

impl Answer {
    /// The answer of `run` on `mesh`. Collective.
    pub(super) fn new(run: &FewStepRun, mesh: Mesh) -> Self {
        let (error, _) = run.relative();
        let (mut zeta, of_triangles) = (vec![1.0; mesh.nodes.len()], run.zeta());
        for (t, nodes) in mesh.triangles.iter().enumerate() {
            nodes.iter().zip(&of_triangles).for_each(|(&node, of)| zeta[node] = of[t]);
        }
        let problem = run.problem;
        let mut points =
            Vec::from_iter(problem.figures.iter().enumerate().map(|(i, _)| run.extremes.points(i)));
        if let Some(number) = problem.figures.number("displacement_max") {
            let (nodes, u) = (&problem.body.nodes, &run.outcome.last.state.u);
            let own = u.chunks_exact(2).zip(&nodes.points).take(nodes.partition.owned());
            let own = own.map(|(u, &[x, y])| [x, y, u[0].hypot(u[1])]);
            points[number] = points_of_ranks(problem.body.comm(), own);
        }
        Self {
            mesh,
            zeta,
            times: run.history.times.clone(),
            error,
            values: run.outcome.last.figures.clone(),
            points,
            open: run.open_length(),
            stop: run.stop(),
        }
    }
}

impl History {
    fn new(instants: usize, triangles: usize) -> Self {
        let (squares, depths) = (vec![0.0; triangles], vec![0.0; triangles]);
        Self { instants, squares, depths, ..Self::default() }
    }

    /// Records an accepted step. Collective.
    fn observe(&mut self, problem: &ObservedProblem, step: &Step) -> Result<(), PetscError> {
        let time = step.state.time;
        self.times.push(time);
        let end = problem.scene().time.map_or(1.0, |grid| grid.end);
        let part = |time: f64| (self.instants as f64 * time / end + 1e-9).floor();
        let is_larger = step.record.displacement_max > LARGER * self.displacement;
        match is_larger || self.last.is_none_or(|before| part(time) > part(before)) {
            true => self.estimate(problem, &step.state),
            false => Ok(()),
        }
    }

    /// Estimates the errors of a state. Collective.
    fn estimate(&mut self, problem: &ObservedProblem, state: &State) -> Result<(), PetscError> {
        let body = &problem.body;
        self.last = Some(state.time);
        self.displacement = self.displacement.max(body.nodes.partition.max_norm(&state.u));
        for penetration in problem.penetrations(state) {
            let deepest = &mut self.depths[penetration.triangle];
            *deepest = deepest.max(penetration.depth);
        }
        let zeta = problem.zeta_at_points(&state.zeta);
        let state = &problem.strained(state);
        let recovered = RecoveredStrains::new(body, &state.u)?;
        let error = recovered.energy_error(&problem.elasticity, &zeta, &state.u);
        let squares = gathered(problem, &error.squares);
        self.squares.iter_mut().zip(&squares).for_each(|(max, square)| *max = max.max(*square));
        self.end = (squares, error.error, error.energy);
        self.worst = self.worst.max(error.error);
        self.energy = self.energy.max(error.energy);
        Ok(())
    }
}

/// Values of this rank's triangles for all triangles of the undivided mesh. Collective.
fn gathered(problem: &ObservedProblem, own: &[f64]) -> Vec<f64> {
    let body = &problem.body;
    let mut values = vec![0.0; problem.mesh().triangles.len()];
    let own = body.global_triangles.iter().zip(own).take(body.own_triangles);
    own.for_each(|(&triangle, value)| values[triangle] = *value);
    body.comm().sum(&mut values);
    values
}
