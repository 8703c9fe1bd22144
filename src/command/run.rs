//! `signorini run`: a scene from its file to its results.

use super::{Failure, screen::Screen};
use clap::Args;
use signorini::{
    contact::{SOLVERS, TAO_TYPES, is_solver},
    evolution::{self, Outcome, Phases, RunError, Setting, Step},
    mesh,
    output::{self, FieldWriter, History, Summary},
    petsc::Session,
    scene::{MeshSource, Scene, Stepping, TimeGrid},
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
        match self.petsc.first() {
            Some(word) if !word.starts_with('-') => Err(Failure::Input(format!(
                "PETSc options begin with a dash, but the first is `{word}`"
            ))),
            _ => Ok(()),
        }
    }
}

/// Runs a scene.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let phases = Phases::default();
    arguments.check()?;
    let mut scene = Scene::read(&arguments.scene, &arguments.set).map_err(Failure::input)?;
    if let Some(file) = &arguments.mesh {
        scene.mesh = MeshSource::from_path(file);
    }
    let solver = solver_name(arguments, &scene)?;
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
    let mut recorder = Recorder::new(&folder, &setting, &phases).map_err(Failure::input)?;
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

/// The solver asked for on the command line or in the scene, else the default.
fn solver_name(arguments: &RunArguments, scene: &Scene) -> Result<String, Failure> {
    let (asked, place) = match (&arguments.solver, &scene.contact.solver) {
        (Some(name), _) => (name.as_str(), "--solver".to_owned()),
        (None, Some(name)) => (name.as_str(), format!("{}: contact.solver", scene.path.display())),
        (None, None) => return Ok(SOLVERS[0].to_owned()),
    };
    match is_solver(asked) {
        true => Ok(asked.to_owned()),
        false => Err(Failure::Input(format!(
            "{place}: there is no contact solver `{asked}`; there are {}, and tao:TYPE with TYPE \
             one of {}",
            SOLVERS.join(", "),
            TAO_TYPES.join(", ")
        ))),
    }
}

/// Shows and writes the accepted steps.
struct Recorder<'a> {
    folder: &'a Path,
    setting: &'a Setting,
    phases: &'a Phases,
    every: usize,
    history: History,
    fields: FieldWriter,
    screen: Screen,
    last: Option<Step>,
}

/// Every how many steps a frame is written unless the scene says it.
fn default_every(time: Option<TimeGrid>) -> usize {
    match time.map(|grid| grid.stepping) {
        Some(Stepping::Uniform { steps }) => steps.div_ceil(FRAMES).max(1),
        _ => 1,
    }
}

/// Frames written when the scene does not say how often.
const FRAMES: usize = 20;

impl<'a> Recorder<'a> {
    fn new(
        folder: &'a Path,
        setting: &'a Setting,
        phases: &'a Phases,
    ) -> Result<Self, output::OutputError> {
        let every = setting.scene().output.every.unwrap_or(default_every(setting.scene().time));
        Ok(Self {
            folder,
            setting,
            phases,
            every,
            history: History::create(folder)?,
            fields: FieldWriter::new(folder, setting),
            screen: Screen::new(setting),
            last: None,
        })
    }

    fn accept(&mut self, step: &Step) -> Result<(), output::OutputError> {
        self.screen.show(&step.record);
        self.phases.time("output", || {
            self.history.add(&step.record)?;
            match step.record.step % self.every {
                0 => self.fields.add(self.setting, &step.state),
                _ => Ok(()),
            }
        })?;
        self.last = Some(step.clone());
        Ok(())
    }

    /// Writes the last accepted state and the summary, also of a run that failed.
    fn finish(
        mut self,
        setting: &Setting,
        solver: &str,
        result: &Result<Outcome, RunError>,
        started: Instant,
    ) -> Result<(), output::OutputError> {
        let Some(Step { state, record }) = self.last.take() else { return Ok(()) };
        if self.fields.last_time() != Some(state.time) {
            self.phases.time("output", || self.fields.add(setting, &state))?;
        }
        let (wall, scene) = (started.elapsed().as_secs_f64(), setting.scene());
        let mut notes = setting.notes();
        let outcome = result.as_ref().ok();
        notes.extend(outcome.into_iter().flat_map(|o| o.accuracy.notes(setting.tolerance)));
        if let Some(outcome) =
            outcome.filter(|o| o.undamaged_steps > 0 && setting.damage().is_some())
        {
            notes.push(format!(
                "the damage solve was skipped in {} of {} steps: no source, uniform ζ",
                outcome.undamaged_steps, record.step
            ));
        }
        if let Some(outcome) = outcome.filter(|o| o.undone > 0) {
            notes.push(format!("{} steps were undone and tried again, shorter", outcome.undone));
        }
        let mut contact_nodes: Vec<usize> = state.contact.iter().map(|p| p.node).collect();
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
            steps: record.step,
            end_time: record.time,
            stopped_at: outcome.and_then(|o| o.stopped).map(|stop| stop.time),
            stopped_uncertainty: outcome.and_then(|o| o.stopped).map(|stop| stop.uncertainty),
            zeta_min: record.zeta_min,
            zeta_mean: record.zeta_mean,
            displacement_max: record.displacement_max,
            work: record.work,
            contact_force: record.contact_force,
            active_nodes: record.active_nodes,
            contact_nodes: contact_nodes.len(),
            kkt: outcome.map_or(record.kkt(), |o| o.kkt),
            wall_seconds: wall,
            seconds_per_step: wall / (record.step.max(1)) as f64,
            phases: self.phases.table().into_iter().map(|(name, (_, s))| (name, s)).collect(),
            foundation: setting.foundation.clone(),
            notes,
            error: result.as_ref().err().map(ToString::to_string),
        };
        summary.write(self.folder)?;
        self.screen.close(&summary, outcome, &self.phases.table(), self.folder);
        Ok(())
    }
}
