//! Points with singular stresses: they grow without bound as the mesh is refined.
//!
//! There sectors of materials meet. Near such a point u = r^λ (U, V) and σ = r^(λ−1) (σ_rr, σ_rθ, σ_θθ), with functions of
//! the angle θ (Williams, J. Appl. Mech. 19, 1952; Bogy, J. Appl. Mech. 35, 1968). With σ_θθ = d (ε_θθ + ν ε_rr) and
//! E = d (1 − ν²), Hooke's law and equilibrium are the system z′ = A(λ) z for z = (U, V, σ_rθ, σ_θθ):
//! U′ = (1 − λ) V + σ_rθ/μ, V′ = −(1 + νλ) U + σ_θθ/d, σ_rθ′ = −λ²E U + (1 − νλ) σ_θθ, σ_θθ′ = −(1 + λ) σ_rθ.
//!
//! z is continuous at interfaces. Sectors with the angles α₁, α₂, … transfer it by T = … exp(α₂A₂) exp(α₁A₁). The sides
//! have conditions B z = 0 and C z = 0, so that det(B; CT) = 0. Inside the body z returns to itself: det(T − I) = 0.

use crate::{
    mesh::Lines,
    problem::{DiscreteProblem, jump, load_jumps},
    scene::{Boundary, Condition},
};
use nalgebra::{Complex, Matrix2x4, Matrix3, Matrix4};
use rustc_hash::FxHashMap as HashMap;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A point with singular stresses.
#[derive(Debug, Clone, PartialEq)]
pub struct Singular {
    /// The point, m.
    pub at: [f64; 2],
    /// The distance within which the point makes stresses large, m: the length of the longest edge at the point.
    pub radius: f64,
    /// The kind of the point, as in "the end of `clamp`".
    pub name: String,
    /// Is it singular only while contact is open there?
    pub is_open: bool,
}

/// A condition on an edge, and its boundary.
pub(super) type Support<'a> = (&'a Condition, &'a Boundary);

/// A bisection that raises an extreme by less than this fraction shows no singularity.
pub(crate) const SEEN: f64 = 0.02;
/// Bounds of Re λ and |Im λ|. Above 0.975 a bisection raises the stress by less than [`SEEN`]; λ = 0 is a rigid motion.
const LAMBDA: [f64; 3] = [0.03, 0.975, 1.5];
/// Number of parts of each side of this rectangle.
const PARTS_OF_SIDE: usize = 48;
/// Are stresses singular where sectors (stiffness and angle, rad) meet, with conditions on two sides, or inside the body?
/// The determinant is real on the real axis. So along the half of the rectangle's border above this axis its argument changes by π times
/// the number of its roots inside (argument principle).
fn is_singular(sectors: &[(Matrix3<f64>, f64)], sides: Option<[Matrix2x4<f64>; 2]>) -> bool {
    let unit: f64 = sectors.iter().map(|(stiffness, _)| stiffness[(2, 2)]).sum();
    let determinant = |l: Complex<f64>| {
        let transfer = sectors.iter().fold(Matrix4::identity(), |transfer, (stiffness, angle)| {
            let [d, nu_d, mu] = [(0, 0), (0, 1), (2, 2)].map(|entry| stiffness[entry] / unit);
            let (nu, [o, i]) = (nu_d / d, [0.0, 1.0].map(Complex::from));
            let columns = [
                [o, -i - l * nu, -l * l * d * (1.0 - nu * nu), o],
                [i - l, o, o, o],
                [i / mu, o, o, -i - l],
                [o, i / d, i - l * nu, o],
            ];
            (Matrix4::from(columns) * Complex::from(*angle)).exp() * transfer
        });
        let Some(sides) = sides else { return (transfer - Matrix4::identity()).determinant() };
        let [first, last] = sides.map(|side| side.map(Complex::from));
        let mut rows = Matrix4::zeros();
        rows.fixed_rows_mut::<2>(0).copy_from(&first);
        rows.fixed_rows_mut::<2>(2).copy_from(&(last * transfer));
        rows.determinant()
    };
    let ([least, largest, height], last) = (LAMBDA, 3 * PARTS_OF_SIDE);
    let values = (0..=last).map(|i| {
        let s = if i == last { 1.0 } else { (i % PARTS_OF_SIDE) as f64 / PARTS_OF_SIDE as f64 };
        determinant(match i / PARTS_OF_SIDE {
            0 => Complex::new(largest, height * s * s),
            1 => Complex::new(largest + (least - largest) * s, height),
            _ => Complex::new(least, height * (1.0 - s).powi(2)),
        })
    });
    let values: Vec<_> = values.collect();
    values.windows(2).map(|pair| (pair[1] * pair[0].conj()).arg()).sum::<f64>() > FRAC_PI_2
}

/// How strongly a support constrains its side of a corner (0 free, then contact, symmetry, clamped), and the equations that
/// may hold on this side, which leaves the corner at an `angle`, rad. On Γ_C there are two: the body slides where contact is
/// closed, and the side is free where it is open.
fn conditions(support: Option<&Support>, angle: f64) -> (u8, Vec<Matrix2x4<f64>>) {
    let sliding = |direction: Option<[f64; 2]>| {
        let (sine, cosine) = direction.map_or(FRAC_PI_2, |[x, y]| y.atan2(x) - angle).sin_cos();
        Matrix2x4::new(cosine, sine, 0.0, 0.0, 0.0, 0.0, -sine, cosine)
    };
    let free = Matrix2x4::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    match support.map(|(condition, _)| condition) {
        None | Some(Condition::Load(_)) => (0, vec![free]),
        Some(Condition::Gap(gap)) => (1, vec![sliding(gap.normal), free]),
        Some(Condition::Symmetry) => (2, vec![sliding(None)]),
        Some(Condition::Displacement([Some(_), None])) => (2, vec![sliding(Some([1.0, 0.0]))]),
        Some(Condition::Displacement([None, _])) => (2, vec![sliding(Some([0.0, 1.0]))]),
        Some(Condition::Displacement(_)) => (3, vec![Matrix2x4::identity()]),
    }
}

/// The lines of a mesh and the triangles at their nodes.
struct Wedges<'a> {
    lines: Lines<'a>,
    /// By the side ab of a triangle abc with a on a line: the node c and the stiffness.
    next: HashMap<[usize; 2], (usize, Matrix3<f64>)>,
}

impl Wedges<'_> {
    /// The angle, rad, at which the line with the edge ab leaves a.
    fn tangent(&self, a: usize, b: usize) -> f64 {
        let [x, y] = self.lines.tangent(a, b);
        y.atan2(x)
    }

    /// The sectors counter-clockwise from the edge to `first`, and the end of the last edge.
    fn around(&self, node: usize, first: usize) -> (Vec<(Matrix3<f64>, f64)>, usize) {
        let (mut sectors, mut end) = (Vec::<(Matrix3<f64>, f64)>::new(), first);
        while let Some(&(next, stiffness)) = self.next.get(&[node, end]) {
            let turn = wrapped(self.tangent(node, next) - self.tangent(node, end));
            match sectors.last_mut() {
                Some((last, angle)) if *last == stiffness => *angle += turn,
                _ => sectors.push((stiffness, turn)),
            }
            end = next;
            if end == first {
                break;
            }
        }
        (sectors, end)
    }
}

/// An angle between −π and π, rad.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

impl DiscreteProblem {
    /// The points of the whole body with singular stresses.
    pub fn singular_points(&self) -> Vec<Singular> {
        let (wedges, supports) = (self.wedges(), self.supports_of_edges());
        let is_side = |edge: [usize; 2]| wedges.next.contains_key(&edge);
        let first = wedges.lines.ends.iter().flat_map(|(&node, ends)| {
            let is_first = move |end: &usize| is_side([node, *end]) && !is_side([*end, node]);
            let is_inside = ends.iter().all(|&end| is_side([node, end]) && is_side([end, node]));
            let first = ends.iter().copied().filter(is_first);
            first.chain(is_inside.then_some(ends[0])).map(move |first| [node, first])
        });
        let corners = first.filter_map(|edge| self.singular(&wedges, &supports, edge));
        corners.chain(self.shear_jumps(&wedges.lines)).collect()
    }

    /// The jumps of a shear load τ on smooth boundaries: nearby σ_tt grows like (2τ/π) ln r along the tangent t. A jump of the
    /// normal load leaves stresses bounded.
    fn shear_jumps(&self, lines: &Lines) -> Vec<Singular> {
        let singular = |(node, [x, y, pressure]): (usize, [f64; 3])| {
            let ends = &lines.ends[&node];
            let [tx, ty] = lines.tangent(node, ends[0]);
            let shear = (x * tx + y * ty).abs() / tx.hypot(ty);
            let radius =
                ends.iter().map(|&end| self.mesh().edge_normal([node, end]).1).fold(0.0, f64::max);
            let (at, name) = (self.mesh().nodes[node], "a jump of a shear load".to_owned());
            (shear > SEEN * x.hypot(y).hypot(pressure)).then_some(Singular {
                at,
                radius,
                name,
                is_open: false,
            })
        };
        load_jumps(self.scene(), self.mesh(), lines).into_iter().filter_map(singular).collect()
    }

    /// The lines of the mesh with its wedges.
    fn wedges(&self) -> Wedges<'_> {
        let (mesh, mut next) = (self.mesh(), HashMap::default());
        let stiffness: Vec<_> = self.scene().materials().map(|of| of.stiffness()).collect();
        let numbers = self.scene().materials_of(mesh);
        let material = |t: usize| numbers.get(t).map_or(0, |&number| number as usize);
        let lines = Lines::new(mesh, |t| stiffness[material(t)]);
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            let sides = [[a, b, c], [b, c, a], [c, a, b]].into_iter();
            let sides = sides.filter(|side| lines.ends.contains_key(&side[0]));
            next.extend(sides.map(|[p, q, r]| ([p, q], (r, stiffness[material(t)]))));
        }
        Wedges { lines, next }
    }

    /// The singular point of the sectors at a node counter-clockwise from the edge to `first`.
    fn singular(
        &self,
        wedges: &Wedges,
        supports: &BTreeMap<[usize; 2], Support>,
        [node, first]: [usize; 2],
    ) -> Option<Singular> {
        let (mut sectors, last) = wedges.around(node, first);
        // The tangents of other curves than circles are not exact: a corner is not re-entrant within their errors.
        if let [(_, angle)] = &mut sectors[..] {
            *angle -=
                [first, last].map(|end| wedges.lines.tangent_error(node, end)).iter().sum::<f64>();
        }
        let sides = [[node, first], [last, node]].map(|edge| supports.get(&edge));
        let [(a, of_a), (b, of_b)] = [(sides[0], first), (sides[1], last)]
            .map(|(side, end)| conditions(side, wedges.tangent(node, end)));
        let (is_inside, slides) = (first == last, a.min(b) > 0 && a.max(b) < 3);
        let [p, q] = [of_a[0], of_b[0]];
        let is_same = a == b && (p - q).norm().min((p + q).norm()) < 0.1;
        let ends = &wedges.lines.ends[&node];
        let is_smooth = match ends[..] {
            [p, q] => wedges.lines.is_smooth(node, [p, q]),
            _ => !is_inside && wedges.lines.is_smooth(node, [last, first]),
        };
        let jumps = is_smooth && a == 1 && b == 1 && self.gap_jumps([last, node, first], sides);
        let is_same = is_smooth && is_same && !jumps;
        if is_same && ends.len() == 2 {
            return None;
        }
        // A contact condition is closed or open. Where one smooth foundation passes the end of an interface of two materials,
        // it is closed on both sides of the end, or open on both.
        let cases = (0..of_a.len()).flat_map(|i| (0..of_b.len()).map(move |k| [i, k]));
        let mut cases = cases.filter(|[i, k]| !is_same || i == k);
        let case = cases
            .find(|&[i, k]| is_singular(&sectors, (!is_inside).then_some([of_a[i], of_b[k]])))?;
        let is_open = case == [of_a.len() - 1, of_b.len() - 1] && case != [0, 0];
        let of = sides[usize::from(b > a)].map_or("", |(_, boundary)| &*boundary.name);
        let lengths = ends.iter().map(|&end| self.mesh().edge_normal([node, end]).1);
        let name = match sectors.len() {
            _ if is_inside => "a corner of an inclusion".to_owned(),
            2.. => "the end of an interface of two materials".to_owned(),
            _ if jumps => format!("a jump of the gap of `{of}`"),
            _ if slides => format!("a corner of `{of}`"),
            _ if a != b => format!("the end of `{of}`"),
            _ => "a re-entrant corner".to_owned(),
        };
        let (at, radius) = (self.mesh().nodes[node], lengths.fold(0.0, f64::max));
        Some(Singular { at, radius, name, is_open })
    }

    /// Does the gap jump between the middles of the edges pq and qr of Γ_C, at the start or the end of the run?
    fn gap_jumps(&self, nodes: [usize; 3], [after, before]: [Option<&Support>; 2]) -> bool {
        let points @ [p, _, r] = nodes.map(|node| self.mesh().nodes[node]);
        self.scene().sample_times(1).into_iter().any(|t| {
            let gap = |side: usize, [x, y]: [f64; 2]| {
                let gap = [before, after][side].and_then(|side| side.1.gap());
                [gap.map_or(0.0, |gap| gap.distance.eval(x, y, t))]
            };
            jump(points, gap)[0].abs() > 1e-9 * (p[0] - r[0]).hypot(p[1] - r[1])
        })
    }

    /// The supported edges of the boundary, each with the support that prescribes most components.
    pub(super) fn supports_of_edges(&self) -> BTreeMap<[usize; 2], Support<'_>> {
        let mut supports = BTreeMap::new();
        for boundary in &self.scene().boundaries {
            for edge in self.mesh().edges_of(&boundary.name) {
                for condition in &boundary.conditions {
                    let (new, count) = ((condition, boundary), |of| conditions(Some(of), 0.0).0);
                    let known = supports.entry(*edge).or_insert(new);
                    *known = if count(&new) > count(known) { new } else { *known };
                }
            }
        }
        supports
    }
}
