//! The sums over the elements of the elasticity, for eight elements at a time in the lanes of the processor.

use crate::fem::{Body, Cells, Elasticity, Element, stiffness::ElementSums};
use nalgebra::Matrix2;
use std::{array::from_fn, iter::zip};
use wide::f64x8;

/// Elements of a group.
pub(super) const LANES: usize = 8;

/// The elements of a body, [`LANES`] in a group. For an isotropic A with the Lamé constants λ = D_12 and μ = D_33, a
/// quadrature point q of weight w contributes the stress
///
/// ```text
/// w σ = w ζ_q (λ tr ε I + 2μ ε),   ε = ½(∇u + ∇uᵀ).
/// ```
pub(crate) struct Groups<const N: usize, const Q: usize> {
    elasticity: Elasticity,
    groups: Vec<Group<N, Q>>,
    elements: usize,
}

/// Elements with N nodes and Q quadrature points. Lanes without an element have zeros.
struct Group<const N: usize, const Q: usize> {
    nodes: [[u32; LANES]; N],
    points: [Point<N>; Q],
}

struct Point<const N: usize> {
    gradients: [[f64x8; 2]; N],
    weight: f64x8,
    /// w ζ λ and w ζ μ.
    lambda: f64x8,
    mu: f64x8,
}

impl<const N: usize, const Q: usize> Groups<N, Q> {
    /// The elements, with ζ = 0.
    pub(crate) fn new(elasticity: &Elasticity, cells: Cells<N, Q>) -> Self {
        let group = |(nodes, elements): (&[[usize; N]], &[Element<N, Q>])| Group {
            nodes: from_fn(|i| from_fn(|lane| nodes.get(lane).map_or(0, |nodes| nodes[i] as u32))),
            points: from_fn(|q| {
                let lanes = |of: &dyn Fn(&Element<N, Q>) -> f64| -> f64x8 {
                    f64x8::from(from_fn(|lane| elements.get(lane).map_or(0.0, of)))
                };
                let gradient =
                    |i: usize, axis: usize| lanes(&|element| element.points[q].gradients[i][axis]);
                Point {
                    gradients: from_fn(|i| from_fn(|axis| gradient(i, axis))),
                    weight: lanes(&|element| element.points[q].weight),
                    lambda: f64x8::ZERO,
                    mu: f64x8::ZERO,
                }
            }),
        };
        let groups = zip(cells.nodes.chunks(LANES), cells.elements.chunks(LANES)).map(group);
        Self {
            elasticity: elasticity.clone(),
            groups: groups.collect(),
            elements: cells.elements.len(),
        }
    }
}

impl<const N: usize, const Q: usize> ElementSums for Groups<N, Q> {
    fn set(&mut self, body: &Body, zeta: &[f64], diagonal: &mut [[f64; 3]]) {
        let zeta = zeta.as_chunks::<Q>().0.chunks(LANES);
        for (g, (Group { nodes, points }, zeta)) in zip(&mut self.groups, zeta).enumerate() {
            let mut blocks = [[f64x8::ZERO; 3]; N];
            for (q, Point { gradients, weight, lambda, mu }) in points.iter_mut().enumerate() {
                let [mut of_lambda, mut of_mu] = [[0.0; LANES]; 2];
                for (lane, zeta) in zeta.iter().enumerate() {
                    let d = self.elasticity.d(body, LANES * g + lane);
                    (of_lambda[lane], of_mu[lane]) = (zeta[q] * d[(0, 1)], zeta[q] * d[(2, 2)]);
                }
                (*lambda, *mu) = (*weight * f64x8::from(of_lambda), *weight * f64x8::from(of_mu));
                let sum = *lambda + *mu;
                for ([xx, xy, yy], [x, y]) in zip(&mut blocks, gradients) {
                    let (x_x, x_y, y_y) = (*x * *x, *x * *y, *y * *y);
                    let both = *mu * (x_x + y_y);
                    (*xx, *xy, *yy) =
                        (*xx + (sum * x_x + both), *xy + sum * x_y, *yy + (sum * y_y + both));
                }
            }
            for (nodes, block) in zip(nodes, blocks) {
                let [xx, xy, yy] = block.map(f64x8::to_array);
                for (lane, &node) in nodes.iter().enumerate() {
                    let sums = &mut diagonal[node as usize];
                    *sums = [sums[0] + xx[lane], sums[1] + xy[lane], sums[2] + yy[lane]];
                }
            }
        }
    }

    fn add_forces(&self, u: &[f64], force: &mut [f64]) {
        let (u, force) = (u.as_chunks::<2>().0, force.as_chunks_mut::<2>().0);
        for Group { nodes, points } in &self.groups {
            let u: [[f64x8; 2]; N] = from_fn(|i| {
                let of_nodes = nodes[i].map(|node| u[node as usize]);
                from_fn(|axis| f64x8::from(of_nodes.map(|u| u[axis])))
            });
            let mut forces = [[f64x8::ZERO; 2]; N];
            for Point { gradients, lambda, mu, .. } in points {
                let [mut xx, mut yy, mut xy] = [f64x8::ZERO; 3];
                for ([dx, dy], [ux, uy]) in zip(gradients, &u) {
                    (xx, yy, xy) = (xx + *dx * *ux, yy + *dy * *uy, xy + (*dy * *ux + *dx * *uy));
                }
                let (pressure, twice) = (*lambda * (xx + yy), *mu + *mu);
                let (xx, yy, xy) = (pressure + twice * xx, pressure + twice * yy, *mu * xy);
                for ([fx, fy], [dx, dy]) in zip(&mut forces, gradients) {
                    (*fx, *fy) = (*fx + (*dx * xx + *dy * xy), *fy + (*dy * yy + *dx * xy));
                }
            }
            for (nodes, forces) in zip(nodes, forces) {
                let [fx, fy] = forces.map(f64x8::to_array);
                for (lane, &node) in nodes.iter().enumerate() {
                    let [x, y] = force[node as usize];
                    force[node as usize] = [x + fx[lane], y + fy[lane]];
                }
            }
        }
    }

    fn for_blocks(&self, add: &mut dyn FnMut([usize; 2], [usize; 2], Matrix2<f64>)) {
        for (g, group) in self.groups.iter().enumerate() {
            for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
                let [xx, xy, yx, yy] = group.block(i, j).map(f64x8::to_array);
                for lane in 0..LANES.min(self.elements - LANES * g) {
                    let pair = |i, j| N * (N * (LANES * g + lane) + i) + j;
                    let nodes = [i, j].map(|i| group.nodes[i][lane] as usize);
                    let block = Matrix2::new(xx[lane], xy[lane], yx[lane], yy[lane]);
                    add([pair(i, j), pair(j, i)], nodes, block);
                }
            }
        }
    }
}

impl<const N: usize, const Q: usize> Group<N, Q> {
    /// K_ij of the elements, (xx, xy, yx, yy): Σ_q w ζ (λ ∇φ_i ∇φ_jᵀ + μ ∇φ_j ∇φ_iᵀ + μ ∇φ_i·∇φ_j I).
    #[inline(always)]
    fn block(&self, i: usize, j: usize) -> [f64x8; 4] {
        let mut sums = [f64x8::ZERO; 4];
        for Point { gradients, lambda, mu, .. } in &self.points {
            let ([x, y], [p, q]) = (gradients[i], gradients[j]);
            let (xp, xq, yp, yq) = (x * p, x * q, y * p, y * q);
            let both = *mu * (xp + yq);
            let sum = *lambda + *mu;
            let terms = [
                sum * xp + both,
                *lambda * xq + *mu * yp,
                *lambda * yp + *mu * xq,
                sum * yq + both,
            ];
            sums = from_fn(|k| sums[k] + terms[k]);
        }
        sums
    }
}
