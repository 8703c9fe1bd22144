//! Stresses on a triangle from the tractions on its sides.
//!
//! The triangle is cut at its centroid into three parts. On each part the stress is symmetric and a polynomial of degree k; between
//! parts its tractions are continuous. Such a stress exists for all tractions of degree k on the sides that balance the
//! body force: for k = 1 exactly one (Johnson and Mercier, Numer. Math. 30, 1978), for k = 2 a family with three
//! parameters (Arnold, Douglas and Gupta, Numer. Math. 45, 1984), of which the error takes the best one.
//!
//! With x = x_0 + J x̂, the stress τ = J τ̂ Jᵀ/det J has the forces J(τ̂n̂ dŝ) on sides and J(div τ̂ dx̂) in the body. So all
//! triangles share one map from forces to stresses, which is made once.

use crate::fem::{THREE_GAUSS, Triangle};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use std::sync::LazyLock;

/// The forces on a triangle. Per side 01, 12, 20: ∫ τn ψ for the hat functions ψ of its first and its second end, and
/// for the bubble 4 ψ_first ψ_second, N per metre of thickness. Linear tractions do not use the last one.
pub(super) type SideForces = [[Vector2<f64>; 3]; 3];

/// The quadrature points of the three parts, exact for polynomials of degree 5 (Radon, Monatsh. Math. 52, 1948).
const RULE_SIZE: usize = 21;
/// The components (σ_xx, σ_yy, σ_xy) of a stress at all points.
const VALUES: usize = 3 * RULE_SIZE;

/// The map from the forces on the reference triangle to the stresses in it, for tractions of degree k with D = 6k + 12
/// components of forces, R = 4k + 4 of them on two sides.
pub(super) struct Composite<const R: usize, const D: usize> {
    /// The barycentric coordinates of the points, and their weights as parts of |T|.
    points: [([f64; 3], f64); RULE_SIZE],
    /// The stresses at the points.
    stresses: SMatrix<f64, VALUES, D>,
    /// The stresses without forces, per parameter; none for k = 1.
    free: Vec<SVector<f64, VALUES>>,
    /// Per vertex, for the forces on its first and its last side (R components) and all forces, these two sides first: per pair of
    /// components i ≤ j of a stress, ∫ (σ_i σ_j + σ_j σ_i)/|T| (i < j) or ∫ σ_i²/|T| as a bilinear form.
    products: [[SMatrix<f64, R, D>; 6]; 3],
}

/// The pairs of components of a stress.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// The map of a triangle from the reference triangle.
pub(super) struct Frame {
    /// J⁻¹, 1/m.
    pub(super) inverse: Matrix2<f64>,
    /// The matrix P with σ = P σ̂ in components, where σ = J σ̂ Jᵀ/det J; without unit.
    to_physical: Matrix3<f64>,
    /// |T|, m².
    area: f64,
}

impl Frame {
    /// The frame of a triangle with these corners, m.
    pub(super) fn new([a, b, c]: [Vector2<f64>; 3]) -> Self {
        let jacobian = Matrix2::from_columns(&[b - a, c - a]);
        let [p, q, r, s] = [jacobian.m11, jacobian.m12, jacobian.m21, jacobian.m22];
        let determinant = jacobian.determinant();
        let [x, y] = [[p * p, q * q, 2.0 * p * q], [r * r, s * s, 2.0 * r * s]];
        let to_physical = Matrix3::from([x, y, [p * r, q * s, p * s + q * r]]).transpose();
        Self {
            inverse: Matrix2::new(s, -q, -r, p) / determinant,
            to_physical: to_physical / determinant,
            area: 0.5 * determinant,
        }
    }

    /// ∫ σ̂ : A⁻¹ σ̂ as a quadratic form of the mean of σ̂, with A⁻¹ as a matrix, 1/Pa.
    pub(super) fn metric(&self, compliance: &Matrix3<f64>) -> Matrix3<f64> {
        self.to_physical.transpose() * compliance * self.to_physical * self.area
    }
}

pub(super) static LINEAR: LazyLock<Composite<8, 18>> = LazyLock::new(|| Composite::new(1));
pub(super) static QUADRATIC: LazyLock<Composite<12, 24>> = LazyLock::new(|| Composite::new(2));

/// A triangle with an affine strain and ζ, and the forces on it.
pub(super) struct LoadedTriangle<'a> {
    pub(super) frame: Frame,
    /// The matrix D of A, Pa, and its inverse, 1/Pa.
    pub(super) d: &'a Matrix3<f64>,
    pub(super) compliance: &'a Matrix3<f64>,
    /// (ε_xx, ε_yy, 2ε_xy) and ζ at the vertices.
    pub(super) strains: [Vector3<f64>; 3],
    pub(super) zeta: [f64; 3],
    pub(super) sides: &'a SideForces,
    /// ∫ f_B ψ for the hat functions ψ of the vertices.
    pub(super) body: [Vector2<f64>; 3],
}

impl<const R: usize, const D: usize> Composite<R, D> {
    /// ∫ σ : A⁻¹ σ as a bilinear form of the forces on both sides at the vertex i and of all forces, as in [`Self::permuted`], for a
    /// [`Frame::metric`].
    pub(super) fn form(&self, i: usize, metric: &Matrix3<f64>) -> SMatrix<f64, R, D> {
        let [a, b, c, d, e, f] = PAIRS.map(|at| metric[at]);
        let [p, q, r, s, t, u] = self.products[i].each_ref().map(|of| &of.as_slice()[..R * D]);
        let mut form = SMatrix::<f64, R, D>::zeros();
        // All six products are added in one pass over their entries, which is faster.
        for (k, sum) in form.as_mut_slice()[..R * D].iter_mut().enumerate() {
            *sum = a * p[k] + b * q[k] + c * r[k] + d * s[k] + e * t[k] + f * u[k];
        }
        form
    }

    /// The numbers of all components of forces: those of the first and the last side of the vertex i, then the others.
    fn permutation(i: usize) -> [usize; D] {
        let side = D / 3 - 2;
        let sides =
            [i, (i + 2) % 3, (i + 1) % 3].into_iter().flat_map(|s| side * s..side * (s + 1));
        let mut numbers = sides.chain(3 * side..D);
        std::array::from_fn(|_| numbers.next().unwrap_or_default())
    }

    /// The forces on the reference triangle, permuted for the vertex i.
    pub(super) fn permuted(
        i: usize,
        inverse: &Matrix2<f64>,
        sides: &SideForces,
        body: &[Vector2<f64>; 3],
    ) -> SVector<f64, D> {
        let sides = [i, (i + 2) % 3, (i + 1) % 3].into_iter().flat_map(|s| &sides[s][..D / 6 - 1]);
        let mut forces = SVector::zeros();
        for (k, force) in sides.chain(body).enumerate() {
            let force = inverse * force;
            (forces[2 * k], forces[2 * k + 1]) = (force.x, force.y);
        }
        forces
    }

    /// τ̂ at the points.
    fn on_reference(&self, on: &LoadedTriangle) -> SVector<f64, VALUES> {
        let used = D / 6 - 1;
        let forces = on.sides.iter().flat_map(|side| &side[..used]).chain(&on.body);
        let forces = forces.flat_map(|force| <[f64; 2]>::from(on.frame.inverse * force));
        let mut stresses = SVector::<f64, VALUES>::zeros();
        // Without a body force, the columns of its forces are left out.
        let columns = self.stresses.as_slice().chunks_exact(VALUES).zip(forces);
        for (column, force) in columns.filter(|(_, force)| *force != 0.0) {
            let sums = stresses.as_mut_slice().iter_mut().zip(column);
            sums.for_each(|(sum, part)| *sum += force * part);
        }
        stresses
    }

    /// τ, Pa, at the points with their barycentric coordinates.
    pub(super) fn stresses(&self, on: &LoadedTriangle) -> [([f64; 3], Vector3<f64>); RULE_SIZE] {
        let stresses = self.on_reference(on);
        let stress = |q: usize| on.frame.to_physical * stresses.fixed_rows::<3>(3 * q);
        std::array::from_fn(|q| (self.points[q].0, stress(q)))
    }

    /// ∫ (ζA)⁻¹(τ − ζAε) : (τ − ζAε), N m per metre of thickness. Between the corners of the parts 1/ζ is replaced by its interpolation,
    /// which is never smaller.
    pub(super) fn square(&self, on: &LoadedTriangle) -> f64 {
        let mut errors = self.on_reference(on);
        let Some(to_reference) = on.frame.to_physical.try_inverse() else { return f64::INFINITY };
        let metric = on.frame.metric(on.compliance);
        let stresses = on.strains.map(|strain| to_reference * (on.d * strain));
        // 1/ζ ≤ its interpolation between the corners of a part.
        let centre = 3.0 / on.zeta.iter().sum::<f64>();
        let weights: [f64; RULE_SIZE] = std::array::from_fn(|q| {
            let ((at, weight), [first, second, opposite]) = (self.points[q], corners_of(q));
            let of_corners = [first, second].map(|i| (at[i] - at[opposite]) / on.zeta[i]);
            weight * (of_corners.iter().sum::<f64>() + 3.0 * at[opposite] * centre)
        });
        for (q, (at, _)) in self.points.iter().enumerate() {
            let zeta: f64 = at.iter().zip(on.zeta).map(|(l, zeta)| l * zeta).sum();
            let stress = at.iter().zip(&stresses).map(|(l, stress)| stress * (l * zeta));
            let mut error = errors.fixed_rows_mut::<3>(3 * q);
            error -= stress.sum::<Vector3<f64>>();
        }
        let product = |a: &SVector<f64, VALUES>, b: &SVector<f64, VALUES>| -> f64 {
            let at = |q: usize| a.fixed_rows::<3>(3 * q).dot(&(metric * b.fixed_rows::<3>(3 * q)));
            weights.iter().enumerate().map(|(q, weight)| weight * at(q)).sum()
        };
        let square = product(&errors, &errors);
        // The best parameters.
        let count = self.free.len();
        let gram = DMatrix::from_fn(count, count, |i, j| product(&self.free[i], &self.free[j]));
        let work = DVector::from_fn(count, |i, _| product(&self.free[i], &errors));
        let gain = gram.cholesky().map_or(0.0, |gram| work.dot(&gram.solve(&work)));
        (square - gain).max(0.0)
    }

    /// The stress in part s, of the corners s and s + 1 and the centroid, is a polynomial of its barycentric coordinates. Its
    /// coefficients x solve the equations A x = B F of the tractions, of their continuity and of the divergence for forces F, in
    /// least squares: x = (AᵀA)⁺ AᵀB F. The stresses without forces are the null space of A.
    fn new(degree: usize) -> Self {
        let (rows, forces) = Equations::<D>::matrices(degree);
        let unknowns = rows.ncols();
        let eigen = (rows.transpose() * &rows).symmetric_eigen();
        let cut = 1e-10 * eigen.eigenvalues.max();
        let inverse = eigen.eigenvalues.map(|value| if value > cut { 1.0 / value } else { 0.0 });
        let basis = &eigen.eigenvectors;
        let coefficients = basis
            * DMatrix::from_diagonal(&inverse)
            * (basis.transpose() * (rows.transpose() * forces));
        let rule = rule();
        let mut values = DMatrix::zeros(VALUES, unknowns);
        for (q, (s, at, _)) in rule.iter().enumerate() {
            for (i, value) in monomials(degree, *at).into_iter().enumerate() {
                (0..3).for_each(|of| values[(3 * q + of, coefficient(degree, *s, i, of))] = value);
            }
        }
        let mut stresses = &values * coefficients;
        let free = (0..unknowns).filter(|&i| eigen.eigenvalues[i] <= cut);
        let free = Vec::from_iter(free.map(|i| &values * basis.column(i)));
        let weights = DVector::from_fn(VALUES, |i, _| rule[i / 3].2);
        subtract_projection(&mut stresses, &free, &weights);
        let products = PAIRS.map(|pair| product::<D>(&stresses, &weights, pair));
        let of_vertex = |i: usize| {
            let numbers = Self::permutation(i);
            let permuted =
                |product: &DMatrix<f64>| SMatrix::from_fn(|r, c| product[(numbers[r], numbers[c])]);
            products.each_ref().map(permuted)
        };
        let in_triangle = |(s, at, weight): (usize, [f64; 3], f64)| {
            (<[f64; 3]>::from(Matrix3::from_columns(&part_corners(s)) * Vector3::from(at)), weight)
        };
        Self {
            products: [0, 1, 2].map(of_vertex),
            points: rule.map(in_triangle),
            stresses: SMatrix::from_fn(|i, j| stresses[(i, j)]),
            free: free.iter().map(|of| SVector::from_iterator(of.iter().copied())).collect(),
        }
    }
}

/// The number of the coefficient of the monomial i of a component of the stress in part s.
fn coefficient(degree: usize, s: usize, i: usize, component: usize) -> usize {
    3 * (monomials(degree, [0.0; 3]).len() * s + i) + component
}

/// The equations A x = B F for the coefficients x of a stress in the reference triangle, and the D components of forces F.
struct Equations<const D: usize> {
    degree: usize,
    /// The rows of A, and those of B.
    rows: Vec<DVector<f64>>,
    forces: Vec<DVector<f64>>,
}

impl<const D: usize> Equations<D> {
    /// A and B.
    fn matrices(degree: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut equations = Self { degree, rows: Vec::new(), forces: Vec::new() };
        for s in 0..3 {
            equations.add_side(s);
            equations.add_continuity(s);
            equations.add_divergence(s);
        }
        let matrix = |of: &[DVector<f64>]| {
            DMatrix::from_rows(&Vec::from_iter(of.iter().map(DVector::transpose)))
        };
        (matrix(&equations.rows), matrix(&equations.forces))
    }

    /// A row of A and a row of B, both zero. The functions that add equations fill them.
    fn next(&mut self) -> (&mut DVector<f64>, &mut DVector<f64>) {
        self.rows.push(DVector::zeros(coefficient(self.degree, 3, 0, 0)));
        self.forces.push(DVector::zeros(D));
        let last = self.rows.len() - 1;
        (&mut self.rows[last], &mut self.forces[last])
    }

    /// On the side s of the triangle τn has the given forces: ∫ τn ψ = F for the hat functions of both ends and, for k = 2, the
    /// bubble.
    fn add_side(&mut self, s: usize) {
        let ([a, b, _], degree) = (part(s), self.degree);
        for function in 0..=degree {
            for of in 0..2 {
                let (row, force) = self.next();
                for [r, weight] in THREE_GAUSS {
                    let value = [1.0 - r, r, 4.0 * r * (1.0 - r)][function];
                    add_traction(
                        row,
                        degree,
                        (s, [1.0 - r, r, 0.0]),
                        (normal(a, b), of),
                        weight * value,
                    );
                }
                force[2 * ((degree + 1) * s + function) + of] = 1.0;
            }
        }
    }

    /// From the corner s to the centroid τn is the same in both parts, at k + 1 points.
    fn add_continuity(&mut self, s: usize) {
        let ([a, ..], degree) = (part(s), self.degree);
        for point in 0..=degree {
            let (r, n) = (point as f64 / degree as f64, normal(a, CENTRE));
            for of in 0..2 {
                let (row, _) = self.next();
                add_traction(row, degree, (s, [1.0 - r, 0.0, r]), (n, of), 1.0);
                add_traction(row, degree, ((s + 2) % 3, [0.0, 1.0 - r, r]), (n, of), -1.0);
            }
        }
    }

    /// In part s −div τ is f_B, which has the given forces F_i at the hat functions, with |T| = ½. For k = 1 it is constant on
    /// each part: (4 Σ F − 9 F_i)/|T| on the part opposite to the corner i. For k = 2 it is affine: 3 (4 F_i − Σ F)/|T|
    /// at the corner i.
    fn add_divergence(&mut self, s: usize) {
        let degree = self.degree;
        let gradients = *Triangle::new(part(s)).gradients();
        let corner = |i: usize| [0, 1, 2].map(|j| f64::from(i == j));
        let points =
            if degree == 1 { vec![[1.0 / 3.0; 3]] } else { Vec::from([0, 1, 2].map(corner)) };
        for at in points {
            let here = Matrix3::from_columns(&part_corners(s)) * Vector3::from(at);
            for of in 0..2 {
                let (row, force) = self.next();
                for (i, slope) in derivatives(degree, at).into_iter().enumerate() {
                    let [x, y] =
                        [0, 1].map(|k| (0..3).map(|j| slope[j] * gradients[j][k]).sum::<f64>());
                    row[coefficient(degree, s, i, of)] += [x, y][of];
                    row[coefficient(degree, s, i, 2)] += [y, x][of];
                }
                for i in 0..3 {
                    let opposite = f64::from(i == (s + 2) % 3);
                    let own = if degree == 1 { 4.0 - 9.0 * opposite } else { 12.0 * here[i] - 3.0 };
                    force[6 * (degree + 1) + 2 * i + of] = -own / 0.5;
                }
            }
        }
    }
}

/// Adds to a row `weight` times a component of τn, for a point in part s.
fn add_traction(
    row: &mut DVector<f64>,
    degree: usize,
    (s, at): (usize, [f64; 3]),
    (n, of): ([f64; 2], usize),
    weight: f64,
) {
    for (i, value) in monomials(degree, at).into_iter().enumerate() {
        row[coefficient(degree, s, i, of)] += weight * value * n[of];
        row[coefficient(degree, s, i, 2)] += weight * value * n[1 - of];
    }
}

/// Subtracts from the stresses their parts in the span of `free`: of each family, the least stress in L² remains.
fn subtract_projection(stresses: &mut DMatrix<f64>, free: &[DVector<f64>], weights: &DVector<f64>) {
    if free.is_empty() {
        return;
    }
    let free = DMatrix::from_columns(free);
    let weighted = DMatrix::from_fn(free.ncols(), VALUES, |i, j| free[(j, i)] * weights[j]);
    if let Some(gram) = (&weighted * &free).cholesky() {
        *stresses -= &free * gram.solve(&(weighted * &*stresses));
    }
}

/// ∫ (σ_i σ_j + σ_j σ_i)/|T|, or ∫ σ_i²/|T| if i = j, as a bilinear form of all forces.
fn product<const D: usize>(
    stresses: &DMatrix<f64>,
    weights: &DVector<f64>,
    (i, j): (usize, usize),
) -> DMatrix<f64> {
    let weighted =
        DMatrix::from_fn(RULE_SIZE, D, |q, force| weights[3 * q] * stresses[(3 * q + i, force)]);
    let other = DMatrix::from_fn(RULE_SIZE, D, |q, force| stresses[(3 * q + j, force)]);
    let product = weighted.transpose() * other;
    if i == j { product } else { &product + product.transpose() }
}

const CORNERS: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
const CENTRE: [f64; 2] = [1.0 / 3.0; 2];

/// The corners of part s of the reference triangle.
fn part(s: usize) -> [[f64; 2]; 3] {
    [CORNERS[s], CORNERS[(s + 1) % 3], CENTRE]
}

/// The outward normal of the edge ab, as long as the edge.
fn normal([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> [f64; 2] {
    [by - ay, ax - bx]
}

/// The first and second corner of the part in which the point q lies, and the corner opposite to it.
fn corners_of(q: usize) -> [usize; 3] {
    let s = q / (RULE_SIZE / 3);
    [s, (s + 1) % 3, (s + 2) % 3]
}

/// The barycentric coordinates of the corners of part s in the triangle.
fn part_corners(s: usize) -> [Vector3<f64>; 3] {
    let corner = |i: usize| Vector3::from_fn(|j, _| f64::from(i == j));
    [corner(s), corner((s + 1) % 3), Vector3::repeat(1.0 / 3.0)]
}

/// The monomials of a degree in barycentric coordinates.
fn monomials(degree: usize, [a, b, c]: [f64; 3]) -> Vec<f64> {
    if degree == 1 { vec![a, b, c] } else { vec![a * a, b * b, c * c, a * b, b * c, c * a] }
}

/// Their derivatives by the barycentric coordinates.
fn derivatives(degree: usize, [a, b, c]: [f64; 3]) -> Vec<[f64; 3]> {
    match degree {
        1 => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        _ => vec![
            [2.0 * a, 0.0, 0.0],
            [0.0, 2.0 * b, 0.0],
            [0.0, 0.0, 2.0 * c],
            [b, a, 0.0],
            [0.0, c, b],
            [c, 0.0, a],
        ],
    }
}

/// Radon's rule of seven points in each part: the part, barycentric coordinates in it, and the weight as a part of |T|.
fn rule() -> [(usize, [f64; 3], f64); RULE_SIZE] {
    let root = 15.0_f64.sqrt();
    let orbits = [(6.0 - root, 155.0 - root), (6.0 + root, 155.0 + root)];
    let mut rule = vec![([1.0 / 3.0; 3], 9.0 / 40.0)];
    for (near, weight) in orbits {
        let (l, weight) = (near / 21.0, weight / 1200.0);
        let far = 1.0 - 2.0 * l;
        rule.extend([[far, l, l], [l, far, l], [l, l, far]].map(|at| (at, weight)));
    }
    std::array::from_fn(|q| (q / 7, rule[q % 7].0, rule[q % 7].1 / 3.0))
}
