//! Speed against accuracy: what a run costs and how far its answer is from the reference.

use super::{
    Norms, Reference, ReferenceSpec, StudyError,
    front::Front,
    study_run::{History, StudyRun},
};
use serde::Serialize;
use signorini::{
    contact::SOLVERS,
    evolution::RunError,
    mesh::MeshError,
    petsc::Session,
    scene::{Stepping, TimeGrid},
};

/// A choice of everything that trades seconds for accuracy.
#[derive(Debug, Clone, PartialEq)]
struct Choice {
    solver: &'static str,
    /// `mesh.size`, m.
    size: f64,
    /// `mesh.parameters.grading`.
    grading: f64,
    stepping: Stepping,
    /// KKT tolerance.
    tolerance: f64,
}

impl Choice {
    /// The scene as it is.
    fn of(spec: &ReferenceSpec) -> Result<Self, StudyError> {
        let scene = &spec.scene;
        let parameters = &scene.mesh.parameters;
        let (Some(&size), Some(TimeGrid { stepping, .. })) = (parameters.get("size"), scene.time)
        else {
            return Err(StudyError::Unsuitable(format!(
                "{}: the chart varies mesh.size, which this scene does not set; it needs a .geo \
                 and its size",
                scene.path.display()
            )));
        };
        let grading = parameters.get("grading").copied().unwrap_or(1.0);
        let tolerance = scene.contact.tolerance;
        Ok(Self { solver: SOLVERS[0], size, grading, stepping, tolerance })
    }

    /// Whether the mesh is coarser than that of the reference, at its finest places too.
    fn is_coarser(&self, spec: &ReferenceSpec) -> bool {
        let finest = spec.finest_size().unwrap_or_default();
        self.size > 1.001 * finest && self.size / self.grading > 0.999 * finest / spec.grading()
    }

    fn run(&self, spec: &ReferenceSpec) -> StudyRun {
        let mut scene = spec.scene.clone();
        let parameters = &mut scene.mesh.parameters;
        parameters.insert("size".to_owned(), self.size);
        // A .geo need not know a grading.
        if self.grading != 1.0 || parameters.contains_key("grading") {
            parameters.insert("grading".to_owned(), self.grading);
        }
        scene.contact.tolerance = self.tolerance;
        let euler = TimeGrid::uniform(spec.end, spec.end);
        scene.time = Some(TimeGrid { stepping: self.stepping, ..euler });
        StudyRun { scene, refinements: 0, solver: self.solver.to_owned() }
    }
}

/// Runs below this are made several times, s.
const SHORT: f64 = 1.0;
/// How often.
const PASSES: usize = 3;

/// The mesh sizes over that of the scene.
const SIZES: [f64; 5] = [4.0, 2.0, 1.0, 0.5, 0.25];
/// Gradings besides 1.
const GRADINGS: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// T/k of uniform steps.
const STEPS: [usize; 7] = [10, 20, 50, 100, 200, 500, 1000];

/// A run of the chart.
#[derive(Debug, Clone, Serialize)]
pub struct ChartRow {
    /// The contact solver.
    pub solver: String,
    /// `mesh.size`, m.
    pub size: f64,
    /// `mesh.parameters.grading`.
    pub grading: f64,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// k, s; empty where steps are chosen.
    pub step: Option<f64>,
    /// Tolerance of chosen steps.
    pub step_tolerance: Option<f64>,
    /// KKT tolerance asked for.
    pub tolerance: f64,
    /// Worst KKT residual found.
    pub kkt: f64,
    /// Time steps.
    pub steps: usize,
    /// Wall time of reading the mesh, set-up and steps, s; of a short run the least of three.
    pub seconds: f64,
    /// Largest ‖ε(Δu)‖ + ‖Δζ‖ over time.
    pub sum: f64,
    /// Largest ‖ε(Δu)‖ over time.
    pub strain: f64,
    /// Largest |Δu| in H¹ over time.
    pub gradient: f64,
    /// Largest ‖Δζ‖ over time.
    pub zeta: f64,
    /// Largest |Δζ| in H¹ over time.
    pub zeta_gradient: f64,
    /// min ζ at the end, to know the run by.
    pub zeta_min: f64,
    /// Largest |u| at the end, m.
    pub displacement_max: f64,
    /// Whether this is what a user gets who chooses nothing.
    pub default: bool,
    /// Whether no run is both faster and more accurate, by `sum`; and the knee of these.
    pub front: bool,
    /// See `front`.
    pub knee: bool,
    /// The same by `zeta`.
    pub front_zeta: bool,
    /// The same by `zeta`.
    pub knee_zeta: bool,
    /// Why the run failed, if it did.
    pub error: Option<String>,
}

/// Runs the chart and marks its fronts; `done` is told how many of how many runs are finished.
///
/// # Errors
/// No mesh is coarser than that of the reference, or a run failed for which no contact solver is to
/// blame.
pub fn chart(
    session: &Session,
    reference: &Reference,
    done: &mut dyn FnMut(usize, usize),
) -> Result<Vec<ChartRow>, StudyError> {
    let spec = &reference.spec;
    let choices = choices(spec)?;
    let Some(first) = choices.first() else {
        let problem = "no mesh of the chart is coarser than this reference";
        return Err(StudyError::Unsuitable(problem.to_owned()));
    };
    // The first run of a process pays for what the others find ready.
    attempt(session, first, reference)?.ok();
    let mut rows = Vec::new();
    for choice in &choices {
        done(rows.len(), PASSES * choices.len());
        rows.push(run(session, reference, choice)?);
    }
    // Passes over all, so that what else the machine does for a while slows no run each time.
    for pass in 1..PASSES {
        done(pass * choices.len(), PASSES * choices.len());
        for (row, choice) in rows.iter_mut().zip(&choices) {
            if row.seconds < SHORT {
                let again = choice.run(spec).run(session, &[], &mut |_| ())?;
                row.seconds = row.seconds.min(again.seconds);
            }
        }
    }
    mark(&mut rows);
    Ok(rows)
}

/// The runs: all meshes are coarser than that of the reference, at the finest places too.
fn choices(spec: &ReferenceSpec) -> Result<Vec<Choice>, StudyError> {
    let default = Choice::of(spec)?;
    let uniform = Choice { grading: 1.0, ..default.clone() };
    let graded = gradings(spec, &default)?;
    let mut choices = vec![default.clone()];
    // Solvers, meshes and uniform steps.
    for solver in SOLVERS {
        for ratio in SIZES {
            for steps in STEPS {
                // The other solvers show where they stand on smaller meshes.
                if solver == SOLVERS[0] || (ratio >= 0.5 && steps <= 500) {
                    let size = ratio * default.size;
                    let stepping = Stepping::Uniform { steps };
                    choices.push(Choice { solver, size, stepping, ..uniform });
                }
            }
        }
    }
    for size in SIZES.map(|ratio| ratio * default.size) {
        // Graded meshes.
        for &grading in &graded {
            for steps in STEPS.into_iter().filter(|steps| *steps <= 500) {
                let stepping = Stepping::Uniform { steps };
                choices.push(Choice { size, grading, stepping, ..default });
            }
        }
        // Chosen steps.
        for grading in [uniform.grading, default.grading] {
            for tolerance in [0.1, 0.03, 0.01, 3e-3, 1e-3] {
                let stepping = Stepping::Auto { tolerance };
                choices.push(Choice { size, grading, stepping, ..default });
            }
        }
    }
    // Loose tolerances.
    for tolerance in [1e-4, 1e-6, 1e-8] {
        for size in SIZES[1..4].iter().map(|ratio| ratio * default.size) {
            for solver in SOLVERS {
                choices.push(Choice { solver, size, tolerance, ..uniform });
            }
            choices.push(Choice { size, tolerance, ..default });
        }
    }
    let mut once: Vec<Choice> = Vec::new();
    for choice in choices.into_iter().filter(|choice| choice.is_coarser(spec)) {
        if !once.contains(&choice) {
            once.push(choice);
        }
    }
    Ok(once)
}

/// The gradings besides 1 that the scene's .geo knows.
fn gradings(spec: &ReferenceSpec, default: &Choice) -> Result<Vec<f64>, StudyError> {
    match (Choice { grading: GRADINGS[0], ..default.clone() }).run(spec).mesh() {
        Ok(_) => Ok(GRADINGS.to_vec()),
        Err(MeshError::Parameter { .. }) => Ok(Vec::new()),
        Err(error) => Err(error.into()),
    }
}

/// Runs a choice; the inner error is a run that did not reach T.
fn attempt(
    session: &Session,
    choice: &Choice,
    reference: &Reference,
) -> Result<Result<History, String>, StudyError> {
    match choice.run(&reference.spec).run(session, &reference.times, &mut |_| ()) {
        Ok(history) => Ok(Ok(history)),
        Err(error @ (StudyError::Run(RunError::Contact { .. }) | StudyError::Stopped { .. })) => {
            Ok(Err(error.to_string()))
        }
        Err(other) => Err(other),
    }
}

fn run(session: &Session, reference: &Reference, choice: &Choice) -> Result<ChartRow, StudyError> {
    let (step, step_tolerance) = match choice.stepping {
        Stepping::Uniform { steps } => (Some(reference.spec.end / steps as f64), None),
        Stepping::Auto { tolerance } => (None, Some(tolerance)),
    };
    let ran = attempt(session, choice, reference)?;
    let history = ran.as_ref().ok();
    let measured = |value: fn(&History) -> f64| history.map_or(f64::NAN, value);
    let errors = history.map(|history| reference.errors(&history.body, &history.states));
    let error = |value: fn(&Norms) -> f64| errors.map_or(f64::NAN, |(norms, ..)| value(&norms));
    Ok(ChartRow {
        solver: choice.solver.to_owned(),
        size: choice.size,
        grading: choice.grading,
        nodes: history.map_or(0, |history| history.body.mesh.nodes.len()),
        step,
        step_tolerance,
        tolerance: choice.tolerance,
        kkt: measured(|history| history.kkt.worst()),
        steps: history.map_or(0, |history| history.last.step),
        seconds: measured(|history| history.seconds),
        sum: errors.map_or(f64::NAN, |(_, sum, _)| sum),
        strain: error(|norms| norms.strain),
        gradient: error(|norms| norms.gradient),
        zeta: error(|norms| norms.zeta),
        zeta_gradient: error(|norms| norms.zeta_gradient),
        zeta_min: measured(|history| history.last.zeta_min),
        displacement_max: measured(|history| history.last.displacement_max),
        default: *choice == Choice::of(&reference.spec)?,
        front: false,
        knee: false,
        front_zeta: false,
        knee_zeta: false,
        error: ran.as_ref().err().cloned(),
    })
}

/// Marks the Pareto fronts and their knees.
fn mark(rows: &mut [ChartRow]) {
    let points = |error: fn(&ChartRow) -> f64| -> Vec<[f64; 2]> {
        rows.iter().map(|row| [row.seconds, error(row)]).collect()
    };
    let [sum, zeta] = [points(|row| row.sum), points(|row| row.zeta)];
    let [sum, zeta] = [Front::of(&sum), Front::of(&zeta)];
    for (i, row) in rows.iter_mut().enumerate() {
        (row.front, row.knee) = (sum.members.contains(&i), sum.knee == Some(i));
        (row.front_zeta, row.knee_zeta) = (zeta.members.contains(&i), zeta.knee == Some(i));
    }
}
