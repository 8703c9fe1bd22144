//! Points with singular stresses: they grow without bound as the mesh is refined.
//!
//! There sectors of materials meet. Near such a point u = r^λ (U, V) and σ = r^(λ−1) (σ_rr, σ_rθ, σ_θθ), with functions of
//! the angle θ (Williams, J. Appl. Mech. 19, 1952; Bogy, J. Appl. Mech. 35, 1968). With σ_θθ = d (ε_θθ + ν ε_rr) and
//! E = d (1 − ν²), Hooke's law and equilibrium are the system z′ = A(λ) z for z = (U, V, σ_rθ, σ_θθ):
//! U′ = (1 − λ) V + σ_rθ/μ, V′ = −(1 + νλ) U + σ_θθ/d, σ_rθ′ = −λ²E U + (1 − νλ) σ_θθ, σ_θθ′ = −(1 + λ) σ_rθ.
//!
//! z is continuous at interfaces. Sectors with the angles α₁, α₂, … transfer it by T = … exp(α₂A₂) exp(α₁A₁). The sides
//! have conditions B z = 0 and C z = 0, so that det(B; CT) = 0. Inside the body z returns to itself: det(T − I) = 0.

use super::{
    DiscreteProblem, SAMPLE_TIMES,
    directions::{Corner, Effect, Side},
    loads::{jump, load_jumps},
};
use crate::{
    mesh::{Lines, distance, longest_side},
    scene::{Boundary, Condition},
};
use nalgebra::{Complex, Matrix2x4, Matrix3, Matrix4, Matrix5, Vector4};
use rustc_hash::FxHashMap as HashMap;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A point with singular stresses.
#[derive(Debug, Clone, PartialEq)]
pub struct Singular {
    /// The point, m.
    pub at: [f64; 2],
    /// The distance within which the point makes stresses large, m: the length of the longest side of its triangles.
    pub radius: f64,
    /// The kind of the point, as in "the end of `clamp`".
    pub name: String,
    /// Is it singular only while contact is open there?
    pub is_open: bool,
}

/// A condition on an edge, and its boundary.
pub(super) type Support<'a> = (&'a Condition, &'a Boundary);

/// A sector of one material at a corner.
#[derive(Debug, Clone)]
pub(super) struct Sector {
    /// The number of the material, and its stiffness, Pa.
    pub(super) material: usize,
    pub(super) stiffness: Matrix3<f64>,
    /// rad.
    pub(super) angle: f64,
}

impl Sector {
    /// A(λ) for stresses in the `unit`, Pa.
    fn system(&self, unit: f64, l: Complex<f64>) -> Matrix4<Complex<f64>> {
        let [d, nu_d, mu] = [(0, 0), (0, 1), (2, 2)].map(|entry| self.stiffness[entry] / unit);
        let (nu, [o, i]) = (nu_d / d, [0.0, 1.0].map(Complex::from));
        Matrix4::from([
            [o, -i - l * nu, -l * l * d * (1.0 - nu * nu), o],
            [i - l, o, o, o],
            [i / mu, o, o, -i - l],
            [o, i / d, i - l * nu, o],
        ])
    }

    /// The system of degree 0 for (z, ω), see [`super::directions`].
    pub(super) fn system_of_degree_0(&self, unit: f64) -> Matrix5<f64> {
        let own = self.system(unit, 1.0.into()).map(|entry| entry.re);
        let mut system = own.fixed_resize::<5, 5>(0.0);
        system[(0, 4)] = -1.0;
        system
    }
}

/// A bisection that raises an extreme by less than this fraction shows no singularity.
pub(crate) const SEEN: f64 = 0.02;
/// Bounds of Re λ and |Im λ|. Above 0.975 a bisection raises the stress by less than [`SEEN`]; λ = 0 is a rigid motion.
const LAMBDA: [f64; 3] = [0.03, 0.975, 1.5];
/// Number of parts of each side of this rectangle.
const PARTS_OF_SIDE: usize = 48;
/// Are stresses singular where sectors meet, with conditions on two sides, or inside the body?
/// The determinant is real on the real axis. So along the half of the rectangle's border above this axis its argument changes by π times
/// the number of its roots inside (argument principle).
fn is_singular(sectors: &[Sector], sides: Option<[Matrix2x4<f64>; 2]>) -> bool {
    let unit: f64 = sectors.iter().map(|sector| sector.stiffness[(2, 2)]).sum();
    let determinant = |l: Complex<f64>| {
        let transfer = sectors.iter().fold(Matrix4::identity(), |transfer, sector| {
            (sector.system(unit, l) * Complex::from(sector.angle)).exp() * transfer
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
    /// By the side ab of a triangle abc with a on a line: the node c and the material.
    next: HashMap<[usize; 2], (usize, usize)>,
    /// Per node on a line: the length of the longest side of its triangles, m.
    longest: HashMap<usize, f64>,
    /// Per material: its stiffness, Pa.
    stiffness: Vec<Matrix3<f64>>,
}

impl Wedges<'_> {
    /// The angle, rad, at which the line with the edge ab leaves a.
    fn tangent(&self, a: usize, b: usize) -> f64 {
        let [x, y] = self.lines.tangent(a, b);
        y.atan2(x)
    }

    /// The sectors counter-clockwise from the edge to `first`, and the end of the last edge.
    fn around(&self, node: usize, first: usize) -> (Vec<Sector>, usize) {
        let (mut sectors, mut end) = (Vec::<Sector>::new(), first);
        while let Some(&(next, material)) = self.next.get(&[node, end]) {
            let turn = wrapped(self.tangent(node, next) - self.tangent(node, end));
            match sectors.last_mut() {
                Some(last) if last.material == material => last.angle += turn,
                _ => {
                    let stiffness = self.stiffness[material];
                    sectors.push(Sector { material, stiffness, angle: turn });
                }
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
        self.corners().0.clone()
    }

    /// The points of the whole body with singular stresses, and its other corners, found once.
    pub(crate) fn corners(&self) -> &(Vec<Singular>, Vec<Corner>) {
        self.corners.get_or_init(|| self.found_corners())
    }

    fn found_corners(&self) -> (Vec<Singular>, Vec<Corner>) {
        let (wedges, supports) = (self.wedges(), self.supports_of_edges());
        let is_side = |edge: [usize; 2]| wedges.next.contains_key(&edge);
        let first = wedges.lines.ends.iter().flat_map(|(&node, ends)| {
            let is_first = move |end: &usize| is_side([node, *end]) && !is_side([*end, node]);
            let is_inside = ends.iter().all(|&end| is_side([node, end]) && is_side([end, node]));
            let first = ends.iter().copied().filter(is_first);
            first.chain(is_inside.then_some(ends[0])).map(move |first| [node, first])
        });
        let jumps = load_jumps(self.scene(), self.mesh(), &wedges.lines);
        let jumps = jumps.into_iter().filter_map(|(node, jump)| self.jump(&wedges, node, jump));
        let corners = first.filter_map(|edge| self.corner(&wedges, &supports, edge)).chain(jumps);
        let (mut singular, mut others) = (Vec::new(), Vec::new());
        for corner in corners {
            match corner {
                Ok(point) => singular.push(point),
                Err(corner) => others.push(corner),
            }
        }
        (singular, others)
    }

    /// The singular point, or else the corner, at a `jump` of the loads (t_x, t_y, pressure), Pa, on a smooth free boundary.
    fn jump(
        &self,
        wedges: &Wedges,
        node: usize,
        [x, y, pressure]: [f64; 3],
    ) -> Option<Result<Singular, Corner>> {
        let is_first = |end: &&usize| !wedges.next.contains_key(&[**end, node]);
        let first = *wedges.lines.ends[&node].iter().find(is_first)?;
        let (sectors, last) = wedges.around(node, first);
        let sides = [first, last].map(|end| (end, conditions(None, 0.0).1));
        let corner = self.sides_of(wedges, node, sectors, sides);
        let [nx, ny] = corner.sides[0].normal(false);
        let load = corner.sides[0].of_traction([x - pressure * nx, y - pressure * ny], false);
        let grows = matches!(corner.effect_of([load, Vector4::zeros()], false), Effect::Singular);
        let (at, radius) = (corner.at, wedges.longest[&node]);
        let name = "a jump of a shear load".to_owned();
        Some(if grows { Ok(Singular { at, radius, name, is_open: false }) } else { Err(corner) })
    }

    /// The corner with these sectors and, per side, the end of its edge and the rows of its conditions.
    fn sides_of(
        &self,
        wedges: &Wedges,
        node: usize,
        sectors: Vec<Sector>,
        sides: [(usize, Vec<Matrix2x4<f64>>); 2],
    ) -> Corner {
        let (mesh, boundaries) = (self.mesh(), &self.scene().boundaries);
        let sides = sides.map(|(end, rows)| {
            let edges = [[node, end], [end, node]];
            let is_on =
                |of: &Boundary| mesh.edges_of(&of.name).iter().any(|edge| edges.contains(edge));
            Side {
                end: mesh.nodes[end],
                angle: wedges.tangent(node, end),
                rows,
                boundaries: (0..boundaries.len()).filter(|&i| is_on(&boundaries[i])).collect(),
            }
        });
        Corner { node, at: mesh.nodes[node], sectors, sides }
    }

    /// The lines of the mesh with its wedges.
    fn wedges(&self) -> Wedges<'_> {
        let (mesh, mut next, mut longest) = (self.mesh(), HashMap::default(), HashMap::default());
        let stiffness: Vec<_> = self.scene().materials().map(|of| of.stiffness()).collect();
        let numbers = self.scene().materials_of(mesh);
        let material = |t: usize| numbers.get(t).map_or(0, |&number| number as usize);
        let lines = Lines::new(mesh, |t| stiffness[material(t)]);
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            let sides = [[a, b, c], [b, c, a], [c, a, b]].into_iter();
            let sides = sides.filter(|side| lines.ends.contains_key(&side[0]));
            for [p, q, r] in sides {
                next.insert([p, q], (r, material(t)));
                let ([from, to], _) = longest_side(&mesh.nodes, [a, b, c]);
                let length = distance(mesh.nodes[from], mesh.nodes[to]);
                let known = longest.entry(p).or_insert(length);
                *known = length.max(*known);
            }
        }
        Wedges { lines, next, longest, stiffness }
    }

    /// The singular point, or else the corner, of the sectors at a node counter-clockwise from the edge to `first`. `None` inside the
    /// body and on smooth lines with the same conditions on both sides.
    fn corner(
        &self,
        wedges: &Wedges,
        supports: &BTreeMap<[usize; 2], Support>,
        [node, first]: [usize; 2],
    ) -> Option<Result<Singular, Corner>> {
        let (sectors, last) = wedges.around(node, first);
        let mut within = sectors.clone();
        within.dedup_by(|next, of| {
            let is_same = next.stiffness == of.stiffness;
            of.angle += if is_same { next.angle } else { 0.0 };
            is_same
        });
        // The tangents of other curves than circles are not exact: a corner is not re-entrant within their errors.
        if let [of] = &mut within[..] {
            of.angle -=
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
        let case =
            cases.find(|&[i, k]| is_singular(&within, (!is_inside).then_some([of_a[i], of_b[k]])));
        let is_open = case == Some([of_a.len() - 1, of_b.len() - 1]) && case != Some([0, 0]);
        let of = sides[usize::from(b > a)].map_or("", |(_, boundary)| &*boundary.name);
        let (at, radius) = (self.mesh().nodes[node], wedges.longest[&node]);
        if case.is_none() {
            if is_inside {
                return None;
            }
            let corner = self.sides_of(wedges, node, sectors, [(first, of_a), (last, of_b)]);
            let mut times = self.scene().sample_times(SAMPLE_TIMES).into_iter();
            let grows = |t| matches!(corner.effect(self.scene(), t, true), Effect::Singular);
            let name = match of {
                "" => "a jump of a shear load".to_owned(),
                _ => format!("a load at the end of `{of}`"),
            };
            let singular = Singular { at, radius, name, is_open };
            return Some(if times.any(grows) { Ok(singular) } else { Err(corner) });
        }
        let name = match within.len() {
            _ if is_inside => "a corner of an inclusion".to_owned(),
            2.. => "the end of an interface of two materials".to_owned(),
            _ if jumps => format!("a jump of the gap of `{of}`"),
            _ if slides => format!("a corner of `{of}`"),
            _ if a != b => format!("the end of `{of}`"),
            _ => "a re-entrant corner".to_owned(),
        };
        Some(Ok(Singular { at, radius, name, is_open }))
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
    pub(crate) fn supports_of_edges(&self) -> BTreeMap<[usize; 2], Support<'_>> {
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
