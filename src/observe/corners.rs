//! The corners at which stresses depend on the direction.
//!
//! In the triangles around such a corner u_h is as wrong on a fine mesh as on a coarse one: stresses overshoot at its own scale. Theory
//! knows the stress f(θ) in each direction, and its extreme F. Fits from these triangles do not count. Their errors fall at
//! least like h/r with the distance r from the corner and the longest edge h at a point. With C = max |f_h − f(θ)| r/h over the
//! points in these triangles, a stress elsewhere counts only beyond F + C h/r.

use super::{NodalStress, ObservedProblem, nodal_stress::Point, principal};
use crate::{
    model::von_mises,
    problem::{Corner, Effect, Ray, State},
};
use nalgebra::Vector3;
use rustc_hash::FxHashSet as HashSet;
use std::sync::OnceLock;

/// A corner.
#[derive(Debug)]
pub(super) struct LoadedCorner {
    corner: Corner,
    /// Per point of this rank, of both lists of [`NodalStress`]: does its stress come from fits in the triangles at the corner or next to them?
    near: OnceLock<Vec<bool>>,
}

/// The stresses in many directions at a corner.
pub struct Rays<'a> {
    /// The corner, m.
    pub at: [f64; 2],
    /// Per direction: the material, and (σ_xx, σ_yy, σ_xy), Pa; `None` if other loads than those on the sides determine them.
    pub stresses: Option<Vec<Ray>>,
    of: &'a LoadedCorner,
}

/// The extremes over the directions at a corner.
pub(super) struct Known<'a> {
    pub(crate) at: [f64; 2],
    /// Per material: F of the von Mises stress, σ₁ and −σ₂, Pa; −∞ if it is not at the corner.
    pub(super) extremes: Vec<[f64; 3]>,
    /// Per material: C of the same, Pa.
    excess: Vec<[f64; 3]>,
    near: &'a [bool],
}

/// The von Mises stress, σ₁ and −σ₂ of (σ_xx, σ_yy, σ_xy, σ_zz), Pa.
pub(super) fn sizes(stress: [f64; 4]) -> [f64; 3] {
    let [most, least] = principal(stress);
    [von_mises(stress), most, -least]
}

impl ObservedProblem {
    /// The corners at which stresses depend on the direction in a `state`. Collective.
    pub fn rays(&self, state: &State) -> Vec<Rays<'_>> {
        let corners = self.corners.get_or_init(|| {
            let new = |corner| LoadedCorner { corner, near: OnceLock::new() };
            self.problem.corners().1.iter().cloned().map(new).collect()
        });
        let active = state.of_contact().filter(|of| of.active);
        let active = Vec::from_iter(active.map(|of| self.body.nodes.points[of.node]));
        let rays = |of: &'_ LoadedCorner| {
            let at = of.corner.at;
            let is_closed = of.corner.may_open() && self.body.comm().any(active.contains(&at));
            match of.corner.effect(self.scene(), state.time, is_closed) {
                Effect::ByDirection(stresses) => Some((at, stresses)),
                _ => None,
            }
        };
        let found = corners.iter().filter_map(|of| Some((of, rays(of)?)));
        found.map(|(of, (at, stresses))| Rays { at, stresses, of }).collect()
    }
}

impl Known<'_> {
    /// The corners with known extremes, where `sizes_at` gives the [`sizes`] of the fits at the point with a number. Collective.
    pub(super) fn all<'a>(
        problem: &ObservedProblem,
        rays: &'a [Rays],
        sizes_at: impl Fn(usize) -> [f64; 3],
    ) -> Vec<Known<'a>> {
        let nodal = problem.nodal_stress();
        let known = |rays: &'a Rays| {
            let mut extremes = vec![[f64::NEG_INFINITY; 3]; nodal.materials.len()];
            let (mut by_direction, stresses) = (Vec::new(), rays.stresses.as_ref()?);
            for &(material, [xx, yy, xy]) in stresses {
                let zz = nodal.materials[material].0.out_of_plane(&Vector3::new(xx, yy, xy));
                let of = sizes([xx, yy, xy, zz]);
                (0..3).for_each(|k| extremes[material][k] = of[k].max(extremes[material][k]));
                by_direction.push(of);
            }
            // Between directions an extreme is that of a parabola through three of them.
            for (sizes, rays) in by_direction.windows(3).zip(stresses.windows(3)) {
                for k in (0..3).filter(|_| rays[0].0 == rays[2].0) {
                    let [before, own, after]: [f64; 3] = [0, 1, 2].map(|i| sizes[i][k]);
                    if own > before.max(after) {
                        let bend = 2.0 * own - before - after;
                        let largest = own + (after - before).powi(2) / (8.0 * bend);
                        extremes[rays[0].0][k] = largest.max(extremes[rays[0].0][k]);
                    }
                }
            }
            let mut excess = vec![[0.0; 3]; extremes.len()];
            let near = rays.near(problem);
            for (i, point) in nodal.points.iter().enumerate().filter(|(i, _)| near[*i]) {
                let (own, exact) = (sizes_at(i), by_direction[rays.of.corner.direction(point.at)]);
                let size = nodal.relative_size(point, rays.at);
                for k in 0..3 {
                    let error = (own[k] - exact[k]).abs() / size;
                    excess[point.material][k] = error.max(excess[point.material][k]);
                }
            }
            let comm = problem.body.comm();
            excess.as_flattened_mut().iter_mut().for_each(|of| *of = comm.max(*of));
            Some(Known { at: rays.at, extremes, excess, near })
        };
        rays.iter().filter_map(known).collect()
    }

    /// Is the point of this rank with the number `i` next to the corner, in a material of the corner?
    pub(super) fn is_near(&self, i: usize, point: &Point) -> bool {
        self.near[i] && self.extremes[point.material][0] > f64::NEG_INFINITY
    }

    /// Does the value number `k` of the [`sizes`] at this point exceed what the corner causes?
    pub(super) fn is_exceeded(
        &self,
        nodal: &NodalStress,
        point: &Point,
        k: usize,
        value: f64,
    ) -> bool {
        let [extreme, excess] = [&self.extremes, &self.excess].map(|of| of[point.material][k]);
        extreme == f64::NEG_INFINITY
            || value > extreme + excess * nodal.relative_size(point, self.at)
    }
}

impl Rays<'_> {
    /// Per point of this rank: is it next to the corner?
    pub(crate) fn near(&self, problem: &ObservedProblem) -> &[bool] {
        self.of.near.get_or_init(|| {
            let (mesh, nodal) = (problem.mesh(), problem.nodal_stress());
            let mut vertices = HashSet::from_iter([self.of.corner.node]);
            for _ in 0..2 {
                let triangles = mesh.triangles.iter();
                let here = triangles.filter(|of| of.iter().any(|v| vertices.contains(v)));
                vertices.extend(Vec::from_iter(here.flatten().copied()));
            }
            let bits = |at: [f64; 2]| at.map(f64::to_bits);
            let places: HashSet<_> = vertices.into_iter().map(|v| bits(mesh.nodes[v])).collect();
            let is_near = |point| nodal.ends_of(point).iter().any(|&at| places.contains(&bits(at)));
            nodal.all().map(is_near).collect()
        })
    }
}
