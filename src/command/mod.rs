//! The subcommands of the program, a file each: `run`, `check`, `new`, `script`; the short ones are here.
//!
//! A run reads its arguments and its scene into a [`Task`](task::Task). A `Recorder` observes the steps, writes the
//! results, keeps checkpoints and shows the progress.
//!
//! What crosses the door: `main` calls one function per subcommand. It returns a [`Failure`] with an exit code and
//! a message for the person at the terminal.

mod check;
mod checkpoint;
mod ending;
mod explain;
mod export;
mod figures;
mod new;
mod provenance;
mod ranks;
mod recorder;
mod run;
mod screen;
mod script;
mod serve;
mod summary;
mod task;

pub use check::check;
pub use ending::{install, out_of_memory, watch};
pub use explain::explain;
pub use export::{ExportArguments, export};
pub use new::{list_gallery, new};
pub use provenance::version;
pub use run::{RunArguments, run};
pub use script::{ScriptArguments, script};
pub use serve::{serve, words};

use clap::Args;
use ranks::require_one_process;
use signorini::{
    accuracy,
    contact::{REGISTRY, SOLVERS, TAO_TYPES},
    interrupt::{Signal, received},
    mesh::{self, Format, Mesh},
    observe::{Figure, Figures},
    output::terminal::say,
    printable::print_error,
    scene::{MeshSource, SCHEMA, Scene, Units},
};
use std::{
    fmt,
    path::{Path, PathBuf},
};

/// The failure of a command.
#[derive(Debug)]
pub struct Failure {
    /// The exit code: 2 for bad input, 1 for a run that ended early.
    pub code: u8,
    /// The message for the user; `None` if another rank reports it.
    pub message: Option<String>,
}

impl Failure {
    /// Another rank has failed and reports its error.
    const ON_ANOTHER_RANK: Self = Self { code: 1, message: None };

    /// The user has to change the input, or a signal has ended the work on it.
    fn input(error: impl fmt::Display) -> Self {
        Self { code: received().map_or(2, Signal::exit_code), ..Self::from(error) }
    }
}

/// Failures that are not caused by the input: a solver missed its tolerance, or results could not be written.
impl<E: fmt::Display> From<E> for Failure {
    fn from(error: E) -> Self {
        Self { code: received().map_or(1, Signal::exit_code), message: Some(error.to_string()) }
    }
}

/// Prints an error or another `kind` of message.
pub fn tell(kind: &str, text: &str) {
    print_error(&format!("{kind}: {text}"));
}

/// Checks PETSc options before the results of an earlier run are removed.
fn check_petsc(options: &[String]) -> Result<(), Failure> {
    if let Some(word) = options.first().filter(|word| !word.starts_with('-')) {
        let problem = format!("PETSc options begin with a dash, but the first is `{word}`");
        return Err(Failure::input(problem));
    }
    if options.iter().any(|word| word == "-elastic_ksp_view_mat") {
        return Err(Failure::input(
            "-elastic_ksp_view_mat: products with K are sums over elements, so it has no entries here; `signorini export` \
             writes K and all else of a step (-elastic_ksp_view_pmat: the matrix of the factor, in nodal bases)",
        ));
    }
    match options.windows(2).find(|pair| pair[0] == "-tao_type") {
        Some([_, kind]) if !TAO_TYPES.contains(&kind.as_str()) => Err(Failure::input(format!(
            "-tao_type: `{kind}` is none of TAO's types that solve contact problems: {}",
            TAO_TYPES.join(", ")
        ))),
        _ => Ok(()),
    }
}

fn fraction(text: &str) -> Result<f64, &'static str> {
    text.parse().map_err(|_| "write a number with a decimal point: 0.01 is 1 %")
}

/// The names in a list with commas, as in CSV: a name with a comma stands in double quotes.
fn split_names(list: &str) -> Vec<String> {
    let reader = csv::ReaderBuilder::new().has_headers(false).from_reader(list.as_bytes());
    reader
        .into_records()
        .flatten()
        .flat_map(|names| Vec::from_iter(names.iter().map(str::to_owned)))
        .collect()
}

/// A scene and overrides of its keys.
#[derive(Args)]
pub struct SceneArguments {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Use this mesh or geometry instead of the scene's.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Choose order, mesh and time steps so that every figure is within this part of its largest value in
    /// the run, and u (energy norm) and the damage too, from 1e-5 to 0.5, e.g. 0.01; time.step,
    /// time.tolerance and the mesh.size of a .geo then have no effect.
    #[arg(long, value_name = "ERROR", value_parser = fraction)]
    accuracy: Option<f64>,
    /// Ask for the accuracy of this figure alone, or of several, with commas (`signorini keys --figures` lists
    /// them); a name with a comma stands in quotes.
    #[arg(long, value_name = "NAME")]
    accuracy_of: Vec<String>,
    /// Begin no finer mesh for the accuracy that would need more memory on all ranks [default: half of the free
    /// memory at the start].
    #[arg(long, value_name = "MB")]
    max_memory: Option<f64>,
    /// Begin no finer mesh, and no repetition with shorter steps, for the accuracy after which the run would take longer;
    /// meshes may take half of it.
    #[arg(long, value_name = "S")]
    max_seconds: Option<f64>,
    /// Override a key of the scene, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Keys without effect if an accuracy is required.
const CHOSEN: [&str; 3] = ["mesh.size", "time.step", "time.tolerance"];

impl SceneArguments {
    /// Checks that no argument is without effect.
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

    /// The scene with its overrides and those in `more`, and notes for the user.
    fn read(&self, more: &[String]) -> Result<(Scene, Vec<String>), Failure> {
        let keys = ["accuracy", "max_memory", "max_seconds"];
        let values = [self.accuracy, self.max_memory, self.max_seconds].into_iter().zip(keys);
        let asked = values.filter_map(|(value, key)| Some(format!("{key}={}", value?)));
        let figures = self.accuracy_of.iter().flat_map(|names| split_names(names));
        let figures = Vec::from_iter(figures.map(toml::Value::from));
        let figures =
            (!figures.is_empty()).then(|| format!("accuracy_of={}", toml::Value::from(figures)));
        let asked = Vec::from_iter(asked.chain(figures));
        let set = [&self.set[..], &asked, more].concat();
        let mut scene = Scene::read(&self.scene, &set).map_err(Failure::input)?;
        let idle = [
            ("accuracy_of", !scene.accuracy_of.is_empty()),
            ("max_memory", scene.max_memory.is_some()),
            ("max_seconds", scene.max_seconds.is_some()),
        ];
        let idle = idle.into_iter().find(|(_, given)| *given && scene.accuracy.is_none());
        if let Some((key, _)) = idle {
            return Err(Failure::input(format!(
                "{key} has no effect without accuracy; add accuracy = 0.01, say, or --accuracy 0.01"
            )));
        }
        let is_chosen =
            |set: &&String| set.split('=').next().is_some_and(|key| CHOSEN.contains(&key.trim()));
        let unused = self.set.iter().filter(|_| scene.accuracy.is_some()).find(is_chosen);
        let notes = Vec::from_iter(unused.map(|set| {
            format!("--set {set} has no effect: the accuracy chooses the mesh and the time steps")
        }));
        match &self.mesh {
            Some(file) => scene.mesh = MeshSource::from_path(file),
            None => scene.check_mesh_file().map_err(Failure::input)?,
        }
        Ok((scene, notes))
    }
}

/// The mesh of a scene; gmsh makes it if necessary. If the run will adapt the mesh to an accuracy, the mesh of
/// a `.geo` is coarse.
fn read_mesh(scene: &Scene, adapts: bool) -> Result<Mesh, Failure> {
    let MeshSource { file, parameters, materials } = &scene.mesh;
    let is_adapted = adapts && Format::of(file) == Some(Format::Geometry);
    let mesh = match scene.accuracy.filter(|_| is_adapted) {
        Some(accuracy) => accuracy::first_mesh(scene, accuracy),
        None => mesh::load_choosing(file, parameters, materials.as_deref(), scene.order),
    };
    let mut mesh = mesh.map_err(Failure::input)?;
    scene.name_edges(&mut mesh).map_err(Failure::input)?;
    Ok(mesh)
}

/// The reference of all keys of a scene. scripts/keys.py makes it from their schema.
const KEYS: &str = include_str!("../../geo/KEYS.md");

/// `signorini keys [--schema | --figures]`.
pub fn keys(as_schema: bool, of_figures: bool) -> Result<(), Failure> {
    match of_figures {
        true => {
            let row = |of: &Figure| {
                let unit = of.dimension.unit(&Units::default());
                format!("| `{}` | {} | {unit} |", of.name, of.label)
            };
            say(&Figures::of_any_scene().iter().map(row).collect::<Vec<_>>().join("\n"));
        }
        false => say(if as_schema { SCHEMA } else { KEYS }.trim_end()),
    }
    Ok(())
}

/// `signorini solvers`.
pub fn solvers() -> Result<(), Failure> {
    REGISTRY.iter().for_each(|entry| say(&format!("{}\t{}", entry.name, entry.summary)));
    Ok(())
}

/// `signorini completions SHELL`. A run takes further solvers, as `tao:bnls`, but these names are offered.
pub fn completions(shell: clap_complete::Shell, program: clap::Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    let mut program =
        program.mut_subcommand("run", |run| run.mut_arg("solver", |of| of.value_parser(SOLVERS)));
    clap_complete::generate(shell, &mut program, "signorini", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
    Ok(())
}

/// `signorini man FOLDER`. The pages show the short version: the long one tells the files of one machine.
pub fn man(folder: &Path, program: clap::Command) -> Result<(), Failure> {
    clap_mangen::generate_to(program.long_version(None::<&str>), folder).map_err(Failure::from)
}

/// `signorini mesh SCENE…`.
pub fn mesh(scenes: &[PathBuf], set: &[String]) -> Result<(), Failure> {
    require_one_process()?;
    for path in scenes {
        let scene = Scene::read(path, set).map_err(Failure::input)?;
        scene.check_mesh_file().map_err(Failure::input)?;
        let mesh = read_mesh(&scene, false)?;
        mesh.notes.iter().for_each(|note| tell("note", note));
        let (nodes, triangles) = (mesh.nodes.len(), mesh.triangles.len());
        say(&format!("{}: {nodes} nodes, {triangles} triangles", scene.name));
    }
    Ok(())
}
