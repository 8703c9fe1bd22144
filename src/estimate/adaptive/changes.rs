//! The change of the damage between a mesh and a finer one.

use super::{few_step_run::FewStepRun, finer::Finer, sizes::areas};
use crate::mesh::Mesh;

/// The final change ‖ζ_h − ζ_{h/2}‖ / ‖1 − ζ_{h/2}‖, and max |ζ_h − ζ_{h/2}| per triangle. Collective.
pub(super) fn damage(
    mesh: &Mesh,
    finer: &Finer,
    coarse: &FewStepRun,
    fine: &FewStepRun,
) -> (f64, Vec<f64>) {
    let before = finer.interpolated(at_vertices(mesh, &coarse.zeta()));
    let mut changes = vec![0.0_f64; mesh.triangles.len()];
    let mesh = &finer.mesh;
    let now = at_vertices(mesh, &fine.zeta());
    let mut sums = [0.0; 2];
    let parts = mesh.triangles.iter().zip(&finer.parents).zip(areas(mesh));
    for ((nodes, &parent), area) in parts {
        for &node in nodes {
            let change = now[node] - before[node];
            sums[0] += area * change * change;
            sums[1] += area * (1.0 - now[node]).powi(2);
            changes[parent] = changes[parent].max(change.abs());
        }
    }
    let relative = if sums[0] > 0.0 { (sums[0] / sums[1]).sqrt() } else { 0.0 };
    (relative, changes)
}

/// A field at the vertices of `mesh`, from its values on the triangles.
fn at_vertices(mesh: &Mesh, of_triangles: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut values = vec![0.0; mesh.nodes.len()];
    for (t, nodes) in mesh.triangles.iter().enumerate() {
        nodes.iter().zip(of_triangles).for_each(|(&node, of)| values[node] = of[t]);
    }
    values
}
