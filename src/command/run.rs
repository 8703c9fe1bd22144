//! `signorini run`: a scene from its file to its results.

use super::{
    Failure, check_petsc, check_solver,
    ranks::{rejoin, together},
    recorder::Recorder,
};
use clap::Args;
use signorini::{
    contact::{self, SOLVERS},
    evolution::{self, DiscreteProblem, Phases, RunError},
    mesh, output,
    petsc::{Communicator, Session},
    scene::{MeshSource, Scene},
};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Arguments of `signorini run`.
#[derive(Args)]
pub struct RunArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Use this .geo or .msh instead of the scene's.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Folder for the results [default: out/<scene>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[arg(long, value_name = "NAME", help = format!("Contact solver [default: the scene's, else {}]:\n{}", SOLVERS[0], contact::summaries()))]
    solver: Option<String>,
    /// Override a key of the scene, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Close with all that was timed: counts, times per call, bytes moved, unavoidable work.
    #[arg(long)]
    profile: bool,
    /// PETSc options, e.g. -- -tao_monitor -log_view.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

impl RunArguments {
    /// Refuses what would silently have no effect.
    fn check(&self) -> Result<(), Failure> {
        let meshes = |set: &&String| set.trim_start().starts_with("mesh.");
        if let (Some(file), Some(set)) = (&self.mesh, self.set.iter().find(meshes)) {
            return Err(Failure::Input(format!(
                "--set {set} has no effect beside --mesh {0}, which replaces the scene's [mesh]; \
                 write --set mesh.file={0} instead (relative to the scene)",
                file.display()
            )));
        }
        self.solver.iter().try_for_each(|name| check_solver("--solver", name))?;
        check_petsc(&self.petsc)
    }
}

/// The scene at `path` with keys overridden by `set`, on another mesh if one is given.
pub(super) fn read_scene(
    path: &Path,
    mesh: Option<&Path>,
    set: &[String],
) -> Result<Scene, Failure> {
    let mut scene = Scene::read(path, set).map_err(Failure::input)?;
    if let Some(file) = mesh {
        scene.mesh = MeshSource::from_path(file);
    }
    Ok(scene)
}

/// Runs a scene, on as many ranks as `mpiexec` has started.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let phases = Phases::default();
    let start = |options: &[String]| {
        phases.time("petsc start", || Session::start(options)).map_err(Failure::solver)
    };
    let checked = arguments.check();
    // One rank tells bad input before PETSc starts; several need it to speak with one voice.
    let early = match (Communicator::launched(), &checked) {
        (1, _) => None,
        (_, Ok(())) => Some(start(&arguments.petsc)?),
        (_, Err(_)) => Some(start(&[])?),
    };
    let comm = early.as_ref().map_or(Communicator::serial(), Session::comm);
    let task = together(comm, checked).and_then(|()| Task::read(arguments, comm, &phases));
    let session = match (early, &task) {
        (Some(session), _) => session,
        (None, Err(_)) => return task.map(|_| ()),
        (None, Ok(_)) => start(&arguments.petsc)?,
    };
    let speaks = task.is_ok() && session.comm().is_root();
    let result = task.and_then(|task| task.solve(&session, &phases, started));
    let unused = session.unused_options();
    let ended = session.finalize().map_err(Failure::solver);
    if speaks && !unused.is_empty() {
        eprintln!("warning: PETSc options that nothing read: {}", unused.join(" "));
    }
    result.and(ended)
}

/// What is to be done, all input being good.
struct Task {
    problem: DiscreteProblem,
    solver: String,
    folder: PathBuf,
    profile: bool,
}

impl Task {
    /// Reads scene and mesh. Every rank reads both; the first also makes the mesh, where it is to
    /// be made. Collective.
    fn read(
        arguments: &RunArguments,
        comm: Communicator,
        phases: &Phases,
    ) -> Result<Self, Failure> {
        let scene = read_scene(&arguments.scene, arguments.mesh.as_deref(), &arguments.set);
        let scene = together(comm, scene)?;
        let asked = arguments.solver.clone().or_else(|| scene.contact.solver.clone());
        let solver = asked.unwrap_or_else(|| SOLVERS[0].to_owned());
        let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));

        let load = || {
            phases
                .time("mesh", || mesh::load(&scene.mesh.file, &scene.mesh.parameters))
                .map_err(Failure::input)
        };
        let first = comm.is_root().then(load).transpose();
        let loaded = together(comm, first)?.map_or_else(load, Ok);
        let mesh = together(comm, loaded)?;
        let problem =
            phases.time("setting", || DiscreteProblem::new(scene, mesh)).map_err(Failure::input);
        let profile = arguments.profile;
        Ok(Self { problem: together(comm, problem)?, solver, folder, profile })
    }

    /// Solves and writes the results. Collective.
    fn solve(self, session: &Session, phases: &Phases, started: Instant) -> Result<(), Failure> {
        let comm = session.comm();
        let Self { problem, solver, folder, profile } = self;
        let problem =
            phases.time("partition", || problem.restrict(session)).map_err(Failure::solver);
        let problem = together(comm, problem)?;
        // Now that all input is good: the results of an earlier run go.
        let prepared = if comm.is_root() { output::prepare(&folder) } else { Ok(()) };
        together(comm, prepared.map_err(Failure::input))?;
        let recorder = Recorder::new(&folder, &problem, &solver, phases, profile);
        let mut recorder = together(comm, recorder.map_err(Failure::input))?;

        let result = evolution::run(session, &problem, &solver, phases, &mut |step| {
            Ok(recorder.accept(step)?)
        });
        let failure = result.as_ref().map(|_| ()).map_err(failure);
        rejoin(comm, &failure);
        let written = recorder.finish(&result, started);
        together(comm, failure.and(written.map_err(Failure::solver)))
    }
}

/// The run has begun, so what was accepted is saved, whoever is to blame.
fn failure(error: &RunError) -> Failure {
    match error {
        RunError::OnAnotherRank => Failure::OnAnotherRank,
        error => Failure::solver(error),
    }
}
