//! Changes of figures and fields between a mesh and a finer one.

use super::{
    few_step_run::{FewStepRun, INSTANTS},
    finer::Finer,
    sizes::areas,
};
use crate::{
    mesh::Mesh,
    problem::{Bar, Dimension},
};

/// Error over change of the damage in L². No signs cancel there, and adapted meshes reach second order. On five
/// bodies, a bar fails with half of it and with twice, with which meshes have twice as many triangles.
const FIELD_ERROR_OVER_CHANGE: f64 = 4.0 / 3.0;

/// The relative error of u at the end, without damage, from the change of the potential energy J = ½‖u‖² − fᵀu.
///
/// The minima over nested spaces obey ½‖u_h − u_{h/2}‖² ≤ J(u_h) − J(u_{h/2}), with equality if no contact opens or
/// closes. For order 1, ‖u_h − u‖² is 4/3 of ‖u_h − u_{h/2}‖².
pub(super) fn change_of_u(coarse: &FewStepRun, fine: &FewStepRun) -> f64 {
    if coarse.problem.damage().is_some() {
        return 0.0;
    }
    let [before, now] = [coarse, fine].map(|run| {
        let ([energy, largest], work) = (run.energies(), run.outcome.last.record.work);
        (0.5 * energy - work, largest)
    });
    let square = 2.0 * (before.0 - now.0).max(0.0) / now.1;
    if square > 0.0 { (4.0 / 3.0 * square).sqrt() } else { 0.0 }
}

/// The error bars of the figures on the mesh of `coarse`: `factor` times their changes. Extremes move from place to
/// place, so only their change at the end counts; those that `grows` names have no bars.
pub(super) fn bars(
    coarse: &FewStepRun,
    fine: &FewStepRun,
    factor: f64,
    grows: &[String],
) -> Vec<Bar> {
    let end = coarse.outcome.last.state.time;
    let change_at = |i: usize| -> Vec<f64> {
        let (time, before) = coarse.figures_from(end * i as f64 / INSTANTS as f64);
        let (_, now) = fine.figures_from(*time);
        now.iter().zip(before).map(|(now, before)| now - before).collect()
    };
    let changes: Vec<Vec<f64>> = (0..=INSTANTS).map(change_at).collect();
    let change = |i: usize| {
        let squares: f64 = changes.iter().map(|change| change[i] * change[i]).sum();
        (squares / changes.len() as f64).sqrt().max(changes[INSTANTS][i].abs())
    };
    let mut errors: Vec<f64> = (0..changes[0].len()).map(change).collect();
    let [before, now] = [coarse, fine].map(|run| run.extremes().values());
    errors.extend(now.iter().zip(before).map(|(now, before)| (now - before).abs()));
    errors.iter_mut().for_each(|error| *error *= factor);
    let mut bars = coarse.problem.bars(&errors, &fine.scales(grows));
    bars.retain(|bar| !grows.contains(&bar.name));
    // η².
    let square = coarse.relative().0.powi(2);
    for bar in &mut bars {
        bar.bar = match bar.dimension {
            Dimension::Work | Dimension::Length | Dimension::Stress => {
                bar.bar.max(0.1 * square * bar.scale)
            }
            // A change within the open parts is no error beyond them.
            Dimension::ContactLength => {
                let open = coarse.open_length();
                open + (bar.bar - factor * open).max(0.0)
            }
            _ => bar.bar,
        };
    }
    coarse.extremes().join(&mut bars);
    bars
}

/// The final error ‖ζ_h − ζ_{h/2}‖ / ‖1 − ζ_{h/2}‖, and max |ζ_h − ζ_{h/2}| per triangle. Collective.
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
    (FIELD_ERROR_OVER_CHANGE * relative, changes)
}

/// A field at the vertices of `mesh`, from its values on the triangles.
fn at_vertices(mesh: &Mesh, of_triangles: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut values = vec![0.0; mesh.nodes.len()];
    for (t, nodes) in mesh.triangles.iter().enumerate() {
        nodes.iter().zip(of_triangles).for_each(|(&node, of)| values[node] = of[t]);
    }
    values
}
