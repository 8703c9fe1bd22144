//! The change of the damage between a mesh and a finer one.

use super::{sequence::Level, sizes::areas};
use crate::mesh::Refinement;
use std::collections::HashMap;

/// Per triangle of the mesh that was bisected to `finer`: its share in the squared change ‖ζ_h − ζ_{h/2}‖² / ‖1 − ζ_{h/2}‖² at
/// the end, and max |ζ_h − ζ_{h/2}|. ζ_h is the answer on the bisected mesh, or on a refinement of it: on an edge that this one does
/// not halve, it is affine.
pub(super) fn damage(coarse: &Level, finer: &Refinement, fine: &Level) -> [Vec<f64>; 2] {
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
            shares[parent] += area * change * change;
            done += area * (1.0 - fine.zeta[node]).powi(2);
            largest[parent] = largest[parent].max(change.abs());
        }
    }
    shares.iter_mut().for_each(|share| *share = if *share > 0.0 { *share / done } else { 0.0 });
    [shares, largest]
}
