//! `signorini export`: the matrices of a step in the plain nodal unknowns, for programs of other authors.

use super::{Failure, SceneArguments, read_mesh, require_one_process, run::accuracy_loop, screen};
use clap::Args;
use serde_json::json;
use signorini::{
    contact::Bound,
    estimate::Simulation,
    evolution::{RunError, RunOptions, Step},
    fem::{DamageSystem, NodalBases, Stiffness, source, source_load},
    observe::ObservedProblem,
    output::{check_is_own, create, terminal::say, write_whole},
    petsc::{Matrix, PetscError, Session},
    problem::{LoadCase, State},
    scene::rounded,
};
use std::{
    fs,
    iter::zip,
    path::{Path, PathBuf},
};

/// Arguments of `signorini export`.
#[derive(Args)]
pub struct ExportArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The time of the step: the first one that reaches it [default: the last step of the run].
    #[arg(long, value_name = "T")]
    time: Option<f64>,
    /// Folder for the files.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// All files that an export may have.
const EXPORTED: &str = "K.mtx A.mtx B.mtx u_D.mtx g.mtx f.mtx u.mtx zeta.mtx nodes.csv \
    triangles.csv M.mtx L.mtx source.mtx zeta_before.mtx export.json README.md";

/// The names of the files that an earlier export has left in a folder.
fn earlier(out: &Path) -> Vec<String> {
    let about = fs::read(out.join("export.json")).unwrap_or_default();
    let about: serde_json::Value = serde_json::from_slice(&about).unwrap_or_default();
    if about.get("kappa").is_none() {
        return Vec::new();
    }
    let files = about["files"].as_array().into_iter().flatten().filter_map(|name| name.as_str());
    files.chain(["export.json", "README.md"]).map(str::to_owned).collect()
}

/// The name of a file and its content.
type File = (&'static str, String);
/// The entries of a row: column and value.
type Row = Vec<(usize, f64)>;

/// `signorini export SCENE`: runs the scene until a time, and writes the matrices of the step there.
pub fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    require_one_process()?;
    arguments.scene.check()?;
    let session = Session::start(&[])?;
    let exported = run(arguments, &session);
    session.finalize()?;
    exported
}

fn run(arguments: &ExportArguments, session: &Session) -> Result<(), Failure> {
    let ExportArguments { scene, time, out } = arguments;
    check_is_own(&out.join("export.json"), || true).map_err(Failure::input)?;
    let earlier = earlier(out);
    let is_own = |name: &str| earlier.iter().any(|known| known == name);
    EXPORTED
        .split(' ')
        .try_for_each(|name| check_is_own(&out.join(name), || is_own(name)))
        .map_err(Failure::input)?;
    let (mut scene, _) = scene.read(&[])?;
    let mesh = read_mesh(&scene, true)?;
    let (_, mesh) = accuracy_loop(session, &mut scene, mesh, (false, None), false)?;
    let problem = ObservedProblem::new(scene, mesh).map_err(Failure::input)?;
    let mut states = Vec::new();
    let mut keep = |step: &Step| {
        states.insert(0, step.state.clone());
        states.truncate(2);
        // The times of steps are rounded. An error ends the run.
        let reached = time.is_some_and(|time| step.state.time >= time * (1.0 - 1e-9));
        if reached { Err("the time is reached".into()) } else { Ok(()) }
    };
    let ended = Simulation::new(&problem).observer(&mut keep).run(session);
    if !matches!(ended, Err(RunError::Observer(_))) {
        let end = rounded(ended?.last.state.time);
        if let Some(time) = time {
            return Err(Failure::input(format!(
                "--time {time}: the run ends before, at t = {end}"
            )));
        }
    }
    let mut files = files(session, &problem, &states)?;
    let names = Vec::from_iter(files.iter().map(|(name, _)| *name));
    let description = json!({
        "time": states[0].time, "k": states.get(1).map(|before| states[0].time - before.time),
        "kappa": problem.diffusions().first(), "units": problem.scene().units, "files": names,
    });
    files.push(("export.json", format!("{description:#}\n")));
    files.push(("README.md", include_str!("export.md").to_owned()));
    create(out).map_err(Failure::input)?;
    // An earlier export may have files that this one has not.
    let is_new = |name: &str| files.iter().any(|(new, _)| *new == name);
    let stale = EXPORTED.split(' ').filter(|name| is_own(name) && !is_new(name));
    stale.for_each(|name| drop(fs::remove_file(out.join(name))));
    files.iter().try_for_each(|(name, text)| write_whole(&out.join(name), text.as_bytes()))?;
    let end = rounded(states[0].time);
    let files = format!("t = {end}: {}/README.md names them", out.display());
    say(&screen::row("results", &files));
    Ok(())
}

/// (26) in the last of the states, the first in the list: u minimises ½ uᵀKu − fᵀu over Au = a and Bu ≤ g. A has a row for
/// each prescribed unknown, and for each rigid motion m that nothing resists, ∫u·m/|Ω| = 0. With the state before also
/// (28), (M + kκL) ζ_n = M ζ_{n−1} + k b.
fn files(
    session: &Session,
    problem: &ObservedProblem,
    states: &[State],
) -> Result<Vec<File>, Failure> {
    let (body, constraints) = (&problem.body, &problem.constraints);
    let (points, weights) = (&body.nodes.points, &body.nodes.weights);
    let LoadCase { load, c_prescribed, bounds, .. } = problem.load_case(states[0].time)?;
    let row_of = |node: usize, [x, y]: [f64; 2]| vec![(2 * node, x), (2 * node + 1, y)];
    let prescribed = |dof| (row_of(dof / 2, constraints.bases.direction(dof)), c_prescribed[dof]);
    let free = problem.motions.free.iter().map(|motion| {
        let mean = |(dof, m)| (dof, m * weights[dof / 2] / body.area);
        (Row::from_iter(motion.field(body).into_iter().enumerate().map(mean)), 0.0)
    });
    let (a_rows, a): (Vec<_>, Vec<_>) =
        constraints.prescribed().map(prescribed).chain(free).unzip();
    let sides = |of: &Bound| {
        let sides = [(of.normal, of.upper), (of.normal.map(|n| -n), -of.lower)];
        sides.map(|(normal, gap)| (row_of(of.node, normal), gap))
    };
    let gaps = bounds.iter().flat_map(sides).filter(|(_, gap)| gap.is_finite());
    let (b_rows, g): (Vec<_>, Vec<_>) = gaps.unzip();
    let mut stiffness =
        Stiffness::new(session, body, &problem.elasticity, &NodalBases::identity(points.len()))?;
    stiffness.set_damage(body, &problem.zeta_at_points(&states[0].zeta));
    let corners =
        |(t, [i, j, k]): (usize, &[usize; 3])| format!("{i},{j},{k},{}", body.material(t));
    let triangles = body.mesh.triangles.iter().enumerate().map(corners);
    let nodes = points.iter().enumerate().map(|(i, [x, y])| format!("{i},{x},{y}"));
    let mut files = vec![
        ("K.mtx", square(&stiffness.matrix)?),
        ("A.mtx", sparse(load.len(), &a_rows)),
        ("B.mtx", sparse(load.len(), &b_rows)),
        ("u_D.mtx", vector(&a)),
        ("g.mtx", vector(&g)),
        ("f.mtx", vector(&load)),
        ("u.mtx", vector(&states[0].u)),
        ("zeta.mtx", vector(&states[0].zeta)),
        ("nodes.csv", table("node,x,y", nodes)),
        ("triangles.csv", table("i,j,k,material", triangles)),
    ];
    if let (Some(laws), Some(before)) = (problem.damage(), states.get(1)) {
        let mass = problem.mass();
        let system = DamageSystem::new(session, body, mass, &problem.diffusions(), 1.0)?;
        let phi = source(
            body,
            (&RunOptions::of(problem.scene()).source, laws),
            &body.strains(&before.u),
            &before.zeta,
        )
        .map_err(Failure::input)?;
        files.extend([
            ("M.mtx", square(&system.mass)?),
            ("L.mtx", square(&system.laplace)?),
            ("source.mtx", vector(&source_load(body, mass, &phi))),
            ("zeta_before.mtx", vector(&before.zeta)),
        ]);
    }
    // SciPy cannot read a vector without entries.
    files.retain(|(_, text)| !text.ends_with("\n0 1\n"));
    Ok(files)
}

fn table(head: &str, lines: impl Iterator<Item = String>) -> String {
    lines.fold(format!("{head}\n"), |text, line| text + &line + "\n")
}

/// A vector in the array format of Matrix Market (Boisvert, Pozo and Remington, NISTIR 5935).
fn vector(values: &[f64]) -> String {
    let head = format!("%%MatrixMarket matrix array real general\n{} 1", values.len());
    table(&head, values.iter().map(|value| format!("{value:e}")))
}

/// The entries of the rows that are not zero, in the coordinate format.
fn sparse(columns: usize, rows: &[Row]) -> String {
    let entries = rows.iter().enumerate().flat_map(|(i, row)| row.iter().map(move |of| (i, of)));
    let entries = entries.filter(|(_, (_, value))| *value != 0.0);
    let size = format!("{} {columns} {}", rows.len(), entries.clone().count());
    let head = format!("%%MatrixMarket matrix coordinate real general\n{size}");
    table(&head, entries.map(|(i, (j, value))| format!("{} {} {value:e}", i + 1, j + 1)))
}

fn square(matrix: &Matrix) -> Result<String, PetscError> {
    let read = |columns: &[i32], values: &[f64]| {
        zip(columns, values).map(|(&j, &v)| (j as usize, v)).collect()
    };
    let entries = matrix.assembled_rows()?;
    let rows = (0..matrix.owned() as i32).map(|row| entries.read(row, read));
    Ok(sparse(matrix.owned(), &rows.collect::<Result<Vec<Row>, _>>()?))
}
