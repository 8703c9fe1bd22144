//! Better tractions: the least ‖τ − σ_h‖ in one star after the other.
//!
//! A stress without forces has an Airy function φ, σ_xx = φ_yy, σ_yy = φ_xx, σ_xy = −φ_xy. With G = (φ_y, −φ_x) its traction on
//! a side is dG/ds, so the forces on a side from a to b are ∫ τn ψ_a = Ḡ − G_a and ∫ τn ψ_b = G_b − Ḡ, with the mean Ḡ on the
//! side. The stresses of the composite element with k = 1 are those of the functions of Clough and Tocher: φ and ∇φ at the
//! vertices and the mean of the normal derivative on each side determine φ. In each star, φ and ∇φ at its vertex and the mean
//! normal derivatives on the sides at the vertex are free, and for k = 2 also the bubbles of the tractions on these sides.

use super::{
    composite::{Composite, Frame, SideForces},
    stars::{BoundaryEdge, Star, StressedTriangle},
};
use crate::mesh::sorted;
use nalgebra::{DMatrix, DVector, SMatrix, Vector2};
use rustc_hash::FxHashMap as HashMap;

/// The triangles, the stars, and the edges of the boundary. None of them changes.
type Known<'a> = (&'a [StressedTriangle], &'a [Star], &'a HashMap<[usize; 2], BoundaryEdge>);

/// Improves the tractions in the stars that are wanted, one after the other. The numbers are those of [`Composite`] and C = 4k + 1, the
/// functions in a triangle.
pub(super) fn improve<const R: usize, const D: usize, const C: usize>(
    composite: &Composite<R, D>,
    (triangles, stars, boundary): Known,
    is_wanted: &dyn Fn(&Star) -> bool,
    forces: &mut [SideForces],
) {
    // The number of functions per side of the star, and that of the vertex (φ and the two components of ∇φ), which come first.
    let (of_side, of_centre) = ((C - 3) / 2, 3);
    for star in stars.iter().filter(|star| is_wanted(star)) {
        let count = star.triangles.len() + usize::from(!star.is_closed);
        // Can the traction change on the side j?
        let is_free = |j: usize| {
            let is_boundary = !star.is_closed && (j == 0 || j + 1 == count);
            let edge = || boundary.get(&sorted([star.node, star.end(triangles, j)]));
            !is_boundary || edge().is_some_and(|edge| edge.known().is_empty())
        };
        // φ at the vertex is divided by this length, m, so that all unknowns have one unit. All triangles of the star take the
        // same length: with lengths of their own the tractions on their common sides would differ.
        let length = star.triangles.first().map_or(1.0, |&(t, _)| triangles[t].area.sqrt());
        let has_centre = star.is_closed || (is_free(0) && is_free(count - 1));
        let size = of_centre + of_side * count;
        let mut gram = DMatrix::<f64>::zeros(size, size);
        let mut right = DVector::<f64>::zeros(size);
        // The numbers of the functions of triangle j among the unknowns of the star.
        let numbers = |j: usize| {
            let first = [j, if j + 1 < count { j + 1 } else { 0 }].map(|j| of_centre + of_side * j);
            std::array::from_fn::<usize, C, _>(|c| match c.checked_sub(of_centre) {
                None => c,
                Some(k) => first[k / of_side] + k % of_side,
            })
        };
        for (j, &(t, i)) in star.triangles.iter().enumerate() {
            let triangle = &triangles[t];
            let frame = Frame::new(triangle.corners);
            let functions = functions::<R, C>(triangle, i, length);
            let mut local = functions;
            for k in 0..R / 2 {
                let turned = frame.inverse * functions.fixed_rows::<2>(2 * k);
                local.fixed_rows_mut::<2>(2 * k).copy_from(&turned);
            }
            let form =
                composite.form(i, &(frame.metric(&triangle.compliance) * triangle.zeta.recip()));
            let (sides, body) = difference(triangle, &forces[t]);
            let error = Composite::<R, D>::permuted(i, &frame.inverse, &sides, &body);
            let gradient = local.transpose() * (form * error);
            let own = local.transpose() * (form.fixed_columns::<R>(0) * local);
            let numbers = numbers(j);
            for (c, column) in numbers.into_iter().enumerate() {
                right[column] -= gradient[c];
                numbers.iter().enumerate().for_each(|(r, row)| gram[(*row, column)] += own[(r, c)]);
            }
        }
        let fixed_sides = (0..count).filter(|j| !is_free(*j)).flat_map(|j| {
            let first = of_centre + of_side * j;
            first..first + of_side
        });
        let fixed_centre = 0..if has_centre { 0 } else { of_centre };
        for k in fixed_sides.chain(fixed_centre) {
            gram.row_mut(k).fill(0.0);
            gram.column_mut(k).fill(0.0);
            (gram[(k, k)], right[k]) = (1.0, 0.0);
        }
        let Some(gram) = gram.cholesky() else { continue };
        gram.solve_mut(&mut right);
        for (j, &(t, i)) in star.triangles.iter().enumerate() {
            let numbers = numbers(j);
            let own = SMatrix::<f64, C, 1>::from_fn(|c, _| right[numbers[c]]);
            let change = functions::<R, C>(&triangles[t], i, length) * own;
            let used = R / 4;
            for (k, side) in [i, (i + 2) % 3].into_iter().enumerate() {
                for (m, force) in forces[t][side][..used].iter_mut().enumerate() {
                    *force += change.fixed_rows::<2>(2 * (used * k + m));
                }
            }
        }
    }
}

/// The forces on the first and the last side of the vertex i by each function: φ/`length` and G of the vertex, then per side its
/// normal derivative and bubbles.
fn functions<const R: usize, const C: usize>(
    triangle: &StressedTriangle,
    i: usize,
    length: f64,
) -> SMatrix<f64, R, C> {
    let mut functions = SMatrix::<f64, R, C>::zeros();
    let (used, of_side) = (R / 4, (C - 3) / 2);
    for last in 0..2 {
        let spoke = triangle.corners[(i + 1 + last) % 3] - triangle.corners[i];
        // The last side runs towards the vertex: its outward force has the opposite sign, and the vertex is its second end.
        let sign = if last == 0 { 1.0 } else { -1.0 };
        let [at_centre, at_end] = [last, 1 - last].map(|slot| 2 * (used * last + slot));
        let mut set = |function: usize, row: usize, force: Vector2<f64>| {
            functions.fixed_view_mut::<2, 1>(row, function).copy_from(&(sign * force));
        };
        // The mean of ∇φ along the side is −φ/h.
        let mean = -length / spoke.norm_squared() * Vector2::new(spoke.y, -spoke.x);
        set(0, at_centre, mean);
        set(0, at_end, -mean);
        set(1, at_centre, -Vector2::x());
        set(2, at_centre, -Vector2::y());
        let (normal, first) = (spoke.normalize(), 3 + of_side * last);
        set(first, at_centre, normal);
        set(first, at_end, -normal);
        if of_side > 1 {
            set(first + 1, 2 * (used * last + 2), Vector2::x());
            set(first + 2, 2 * (used * last + 2), Vector2::y());
        }
    }
    functions
}

/// The forces of τ − σ_h on the sides and in the body.
fn difference(triangle: &StressedTriangle, forces: &SideForces) -> (SideForces, [Vector2<f64>; 3]) {
    let on_side = |s: usize| {
        let (end, [a, b, bubble]) = ((s + 1) % 3, forces[s]);
        [
            a - triangle.force(s, end, s),
            b - triangle.force(s, end, end),
            bubble - triangle.bubble_force(s, end),
        ]
    };
    let body = triangle.divergence() * (triangle.area / 3.0);
    ([0, 1, 2].map(on_side), triangle.body.map(|force| force + body))
}
