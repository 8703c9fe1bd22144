//! Meshes for an accuracy.
//!
//! The rounds start from a coarse mesh. In each round, a run with few time steps estimates the error of u per triangle,
//! m_T = max_t ‖ε* − ε(u(t))‖²_T / max_t ‖u(t)‖² (at the end relative to ‖u‖² there). Triangles are bisected until it is
//! small enough.
//!
//! An estimate misses details finer than the mesh, so a [`Measurement`] ends the rounds: the same steps on the mesh
//! bisected everywhere. If the bar of a figure then exceeds its share of the accuracy, the rounds go on.
//!
//! - In: a scene with an accuracy, and a coarse mesh of its body ([`adapted`]); or any mesh ([`measured_errors`]).
//! - Out: the mesh of the last round with the measured errors of the figures on it ([`Adapted`], [`Measured`]), or
//!   the reason why no mesh reaches the accuracy.
//! - Caller: the command `run`, before the run itself.
//!
//! A round is a [`FewStepRun`], a [`Round`] that judges it, and perhaps a [`Measurement`]; [`Progress`] ends the rounds;
//! `sizes` turns errors into the sizes of triangles.

mod changes;
mod first_mesh;
mod limits;
mod measurement;
mod few_step_run;
mod progress;
mod round;
mod sequence;
mod sizes;

use crate::{
    estimate::Simulation,
    evolution::{Choices, RunError},
    interrupt::Signal,
    mesh::{Mesh, MeshError, Refinement},
    petsc::{PetscError, Session},
    problem::{Bar, Collapse, DiscreteProblem, LoadCurve, SetupError},
    scene::{Scene, Stepping, rounded},
};
pub use few_step_run::INSTANTS;
use few_step_run::{FEW, FewStepRun};
pub use first_mesh::{first_mesh, kinks};
use limits::Limits;
use measurement::Measurement;
use progress::Progress;
use round::Round;
use sequence::Level;
use serde::{Deserialize, Serialize};

/// A mesh that was adapted to a scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Adapted {
    /// The mesh.
    pub mesh: Mesh,
    /// The number of unknown displacement components on it.
    pub unknowns: usize,
    /// The number of rounds so far, with the round of this mesh.
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
    /// The names of the extremes that the meshes do not settle. They have no bars.
    pub unsettled: Vec<String>,
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
        "a run on {triangles} triangles, for the accuracy or the error bars: {source}; to keep the results up to \
         this error, ask for neither"
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
/// Maximum number of rounds.
const MAX_ROUNDS: usize = 25;

/// Refines `mesh` until the measured errors in a run of `scene` are at most `accuracy`: the errors of the figures,
/// of u (energy norm) and of the damage. If the run ends at ζ_*, only the errors of u and of this time count. The
/// caller controls the errors of the time steps. `seen` is called with each mesh and its errors. If a run on a
/// refined mesh fails, the mesh of the round before is returned. Collective: all ranks get the same mesh.
///
/// # Errors
/// See [`AdaptError`].
pub fn adapted(
    session: &Session,
    scene: &Scene,
    mesh: Mesh,
    choices: &Choices,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let mut few_steps = scene.clone();
    few_steps
        .time
        .iter_mut()
        .for_each(|grid| grid.stepping = Stepping::Uniform { steps: INSTANTS });
    let scene = with_passing_loads(session, few_steps, &mesh)?;
    let mut reached = None;
    let refined = refined(session, scene, mesh, choices, accuracy, &mut |mesh| {
        seen(mesh);
        reached = Some(mesh.clone());
    });
    match (refined, reached) {
        (Err(error @ AdaptError::Setup(_)), _) => Err(error),
        (Err(error), _) if error.signal().is_some() => Err(error),
        (Err(error), Some(before)) => {
            Ok(Adapted { not_reached: Some(error.to_string()), ..before })
        }
        (refined, _) => refined,
    }
}

/// A scene with its few uniform steps, or with adaptive ones if loads or gaps pass by within a step. An error if the
/// body turns over, or has no figure of the name for which an accuracy is required.
fn with_passing_loads(
    session: &Session,
    mut scene: Scene,
    mesh: &Mesh,
) -> Result<Scene, AdaptError> {
    let problem = DiscreteProblem::new(scene.clone(), mesh.clone())?.restrict(session)?;
    let figures = problem.figures.iter().filter(|of| of.dimension.has_bar());
    let names = Vec::from_iter(figures.map(|figure| &*figure.name));
    scene.check_figures(&names).map_err(SetupError::from)?;
    if let Some(Collapse { time, .. }) = problem.collapse_on_a_point() {
        return Err(AdaptError::Overturns { time });
    }
    if LoadCurve::pass_within_steps(&problem) {
        make_steps_adaptive(&mut scene);
    }
    Ok(scene)
}

/// The errors of the figures of `scene` from `mesh`, measured by three runs: on the mesh and on the mesh bisected
/// everywhere, once and twice. Their steps are few, or chosen for the error `of_steps` of ζ. Collective.
///
/// # Errors
/// See [`AdaptError`].
pub fn measured_errors(
    session: &Session,
    scene: &Scene,
    mesh: &Mesh,
    choices: &Choices,
    of_steps: Option<f64>,
) -> Result<Measured, AdaptError> {
    let mut few_steps = scene.clone();
    if let Some(grid) = &mut few_steps.time {
        grid.stepping = match (of_steps, grid.stepping) {
            (Some(tolerance), _) => Stepping::Auto { tolerance, expected: [0.0; 2] },
            (None, Stepping::Uniform { steps }) => Stepping::Uniform { steps: steps.min(INSTANTS) },
            (None, Stepping::Auto { .. }) => Stepping::Uniform { steps: INSTANTS },
        };
    }
    if of_steps.is_none() {
        few_steps = with_passing_loads(session, few_steps, mesh)?;
    }
    let mesh = Refinement::start(mesh.clone()).mesh;
    let mut limits = Limits::new(session.comm(), scene);
    let triangles = mesh.triangles.len();
    loop {
        let problem = DiscreteProblem::new(few_steps.clone(), mesh.clone())?.restrict(session)?;
        let run = || FewStepRun::run(session, &problem, choices, triangles, FEW, &[]);
        let run = limits.measure(triangles, run);
        let run = run.map_err(|source| AdaptError::Run { triangles, source })?;
        let repeats = of_steps.is_none() && run.stop().is_some();
        if !repeats || !make_steps_adaptive(&mut few_steps) {
            let answer = Level::new(&run, mesh);
            let new = Measurement::new(session, &answer, &run, choices, &[], None, &mut limits);
            return Ok(new?.result());
        }
    }
}

/// Refines `mesh` for a scene with few steps; an error if a run fails. A round is begun only if its measurement is within
/// the limits too, because only a measurement reaches the accuracy. So a mesh that no further round follows can be
/// measured.
fn refined(
    session: &Session,
    mut scene: Scene,
    mesh: Mesh,
    choices: &Choices,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let mut refinement = Refinement::start(mesh);
    let mut rounds = 0;
    let (mut progress, mut limits) = (Progress::new(accuracy), Limits::new(session.comm(), &scene));
    let (mut before, mut last): (Vec<Level>, Option<Measurement>) = Default::default();
    loop {
        rounds += 1;
        let mesh = &refinement.mesh;
        let triangles = mesh.triangles.len();
        let problem = DiscreteProblem::new(scene.clone(), mesh.clone())?.restrict(session)?;
        let run = || FewStepRun::run(session, &problem, choices, triangles, INSTANTS, &[]);
        let run = limits.measure(triangles, run);
        let run = run.map_err(|source| AdaptError::Run { triangles, source })?;
        if run.stop().is_some() && make_steps_adaptive(&mut scene) {
            before.clear();
            continue;
        }
        let round = Round::new(session, &scene, mesh, run, accuracy)?;
        progress.estimated(triangles, round.resolves_data().then_some(round.error));
        let answer = Level::new(&round.run, mesh.clone());
        // The measured errors, or the reason why there are none.
        let mut measure = |progress: &mut Progress, limits: &mut Limits| {
            if let Some(limit) = limits.exceeded(&[4 * triangles]) {
                return Ok(Err(limit));
            }
            let run = &round.run;
            let again = last.take().and_then(|last| last.on_refined(&before, &answer, run));
            if let Some(again) = again.filter(|of| of.excess(accuracy, &scene.accuracy_of) <= 1.0) {
                return Ok(Ok(progress.measured(triangles, again)));
            }
            let accuracy = Some(accuracy);
            match Measurement::new(session, &answer, run, choices, &before, accuracy, limits) {
                Ok(measured) => Ok(Ok(progress.measured(triangles, measured))),
                Err(error) if error.signal().is_some() => Err(error),
                Err(error) => Ok(Err(error.to_string())),
            }
        };
        let is_enough = round.is_enough();
        let (mut measured, failed) = match is_enough {
            true => measure(&mut progress, &mut limits)?
                .map_or_else(|e| (None, Some(e)), |m| (Some(m), None)),
            false => (None, None),
        };
        let errors = measured.as_ref().map_or_else(Vec::new, |of| of.errors(&scene.accuracy_of));
        let limit = || "the limit on rounds is reached".to_owned();
        let unsettled = measured.as_ref().and_then(|of| of.without_accuracy(&scene.accuracy_of));
        let within = errors.first().is_some_and(|worst| worst.excess(accuracy) <= 1.0);
        let reached = within && unsettled.is_none();
        let mut not_reached = failed.or(unsettled).or_else(|| progress.stuck(&errors));
        not_reached = not_reached.or((rounds >= MAX_ROUNDS).then(limit)).filter(|_| !reached);
        let mut next = None;
        if !reached && not_reached.is_none() {
            match round.refined(&refinement, measured.as_ref()) {
                Ok(finer) => {
                    let triangles = finer.mesh.triangles.len();
                    not_reached = limits.exceeded(&[triangles, 4 * triangles]);
                    next = not_reached.is_none().then_some(finer);
                }
                Err(error) => not_reached = Some(error.to_string()),
            }
        }
        if not_reached.is_some() && !is_enough {
            measured = measure(&mut progress, &mut limits)?.ok();
        }
        let mut adapted = round.adapted(measured.as_ref(), rounds, not_reached);
        seen(&adapted);
        match next {
            Some(finer) => {
                before.push(answer);
                (refinement, last) = (finer, measured);
            }
            None => {
                set_steps(session, scene, &before, choices, &mut adapted)?;
                return Ok(adapted);
            }
        }
    }
}

/// Makes the steps adaptive: too long steps may reach ζ_* or miss loads. False if they are adaptive already.
fn make_steps_adaptive(scene: &mut Scene) -> bool {
    let Some(grid) = &mut scene.time else { return false };
    let uniform = matches!(grid.stepping, Stepping::Uniform { .. });
    grid.stepping = Stepping::Auto { tolerance: FEW_STEP_TOLERANCE, expected: [0.0; 2] };
    uniform
}

/// Sets the tolerance of the time steps of an adapted mesh by runs on one of the meshes `before`: the errors of the time steps
/// hardly depend on the mesh. If such a run fails or stops elsewhere, the tolerance stays. Collective.
fn set_steps(
    session: &Session,
    mut scene: Scene,
    before: &[Level],
    choices: &Choices,
    adapted: &mut Adapted,
) -> Result<(), AdaptError> {
    let triangles = adapted.mesh.triangles.len();
    let is_cheap = |level: &&Level| {
        level.error <= MESH_FOR_STEPS && 4 * level.mesh.triangles.len() <= triangles
    };
    let coarse = before.iter().find(is_cheap);
    let (Some(grid), Some(Level { mesh, .. })) = (&mut scene.time, coarse) else { return Ok(()) };
    let tolerance =
        if adapted.measured.stop.is_some() { FEW_STEP_TOLERANCE } else { adapted.steps };
    grid.stepping = Stepping::Auto { tolerance, expected: adapted.damage };
    let mut problem = DiscreteProblem::new(scene, mesh.clone())?.restrict(session)?;
    let mut steps = tolerance;
    // If the mesh uses nearly the whole accuracy, the tolerance would become ever smaller.
    while steps >= tolerance / 64.0 {
        problem.set_step_tolerance(steps);
        let run = Simulation::new(&problem).choices(choices).run(session);
        let Ok(mut outcome) = run else { return Ok(()) };
        outcome.set_bars(&problem, &adapted.measured)?;
        if outcome.stopped.is_some() != adapted.measured.stop.is_some() {
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
