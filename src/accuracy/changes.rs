//! The changes of the damage and of u between a mesh and a finer one.

use super::{Answer, FewStepRun, sizes::areas};
use crate::{
    ROUNDING,
    estimate::mass,
    fem::quadratic_values,
    mesh::{Mesh, Refinement},
};
use nalgebra::{Matrix6x3, Vector3};
use std::collections::HashMap;

/// Per triangle of the mesh that was bisected to `finer`: its share in the squared change ‖ζ_h − ζ_{h/2}‖² / ‖1 − ζ_{h/2}‖² at
/// the end, and max |ζ_h − ζ_{h/2}|. ζ_h is the answer on the bisected mesh, or on a refinement of it: on an edge that this one does
/// not halve, it is affine.
pub(super) fn damage(coarse: &Answer, finer: &Refinement, fine: &Answer) -> [Vec<f64>; 2] {
    let place = |node: &[f64; 2]| node.map(f64::to_bits);
    let known: HashMap<_, _> = coarse.mesh.nodes.iter().map(place).zip(&coarse.zeta).collect();
    let old = finer.mesh.nodes.len() - finer.halved_edges.len();
    let mut before = coarse.zeta[..old].to_vec();
    for ([a, b], node) in finer.halved_edges.iter().zip(&finer.mesh.nodes[old..]) {
        let middle = 0.5 * (before[*a] + before[*b]);
        before.push(known.get(&place(node)).map_or(middle, |zeta| **zeta));
    }
    let triangles = finer.parent_of_triangle.iter().max().map_or(0, |last| last + 1);
    let (mut shares, mut largest) = (vec![0.0; triangles], vec![0.0_f64; triangles]);
    let mut done = 0.0;
    let parts = finer.mesh.triangles.iter().zip(&finer.parent_of_triangle).zip(areas(&finer.mesh));
    for ((nodes, &parent), area) in parts {
        for &node in nodes {
            let change = fine.zeta[node] - before[node];
            // Rounding, where there is no damage, is no error.
            let change = if change.abs() <= ROUNDING { 0.0 } else { change };
            shares[parent] += area * change * change;
            done += area * (1.0 - fine.zeta[node]).powi(2);
            largest[parent] = largest[parent].max(change.abs());
        }
    }
    shares.iter_mut().for_each(|share| *share = if *share == 0.0 { 0.0 } else { *share / done });
    [shares, largest]
}

/// The change of ζ at the node of its minimum if the lumped mass takes the place of the consistent one, which overshoots at a jump of ζ.
/// With the triangles T = ijk at the node i,
///
/// |(M_L⁻¹Mζ)_i − ζ_i| = |Σ_T |T| (ζ_j + ζ_k − 2ζ_i)| / (4 Σ_T |T|).
pub(super) fn overshoot(Answer { mesh, zeta, .. }: &Answer) -> f64 {
    let weakest = (0..zeta.len()).min_by(|i, k| zeta[*i].total_cmp(&zeta[*k]));
    let (mut sum, mut weight) = (0.0, 0.0);
    for (nodes, area) in mesh.triangles.iter().zip(areas(mesh)) {
        if let Some(i) = weakest.filter(|i| nodes.contains(i)) {
            sum += area * nodes.iter().map(|&k| zeta[k] - zeta[i]).sum::<f64>();
            weight += 4.0 * area;
        }
    }
    (sum / weight).abs()
}

/// ‖u_h − u_{h/2}‖ / ‖u_{h/2}‖ at the end in the energy norm, with u_h on the `mesh` that was bisected to `finer`. Collective.
///
/// On a triangle, the difference of the strains is the quadratic function of its values at the vertices and the midpoints.
/// Places of both meshes are compared by λ in the triangle of the `mesh`.
pub(super) fn displacement(
    coarse: &FewStepRun,
    mesh: &Mesh,
    finer: &Refinement,
    fine: &FewStepRun,
) -> f64 {
    let (before, after, size) = (coarse.strains(), fine.own_strains(), fine.energy());
    let (problem, comm) = (fine.problem, fine.problem.body.comm());
    let (body, elasticity) = (&problem.body, &problem.elasticity);
    let zeta = problem.zeta_at_points(&fine.outcome.last.state.zeta);
    let (per_triangle, old) = (body.points_per_triangle(), mesh.nodes.len());
    let square = |t: usize| {
        let triangle = body.global_triangles[t];
        let parent = finer.parent_of_triangle[triangle];
        let [a, b, c] = finer.mesh.triangles[triangle].map(|node| {
            let ends = node.checked_sub(old).map_or([node; 2], |new| finer.halved_edges[new]);
            let part = |corner| ends.iter().filter(|end| **end == corner).count() as f64 / 2.0;
            Vector3::from(mesh.triangles[parent].map(part))
        });
        let places = [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let difference = [0, 1, 2, 3, 4, 5].map(|i| {
            let values = quadratic_values(places[i].into()).into_iter().zip(before[parent]);
            let strain = values.map(|(value, strain)| strain * value).sum::<Vector3<f64>>();
            (after[t][i] - strain).transpose()
        });
        let difference = Matrix6x3::from_rows(&difference);
        let mean =
            zeta[per_triangle * t..][..per_triangle].iter().sum::<f64>() / per_triangle as f64;
        let products = difference.transpose() * mass() * difference;
        elasticity.d(body, t).dot(&products) * mean * body.triangles[t].area()
    };
    let square = comm.total((0..body.own_triangles).map(square).sum::<f64>());
    if square == 0.0 { 0.0 } else { (square / size).sqrt() }
}
