//! `signorini run`: a scene from its file to its results.

use super::{Failure, check_petsc, check_solver, profile, screen::Screen};
use clap::Args;
use signorini::{
    contact::SOLVERS,
    evolution::{self, Outcome, Phases, RunError, Setting, Step},
    mesh,
    output::{self, FieldWriter, History, Summary},
    petsc::Session,
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

/// Runs a scene.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let phases = Phases::default();
    arguments.check()?;
    let scene = read_scene(&arguments.scene, arguments.mesh.as_deref(), &arguments.set)?;
    let asked = arguments.solver.clone().or_else(|| scene.contact.solver.clone());
    let solver = asked.unwrap_or_else(|| SOLVERS[0].to_owned());
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&scene.name));

    let mesh = phases
        .time("mesh", || mesh::load(&scene.mesh.file, &scene.mesh.parameters))
        .map_err(Failure::input)?;
    let setting = phases.time("setting", || Setting::new(scene, mesh)).map_err(Failure::input)?;
    let session =
        phases.time("petsc start", || Session::start(&arguments.petsc)).map_err(Failure::solver)?;
    if session.ranks() > 1 {
        return Err(Failure::Input(format!(
            "{} ranks: this version runs on one; start it without mpiexec",
            session.ranks()
        )));
    }
    // Now that all input is good: the results of an earlier run go.
    output::prepare(&folder).map_err(Failure::input)?;
    let mut recorder =
        Recorder::new(&folder, &setting, &phases, arguments.profile).map_err(Failure::input)?;
    let result =
        evolution::run(
            &session,
            &setting,
            &solver,
            &phases,
            &mut |step| Ok(recorder.accept(step)?),
        );
    let summary = recorder.finish(&setting, &solver, &result, started);
    let unused = session.unused_options();
    session.finalize().map_err(Failure::solver)?;
    if !unused.is_empty() {
        eprintln!("warning: PETSc options that nothing read: {}", unused.join(" "));
    }
    match (result, summary) {
        (Ok(_), written) => written.map_err(Failure::solver),
        (Err(RunError::Setup(error)), _) => Err(Failure::input(error)),
        (Err(error), _) => Err(Failure::solver(error)),
    }
}

/// Shows and writes the accepted steps.
struct Recorder<'a> {
    folder: &'a Path,
    setting: &'a Setting,
    phases: &'a Phases,
    profile: bool,
    /// Seconds of all accepted steps after n = 0.
    stepping: f64,
    every: Option<usize>,
    history: History,
    fields: FieldWriter,
    screen: Screen,
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
            history: History::create(folder)?,
            fields: FieldWriter::new(folder, setting)?,
            screen: Screen::new(setting),
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
        self.screen.show(&step.record);
        if step.record.step > 0 {
            self.stepping += step.record.seconds;
        }
        self.phases.time("output", || {
            self.history.add(&step.record)?;
            match self.is_frame(step.record.step) {
                true => self.fields.add(self.setting, &step.state),
                false => Ok(()),
            }
        })?;
        self.last = Some(step.clone());
        Ok(())
    }

    /// Writes the last accepted state, if there is one, and the summary, also of a run that failed.
    fn finish(
        mut self,
        setting: &Setting,
        solver: &str,
        result: &Result<Outcome, RunError>,
        started: Instant,
    ) -> Result<(), output::OutputError> {
        let last = self.last.take();
        if let Some(Step { state, .. }) = &last
            && self.fields.last_time() != Some(state.time)
        {
            self.phases.time("output", || self.fields.add(setting, state))?;
        }
        let record = last.map(|step| step.record);
        let steps = record.map_or(0, |r| r.step);
        let (wall, scene) = (started.elapsed().as_secs_f64(), setting.scene());
        let mut notes = setting.notes();
        let outcome = result.as_ref().ok();
        notes.extend(outcome.iter().flat_map(|outcome| outcome.notes(setting)));
        let bounds = &setting.constraints.bounds;
        let mut contact_nodes: Vec<usize> = bounds.iter().map(|bound| bound.node).collect();
        contact_nodes.dedup();
        let summary = Summary {
            scene: scene.name.clone(),
            title: scene.title.clone(),
            solver: match contact_nodes.is_empty() {
                true => "linear".to_owned(),
                false => solver.to_owned(),
            },
            nodes: setting.body.mesh.nodes.len(),
            triangles: setting.body.mesh.triangles.len(),
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
            contact_nodes: contact_nodes.len(),
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
        summary.write(self.folder)?;
        let phases = self.phases.table();
        let table = match self.profile {
            true => profile::report(&phases, wall, steps, self.stepping),
            false => profile::short(&phases, wall),
        };
        self.screen.close(&summary, outcome, &table, self.folder);
        Ok(())
    }
}
