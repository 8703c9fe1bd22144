//! Divides edges and triangles into parts so small that a quadrature rule integrates a function in each part.
//!
//! A part with the measure m is bisected while, relative to the sum of ∫|f| over all parts,
//!
//! - m max |f − f₂| > `DEVIATION`, with f₂ the quadratic interpolation of f at ends and middles (corners
//!   and midpoints of sides) and the maximum over the quadrature points; or
//! - m times the distance of the bounds [`Expression::range`] from the values at these points > `HIDDEN`: a peak
//!   between the points may be missed.
//!
//! The sum of both over all parts bounds the missed part of ∫|f|. The error of the integral is estimated from the
//! differences e = ∫f − ∫f₂ and d = max |f − f₂| times the measure by √((Σe)² + Σ(e² + d²/25)): parts may err with one sign, or
//! with signs by chance. Where f has a jump or a kink in an edge, e² + d²/25 covers the error of three Gauss points.

use crate::{
    fem::{Body, GAUSS, POINTS, parabola, part_point, quadratic_values, six_points},
    mesh::{bounds, twice_area},
    scene::Expression,
};

/// A part of an edge: the index of the edge, and the start and the end of the part, 0 ≤ s ≤ 1.
pub(crate) type EdgePart = (usize, [f64; 2]);
/// A part of a triangle: the index of the triangle, and the barycentric coordinates of the part's corners.
pub(crate) type TrianglePart = (usize, [[f64; 3]; 3]);

/// The relative error of an integral that a part of a triangle may cause. Edges of loads have a smaller one.
pub(crate) const DEVIATION: f64 = 1e-5;
/// The fraction of ∫|f| that may be hidden in a peak between the sample points.
const HIDDEN: f64 = 1e-3;
/// Ends and corners are sampled this far inside, relative to the part, so that no part contains a jump at a node.
const WITHIN: f64 = 1e-7;
/// Maximum number of bisections of a part.
const MAX_BISECTIONS: usize = 40;
/// A triangle as its only part.
pub(crate) const WHOLE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// Samples in a part, times the measure of the part: ∫|f|, max |f − f₂|, the highest possible hidden peak, and ∫f − ∫f₂.
#[derive(Clone, Copy)]
struct Sampled {
    integral: f64,
    deviation: f64,
    hidden: f64,
    error: f64,
}

impl Sampled {
    /// The part of ∫|f| that may be missed here; `integral` is ∫|f| over all parts. A hidden peak below the limit
    /// does not count: usually the bounds of the function are only too wide.
    fn missed(&self, integral: f64) -> f64 {
        self.deviation + if self.hidden > HIDDEN * integral { self.hidden } else { 0.0 }
    }
}

/// Parts in which functions are integrated.
pub(crate) struct Parts<P> {
    pub(crate) parts: Vec<P>,
    /// Upper bound of the missed part of ∫|f|, relative to the integral found.
    pub(crate) missed: f64,
    /// The estimated error of ∫f.
    pub(crate) error: f64,
}

impl<P> Parts<P> {
    fn new(parts: Vec<(P, Sampled)>) -> Self {
        let integral: f64 = parts.iter().map(|(_, of)| of.integral).sum();
        let missed: f64 = parts.iter().map(|(_, of)| of.missed(integral)).sum();
        let missed = if missed > 0.0 { missed / integral } else { 0.0 };
        let sum: f64 = parts.iter().map(|(_, of)| of.error).sum();
        let squares = parts.iter().map(|(_, of)| of.error.powi(2) + (0.2 * of.deviation).powi(2));
        let error = sum.hypot(squares.sum::<f64>().sqrt());
        Self { parts: parts.into_iter().map(|(part, _)| part).collect(), missed, error }
    }
}

/// Bisects parts until all are small enough for a `deviation`, or there would be more than `most`.
fn bisected<P: Copy>(
    parts: impl Iterator<Item = P>,
    [deviation, most]: [f64; 2],
    sample: impl Fn(P) -> Sampled,
    halves: impl Fn(P) -> [P; 2],
) -> Vec<(P, Sampled)> {
    let (mut done, mut integral) = (Vec::new(), 0.0);
    let mut open: Vec<(P, Sampled)> = parts.map(|part| (part, sample(part))).collect();
    for _ in 0..MAX_BISECTIONS {
        let total = open.iter().fold(integral, |sum, (_, sampled)| sum + sampled.integral);
        let is_coarse = |(_, sampled): &(P, Sampled)| {
            sampled.deviation > deviation * total || sampled.hidden > HIDDEN * total
        };
        let (coarse, fine): (Vec<_>, Vec<_>) = open.into_iter().partition(is_coarse);
        integral = fine.iter().fold(integral, |sum, (_, sampled)| sum + sampled.integral);
        done.extend(fine);
        if (done.len() + 2 * coarse.len()) as f64 > most {
            done.extend(coarse);
            return done;
        }
        let parts = coarse.into_iter().flat_map(|(part, _)| halves(part));
        open = parts.map(|part| (part, sample(part))).collect();
    }
    done.extend(open);
    done
}

/// Divides edges, parabolas through three points each, so that the Gauss points of each part integrate `f` at time
/// `t` with errors of about `deviation` ∫|f|. A function that is constant in space needs one part per edge.
pub(crate) fn edge_parts(
    lines: &[[[f64; 2]; 3]],
    f: &[Expression],
    t: f64,
    deviation: f64,
) -> Parts<EdgePart> {
    let whole = (0..lines.len()).map(|edge| (edge, [0.0, 1.0]));
    if !f.iter().any(Expression::depends_on_space) {
        return Parts { parts: whole.collect(), missed: 0.0, error: 0.0 };
    }
    let sample = |(edge, [from, to]): EdgePart| {
        let at = |s: f64| parabola(lines[edge], from + s * (to - from));
        let nodes = [WITHIN, 0.5, 1.0 - WITHIN].map(at);
        let [p, _, q] = nodes;
        let measure = (q[0] - p[0]).hypot(q[1] - p[1]);
        let points = GAUSS.map(at);
        let interpolated = |[a, m, b]: [f64; 3]| GAUSS.map(|s| parabola([[a], [m], [b]], s)[0]);
        sampled(f, 0.0, &[t], nodes, [[0, 2, 1]], points, interpolated, measure)
    };
    let halves = |(edge, [from, to]): EdgePart| {
        let middle = 0.5 * (from + to);
        [(edge, [from, middle]), (edge, [middle, to])]
    };
    let most = (4 * lines.len() + 2000) as f64;
    Parts::new(bisected(whole, [deviation, most], sample, halves))
}

/// Divides quadratic triangles of six points so that `f` − `zero` is integrated at all `times` with errors of about
/// `DEVIATION` ∫|f − zero|. At most `more` parts are added.
pub(crate) fn triangle_parts(
    triangles: &[[[f64; 2]; 6]],
    (f, zero): (&[Expression], f64),
    times: &[f64],
    more: f64,
) -> Parts<TrianglePart> {
    let whole = (0..triangles.len()).map(|triangle| (triangle, WHOLE));
    let sample = |(triangle, corners): TrianglePart| {
        let at = |point| triangle_point(&triangles[triangle], part_point(&corners, point));
        let shrunk = WHOLE.map(|corner| corner.map(|l| l + WITHIN * (1.0 / 3.0 - l)));
        let [a, b, c] = shrunk;
        let nodes = [a, b, c, mean(a, b), mean(b, c), mean(c, a)].map(at);
        let [p, q, r, ..] = nodes;
        let measure = 0.5 * twice_area(p, q, r).abs();
        let interpolated = |values: [f64; 6]| {
            POINTS.map(|point| quadratic_values(point).iter().zip(values).map(|(w, v)| w * v).sum())
        };
        let sides = [[0, 1, 3], [1, 2, 4], [2, 0, 5]];
        sampled(f, zero, times, nodes, sides, POINTS.map(at), interpolated, measure)
    };
    // Newest vertex bisection: the side between the first two corners is halved.
    let halves = |(triangle, [a, b, c]): TrianglePart| {
        let middle = mean(a, b);
        [(triangle, [c, a, middle]), (triangle, [b, c, middle])]
    };
    Parts::new(bisected(whole, [DEVIATION, triangles.len() as f64 + more], sample, halves))
}

/// The point of a quadratic triangle of six points at barycentric coordinates, m.
pub(crate) fn triangle_point(points: &[[f64; 2]; 6], at: [f64; 3]) -> [f64; 2] {
    let values = quadratic_values(at);
    [0, 1].map(|k| points.iter().zip(values).map(|(x, value)| value * x[k]).sum())
}

pub(crate) fn triangle_points(body: &Body) -> Vec<[[f64; 2]; 6]> {
    let points = &body.nodes.points;
    match body.quadratic_nodes() {
        Some(nodes) => nodes.iter().map(|nodes| nodes.map(|node| points[node])).collect(),
        None => body.mesh.triangles.iter().map(|t| six_points(t.map(|i| points[i]))).collect(),
    }
}

/// The centroid, m, and the area, m², of a part, with straight sides.
pub(crate) fn centroid(
    triangles: &[[[f64; 2]; 6]],
    (triangle, corners): &TrianglePart,
) -> ([f64; 2], f64) {
    let [p, q, r] = corners.map(|corner| triangle_point(&triangles[*triangle], corner));
    ([0, 1].map(|k| (p[k] + q[k] + r[k]) / 3.0), 0.5 * twice_area(p, q, r).abs())
}

fn mean(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))
}

/// Samples `f` − `zero` at the `nodes` of a part and its quadrature `points`. `sides` has the two ends and the
/// middle of each side. A parabolic side lies in the box of its ends and its control point 2m − (p + q)/2.
#[allow(clippy::too_many_arguments, reason = "an edge and a triangle differ in all of these")]
fn sampled<const N: usize, const S: usize, const Q: usize>(
    f: &[Expression],
    zero: f64,
    times: &[f64],
    nodes: [[f64; 2]; N],
    sides: [[usize; 3]; S],
    points: [[f64; 2]; Q],
    interpolated: impl Fn([f64; N]) -> [f64; Q],
    measure: f64,
) -> Sampled {
    let controls = sides
        .map(|[p, q, m]| [0, 1].map(|k| 2.0 * nodes[m][k] - 0.5 * (nodes[p][k] + nodes[q][k])));
    let space = bounds(nodes.iter().chain(&controls));
    let mut found = Sampled { integral: 0.0, deviation: 0.0, hidden: 0.0, error: 0.0 };
    let period = [times.first(), times.last()].map(|t| t.copied().unwrap_or(0.0));
    for f in f.iter().filter(|f| f.as_constant() != Some(zero)) {
        let mut shown = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut integral, mut deviation, mut error) = (0.0_f64, 0.0_f64, 0.0_f64);
        for &t in times {
            let at = |[x, y]: [f64; 2]| f.eval(x, y, t);
            let (values, checks) = (nodes.map(at), points.map(at));
            for v in values.iter().chain(&checks) {
                shown = [shown[0].min(*v), shown[1].max(*v)];
            }
            let sum: f64 = checks.iter().map(|v| (v - zero).abs()).sum();
            integral = integral.max(sum / Q as f64);
            let differences = checks.iter().zip(interpolated(values)).map(|(f, value)| f - value);
            deviation = differences.clone().map(f64::abs).fold(deviation, f64::max);
            let mean = differences.sum::<f64>() / Q as f64;
            error = if mean.abs() > error.abs() { mean } else { error };
        }
        let range = f.range([space[0], space[1], period]);
        found.integral += measure * integral;
        found.error += measure * error;
        found.deviation = found.deviation.max(measure * deviation);
        found.hidden = found.hidden.max(measure * (range[1] - shown[1]).max(shown[0] - range[0]));
    }
    found
}
