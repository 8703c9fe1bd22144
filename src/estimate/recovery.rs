//! Recovered strains, to estimate the discretisation error of displacements.

use super::hierarchical::{coefficients, mass};
use crate::{
    fem::{Body, Cells, Elasticity, POINTS, for_elements, quadratic_values},
    petsc::PetscError,
};
use nalgebra::{Matrix6, Matrix6x3, Vector3, Vector6};

/// An estimate of the error of u in the energy norm, ‖v‖² = ∫ ζ Aε(v) : ε(v).
#[derive(Debug, Clone)]
pub struct EnergyError {
    /// ‖ε* − ε(u)‖² on each triangle that belongs to this rank, N m per metre of thickness.
    pub squares: Vec<f64>,
    /// The sum of these squares and ‖u‖², over the undivided body.
    pub error: f64,
    /// See `error`.
    pub energy: f64,
}

/// Triangles needed to fit at a vertex; with fewer, the fits of its neighbours are averaged.
const ENOUGH: usize = 4;
/// This fraction of its trace is added to the diagonal of a normal matrix. It makes the fit unique.
const REGULARISATION: f64 = 1e-13;

/// A strain (ε_xx, ε_yy, 2ε_xy) as a polynomial about a vertex: the coefficients of 1, x, y, x², xy, y² (rows).
type Fit = Matrix6x3<f64>;

impl EnergyError {
    /// The error relative to the energy norm of u.
    pub fn relative(&self) -> f64 {
        if self.error == 0.0 { 0.0 } else { (self.error / self.energy).sqrt() }
    }
}

/// Strains recovered from nodal u (Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33, 1992:
/// superconvergent patch recovery).
///
/// Around each vertex, a polynomial of the degree of u is fitted to ε(u) at the quadrature points of its
/// triangles. At a vertex ε* is the value of its fit, and at a midpoint the mean of the fits of both ends.
///
/// A vertex at a boundary may have too few triangles. It takes the mean of its neighbours' fits or, in a layer one
/// triangle thick, a fit of lower degree. Strains jump where two materials meet, so each material has its own fits.
pub struct RecoveredStrains<'a> {
    body: &'a Body,
    /// ε(u) at the quadrature points, `per_triangle` of them in each triangle.
    strains: Vec<Vector3<f64>>,
    per_triangle: usize,
    /// Per material: the fits of the vertices.
    fits: Vec<Vec<Fit>>,
}

impl<'a> RecoveredStrains<'a> {
    /// Recovers the strains of nodal u. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn new(body: &'a Body, u: &[f64]) -> Result<Self, PetscError> {
        let (strains, samples) = for_elements!(body, cells => {
            (cells.strains(u, |_, strain| strain), sample_points(body, &cells))
        });
        let per_triangle = strains.len() / body.triangles.len();
        let last = body.materials.iter().copied().max().unwrap_or(0);
        let last = body.vertices.partition.comm().max(f64::from(last)) as usize;
        let of_material = |material| fits(body, material, &strains, &samples, per_triangle);
        let fits = (0..=last).map(of_material).collect::<Result<_, _>>()?;
        Ok(Self { body, strains, per_triangle, fits })
    }

    /// Estimates the error of u in the energy norm; `zeta` is ζ at the quadrature points. Collective.
    pub fn energy_error(&self, elasticity: &Elasticity, zeta: &[f64], u: &[f64]) -> EnergyError {
        let Self { body, per_triangle, .. } = *self;
        let square = |t: usize| {
            let own = per_triangle * t..per_triangle * (t + 1);
            let mean = zeta[own].iter().sum::<f64>() / per_triangle as f64;
            // ∫ e_i e_j of the components of e = ε* − ε(u).
            let difference = self.difference(t).map(|strain| strain.transpose());
            let difference = coefficients(Matrix6x3::from_rows(&difference));
            let products = difference.transpose() * mass(&body.triangles[t]) * difference;
            mean * elasticity.d(body, t).dot(&products)
        };
        let squares: Vec<f64> = (0..body.own_triangles).map(square).collect();
        let points = per_triangle * body.own_triangles;
        let energy: f64 = elasticity.energies(body, zeta, u).iter().take(points).sum();
        let mut sums = [squares.iter().sum(), energy];
        body.nodes.partition.comm().sum(&mut sums);
        EnergyError { squares, error: sums[0], energy: sums[1] }
    }

    /// ε* − ε(u) on triangle `t`, at the vertices and the midpoints of the sides 01, 12, 20. (ε(u) is affine
    /// between the quadrature points, except on curved triangles.)
    fn difference(&self, t: usize) -> [Vector3<f64>; 6] {
        let (body, triangle) = (self.body, self.body.mesh.triangles[t]);
        let fits = &self.fits[body.material(t)];
        let strains = &self.strains[self.per_triangle * t..self.per_triangle * (t + 1)];
        let computed = at_vertices(strains);
        let at = |i: usize| body.mesh.nodes[triangle[i]];
        let recovered = |i: usize, [x, y]: [f64; 2]| {
            let [vx, vy] = at(i);
            fits[triangle[i]].transpose() * monomials([x - vx, y - vy])
        };
        let vertex = |i: usize| recovered(i, at(i)) - computed[i];
        let middle = |i: usize, j: usize| {
            if let [_] = strains {
                return 0.5 * (vertex(i) + vertex(j));
            }
            let x = [0, 1].map(|k| 0.5 * (at(i)[k] + at(j)[k]));
            0.5 * (recovered(i, x) + recovered(j, x) - computed[i] - computed[j])
        };
        [vertex(0), vertex(1), vertex(2), middle(0, 1), middle(1, 2), middle(2, 0)]
    }
}

/// The strains of nodal u at the vertices and the midpoints of the sides 01, 12, 20 of each triangle.
pub fn strains_at_nodes(body: &Body, u: &[f64]) -> impl Iterator<Item = [Vector3<f64>; 6]> {
    (0..body.triangles.len()).map(move |t| {
        let [a, b, c] = for_elements!(body, cells => {
            let local = cells.gather(t, u);
            at_vertices(&cells.elements[t].points.map(|point| point.strain(&local)))
        });
        [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)]
    })
}

/// A function at the vertices from its values at the quadrature points of a triangle, constant or
/// affine between them: an affine f has the values f(x_q) = Σf/6 + f_q/2, so f_q = 2 f(x_q) − Σf/3.
fn at_vertices(points: &[Vector3<f64>]) -> [Vector3<f64>; 3] {
    match points {
        [value] => [*value; 3],
        _ => {
            let sum = points.iter().sum::<Vector3<f64>>();
            [0, 1, 2].map(|i| 2.0 * points[i] - sum / 3.0)
        }
    }
}

/// The quadrature points, m, triangle by triangle.
fn sample_points<const N: usize, const Q: usize>(
    body: &Body,
    cells: &Cells<N, Q>,
) -> Vec<[f64; 2]> {
    let points = &body.nodes.points;
    let values: Vec<Vec<f64>> = match Q {
        1 => vec![vec![1.0 / 3.0; 3]],
        _ => POINTS.map(|point| quadratic_values(point).to_vec()).to_vec(),
    };
    let place = |nodes: &[usize; N], values: &Vec<f64>| {
        [0, 1].map(|k| nodes.iter().zip(values).map(|(&i, value)| value * points[i][k]).sum())
    };
    cells.nodes.iter().flat_map(|nodes| values.iter().map(move |v| place(nodes, v))).collect()
}

/// The triangles of one material around each vertex, vertex after vertex in one list.
struct TrianglesAround {
    triangles: Vec<usize>,
    /// Per vertex: where its triangles end in the list.
    ends: Vec<usize>,
}

impl TrianglesAround {
    fn new(body: &Body, material: usize) -> Self {
        let triangles = body.mesh.triangles.iter().enumerate();
        let own = triangles.filter(|(t, _)| body.material(*t) == material);
        // `ends` first holds the start of each vertex's list; each entry moves it towards the end of the list.
        let mut ends = vec![0; body.mesh.nodes.len() + 1];
        own.clone().flat_map(|(_, triangle)| triangle).for_each(|&vertex| ends[vertex + 1] += 1);
        (1..ends.len()).for_each(|i| ends[i] += ends[i - 1]);
        let mut triangles = vec![0; ends[ends.len() - 1]];
        for (t, triangle) in own {
            for &vertex in triangle {
                triangles[ends[vertex]] = t;
                ends[vertex] += 1;
            }
        }
        Self { triangles, ends }
    }

    fn of(&self, vertex: usize) -> &[usize] {
        let first = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.triangles[first..self.ends[vertex]]
    }
}

/// The fit of each vertex to the strains of one material. Fits of vertices outside the material are not used.
fn fits(
    body: &Body,
    material: usize,
    strains: &[Vector3<f64>],
    samples: &[[f64; 2]],
    per_triangle: usize,
) -> Result<Vec<Fit>, PetscError> {
    let (vertices, nodes) = (&body.mesh.nodes, body.mesh.nodes.len());
    let around = TrianglesAround::new(body, material);
    let partition = &body.vertices.partition;
    let degree = if per_triangle > 1 { 2 } else { 1 };
    let own_fit = |vertex: usize, degree: usize| {
        let own = around.of(vertex).iter().flat_map(|t| per_triangle * t..per_triangle * (t + 1));
        fit(vertices[vertex], own.map(|q| (samples[q], strains[q])), degree)
    };
    // Per vertex: its fit (18 entries), then 1 if the fit is known, else 0.
    let mut fields = vec![[0.0; 19]; nodes];
    let known = |fit: Fit| std::array::from_fn(|i| fit.as_slice().get(i).copied().unwrap_or(1.0));
    for vertex in (0..partition.owned()).filter(|&vertex| around.of(vertex).len() >= ENOUGH) {
        fields[vertex] = known(own_fit(vertex, degree));
    }
    partition.update(fields.as_flattened_mut(), 19)?;
    // The other vertices take the mean of their neighbours' fits. Corners, with one triangle, come second, because
    // their neighbours get fits in the first pass. Over more triangles a mean of means would extrapolate too far.
    for most in [usize::MAX, 1] {
        let before = fields.clone();
        let is_left =
            |vertex: &usize| before[*vertex][18] == 0.0 && around.of(*vertex).len() <= most;
        for vertex in (0..partition.owned()).filter(is_left) {
            let neighbours = around.of(vertex).iter().flat_map(|&t| body.mesh.triangles[t]);
            let fits = neighbours.filter(|&other| before[other][18] > 0.0).map(|other| {
                let fit = Fit::from_column_slice(&before[other][..18]);
                moved(&fit, vertices[other], vertices[vertex])
            });
            let (count, sum) = fits.fold((0.0, Fit::zeros()), |(n, sum), fit| (n + 1.0, sum + fit));
            if count > 0.0 {
                fields[vertex] = known(sum / count);
            }
        }
        partition.update(fields.as_flattened_mut(), 19)?;
    }
    // Other vertices, as in strips one triangle thick, take a fit of the strains' degree: one triangle suffices.
    for (vertex, field) in fields.iter_mut().enumerate().take(partition.owned()) {
        if field[18] == 0.0 {
            *field = known(own_fit(vertex, degree - 1));
        }
    }
    partition.update(fields.as_flattened_mut(), 19)?;
    Ok(fields.iter().map(|field| Fit::from_column_slice(&field[..18])).collect())
}

/// The polynomial of this degree about `centre` nearest to the strains at some points, in least squares.
fn fit(
    centre: [f64; 2],
    samples: impl Iterator<Item = ([f64; 2], Vector3<f64>)> + Clone,
    degree: usize,
) -> Fit {
    /// Number of monomials up to each degree.
    const COUNT: [usize; 3] = [1, 3, 6];
    let offset = |x: [f64; 2]| [x[0] - centre[0], x[1] - centre[1]];
    let size = samples.clone().map(|(x, _)| offset(x)).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max);
    let (mut normal, mut rhs) = (Matrix6::zeros(), Fit::zeros());
    for (x, strain) in samples {
        let mut row = monomials(offset(x).map(|x| x / size));
        row.rows_range_mut(COUNT[degree]..).fill(0.0);
        normal.ger(1.0, &row, &row, 1.0);
        rhs.ger(1.0, &row, &strain, 1.0);
    }
    let trace = normal.trace();
    (0..6).for_each(|i| normal[(i, i)] += REGULARISATION * trace);
    let Some(factor) = normal.cholesky() else { return Fit::zeros() };
    let mut fit = factor.solve(&rhs);
    for (row, degree) in [0, 1, 1, 2, 2, 2].into_iter().enumerate() {
        fit.row_mut(row).scale_mut(size.powi(-degree));
    }
    fit
}

/// 1, x, y, x², xy, y².
fn monomials([x, y]: [f64; 2]) -> Vector6<f64> {
    Vector6::new(1.0, x, y, x * x, x * y, y * y)
}

/// A fit about `from` as a polynomial about `to`.
fn moved(fit: &Fit, from: [f64; 2], to: [f64; 2]) -> Fit {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let mut moved = *fit;
    moved.set_row(0, &(monomials([x, y]).transpose() * fit));
    moved.set_row(1, &(fit.row(1) + 2.0 * x * fit.row(3) + y * fit.row(4)));
    moved.set_row(2, &(fit.row(2) + x * fit.row(4) + 2.0 * y * fit.row(5)));
    moved
}
