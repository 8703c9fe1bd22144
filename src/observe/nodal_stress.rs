//! Stresses at the nodes, as engineers look at them: continuous within a material.

use super::{
    ObservedProblem, Rays, Value,
    away::Region,
    corners::{Known, sizes},
    figures::greatest,
};
use crate::{
    fem::{Fits, Partition, Patches, for_elements},
    mesh::{distance, twice_area},
    model::Material,
    petsc::PetscError,
    problem::{DiscreteProblem, State},
};
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap as HashMap;
use std::sync::Arc;

/// σ = η_*(ζ) 𝒜ε* at the nodes of this rank, with the recovered strains ε*
/// ([`RecoveredStrains`](crate::estimate::RecoveredStrains)).
///
/// A node where materials meet is several points, one for each material. The first point of each node has the
/// node's number; the others follow. This value needs neither PETSc nor the problem, so that a thread can use it.
#[derive(Debug)]
pub struct NodalStress {
    patches: Arc<Patches>,
    pub(crate) points: Vec<Point>,
    /// The points of this rank away from singular points, and those of its triangles on the border of this region.
    pub(crate) away: Vec<Point>,
    /// The points of this rank's triangles, each with the nodes of an element of u.
    pub cells: Vec<usize>,
    pub(super) materials: Vec<(Material, Matrix3<f64>)>,
    /// Per vertex: the length of its longest edge, m.
    longest: Vec<f64>,
}

/// A node, or another point of a triangle, as a point of one material.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    node: usize,
    pub(crate) material: usize,
    pub(crate) at: [f64; 2],
    /// The vertices whose fits give its strain, and their weights: itself alone, the ends of its side, or those of its triangle with
    /// the barycentric coordinates.
    pub(crate) ends: [usize; 3],
    weights: [f64; 3],
}

/// The strains and ζ from which the stresses of a state are computed.
pub struct Strained {
    /// ε(u) at the quadrature points.
    pub(crate) strains: Vec<Vector3<f64>>,
    /// ζ at the vertices, and ζ_*.
    zeta: Vec<f64>,
    threshold: f64,
}

impl NodalStress {
    /// The nodes of the body of `problem`, and the points of its `region` away from singular points. Collective.
    pub(super) fn new(problem: &DiscreteProblem, region: &Region) -> Self {
        let body = &problem.body;
        let unset = |&at: &[f64; 2]| {
            let (node, material) = (0, usize::MAX);
            Point { node, material, at, ends: [0; 3], weights: [1.0, 0.0, 0.0] }
        };
        let mut points: Vec<Point> = body.nodes.points.iter().map(unset).collect();
        let mut copies = HashMap::default();
        let mut cells = Vec::new();
        let (count, nodes) = for_elements!(body, cells => cells.flat_nodes());
        for (t, vertices) in body.mesh.triangles.iter().enumerate() {
            let material = body.material(t);
            for (i, &node) in nodes[count * t..count * (t + 1)].iter().enumerate() {
                let (at, first) = (body.nodes.points[node], vertices[i % 3]);
                let ends = [first, vertices[if i < 3 { i } else { (i + 1) % 3 }], first];
                let weights = if i < 3 { [1.0, 0.0, 0.0] } else { [0.5, 0.5, 0.0] };
                let point = Point { node, material, at, ends, weights };
                let index = match points[node].material {
                    usize::MAX => node,
                    first if first == material => node,
                    _ => *copies.entry((node, material)).or_insert(points.len()),
                };
                match points.get_mut(index) {
                    Some(known) => *known = point,
                    None => points.push(point),
                }
                if t < body.own_triangles {
                    cells.push(index);
                }
            }
        }
        let materials = problem.elasticity.materials().map(|m| (*m, m.stiffness())).collect();
        let is_away = |of: &&Point| region.contains(of.material, of.at);
        let mut away: Vec<Point> = points.iter().filter(is_away).cloned().collect();
        for of in cells.chunks_exact(count).map(|of| of.iter().map(|&index| &points[index])) {
            away.extend(on_circles(&Vec::from_iter(of), region));
        }
        let mut longest = vec![0.0; body.mesh.nodes.len()];
        for &[a, b, c] in &body.mesh.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                let length = distance(body.mesh.nodes[p], body.mesh.nodes[q]);
                [p, q].iter().for_each(|&of| longest[of] = length.max(longest[of]));
            }
        }
        Self { patches: Arc::clone(body.patches()), points, away, cells, materials, longest }
    }

    /// The node of each point.
    pub fn nodes(&self) -> impl Iterator<Item = usize> + Clone {
        self.points.iter().map(|point| point.node)
    }

    /// The coordinates of the points, m.
    pub fn places(&self) -> Vec<[f64; 2]> {
        self.points.iter().map(|point| point.at).collect()
    }

    /// The places of the vertices whose fits give the stress at a point, m.
    pub(super) fn ends_of(&self, point: &Point) -> [[f64; 2]; 3] {
        point.ends.map(|end| self.patches.vertices[end])
    }

    /// The length of the longest edge at a point, over its distance from another one.
    pub(super) fn relative_size(&self, point: &Point, from: [f64; 2]) -> f64 {
        let lengths = point.ends.iter().map(|&end| self.longest[end]);
        lengths.fold(0.0, f64::max) / distance(point.at, from)
    }

    /// The strains and ζ of `state`, from which its stresses are computed.
    pub fn strained(problem: &DiscreteProblem, state: &State) -> Strained {
        let (strains, zeta) = (problem.body.strains(&state.u), state.zeta.clone());
        Strained { strains, zeta, threshold: problem.threshold() }
    }

    /// The stresses (σ_xx, σ_yy, σ_xy, σ_zz) at the points, Pa. `vertices` is the division of the vertices among
    /// several ranks. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn stresses(
        &self,
        strained: &Strained,
        vertices: Option<&Partition>,
    ) -> Result<Vec<[f64; 4]>, PetscError> {
        let fits = self.patches.fits(&strained.strains, vertices)?;
        Ok(self.points.iter().map(|point| self.stress(point, strained, &fits)).collect())
    }

    /// All points, of both lists.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().chain(&self.away)
    }

    /// The stress at a point, with the fits of the strains.
    #[inline(always)]
    fn stress(&self, point: &Point, strained: &Strained, fits: &[Fits]) -> [f64; 4] {
        let ([x, y], [first, ..], fits) = (point.at, point.ends, &fits[point.material]);
        let used =
            || point.ends.into_iter().zip(point.weights).filter(|(_, weight)| *weight != 0.0);
        let value = |(end, weight): (usize, f64)| {
            let [vx, vy] = self.patches.vertices[end];
            weight * fits.value(end, [x - vx, y - vy])
        };
        let strain = match point.weights[0] == 1.0 {
            true => fits.at_vertex(first),
            false => used().map(value).sum(),
        };
        let (material, stiffness) = &self.materials[point.material];
        let zeta: f64 = used().map(|(end, weight)| weight * strained.zeta[end]).sum();
        let stress = stiffness * strain * zeta.clamp(strained.threshold, 1.0);
        [stress[0], stress[1], stress[2], material.out_of_plane(&stress)]
    }
}

/// The points of the region's circles in an element with these points: three vertices and, if it is quadratic, the middles of its
/// sides, which divide them into straight parts.
fn on_circles(element: &[&Point], region: &Region) -> Vec<Point> {
    let corners @ [a, b, c] = [0, 1, 2].map(|i| element[i].at);
    let around = if element.len() > 3 { &[0, 3, 1, 4, 2, 5][..] } else { &[0, 1, 2] };
    let around = Vec::from_iter(around.iter().map(|&i| element[i].at));
    let (first, ends) = (element[0], [0, 1, 2].map(|i| element[i].ends[0]));
    let point = |at| Point {
        node: first.node,
        material: first.material,
        at,
        ends,
        weights: [0, 1, 2].map(|i| {
            let [p, q] = [corners[(i + 1) % 3], corners[(i + 2) % 3]];
            twice_area(p, q, at) / twice_area(a, b, c)
        }),
    };
    region.on_circles(first.material, &around).into_iter().map(point).collect()
}

impl ObservedProblem {
    /// The nodes of the body as points of stresses. Collective.
    pub fn nodal_stress(&self) -> &Arc<NodalStress> {
        self.nodal_stress.get_or_init(|| NodalStress::new(self, &self.away).into())
    }

    /// The largest von Mises stress and σ₁, and the smallest σ₂, Pa, of the body and of each of several materials; then the
    /// same away from singular points. At corners with `rays` these count instead of the fits. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(crate) fn extreme_stresses(
        &self,
        of: &Strained,
        rays: &[Rays],
    ) -> Result<[Vec<[Value; 3]>; 2], PetscError> {
        let (nodal, body) = (self.nodal_stress(), &self.body);
        let fits = nodal.patches.fits(&of.strains, Some(&body.vertices.partition))?;
        let comm = body.comm();
        let sizes_at = |point: &Point| sizes(nodal.stress(point, of, &fits));
        let corners = Known::all(self, rays, |i| sizes_at(&nodal.points[i]));
        // The extremes over a list of points, whose numbers begin with `first`, and over the corners in their region.
        let extremes = |first: usize, points: &[Point], is_in: &dyn Fn(usize, [f64; 2]) -> bool| {
            let mut largest = vec![[(f64::NEG_INFINITY, [0.0; 2]); 3]; nodal.materials.len()];
            for (i, point) in (first..).zip(points) {
                if corners.iter().any(|corner| corner.is_near(i, point)) {
                    continue;
                }
                let values = sizes_at(point);
                for (k, largest) in largest[point.material].iter_mut().enumerate() {
                    let counts = |of: &Known| of.is_exceeded(nodal, point, k, values[k]);
                    if values[k] >= largest.0 && corners.iter().all(counts) {
                        *largest = (values[k], point.at);
                    }
                }
            }
            for corner in &corners {
                for (material, largest) in largest.iter_mut().enumerate() {
                    for (largest, own) in largest.iter_mut().zip(corner.extremes[material]) {
                        if own > largest.0 && is_in(material, corner.at) {
                            *largest = (own, corner.at);
                        }
                    }
                }
            }
            let extremes = |parts: &[[(f64, [f64; 2]); 3]]| {
                let [von_mises, most, least] =
                    [0, 1, 2].map(|k| greatest(comm, parts.iter().map(|part| part[k])));
                [von_mises, most, Value { value: -least.value, ..least }]
            };
            let parts = if self.materials.len() > 1 { &self.materials[..] } else { &[] };
            let parts = parts.iter().map(|(number, _)| extremes(&largest[*number..=*number]));
            [extremes(&largest)].into_iter().chain(parts).collect()
        };
        let is_away = |material: usize, at: [f64; 2]| self.away.contains(material, at);
        let whole = extremes(0, &nodal.points, &|_, _| true);
        Ok([whole, extremes(nodal.points.len(), &nodal.away, &is_away)])
    }
}

/// The principal stresses σ₁ ≥ σ₂ in the plane, Pa.
pub fn principal([xx, yy, xy, _]: [f64; 4]) -> [f64; 2] {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = (half * half + xy * xy).sqrt();
    [mean + radius, mean - radius]
}

/// The direction of σ₁, a unit vector with x ≥ 0.
pub fn principal_direction([xx, yy, xy, _]: [f64; 4]) -> [f64; 2] {
    let (sine, cosine) = (0.5 * xy.atan2(0.5 * (xx - yy))).sin_cos();
    [cosine, sine]
}
