//! `signorini run`: a scene from its file to its results.

use super::{
    Failure, check_petsc, check_solver, profile,
    ranks::{rejoin, together},
    screen::Screen,
};
use clap::Args;
use signorini::{
    contact::SOLVERS,
    evolution::{self, Outcome, Phases, RunError, Setting, Step},
    mesh,
    output::{self, FieldWriter, History, Summary},
    petsc::{Ranks, Session},
    scene::{MeshSource, Scene, Stepping},
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
    /// Contact solver: active-set, penalty-duality, tao, tao:TYPE [default: the scene's, else
    /// active-set].
    #[arg(long, value_name = "NAME")]
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
    let early = match (Ranks::launched(), &checked) {
        (1, _) => None,
        (_, Ok(())) => Some(start(&arguments.petsc)?),
        (_, Err(_)) => Some(start(&[])?),
    };
    let ranks = early.as_ref().map_or(Ranks::alone(), Session::ranks);
    let task = together(ranks, checked).and_then(|()| Task::read(arguments, ranks, &phases));
    let session = match (early, &task) {
        (Some(session), _) => session,
        (None, Err(_)) => return task.map(|_| ()),
        (None, Ok(_)) => start(&arguments.petsc)?,
    };
    let speaks = task.is_ok() && session.ranks().is_first();
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
    setting: Setting,
    solver: String,
    folder: PathBuf,
    profile: bool,
}

impl Task {
    /// Reads scene and mesh. Every rank reads both; the first also makes the mesh, where it is to
    /// be made. Collective.
    fn read(arguments: &RunArguments, ranks: Ranks, phases: &Phases) -> Result<Self, Failure> {
        let scene = read_scene(&arguments.scene, arguments.mesh.as_deref(), &arguments.set);
        let scene = together(ranks, scene)?;
        let asked = arguments.solver.clone().or_else(|| scene.contact.solver.clone());
        let solver = asked.unwrap_or_else(|| SOLVERS[0].to_owned());
        let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));

        let load = || {
            phases
                .time("mesh", || mesh::load(&scene.mesh.file, &scene.mesh.parameters))
                .map_err(Failure::input)
        };
        let first = ranks.is_first().then(load).transpose();
        let loaded = together(ranks, first)?.map_or_else(load, Ok);
        let mesh = together(ranks, loaded)?;
        let setting = phases.time("setting", || Setting::new(scene, mesh)).map_err(Failure::input);
        let profile = arguments.profile;
        Ok(Self { setting: together(ranks, setting)?, solver, folder, profile })
    }

    /// Solves and writes the results. Collective.
    fn solve(self, session: &Session, phases: &Phases, started: Instant) -> Result<(), Failure> {
        let ranks = session.ranks();
        let Self { setting, solver, folder, profile } = self;
        let setting = phases.time("partition", || setting.share(session)).map_err(Failure::solver);
        let setting = together(ranks, setting)?;
        // Now that all input is good: the results of an earlier run go.
        let prepared = if ranks.is_first() { output::prepare(&folder) } else { Ok(()) };
        together(ranks, prepared.map_err(Failure::input))?;
        let recorder = Recorder::new(&folder, &setting, phases, profile).map_err(Failure::input);
        let mut recorder = together(ranks, recorder)?;

        let result = evolution::run(session, &setting, &solver, phases, &mut |step| {
            Ok(recorder.accept(step)?)
        });
        let failure = result.as_ref().map(|_| ()).map_err(failure);
        rejoin(ranks, &failure);
        let written = recorder.finish(&setting, &solver, &result, started);
        together(ranks, failure.and(written.map_err(Failure::solver)))
    }
}

/// By whose turn it is now.
fn failure(error: &RunError) -> Failure {
    match error {
        RunError::Setup(error) => Failure::input(error),
        RunError::Elsewhere => Failure::Elsewhere,
        error => Failure::solver(error),
    }
}

/// Shows and writes the accepted steps; of several ranks only the first shows them.
struct Recorder<'a> {
    folder: &'a Path,
    setting: &'a Setting,
    phases: &'a Phases,
    profile: bool,
    /// Seconds of all accepted steps after n = 0.
    stepping: f64,
    every: Option<usize>,
    fields: FieldWriter,
    shown: Option<(History, Screen)>,
    last: Option<Step>,
}

/// Frames written, about, when the scene does not say how often.
const FRAMES: usize = 20;

impl<'a> Recorder<'a> {
    fn new(
        folder: &'a Path,
        setting: &'a Setting,
        phases: &'a Phases,
        profile: bool,
    ) -> Result<Self, output::OutputError> {
        Ok(Self {
            folder,
            setting,
            phases,
            profile,
            stepping: 0.0,
            every: setting.scene().output.every,
            fields: FieldWriter::new(folder, setting)?,
            shown: match setting.body.partition.ranks().is_first() {
                true => Some((History::create(folder)?, Screen::new(setting))),
                false => None,
            },
            last: None,
        })
    }

    /// Whether a frame is written of step `n`. Unless the scene says how often, those after 1, 2,
    /// 4, … steps are added for the runs that do not come far.
    fn is_frame(&self, n: usize) -> bool {
        match (self.every, self.setting.scene().time.map(|grid| grid.stepping)) {
            (Some(every), _) => n.is_multiple_of(every),
            (None, Some(Stepping::Uniform { steps })) => {
                let every = steps.div_ceil(FRAMES);
                n.is_multiple_of(every) || (n < every && n.is_power_of_two())
            }
            (None, _) => true,
        }
    }

    fn accept(&mut self, step: &Step) -> Result<(), output::OutputError> {
        if step.record.step > 0 {
            self.stepping += step.record.seconds;
        }
        let written = self.phases.time("output", || {
            let shown = self.shown.as_mut().map_or(Ok(()), |(history, screen)| {
                screen.show(&step.record);
                history.add(&step.record)
            });
            // All ranks write a frame, whatever became of the row.
            match self.is_frame(step.record.step) {
                true => shown.and(self.fields.add(self.setting, &step.state)),
                false => shown,
            }
        });
        self.last = Some(step.clone());
        written
    }

    /// Writes the last accepted state, if there is one, and the summary, also of a run that failed.
    /// Collective.
    fn finish(
        mut self,
        setting: &Setting,
        solver: &str,
        result: &Result<Outcome, RunError>,
        started: Instant,
    ) -> Result<(), output::OutputError> {
        let last = self.last.take();
        let written = match &last {
            Some(Step { state, .. }) if self.fields.last_time() != Some(state.time) => {
                self.phases.time("output", || self.fields.add(setting, state))
            }
            _ => Ok(()),
        };
        let record = last.map(|step| step.record);
        let steps = record.map_or(0, |r| r.step);
        let (wall, scene) = (started.elapsed().as_secs_f64(), setting.scene());
        let mut notes = setting.notes();
        let outcome = result.as_ref().ok();
        notes.extend(outcome.iter().flat_map(|outcome| outcome.notes(setting)));
        let bounds = &setting.constraints.bounds;
        let mut contact_nodes: Vec<usize> = bounds.iter().map(|bound| bound.node).collect();
        contact_nodes.dedup();
        let (body, ranks) = (&setting.body, setting.body.partition.ranks());
        let contact_nodes = ranks.count(contact_nodes.len());
        let summary = Summary {
            scene: scene.name.clone(),
            title: scene.title.clone(),
            solver: match contact_nodes == 0 {
                true => "linear".to_owned(),
                false => solver.to_owned(),
            },
            ranks: ranks.size(),
            nodes: body.partition.total(),
            triangles: ranks.count(body.own_triangles),
            steps,
            end_time: record.map(|r| r.time),
            stopped_at: outcome.and_then(|o| o.stopped).map(|stop| stop.time),
            stopped_uncertainty: outcome.and_then(|o| o.stopped).map(|stop| stop.uncertainty),
            zeta_min: record.map(|r| r.zeta_min),
            zeta_mean: record.map(|r| r.zeta_mean),
            displacement_max: record.map(|r| r.displacement_max),
            work: record.map(|r| r.work),
            contact_force: record.map(|r| r.contact_force),
            active_nodes: record.map(|r| r.active_nodes),
            contact_nodes,
            kkt: outcome.map(|o| o.kkt).or(record.map(|r| r.kkt())),
            wall_seconds: wall,
            seconds_per_step: wall / steps.max(1) as f64,
            phases: profile::whole(&self.phases.table())
                .into_iter()
                .map(|(name, phase)| (name, phase.seconds))
                .collect(),
            foundation: setting.foundation.clone(),
            notes,
            error: result.as_ref().err().map(ToString::to_string),
        };
        let Some((_, screen)) = &self.shown else { return written };
        summary.write(self.folder)?;
        let phases = self.phases.table();
        let table = match self.profile {
            true => profile::report(&phases, wall, steps, self.stepping),
            false => profile::short(&phases, wall),
        };
        screen.close(&summary, outcome, &table, self.folder);
        written
    }
}
