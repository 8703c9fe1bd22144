//! Points of the boundary at which stresses are singular: they grow without bound as the mesh is refined.
//!
//! In a corner with the interior angle ω, stresses are singular (Williams, J. Appl. Mech. 19, 1952) if
//!
//! - ω > 180° and both sides have the same condition;
//! - both sides slide without friction and ω > 90°, except on a smooth boundary (the exponent is π/ω − 1);
//! - one side is clamped and the other one free, as open contact is, and sin² ω > 1/(1 + ν) in plane stress, 1 − ν
//!   in plane strain, or ω > 90° (61° and 57° for ν = 0.3; the exponent 1 in Williams's equation);
//! - one side slides without friction on a support and the other one is free, and ω > 90°;
//! - two materials meet there (Bogy, J. Appl. Mech. 35, 1968; for most pairs of materials), except at a right angle
//!   to a support without friction.

use super::DiscreteProblem;
use crate::{
    mesh::CORNER_ANGLE,
    model::{Material, Plane},
    scene::Condition,
};
use std::collections::BTreeMap;

/// A point with singular stresses.
#[derive(Debug, Clone, PartialEq)]
pub struct Singular {
    /// The point, m.
    pub at: [f64; 2],
    /// Stresses nearer than this are large because of it: the length of the longest edge there, m.
    pub radius: f64,
    /// What it is, as in "the end of `clamp`".
    pub name: String,
}

/// The condition on a side of a corner. The order is that of constraint.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Support {
    Free,
    /// Sliding where the contact is closed, and free where it is open.
    Contact,
    Sliding,
    Clamped,
}

impl Support {
    fn slides(self) -> bool {
        matches!(self, Self::Contact | Self::Sliding)
    }
}

/// A side of a corner: its edge, its support, and the name of the supporting boundary.
type Side<'a> = ([usize; 2], Support, Option<&'a str>);

/// Angles, in degrees, above which stresses are singular. Corners of a polygon with smooth sides turn by less than
/// `SMOOTH`.
const SMOOTH: f64 = 10.0;
const SLIDING: f64 = 90.0 + SMOOTH;

/// The angle, in degrees, above which stresses at the end of a clamp are singular.
fn clamped(Material { poisson, plane, .. }: Material) -> f64 {
    let square = match plane {
        Plane::Stress => 1.0 / (1.0 + poisson),
        Plane::Strain => 1.0 - poisson,
    };
    square.min(1.0).sqrt().asin().to_degrees()
}

impl DiscreteProblem {
    /// The points of the boundary of the whole body with singular stresses.
    pub fn singular_points(&self) -> Vec<Singular> {
        let mesh = self.mesh();
        let boundary = mesh.boundary_edges();
        let (angles, found) = self.corner_angles(&boundary);
        let supports = self.supports_of_edges();
        let mut sides = BTreeMap::<usize, Vec<Side>>::new();
        for &edge in &boundary {
            let (support, name) = supports.get(&edge).copied().unwrap_or((Support::Free, None));
            edge.iter()
                .for_each(|node| sides.entry(*node).or_default().push((edge, support, name)));
        }
        let singular = |(node, sides): (usize, Vec<Side>)| {
            let (material, of_first) = *found.get(&node)?;
            let of_first = of_first.to_degrees() / (sides.len() / 2).max(1) as f64;
            let angle = angles[node].to_degrees() / (sides.len() / 2).max(1) as f64;
            let (_, most, name) = *sides.iter().max_by_key(|(_, support, _)| *support)?;
            let is_same = |other: Support| other == most || (other.slides() && most.slides());
            let same = sides.iter().all(|(_, support, _)| is_same(*support));
            let is_free = sides.iter().any(|(_, support, _)| *support <= Support::Contact);
            // An interface at a right angle to a smooth frictionless support continues in its mirror image.
            let mirrored = same && most.slides() && (of_first - 90.0).abs() <= SMOOTH;
            let two_materials = of_first < angle - SMOOTH && !mirrored;
            let is_smooth = (angle - 180.0).abs() <= CORNER_ANGLE.to_degrees();
            let limit = match most {
                _ if same && most.slides() && is_smooth => f64::INFINITY,
                _ if most.slides() => SLIDING,
                _ if same => 180.0 + SMOOTH,
                _ if is_free => clamped(material),
                _ => SLIDING,
            };
            let length = |(edge, ..): &([usize; 2], _, _)| mesh.edge_normal(*edge).1;
            (angle > limit || two_materials).then(|| Singular {
                at: mesh.nodes[node],
                radius: sides.iter().map(length).fold(0.0, f64::max),
                name: match name.filter(|_| !same) {
                    _ if two_materials => "the end of an interface of two materials".to_owned(),
                    Some(name) => format!("the end of `{name}`"),
                    None if most.slides() => {
                        format!("a corner of `{}`", name.unwrap_or_default())
                    }
                    None => "a re-entrant corner".to_owned(),
                },
            })
        };
        sides.into_iter().filter_map(singular).collect()
    }

    /// The interior angle at each node of the `boundary`, rad, NaN elsewhere; and at these nodes the elastic constants of
    /// the first triangle with the angle in which they hold.
    fn corner_angles(
        &self,
        boundary: &[[usize; 2]],
    ) -> (Vec<f64>, BTreeMap<usize, (Material, f64)>) {
        let mesh = self.mesh();
        let mut angles = vec![f64::NAN; mesh.nodes.len()];
        let materials: Vec<Material> = self.scene().materials().collect();
        let numbers = self.scene().materials_of(mesh);
        let mut found = BTreeMap::<usize, (Material, f64)>::new();
        boundary.iter().flatten().for_each(|&node| angles[node] = 0.0);
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            for i in 0..3 {
                if angles[triangle[i]].is_nan() {
                    continue;
                }
                let [a, b, c] = [0, 1, 2].map(|k| triangle[(i + k) % 3]);
                let [p, q] = [b, c].map(|end| mesh.direction(a, end));
                let turn = (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
                angles[triangle[i]] += turn;
                let own = materials[numbers.get(t).map_or(0, |&number| number as usize)];
                let (first, of_first) = found.entry(triangle[i]).or_insert((own, 0.0));
                if own.stiffness() == first.stiffness() {
                    *of_first += turn;
                }
            }
        }
        (angles, found)
    }

    /// The supported edges of the boundary, with the names of their curves.
    fn supports_of_edges(&self) -> BTreeMap<[usize; 2], (Support, Option<&str>)> {
        let mut supports = BTreeMap::new();
        for boundary in &self.scene().boundaries {
            let support = boundary.conditions.iter().map(|condition| match condition {
                Condition::Displacement([Some(_), Some(_)]) => Support::Clamped,
                Condition::Displacement(_) | Condition::Symmetry => Support::Sliding,
                Condition::Gap(_) => Support::Contact,
                Condition::Load(_) => Support::Free,
            });
            let support = support.max().unwrap_or(Support::Free);
            let curve = self.mesh().curves.get(&boundary.name);
            for edge in curve.iter().flat_map(|curve| &curve.edges) {
                let known = supports.entry(*edge).or_insert((Support::Free, None));
                if support > known.0 {
                    *known = (support, Some(&*boundary.name));
                }
            }
        }
        supports
    }
}
