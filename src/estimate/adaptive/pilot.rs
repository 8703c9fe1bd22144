//! A run with few time steps, the error of u and the penetration on each triangle, and the figures of all steps.

use crate::{
    estimate::{self, RecoveredStrains},
    evolution::{self, Outcome, Phases, RunError, Step},
    petsc::{PetscError, Session},
    problem::{DiscreteProblem, State},
};

/// Number of steps of the run, and of evenly spread times at which its errors are estimated.
pub(super) const INSTANTS: usize = 12;
/// Number of these times in a run that is only compared with another.
const FEW: usize = 3;
/// Errors at the end are relative to at least this fraction of the maximum ‖u‖².
const MIN_ENERGY: f64 = 1e-4;

/// A run with few steps, and its errors on each triangle of the undivided mesh.
pub(super) struct Pilot<'a> {
    pub(super) problem: &'a DiscreteProblem,
    pub(super) outcome: Outcome,
    history: History,
}

/// The figures and the estimated errors of the steps of a run.
#[derive(Default)]
struct History {
    /// The number of times at which errors are estimated, and the last such time so far, s.
    instants: usize,
    last: Option<f64>,
    /// max_t ‖ε* − ε(u)‖²_T, and the maximum sum over T at any time.
    squares: Vec<f64>,
    worst: f64,
    /// max_t ‖u‖², and the maximum |u| at any time, m.
    energy: f64,
    displacement: f64,
    /// ‖ε* − ε(u)‖²_T, their sum and ‖u‖² at the last time.
    end: (Vec<f64>, f64, f64),
    /// The maximum penetration at an edge of each triangle at any time, m.
    depths: Vec<f64>,
    /// The times of all steps, s, with their figures, and the maximum size of each figure.
    figures: Vec<(f64, Vec<f64>)>,
    sizes: Vec<f64>,
}

impl<'a> Pilot<'a> {
    /// Runs `problem` on a mesh of `triangles` triangles, with estimates at its end if `estimated`. Collective.
    pub(super) fn run(
        session: &Session,
        problem: &'a DiscreteProblem,
        solver: &str,
        triangles: usize,
        estimated: bool,
    ) -> Result<Self, RunError> {
        let zeros = vec![0.0; triangles];
        let instants = if estimated { INSTANTS } else { FEW };
        let mut history =
            History { instants, squares: zeros.clone(), depths: zeros, ..History::default() };
        let phases = Phases::default();
        let mut observe = |step: &Step| Ok(history.observe(problem, step)?);
        let run = if estimated { estimate::run } else { evolution::run };
        let outcome = run(session, problem, solver, &phases, &mut observe)?;
        if history.last != Some(outcome.last.state.time) {
            history.estimate(problem, &outcome.last.state)?;
        }
        Ok(Self { problem, outcome, history })
    }

    /// The time at which ζ_* was reached, s.
    pub(super) fn stop(&self) -> Option<f64> {
        self.outcome.stopped.as_ref().map(|stop| stop.time)
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

    /// The maximum |u| at any time, m.
    pub(super) fn displacement(&self) -> f64 {
        self.history.displacement
    }

    /// The maximum penetration at an edge of each triangle at any time, m.
    pub(super) fn depths(&self) -> &[f64] {
        &self.history.depths
    }

    /// ‖u‖² at the end, N m per metre of thickness, and the maximum at any time.
    pub(super) fn energies(&self) -> [f64; 2] {
        [self.history.end.2, self.history.energy]
    }

    /// The scales of the figures.
    pub(super) fn scales(&self) -> Vec<f64> {
        self.problem.figure_scales(&self.history.sizes, self.history.energy)
    }

    /// The figures at `time`, s, affine between the steps.
    pub(super) fn figures_at(&self, time: f64) -> Vec<f64> {
        let figures = &self.history.figures;
        let after = figures.partition_point(|(t, _)| *t < time).min(figures.len() - 1);
        let [(t0, before), (t1, next)] = [&figures[after.saturating_sub(1)], &figures[after]];
        let part = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 1.0 };
        before.iter().zip(next).map(|(a, b)| (1.0 - part) * a + part * b).collect()
    }

    /// ζ at the end at the vertices of each triangle of the undivided mesh. Collective.
    pub(super) fn zeta(&self) -> [Vec<f64>; 3] {
        let (triangles, zeta) = (&self.problem.body.mesh.triangles, &self.outcome.last.state.zeta);
        let own = |i: usize| triangles.iter().map(|nodes| zeta[nodes[i]]).collect::<Vec<_>>();
        [0, 1, 2].map(|i| self.gathered(&own(i)))
    }

    /// The normal reactions at the end on the edges of each triangle. Collective.
    pub(super) fn reactions(&self) -> Vec<f64> {
        self.problem.reactions(&self.outcome.last.state, self.history.squares.len())
    }

    /// Values of this rank's triangles for all triangles of the undivided mesh. Collective.
    pub(super) fn gathered(&self, own: &[f64]) -> Vec<f64> {
        gathered(self.problem, own, self.history.squares.len())
    }

    /// The relative error of u at the worst time, and the shares m_T of its square.
    pub(super) fn relative(&self) -> (f64, Vec<f64>) {
        let History { squares, worst, energy, end: (last, error, of_last), .. } = &self.history;
        if *worst == 0.0 {
            return (0.0, vec![0.0; squares.len()]);
        }
        // After unloading, the remaining deformation need not be exact.
        let of_last = of_last.max(MIN_ENERGY * energy);
        let share = |(max, end): (&f64, &f64)| (max / energy).max(end / of_last);
        let shares = squares.iter().zip(last).map(share).collect();
        ((worst / energy).max(error / of_last).sqrt(), shares)
    }
}

impl History {
    /// Records an accepted step. Collective.
    fn observe(&mut self, problem: &DiscreteProblem, step: &Step) -> Result<(), PetscError> {
        let time = step.state.time;
        let figures = step.figures();
        let sizes = problem.figure_sizes(&figures);
        self.sizes.resize(sizes.len(), 0.0);
        self.sizes.iter_mut().zip(sizes).for_each(|(most, size)| *most = most.max(size));
        self.figures.push((time, figures));
        let end = problem.scene().time.map_or(1.0, |grid| grid.end);
        let part = |time: f64| (self.instants as f64 * time / end + 1e-9).floor();
        match self.last.is_none_or(|before| part(time) > part(before)) {
            true => self.estimate(problem, &step.state),
            false => Ok(()),
        }
    }

    /// Estimates the errors of a state. Collective.
    fn estimate(&mut self, problem: &DiscreteProblem, state: &State) -> Result<(), PetscError> {
        let body = &problem.body;
        self.last = Some(state.time);
        self.displacement = self.displacement.max(body.nodes.partition.max_norm(&state.u));
        for penetration in problem.penetrations(state) {
            let deepest = &mut self.depths[penetration.triangle];
            *deepest = deepest.max(penetration.depth);
        }
        let zeta = problem.zeta_at_points(&state.zeta);
        let recovered = RecoveredStrains::new(body, &state.u)?;
        let error = recovered.energy_error(&problem.elasticity, &zeta, &state.u);
        let squares = gathered(problem, &error.squares, self.squares.len());
        self.squares.iter_mut().zip(&squares).for_each(|(max, square)| *max = max.max(*square));
        self.end = (squares, error.error, error.energy);
        self.worst = self.worst.max(error.error);
        self.energy = self.energy.max(error.energy);
        Ok(())
    }
}

/// Values of this rank's triangles for all `count` triangles of the undivided mesh. Collective.
fn gathered(problem: &DiscreteProblem, own: &[f64], count: usize) -> Vec<f64> {
    let body = &problem.body;
    let mut values = vec![0.0; count];
    let own = body.global_triangles.iter().zip(own).take(body.own_triangles);
    own.for_each(|(&triangle, value)| values[triangle] = *value);
    body.nodes.partition.comm().sum(&mut values);
    values
}
