//! Map 3. Penalty-duality: ω against λω.

use super::{
    Table, Verdict,
    problems::{self, PRESSED_AND_LIFTED, difference, square},
    table::Row,
};
use crate::StudyError;
use signorini::petsc::Session;

/// A horizontal soft band whose stiffness is 1/contrast.
const BAND: &str = r#"
damage = { diffusion = 1, lambda_d = 0, lambda_u = 0, lambda_w = 0, strain_cap = 1, threshold = 1e-6, initial = "SOFT + (1 - SOFT)*min(1, max(0, 8*abs(y - 0.5) - 1))" }
"#;

/// Answers agree when they differ by less, relative to the largest |u|.
const AGREEMENT: f64 = 1e-8;

/// One mesh and stiffness, and the parameters to try there.
struct Sweep {
    cells: usize,
    contrast: f64,
    /// Iterations allowed.
    cap: usize,
    /// Powers of ten of ω/ω_auto.
    decades: &'static [f64],
    lambdas: &'static [f64],
}

const MANY: [f64; 9] = [-3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0];
const FEW: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
const LAMBDAS: [f64; 7] = [0.1, 0.3, 0.45, 0.5, 0.55, 0.7, 0.9];
const SIDES: [f64; 3] = [0.3, 0.5, 0.7];

const SWEEP: Sweep = Sweep { cells: 32, contrast: 1.0, cap: 300, decades: &FEW, lambdas: &[0.5] };
const SWEEPS: [Sweep; 8] = [
    Sweep { cells: 16, cap: 1000, decades: &MANY, lambdas: &LAMBDAS, ..SWEEP },
    Sweep { cap: 500, decades: &MANY, lambdas: &SIDES, ..SWEEP },
    Sweep { cells: 64, ..SWEEP },
    Sweep { cells: 128, cap: 100, decades: &[-1.0, 0.0, 1.0], ..SWEEP },
    Sweep { contrast: 1e1, ..SWEEP },
    Sweep { contrast: 1e2, ..SWEEP },
    Sweep { contrast: 1e3, ..SWEEP },
    Sweep { contrast: 1e4, ..SWEEP },
];

/// A row is correct if the iteration ends at the answer of the active set.
pub(super) fn fill(session: &Session, table: &mut Table) -> Result<(), StudyError> {
    for sweep in &SWEEPS {
        add(session, sweep, table)?;
        table.write()?;
    }
    Ok(())
}

fn add(session: &Session, sweep: &Sweep, table: &mut Table) -> Result<(), StudyError> {
    let band = match sweep.contrast {
        1.0 => String::new(),
        contrast => BAND.replace("SOFT", &(1.0 / contrast).to_string()),
    };
    let text = format!("{PRESSED_AND_LIFTED}{band}");
    let solve = |solver: &str, keys: &[String]| {
        let set: Vec<_> = keys.iter().map(|key| format!("contact.penalty_duality.{key}")).collect();
        problems::solve(session, &square(sweep.cells, &text, &set)?, solver, None)
    };
    let reference = solve("active-set", &[])??;
    let automatic = solve("penalty-duality", &[])??.report.omega.unwrap_or(f64::NAN);
    for accelerate in [false, true] {
        for &lambda_omega in sweep.lambdas {
            for &decade in sweep.decades {
                let factor = 10f64.powf(decade);
                let omega = automatic * factor;
                let keys = [
                    format!("omega={omega:e}"),
                    format!("lambda_omega={lambda_omega}"),
                    format!("accelerate={accelerate}"),
                    format!("iterations={}", sweep.cap),
                ];
                let answer = solve("penalty-duality", &keys)?;
                let row = Row::default()
                    .with("h", 1.0 / sweep.cells as f64)
                    .with("contrast", sweep.contrast)
                    .with("omega", omega)
                    .with("omega_over_auto", factor)
                    .with("lambda_omega", lambda_omega)
                    .with("accelerate", accelerate)
                    .with("converged", answer.is_ok());
                let Ok(step) = answer else {
                    table.push(row.with("iterations", sweep.cap), Verdict::Refused);
                    continue;
                };
                let apart = difference(&step.state.u, &reference.state.u);
                let row = row
                    .with("iterations", step.report.iterations)
                    .with("contraction", step.report.contraction)
                    .with("difference", apart);
                table.push(row, Verdict::of_answer(apart <= AGREEMENT));
            }
        }
    }
    Ok(())
}
