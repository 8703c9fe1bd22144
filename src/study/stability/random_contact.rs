//! Map 5. Active set on random problems: loads, gaps, stiffness and first guesses drawn at random.

use super::{
    Counts, StudyError, Verdict,
    statics::{difference, solve},
};
use crate::{evolution::DiscreteProblem, output, petsc::Session, scene::Scene, study::rectangle};
use serde::Serialize;
use std::path::Path;

/// Problems of the map.
const PROBLEMS: u64 = 1_000;
/// KKT tolerance of the scenes (the default of the program).
const TOLERANCE: f64 = 1e-10;
/// The kinds of problems, in turn.
const KINDS: [&str; 5] = ["smooth", "rough", "grazing", "held by contact", "two sides"];

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; the constants are those of Vigna's public
/// domain C code): small, and the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of(&mut self, n: u64) -> u64 {
        self.next() % n
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
    discrete: DiscreteProblem,
    /// A random first guess of the pressing nodes, for every other problem.
    guess: Option<Vec<f64>>,
}

#[derive(Serialize)]
struct Row {
    id: u64,
    kind: &'static str,
    nodes: usize,
    contact_nodes: usize,
    active: Option<usize>,
    contrast: f64,
    random_start: bool,
    iterations: Option<usize>,
    factorisations: Option<usize>,
    triangular_solves: Option<usize>,
    fallbacks: Option<usize>,
    kkt: Option<f64>,
    reference: &'static str,
    difference: Option<f64>,
    allowed: f64,
    verdict: Verdict,
    message: Option<String>,
}

/// Makes the map.
pub(super) fn run(session: &Session, folder: &Path) -> Result<Counts, StudyError> {
    let table = (0..PROBLEMS).map(|id| row(session, id)).collect::<Result<Vec<_>, _>>()?;
    output::write_table(&folder.join("active-set.csv"), &table)?;
    Ok(table.iter().map(|row| row.verdict).collect())
}

/// Solves `count` random problems and counts the verdicts.
///
/// # Errors
/// A problem could not be set up, or PETSc failed.
pub fn sample(session: &Session, count: u64) -> Result<Counts, StudyError> {
    (0..count).map(|id| Ok(row(session, id)?.verdict)).collect()
}

fn row(session: &Session, id: u64) -> Result<Row, StudyError> {
    let problem = problem(id)?;
    let discrete = &problem.discrete;
    let bounds = &discrete.constraints.bounds;
    let cells = (discrete.body.mesh.triangles.len() / 2) as f64;
    let mut row = Row {
        id,
        kind: problem.kind,
        nodes: discrete.body.mesh.nodes.len(),
        contact_nodes: bounds.len(),
        active: None,
        contrast: problem.contrast,
        random_start: problem.guess.is_some(),
        iterations: None,
        factorisations: None,
        triangular_solves: None,
        fallbacks: None,
        kkt: None,
        reference: "none",
        difference: None,
        // A relative residual moves u by at most the condition number of K times as much,
        // and that grows with n² and the contrast.
        allowed: TOLERANCE * cells * problem.contrast,
        verdict: Verdict::Refused,
        message: None,
    };
    let (answer, report) = match solve(session, discrete, "active-set", problem.guess.as_deref())? {
        Ok(answer) => answer,
        Err(message) => {
            row.message = Some(message.to_string());
            return Ok(row);
        }
    };
    row.active = Some(answer.record.active_nodes);
    row.iterations = Some(report.iterations);
    row.factorisations = Some(report.factorisations);
    row.triangular_solves = Some(report.linear_iterations);
    row.fallbacks = Some(report.fallbacks);
    row.kkt = Some(answer.record.kkt().worst());
    // The first of two methods that share nothing with the active set and can do it.
    for method in ["penalty-duality", "tao"] {
        if let Ok((other, _)) = solve(session, discrete, method, None)? {
            row.reference = method;
            row.difference = Some(difference(&answer.state.u, &other.state.u));
            break;
        }
    }
    let certified = row.kkt.is_some_and(|kkt| kkt <= TOLERANCE);
    let agrees = row.difference.is_some_and(|d| d <= row.allowed);
    row.verdict = if certified && agrees { Verdict::Correct } else { Verdict::Wrong };
    Ok(row)
}

fn problem(id: u64) -> Result<Problem, StudyError> {
    let mut random = Random(id);
    let kind = KINDS[(id % KINDS.len() as u64) as usize];
    let n = 8 + 4 * random.one_of(3) as usize;
    let contrast = match random.one_of(4) {
        0 => 1.0,
        _ => 10f64.powf(random.between(0.0, 4.0)),
    };
    let highest = if kind == "rough" { n } else { 3 };
    let load = random.waves('x', 10.0, highest);
    let pull = random.waves('y', 5.0, highest);
    let opening = 10f64.powf(random.between(-4.0, -1.5));
    let gap = format!("max(0,{})", random.waves('x', opening, highest));
    let tangential = format!("{:.6}", random.between(-10.0, 10.0));
    let (left, bottom, top, right) = match kind {
        // Just touching: no gap on a part or everywhere, and a load that is zero there, along
        // the foundation, or nothing at all.
        "grazing" => {
            let gap = ["0".into(), "max(0, x-0.5)".into(), gap][random.one_of(3) as usize].clone();
            let top = match random.one_of(4) {
                0 => ["0".into(), "0".into()],
                1 => [tangential, "0".into()],
                2 => ["0".into(), format!("-min(0, x-0.7)*({tangential})")],
                _ => [tangential.clone(), format!("({tangential})*(x-0.5)")],
            };
            (CLAMPED, gap, top, ["0".into(), "0".into()])
        }
        // The waves lift by less than 9 + 5: 40 downwards keep the body on the foundation, and
        // the symmetry axis holds everything else.
        "held by contact" => {
            (SYMMETRIC, gap, [tangential, format!("-40+{load}")], ["0".into(), pull])
        }
        _ => (CLAMPED, gap, ["0".into(), format!("-10+{load}")], [pull, tangential]),
    };
    let rough = random.one_of(2) == 0;
    let shape = match rough {
        true => "0.5+0.5*sin(9*x+1)*cos(11*y)",
        false => "max(0, min(1, 20*(0.3-sqrt((x-0.5)^2+(y-0.3)^2))))",
    };
    let side = match kind {
        "two sides" => format!("gap = \"abs({})\"", random.waves('y', opening, 2)),
        _ => String::new(),
    };
    let quoted = |[a, b]: [String; 2]| format!("[\"{a}\", \"{b}\"]");
    let (top, right, log) = (quoted(top), quoted(right), contrast.ln());
    let text = format!(
        r#"
title = "random"
[mesh]
file = "random.msh"
[material]
young = 80
poisson = 0.3
plane = "stress"
[damage]
diffusion = 1
lambda_d = 1
lambda_u = 1
lambda_w = 0
strain_cap = 1000
threshold = 1e-6
initial = "exp(-({log:.6})*({shape}))"
[[boundary]]
name = "left"
{left}
[[boundary]]
name = "bottom"
gap = "{bottom}"
[[boundary]]
name = "top"
traction = {top}
[[boundary]]
name = "right"
traction = {right}
{side}
"#
    );
    let scene = Scene::parse(&text, Path::new("random.toml"), &[])?;
    let discrete = DiscreteProblem::new(scene, rectangle(1.0, 1.0, n, n))?;
    let guess = (id % 2 == 1)
        .then(|| discrete.constraints.bounds.iter().map(|_| random.one_of(2) as f64).collect());
    Ok(Problem { kind, contrast, discrete, guess })
}

const CLAMPED: &str = "displacement = [\"0\", \"0\"]";
const SYMMETRIC: &str = "symmetry = true";
