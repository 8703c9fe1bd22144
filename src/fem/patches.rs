//! Polynomials fitted to the strains around each vertex.

use super::{Body, Cells, POINTS, Partition, for_elements, quadratic_values};
use crate::{ROUNDING, petsc::PetscError};
use nalgebra::{Matrix6x3, SMatrix, SVector, Vector3, Vector6};
use std::{iter, ops::Range};

/// Triangles needed to fit a polynomial at a vertex. A vertex with fewer takes the mean of the fits of its
/// neighbours.
///
/// Tuned on the 13 adapted runs. Half: 9 % more triangles, 16 times as many for `hertz` at 0.1. Twice: 5 % more
/// triangles, and a bar of 15 other scenes fails.
const TRIANGLES_TO_FIT: usize = 4;

/// A strain (ε_xx, ε_yy, 2ε_xy) as a polynomial about a vertex: the coefficients of 1, x, y, x², xy, y² (rows).
type Fit = Matrix6x3<f64>;

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
    /// At a jump of a load strains differ by the angle, at any distance: these vertices take the mean. See [`Body`].
    near_jumps: Vec<bool>,
    /// Per material: its triangles around each vertex.
    around: Vec<TrianglesAround>,
}

/// The triangles of one material around each vertex, vertex after vertex in one list.
#[derive(Debug)]
struct TrianglesAround {
    triangles: Vec<usize>,
    /// Per vertex: where its triangles end in the list.
    ends: Vec<usize>,
    /// Per quadrature point of the triangles in the list: the factors of its strain in the coefficients of the fit. There are 3
    /// for linear and 6 for quadratic elements.
    factors: Vec<f64>,
}

impl TrianglesAround {
    /// The triangles of a `material` of the body, without factors.
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
        Self { triangles, ends, factors: Vec::new() }
    }

    /// The places of the triangles of a vertex in the list.
    fn places(&self, vertex: usize) -> Range<usize> {
        vertex.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[vertex]
    }

    fn of(&self, vertex: usize) -> &[usize] {
        &self.triangles[self.places(vertex)]
    }
}

impl Patches {
    /// The patches of a body. Collective.
    pub(crate) fn new(body: &Body) -> Self {
        let samples: Vec<_> = for_elements!(body, cells => sample_points(body, &cells));
        let last = body.materials.iter().copied().max().unwrap_or(0);
        let last = body.vertices.partition.comm().max(f64::from(last)) as usize;
        let mut patches = Self {
            near_jumps: body.near_jumps.clone(),
            vertices: body.mesh.nodes.clone(),
            triangles: body.mesh.triangles.clone(),
            owned: body.vertices.partition.owned(),
            per_triangle: samples.len() / body.triangles.len(),
            around: (0..=last).map(|material| TrianglesAround::new(body, material)).collect(),
        };
        for material in 0..=last {
            patches.around[material].factors = patches.factors(&patches.around[material], &samples);
        }
        patches
    }

    /// The factors of the fits to strains at the `samples`, of as high a degree as the triangles of a vertex allow.
    fn factors(&self, around: &TrianglesAround, samples: &[[f64; 2]]) -> Vec<f64> {
        let (points, mut factors) = (self.per_triangle, Vec::new());
        for vertex in 0..self.owned {
            let own = around.of(vertex).iter().flat_map(|t| points * t..points * (t + 1));
            let (at, own) = (self.vertices[vertex], own.map(|q| samples[q]));
            match (points, self.has_own_fit(around, vertex)) {
                _ if self.is_near_jump(vertex) => fit::<1>(at, own, points, &mut factors),
                (1, true) => fit::<3>(at, own, points, &mut factors),
                (1, false) => fit::<1>(at, own, points, &mut factors),
                (_, true) => fit::<6>(at, own, points, &mut factors),
                (_, false) => fit::<3>(at, own, points, &mut factors),
            }
        }
        factors
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
        self.around.iter().map(|around| self.fits_of_material(around, strains, vertices)).collect()
    }

    fn fits_of_material(
        &self,
        around: &TrianglesAround,
        strains: &[Vector3<f64>],
        partition: Option<&Partition>,
    ) -> Result<Fits, PetscError> {
        let (points, coefficients) = (self.per_triangle, coefficients(self.per_triangle));
        let set_own = |fits: &mut Fits, vertex: usize| {
            let places = around.places(vertex);
            let factors = &around.factors[coefficients * points * places.start..];
            let own = around.triangles[places].iter().flat_map(|t| points * t..points * (t + 1));
            let [fit @ .., known] = fits.entries_mut(vertex) else { return };
            for (factors, q) in factors.chunks_exact(coefficients).zip(own) {
                for (coefficient, factor) in fit.chunks_exact_mut(3).zip(factors) {
                    (0..3).for_each(|i| coefficient[i] += factor * strains[q][i]);
                }
            }
            *known = 1.0;
        };
        let width = 3 * coefficients + 1;
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
            let left = (0..self.owned).filter(|&vertex| !fits.is_known(vertex));
            let left = left.filter(|&vertex| around.of(vertex).len() <= most);
            for (vertex, fit) in Vec::from_iter(left.filter_map(mean)) {
                let fit = fit.transpose();
                let known = fit.iter().take(width - 1).copied().chain([1.0]);
                fits.entries_mut(vertex).iter_mut().zip(known).for_each(|(to, from)| *to = from);
            }
            update(&mut fits)?;
        }
        // Other vertices, as in strips one triangle thick, take a fit of the strains' degree: one triangle suffices.
        for vertex in 0..self.owned {
            if !fits.is_known(vertex) {
                set_own(&mut fits, vertex);
            }
        }
        update(&mut fits)?;
        Ok(fits)
    }
}

/// The coefficients of a fit, with this number of quadrature points in a triangle.
fn coefficients(per_triangle: usize) -> usize {
    if per_triangle > 1 { 6 } else { 3 }
}

/// The fits of all vertices to the strains of a material.
pub(crate) struct Fits {
    width: usize,
    /// Per vertex: the coefficients in turn, each with three components; then 1 if the fit is known, else 0.
    entries: Vec<f64>,
}

impl Fits {
    fn entries_mut(&mut self, vertex: usize) -> &mut [f64] {
        &mut self.entries[self.width * vertex..self.width * (vertex + 1)]
    }

    fn entries(&self, vertex: usize) -> &[f64] {
        &self.entries[self.width * vertex..self.width * (vertex + 1)]
    }

    fn is_known(&self, vertex: usize) -> bool {
        self.entries(vertex)[self.width - 1] > 0.0
    }

    fn get(&self, vertex: usize) -> Option<Fit> {
        let entries = &self.entries(vertex)[..self.width - 1];
        let entries = entries.iter().copied().chain(iter::repeat(0.0));
        self.is_known(vertex).then(|| Fit::from_row_iterator(entries.take(18)))
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

/// Adds the factors of the strains at the `samples` in the polynomial about `centre` that is nearest to them, in least squares,
/// with the first N coefficients: N is 1, 3 or 6 for the degrees 0, 1, 2.
fn fit<const N: usize>(
    centre: [f64; 2],
    samples: impl Iterator<Item = [f64; 2]> + Clone,
    per_triangle: usize,
    factors: &mut Vec<f64>,
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
        factors.extend(samples.flat_map(|_| vec![0.0; coefficients(per_triangle)]));
        return;
    };
    for x in samples {
        let found = factor.solve(&row(x));
        let scaled = [0, 1, 1, 2, 2, 2].into_iter().zip(found.iter());
        let scaled = scaled.map(|(degree, of)| of * size.powi(-degree));
        factors.extend(scaled.chain([0.0; 6]).take(coefficients(per_triangle)));
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
    moved.set_row(0, &(monomials([x, y]).transpose() * fit));
    moved.set_row(1, &(fit.row(1) + 2.0 * x * fit.row(3) + y * fit.row(4)));
    moved.set_row(2, &(fit.row(2) + x * fit.row(4) + 2.0 * y * fit.row(5)));
    moved
}
