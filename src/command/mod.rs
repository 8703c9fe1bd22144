//! What the subcommands do.

mod accuracy;
mod check;
mod checkpoint;
mod new;
mod profile;
mod provenance;
mod ranks;
mod recorder;
mod run;
mod screen;
mod script;
mod task;

pub use check::check;
pub use new::new;
pub use run::{RunArguments, run};
pub use script::{ScriptArguments, script};

use clap::Args;
use ranks::require_one_process;
use signorini::{
    contact::{self, REGISTRY, SOLVERS, TAO_TYPES, summaries},
    mesh::{self, Mesh, MeshError, Order},
    output::terminal::say,
    scene::{MeshSource, SCHEMA, Scene},
};
use std::{
    fmt,
    io::{self, Write},
    path::PathBuf,
};

/// Why a command failed.
#[derive(Debug)]
pub struct Failure {
    /// The exit code: 2 for bad input, 1 for a run that ended early.
    pub code: u8,
    /// What to tell the user; none where a rank has told it for all.
    pub message: Option<String>,
}

impl Failure {
    /// Another rank failed, which tells why.
    const ON_ANOTHER_RANK: Self = Self { code: 1, message: None };

    /// The user has to change the input.
    fn input(error: impl fmt::Display) -> Self {
        Self { code: 2, message: Some(error.to_string()) }
    }

    /// There is no mesh.
    fn mesh(error: MeshError) -> Self {
        match error {
            MeshError::Interrupted(signal) => {
                Self { code: signal.exit_code(), message: Some(error.to_string()) }
            }
            _ => Self::input(error),
        }
    }
}

/// Failures for which the input is not to blame: a solver missed its tolerance, or results could not be written.
impl<E: fmt::Display> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { code: 1, message: Some(error.to_string()) }
    }
}

/// Tells the person at the terminal an error, or what else `kind` names, in one write: what `mpiexec` and
/// other ranks say meanwhile comes before or after it, never between its words.
pub fn tell(kind: &str, text: &str) {
    // Where nobody can be told any more, the exit code still says it.
    let _ = io::stderr().write_all(format!("{kind}: {text}\n").as_bytes());
}

/// Refuses an unknown solver, which `option` names.
fn check_solver(option: &str, name: &str) -> Result<(), Failure> {
    let found = contact::find(name).map(|_| ());
    found.map_err(|unknown| Failure::input(format!("{option}: {unknown}")))
}

/// Refuses PETSc options that would end a run only after the results of an earlier run are removed.
fn check_petsc(options: &[String]) -> Result<(), Failure> {
    if let Some(word) = options.first().filter(|word| !word.starts_with('-')) {
        let problem = format!("PETSc options begin with a dash, but the first is `{word}`");
        return Err(Failure::input(problem));
    }
    match options.windows(2).find(|pair| pair[0] == "-tao_type") {
        Some([_, kind]) if !TAO_TYPES.contains(&kind.as_str()) => Err(Failure::input(format!(
            "-tao_type: `{kind}` is none of TAO's types for bounds: {}",
            TAO_TYPES.join(", ")
        ))),
        _ => Ok(()),
    }
}

/// The approximate number of triangles along the body in the first mesh of a `.geo` for an accuracy. Refined sides
/// stay on the parabolas of this mesh, whose distance from an arc is of fourth order in the length of its sides. So
/// the number increases for high accuracies.
fn cells(accuracy: f64) -> f64 {
    /// Below this accuracy a mesh with four triangles along the body follows arcs too coarsely.
    const COARSE: f64 = 0.01;
    4.0 * (COARSE / accuracy).cbrt().max(1.0)
}

fn fraction(text: &str) -> Result<f64, &'static str> {
    text.parse().map_err(|_| "write a number with a decimal point: 0.01 is 1 %")
}

/// A scene and what overrides parts of it.
#[derive(Args)]
pub struct SceneArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Use this .geo or .msh instead of the scene's.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Choose order, mesh and time steps so that every figure is within this part of its largest value in
    /// the run, and u (energy norm) and the damage too, from 1e-5 to 0.5, e.g. 0.01; time.step,
    /// time.tolerance and the mesh.size of a .geo then have no effect.
    #[arg(long, value_name = "ERROR", value_parser = fraction)]
    accuracy: Option<f64>,
    /// Ask for the accuracy of this figure alone (work, displacement_max, contact_force, zeta_min, zeta_mean,
    /// NAME.force_x … as in summary.json); may be repeated.
    #[arg(long, value_name = "NAME")]
    accuracy_of: Vec<String>,
    /// Override a key of the scene, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SceneArguments {
    /// Refuses what would silently have no effect.
    fn check(&self) -> Result<(), Failure> {
        let is_of_mesh = |set: &&String| set.trim_start().starts_with("mesh.");
        if let (Some(file), Some(set)) = (&self.mesh, self.set.iter().find(is_of_mesh)) {
            return Err(Failure::input(format!(
                "--set {set} has no effect beside --mesh {0}, which replaces the scene's [mesh]; \
                 write --set mesh.file={0} instead (relative to the scene)",
                file.display()
            )));
        }
        Ok(())
    }

    /// The scene with its keys overridden, also by `more`.
    fn read(&self, more: &[String]) -> Result<Scene, Failure> {
        let accuracy = self.accuracy.map(|error| format!("accuracy={error}"));
        let quoted: Vec<_> = self.accuracy_of.iter().map(|name| format!("'{name}'")).collect();
        let figures = (!quoted.is_empty()).then(|| format!("accuracy_of=[{}]", quoted.join(",")));
        let asked = Vec::from_iter(accuracy.into_iter().chain(figures));
        let set = [&self.set[..], &asked, more].concat();
        let mut scene = Scene::read(&self.scene, &set).map_err(Failure::input)?;
        if scene.accuracy.is_none() && !scene.accuracy_of.is_empty() {
            return Err(Failure::input(
                "accuracy_of has no effect without accuracy; add accuracy = 0.01, say, or --accuracy 0.01",
            ));
        }
        if let Some(file) = &self.mesh {
            let replaced = std::mem::replace(&mut scene.mesh, MeshSource::from_path(file));
            if !replaced.parameters.is_empty() {
                let unused: Vec<_> = replaced.parameters.into_keys().collect();
                scene.notes.push(format!(
                    "of the scene's [mesh] nothing was used, because of --mesh: not {}",
                    unused.join(", ")
                ));
            }
        }
        Ok(scene)
    }
}

/// The mesh of a scene, which is made where it is not there. Where the scene asks for an accuracy and the
/// mesh is to be adapted to it, that of a `.geo` is coarse.
fn read_mesh(scene: &Scene, adapts: bool) -> Result<Mesh, Failure> {
    let MeshSource { file, parameters } = &scene.mesh;
    if !file.exists() {
        let problem = "No such file; mesh.file (relative to the scene) or --mesh names it";
        return Err(Failure::input(format!("{}: {problem}", file.display())));
    }
    let (mut parameters, mut order) = (parameters.clone(), scene.order);
    if let Some(accuracy) = scene.accuracy
        && adapts
        && file.extension().is_none_or(|kind| kind != "msh")
    {
        // Of order 1, too: bisected sides then follow curved boundaries, as well as the parabolas of this mesh.
        order = Order::Quadratic;
        let usual = mesh::load(file, &parameters, Order::Linear).map_err(Failure::mesh)?;
        let scaling = mesh::scaling_factor(file).map_err(Failure::mesh)?;
        parameters
            .insert("size".to_owned(), mesh::extent(&usual.nodes) / scaling / cells(accuracy));
    }
    mesh::load(file, &parameters, order).map_err(Failure::mesh)
}

/// The reference of all keys of a scene, made of their schema by scripts/keys.py.
const KEYS: &str = include_str!("../../geo/KEYS.md");

/// `signorini keys [--schema]`.
pub fn keys(as_schema: bool) -> Result<(), Failure> {
    say(if as_schema { SCHEMA } else { KEYS }.trim_end());
    Ok(())
}

/// `signorini solvers`.
pub fn solvers() -> Result<(), Failure> {
    REGISTRY.iter().for_each(|entry| say(&format!("{}\t{}", entry.name, entry.summary)));
    Ok(())
}

/// `signorini completions SHELL`.
pub fn completions(shell: clap_complete::Shell, mut program: clap::Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut program, "signorini", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
    Ok(())
}

/// `signorini mesh SCENE…`.
pub fn mesh(scenes: &[PathBuf]) -> Result<(), Failure> {
    require_one_process()?;
    for path in scenes {
        let scene = Scene::read(path, &[]).map_err(Failure::input)?;
        let mesh = read_mesh(&scene, false)?;
        let (nodes, triangles) = (mesh.nodes.len(), mesh.triangles.len());
        say(&format!("{}: {nodes} nodes, {triangles} triangles", scene.name));
    }
    Ok(())
}
