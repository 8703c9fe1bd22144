//! The changes of the damage and of u between a mesh and a finer one.

use super::{Answer, FewStepRun, sizes::areas};
use crate::{
    ROUNDING,
    fem::Triangle,
    mesh::{Mesh, Refinement},
};
use nalgebra::{Matrix3, Vector3};
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

/// ‖u_h − u_{h/2}‖ / ‖u_{h/2}‖ at the end in the energy norm, with u_h on the `mesh` that was bisected to `finer`. Collective.
///
/// On a triangle T, the difference e of the strains is affine: ∫ e eᵀ = |T|/12 (Σ e_i e_iᵀ + s sᵀ), with its values e_i at the
/// vertices and their sum s.
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
    let per_triangle = body.points_per_triangle();
    let square = |t: usize| {
        let parent = finer.parent_of_triangle[body.global_triangles[t]];
        let corners = mesh.triangles[parent].map(|node| mesh.nodes[node]);
        let gradients = *Triangle::new(corners).gradients();
        let difference = [0, 1, 2].map(|i| {
            let [x, y] = body.mesh.nodes[body.mesh.triangles[t][i]];
            // The strain of the parent at this place: Σ λ_j s_j, with λ_j = 1/3 + ∇λ_j · (x − centroid).
            let centroid = [0, 1].map(|k| corners.iter().map(|at| at[k]).sum::<f64>() / 3.0);
            let part = |[a, b]: [f64; 2]| 1.0 / 3.0 + a * (x - centroid[0]) + b * (y - centroid[1]);
            let strain = before[parent].iter().zip(gradients).map(|(of, g)| of * part(g));
            after[t][i] - strain.sum::<Vector3<f64>>()
        });
        let sum = difference.iter().sum::<Vector3<f64>>();
        let products = difference.iter().chain([&sum]).map(|e| e * e.transpose());
        let mean =
            zeta[per_triangle * t..][..per_triangle].iter().sum::<f64>() / per_triangle as f64;
        let products = products.sum::<Matrix3<f64>>() * (mean * body.triangles[t].area() / 12.0);
        elasticity.d(body, t).dot(&products)
    };
    let square = comm.total((0..body.own_triangles).map(square).sum::<f64>());
    if square == 0.0 { 0.0 } else { (square / size).sqrt() }
}
