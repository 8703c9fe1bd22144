//! `signorini run`: from the file of a scene to its results.

use super::{
    Failure, SOLVERS, SceneArguments,
    check::contact_nodes,
    check_petsc,
    checkpoint::Checkpoint,
    ranks::{self, Ranks, agree, barrier_or_abort, cores},
    read_mesh,
    recorder::Recorder,
    screen,
    task::Task,
    tell,
};
use clap::Args;
use signorini::{
    accuracy::{AdaptError, Adapted, LoopState},
    estimate::Simulation,
    evolution::{Outcome, RunError},
    interrupt::Interrupts,
    linear::LinearSolver,
    mesh::{Mesh, Order},
    observe::ObservedProblem,
    output::{self, terminal::say},
    petsc::{Communicator, Session, stage},
    scene::Scene,
};
use std::{
    fs, mem,
    path::{Path, PathBuf},
    time::Instant,
};

/// Arguments of `signorini run`.
#[derive(Args)]
pub struct RunArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Folder for the results [default: out/<scene>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[arg(long, value_name = "NAME", help = format!(
        "Contact solver: {} [default: the scene's, else {}]; `signorini solvers` describes them",
        SOLVERS.join(", "), SOLVERS[0]
    ))]
    solver: Option<String>,
    /// Measure the error of each figure that the mesh causes: three runs with few steps, on the mesh and on
    /// this mesh bisected everywhere, once and twice (`signorini check` estimates their time). --accuracy includes it.
    #[arg(long)]
    bars: bool,
    /// Prove a bound on the error of u from the mesh (energy norm), for up to a third of the time of a static solve; --bars and
    /// --accuracy include it.
    #[arg(long)]
    bound: bool,
    /// Continue the same run from its last checkpoint, with the same results bit by bit; without a
    /// checkpoint start from the beginning.
    #[arg(long)]
    restart: bool,
    /// Print one line at the end, and no progress.
    #[arg(long, short, conflicts_with = "verbose")]
    quiet: bool,
    /// Print also residuals, the errors and iterations of the solvers, and remarks.
    #[arg(long, short)]
    verbose: bool,
    /// Run on this number of processes, at most one per core, or on as many as pay: starts itself under mpiexec.
    #[arg(long, value_name = "N|auto")]
    ranks: Option<Ranks>,
    /// PETSc options, e.g. -- -tao_monitor -log_view.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

impl RunArguments {
    /// Checks that no argument is without effect.
    fn check(&self) -> Result<(), Failure> {
        self.scene.check()?;
        let is_root = |out: &PathBuf| out.canonicalize().is_ok_and(|out| out.parent().is_none());
        if self.out.iter().any(is_root) {
            let problem =
                "--out: the results cannot go into the root folder; choose another folder";
            return Err(Failure::input(problem));
        }
        if self.ranks.is_some() && Communicator::launched().is_some() {
            return Err(Failure::input("--ranks: mpiexec has started this run; leave --ranks out"));
        }
        check_petsc(&self.petsc)
    }

    /// The scene with its overrides, and notes for the user.
    fn read(&self) -> Result<(Scene, Vec<String>), Failure> {
        let solver =
            self.solver.iter().map(|name| format!("contact.solver={}", toml::Value::from(&**name)));
        self.scene.read(&Vec::from_iter(solver))
    }

    /// The number of processes. Runs with an accuracy are many, on meshes for which one process is best.
    fn count(&self, ranks: Ranks) -> Result<usize, Failure> {
        match ranks {
            Ranks::Count(number) if number.get() > cores() => Err(Failure::input(format!(
                "--ranks {number}: this process may use {} cores, and more ranks than cores are slower",
                cores()
            ))),
            Ranks::Count(number) => Ok(number.get()),
            Ranks::Auto => {
                let (scene, _) = self.read()?;
                if scene.accuracy.is_some() {
                    return Ok(1);
                }
                let mesh = read_mesh(&scene, false)?;
                let (vertices, triangles) = (mesh.nodes.len(), mesh.triangles.len());
                // V − E + T = 1 for a body without holes.
                let nodes = match scene.order {
                    Order::Linear => vertices,
                    Order::Quadratic => 2 * vertices + triangles,
                };
                Ok(ranks::paying(2 * nodes))
            }
        }
    }

    /// The folder of the results.
    fn folder(&self, scene: &Scene) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name))
    }
}

/// The mesh of a scene. The first rank reads it for all. Collective.
fn read_shared(comm: Communicator, scene: &Scene) -> Result<Mesh, Failure> {
    let read = if comm.is_root() { read_mesh(scene, true) } else { Ok(Mesh::default()) };
    let mut mesh = agree(comm, read)?;
    if !comm.is_serial() {
        mesh = postcard::from_bytes(&comm.broadcast_bytes(postcard::to_stdvec(&mesh)?))?;
    }
    Ok(mesh)
}

/// Checks the PETSc options that would otherwise fail at the first factorisation. Collective.
fn check_factors(session: &Session, problem: &ObservedProblem) -> Result<(), Failure> {
    let mut prefixes = ["elastic_"].into_iter().chain(problem.damage().map(|_| "damage_"));
    prefixes.try_for_each(|prefix| {
        let checked = LinearSolver::check_options(session, prefix);
        let refused = |error| format!("PETSc options that begin with -{prefix}: {error}");
        agree(session.comm(), checked.map_err(|error| Failure::input(refused(error))))
    })
}

/// Checks that the adapted mesh will not replace a mesh of the user.
fn check_mesh_is_kept(scene: &Scene, folder: &Path) -> Result<(), Failure> {
    let kept = folder.join(output::MESH);
    let whose = match scene.accuracy {
        Some(_) if output::is_same_file(&kept, &scene.mesh.file) => "is the mesh of the scene",
        Some(_) if fs::symlink_metadata(&kept).is_ok() && !output::is_adapted(&kept) => {
            "was left there by no run"
        }
        _ => return Ok(()),
    };
    Err(Failure::input(format!(
        "{} {whose}, and the adapted mesh would be written over it; choose another folder with --out",
        kept.display()
    )))
}

/// `signorini run SCENE`, on the ranks that `mpiexec` has started.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let checked = arguments.check();
    if let (Some(ranks), Ok(())) = (arguments.ranks, &checked) {
        let ranks = arguments.count(ranks)?;
        if ranks > 1 {
            match ranks::start(ranks)? {}
        }
    }
    let options = if checked.is_ok() { &arguments.petsc[..] } else { &[] };
    let session = stage("petsc start", || Session::start(options))?;
    let checked = checked.and_then(|()| ranks::check_launcher(session.comm()));
    let task = agree(session.comm(), checked).and_then(|()| read(arguments, &session, started));
    let warns = task.is_ok() && session.comm().is_root();
    let result = task.and_then(|(task, restart)| solve(task, restart, &session));
    let mut unused = session.unused_options();
    // PETSc reads this option when it ends.
    unused.retain(|option| !option.starts_with("-options_left"));
    let finalized = session.finalize().map_err(Failure::from);
    if warns && !unused.is_empty() {
        tell("warning", &format!("PETSc options that nothing read: {}", unused.join(" ")));
    }
    result.and(finalized)
}

/// Reads the scene and, for a restart, the checkpoint on every rank. The first rank reads the mesh for all.
/// Collective.
fn read<'a>(
    arguments: &'a RunArguments,
    session: &Session,
    started: Instant,
) -> Result<(Task<'a>, Option<Checkpoint>), Failure> {
    let comm = session.comm();
    let (mut scene, notes) = agree(comm, arguments.read())?;
    let mesh = stage("mesh", || read_shared(comm, &scene))?;
    let folder = arguments.folder(&scene);
    let as_run = scene.as_run();
    agree(comm, check_mesh_is_kept(&scene, &folder))?;
    agree(comm, output::check_is_writable(&folder).map_err(Failure::input))?;
    let restart = arguments.restart.then(|| Checkpoint::read(comm, &folder));
    let mut restart = restart.transpose()?.flatten();
    if arguments.restart && restart.is_none() && comm.is_root() {
        let folder = folder.display();
        tell("warning", &format!("{folder} has no checkpoint; the run begins at its start"));
    }
    let saved = restart.as_mut().map(|checkpoint| mem::take(&mut checkpoint.accuracy));
    let _interrupts = Interrupts::defer();
    let name = if scene.accuracy.is_some() { "adaptation" } else { "error bars" };
    let start =
        || accuracy_loop(session, &mut scene, mesh, (arguments.bars, saved), arguments.quiet);
    let (accuracy, mesh) = agree(comm, stage(name, start))?;
    let problem = stage("discrete problem", || ObservedProblem::new(scene, mesh));
    let problem = agree(comm, problem.map_err(Failure::input))?;
    let problem = stage("partition", || problem.restrict(session));
    let problem = agree(comm, problem.map_err(Failure::from))?;
    check_factors(session, &problem)?;
    let lock = if comm.is_root() { output::lock(&folder) } else { Ok(None) };
    let lock = agree(comm, lock.map_err(Failure::input))?;
    let left = if arguments.restart || !comm.is_root() {
        None
    } else {
        output::checkpoints(&folder, 0).first().cloned()
    };
    if let Some((step, _)) = left {
        let warning = format!(
            "the run that left a checkpoint of step {step} in {} is not continued, and its results go; --restart continues \
             it",
            folder.display()
        );
        tell("warning", &warning);
    }
    let task = Task {
        bound: arguments.bound || arguments.bars || accuracy.adapted.is_some(),
        triangles: comm.count(problem.body.own_triangles),
        contact_nodes: comm.count(contact_nodes(&problem)),
        problem,
        folder,
        as_run,
        accuracy,
        quiet: arguments.quiet,
        verbose: arguments.verbose,
        notes,
        _lock: lock,
        _interrupts,
        petsc: &arguments.petsc,
        started,
    };
    Ok((task, restart))
}

/// Solves and writes the results. If the time steps alone miss the required accuracy, the run is repeated with shorter
/// ones. Collective.
fn solve(
    mut task: Task,
    mut restart: Option<Checkpoint>,
    session: &Session,
) -> Result<(), Failure> {
    let checked = restart.as_ref().map_or(Ok(()), |checkpoint| checkpoint.check(&task));
    agree(session.comm(), checked)?;
    let comm = session.comm();
    loop {
        if task.accuracy.repeats && comm.is_root() && !task.quiet {
            let text = "with shorter time steps, which the accuracy needs";
            say(&screen::row("again", text));
        }
        let started = Instant::now();
        let (recorder, result) = solve_once(&task, restart.take(), session)?;
        let seconds = [task.started, started].map(|from| comm.max(from.elapsed().as_secs_f64()));
        let Task { accuracy, problem, .. } = &task;
        let shorter = |of: &Outcome| accuracy.shorter_steps(problem, of, seconds);
        match result.as_ref().ok().and_then(shorter).zip(result.as_ref().ok()) {
            Some((ratio, outcome)) => {
                drop(recorder);
                let Task { accuracy, problem, .. } = &mut task;
                let repeated = accuracy.repeat(session, problem, outcome, ratio);
                repeated.map_err(|error| failure(&error))?;
            }
            None => return finish(recorder, result, comm),
        }
    }
}

/// The accuracy loop up to the run that is written, whose meshes are shown; see [`LoopState::start`]. Collective.
pub(super) fn accuracy_loop(
    session: &Session,
    scene: &mut Scene,
    mesh: Mesh,
    asked: (bool, Option<LoopState>),
    quiet: bool,
) -> Result<(LoopState, Mesh), Failure> {
    let accuracy = scene.accuracy.filter(|_| session.comm().is_root() && !quiet);
    let mut started = Some(Instant::now());
    let mut show = |mesh: &Adapted| {
        accuracy.iter().for_each(|accuracy| screen::adapting(mesh, *accuracy, started.take()));
    };
    let made = LoopState::start(session, scene, mesh, asked, &mut show);
    made.map_err(|error| failure(&error))
}

/// A failure of the accuracy loop: the input, or a signal during a run on a mesh that was only tried.
fn failure(error: &AdaptError) -> Failure {
    match (error, error.signal()) {
        (AdaptError::Setup(_) | AdaptError::Overturns { .. }, _) => Failure::input(error),
        (_, None) => error.into(),
        (_, Some(signal)) => {
            let message = format!(
                "ended by {signal} while meshes were tried for the accuracy or the error bars"
            );
            Failure { code: signal.exit_code(), message: Some(message) }
        }
    }
}

/// A run of the task. Collective.
fn solve_once<'a>(
    task: &'a Task,
    restart: Option<Checkpoint>,
    session: &Session,
) -> Result<(Recorder<'a>, Result<Outcome, RunError>), Failure> {
    let comm = session.comm();
    let mut recorder = agree(comm, Recorder::new(task).map_err(Failure::input))?;
    let problem = &task.problem;
    let resumed = restart.as_ref().map_or(Ok(()), |checkpoint| recorder.resume(checkpoint));
    agree(comm, resumed.map_err(Failure::from))?;
    let mut simulation = Simulation::new(problem).observer(&mut recorder);
    if task.bound {
        simulation = simulation.bound();
    }
    if let Some(checkpoint) = restart {
        simulation = simulation.resume(checkpoint.run);
    }
    let mut result = simulation.run(session);
    if let Ok(outcome) = &mut result {
        outcome.set_bars(problem, &task.accuracy.measured)?;
    }
    Ok((recorder, result))
}

/// Writes the last results and shows how the run ended. Collective.
fn finish(
    recorder: Recorder,
    result: Result<Outcome, RunError>,
    comm: Communicator,
) -> Result<(), Failure> {
    barrier_or_abort(comm, result.as_ref().err());
    let written = recorder.finish(&result);
    let ended = match result {
        Ok(_) => written.map_err(Failure::from),
        Err(RunError::OnAnotherRank) => Err(Failure::ON_ANOTHER_RANK),
        Err(RunError::Interrupted(signal)) => {
            let message = format!("ended by {signal}; --restart goes on from here");
            Err(Failure { code: signal.exit_code(), message: Some(message) })
        }
        Err(error) => Err(error.into()),
    };
    agree(comm, ended)
}
