//! Infinitesimal rigid motions of a body, and their names in messages.

use super::Body;
use crate::mesh::place;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The infinitesimal rigid motion u(x) = a + θ e_z × (x − x̄), with x̄ the centroid of the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RigidMotion {
    /// a, m.
    translation: [f64; 2],
    /// θ, rad.
    rotation: f64,
    /// x̄, m.
    centre: [f64; 2],
    /// r, the body's radius of gyration, m.
    radius: f64,
}

impl RigidMotion {
    /// The motion with the coordinates v = (a_x, a_y, rθ): |v|² is the mean of |u|² over the body.
    pub fn new(body: &Body, v: [f64; 3]) -> Self {
        let (radius, [ax, ay, turn]) = (body.radius_of_gyration(), v);
        Self { translation: [ax, ay], rotation: turn / radius, centre: body.centroid, radius }
    }

    /// The motion nearest to the nodal displacements u, m, in ∫|·|²: a = ∫u/|Ω|,
    /// θ = ∫ (x − x̄) × u / ∫|x − x̄|². Collective.
    pub fn nearest(body: &Body, u: &[f64]) -> Self {
        let weights = &body.nodes.weights;
        let [fx, fy, moment] =
            resultant(body, |i| [weights[i] * u[2 * i], weights[i] * u[2 * i + 1]]);
        let rotation = moment / body.polar_inertia;
        Self {
            translation: [fx / body.area, fy / body.area],
            rotation,
            ..Self::new(body, [0.0; 3])
        }
    }

    /// Σ multiplier·motion of motions of one body.
    pub fn combination(body: &Body, terms: impl IntoIterator<Item = (f64, Self)>) -> Self {
        let mut sum = Self::new(body, [0.0; 3]);
        for (multiplier, Self { translation: [ax, ay], rotation, .. }) in terms {
            sum.translation[0] += multiplier * ax;
            sum.translation[1] += multiplier * ay;
            sum.rotation += multiplier * rotation;
        }
        sum
    }

    /// Whether it is no translation.
    pub fn is_rotation(&self) -> bool {
        let [ax, ay] = self.translation;
        self.rotation.abs() * self.radius > NEGLIGIBLE_MOTION * ax.hypot(ay)
    }

    /// The displacement at a point, m.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([ax, ay], [cx, cy]) = (self.translation, self.centre);
        [ax - self.rotation * (y - cy), ay + self.rotation * (x - cx)]
    }

    /// The displacements at all nodes, m (two entries per node).
    pub fn field(&self, body: &Body) -> Vec<f64> {
        body.nodes.points.iter().flat_map(|&x| self.at(x)).collect()
    }

    /// The work of forces with this [`resultant`], a·F + θM.
    pub fn work(&self, [fx, fy, moment]: [f64; 3]) -> f64 {
        let [ax, ay] = self.translation;
        ax * fx + ay * fy + self.rotation * moment
    }

    /// The largest nodal |·| of the motion, and of u minus the motion, m. Collective.
    pub fn max_norms(&self, body: &Body, u: &[f64]) -> [f64; 2] {
        let motion = self.field(body);
        let rest: Vec<_> = u.iter().zip(&motion).map(|(u, motion)| u - motion).collect();
        [motion, rest].map(|of| body.nodes.partition.max_norm(&of))
    }
}

/// The resultant (F_x, F_y) of nodal forces, N/m, and their moment about the centroid, N. Collective.
pub fn resultant(body: &Body, force: impl Fn(usize) -> [f64; 2]) -> [f64; 3] {
    let ([cx, cy], mut sums) = (body.centroid, [0.0; 3]);
    for (node, &[x, y]) in body.nodes.points[..body.nodes.partition.owned()].iter().enumerate() {
        let [fx, fy] = force(node);
        sums[0] += fx;
        sums[1] += fy;
        sums[2] += (x - cx) * fy - (y - cy) * fx;
    }
    body.comm().sum(&mut sums);
    sums
}

/// Components that move the body less than this, relative, do not count: a rotation about a point 1e4 times the body's
/// radius away is a translation to the eye.
const NEGLIGIBLE_MOTION: f64 = 1e-4;

impl fmt::Display for RigidMotion {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [ax, ay] = self.translation;
        let length = ax.hypot(ay);
        if self.is_rotation() {
            // The point at rest: a + θ e_z × (x − x̄) = 0. A slender bar is √12 r long.
            let [x, y] = self.centre;
            let at_rest = [x - ay / self.rotation, y + ax / self.rotation];
            let at_rest = place(12_f64.sqrt() * self.radius, at_rest);
            return write!(f, "the rotation about {at_rest}");
        }
        match [ax, ay].map(|a| a.abs() > NEGLIGIBLE_MOTION * length) {
            [true, false] => write!(f, "the horizontal translation"),
            [false, _] => write!(f, "the vertical translation"),
            _ => write!(f, "the translation along ({:.3}, {:.3})", ax / length, ay / length),
        }
    }
}
