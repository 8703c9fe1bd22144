//! The accuracy loop: meshes and time steps for an accuracy, and the error bars of figures.
//!
//! The loop is that of the field (Dörfler, SIAM J. Numer. Anal. 33, 1996):
//!
//! - SOLVE: a run with few time steps on the mesh (`FewStepRun`), which leaves an `Answer`.
//! - ESTIMATE: the error of u per triangle, m_T = max_t ‖ε* − ε(u(t))‖²_T / max_t ‖u(t)‖² (at the end relative to ‖u‖² there), with
//!   the recovered strains ε* (`RecoveredStrains`). An estimate misses details finer than the mesh. So a `Measurement` follows once
//!   the estimates are small: the same steps on the mesh bisected everywhere. The sequence of answers gives the error bars
//!   of the figures (`Sequence`).
//! - MARK: the factors for the sizes of the triangles (`marking`, `sizes`).
//! - REFINE: bisection down to these sizes.
//!
//! The loop ends for one reason (`End`). The run that is written is its last rung: it takes the mesh and the steps of the
//! loop, and is repeated once with shorter steps if its own steps take too much of the accuracy ([`LoopState::repeat`]).
//! Error bars of a given mesh (`--bars`) are the loop with a fixed mesh ([`measured_errors`]).
//!
//! - In: a scene and a mesh of its body. With an accuracy this mesh is coarse ([`first_mesh`]).
//! - Out: a [`LoopState`]: the mesh, the measured errors, the notes. A restart needs nothing else of the loop. It also says whether
//!   the accuracy is reached, and what is not known (`conclusion`).
//! - Caller: the command `run`.

mod answer;
mod bars;
mod changes;
mod conclusion;
mod extremes;
mod first_mesh;
mod limits;
mod marking;
mod measurement;
mod sequence;
mod sizes;
mod state;
mod verdict;

use crate::{
    estimate::Simulation,
    evolution::{RunError, RunOptions},
    interrupt::Signal,
    mesh::{Mesh, MeshError, Refinement},
    observe::{Bar, ObservedProblem},
    petsc::{PetscError, Session},
    problem::{Collapse, LoadCurve, SetupError},
    scene::{Scene, Stepping, rounded},
};
pub use answer::INSTANTS;
use answer::{Answer, FEW, FewStepRun};
pub use extremes::{BY_DIRECTION, Extreme, Extremes};
pub use first_mesh::first_mesh;
use limits::Limits;
use marking::Estimate;
use measurement::Measurement;
use serde::{Deserialize, Serialize};
pub use state::LoopState;
use verdict::{End, Progress};

/// A mesh that was adapted to a scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Adapted {
    /// The mesh.
    pub mesh: Mesh,
    /// The number of unknown displacement components on it.
    pub unknowns: usize,
    /// The number of meshes so far, with this one.
    pub rounds: usize,
    /// The estimated relative error of u on it, in the energy norm, at the worst time.
    pub error: f64,
    /// The measured relative error of the damage at the end.
    pub damage_error: Option<f64>,
    /// The damage at the end of the run with few steps, max (ζ₀ − ζ) and its mean; 0 if the run stops at ζ_*.
    pub damage: [f64; 2],
    /// The tolerance of the time steps that keeps the error of ζ within the accuracy.
    pub steps: f64,
    /// The measured errors of the figures from the mesh.
    pub measured: Measured,
    /// The maximum measured relative error and its name, once it is measured.
    pub worst: Option<(String, f64)>,
    /// The reason why the accuracy was not reached, if it was not.
    pub not_reached: Option<String>,
}

/// The errors from the mesh, as measured on a finer one; empty if they are not measured.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Measured {
    /// The error bars of the figures; empty if the run ends at ζ_*.
    pub bars: Vec<Bar>,
    /// The names of the extremes that do not converge over the meshes. They have no bars.
    pub not_converged: Vec<String>,
    /// max_t ‖u‖² of the run with few steps, N m per metre of thickness.
    pub energy: f64,
    /// The error bar of the time of ζ_*, s.
    pub stop: Option<f64>,
    /// The relative error of the damage ζ₀ − ζ in L² at the end; `None` without damage.
    pub damage: Option<f64>,
    /// The relative error of u in the energy norm at the end; 0 if the run ends at ζ_*.
    pub displacement: f64,
}

/// Errors that prevent an adapted mesh.
#[derive(thiserror::Error)]
pub enum AdaptError {
    /// The scene does not fit a mesh.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A triangle cannot be divided.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A run with few steps failed.
    #[error(
        "a run on {triangles} triangles that measures errors failed: {source}; without --accuracy and --bars you get the \
         results up to this failure"
    )]
    Run {
        /// The triangles of its mesh.
        triangles: usize,
        /// The failure of the run.
        source: RunError,
    },
    /// The run ends where the body turns over.
    #[error(
        "the body turns over at t = {}: just before, the contact shrinks to a point, and displacements and \
         stresses grow as the mesh is refined; set an earlier time.end",
        rounded(*.time)
    )]
    Overturns {
        /// The time, s.
        time: f64,
    },
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
}

debug_is_message!(AdaptError);

impl AdaptError {
    /// The signal that ended a run, if there was one.
    pub fn signal(&self) -> Option<Signal> {
        match self {
            Self::Run { source: RunError::Interrupted(signal), .. } => Some(*signal),
            _ => None,
        }
    }
}

/// The tolerance of the time steps of the runs with few steps.
///
/// Tuned on the 13 adapted runs. Half: 1 % more triangles. Twice: 2 % fewer, a quarter fewer for `square`.
const FEW_STEP_TOLERANCE: f64 = 0.05;
/// The tolerance of the time steps is found on the first mesh with at most this estimated error of u. On a coarser mesh,
/// contact and damage differ too much from those of the last mesh.
const MESH_FOR_STEPS: f64 = 0.1;

/// The smallest tolerance of time steps that is tried, as a fraction of the first one: there are about four times as many
/// steps then.
const SHORTEST_STEPS: f64 = 1.0 / 64.0;

/// Refines `mesh` until the measured errors in a run of `scene` are at most `accuracy`: the errors of the figures,
/// of u (energy norm) and of the damage. If the run ends at ζ_*, only the errors of u and of this time count. The
/// caller controls the errors of the time steps. `seen` is called with each mesh and its errors. If a run on a
/// refined mesh fails, the mesh before is returned. Collective: all ranks get the same mesh.
///
/// # Errors
/// See [`AdaptError`].
pub fn adapted(
    session: &Session,
    scene: &Scene,
    mesh: Mesh,
    run_options: &RunOptions,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let scene = with_passing_loads(session, with_steps(scene, INSTANTS), &mesh)?;
    let mut last = None;
    let ended = AccuracyLoop::new(session, run_options, scene).until(accuracy, mesh, &mut |mesh| {
        seen(mesh);
        last = Some(mesh.clone());
    });
    match (ended, last) {
        (Err(error), Some(last))
            if !matches!(error, AdaptError::Setup(_)) && error.signal().is_none() =>
        {
            Ok(Adapted { not_reached: Some(error.to_string()), ..last })
        }
        (ended, _) => ended,
    }
}

/// The errors of the figures of `scene` from `mesh`, measured by three runs: on the mesh and on the mesh bisected
/// everywhere, once and twice, with new nodes on the curved sides of `curved`, which has the same triangles. So the changes
/// contain the error of shape. The steps are few, or chosen for the error `of_steps` of ζ. Collective.
///
/// # Errors
/// See [`AdaptError`].
pub fn measured_errors(
    session: &Session,
    scene: &Scene,
    [mesh, curved]: [&Mesh; 2],
    run_options: &RunOptions,
    of_steps: Option<f64>,
) -> Result<Measured, AdaptError> {
    let scene = match (of_steps, scene.time.map(|grid| grid.stepping)) {
        (Some(tolerance), _) => with_tolerance(scene.clone(), tolerance),
        (None, Some(Stepping::Uniform { steps })) => with_steps(scene, steps.min(INSTANTS)),
        (None, _) => with_steps(scene, INSTANTS),
    };
    let scene = if of_steps.is_none() { with_passing_loads(session, scene, mesh)? } else { scene };
    let [mesh, curved] = [mesh, curved].map(|mesh| Refinement::start(mesh.clone()).mesh);
    let mut fixed = AccuracyLoop::new(session, run_options, scene);
    loop {
        let problem = problem_on(session, &fixed.scene, &mesh)?;
        let run = fixed.solve(&problem, FEW, &[])?;
        if of_steps.is_some() || !fixed.shorten_steps(&run) {
            let answer = Answer::new(&run, curved);
            return Ok(fixed.measurement(&answer, &run, None)?.result);
        }
    }
}

/// The sequence of answers on ever finer meshes.
struct AccuracyLoop<'a> {
    session: &'a Session,
    run_options: &'a RunOptions,
    /// The scene with few time steps.
    scene: Scene,
    limits: Limits,
    /// The number of meshes so far, and the answers on those before the present one.
    rounds: usize,
    before: Vec<Answer>,
    /// The measurement of the mesh before.
    last: Option<Measurement>,
}

impl<'a> AccuracyLoop<'a> {
    fn new(session: &'a Session, run_options: &'a RunOptions, scene: Scene) -> Self {
        let limits = Limits::new(session.comm(), &scene);
        Self { session, run_options, scene, limits, rounds: 0, before: Vec::new(), last: None }
    }

    /// The loop. A mesh is begun only if its measurement is within the limits too, because only a measurement reaches the
    /// accuracy. So the last mesh can be measured.
    fn until(
        mut self,
        accuracy: f64,
        mesh: Mesh,
        seen: &mut dyn FnMut(&Adapted),
    ) -> Result<Adapted, AdaptError> {
        let (mut refinement, mut progress) = (Refinement::start(mesh), Progress::new(accuracy));
        loop {
            self.rounds += 1;
            let problem = problem_on(self.session, &self.scene, &refinement.mesh)?;
            // SOLVE
            let run = self.solve(&problem, INSTANTS, &[])?;
            if self.shorten_steps(&run) {
                self.before.clear();
                continue;
            }
            // ESTIMATE
            let estimate = Estimate::new(self.session, &refinement.mesh, run, accuracy)?;
            progress.estimated(&estimate);
            let answer = Answer::new(&estimate.run, refinement.mesh.clone());
            let is_enough = estimate.is_enough();
            let mut measured = match is_enough {
                true => self.measure(&estimate, &answer, &mut progress)?.map(Some),
                false => Ok(None),
            };
            // MARK and REFINE, unless the loop ends.
            let next =
                measured.as_ref().map(Option::as_ref).map_err(End::clone).and_then(|measured| {
                    progress.verdict(&estimate, measured, self.rounds)?;
                    self.refined(&estimate, measured, &refinement)
                });
            if !is_enough && next.is_err() {
                measured = self.measure(&estimate, &answer, &mut progress)?.map(Some);
            }
            let measured = measured.unwrap_or_default();
            let end = next.as_ref().err();
            let mut adapted = estimate.adapted(measured.as_ref(), self.rounds, end);
            seen(&adapted);
            let Ok(finer) = next else {
                self.set_steps(&mut adapted)?;
                return Ok(adapted);
            };
            self.before.push(answer);
            (refinement, self.last) = (finer, measured);
        }
    }

    /// A run of `problem` with estimates at about `instants` times. Adaptive steps end at the times `followed` of the run with
    /// which this one is compared. Collective.
    fn solve<'b>(
        &mut self,
        problem: &'b ObservedProblem,
        instants: usize,
        followed: &[f64],
    ) -> Result<FewStepRun<'b>, AdaptError> {
        let (session, run_options) = (self.session, self.run_options);
        let triangles = problem.mesh().triangles.len();
        let run = || FewStepRun::run(session, problem, run_options, instants, followed);
        let run = self.limits.measure(triangles, run);
        run.map_err(|source| AdaptError::Run { triangles, source })
    }

    /// The measured errors, or the reason why there are none. The answer on the bisected mesh before may serve. Collective.
    fn measure(
        &mut self,
        estimate: &Estimate,
        answer: &Answer,
        progress: &mut Progress,
    ) -> Result<Result<Measurement, End>, AdaptError> {
        let (run, accuracy) = (&estimate.run, estimate.accuracy);
        let triangles = answer.mesh.triangles.len();
        if let Some(limit) = self.limits.exceeded(&[4 * triangles]) {
            return Ok(Err(End::Limit(limit)));
        }
        let again = self.last.take().and_then(|last| last.on_refined(&self.before, answer, run));
        let again = again.filter(|of| of.over_accuracy(accuracy, &self.scene.accuracy_of) <= 1.0);
        match again.map_or_else(|| self.measurement(answer, run, Some(accuracy)), Ok) {
            Ok(measured) => Ok(Ok(progress.measured(estimate, measured))),
            Err(error) if error.signal().is_some() => Err(error),
            Err(error) => Ok(Err(End::Failed(error.to_string()))),
        }
    }

    /// The next mesh, or the reason why there is none. Collective.
    fn refined(
        &self,
        estimate: &Estimate,
        measured: Option<&Measurement>,
        refinement: &Refinement,
    ) -> Result<Refinement, End> {
        let finer = estimate.refined(refinement, measured);
        let finer = finer.map_err(|error| End::Failed(error.to_string()))?;
        let triangles = finer.mesh.triangles.len();
        let limit = self.limits.exceeded(&[triangles, 4 * triangles]);
        limit.map_or(Ok(finer), |limit| Err(End::Limit(limit)))
    }

    /// Makes the steps adaptive, and then ever shorter, if too long steps may be the reason why this `run` reaches ζ_* or does
    /// not. False if the steps stay.
    fn shorten_steps(&mut self, run: &FewStepRun) -> bool {
        let now = self.scene.step_tolerance();
        let is_open = run.is_undecided() || (now.is_infinite() && run.stop().is_some());
        if is_open && now > SHORTEST_STEPS * FEW_STEP_TOLERANCE {
            let shorter = FEW_STEP_TOLERANCE.min(0.25 * now);
            self.scene = with_tolerance(self.scene.clone(), shorter);
            return true;
        }
        false
    }

    /// Sets the tolerance of the time steps of an adapted mesh by runs on one of the meshes before: the errors of the time steps
    /// hardly depend on the mesh. If such a run fails or stops elsewhere, the tolerance stays. Collective.
    fn set_steps(mut self, adapted: &mut Adapted) -> Result<(), AdaptError> {
        let (triangles, stops) = (adapted.mesh.triangles.len(), adapted.measured.stop.is_some());
        let is_cheap =
            |of: &&Answer| of.error <= MESH_FOR_STEPS && 4 * of.mesh.triangles.len() <= triangles;
        let coarse = self.before.iter().find(is_cheap);
        let (Some(grid), Some(Answer { mesh, .. })) = (&mut self.scene.time, coarse) else {
            return Ok(());
        };
        let tolerance = if stops { FEW_STEP_TOLERANCE } else { adapted.steps };
        grid.stepping = Stepping::Auto { tolerance, expected: adapted.damage };
        let mut problem = problem_on(self.session, &self.scene, mesh)?;
        let mut steps = tolerance;
        // If the mesh uses nearly the whole accuracy, the tolerance would become ever smaller.
        while steps >= SHORTEST_STEPS * tolerance {
            problem.set_step_tolerance(steps);
            let run = Simulation::new(&problem).run_options(self.run_options).run(self.session);
            let Ok(mut outcome) = run else { return Ok(()) };
            outcome.set_bars(&problem, &adapted.measured)?;
            if outcome.stopped.is_some() != stops {
                return Ok(());
            }
            match outcome.shorter_steps(&problem, &adapted.measured) {
                Some(ratio) => steps *= ratio,
                None => break,
            }
        }
        adapted.steps = steps;
        Ok(())
    }
}

/// The problem of `scene` on `mesh`, on this rank's part of it. Collective.
fn problem_on(
    session: &Session,
    scene: &Scene,
    mesh: &Mesh,
) -> Result<ObservedProblem, AdaptError> {
    Ok(ObservedProblem::new(scene.clone(), mesh.clone())?.restrict(session)?)
}

/// The scene with some uniform steps.
fn with_steps(scene: &Scene, steps: usize) -> Scene {
    let mut scene = scene.clone();
    scene.time.iter_mut().for_each(|grid| grid.stepping = Stepping::Uniform { steps });
    scene
}

/// The scene with adaptive steps.
fn with_tolerance(mut scene: Scene, tolerance: f64) -> Scene {
    let stepping = Stepping::Auto { tolerance, expected: [0.0; 2] };
    scene.time.iter_mut().for_each(|grid| grid.stepping = stepping);
    scene
}

/// The scene, with adaptive steps if loads or gaps pass by within one of its steps. An error if the body turns over, or has no
/// figure of the name for which an accuracy is required.
fn with_passing_loads(session: &Session, scene: Scene, mesh: &Mesh) -> Result<Scene, AdaptError> {
    let problem = problem_on(session, &scene, mesh)?;
    let figures = problem.figures.iter().filter(|of| of.dimension.has_bar());
    let names = Vec::from_iter(figures.map(|figure| &*figure.name));
    scene.check_figures(&names).map_err(SetupError::from)?;
    if let Some(Collapse { time, .. }) = problem.collapse_on_a_point() {
        return Err(AdaptError::Overturns { time });
    }
    let passes = LoadCurve::pass_within_steps(&problem);
    Ok(if passes { with_tolerance(scene, FEW_STEP_TOLERANCE) } else { scene })
}
