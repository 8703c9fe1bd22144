//! `signorini check`: describes a scene without solving it.

use super::{Failure, SceneArguments, ranks::require_one_process, read_mesh, screen::row};
use comfy_table::{CellAlignment, Table, presets};
use signorini::{
    accuracy::INSTANTS,
    mesh::{Mesh, extent},
    model::{Material, Plane},
    observe::ObservedProblem,
    output::terminal::{plain, say},
    problem::Collapse,
    scene::{Boundary, Condition, Scene, Stepping, Units, rounded},
};
use std::iter::once;

/// The approximate number of times at which gaps are evaluated.
const SHOWN_TIMES: usize = 20;

/// `signorini check SCENE`: describes mesh, boundaries, loads, support and cost.
pub fn check(arguments: &SceneArguments) -> Result<(), Failure> {
    require_one_process()?;
    arguments.check()?;
    let (scene, notes) = arguments.read(&[])?;
    let mesh = read_mesh(&scene, false)?;
    scene.check_mesh(&mesh).map_err(Failure::input)?;
    say(&scene.title);
    let (nodes, triangles) = (mesh.nodes.len(), mesh.triangles.len());
    let (width, length) = (plain(extent(&mesh.nodes), 5), &scene.units.length);
    let angle = mesh.smallest_angle().0;
    let of_mesh = format!(
        "{nodes} vertices, {triangles} triangles, up to {width} {length} wide, angles from {angle:.0}°"
    );
    say(&row("mesh", &of_mesh));
    say(&materials(&scene).join("\n"));
    say(&boundaries(&scene, &mesh));
    let problem = ObservedProblem::new(scene, mesh).map_err(Failure::input)?;
    let (of_u, contact) = (2 * problem.body.nodes.points.len(), contact_nodes(&problem));
    let of_damage = problem.damage().map_or(0, |_| problem.body.mesh.nodes.len());
    let unknowns = format!("{of_u} of u, {of_damage} of ζ; {contact} nodes with a gap");
    let mut lines = vec![row("unknowns", &unknowns)];
    lines.extend(loads(&problem));
    lines.extend(support(&problem));
    lines.push(row("cost", &cost(&problem)));
    lines.extend(notes.into_iter().chain(problem.notes()).map(|note| row("note", &note)));
    say(&lines.join("\n"));
    Ok(())
}

/// The materials: that of [material], and those of the surfaces by name.
fn materials(scene: &Scene) -> Vec<String> {
    let names = once("").chain(scene.surfaces.keys().map(String::as_str));
    let line = |(material, name): (&Material, &str)| {
        let plane = if material.plane == Plane::Strain { "plane strain" } else { "plane stress" };
        let stress = &scene.units.stress;
        let mut words =
            format!("E = {} {stress}, ν = {}, {plane}", plain(material.young, 5), material.poisson);
        if material.density > 0.0 {
            words += &format!(", ρ = {}", plain(material.density, 5));
        }
        match name {
            "" => row("material", &words),
            name => row("", &format!("{name}: {words}")),
        }
    };
    let all: Vec<_> = scene.materials().collect();
    all.iter().zip(names).map(line).collect()
}

/// A table of the parts of the boundary: those in the scene, and the free rest.
fn boundaries(scene: &Scene, mesh: &Mesh) -> String {
    let times = scene.sample_times(SHOWN_TIMES);
    let mut free = mesh.boundary_edges();
    let measure = format!("length, {}", scene.units.length);
    let row = |name: &str, edges: &[[usize; 2]], conditions: String| {
        let (mut length, mut mean) = (0.0, [0.0; 2]);
        for (normal, edge_length) in edges.iter().map(|&edge| mesh.edge_normal(edge)) {
            length += edge_length;
            mean = [0, 1].map(|k| mean[k] + normal[k] * edge_length);
        }
        // On a closed curve, or on opposite sides, the mean is 0.
        let straight = mean[0].hypot(mean[1]) / length;
        let [x, y] = mean.map(|sum| sum / (length * straight) + 0.0);
        let normal = match straight {
            straight if straight > 0.999_999 => format!("({x:.3}, {y:.3})"),
            straight if straight > 0.1 => format!("about ({x:.2}, {y:.2})"),
            _ => String::new(),
        };
        [format!("  {name}"), conditions, edges.len().to_string(), plain(length, 5), normal]
    };
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["  boundary", "conditions", "edges", &measure, "outward normal"]);
    for boundary in &scene.boundaries {
        let edges = mesh.edges_of(&boundary.name);
        free.retain(|edge| !edges.contains(edge));
        let conditions = conditions(boundary, edges, mesh, &times, &scene.units.length);
        table.add_row(row(&boundary.name, edges, conditions));
    }
    table.add_row(row("(all other)", &free, "free".to_owned()));
    for numbers in table.column_iter_mut().skip(2) {
        numbers.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string().lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The conditions on a boundary in words, with the range of its gap at `times`.
fn conditions(
    boundary: &Boundary,
    edges: &[[usize; 2]],
    mesh: &Mesh,
    times: &[f64],
    unit: &str,
) -> String {
    let in_words = |condition: &Condition| match condition {
        Condition::Displacement([_, None]) => "displacement in x".to_owned(),
        Condition::Displacement([None, _]) => "displacement in y".to_owned(),
        Condition::Gap(gap) => {
            let at = |node: &usize| {
                let [x, y] = mesh.nodes[*node];
                times.iter().map(move |&t| gap.distance.eval(x, y, t))
            };
            let gaps = edges.iter().flatten().flat_map(at);
            let (least, most) = gaps
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), gap| {
                    (low.min(gap), high.max(gap))
                });
            let along = if gap.normal.is_some() { " along its own normal" } else { "" };
            format!("gap from {} to {} {unit}{along}", plain(least, 5), plain(most, 5))
        }
        other => other.name().to_owned(),
    };
    boundary.conditions.iter().map(in_words).collect::<Vec<_>>().join(", ")
}

/// The number of nodes with a gap condition. The bounds of a node are consecutive.
pub(super) fn contact_nodes(problem: &ObservedProblem) -> usize {
    problem.constraints.bounds.chunk_by(|a, b| a.node == b.node).count()
}

/// The resultants of the loads at the start and at the end.
fn loads(problem: &ObservedProblem) -> Vec<String> {
    let Units { length, force, .. } = &problem.scene().units;
    let line = |t: f64| {
        let load = problem.load(t);
        let at_points = || load.chunks_exact(2).zip(&problem.body.nodes.points);
        let sum = |part: fn(&[f64], &[f64; 2]) -> f64| {
            plain(at_points().map(|(f, point)| part(f, point)).sum::<f64>() + 0.0, 5)
        };
        let [x, y] = [sum(|f, _| f[0]), sum(|f, _| f[1])];
        let moment = sum(|f, [x, y]| x * f[1] - y * f[0]);
        let moment = format!("moment about (0, 0) {moment} {force}");
        row("loads", &format!("t = {}: ({x}, {y}) {force}/{length}, {moment}", rounded(t)))
    };
    problem.scene().sample_times(1).into_iter().map(line).collect()
}

/// The rigid motions of the body and its supports against them.
fn support(problem: &ObservedProblem) -> Vec<String> {
    let motions = &problem.motions;
    if motions.all_prevented() {
        return vec![row("support", "the boundary conditions prevent all rigid motions")];
    }
    let by_contact = |motion| format!("contact alone stops {motion}, and in one direction only");
    let stands = problem.collapse.map(|Collapse { time, motion }| {
        let time = rounded(time);
        format!("stands up to t = {time}; then nothing supports it against {motion}")
    });
    let facts = motions.resisted.iter().map(by_contact).chain(stands);
    facts.map(|fact| row("support", &fact)).collect()
}

/// The approximate time and memory of a run on one rank: time within a factor of two, memory within a fifth.
/// N nodes take 0.7 μs N (N/4225)^0.27 per step, 50 μs N once, and 8 kB N of memory. If contact moves, a step
/// takes three times as long, and another 0.65 ns m³ for m contact nodes. The figures are fits to runs with
/// 300 to 66,000 nodes.
fn cost(problem: &ObservedProblem) -> String {
    let scene = problem.scene();
    let (nodes, contact) = (problem.body.nodes.points.len() as f64, contact_nodes(problem) as f64);
    let step_on = |nodes: f64| 0.7e-6 * nodes * (nodes / 4225.0).powf(0.27);
    let step = step_on(nodes);
    let once = 0.05 + 50e-6 * nodes;
    let megabytes = 50.0 + 8e-3 * nodes;
    // As many steps on the mesh as on meshes with 4 and 16 times as many triangles.
    let steps: f64 = [1.0, 4.0, 16.0].map(|times| step_on(times * nodes)).iter().sum();
    let bars = INSTANTS as f64 * steps + 10.0 * once;
    let seconds = match scene.time.map(|grid| grid.stepping) {
        _ if scene.accuracy.is_some() => {
            return "the run chooses mesh and steps for the required accuracy".to_owned();
        }
        None => format!("{once:.1} s"),
        Some(Stepping::Uniform { steps }) => {
            let moving = 3.0 * step + 0.65e-9 * contact.powi(3);
            let [least, most] = [step, moving].map(|step| once + steps as f64 * step);
            format!(
                "{least:.1} s in {steps} steps, or {most:.1} s if the contact changes in each step"
            )
        }
        Some(Stepping::Auto { .. }) => format!("{once:.1} s and {:.1} ms a step", 1e3 * step),
    };
    format!("about {seconds}; about {megabytes:.0} MB; --bars adds about {bars:.1} s")
}
