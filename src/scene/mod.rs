//! Scenes: descriptions of problems, read from TOML files and checked before a run.
//!
//! - [`Scene`] and its parts: what the user asked for, with all defaults;
//! - [`Expression`]: a function of x, y and t, with bounds on its values in a box;
//! - [`SceneError`]: all problems of a file at once, each with its line.
//!
//! What crosses the door: [`Scene::read`] parses the file and checks it against the JSON schema without the mesh;
//! [`Scene::check_mesh`] checks it against the mesh. Nothing here knows how a problem is solved. Units are SI.

mod as_run;
mod boundary;
mod check;
mod document;
mod error;
mod expression;
mod schema;
mod selection;
mod tables;
mod time;
mod units;

use std::collections::BTreeMap;
use std::iter;
use std::path::{Path, PathBuf};

pub use as_run::AsRun;
pub use boundary::{Boundary, Condition, Gap, SurfaceLoad};
pub(crate) use check::is_required;
pub use error::SceneError;
pub use expression::{Expression, ExpressionError};
pub use schema::SCHEMA;
pub use time::{APART, Scheme, Stepping, TimeGrid, rounded};
pub use units::Units;

use crate::{
    contact::ContactOptions,
    fem::Mass,
    mesh::{Format, Mesh, Order},
    model::{DamageLaw, Material},
    whole_file,
};
use document::SceneText;
use schema::Diagnostics;
use serde::Deserialize;

/// A problem to solve, as described by a scene file.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file, as given.
    pub path: PathBuf,
    /// The file's stem: results go to `out/<name>/`.
    pub name: String,
    /// The title, one line; the name if the file has no `title`.
    pub title: String,
    /// The source of the mesh.
    pub mesh: MeshSource,
    /// The undamaged material outside the `surfaces`.
    pub material: Material,
    /// The damage law and ζ₀; `None` for an elastic body without damage.
    pub damage: Option<Damage>,
    /// The physical surfaces with another material or another damage law, by name.
    pub surfaces: BTreeMap<String, Surface>,
    /// The order of the displacements.
    pub order: Order,
    /// The largest relative error of the figures, of u (energy norm) and of the damage. If it is given, the
    /// program chooses mesh and steps.
    pub accuracy: Option<f64>,
    /// The figures that must have the accuracy; if empty, all figures, u and the damage.
    pub accuracy_of: Vec<String>,
    /// The distance from singular points beyond which extreme stresses are figures of their own, m.
    pub away: Option<f64>,
    /// The memory, MB, and the time, s, that a run with an accuracy may take.
    pub max_memory: Option<f64>,
    /// See `max_memory`.
    pub max_seconds: Option<f64>,
    /// The time grid; `None` for one static solve at t = 1.
    pub time: Option<TimeGrid>,
    /// Body force f_B, N/m³.
    pub body_force: [Expression; 2],
    /// Gravity, m/s², a function of time. With the densities of the materials it is a further body force.
    pub gravity: [Expression; 2],
    /// Options of the contact solver.
    pub contact: ContactOptions,
    /// Options of the results.
    pub output: OutputOptions,
    /// The names of the units.
    pub units: Units,
    /// Points at which every step is observed, with different names.
    pub probes: Vec<Probe>,
    /// The conditions on the named parts of the boundary, with different names.
    pub boundaries: Vec<Boundary>,
    text: SceneText,
}

/// A mesh file and, for a geometry, its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSource {
    /// A file in one of the formats of [`Format`].
    pub file: PathBuf,
    /// Constants set in the geometry, by name; `size` is the mesh size, m.
    pub parameters: BTreeMap<String, f64>,
    /// The array on the cells of a mesh in VTK or XDMF that has the numbers of the materials.
    pub materials: Option<String>,
}

impl MeshSource {
    /// The mesh in `file`, with no parameters (`--mesh FILE`).
    pub fn from_path(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), parameters: BTreeMap::new(), materials: None }
    }
}

/// The damage of the material.
#[derive(Debug, Clone)]
pub struct Damage {
    /// The damage law.
    pub law: DamageLaw,
    /// ζ₀(x, y) in (ζ_*, 1].
    pub initial: Expression,
    /// The mass matrix in (28).
    pub mass: Mass,
}

/// The material of a physical surface.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// Its material.
    pub material: Material,
    /// Its damage law, if there is damage. All surfaces have the same ζ_*.
    pub law: Option<DamageLaw>,
    /// Its [`Scene::away`], m.
    pub away: Option<f64>,
}

/// Whether `zeta` is an admissible ζ₀: in (ζ_*, 1].
fn may_start_at(law: &DamageLaw, zeta: f64) -> bool {
    law.threshold < zeta && zeta <= 1.0
}

/// A point of the body at which every step is observed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Its name, with which the names of its columns begin.
    pub name: String,
    /// Its coordinates, m.
    pub point: [f64; 2],
}

/// Options of the results.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputOptions {
    /// The number of steps between two frames, 0 for no frames; `None` for about 20 frames.
    pub every: Option<usize>,
    /// Times of frames, s, at which steps end.
    #[serde(default)]
    pub times: Vec<f64>,
    /// The time between two checkpoints, s; 0 for no checkpoints.
    pub checkpoint: f64,
}

impl Scene {
    /// The materials by their numbers: the material of the scene, then those of the surfaces.
    pub fn materials(&self) -> impl Iterator<Item = Material> {
        iter::once(self.material).chain(self.surfaces.values().map(|surface| surface.material))
    }

    /// Per material: the distance from singular points beyond which extreme stresses are figures of their own, m.
    pub fn distances_of_extremes(&self) -> Vec<Option<f64>> {
        iter::once(self.away).chain(self.surfaces.values().map(|surface| surface.away)).collect()
    }

    /// The damage laws of these materials; empty without damage.
    pub fn damage_laws(&self) -> Vec<DamageLaw> {
        let own = self.damage.iter().map(|damage| damage.law);
        own.chain(self.surfaces.values().filter_map(|surface| surface.law)).collect()
    }

    /// Per triangle of `mesh`: the number of its material. Empty if there is only one material.
    pub fn materials_of(&self, mesh: &Mesh) -> Vec<u32> {
        let count = if self.surfaces.is_empty() { 0 } else { mesh.triangles.len() };
        let mut materials = vec![0; count];
        for (number, name) in (1..).zip(self.surfaces.keys()) {
            let triangles = mesh.surfaces.get(name).into_iter().flatten();
            triangles.for_each(|&t| materials[t] = number);
        }
        materials
    }

    /// The time of the first solve, s: 0, or 1 for a static problem.
    pub fn start(&self) -> f64 {
        if self.time.is_some() { 0.0 } else { 1.0 }
    }

    /// The tolerance of adaptive time steps; infinite for others.
    pub fn step_tolerance(&self) -> f64 {
        match self.time.map(|grid| grid.stepping) {
            Some(Stepping::Auto { tolerance, .. }) => tolerance,
            _ => f64::INFINITY,
        }
    }

    /// The numbers and names of the materials with these `numbers`; 0 is `material`.
    pub(crate) fn materials_in(&self, numbers: &[u32]) -> Vec<(usize, String)> {
        let names = iter::once("material").chain(self.surfaces.keys().map(String::as_str));
        let found = names.enumerate().filter(|(number, _)| numbers.contains(&(*number as u32)));
        found.map(|(number, name)| (number, name.to_owned())).collect()
    }

    /// The times at which expressions are evaluated and checked before the run, s: all t_n, or about `most`
    /// (at least 1) evenly chosen ones. For adaptive steps a hundred times; without a time grid t = 1.
    pub fn sample_times(&self, most: usize) -> Vec<f64> {
        let Some(grid) = self.time else { return vec![1.0] };
        let steps = match grid.stepping {
            Stepping::Uniform { steps } => steps,
            Stepping::Auto { .. } => 100,
        };
        let parts = steps.min(most.max(1));
        (0..=parts).map(|i| grid.time(i * steps / parts, steps)).collect()
    }

    /// Reads and checks the scene at `path`.
    ///
    /// `overrides` are `--set` arguments such as `time.step=0.005`: a dotted key and a TOML value. A value
    /// that is not TOML becomes a string. `boundary.NAME.key=…` addresses a boundary by its name. Mesh files
    /// are relative to the folder of the scene, in the file and in `--set`.
    ///
    /// # Errors
    /// The file cannot be read or is not TOML; keys are unknown, missing or have the wrong type; values are
    /// out of range or contradict others. The error lists all problems of a file, each with the line (or the
    /// `--set`), the key and what to write instead.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let refused = |problem| SceneError(vec![format!("{}: {problem}", path.display())]);
        if Format::of(path).is_some() {
            let problem = "it is a mesh, and what runs is a scene that names it in [mesh] (`signorini \
                           new NAME` writes one)";
            return Err(refused(problem.to_owned()));
        }
        let text = whole_file::read(path)
            .map_err(|error| refused(format!("the scene cannot be read: {error}")))?;
        let text = whole_file::text(text).map_err(refused)?;
        Self::parse(&text, path, overrides)
    }

    /// As [`Scene::read`], from the `text` of a scene. Messages name the file `path`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let mut text = SceneText::new(path, text, overrides, schema::is_key);
        let root = text.parse()?;
        let document = SceneText::values(&root);
        let mut found = Diagnostics::check(&text, &root, &document);
        let scene = tables::scene(&mut found);
        let Diagnostics { problems, positions, .. } = found;
        text.refuse(problems)?;
        (text.positions, text.document) = (positions, document);
        // Without problems there is a scene.
        let scene = scene.ok_or_else(|| SceneError(Vec::new()))?;
        Ok(Self { text, ..scene })
    }
}
