//! The data of a scene that a proof leaves out.

use super::pressure::ContactEdge;
use crate::{mesh::bounds, problem::DiscreteProblem, scene::Expression};

/// Functions may jump at vertices, so this part of a triangle or of a side at its ends does not count.
const AT_JUMP: f64 = 1e-9;

/// The data of the scene that the proof leaves out: functions that are no polynomials of the degrees that it takes in the triangles
/// and on their sides, chords, and turns of the contact surface. Collective.
pub(super) fn of(problem: &DiscreteProblem, edges: &[ContactEdge], time: f64) -> Vec<&'static str> {
    let (body, scene) = (&problem.body, problem.scene());
    let degree = body.order() as u32 + 1;
    // Is f a polynomial of at most the `degree` between these vertices? It may have jumps at them.
    let varies = |f: &Expression, vertices: &[usize], degree: u32| {
        let [x, y] = bounds(vertices.iter().map(|vertex| &body.mesh.nodes[*vertex]));
        let [x, y] = [x, y].map(|[low, high]| {
            let within = AT_JUMP * (high - low);
            [low + within, high - within]
        });
        f.degree([x, y, [time; 2]]).is_none_or(|of| of > degree)
    };
    let (mut loads, mut values) = (false, false);
    for force in &scene.body_force {
        loads |= body.mesh.triangles.iter().any(|triangle| varies(force, triangle, degree - 1));
    }
    for part in &scene.boundaries {
        for condition in &part.conditions {
            for function in condition.expressions().into_iter().flatten() {
                let mut edges = body.mesh.edges_of(&part.name).iter();
                let found = edges.any(|ends| varies(function, ends, degree));
                *(if condition.is_support() { &mut values } else { &mut loads }) |= found;
            }
        }
    }
    let comm = body.comm();
    let parts = [
        (loads, "loads vary within triangles"),
        (values, "gaps or displacements vary between nodes"),
        (problem.has_chords, "curved sides are chords"),
        (edges.iter().any(|edge| edge.is_turned), "the contact surface turns at nodes"),
    ];
    parts.into_iter().filter_map(|(found, name)| comm.any(found).then_some(name)).collect()
}
