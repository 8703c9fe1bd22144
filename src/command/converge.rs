//! `signorini converge`: the paper's Table 1 and Figure 3.

use super::{
    Failure, ReferenceArguments,
    screen::{Counter, say},
};
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use signorini::{
    output,
    petsc::Session,
    study::{Convergence, MEASURES, Measure, Norms, converge},
};
use std::path::PathBuf;

/// Arguments of `signorini converge`.
#[derive(Args)]
pub struct ConvergeArguments {
    #[command(flatten)]
    reference: ReferenceArguments,
    /// Folder for converge.csv.
    #[arg(long, value_name = "DIR", default_value = "out/converge")]
    out: PathBuf,
}

/// What stands beside the paper's figures, so that nobody expects their numbers.
const NOT_REPRODUCIBLE: &str = "\
What of the paper cannot be reproduced:
  Table 1, Figure 3  Their numbers: with the data as printed (λ_U = 100) ζ reaches ζ_* at the corner
                     (1, 0) at t = 0.046 (n = 8) … 0.021 (n = 64), and no run comes to T = 1. Above,
                     λ_U is 2. What can be compared is the order.
  Figures 4–9        Their numbers: Figures 4 and 7 carry no dimensions. geo/lshape.geo and
                     geo/bridge.geo choose them.";

/// Runs the study, prints and writes its tables.
///
/// # Errors
/// There is no reference, or a run failed.
pub fn convergence(arguments: &ConvergeArguments) -> Result<(), Failure> {
    let reference = arguments.reference.load()?;
    output::create(&arguments.out).map_err(Failure::input)?;
    let session = Session::start(&[]).map_err(Failure::solver)?;
    let counter = Counter::new("runs");
    let study = converge(&session, &reference, &mut |done, all| counter.show(done, all));
    counter.clear();
    session.finalize().map_err(Failure::solver)?;
    let study = study.map_err(Failure::solver)?;
    if study.rows.is_empty() {
        let problem = "no n and k of Table 1 is coarser than this reference and nested in it";
        return Err(Failure::Input(problem.to_owned()));
    }
    for measure in &MEASURES {
        say(&table(&study, &reference.size, measure));
    }
    say(NOT_REPRODUCIBLE);
    let path = arguments.out.join("converge.csv");
    output::write_table(&path, &study.rows).map_err(Failure::solver)?;
    say(&format!("written to {}", path.display()));
    Ok(())
}

/// An error in the layout of Table 1, with its orders.
fn table(study: &Convergence, size: &Norms, (name, measure, norm): &Measure) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let steps = study.steps();
    let head = steps.iter().map(|k| format!("k = {k}"));
    table.set_header(std::iter::once("n".to_owned()).chain(head));
    for n in study.cells() {
        let errors = study.rows.iter().filter(|row| row.n == n);
        let errors = errors.map(|row| four_digits(measure(row)));
        table.add_row(std::iter::once(n.to_string()).chain(errors));
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let (all, in_h) = (study.order(*measure), study.order_in_h(*measure));
    let in_k = study.growth_in_k(*measure);
    format!(
        "{name}: largest over time; of the reference itself {}\n{table}\norder {all:.2} in h + k over all runs; {in_h:.2} in h \
         at the least k; at the largest n it grows with k by {in_k:.1e} per second\n",
        four_digits(norm(size))
    )
}

/// As in the paper: four significant digits, without an exponent.
fn four_digits(value: f64) -> String {
    let digits = 3 - value.abs().log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 12) as usize)
}
