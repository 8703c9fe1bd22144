//! Polynomials fitted to the strains around each vertex.

use super::{Body, Cells, POINTS, Partition, for_elements, quadratic_values};
use crate::{ROUNDING, by_number, petsc::PetscError};
use nalgebra::{Matrix3x6, SMatrix, SVector, Vector3, Vector6};
use std::ops::Range;

/// Triangles needed to fit a polynomial at a vertex. A vertex with fewer takes the mean of the fits of its
/// neighbours.
///
/// Tuned on the 13 adapted runs. Half: 9 % more triangles, 16 times as many for `hertz` at 0.1. Twice: 5 % more
/// triangles, and a bar of 15 other scenes fails.
const TRIANGLES_TO_FIT: usize = 4;

/// A strain (ε_xx, ε_yy, 2ε_xy) as a polynomial about a vertex: the coefficients of 1, x, y, x², xy, y² (columns).
type Fit = Matrix3x6<f64>;

/// The fits around each vertex as linear functions of the strains.
///
/// Around each vertex, a polynomial of the degree of u is fitted to ε(u) at the quadrature points of its triangles.
/// A vertex at a boundary may have too few triangles. It takes the mean of its neighbours' fits or, in a layer one
/// triangle thick, a fit of lower degree. Strains jump where two materials meet, so each material has its own fits.
#[derive(Debug)]
pub(crate) struct Patches {
    pub(crate) vertices: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
    /// The number of vertices that this rank owns; they come first.
    owned: usize,
    /// The number of quadrature points in a triangle.
    pub(crate) per_triangle: usize,
    /// Per vertex: is it next to a jump of a load? Around the jump the strain depends on the direction at any distance, so no
    /// polynomial fits it, and the vertex takes the mean of its triangles' strains. See [`Body`].
    near_jumps: Vec<bool>,
    /// Per material: its triangles around each vertex.
    around: Vec<TrianglesAround>,
}

/// The triangles of one material around each vertex, vertex after vertex in one list.
#[derive(Debug)]
struct TrianglesAround {
    triangles: Vec<usize>,
    /// Per vertex: where its triangles start in the list; then the end.
    starts: Vec<usize>,
    /// Per quadrature point of the triangles in the list: the weights of its strain in the coefficients of the fit. There are 3
    /// for linear and 6 for quadratic elements.
    weights: Vec<f64>,
    /// The vertices of this rank with too few triangles, if any.
    few: Vec<usize>,
}

impl TrianglesAround {
    /// The triangles of a `material` of the body, without weights.
    fn new(body: &Body, material: usize) -> Self {
        let triangles = body.mesh.triangles.iter().enumerate();
        let own = triangles.filter(|(t, _)| body.material(*t) == material);
        let around = own.flat_map(|(t, triangle)| triangle.map(|vertex| (vertex, t)));
        let (starts, triangles) = by_number(body.mesh.nodes.len(), around);
        Self { triangles, starts, weights: Vec::new(), few: Vec::new() }
    }

    /// The range of the triangles of a vertex in the list.
    fn range(&self, vertex: usize) -> Range<usize> {
        self.starts[vertex]..self.starts[vertex + 1]
    }

    fn of(&self, vertex: usize) -> &[usize] {
        &self.triangles[self.range(vertex)]
    }
}

impl Patches {
    /// The patches of a body. Collective.
    pub(crate) fn new(body: &Body) -> Self {
        let samples: Vec<_> = for_elements!(body, cells => sample_points(body, &cells));
        let last = body.materials.iter().copied().max().unwrap_or(0);
        let last = body.comm().max(f64::from(last)) as usize;
        let mut patches = Self {
            near_jumps: body.near_jumps.clone(),
            vertices: body.mesh.nodes.clone(),
            triangles: body.mesh.triangles.clone(),
            owned: body.vertices.partition.owned(),
            per_triangle: body.points_per_triangle(),
            around: (0..=last).map(|material| TrianglesAround::new(body, material)).collect(),
        };
        for material in 0..=last {
            let (few, weights) = patches.weights(&patches.around[material], &samples);
            (patches.around[material].few, patches.around[material].weights) = (few, weights);
        }
        patches
    }

    /// The vertices with too few triangles, and the weights of the fits to strains at the `samples`, of as high a degree as the
    /// triangles of a vertex allow.
    fn weights(&self, around: &TrianglesAround, samples: &[[f64; 2]]) -> (Vec<usize>, Vec<f64>) {
        let (mut weights, mut few) = (Vec::new(), Vec::new());
        let (points, count) = (self.per_triangle, if self.per_triangle > 1 { 6 } else { 3 });
        for vertex in 0..self.owned {
            let own = around.of(vertex).iter().flat_map(|t| points * t..points * (t + 1));
            let (at, own) = (self.vertices[vertex], own.map(|q| samples[q]));
            let has_own = self.has_own_fit(around, vertex);
            few.extend((!has_own && !around.of(vertex).is_empty()).then_some(vertex));
            match (points, has_own) {
                _ if self.is_near_jump(vertex) => fit::<1>(at, own, count, &mut weights),
                (1, true) => fit::<3>(at, own, count, &mut weights),
                (1, false) => fit::<1>(at, own, count, &mut weights),
                (_, true) => fit::<6>(at, own, count, &mut weights),
                (_, false) => fit::<3>(at, own, count, &mut weights),
            }
        }
        (few, weights)
    }

    fn is_near_jump(&self, vertex: usize) -> bool {
        self.near_jumps.get(vertex) == Some(&true)
    }

    /// Are there enough triangles around the vertex, or does it take the mean of few?
    fn has_own_fit(&self, around: &TrianglesAround, vertex: usize) -> bool {
        let count = around.of(vertex).len();
        count >= TRIANGLES_TO_FIT || (count > 0 && self.is_near_jump(vertex))
    }

    /// Per material the fits of the vertices to its strains. `vertices` is the division of the vertices among several ranks.
    /// Fits of vertices outside the material are not used. Collective.
    pub(crate) fn fits(
        &self,
        strains: &[Vector3<f64>],
        vertices: Option<&Partition>,
    ) -> Result<Vec<Fits>, PetscError> {
        let fits = |around| match self.per_triangle {
            1 => self.fits_of_material::<1, 3>(around, strains, vertices),
            _ => self.fits_of_material::<3, 6>(around, strains, vertices),
        };
        self.around.iter().map(fits).collect()
    }

    /// The same for a material, with Q quadrature points in a triangle and C coefficients.
    fn fits_of_material<const Q: usize, const C: usize>(
        &self,
        around: &TrianglesAround,
        strains: &[Vector3<f64>],
        partition: Option<&Partition>,
    ) -> Result<Fits, PetscError> {
        let strains = strains.as_chunks::<Q>().0;
        let weights = around.weights.as_chunks::<C>().0.as_chunks::<Q>().0;
        let set_own = |fits: &mut Fits, vertex: usize| {
            let (range, mut sums) = (around.range(vertex), [[0.0; C]; 3]);
            for (weights, &t) in weights[range.clone()].iter().zip(&around.triangles[range]) {
                for (weights, strain) in weights.iter().zip(&strains[t]) {
                    (0..3).for_each(|i| (0..C).for_each(|k| sums[i][k] += weights[k] * strain[i]));
                }
            }
            fits.set(vertex, SMatrix::<f64, 3, C>::from_fn(|i, k| sums[i][k]).as_slice());
        };
        let width = 3 * C + 1;
        let mut fits = Fits { width, entries: vec![0.0; width * self.vertices.len()] };
        let update = |fits: &mut Fits| match partition {
            Some(partition) => partition.update(&mut fits.entries, width),
            None => Ok(()),
        };
        for vertex in (0..self.owned).filter(|&vertex| self.has_own_fit(around, vertex)) {
            set_own(&mut fits, vertex);
        }
        update(&mut fits)?;
        // The other vertices take the mean of their neighbours' fits. Corners, with one triangle, come second,
        // because their neighbours get fits in the first pass. Over more triangles a mean of means would extrapolate
        // too far.
        for most in [usize::MAX, 1] {
            let mean = |vertex: usize| {
                let neighbours = around.of(vertex).iter().flat_map(|&t| self.triangles[t]);
                let known = neighbours.filter_map(|other| Some((other, fits.get(other)?)));
                let at = |vertex: usize| self.vertices[vertex];
                let (count, sum) = known.fold((0.0, Fit::zeros()), |(n, sum), (other, fit)| {
                    (n + 1.0, sum + moved(&fit, at(other), at(vertex)))
                });
                (count > 0.0).then(|| (vertex, sum / count))
            };
            let left = around.few.iter().copied().filter(|&vertex| !fits.is_known(vertex));
            let left = left.filter(|&vertex| around.of(vertex).len() <= most);
            for (vertex, fit) in Vec::from_iter(left.filter_map(mean)) {
                fits.set(vertex, &fit.as_slice()[..3 * C]);
            }
            update(&mut fits)?;
        }
        // Other vertices, as in strips one triangle thick, take a fit of the strains' degree: one triangle suffices.
        for &vertex in &around.few {
            if !fits.is_known(vertex) {
                set_own(&mut fits, vertex);
            }
        }
        update(&mut fits)?;
        Ok(fits)
    }
}

/// The fits of all vertices to the strains of a material.
pub(crate) struct Fits {
    width: usize,
    /// Per vertex: the coefficients in turn, each with three components; then 1 if the fit is known, else 0.
    entries: Vec<f64>,
}

impl Fits {
    fn set(&mut self, vertex: usize, fit: &[f64]) {
        let entries = &mut self.entries[self.width * vertex..self.width * (vertex + 1)];
        entries[..fit.len()].copy_from_slice(fit);
        entries[fit.len()] = 1.0;
    }

    fn entries(&self, vertex: usize) -> &[f64] {
        &self.entries[self.width * vertex..self.width * (vertex + 1)]
    }

    fn is_known(&self, vertex: usize) -> bool {
        self.entries(vertex)[self.width - 1] > 0.0
    }

    fn get(&self, vertex: usize) -> Option<Fit> {
        let mut fit = Fit::zeros();
        let [entries @ .., _] = self.entries(vertex) else { return None };
        fit.as_mut_slice()[..entries.len()].copy_from_slice(entries);
        self.is_known(vertex).then_some(fit)
    }

    /// The fit at its vertex.
    pub(crate) fn at_vertex(&self, vertex: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.entries(vertex)[..3])
    }

    /// The fit of a vertex at a point with this offset from it, m.
    pub(crate) fn value(&self, vertex: usize, offset: [f64; 2]) -> Vector3<f64> {
        let monomials = monomials(offset);
        let terms = self.entries(vertex).chunks_exact(3).zip(&monomials);
        terms.fold(Vector3::zeros(), |sum, (of, monomial)| {
            sum + Vector3::new(of[0], of[1], of[2]) * *monomial
        })
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

/// Adds the `count` weights of each strain at the `samples` in the polynomial about `centre` that is nearest to them, in
/// least squares, with the first N coefficients: N is 1, 3 or 6 for the degrees 0, 1, 2.
fn fit<const N: usize>(
    centre: [f64; 2],
    samples: impl Iterator<Item = [f64; 2]> + Clone,
    count: usize,
    weights: &mut Vec<f64>,
) {
    let offset = |x: [f64; 2]| [x[0] - centre[0], x[1] - centre[1]];
    let square = |x: [f64; 2]| offset(x).iter().map(|d| d * d).sum::<f64>();
    let size = samples.clone().map(square).fold(0.0, f64::max).sqrt();
    let row = |x: [f64; 2]| -> SVector<f64, N> {
        monomials(offset(x).map(|x| x / size)).fixed_rows::<N>(0).into()
    };
    let mut normal = SMatrix::<f64, N, N>::zeros();
    samples.clone().map(row).for_each(|row| normal += row * row.transpose());
    // This makes the fit unique.
    let rounding = ROUNDING * normal.trace();
    (0..N).for_each(|i| normal[(i, i)] += rounding);
    let Some(factor) = normal.cholesky() else {
        weights.extend(samples.flat_map(|_| vec![0.0; count]));
        return;
    };
    for x in samples {
        let found = factor.solve(&row(x));
        let scaled = [0, 1, 1, 2, 2, 2].into_iter().zip(found.iter());
        let scaled = scaled.map(|(degree, of)| of * size.powi(-degree));
        weights.extend(scaled.chain([0.0; 6]).take(count));
    }
}

/// 1, x, y, x², xy, y².
fn monomials([x, y]: [f64; 2]) -> Vector6<f64> {
    Vector6::new(1.0, x, y, x * x, x * y, y * y)
}

/// A fit about `from` as a polynomial about `to`.
fn moved(fit: &Fit, from: [f64; 2], to: [f64; 2]) -> Fit {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let mut moved = *fit;
    moved.set_column(0, &(fit * monomials([x, y])));
    moved.set_column(1, &(fit.column(1) + 2.0 * x * fit.column(3) + y * fit.column(4)));
    moved.set_column(2, &(fit.column(2) + x * fit.column(4) + 2.0 * y * fit.column(5)));
    moved
}
