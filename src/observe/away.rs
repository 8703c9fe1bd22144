//! The region that is at least the length `away` of the scene from all singular points.
//!
//! The stress is steep around a singular point C, so its extremes lie on the circle of the radius `away` around it. They are
//! taken at the nodes outside all circles, where a straight part P + τ(Q − P) of a side of a triangle crosses one, and in the
//! middles of the arcs between:
//!
//! |P + τ(Q − P) − C| = `away`,   0 < τ < 1.
//!
//! The region is the same on all meshes, and at all times: a corner of a foundation counts even while it is in contact.

use crate::{
    mesh::{TIES, distance, twice_area},
    problem::DiscreteProblem,
    scene::SceneError,
};

/// The region of the problem's materials that is away from singular points.
#[derive(Debug, Clone, Default)]
pub(super) struct Region {
    /// The singular points, m.
    centres: Vec<[f64; 2]>,
    /// The length `away` per material, m; `None` for materials without one.
    radii: Vec<Option<f64>>,
}

impl Region {
    /// The region of an undivided problem.
    ///
    /// # Errors
    /// A material has no node there.
    pub(super) fn new(problem: &DiscreteProblem) -> Result<Self, SceneError> {
        let radii = problem.scene().distances_of_extremes();
        if radii.iter().all(Option::is_none) {
            return Ok(Self::default());
        }
        let points = problem.singular_points().into_iter();
        let mut region = Self { centres: points.map(|point| point.at).collect(), radii };
        // Per material of the body: has it a node in the region?
        let (body, mut has_nodes) = (&problem.body, vec![None; region.radii.len()]);
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let material = body.material(t);
            let mut places = nodes.iter().map(|&node| body.mesh.nodes[node]);
            *has_nodes[material].get_or_insert(false) |=
                places.any(|at| region.contains(material, at));
        }
        let is_empty = |of: &usize| region.has(of) && has_nodes[*of] == Some(false);
        let empty = (0..has_nodes.len()).filter(is_empty);
        problem.scene().check_distances(&Vec::from_iter(empty))?;
        let of_body = region.radii.iter_mut().zip(has_nodes);
        of_body.for_each(|(radius, has_nodes)| *radius = radius.filter(|_| has_nodes.is_some()));
        Ok(region)
    }

    /// Has any material of the body a length `away`?
    pub(super) fn exists(&self) -> bool {
        self.radii.iter().any(Option::is_some)
    }

    /// Has the material a length `away`?
    pub(super) fn has(&self, material: &usize) -> bool {
        self.radii.get(*material).is_some_and(Option::is_some)
    }

    /// Is a place of the material in the region?
    pub(super) fn contains(&self, material: usize, at: [f64; 2]) -> bool {
        let Some(Some(radius)) = self.radii.get(material) else { return false };
        self.centres.iter().all(|&centre| distance(centre, at) >= TIES * radius)
    }

    /// The points of the circles on the sides of a convex polygon in the material, and in the middles of the arcs between two of
    /// them within the polygon.
    pub(super) fn on_circles(&self, material: usize, polygon: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let Some(Some(radius)) = self.radii.get(material) else { return Vec::new() };
        let sides = || (0..polygon.len()).map(|i| [polygon[i], polygon[(i + 1) % polygon.len()]]);
        let is_inside = |at: &[f64; 2]| sides().all(|[p, q]| twice_area(p, q, *at) >= 0.0);
        let mut found = Vec::new();
        for &centre in &self.centres {
            let ends: Vec<_> = sides().flat_map(|side| crossings(side, centre, *radius)).collect();
            let pairs =
                ends.iter().enumerate().flat_map(|(i, p)| ends[..i].iter().map(move |q| [p, q]));
            let middle = |[p, q]: [&[f64; 2]; 2]| {
                let [x, y] = [0, 1].map(|k| p[k] + q[k] - 2.0 * centre[k]);
                let scale = radius / x.hypot(y);
                [centre[0] + scale * x, centre[1] + scale * y]
            };
            let middles: Vec<_> = pairs.map(middle).filter(is_inside).collect();
            found.extend(ends.into_iter().chain(middles));
        }
        found.retain(|at| self.contains(material, *at));
        found
    }
}

/// The points at which the segment from p to q crosses a circle.
fn crossings(
    [p, q]: [[f64; 2]; 2],
    [x, y]: [f64; 2],
    radius: f64,
) -> impl Iterator<Item = [f64; 2]> {
    let (from, along) = ([p[0] - x, p[1] - y], [q[0] - p[0], q[1] - p[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let middle = -(from[0] * along[0] + from[1] * along[1]) / square;
    let [dx, dy] = [0, 1].map(|k| from[k] + middle * along[k]);
    // NaN if the segment passes by.
    let half = ((radius * radius - dx * dx - dy * dy) / square).sqrt();
    let parts =
        [middle - half, middle + half].into_iter().filter(|part| *part > 0.0 && *part < 1.0);
    parts.map(move |part| [p[0] + part * along[0], p[1] + part * along[1]])
}

impl DiscreteProblem {
    /// A length `away` for this body, m: a quarter of the least distance between two singular points, so that their circles are
    /// far apart; for a single point of the radius of gyration. `None` without singular points.
    pub fn proposed_distance(&self) -> Option<f64> {
        let points = Vec::from_iter(self.singular_points().into_iter().map(|point| point.at));
        let pairs = points.iter().flat_map(|p| points.iter().map(|q| distance(*p, *q)));
        let least = pairs.filter(|length| *length > 0.0).reduce(f64::min);
        (!points.is_empty()).then(|| 0.25 * least.unwrap_or(self.body.radius_of_gyration()))
    }
}
