//! Polynomials fitted to the strains around each vertex.

use crate::{
    ROUNDING,
    fem::{Body, Cells, POINTS, for_elements, quadratic_values},
    petsc::PetscError,
};
use nalgebra::{Matrix6x3, SMatrix, SVector, Vector3, Vector6};

/// Triangles needed to fit at a vertex; with fewer, the fits of its neighbours are averaged.
/// On 15 scenes, with half of them meshes have half as many triangles again; with twice a bar fails.
const ENOUGH: usize = 4;

/// A strain (ε_xx, ε_yy, 2ε_xy) as a polynomial about a vertex: the coefficients of 1, x, y, x², xy, y² (rows).
pub(super) type Fit = Matrix6x3<f64>;

/// A fit (18 entries), then 1 if the fit is known, else 0.
pub(super) const ENTRIES: usize = 19;

/// Gives ghosts the values of their owners, [`ENTRIES`] per vertex.
pub(super) type Update<'u> = &'u mut dyn FnMut(&mut [f64]) -> Result<(), PetscError>;

/// The mesh of a rank as the fits need it.
///
/// Around each vertex, a polynomial of the degree of u is fitted to ε(u) at the quadrature points of its triangles.
/// A vertex at a boundary may have too few triangles. It takes the mean of its neighbours' fits or, in a layer one
/// triangle thick, a fit of lower degree. Strains jump where two materials meet, so each material has its own fits.
pub(super) struct Patches {
    pub(super) vertices: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
    /// The number of vertices that this rank owns; they come first.
    owned: usize,
    /// The quadrature points, m, `per_triangle` of them in each triangle.
    samples: Vec<[f64; 2]>,
    pub(super) per_triangle: usize,
    /// At a jump of a load strains differ by the angle, at any distance: these vertices take the mean. See [`Body`].
    near_jumps: Vec<bool>,
    /// Per material: its triangles around each vertex.
    around: Vec<TrianglesAround>,
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

impl Patches {
    /// The patches of a body. Collective.
    pub(super) fn new(body: &Body) -> Self {
        let samples: Vec<_> = for_elements!(body, cells => sample_points(body, &cells));
        let last = body.materials.iter().copied().max().unwrap_or(0);
        let last = body.vertices.partition.comm().max(f64::from(last)) as usize;
        Self {
            near_jumps: body.near_jumps.clone(),
            vertices: body.mesh.nodes.clone(),
            triangles: body.mesh.triangles.clone(),
            owned: body.vertices.partition.owned(),
            per_triangle: samples.len() / body.triangles.len(),
            samples,
            around: (0..=last).map(|material| TrianglesAround::new(body, material)).collect(),
        }
    }

    /// Per material the fits of the vertices to its strains. Fits of vertices outside the material are not used.
    pub(super) fn fits(
        &self,
        strains: &[Vector3<f64>],
        update: Update,
    ) -> Result<Vec<Vec<Fit>>, PetscError> {
        self.around.iter().map(|around| self.fits_of_material(around, strains, update)).collect()
    }

    fn fits_of_material(
        &self,
        around: &TrianglesAround,
        strains: &[Vector3<f64>],
        update: Update,
    ) -> Result<Vec<Fit>, PetscError> {
        let Self { vertices, triangles, owned, samples, per_triangle: points, .. } = self;
        let degree = if *points > 1 { 2 } else { 1 };
        let is_near = |vertex: usize| self.near_jumps.get(vertex) == Some(&true);
        let own_fit = |vertex: usize, degree: usize| {
            let own = around.of(vertex).iter().flat_map(|t| points * t..points * (t + 1));
            let (at, own) = (vertices[vertex], own.map(|q| (samples[q], strains[q])));
            match degree {
                _ if is_near(vertex) => fit::<1>(at, own),
                0 => fit::<1>(at, own),
                1 => fit::<3>(at, own),
                _ => fit::<6>(at, own),
            }
        };
        let mut fields = vec![[0.0; ENTRIES]; vertices.len()];
        let known =
            |fit: Fit| std::array::from_fn(|i| fit.as_slice().get(i).copied().unwrap_or(1.0));
        let is_known = |&vertex: &usize| {
            let count = around.of(vertex).len();
            count >= ENOUGH || (count > 0 && is_near(vertex))
        };
        for vertex in (0..*owned).filter(is_known) {
            fields[vertex] = known(own_fit(vertex, degree));
        }
        update(fields.as_flattened_mut())?;
        // The other vertices take the mean of their neighbours' fits. Corners, with one triangle, come second,
        // because their neighbours get fits in the first pass. Over more triangles a mean of means would extrapolate
        // too far.
        for most in [usize::MAX, 1] {
            let is_left =
                |vertex: &usize| fields[*vertex][18] == 0.0 && around.of(*vertex).len() <= most;
            let mean = |vertex: usize| {
                let neighbours = around.of(vertex).iter().flat_map(|&t| triangles[t]);
                let fits = neighbours.filter(|&other| fields[other][18] > 0.0).map(|other| {
                    let fit = Fit::from_column_slice(&fields[other][..18]);
                    moved(&fit, vertices[other], vertices[vertex])
                });
                let (count, sum) =
                    fits.fold((0.0, Fit::zeros()), |(n, sum), fit| (n + 1.0, sum + fit));
                (count > 0.0).then(|| (vertex, known(sum / count)))
            };
            let means: Vec<_> = (0..*owned).filter(is_left).filter_map(mean).collect();
            means.into_iter().for_each(|(vertex, fit)| fields[vertex] = fit);
            update(fields.as_flattened_mut())?;
        }
        // Other vertices, as in strips one triangle thick, take a fit of the strains' degree: one triangle suffices.
        for (vertex, field) in fields.iter_mut().enumerate().take(*owned) {
            if field[18] == 0.0 {
                *field = known(own_fit(vertex, degree - 1));
            }
        }
        update(fields.as_flattened_mut())?;
        Ok(fields.iter().map(|field| Fit::from_column_slice(&field[..18])).collect())
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

/// The polynomial about `centre` nearest to the strains at some points, in least squares, with the first N
/// coefficients: N is 1, 3 or 6 for the degrees 0, 1, 2.
fn fit<const N: usize>(
    centre: [f64; 2],
    samples: impl Iterator<Item = ([f64; 2], Vector3<f64>)> + Clone,
) -> Fit {
    let offset = |x: [f64; 2]| [x[0] - centre[0], x[1] - centre[1]];
    let square = |(x, _)| offset(x).iter().map(|d| d * d).sum::<f64>();
    let size = samples.clone().map(square).fold(0.0, f64::max).sqrt();
    let mut normal = SMatrix::<f64, N, N>::zeros();
    let mut rhs = SMatrix::<f64, N, 3>::zeros();
    for (x, strain) in samples {
        let row: SVector<f64, N> = monomials(offset(x).map(|x| x / size)).fixed_rows::<N>(0).into();
        normal += row * row.transpose();
        rhs += row * strain.transpose();
    }
    // This makes the fit unique.
    let rounding = ROUNDING * normal.trace();
    (0..N).for_each(|i| normal[(i, i)] += rounding);
    let mut fit = Fit::zeros();
    let Some(factor) = normal.cholesky() else { return fit };
    let found = factor.solve(&rhs);
    for (row, degree) in [0, 1, 1, 2, 2, 2].into_iter().enumerate().take(N) {
        fit.set_row(row, &(found.row(row) * size.powi(-degree)));
    }
    fit
}

/// 1, x, y, x², xy, y².
pub(super) fn monomials([x, y]: [f64; 2]) -> Vector6<f64> {
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
