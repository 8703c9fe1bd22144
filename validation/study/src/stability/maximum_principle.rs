//! Map 2. The maximum principle of the damage step: kκ against h², with both masses.

use super::{
    Table, Verdict,
    problems::{self, EXAMPLE_I},
    table::Row,
};
use crate::StudyError;
use signorini::{
    estimate::Simulation,
    evolution::{ObservedProblem, Step},
    fem,
    mesh::Mesh,
    model::Fremond,
    petsc::Session,
};

/// A soft square, sound one cell further, in an unloaded body: φ = 0, ζ only diffuses.
const SOFT: &str = r#"
damage = { diffusion = 1, lambda_d = 0, lambda_u = 1, lambda_w = 0, strain_cap = 1, threshold = 0.01, initial = "LOW + (1 - LOW)*min(1, max(0, 1e6*(max(abs(x - SHEAR*y - 0.5), abs(y - 0.5)) - 0.26)))" }
time = { end = 1, step = 1 }
"#;
const UNLOADED: &str = r#"boundary = [{ name = "left", displacement = [0, 0] }]"#;

/// Example I with λ_U = 2: the source is singular in the corner (1, 0).
const MILD: &str = r#"
damage = { diffusion = 1, lambda_d = 0.1, lambda_u = 2, lambda_w = 0, strain_cap = 1000, threshold = 0.01, initial = 1 }
time = { end = 1, step = 1 }
"#;

const DIFFUSIONS: [f64; 7] = [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];
const STEPS: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
const MASSES: [&str; 2] = ["consistent", "lumped"];
/// kκ/h² where it decides, at one step length.
const RATIOS: [f64; 11] = [0.05, 0.1, 1.0 / 6.0, 0.25, 0.3, 0.4, 0.5, 0.55, 0.6, 0.8, 1.0];
const RATIO_STEP: f64 = 1e-2;
/// Steps of a run, and the end it does not pass, s.
const LENGTH: f64 = 100.0;
const END: f64 = 1.0;
/// Bounds are left by more than this, far above the error of the linear solver.
const ROUNDING: f64 = 1e-10;

/// What a run is made of.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    damage: &'static str,
    boundary: &'static str,
    /// ζ₀ of the soft square.
    low: f64,
    /// The body is sheared by this: x + shear y. At 1 the right angles become 135°.
    shear: f64,
    cells: usize,
}

const SQUARE: Case =
    Case { name: "soft square", damage: SOFT, boundary: UNLOADED, low: 0.1, shear: 0.0, cells: 16 };
const CORNER: Case = Case { name: "corner", damage: MILD, boundary: EXAMPLE_I, low: 1.0, ..SQUARE };
const CASES: [Case; 8] = [
    Case { cells: 8, ..SQUARE },
    SQUARE,
    Case { cells: 32, ..SQUARE },
    Case { name: "nearly broken square", low: 0.02, ..SQUARE },
    Case { cells: 8, ..CORNER },
    CORNER,
    Case { cells: 32, ..CORNER },
    Case { name: "soft square, obtuse mesh", shear: 1.0, ..SQUARE },
];

/// A row is correct if ζ keeps its bounds, refused if it does not and the notes say so.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for case in CASES {
        let fine =
            RATIOS.map(|ratio| (ratio / RATIO_STEP / (case.cells as f64).powi(2), RATIO_STEP));
        let coarse = DIFFUSIONS.iter().flat_map(|&kappa| STEPS.map(|k| (kappa, k)));
        for (diffusion, step) in coarse.chain(fine) {
            for mass in MASSES {
                add(session, table, case, (diffusion, step, mass))?;
            }
        }
    }
    Ok(())
}

/// Runs a case with κ = `diffusion`, k = `step` and the `mass` matrix.
fn add(
    session: &Session,
    table: &mut Table,
    case: Case,
    (diffusion, step, mass): (f64, f64, &str),
) -> Result<(), StudyError> {
    let problem = problem(case, diffusion, step, mass)?;
    let mut history = Vec::new();
    let mut keep = |accepted: &Step| {
        history.push(accepted.clone());
        Ok(())
    };
    let outcome = Simulation::new(&problem).observer(&mut keep).run(session)?;
    let seen = Seen::of(&problem, &history, step);
    // The sources did not allow ζ_* to be reached there.
    let early_stop = outcome.stopped.is_some() && seen.least_admissible > problem.threshold();
    let undershoot = match outcome.stopped {
        Some(stop) => seen.undershoot.max(seen.least_admissible - stop.zeta_min),
        None => seen.undershoot,
    };
    let violated = seen.rise.max(undershoot) > ROUNDING;
    let notes = outcome.notes(&problem);
    let says = |what: &str| notes.iter().any(|note| note.contains(what));
    let (noted, stop_noted) = (says("left the bounds"), says("too early"));
    let row = Row::default()
        .with("scene", case.name)
        .with("h", 1.0 / case.cells as f64)
        .with("diffusion", diffusion)
        .with("step", step)
        .with("mass", mass)
        // kκ/h².
        .with("ratio", step * diffusion * (case.cells as f64).powi(2))
        .with("steps", outcome.last.record.step)
        .with("rise", seen.rise)
        .with("undershoot", undershoot)
        .with("stopped", outcome.stopped.is_some())
        .with("early_stop", early_stop)
        .with("noted", noted);
    let verdict = match violated {
        true if noted && early_stop == stop_noted => Verdict::Refused,
        false if !noted && !stop_noted => Verdict::Correct,
        _ => Verdict::Wrong,
    };
    table.push(row, verdict);
    Ok(())
}

fn problem(
    case: Case,
    diffusion: f64,
    step: f64,
    mass: &str,
) -> Result<ObservedProblem, StudyError> {
    let set = [
        format!("damage.diffusion={diffusion:e}"),
        format!("damage.mass={mass}"),
        format!("time.step={step:e}"),
        format!("time.end={:e}", END.min(LENGTH * step)),
    ];
    let damage = case.damage.replace("LOW", &case.low.to_string());
    let damage = damage.replace("SHEAR", &case.shear.to_string());
    let text = format!("{damage}{}", case.boundary);
    let mut mesh = Mesh::rectangle(1.0, 1.0, case.cells, case.cells);
    mesh.nodes.iter_mut().for_each(|[x, y]| *x += case.shear * *y);
    Ok(problems::problem(mesh, &text, &set)?)
}

/// What a history shows, found from its states alone.
struct Seen {
    /// By how much ζ rose above its maximum at an earlier time.
    rise: f64,
    /// By how much ζ fell below what the sources allow.
    undershoot: f64,
    /// The least ζ that the sources allow in the step after the last.
    least_admissible: f64,
}

impl Seen {
    fn of(problem: &ObservedProblem, history: &[Step], length: f64) -> Self {
        let mut seen = Self { rise: 0.0, undershoot: 0.0, least_admissible: 0.0 };
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for step in history {
            let zeta = &step.state.zeta;
            let low = zeta.iter().copied().fold(f64::INFINITY, f64::min);
            let high = zeta.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            seen.rise = seen.rise.max(high - most);
            seen.undershoot = seen.undershoot.max(least - low);
            most = most.min(high);
            least = least.max(low) + length * least_source(problem, step);
        }
        seen.least_admissible = least;
        seen
    }
}

/// min φ at a state, 1/s.
fn least_source(problem: &ObservedProblem, step: &Step) -> f64 {
    let Some(laws) = problem.damage() else { return 0.0 };
    let strains = problem.body.strains(&step.state.u);
    let phi = fem::source(&problem.body, (&Fremond, laws), &strains, &step.state.zeta)
        .expect("Frémond's source is never positive");
    phi.iter().flatten().copied().fold(0.0, f64::min)
}
