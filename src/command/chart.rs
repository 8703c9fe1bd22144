//! `signorini chart`: error against seconds.

use super::{
    Failure, ReferenceArguments,
    screen::{Counter, say},
};
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use signorini::{
    output,
    petsc::Session,
    study::{ChartRow, chart},
};
use std::path::PathBuf;

/// Arguments of `signorini chart`.
#[derive(Args)]
pub struct ChartArguments {
    #[command(flatten)]
    reference: ReferenceArguments,
    /// Folder for chart.csv [default: out/chart/<scene>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the chart, prints its Pareto front and writes its table.
///
/// # Errors
/// There is no reference, or a run failed for which no solver is to blame.
pub fn speed_chart(arguments: &ChartArguments) -> Result<(), Failure> {
    let reference = arguments.reference.load()?;
    let folder = arguments.reference.folder("chart", arguments.out.as_ref());
    output::create(&folder).map_err(Failure::input)?;
    let session = Session::start(&[]).map_err(Failure::solver)?;
    let counter = Counter::new("runs");
    let rows = chart(&session, &reference, &mut |done, all| counter.show(done, all));
    counter.clear();
    session.finalize().map_err(Failure::solver)?;
    let rows = rows.map_err(Failure::solver)?;
    if rows.is_empty() {
        return Err(Failure::Input("no mesh of the chart is coarser than this reference".into()));
    }
    let mut fronts = [Vec::new(), Vec::new()];
    for row in &rows {
        if row.front || row.default {
            fronts[0].push(row);
        }
        if row.front_zeta || row.default {
            fronts[1].push(row);
        }
    }
    let [sum, zeta] = fronts;
    say("Pareto front of seconds and ‖ε(Δu)‖ + ‖Δζ‖, and the defaults");
    say(&table(sum, |row| row.sum, |row| (row.front, row.knee)));
    say("\nPareto front of seconds and ‖Δζ‖, and the defaults");
    say(&table(zeta, |row| row.zeta, |row| (row.front_zeta, row.knee_zeta)));
    let failed = rows.iter().filter(|row| row.error.is_some()).count();
    if failed > 0 {
        say(&format!("{failed} of {} runs failed; the table says why", rows.len()));
    }
    let path = folder.join("chart.csv");
    output::write_table(&path, &rows).map_err(Failure::solver)?;
    say(&format!("written to {}", path.display()));
    Ok(())
}

fn table(
    mut rows: Vec<&ChartRow>,
    error: fn(&ChartRow) -> f64,
    mark: fn(&ChartRow) -> (bool, bool),
) -> String {
    rows.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header([
        "solver",
        "size",
        "grading",
        "nodes",
        "steps",
        "number",
        "tolerance",
        "seconds",
        "error",
        "",
    ]);
    for row in rows {
        let steps = match (row.step, row.step_tolerance) {
            (Some(k), _) => format!("k = {k}"),
            (None, Some(tolerance)) => format!("auto {tolerance:e}"),
            (None, None) => String::new(),
        };
        let (front, knee) = mark(row);
        let marks = [(knee, "knee"), (row.default, "default"), (!front, "not on the front")];
        let marks: Vec<_> = marks.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
        table.add_row([
            row.solver.clone(),
            row.size.to_string(),
            row.grading.to_string(),
            row.nodes.to_string(),
            steps,
            row.steps.to_string(),
            format!("{:e}", row.tolerance),
            format!("{:.4}", row.seconds),
            format!("{:.3e}", error(row)),
            marks.join(", "),
        ]);
    }
    for column in [1, 2, 3, 5, 6, 7, 8] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.to_string()
}
