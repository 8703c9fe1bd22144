//! All contact solvers on one scene, side by side.

use serde::Serialize;
use signorini::{
    contact::Kkt,
    evolution::{self, DiscreteProblem, Phases, RunError, State, StepRecord},
    petsc::Session,
};

/// What a solver took for a whole run, and how its answer differs from the most accurate one.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// The scene.
    pub scene: String,
    /// The solver.
    pub solver: String,
    /// Accepted time steps.
    pub steps: usize,
    /// Steps after which another number of nodes is active than before.
    pub contact_changes: usize,
    /// Iterations of the solver, all steps together.
    pub iterations: usize,
    /// Factorisations (not those of a preconditioner chosen by PETSc options).
    pub factorisations: usize,
    /// Pairs of triangular solves.
    pub triangular_solves: usize,
    /// Times it left its fast path.
    pub fallbacks: usize,
    /// Seconds in the solver.
    pub seconds: f64,
    /// Worst relative KKT residuals of all steps.
    pub kkt_stationarity: f64,
    /// See [`Kkt`].
    pub kkt_primal: f64,
    /// See [`Kkt`].
    pub kkt_dual: f64,
    /// See [`Kkt`].
    pub kkt_complementarity: f64,
    /// max |u − u_ref| / max |u_ref| at the end.
    pub difference_u: f64,
    /// max |ζ − ζ_ref| at the end.
    pub difference_zeta: f64,
    /// max |p − p_ref| / max |p_ref| at the end, p the contact pressure.
    pub difference_pressure: f64,
    /// Why the run ended early, if it failed.
    pub error: Option<String>,
}

/// Runs `problem` with each of `solvers` and compares the final states with that of the
/// smallest KKT residuals: an entry per solver, in their order. A failed run is an entry with its
/// error.
///
/// # Errors
/// Only what no solver is to blame for: PETSc or bad input.
pub fn compare(
    session: &Session,
    problem: &DiscreteProblem,
    solvers: &[&str],
) -> Result<Vec<Entry>, RunError> {
    let mut runs = Vec::new();
    for solver in solvers {
        runs.push(run(session, problem, solver)?);
    }
    let worst = |run: &(Entry, Option<State>)| run.0.kkt().worst();
    let best = runs
        .iter()
        .filter(|run| run.0.error.is_none())
        .min_by(|a, b| worst(a).total_cmp(&worst(b)))
        .and_then(|run| run.1.clone());
    let measured = |(mut entry, state): (Entry, Option<State>)| {
        if let (Some(state), Some(best)) = (&state, &best) {
            entry.difference_u = relative(&state.u, &best.u);
            entry.difference_zeta = difference(&state.zeta, &best.zeta);
            entry.difference_pressure = relative(&pressure(state), &pressure(best));
        }
        entry
    };
    Ok(runs.into_iter().map(measured).collect())
}

impl Entry {
    /// The worst KKT residuals.
    pub fn kkt(&self) -> Kkt {
        Kkt {
            stationarity: self.kkt_stationarity,
            primal: self.kkt_primal,
            dual: self.kkt_dual,
            complementarity: self.kkt_complementarity,
        }
    }
}

fn run(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
) -> Result<(Entry, Option<State>), RunError> {
    let phases = Phases::default();
    let mut records: Vec<StepRecord> = Vec::new();
    let mut state = None;
    let result = evolution::run(session, problem, solver, &phases, &mut |step| {
        records.push(step.record);
        state = Some(step.state.clone());
        Ok(())
    });
    let error = match result {
        Ok(_) => None,
        Err(failure @ RunError::Contact { .. }) => Some(failure.to_string()),
        Err(other) => return Err(other),
    };
    let sum = |count: fn(&StepRecord) -> usize| records.iter().map(count).sum();
    let kkt = records.iter().fold(Kkt::default(), |worst, r| worst.max(&r.kkt()));
    let entry = Entry {
        scene: problem.scene().name.clone(),
        solver: solver.to_owned(),
        steps: records.last().map_or(0, |r| r.step),
        contact_changes: records
            .windows(2)
            .filter(|pair| pair[0].active_nodes != pair[1].active_nodes)
            .count(),
        iterations: sum(|r| r.iterations),
        factorisations: sum(|r| r.factorisations),
        triangular_solves: sum(|r| r.linear_iterations),
        fallbacks: sum(|r| r.fallbacks),
        seconds: phases.table().get("contact").map_or(0.0, |phase| phase.seconds),
        kkt_stationarity: kkt.stationarity,
        kkt_primal: kkt.primal,
        kkt_dual: kkt.dual,
        kkt_complementarity: kkt.complementarity,
        difference_u: f64::NAN,
        difference_zeta: f64::NAN,
        difference_pressure: f64::NAN,
        error,
    };
    Ok((entry, state))
}

fn pressure(state: &State) -> Vec<f64> {
    state.contact.iter().map(|point| point.pressure).collect()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn relative(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if size == 0.0 { difference(a, b) } else { difference(a, b) / size }
}
