//! Scenes: what to solve, read from a TOML file and checked before anything runs.
//!
//! [`Scene::read`] checks everything the file alone can tell; [`Scene::check_mesh`]
//! checks what needs the mesh. Units are SI throughout.

mod boundary;
mod check;
mod document;
mod error;
mod expression;
mod schema;
mod tables;
mod time;

use std::collections::BTreeMap;
use std::iter;
use std::path::{Path, PathBuf};

pub use boundary::{Boundary, Condition, Gap, SurfaceLoad};
pub use error::SceneError;
pub use expression::{Expression, ExpressionError};
pub use schema::SCHEMA;
pub use time::{Scheme, Stepping, TimeGrid, rounded};

use crate::{
    contact::ContactOptions,
    fem::Mass,
    mesh::{Mesh, Order},
    model::{DamageLaw, Material},
};
use document::SceneText;
use schema::Findings;
use serde::Deserialize;

/// A problem to solve, as described by a scene file.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file, as given.
    pub path: PathBuf,
    /// The file's stem: results go to `out/<name>/`.
    pub name: String,
    /// One line for people; the name when the file has no `title`.
    pub title: String,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// The undamaged material, but for the `surfaces`.
    pub material: Material,
    /// The damage law and ζ₀; without it nothing is damaged.
    pub damage: Option<Damage>,
    /// The physical surfaces that are of another material or have another damage law, by name.
    pub surfaces: BTreeMap<String, Surface>,
    /// The order of the displacements.
    pub order: Order,
    /// The largest relative error of the figures, of u (energy norm) and of the damage: mesh and steps are
    /// then chosen.
    pub accuracy: Option<f64>,
    /// The figures for which it is asked; none: all figures, u and the damage.
    pub accuracy_of: Vec<String>,
    /// The time grid; without it there is one static solve at t = 1.
    pub time: Option<TimeGrid>,
    /// Body force f_B, N/m³.
    pub body_force: [Expression; 2],
    /// How the contact problem is solved.
    pub contact: ContactOptions,
    /// What is written.
    pub output: OutputOptions,
    /// The names of its units.
    pub units: Units,
    /// Points at which every step is observed; each name once.
    pub probes: Vec<Probe>,
    /// The conditions on the named parts of the boundary; each name once.
    pub boundaries: Vec<Boundary>,
    /// What was not taken as it is written.
    pub notes: Vec<String>,
    text: SceneText,
}

/// A mesh file and, for a `.geo`, the constants it is meshed with.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshSource {
    /// A `.geo` or `.msh` file.
    pub file: PathBuf,
    /// Constants set in the `.geo`, by name; `size` is the mesh size, m.
    pub parameters: BTreeMap<String, f64>,
}

impl MeshSource {
    /// The mesh in `file`, with no parameters (`--mesh FILE`).
    pub fn from_path(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), parameters: BTreeMap::new() }
    }
}

/// How the material is damaged, and its state at t = 0.
#[derive(Debug, Clone)]
pub struct Damage {
    /// The damage law.
    pub law: DamageLaw,
    /// ζ₀(x, y) in (ζ_*, 1].
    pub initial: Expression,
    /// How (28) is integrated.
    pub mass: Mass,
}

/// What a physical surface is made of.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// Its material.
    pub material: Material,
    /// Its damage law, where there is damage: its ζ_* is that of all.
    pub law: Option<DamageLaw>,
}

/// Whether ζ is in (ζ_*, 1], as ζ₀ must be.
fn may_start_at(law: &DamageLaw, zeta: f64) -> bool {
    law.threshold < zeta && zeta <= 1.0
}

/// The first line of a scene as it was run.
pub const AS_RUN: &str = "# As run by signorini; the results stand beside it.";

/// A point of the body at which every step is observed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// The first part of its columns' names.
    pub name: String,
    /// m.
    pub point: [f64; 2],
}

/// What is written while the scene runs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputOptions {
    /// Fields are written every so many steps, at least 1.
    pub every: Option<usize>,
    /// A checkpoint is written every so many seconds; none if 0.
    pub checkpoint: f64,
}

/// Names of the units that a scene is written in. They label results; nothing is converted.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Units {
    /// Of lengths and displacements, m unless told otherwise.
    pub length: String,
    /// Of forces, N unless told otherwise.
    pub force: String,
    /// Of time, s unless told otherwise.
    pub time: String,
    /// Of stresses and pressures: Pa, or force/length² where one of these is told.
    pub stress: String,
}

impl Default for Units {
    fn default() -> Self {
        let [length, force, time, stress] = ["m", "N", "s", "Pa"].map(str::to_owned);
        Self { length, force, time, stress }
    }
}

impl Units {
    /// Of work per thickness.
    pub fn work(&self) -> String {
        match *self == Self::default() {
            true => "J/m".to_owned(),
            false => format!("{0}·{1}/{1}", self.force, self.length),
        }
    }
}

impl Scene {
    /// All materials by their numbers, that of the scene and those of the surfaces.
    pub fn materials(&self) -> impl Iterator<Item = Material> {
        iter::once(self.material).chain(self.surfaces.values().map(|surface| surface.material))
    }

    /// The damage laws of these materials; none without damage.
    pub fn damage_laws(&self) -> Vec<DamageLaw> {
        let own = self.damage.iter().map(|damage| damage.law);
        own.chain(self.surfaces.values().filter_map(|surface| surface.law)).collect()
    }

    /// The number of the material of each triangle of `mesh`; none where there is only one material.
    pub fn materials_of(&self, mesh: &Mesh) -> Vec<u32> {
        let count = if self.surfaces.is_empty() { 0 } else { mesh.triangles.len() };
        let mut materials = vec![0; count];
        for (number, name) in (1..).zip(self.surfaces.keys()) {
            let triangles = mesh.surfaces.get(name).into_iter().flatten();
            triangles.for_each(|&t| materials[t] = number);
        }
        materials
    }

    /// The times at which expressions are evaluated and checked before the run, s: all t_n, or some
    /// `most` (at least 1) evenly chosen ones; a hundred times where steps are chosen; t = 1 where there
    /// is no time.
    pub fn sample_times(&self, most: usize) -> Vec<f64> {
        let Some(grid) = self.time else { return vec![1.0] };
        let steps = match grid.stepping {
            Stepping::Uniform { steps } => steps,
            Stepping::Auto { .. } => 100,
        };
        let parts = steps.min(most.max(1));
        (0..=parts).map(|i| grid.time(i * steps / parts, steps)).collect()
    }

    /// The scene as it is run, as the text of a file that runs from anywhere: the `--set` arguments are
    /// put in, the mesh is the one in use, paths of files are full. Also what the files of its tables
    /// hold.
    pub fn as_run(&self) -> (String, &[u8]) {
        let mut scene = self.text.document.clone();
        scene.insert("title".into(), self.title.clone().into());
        let file = std::path::absolute(&self.mesh.file).unwrap_or(self.mesh.file.clone());
        let mut mesh = toml::Table::new();
        mesh.insert("file".into(), file.to_string_lossy().into_owned().into());
        let mut parameters = self.mesh.parameters.clone();
        mesh.extend(parameters.remove("size").map(|size| ("size".into(), size.into())));
        if !parameters.is_empty() {
            mesh.insert("parameters".into(), parameters.into());
        }
        scene.insert("mesh".into(), mesh.into());
        (format!("{AS_RUN}\n{scene}"), &self.text.tables)
    }

    /// Reads and checks the scene at `path`.
    ///
    /// `overrides` are `--set` arguments, `time.step=0.005`: a dotted key and a TOML
    /// value; a value that is not TOML is taken as a string. `boundary.NAME.key=…`
    /// addresses a boundary by its name. Relative mesh files start at the scene's
    /// directory, in the file and in `--set` alike.
    ///
    /// # Errors
    /// The file cannot be read or is no TOML; keys are unknown, missing or of the wrong
    /// type; values are out of range or contradict others. All problems of a file are told at
    /// once, each with the line (or the `--set`), the key and what to write instead.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        if path.extension().is_some_and(|ending| ending == "geo" || ending == "msh") {
            let problem = "it is a mesh, and what runs is a scene that names it in [mesh] (`signorini \
                           new NAME` writes one)";
            return Err(SceneError(vec![format!("{}: {problem}", path.display())]));
        }
        let refused = |problem| SceneError(vec![format!("{}: {problem}", path.display())]);
        let text = std::fs::read(path)
            .map_err(|error| refused(format!("the scene cannot be read: {error}")))?;
        let text = String::from_utf8(text).map_err(|error| {
            let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
            refused(format!("line {line} is not UTF-8; save the file in this encoding"))
        })?;
        Self::parse(&text, path, overrides)
    }

    /// As [`Scene::read`], from the text of a file that would stand at `path`.
    ///
    /// # Errors
    /// As [`Scene::read`], but for the reading itself.
    pub fn parse(text: &str, path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let mut text = SceneText::new(path, text, overrides);
        let root = text.parse()?;
        let (document, tables) = text.values(&root);
        let mut found = Findings::check(&text, &root, &document);
        let scene = tables::scene(&mut found);
        let Findings { problems, places, .. } = found;
        text.verdict(problems)?;
        (text.places, text.document, text.tables) = (places, document, tables);
        // Nothing is missing, or there would be a problem.
        let scene = scene.ok_or_else(|| SceneError(Vec::new()))?;
        Ok(Self { text, ..scene })
    }
}
