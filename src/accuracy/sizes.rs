//! The sizes of the triangles for an accuracy, and bisection down to these sizes.
//!
//! If the size of a triangle is multiplied by r, its error falls like r^p, with p the order, and 1/r² triangles
//! replace it. The minimum number of triangles for a given squared error Σ r_T^2p m_T has r_T ~ m_T^(−1/(2p+2)).

use crate::{
    fem::ON_SIDE,
    mesh::{Mesh, MeshError, Refinement, TIES, distance, twice_area},
};

/// Triangles are bisected while they are larger than this many times their wanted area; see [`oversize`].
///
/// Tuned on the 13 adapted runs. Half: 2.5 times as many triangles. Twice: 15 % fewer triangles, 16 % more meshes,
/// and a bar of six other bodies fails.
const OVERSIZE: f64 = 1.5;

/// The factors for the sizes of the triangles, so that the squared relative error Σ m_T (`shares`) becomes `aim`².
pub(super) fn size_ratios(shares: &[f64], order: i32, aim: f64) -> Vec<f64> {
    let order = f64::from(order);
    let exponent = 1.0 / (2.0 * order + 2.0);
    let ratio = |factor: f64, share: f64| match share {
        0.0 => 1.0,
        share => (factor / share.powf(exponent)).min(1.0),
    };
    let error = |factor: f64| -> f64 {
        shares.iter().map(|&share| ratio(factor, share).powf(2.0 * order) * share).sum()
    };
    let (mut low, mut high) = (0.0, shares.iter().copied().fold(0.0, f64::max).powf(exponent));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if error(middle) > aim * aim {
            high = middle;
        } else {
            low = middle;
        }
    }
    let cut = |ratio: f64| if ratio > TIES { 1.0 } else { ratio };
    shares.iter().map(|&share| cut(ratio(low, share))).collect()
}

/// The influences of the errors of u, from the shares m_T of their square, on u at `point` (`derivative` 0) or on a
/// derivative there (1).
///
/// The error of the figure is the sum over the triangles of the products of two errors in the energy norm: that of u,
/// m_T^½, and that of the displacements G under a force or a force dipole at the point. G's strains fall like
/// r^(−1−derivative), so its error on a triangle of size h is about h^(p+1)/r^(p+1+derivative), with r ≥ h.
pub(super) fn influences(
    mesh: &Mesh,
    shares: &[f64],
    order: i32,
    point: [f64; 2],
    derivative: i32,
) -> Vec<f64> {
    let influence = |((nodes, share), area): ((&[usize; 3], &f64), f64)| {
        let size = (2.0 * area).sqrt();
        let near = nodes.map(|node| distance(mesh.nodes[node], point));
        let distance = near.into_iter().fold(f64::INFINITY, f64::min).max(size);
        share.sqrt() * size.powi(order + 1) / distance.powi(order + 1 + derivative)
    };
    mesh.triangles.iter().zip(shares).zip(areas(mesh)).map(influence).collect()
}

/// Bisects the triangles until they are as small as `ratios` say.
pub(super) fn divided(mut refinement: Refinement, ratios: &[f64]) -> Result<Refinement, MeshError> {
    let (areas, oversize) = (areas(&refinement.mesh), oversize(ratios));
    let mut wanted: Vec<f64> =
        areas.iter().zip(ratios).map(|(a, r)| oversize * a * r * r).collect();
    loop {
        let areas = self::areas(&refinement.mesh);
        let marked: Vec<bool> = areas.iter().zip(&wanted).map(|(a, wanted)| a > wanted).collect();
        if !marked.contains(&true) {
            return Ok(refinement);
        }
        refinement = refinement.refine(&marked)?;
        wanted = refinement.parent_of_triangle.iter().map(|&parent| wanted[parent]).collect();
    }
}

/// Halves the triangles that touch a point `halvings` times, for each point.
pub(super) fn sharpened(
    mut refinement: Refinement,
    points: &[([f64; 2], usize)],
) -> Result<Refinement, MeshError> {
    let most = points.iter().map(|(_, halvings)| *halvings).max().unwrap_or(0);
    // Two bisections halve the size.
    for bisections in 0..2 * most {
        let left = points.iter().filter(|(_, halvings)| bisections < 2 * halvings);
        let left: Vec<[f64; 2]> = left.map(|(point, _)| *point).collect();
        refinement = refinement.refine(&touching(&refinement.mesh, &left))?;
    }
    Ok(refinement)
}

/// [`OVERSIZE`], or less if no triangle would be bisected, because a mesh that misses the accuracy must change.
/// Then the worse half of the triangles that are too large is bisected.
fn oversize(ratios: &[f64]) -> f64 {
    let mut squares: Vec<f64> = ratios.iter().map(|r| r * r).filter(|&r| r < 1.0).collect();
    squares.sort_by(f64::total_cmp);
    match squares.first() {
        Some(min) if OVERSIZE * min >= 1.0 => TIES / squares[(squares.len() - 1) / 2],
        _ => OVERSIZE,
    }
}

/// |T| of each triangle, with straight sides, m².
pub(super) fn areas(mesh: &Mesh) -> Vec<f64> {
    let corners = mesh.triangles.iter().map(|t| t.map(|node| mesh.nodes[node]));
    corners.map(|[a, b, c]| 0.5 * twice_area(a, b, c)).collect()
}

/// Per triangle: does it touch one of the points? A point outside all triangles, as beyond a chord, touches the nearest
/// ones.
pub(super) fn touching(mesh: &Mesh, points: &[[f64; 2]]) -> Vec<bool> {
    let mut touching = vec![false; mesh.triangles.len()];
    for &point in points {
        // The smallest barycentric coordinate of the point.
        let depth = |nodes: &[usize; 3]| {
            let [a, b, c] = nodes.map(|node| mesh.nodes[node]);
            let parts = [[a, b], [b, c], [c, a]].map(|[p, q]| twice_area(p, q, point));
            parts.into_iter().fold(f64::INFINITY, f64::min) / twice_area(a, b, c)
        };
        let depths: Vec<f64> = mesh.triangles.iter().map(depth).collect();
        let deepest = depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (touches, depth) in touching.iter_mut().zip(depths) {
            *touches |= depth >= deepest.min(0.0) - ON_SIDE;
        }
    }
    touching
}

/// The size of the largest triangle of `mesh` that touches `point`: the side of a square of twice its area, m.
pub(super) fn size_at(mesh: &Mesh, point: [f64; 2]) -> f64 {
    let here = touching(mesh, &[point]);
    let areas = areas(mesh).into_iter().zip(here).filter(|(_, touches)| *touches);
    areas.fold(0.0, |most, (area, _)| f64::max(most, 2.0 * area)).sqrt()
}
