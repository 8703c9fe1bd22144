//! `signorini compare`: all contact solvers on the same scenes.

use super::{Failure, check_petsc, check_solver, screen::say};
use clap::Args;
use comfy_table::{CellAlignment, Table, presets};
use signorini::{
    contact::SOLVERS,
    evolution::DiscreteProblem,
    mesh, output,
    petsc::Session,
    scene::Scene,
    study::{Entry, compare},
};
use std::path::PathBuf;

/// Arguments of `signorini compare`.
#[derive(Args)]
pub struct CompareArguments {
    /// Scene files.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Solvers to compare, each by itself (contact.rescue = false) [default: all].
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    solvers: Vec<String>,
    /// Override a key of the scenes, e.g. --set time.step=0.005; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for comparison.csv.
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// PETSc options.
    #[arg(last = true, value_name = "PETSC OPTIONS")]
    petsc: Vec<String>,
}

/// Runs every scene with every solver, prints and writes the table.
///
/// # Errors
/// Bad input, or a solver that failed (the table is complete all the same).
pub fn compare_scenes(arguments: &CompareArguments) -> Result<(), Failure> {
    let mut solvers: Vec<&str> = arguments.solvers.iter().map(String::as_str).collect();
    solvers.iter().try_for_each(|name| check_solver("--solvers", name))?;
    check_petsc(&arguments.petsc)?;
    if solvers.is_empty() {
        solvers = SOLVERS.to_vec();
    }
    let mut settings = Vec::new();
    for path in &arguments.scenes {
        let mut scene = Scene::read(path, &arguments.set).map_err(Failure::input)?;
        scene.contact.rescue = false;
        let mesh = mesh::load(&scene.mesh.file, &scene.mesh.parameters).map_err(Failure::input)?;
        settings.push(DiscreteProblem::new(scene, mesh).map_err(Failure::input)?);
    }
    output::create(&arguments.out).map_err(Failure::input)?;
    let session = Session::start(&arguments.petsc).map_err(Failure::solver)?;
    let mut entries = Vec::new();
    for problem in &settings {
        let comparison = compare(&session, problem, &solvers).map_err(Failure::solver)?;
        entries.extend(comparison.entries);
    }
    session.finalize().map_err(Failure::solver)?;
    say(&table(&entries).to_string());
    let path = arguments.out.join("comparison.csv");
    output::write_table(&path, &entries).map_err(Failure::solver)?;
    say(&format!("written to {}", path.display()));
    let failed: Vec<_> = entries.iter().filter_map(|e| e.error.as_deref()).collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::Solver(failed.join("\n       "))),
    }
}

fn table(entries: &[Entry]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header([
        "scene",
        "solver",
        "steps",
        "contact moves",
        "its",
        "factors",
        "solve pairs",
        "fallbacks",
        "seconds",
        "times first",
        "worst KKT",
        "Δu",
        "Δζ",
        "Δp",
    ]);
    for e in entries {
        let small = |v: f64| format!("{v:.1e}");
        let first = entries.iter().find(|other| other.scene == e.scene).unwrap_or(e);
        table.add_row([
            e.scene.clone(),
            e.solver.clone(),
            e.steps.to_string(),
            e.contact_changes.to_string(),
            e.iterations.to_string(),
            e.factorisations.to_string(),
            e.triangular_solves.to_string(),
            e.fallbacks.to_string(),
            format!("{:.3}", e.seconds),
            format!("{:.1}", e.seconds / first.seconds),
            if e.error.is_some() { "FAILED".into() } else { small(e.kkt().worst()) },
            small(e.difference_u),
            small(e.difference_zeta),
            small(e.difference_pressure),
        ]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
