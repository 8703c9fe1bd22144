//! `signorini-study converge`: errors on nested meshes; on Example I the paper's Table 1 and Figure 3.

use super::StudyArguments;
use signorini::output::terminal::{self, MARKDOWN, say};
use signorini_study::{
    Convergence, ErrorRow, MEASURES, Measure, Norms, Reference, StudyError, converge,
};

/// Runs the study, prints and writes its tables.
///
/// # Errors
/// There is no reference, or a run failed.
pub fn convergence(arguments: &StudyArguments) -> Result<(), StudyError> {
    arguments.study("converge", converge, |study| &study.rows, show)
}

fn show(reference: &Reference, study: &Convergence) {
    for measure in &MEASURES {
        say(&errors(study, &reference.size, measure));
    }
    if study.rows.iter().any(|row| row.printed.is_some()) {
        for measure in &MEASURES[..2] {
            say(&comparison(study, measure));
        }
    }
}

/// An error in the layout of Table 1, with its orders.
fn errors(study: &Convergence, size: &Norms, (name, measure, norm): &Measure) -> String {
    let table = table(study, "h", four_digits, |row| four_digits(measure(row)));
    let (all, in_h) = (study.order(|row| Some(measure(row))), study.order_in_h(*measure));
    let in_k = study.growth_in_k(*measure);
    // A slope needs two points.
    let orders = [
        (all, format!("order {all:.2} in h + k over all runs")),
        (in_h, format!("order {in_h:.2} in h at the least k")),
        (in_k, format!("on the finest mesh it grows with k by {in_k:.1e} per second")),
    ];
    let known = orders.into_iter().filter(|(slope, _)| slope.is_finite()).map(|(_, text)| text);
    format!(
        "{name}: largest over time; of the reference itself {}\n{table}\n{}\n",
        four_digits(norm(size)),
        known.collect::<Vec<_>>().join("; ")
    )
}

/// One of our errors beside those of Table 1.
fn comparison(study: &Convergence, (name, measure, _): &Measure) -> String {
    let ratio = |row: &ErrorRow| row.printed.map(|printed| measure(row) / printed);
    let ratios: Vec<f64> = study.rows.iter().filter_map(ratio).collect();
    let cell = |row: &ErrorRow| match (row.printed, ratio(row)) {
        (Some(printed), Some(ratio)) => format!("{} ({ratio:.2})", four_digits(printed)),
        _ => String::new(),
    };
    let cells = |h: f64| format!("{:.0}", 2.0_f64.sqrt() / h);
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    format!(
        "Table 1 of the paper (its reference: n = 256, k = 1e-4); in brackets {name} over it\n{}\nratios {least:.2} to {largest:.2}, \
         {mean:.2} in the mean; order in h + k: the paper's {:.2}, ours {:.2}\n",
        table(study, "n", cells, cell),
        study.order(|row| row.printed),
        study.order(|row| row.printed.map(|_| measure(row))),
    )
}

/// A row per mesh, which `mesh` tells under the title `name`, and a column per step.
fn table(
    study: &Convergence,
    name: &str,
    mesh: impl Fn(f64) -> String,
    cell: impl Fn(&ErrorRow) -> String,
) -> String {
    let rows = study.meshes().into_iter().map(|h| {
        let of_mesh = study.rows.iter().filter(move |row| row.h == h);
        let cells = of_mesh.map(|row| (format!("k = {}", row.k), cell(row)));
        std::iter::once((name.to_owned(), mesh(h))).chain(cells)
    });
    terminal::table(MARKDOWN, rows, 0)
}

/// As in the paper: four significant digits, without an exponent.
fn four_digits(value: f64) -> String {
    let digits = 3 - value.abs().log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 12) as usize)
}
