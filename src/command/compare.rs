//! `signorini compare`: all contact solvers on the same scenes.

use super::{
    Failure, SOLVERS, check_petsc, check_solver, ranks::require_one_process, read, run::adapt,
};
use clap::Args;
use serde::Serialize;
use signorini::{
    contact::Kkt,
    evolution::{self, DiscreteProblem, Phases, RunError, State, StepRecord},
    output::{
        self,
        terminal::{self, MARKDOWN, say},
    },
    petsc::Session,
};
use std::path::PathBuf;

/// Arguments of `signorini compare`.
#[derive(Args)]
pub struct CompareArguments {
    /// Scene files.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Solvers to compare, each by itself (contact.rescue = false).
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_values = SOLVERS)]
    solvers: Vec<String>,
    /// Override a key of the scenes, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for comparison.csv.
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// PETSc options.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

/// `signorini compare SCENE…`: runs every scene with every solver, prints and writes the table, which
/// is complete also where a solver fails.
pub fn compare(arguments: &CompareArguments) -> Result<(), Failure> {
    require_one_process()?;
    arguments.solvers.iter().try_for_each(|name| check_solver("--solvers", name))?;
    check_petsc(&arguments.petsc)?;
    let session = Session::start(&arguments.petsc)?;
    let mut problems: Vec<DiscreteProblem> = Vec::new();
    for path in &arguments.scenes {
        let (mut scene, mesh) = read(path, None, &arguments.set, true)?;
        // All solvers run on the mesh that the first one adapts.
        let adapted = adapt(&session, &mut scene, &mesh, &arguments.solvers[0], None)?;
        let mesh = adapted.map_or(mesh, |adapted| adapted.mesh);
        scene.contact.rescue = false;
        if let Some(other) = problems.iter().find(|other| other.scene().name == scene.name) {
            return Err(Failure::input(format!(
                "{} and {} have the same name, which the table goes by; rename one",
                other.scene().path.display(),
                path.display()
            )));
        }
        problems.push(DiscreteProblem::new(scene, mesh).map_err(Failure::input)?);
    }
    output::create(&arguments.out).map_err(Failure::input)?;

    let mut entries = Vec::new();
    for problem in &problems {
        entries.extend(compare_solvers(&session, problem, &arguments.solvers)?);
    }
    session.finalize()?;
    say(&table(&entries));
    let path = arguments.out.join("comparison.csv");
    output::write_table(&path, &entries)?;
    say(&format!("written to {}", path.display()));
    let failed: Vec<_> = entries.iter().filter_map(|entry| entry.error.as_deref()).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n       ").into()) }
}

/// A row of `comparison.csv`: what a solver took for a whole run, and how its answer differs from the
/// most accurate one.
#[derive(Debug, Clone, Serialize)]
struct Entry {
    scene: String,
    solver: String,
    /// Accepted time steps.
    steps: usize,
    /// Steps after which another number of nodes is active than before.
    contact_changes: usize,
    /// Iterations of the solver, all steps together; so are the next four.
    iterations: usize,
    /// Factorisations (not those of a preconditioner chosen by PETSc options).
    factorisations: usize,
    /// Pairs of triangular solves.
    triangular_solves: usize,
    /// Times the solver left its fast path.
    fallbacks: usize,
    /// Seconds in the solver.
    seconds: f64,
    /// The largest relative KKT residuals of all steps: see [`Kkt`].
    kkt_stationarity: f64,
    kkt_primal: f64,
    kkt_dual: f64,
    kkt_complementarity: f64,
    /// max |u − u_ref| at the end, over max |u_ref| of all steps.
    difference_u: f64,
    /// max |ζ − ζ_ref| at the end.
    difference_zeta: f64,
    /// max |p − p_ref| at the end, over max |p_ref| of all steps, p the contact pressure.
    difference_pressure: f64,
    /// Why the run ended early, if it failed.
    error: Option<String>,
    /// The last accepted state.
    #[serde(skip)]
    last: Option<State>,
    /// What counts as 1 in u and in p: their max norms over all steps.
    #[serde(skip)]
    scales: [f64; 2],
}

impl Entry {
    /// The largest of the four residuals.
    fn worst_residual(&self) -> f64 {
        let equations = self.kkt_stationarity.max(self.kkt_complementarity);
        equations.max(self.kkt_primal).max(self.kkt_dual)
    }
}

/// Runs `problem` with each of `solvers` and compares the final states with the one that has the
/// smallest KKT residuals. A failed run is an entry with its error.
fn compare_solvers(
    session: &Session,
    problem: &DiscreteProblem,
    solvers: &[String],
) -> Result<Vec<Entry>, RunError> {
    let runs = solvers.iter().map(|solver| run(session, problem, solver));
    let mut entries = runs.collect::<Result<Vec<_>, _>>()?;
    let complete = entries.iter().filter(|entry| entry.error.is_none());
    let best = complete.min_by(|a, b| a.worst_residual().total_cmp(&b.worst_residual()));
    if let Some(Entry { last: Some(best), scales: [max_u, max_p], .. }) = best.cloned() {
        for entry in &mut entries {
            let Some(state) = &entry.last else { continue };
            entry.difference_u = difference(&state.u, &best.u) / max_u;
            entry.difference_zeta = difference(&state.zeta, &best.zeta);
            entry.difference_pressure = difference(&pressure(state), &pressure(&best)) / max_p;
        }
    }
    Ok(entries)
}

/// The run of one solver.
fn run(session: &Session, problem: &DiscreteProblem, solver: &str) -> Result<Entry, RunError> {
    let phases = Phases::default();
    let mut records: Vec<StepRecord> = Vec::new();
    let (mut last, mut scales) = (None, [0.0_f64; 2]);
    let result = evolution::run(session, problem, solver, &phases, &mut |step| {
        records.push(step.record);
        scales[0] = scales[0].max(step.record.displacement_max);
        scales[1] = pressure(&step.state).iter().fold(scales[1], |max, p| max.max(p.abs()));
        last = Some(step.state.clone());
        Ok(())
    });
    let error = match result {
        Ok(_) => None,
        Err(failure @ RunError::Contact { .. }) => Some(failure.to_string()),
        Err(other) => return Err(other),
    };
    let sum = |count: fn(&StepRecord) -> usize| records.iter().map(count).sum();
    let kkt = records.iter().fold(Kkt::default(), |worst, r| worst.max(&r.kkt()));
    let moves = records.windows(2).filter(|pair| pair[0].active_nodes != pair[1].active_nodes);
    Ok(Entry {
        scene: problem.scene().name.clone(),
        solver: solver.to_owned(),
        steps: records.last().map_or(0, |record| record.step),
        contact_changes: moves.count(),
        iterations: sum(|record| record.iterations),
        factorisations: sum(|record| record.factorisations),
        triangular_solves: sum(|record| record.linear_iterations),
        fallbacks: sum(|record| record.fallbacks),
        seconds: phases.get("contact").map_or(0.0, |phase| phase.seconds),
        kkt_stationarity: kkt.stationarity,
        kkt_primal: kkt.primal,
        kkt_dual: kkt.dual,
        kkt_complementarity: kkt.complementarity,
        difference_u: f64::NAN,
        difference_zeta: f64::NAN,
        difference_pressure: f64::NAN,
        error,
        last,
        scales: scales.map(|scale| if scale == 0.0 { 1.0 } else { scale }),
    })
}

fn pressure(state: &State) -> Vec<f64> {
    state.contact.iter().map(|point| point.pressure).collect()
}

/// ‖a − b‖ in the max norm.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A table in Markdown.
fn table(entries: &[Entry]) -> String {
    let small = |value: f64| format!("{value:.1e}");
    let rows = entries.iter().map(|entry| {
        let failed = entry.error.is_some();
        let first = entries.iter().find(|other| other.scene == entry.scene).unwrap_or(entry);
        [
            ("scene", entry.scene.clone()),
            ("solver", entry.solver.clone()),
            ("steps", entry.steps.to_string()),
            ("contact moves", entry.contact_changes.to_string()),
            ("its", entry.iterations.to_string()),
            ("factors", entry.factorisations.to_string()),
            ("solve pairs", entry.triangular_solves.to_string()),
            ("fallbacks", entry.fallbacks.to_string()),
            ("seconds", format!("{:.3}", entry.seconds)),
            ("times first", format!("{:.1}", entry.seconds / first.seconds)),
            ("worst KKT", if failed { "FAILED".into() } else { small(entry.worst_residual()) }),
            ("Δu", small(entry.difference_u)),
            ("Δζ", small(entry.difference_zeta)),
            ("Δp", small(entry.difference_pressure)),
        ]
    });
    terminal::table(MARKDOWN, rows, 2)
}
