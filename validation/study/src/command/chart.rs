//! `signorini-study chart`: error against seconds.

use super::StudyArguments;
use signorini::output::terminal::{MARKDOWN, say, table};
use signorini_study::{ChartRow, StudyError, chart};

/// Runs the chart, prints its Pareto fronts and writes its table.
///
/// # Errors
/// There is no reference, or a run failed for which no solver is to blame.
pub fn speed_chart(arguments: &StudyArguments) -> Result<(), StudyError> {
    arguments.study("chart", chart, Vec::as_slice, |_, rows| show(rows))
}

fn show(rows: &[ChartRow]) {
    say("Pareto front of seconds and ‖ε(Δu)‖ + ‖Δζ‖, and the defaults");
    say(&front(rows, |row| (row.sum, row.front, row.knee)));
    say("\nPareto front of seconds and ‖Δζ‖, and the defaults");
    say(&front(rows, |row| (row.zeta, row.front_zeta, row.knee_zeta)));
    let failed = rows.iter().filter(|row| row.error.is_some()).count();
    if failed > 0 {
        say(&format!("{failed} of {} runs failed; the table says why", rows.len()));
    }
}

/// The runs on the front of an error and the default one; `of` tells the error of a run, and
/// whether it is on the front and its knee.
fn front(rows: &[ChartRow], of: fn(&ChartRow) -> (f64, bool, bool)) -> String {
    let mut rows: Vec<_> = rows.iter().filter(|row| of(row).1 || row.default).collect();
    rows.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let cells = rows.into_iter().map(|row| {
        let steps = match (row.step, row.step_tolerance) {
            (Some(k), _) => format!("k = {k}"),
            (None, Some(tolerance)) => format!("auto {tolerance:e}"),
            (None, None) => String::new(),
        };
        let (error, front, knee) = of(row);
        let marks = [(knee, "knee"), (row.default, "default"), (!front, "not on the front")];
        let marks: Vec<_> = marks.iter().filter(|(is, _)| *is).map(|(_, name)| *name).collect();
        [
            ("solver", row.solver.clone()),
            ("steps", steps),
            ("", marks.join(", ")),
            ("size", row.size.to_string()),
            ("grading", row.grading.to_string()),
            ("nodes", row.nodes.to_string()),
            ("number", row.steps.to_string()),
            ("tolerance", format!("{:e}", row.tolerance)),
            ("seconds", format!("{:.4}", row.seconds)),
            ("error", format!("{error:.3e}")),
        ]
    });
    table(MARKDOWN, cells, 3)
}
