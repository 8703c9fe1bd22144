//! The reference solution of a scene: what the studies take for the exact one, computed once.

use super::{
    Embedding, Fields, Norms, StudyError,
    store::{self, Hash},
    study_run::StudyRun,
};
use clap::Args;
use sha2::{Digest, Sha256};
use signorini::{
    contact::SOLVERS,
    evolution::StepRecord,
    fem::Body,
    mesh::Order,
    petsc::Session,
    scene::{Scene, Scheme, TimeGrid},
};
use std::path::{Path, PathBuf};

/// What can be chosen of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct ReferenceOptions {
    /// Mesh size of the coarsest mesh, m [default: 8 times the scene's].
    #[arg(long, value_name = "M")]
    pub size: Option<f64>,
    /// Grading of the coarsest mesh (mesh.parameters.grading) [default: the scene's].
    #[arg(long, value_name = "RATIO")]
    pub grading: Option<f64>,
    /// How often the coarsest mesh is refined to the mesh of the reference; each time halves all
    /// edges.
    #[arg(long, value_name = "R", default_value_t = Self::default().refinements)]
    pub refinements: usize,
    /// Time step of the reference, s; it must divide T/50 [default: T/1000].
    #[arg(long, value_name = "K")]
    pub step: Option<f64>,
}

impl Default for ReferenceOptions {
    /// The mesh of the paper's "exact solution" on Example I, n = 4·2⁶ = 256. Its steps, 10⁻⁴ s of
    /// Euler's scheme, leave a larger error than 10⁻³ s of "bdf2" (validation/ACCURACY.md, section 1).
    fn default() -> Self {
        Self { size: None, grading: None, refinements: 6, step: None }
    }
}

/// The coarsest mesh is so many times as coarse as the scene's: n = 4 where the scene has 32.
const COARSER: f64 = 8.0;
/// The states kept are T divided by this apart: times that all k of the paper's Table 1 meet.
const INTERVALS: usize = 50;

/// A reference solution specified: a scene, its nested meshes and a time step.
#[derive(Debug, Clone)]
pub struct ReferenceSpec {
    /// The scene as given.
    pub scene: Scene,
    /// T, s.
    pub end: f64,
    /// How often the coarsest mesh is refined.
    pub refinements: usize,
    /// k, s.
    pub step: f64,
    /// The scene on the coarsest mesh.
    coarsest: Scene,
    /// What the states depend on but the mesh and the times: the scene's tables and the overrides.
    problem: String,
}

/// A reference solution.
#[derive(Debug)]
pub struct Reference {
    /// What it was computed with.
    pub spec: ReferenceSpec,
    /// Times of the states, s.
    pub times: Vec<f64>,
    /// The states.
    pub states: Vec<Fields>,
    /// The body on the finest mesh.
    pub body: Body,
    /// The largest norms of the states.
    pub size: Norms,
}

impl ReferenceSpec {
    /// Of the scene at `path` with keys overridden by `set`.
    ///
    /// # Errors
    /// The scene is wrong or has no time, or the options do not suit it.
    pub fn new(
        path: &Path,
        set: &[String],
        options: &ReferenceOptions,
    ) -> Result<Self, StudyError> {
        // The meshes and norms of the studies are those of affine displacements, as in the paper.
        let mut scene = Scene::read(path, set)?;
        scene.order = Order::Linear;
        let unsuitable =
            |problem: &str| Err(StudyError::Unsuitable(format!("{}: {problem}", path.display())));
        let Some(TimeGrid { end, .. }) = scene.time else {
            return unsuitable("a study needs a scene with [time]");
        };
        let (step, spacing) = (options.step.unwrap_or(end / 1_000.0), end / INTERVALS as f64);
        let steps = spacing / step;
        if !(steps.is_finite() && steps > 0.5 && (steps - steps.round()).abs() < 1e-6) {
            let must = format!("the reference's step must divide {spacing} s, but is {step}");
            return unsuitable(&must);
        }
        let mut coarsest = scene.clone();
        let parameters = &mut coarsest.mesh.parameters;
        let size = options.size.or(parameters.get("size").map(|size| COARSER * size));
        for (name, value) in [("size", size), ("grading", options.grading)] {
            parameters.extend(value.map(|value| (name.to_owned(), value)));
        }
        let is_msh = scene.mesh.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("msh"));
        if is_msh && !parameters.is_empty() {
            return unsuitable(
                "a size or grading of the coarsest mesh has no effect on a .msh; this mesh itself \
                 is the coarsest",
            );
        }
        let problem = problem(path, set);
        Ok(Self { scene, end, refinements: options.refinements, step, coarsest, problem })
    }

    /// Where the reference is kept in `folder`.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let parameters = self.coarsest.mesh.parameters.iter();
        let mesh: String = parameters.map(|(name, value)| format!("-{name}{value}")).collect();
        let Self { scene, refinements, step, .. } = self;
        folder.join(format!("{}{mesh}-refined{refinements}-k{step:e}.states", scene.name))
    }

    /// Computes the states and keeps them in `folder`; `accepted` sees every step.
    ///
    /// # Errors
    /// The run failed, or its states cannot be written.
    pub fn compute(
        &self,
        session: &Session,
        folder: &Path,
        accepted: &mut dyn FnMut(&StepRecord),
    ) -> Result<(), StudyError> {
        let run = self.finest();
        let history = run.run(session, &self.times(), accepted)?;
        store::write(&self.path(folder), &self.hash(&history.body), &history.states)
    }

    /// Reads the states from `folder`.
    ///
    /// # Errors
    /// There are none, they belong to another scene or mesh, or the file is damaged; or the mesh
    /// cannot be made.
    pub fn load(&self, folder: &Path) -> Result<Reference, StudyError> {
        let body = Body::new(self.finest().mesh()?, Order::Linear);
        let (times, nodes) = (self.times(), body.mesh.nodes.len());
        let states = store::read(&self.path(folder), &self.hash(&body), times.len(), nodes)?;
        let (own, zero) = (Embedding::new(&body, &body), Fields::zero(nodes));
        let norms = states.iter().map(|state| own.difference(state, &zero));
        let size = norms.fold(Norms::default(), |a, b| a.max(&b));
        Ok(Reference { spec: self.clone(), times, states, body, size })
    }

    /// The run of the reference: "bdf2" on the finest mesh.
    fn finest(&self) -> StudyRun {
        let grid = TimeGrid::uniform(self.end, self.step);
        self.timed(self.refinements, TimeGrid { scheme: Scheme::Bdf2, ..grid })
    }

    /// A run on the coarsest mesh refined so often, with uniform steps k of Euler's scheme.
    pub(super) fn run(&self, refinements: usize, step: f64) -> StudyRun {
        self.timed(refinements, TimeGrid::uniform(self.end, step))
    }

    fn timed(&self, refinements: usize, time: TimeGrid) -> StudyRun {
        let mut scene = self.coarsest.clone();
        scene.time = Some(time);
        StudyRun { scene, refinements, solver: SOLVERS[0].to_owned() }
    }

    /// The times of the states, s: 0, T/50, …, T.
    fn times(&self) -> Vec<f64> {
        (0..=INTERVALS).map(|j| self.end * j as f64 / INTERVALS as f64).collect()
    }

    /// The hash of everything the states depend on.
    fn hash(&self, body: &Body) -> Hash {
        let mut hash = Sha256::new();
        for text in [&self.problem, SOLVERS[0], "bdf2", &format!("{:e}", self.step)] {
            hash.update(text);
            hash.update([0]);
        }
        let mesh = &body.mesh;
        mesh.nodes.iter().flatten().for_each(|x| hash.update(x.to_le_bytes()));
        mesh.triangles.iter().flatten().for_each(|&n| hash.update((n as u64).to_le_bytes()));
        self.times().iter().for_each(|t| hash.update(t.to_le_bytes()));
        hash.finalize().into()
    }
}

impl Reference {
    /// The largest errors over the times of `states`, which belong to the nodes of `body`, each
    /// time all norms; and the largest ‖Δu‖_V + ‖Δζ‖_Y with the time it is reached at.
    pub fn errors(&self, body: &Body, states: &[Fields]) -> (Norms, f64, f64) {
        let embedding = Embedding::new(&self.body, body);
        let (mut worst, mut sum, mut at) = (Norms::default(), 0.0, 0.0);
        for ((time, exact), state) in self.times.iter().zip(&self.states).zip(states) {
            let norms = embedding.difference(exact, state);
            worst = worst.max(&norms);
            if norms.sum() > sum {
                (sum, at) = (norms.sum(), *time);
            }
        }
        (worst, sum, at)
    }
}

/// The tables of the scene file and the overrides that decide on the states, without comments and
/// without what the study chooses itself or what only concerns the output.
fn problem(path: &Path, set: &[String]) -> String {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut tables = text.parse::<toml::Table>().unwrap_or_default();
    for name in ["title", "mesh", "time", "output"] {
        tables.remove(name);
    }
    let decides = |set: &&String| {
        !["mesh.", "time.", "output.", "title"]
            .iter()
            .any(|start| set.trim_start().starts_with(start))
    };
    let overrides: Vec<_> = set.iter().filter(decides).cloned().collect();
    format!("{tables}\n{}", overrides.join("\n"))
}
