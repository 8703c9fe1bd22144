//! The change of the damage between a mesh and a finer one.

use super::{few_step_run::FewStepRun, sizes::areas};
use crate::mesh::{Mesh, Refinement};

/// Per triangle: its share in the squared change ‖ζ_h − ζ_{h/2}‖² / ‖1 − ζ_{h/2}‖² at the end, and max |ζ_h − ζ_{h/2}|.
/// Collective.
pub(super) fn damage(
    mesh: &Mesh,
    finer: &Refinement,
    coarse: &FewStepRun,
    fine: &FewStepRun,
) -> [Vec<f64>; 2] {
    let mut before = at_vertices(mesh, &coarse.zeta());
    finer.halved_edges.iter().for_each(|&[a, b]| before.push(0.5 * (before[a] + before[b])));
    let mut largest = vec![0.0_f64; mesh.triangles.len()];
    let mut shares = largest.clone();
    let mesh = &finer.mesh;
    let now = at_vertices(mesh, &fine.zeta());
    let mut done = 0.0;
    let parts = mesh.triangles.iter().zip(&finer.parent_of_triangle).zip(areas(mesh));
    for ((nodes, &parent), area) in parts {
        for &node in nodes {
            let change = now[node] - before[node];
            shares[parent] += area * change * change;
            done += area * (1.0 - now[node]).powi(2);
            largest[parent] = largest[parent].max(change.abs());
        }
    }
    shares.iter_mut().for_each(|share| *share = if *share > 0.0 { *share / done } else { 0.0 });
    [shares, largest]
}

/// A field at the vertices of `mesh`, from its values on the triangles.
fn at_vertices(mesh: &Mesh, of_triangles: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut values = vec![0.0; mesh.nodes.len()];
    for (t, nodes) in mesh.triangles.iter().enumerate() {
        nodes.iter().zip(of_triangles).for_each(|(&node, of)| values[node] = of[t]);
    }
    values
}
