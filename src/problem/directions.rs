//! Stresses of degree 0 at a corner: they depend on the direction and not on the distance.
//!
//! Surface loads f⁻ and f⁺ on the sides of a corner, and prescribed strains of its sides, cause u_r = r U, u_θ = r V + ω r ln r with
//! functions U and V of the angle θ. The rotation ω r is a solution without loads, so that only one of the equations z′ = A(1) z of
//! [`super::singular`] changes, by 2ε_rθ = U′ + ω:
//!
//! U′ = σ_rθ/μ − ω.
//!
//! With z(α) = T z(0) + ω t, the conditions of the sides are B z(0) = B z⁻ and C (T z(0) + ω t) = C z⁺. The vectors z⁻ and z⁺ have the
//! loads and the strains of the sides. A side that resists rotations has no ω. For one material these are the stresses of
//! Airy's function r² (a + bθ + c cos 2θ + d sin 2θ).
//!
//! - Without a solution, stresses grow like ln r.
//! - With one solution up to a rotation, its stresses are those of the body at the corner. Damage does not change them: ζ is
//!   continuous, so that it multiplies the stiffness of all sectors.
//! - With more solutions, as on a smooth side under any tension along it, other loads determine the sum.

use super::singular::{SEEN, Sector};
use crate::scene::{Condition, Expression, Scene};
use nalgebra::{
    Matrix2x4, Matrix4x5, Matrix5, RowVector5, SMatrix, SVector, Vector2, Vector4, Vector5,
};
use std::f64::consts::{PI, TAU};

/// Parts of each sector between directions.
const RAYS: usize = 256;

/// A corner of the boundary at which stresses are not singular for their exponents λ.
#[derive(Debug, Clone)]
pub(crate) struct Corner {
    /// The vertex in the undivided mesh, and its place, m.
    pub(crate) node: usize,
    pub(crate) at: [f64; 2],
    /// Counter-clockwise from the first side to the last one.
    pub(super) sectors: Vec<Sector>,
    pub(super) sides: [Side; 2],
}

/// A side of a corner.
#[derive(Debug, Clone)]
pub(super) struct Side {
    /// The other end of its edge, m.
    pub(super) end: [f64; 2],
    /// The angle, rad, at which it leaves the corner.
    pub(super) angle: f64,
    /// The rows of its conditions, see [`super::singular`]: on Γ_C first those of closed contact.
    pub(super) rows: Vec<Matrix2x4<f64>>,
    /// The numbers of its boundaries in the scene.
    pub(super) boundaries: Vec<usize>,
}

/// The material in a direction, and (σ_xx, σ_yy, σ_xy) there, Pa.
pub type Ray = (usize, [f64; 3]);

/// The effect of the loads on the stresses at a corner.
#[derive(Debug, Clone)]
pub(crate) enum Effect {
    /// Stresses are continuous.
    Regular,
    /// Stresses grow like ln r.
    Singular,
    /// Stresses depend on the direction. Per direction: the material, and (σ_xx, σ_yy, σ_xy), Pa; `None` if the loads on the sides do
    /// not determine them.
    ByDirection(Option<Vec<Ray>>),
}

impl Corner {
    /// Is one of its sides on Γ_C?
    pub(crate) fn may_open(&self) -> bool {
        self.sides.iter().any(|side| side.rows.len() > 1)
    }

    /// The effect of the loads of `scene` at time t, with contact closed or open at the corner.
    pub(crate) fn effect(&self, scene: &Scene, t: f64, is_closed: bool) -> Effect {
        let values = [0, 1].map(|i| self.sides[i].values(self.at, scene, t, i == 1));
        self.effect_of(values, is_closed)
    }

    /// The effect of the values (ε_rr, u_θ/r, σ_rθ, σ_θθ) of both sides, as far as conditions prescribe them.
    pub(super) fn effect_of(&self, mut values: [Vector4<f64>; 2], is_closed: bool) -> Effect {
        let unit: f64 = self.sectors.iter().map(|sector| sector.stiffness[(2, 2)]).sum();
        values.iter_mut().for_each(|of| of.rows_mut(2, 2).unscale_mut(unit));
        let rows = self
            .sides
            .each_ref()
            .map(|side| side.rows[if is_closed { 0 } else { side.rows.len() - 1 }]);
        let wanted = [0, 1].map(|i| rows[i] * values[i]);
        let size = wanted[0].norm().hypot(wanted[1].norm());
        if size == 0.0 {
            return Effect::Regular;
        }
        let transfer = self.sectors.iter().fold(Matrix5::identity(), |transfer, sector| {
            (sector.system_of_degree_0(unit) * sector.angle).exp() * transfer
        });
        let solution = solve(rows, &transfer, wanted);
        let Some((start, is_determined)) = solution else { return Effect::Singular };
        let rays = self.rays(start, unit);
        let largest =
            rays.iter().flat_map(|(_, stress)| stress).fold(0.0, |a: f64, b| a.max(b.abs()));
        let changes = |(a, b): (&Ray, &Ray)| {
            a.0 == b.0 && (0..3).any(|k| (a.1[k] - b.1[k]).abs() > SEEN * largest)
        };
        let first = |material| rays.iter().find(|ray| ray.0 == material).unwrap_or(&rays[0]);
        match rays.iter().any(|ray| changes((ray, first(ray.0)))) {
            true => Effect::ByDirection(is_determined.then_some(rays)),
            false => Effect::Regular,
        }
    }

    /// The number of the direction of a point among the [`RAYS`] of each sector.
    pub(crate) fn direction(&self, [x, y]: [f64; 2]) -> usize {
        let all: f64 = self.sectors.iter().map(|sector| sector.angle).sum();
        let angle = (y - self.at[1]).atan2(x - self.at[0]) - self.sides[0].angle;
        // A point of the first side may lie at an angle of −ε.
        let mut left = (angle - 0.5 * all + PI).rem_euclid(TAU) - PI + 0.5 * all;
        let mut first = 0;
        for sector in &self.sectors[..self.sectors.len() - 1] {
            if left < sector.angle {
                break;
            }
            (left, first) = (left - sector.angle, first + RAYS + 1);
        }
        let angle = self.sectors[first / (RAYS + 1)].angle;
        first + (RAYS as f64 * (left / angle).clamp(0.0, 1.0)).round() as usize
    }

    /// The stresses in many directions, from z and ω on the first side.
    fn rays(&self, start: Vector5<f64>, unit: f64) -> Vec<Ray> {
        let (mut z, mut angle, mut rays) = (start, self.sides[0].angle, Vec::new());
        for sector in &self.sectors {
            let step = (sector.system_of_degree_0(unit) * (sector.angle / RAYS as f64)).exp();
            let [d, nu_d] = [(0, 0), (0, 1)].map(|entry| sector.stiffness[entry] / unit);
            let nu = nu_d / d;
            for ray in 0..=RAYS {
                let [shear, hoop] = [z[2], z[3]];
                let radial = d * (1.0 - nu * nu) * z[0] + nu * hoop;
                let (s, c) = angle.sin_cos();
                rays.push((
                    sector.material,
                    [
                        radial * c * c + hoop * s * s - 2.0 * shear * s * c,
                        radial * s * s + hoop * c * c + 2.0 * shear * s * c,
                        (radial - hoop) * s * c + shear * (c * c - s * s),
                    ]
                    .map(|stress| unit * stress),
                ));
                if ray < RAYS {
                    (z, angle) = (step * z, angle + sector.angle / RAYS as f64);
                }
            }
        }
        rays
    }
}

/// The least squares solution (z(0), ω) of the conditions, and is it the only one up to a rotation? `None` without a solution.
fn solve(
    rows: [Matrix2x4<f64>; 2],
    transfer: &Matrix5<f64>,
    wanted: [Vector2<f64>; 2],
) -> Option<(Vector5<f64>, bool)> {
    /// Singular values below this part of the largest one are zero.
    const ZERO: f64 = 1e-6;
    let (mut matrix, mut values) = (SMatrix::<f64, 9, 5>::zeros(), SVector::<f64, 9>::zeros());
    let at_ends = [Matrix4x5::identity(), transfer.fixed_rows::<4>(0).into_owned()];
    let turn = [0, 1].map(|i| rows[i].column(1).into_owned());
    for i in 0..2 {
        matrix.fixed_rows_mut::<2>(2 * i).copy_from(&(rows[i] * at_ends[i]));
        values.fixed_rows_mut::<2>(2 * i).copy_from(&wanted[i]);
        matrix.fixed_view_mut::<2, 1>(4 + 2 * i, 4).copy_from(&turn[i]);
    }
    if turn[0].norm().max(turn[1].norm()) < ZERO {
        matrix.set_row(8, &RowVector5::new(0.0, 1.0, 0.0, 0.0, 0.0));
    }
    for i in 0..9 {
        let norm = matrix.row(i).norm();
        if norm > ZERO {
            matrix.row_mut(i).unscale_mut(norm);
            values[i] /= norm;
        }
    }
    // A column of rounding belongs to a solution without loads.
    let norms = matrix.column_iter().map(|column| column.norm());
    let norms = Vec::from_iter(norms.map(|norm| if norm > ZERO { norm } else { 1.0 }));
    (0..5).for_each(|k| matrix.column_mut(k).unscale_mut(norms[k]));
    let svd = matrix.svd(true, true);
    let zero = ZERO * svd.singular_values.max();
    let mut solution = svd.solve(&values, zero).ok()?;
    let residual = (matrix * solution - values).norm();
    (0..5).for_each(|k| solution[k] /= norms[k]);
    (residual <= SEEN * values.norm()).then_some((solution, svd.singular_values.min() > zero))
}

impl Side {
    /// The values of the side at time t, as far as conditions prescribe them: of loads (0, 0, σ_rθ, σ_θθ), Pa, and of displacements
    /// (ε_rr, u_θ/r, 0, 0) without their value at the corner. They are limits at the corner, by two points near it.
    fn values(&self, corner: [f64; 2], scene: &Scene, t: f64, is_last: bool) -> Vector4<f64> {
        /// The distance of the nearer point, over the length of the edge.
        const TO_LIMIT: f64 = 1e-5;
        let edge = [0, 1].map(|k| self.end[k] - corner[k]);
        let at = |part: f64| {
            let [x, y] = [0, 1].map(|k| corner[k] + part * edge[k]);
            let length = part * edge[0].hypot(edge[1]);
            let slope = |u: &Option<Expression>| {
                let change = |u: &Expression| u.eval(x, y, t) - u.eval(corner[0], corner[1], t);
                u.as_ref().map_or(0.0, |u| change(u) / length)
            };
            let value = |condition: &Condition| match condition {
                Condition::Load(load) => {
                    self.of_traction(load.at([x, y], self.normal(is_last), t), is_last)
                }
                Condition::Displacement(u) => {
                    let [r, theta] = self.polar(u.each_ref().map(slope));
                    Vector4::new(r, theta, 0.0, 0.0)
                }
                Condition::Symmetry | Condition::Gap(_) => Vector4::zeros(),
            };
            let boundaries = self.boundaries.iter().map(|&number| &scene.boundaries[number]);
            boundaries.flat_map(|of| &of.conditions).map(value).sum::<Vector4<f64>>()
        };
        2.0 * at(TO_LIMIT) - at(2.0 * TO_LIMIT)
    }

    /// (0, 0, σ_rθ, σ_θθ), Pa, of a traction on the side, Pa.
    pub(super) fn of_traction(&self, traction: [f64; 2], is_last: bool) -> Vector4<f64> {
        let sign = if is_last { 1.0 } else { -1.0 };
        let [r, theta] = self.polar(traction);
        Vector4::new(0.0, 0.0, sign * r, sign * theta)
    }

    /// The outward normal.
    pub(super) fn normal(&self, is_last: bool) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        if is_last { [-s, c] } else { [s, -c] }
    }

    /// The components of a vector in the directions of r and θ.
    fn polar(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        [x * c + y * s, y * c - x * s]
    }
}
