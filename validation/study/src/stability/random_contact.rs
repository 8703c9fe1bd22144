//! Map 5. Active set on random problems: loads, gaps, stiffness and first guesses drawn at random.

use super::{
    Counts, Table, Verdict,
    problems::{difference, solve, square},
    table::Row,
};
use crate::StudyError;
use rand_xoshiro::{
    SplitMix64,
    rand_core::{Rng, SeedableRng},
};
use signorini::{evolution::ObservedProblem, petsc::Session};

/// Problems of the map.
const PROBLEMS: u64 = 1_000;
/// KKT tolerance of the scenes (the default of the program).
const TOLERANCE: f64 = 1e-10;
/// The kinds of problems, in turn.
const KINDS: [&str; 5] = ["smooth", "rough", "grazing", "supported by contact", "two sides"];

/// Random numbers, the same on every machine.
struct Random(SplitMix64);

impl Random {
    /// Uniform in [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of(&mut self, n: u64) -> u64 {
        self.0.next_u64() % n
    }

    /// A Fourier sum in the variable, wave numbers up to `highest`.
    fn waves(&mut self, variable: char, size: f64, highest: usize) -> String {
        let terms = (1..=highest).map(|k| {
            let a = size * self.between(-1.0, 1.0);
            let phase = self.between(0.0, std::f64::consts::TAU);
            format!("({a:.6e})*sin({k}*pi*{variable}+{phase:.5})")
        });
        terms.collect::<Vec<_>>().join("+")
    }
}

/// A random problem.
struct Problem {
    kind: &'static str,
    contrast: f64,
    discrete: ObservedProblem,
    /// A random first guess of the active nodes, for every other problem.
    guess: Option<Vec<f64>>,
}

/// A row is correct if its answer is certified and agrees with another solver's.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    (0..PROBLEMS).try_for_each(|id| add(session, id, table))
}

/// Solves `count` random problems and counts the verdicts.
///
/// # Errors
/// A problem could not be set up, or PETSc failed.
pub fn sample(session: &Session, count: u64) -> Result<Counts, StudyError> {
    let mut table = Table::default();
    (0..count).try_for_each(|id| add(session, id, &mut table))?;
    Ok(table.counts())
}

fn add(session: &Session, id: u64, table: &mut Table) -> Result<(), StudyError> {
    let Problem { kind, contrast, discrete, guess } = problem(id)?;
    let cells = (discrete.body.mesh.triangles.len() / 2) as f64;
    // A relative residual moves u by at most the condition number of K times as much, and that
    // grows with n² and the contrast.
    let allowed = TOLERANCE * cells * contrast;
    let row = Row::default()
        .with("id", id)
        .with("kind", kind)
        .with("nodes", discrete.body.mesh.nodes.len())
        .with("contact_nodes", discrete.constraints.bounds.len())
        .with("contrast", contrast)
        .with("random_start", guess.is_some())
        .with("allowed", allowed);
    let answer = match solve(session, &discrete, "active-set", guess.as_deref())? {
        Ok(answer) => answer,
        Err(failure) => {
            table.push_refused(row.with("reference", "none"), failure);
            return Ok(());
        }
    };
    let (report, kkt) = (answer.report, answer.record.kkt().worst());
    // TAO shares nothing with the active set but K and its factors.
    let other = solve(session, &discrete, "tao", None)?.ok();
    let apart = other.map(|step| difference(&answer.state.u, &step.state.u));
    let row = row
        .with("active", answer.record.active_nodes)
        .with("iterations", report.iterations)
        .with("factorisations", report.factorisations)
        .with("triangular_solves", report.linear_iterations)
        .with("fallbacks", report.fallbacks)
        .with("kkt", kkt)
        .with("reference", if apart.is_some() { "tao" } else { "none" })
        .with("difference", apart);
    let agrees = apart.is_some_and(|apart| apart <= allowed);
    table.push(row, Verdict::of_answer(kkt <= TOLERANCE && agrees));
    Ok(())
}

fn problem(id: u64) -> Result<Problem, StudyError> {
    let mut random = Random(SplitMix64::seed_from_u64(id));
    let kind = KINDS[(id % KINDS.len() as u64) as usize];
    let n = 8 + 4 * random.one_of(3) as usize;
    let contrast = match random.one_of(4) {
        0 => 1.0,
        _ => 10f64.powf(random.between(0.0, 4.0)),
    };
    let Boundaries { left, bottom, opening, top, right } = Boundaries::new(kind, n, &mut random);
    let rough = random.one_of(2) == 0;
    let shape = match rough {
        true => "0.5+0.5*sin(9*x+1)*cos(11*y)",
        false => "max(0, min(1, 20*(0.3-sqrt((x-0.5)^2+(y-0.3)^2))))",
    };
    let side = match kind {
        "two sides" => format!(", gap = \"abs({})\"", random.waves('y', opening, 2)),
        _ => String::new(),
    };
    let quoted = |[a, b]: [String; 2]| format!("[\"{a}\", \"{b}\"]");
    let (top, right, log) = (quoted(top), quoted(right), contrast.ln());
    let text = format!(
        r#"
damage = {{ diffusion = 1, lambda_d = 1, lambda_u = 1, lambda_w = 0, strain_cap = 1000, threshold = 1e-6, initial = "exp(-({log:.6})*({shape}))" }}
boundary = [
    {{ name = "left", {left} }},
    {{ name = "bottom", gap = "{bottom}" }},
    {{ name = "top", traction = {top} }},
    {{ name = "right", traction = {right}{side} }},
]
"#
    );
    let discrete = square(n, &text, &[])?;
    let guess = (id % 2 == 1)
        .then(|| discrete.constraints.bounds.iter().map(|_| random.one_of(2) as f64).collect());
    Ok(Problem { kind, contrast, discrete, guess })
}

const CLAMPED: &str = "displacement = [\"0\", \"0\"]";
const SYMMETRIC: &str = "symmetry = true";

/// What happens on the sides of the square.
struct Boundaries {
    left: &'static str,
    /// The gap, and its size (m).
    bottom: String,
    opening: f64,
    /// Tractions.
    top: [String; 2],
    right: [String; 2],
}

impl Boundaries {
    fn new(kind: &str, n: usize, random: &mut Random) -> Self {
        let highest = if kind == "rough" { n } else { 3 };
        let load = random.waves('x', 10.0, highest);
        let pull = random.waves('y', 5.0, highest);
        let opening = 10f64.powf(random.between(-4.0, -1.5));
        let gap = format!("max(0,{})", random.waves('x', opening, highest));
        let tangential = format!("{:.6}", random.between(-10.0, 10.0));
        let none = || "0".to_owned();
        let (left, bottom, top, right) = match kind {
            // Just touching: no gap on a part or everywhere, and a load that is zero there, along
            // the foundation, or nothing at all.
            "grazing" => {
                let gap = [none(), "max(0, x-0.5)".into(), gap][random.one_of(3) as usize].clone();
                let top = match random.one_of(4) {
                    0 => [none(), none()],
                    1 => [tangential, none()],
                    2 => [none(), format!("-min(0, x-0.7)*({tangential})")],
                    _ => [tangential.clone(), format!("({tangential})*(x-0.5)")],
                };
                (CLAMPED, gap, top, [none(), none()])
            }
            // The waves lift by less than 9 + 5: 40 downwards keep the body on the foundation, and
            // the symmetry axis prevents everything else.
            "supported by contact" => {
                (SYMMETRIC, gap, [tangential, format!("-40+{load}")], [none(), pull])
            }
            _ => (CLAMPED, gap, [none(), format!("-10+{load}")], [pull, tangential]),
        };
        Self { left, bottom, opening, top, right }
    }
}
