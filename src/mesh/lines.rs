//! Lines of a mesh, the boundary and the interfaces between its zones: their tangents, and where they are smooth.
//!
//! Lines are smooth between the points of the geometry. At such a point, and everywhere on a mesh without these points, the
//! tangents of both sides decide. A line follows the circle through a node a and the next points p and q on one side. With
//! complex numbers its tangent at a has the direction
//!
//! (p − a)(q − a)/(q − p),
//!
//! exactly for straight lines and circles. Elsewhere its error is about half of the angle to the tangent by the second and
//! the third point. The points are nodes, and the middles of edges if the mesh has curved ones.

use super::{Mesh, SAME_DIRECTION, sides};
use nalgebra::Complex;
use std::{collections::BTreeMap, f64::consts::PI};

/// Edges that turn by at most this angle, rad, may be chords of one curve, where the mesh does not say so. The tolerance
/// protects edges that turn by exactly 30°.
pub(crate) const CHORDS: f64 = PI / 6.0 + 1e-9;

/// The lines of a mesh.
pub struct Lines<'a> {
    mesh: &'a Mesh,
    /// Edges that turn by more than this angle, rad, meet in a corner although their neighbours turn as much: on a mesh of
    /// gmsh, which divides circles into at least seven edges; without points of the geometry.
    largest_turn: f64,
    /// Tangents at most at this angle, rad, are one. Without points of the geometry, it protects lines with coordinates of
    /// few digits.
    largest_kink: f64,
    /// Per node on a line: the other ends of its edges on lines.
    pub ends: BTreeMap<usize, Vec<usize>>,
}

impl<'a> Lines<'a> {
    /// The boundary, and the interfaces between triangles of different zones.
    pub fn new<Z: PartialEq>(mesh: &'a Mesh, zone: impl Fn(usize) -> Z) -> Self {
        let mut ends = BTreeMap::<usize, Vec<usize>>::new();
        for both in sides(&mesh.triangles).chunk_by(|a, b| a.ends == b.ends) {
            let [a, b] = both[0].edge();
            if both.len() == 1 || zone(both[0].triangle()) != zone(both[1].triangle()) {
                ends.entry(a).or_default().push(b);
                ends.entry(b).or_default().push(a);
            }
        }
        let (largest_turn, largest_kink) = match mesh.points.is_empty() {
            true => (CHORDS, PI / 90.0),
            false => (PI / 3.0 + 0.01, SAME_DIRECTION),
        };
        Self { mesh, largest_turn, largest_kink, ends }
    }

    /// The boundary.
    pub fn boundary(mesh: &'a Mesh) -> Self {
        Self::new(mesh, |_| ())
    }

    /// Are some straight edges chords of curves? The tangents at their ends then have other directions.
    pub fn have_chords(&self) -> bool {
        let turns = |a: usize, b: &usize| self.angle(a, *b).abs() > SAME_DIRECTION;
        self.ends.iter().any(|(a, others)| others.iter().any(|b| turns(*a, b)))
    }

    /// The angle, rad, from the chord of the edge ab to its tangent at a, counter-clockwise.
    pub(super) fn angle(&self, a: usize, b: usize) -> f64 {
        let [x, y] = self.tangent(a, b);
        (Complex::new(x, y) * (self.point(b) - self.point(a)).conj()).arg()
    }

    /// Is the line from p over the node to q smooth there?
    pub fn is_smooth(&self, node: usize, [p, q]: [usize; 2]) -> bool {
        let is_known = !self.mesh.points.is_empty();
        if !self.turns_little(node, [p, q]) {
            return false;
        }
        if is_known && !self.mesh.points.contains(&node) {
            return true;
        }
        let [(a, of_a), (b, of_b)] = [p, q].map(|end| self.estimate(node, end));
        // Without the points of a geometry, a corner of the line next to p, or next to q, spoils the tangent on that side. The
        // line is then smooth at the node if the tangent of the other side is that of the circle through p, the node and q.
        let middle = self.circle(node, [p, q].map(|end| self.point(end)));
        let follows = turn(a, -middle) - of_a <= 0.5 * self.largest_kink
            || turn(b, middle) - of_b <= 0.5 * self.largest_kink;
        turn(a, b) - of_a - of_b <= self.largest_kink || (!is_known && follows)
    }

    /// Is the node on a single line that has a corner there?
    pub fn is_corner(&self, node: usize) -> bool {
        matches!(self.ends.get(&node).map(Vec::as_slice), Some(&[p, q]) if !self.is_smooth(node, [p, q]))
    }

    /// The direction in which the line with the edge ab, or another edge ab, leaves a. Where a line is smooth, its two
    /// directions are opposite.
    pub fn tangent(&self, a: usize, b: usize) -> [f64; 2] {
        let ends = self.ends.get(&a).map_or(&[][..], Vec::as_slice);
        let tangent = match *ends {
            _ if !ends.contains(&b) => self.chord(a, b),
            [p, q] if self.is_smooth(a, [p, q]) => {
                let (own, of_own) = self.estimate(a, b);
                let (opposite, of_opposite) = self.estimate(a, if p == b { q } else { p });
                // The estimate with the smaller error counts more: beside a corner, the other one is spoiled.
                if of_own + of_opposite > 0.0 {
                    own * of_opposite - opposite * of_own
                } else {
                    own - opposite
                }
            }
            _ => self.estimate(a, b).0,
        };
        [tangent.re, tangent.im]
    }

    /// The possible error, rad, of the tangent of the line ab at a.
    pub fn tangent_error(&self, a: usize, b: usize) -> f64 {
        self.estimate(a, b).1
    }

    /// The unit tangent at a by the points after a on the line ab, and its possible error, rad.
    fn estimate(&self, a: usize, b: usize) -> (Complex<f64>, f64) {
        match self.points(a, b)[..] {
            [p, q, r] => {
                let [tangent, farther] = [[p, q], [q, r]].map(|points| self.circle(a, points));
                (tangent, turn(tangent, -farther))
            }
            [p, q] => {
                let tangent = self.circle(a, [p, q]);
                let is_known = !self.mesh.points.is_empty();
                (tangent, if is_known { 0.0 } else { turn(tangent, -self.chord(a, b)) })
            }
            _ => match self.after(b, a) {
                Some(before) => (self.circle(a, [b, before].map(|node| self.point(node))), 0.0),
                None => (self.chord(a, b), 0.0),
            },
        }
    }

    /// The unit tangent at a, towards p, of the circle through a, p and q.
    fn circle(&self, a: usize, [p, q]: [Complex<f64>; 2]) -> Complex<f64> {
        let tangent = (p - self.point(a)) * (q - self.point(a)) / (q - p);
        tangent / tangent.norm()
    }

    /// At most three points after a on the line ab, as far as it is smooth.
    fn points(&self, a: usize, b: usize) -> Vec<Complex<f64>> {
        let (mut points, mut edge) = (Vec::new(), Some([a, b]));
        while let Some([from, to]) = edge.filter(|_| points.len() < 3) {
            let middle = (!self.mesh.curved.is_empty()).then(|| self.mesh.midpoint([from, to]));
            points.extend(middle.map(|[x, y]| Complex::new(x, y)));
            points.push(self.point(to));
            edge = self.after(from, to).map(|next| [to, next]);
        }
        points.truncate(3);
        points
    }

    /// The node after b on the line ab, if the line does not end or turn there.
    fn after(&self, a: usize, b: usize) -> Option<usize> {
        let &[p, q] = self.ends.get(&b)?.as_slice() else { return None };
        let goes_on = !self.mesh.points.contains(&b) && self.turns_little(b, [p, q]);
        goes_on.then_some(if p == a { q } else { p })
    }

    /// Does the line from p over the node to q turn there by so little that it may be smooth? Without points of the geometry,
    /// two sides of several edges each, which are straight, meet in a corner.
    fn turns_little(&self, node: usize, [p, q]: [usize; 2]) -> bool {
        let turns =
            |node: usize, [p, q]: [usize; 2]| turn(self.chord(node, p), self.chord(node, q));
        let goes_straight = |end: usize| match self.ends.get(&end).map(Vec::as_slice) {
            Some(&[x, y]) => turns(end, [x, y]) <= SAME_DIRECTION,
            _ => false,
        };
        let (angle, is_known) = (turns(node, [p, q]), !self.mesh.points.is_empty());
        let is_small = is_known || angle <= self.largest_kink;
        angle <= self.largest_turn && (is_small || !(goes_straight(p) && goes_straight(q)))
    }

    /// The unit direction in which the edge ab, as a straight line or an arc, leaves a.
    fn chord(&self, a: usize, b: usize) -> Complex<f64> {
        let [x, y] = self.mesh.direction(a, b);
        let chord = Complex::new(x, y);
        chord / chord.norm()
    }

    fn point(&self, node: usize) -> Complex<f64> {
        let [x, y] = self.mesh.nodes[node];
        Complex::new(x, y)
    }
}

/// The angle, rad, by which a line turns that leaves a node in the directions a and b.
fn turn(a: Complex<f64>, b: Complex<f64>) -> f64 {
    (-a * b.conj()).arg().abs()
}
