//! The proved bound of a scene against the true error, that of a much finer mesh with the same ζ.

use crate::StudyError;
use serde::Serialize;
use signorini::{
    estimate::Simulation,
    evolution::{ContactStep, RunOptions, Step},
    fem::{Body, Location},
    mesh::{self, Order, Refinement},
    observe::ObservedProblem,
    petsc::{Session, stage_seconds},
    scene::Scene,
};
use std::path::Path;

/// Bisects every triangle of the run twice: 16 triangles of second order take the place of each.
const DIVISIONS: usize = 2;

/// The errors of u at the end of a run, relative, in the energy norm.
#[derive(Debug, Serialize)]
pub struct Errors {
    /// The triangles of the run.
    pub triangles: usize,
    /// The bound, if there is one, and what the proof leaves out, or why there is none.
    pub bound: Option<f64>,
    /// See `bound`.
    pub reservations: Vec<&'static str>,
    /// The estimate from recovered strains.
    pub estimate: f64,
    /// The difference from the answer on the finer mesh.
    pub truth: f64,
    /// The seconds of the proof, and of a step.
    pub seconds: [f64; 2],
}

/// Runs a scene, and solves its last contact problem on the finer mesh.
///
/// # Errors
/// A run failed, or the scene or its mesh cannot be used.
pub fn errors(session: &Session, scene: &Path, overrides: &[String]) -> Result<Errors, StudyError> {
    let scene = Scene::read(scene, overrides)?;
    let coarse = mesh::load(&scene.mesh.file, &scene.mesh.parameters, scene.order)?;
    let coarse = Refinement::start(coarse).mesh;
    let problem = ObservedProblem::new(scene.clone(), coarse.clone())?;
    let mut most: Option<Step> = None;
    let mut observer = |step: &Step| {
        let of = |step: &Step| step.record.displacement_max;
        if most.as_ref().is_none_or(|most| of(step) > of(most)) {
            most = Some(step.clone());
        }
        Ok(())
    };
    let run = Simulation::new(&problem).bound().observer(&mut observer);
    let outcome = run.run(session)?;
    // The proof takes the state with the largest displacement if the last one is unloaded.
    let most = most.as_ref().unwrap_or(&outcome.last);
    let is_unloaded = outcome.last.record.displacement_max < 0.01 * most.record.displacement_max;
    let state = if is_unloaded { &most.state } else { &outcome.last.state };
    let body = &problem.body;

    let mut finer = Refinement::start(coarse);
    let (mut zeta, mut parents) = (state.zeta.clone(), Vec::from_iter(0..body.triangles.len()));
    for _ in 0..DIVISIONS {
        finer = finer.refine_everywhere()?;
        parents = finer.parent_of_triangle.iter().map(|&parent| parents[parent]).collect();
        zeta.extend(Vec::from_iter(
            finer.halved_edges.iter().map(|&[a, b]| 0.5 * (zeta[a] + zeta[b])),
        ));
    }
    let mut fine = scene;
    fine.order = Order::Quadratic;
    let fine = ObservedProblem::new(fine, finer.mesh)?;
    let run_options = RunOptions::of(fine.scene());
    let seconds = stage_seconds();
    let exact = ContactStep::new(session, &fine, &run_options)?.solve(0, state.time, &zeta)?;
    let own = interpolated(body, &state.u, &fine.body, &parents);
    let error: Vec<f64> = exact.state.u.iter().zip(&own).map(|(u, own)| u - own).collect();
    let energy = |problem: &ObservedProblem, zeta: &[f64], u: &[f64]| {
        let zeta = problem.zeta_at_points(zeta);
        problem.elasticity.energies(&problem.body, &zeta, u).iter().sum::<f64>()
    };
    Ok(Errors {
        triangles: body.triangles.len(),
        bound: outcome.errors.displacement_bound,
        reservations: outcome.errors.reservations,
        estimate: outcome.errors.displacement_mesh,
        truth: (energy(&fine, &zeta, &error) / energy(&problem, &state.zeta, &state.u)).sqrt(),
        seconds: [seconds["proof"], outcome.last.record.seconds],
    })
}

/// u at the nodes of a finer body, each triangle of which lies in the one of `parents`.
fn interpolated(body: &Body, u: &[f64], finer: &Body, parents: &[usize]) -> Vec<f64> {
    let mut values = vec![0.0; 2 * finer.nodes.points.len()];
    let zeta = vec![1.0; body.mesh.nodes.len()];
    for (nodes, &parent) in finer.quadratic_nodes().unwrap_or_default().iter().zip(parents) {
        let first = body.mesh.nodes[body.mesh.triangles[parent][0]];
        let gradients = body.triangles[parent].gradients();
        for &node in nodes {
            let [dx, dy] = [0, 1].map(|k| finer.nodes.points[node][k] - first[k]);
            let part = |i: usize| gradients[i][0] * dx + gradients[i][1] * dy;
            let barycentric = [1.0 + part(0), part(1), part(2)];
            let [x, y] =
                Location { triangle: parent, barycentric }.values(body, parent, u, &zeta).u;
            (values[2 * node], values[2 * node + 1]) = (x, y);
        }
    }
    values
}
