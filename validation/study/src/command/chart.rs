//! `signorini-study chart`: error against seconds.

use super::{StudyArguments, run_progress, say, with_petsc};
use comfy_table::Table;
use signorini::output;
use signorini_study::{ChartRow, StudyError, chart};

/// Runs the chart, prints its Pareto fronts and writes its table.
///
/// # Errors
/// There is no reference, or a run failed for which no solver is to blame.
pub fn speed_chart(arguments: &StudyArguments) -> Result<(), StudyError> {
    let (reference, folder) = arguments.prepare("chart")?;
    let (bar, mut tell) = run_progress();
    let rows = with_petsc(&[], |session| chart(session, &reference, &mut tell));
    bar.finish_and_clear();
    let rows = rows?;
    if rows.is_empty() {
        let problem = "no mesh of the chart is coarser than this reference";
        return Err(StudyError::Unsuitable(problem.to_owned()));
    }
    say("Pareto front of seconds and ‖ε(Δu)‖ + ‖Δζ‖, and the defaults");
    say(&front(&rows, |row| (row.sum, row.front, row.knee)).to_string());
    say("\nPareto front of seconds and ‖Δζ‖, and the defaults");
    say(&front(&rows, |row| (row.zeta, row.front_zeta, row.knee_zeta)).to_string());
    let failed = rows.iter().filter(|row| row.error.is_some()).count();
    if failed > 0 {
        say(&format!("{failed} of {} runs failed; the table says why", rows.len()));
    }
    let path = folder.join("chart.csv");
    output::write_table(&path, &rows)?;
    say(&format!("written to {}", path.display()));
    Ok(())
}

/// The runs on the front of an error and the default one; `of` tells the error of a run, and
/// whether it is on the front and its knee.
fn front(rows: &[ChartRow], of: fn(&ChartRow) -> (f64, bool, bool)) -> Table {
    let mut rows: Vec<_> = rows.iter().filter(|row| of(row).1 || row.default).collect();
    rows.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let header = [
        "solver",
        "steps",
        "",
        "size",
        "grading",
        "nodes",
        "number",
        "tolerance",
        "seconds",
        "error",
    ];
    let cells = rows.into_iter().map(|row| {
        let steps = match (row.step, row.step_tolerance) {
            (Some(k), _) => format!("k = {k}"),
            (None, Some(tolerance)) => format!("auto {tolerance:e}"),
            (None, None) => String::new(),
        };
        let (error, front, knee) = of(row);
        let marks = [(knee, "knee"), (row.default, "default"), (!front, "not on the front")];
        let marks: Vec<_> = marks.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
        vec![
            row.solver.clone(),
            steps,
            marks.join(", "),
            row.size.to_string(),
            row.grading.to_string(),
            row.nodes.to_string(),
            row.steps.to_string(),
            format!("{:e}", row.tolerance),
            format!("{:.4}", row.seconds),
            format!("{error:.3e}"),
        ]
    });
    super::table(header, cells, 3)
}
