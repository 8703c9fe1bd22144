//! Functions given by points in a file.

use crate::{scene::document::absolute, whole_file};
use std::path::Path;

/// The shape of a function between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// A line between two points.
    Linear,
    /// A cubic function; the second derivative is continuous.
    Cubic,
    /// A monotone cubic function; the derivative is continuous.
    Monotone,
}

/// A function through points (a, f), constant before the first and after the last point.
#[derive(Debug)]
pub(super) struct Table {
    /// The points in the order of a. At a jump two points have the same a.
    points: Vec<[f64; 2]>,
    shape: Shape,
    /// The derivatives f' at the points; empty if the function is piecewise linear.
    slopes: Vec<f64>,
}

impl Table {
    /// Reads the points from the CSV file at `path`: a and f in each row. The first row may be a header.
    /// Lines that begin with `#` are comments. The function between them has a `shape`.
    ///
    /// # Errors
    /// The file cannot be read, or a row has not two finite numbers or is not in order.
    pub(super) fn read(path: &Path, shape: Shape) -> Result<Self, String> {
        let failed =
            |error: &dyn std::fmt::Display| format!("the table {}: {error}", path.display());
        if absolute(path).to_str().is_none() {
            return Err(failed(&"the name of a folder is not in UTF-8; rename the folder"));
        }
        let bytes = whole_file::read(path).map_err(|error| failed(&error))?;
        let text = whole_file::text(bytes).map_err(|problem| failed(&problem))?;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut points: Vec<[f64; 2]> = Vec::new();
        for (row, record) in reader.records().enumerate() {
            let record = record.map_err(|error| failed(&error))?;
            let line = record.position().map_or(0, csv::Position::line);
            let problem = |what: &str| Err(format!("the table {}:{line}: {what}", path.display()));
            let number = |i: usize| record.get(i).and_then(|text| text.parse().ok());
            let point = match (number(0), number(1)) {
                (Some(a), Some(f)) if record.len() == 2 => [a, f],
                (None, None) if row == 0 && !is_like_a_number(&record) => continue,
                _ => return problem("must be two numbers with a comma between them"),
            };
            if !point.iter().all(|number: &f64| number.is_finite()) {
                return problem("has a number that is not finite");
            }
            match points[..] {
                [.., [last, _]] if point[0] < last => {
                    return problem("the numbers of the first column must not fall");
                }
                [.., [before, _], [last, _]] if before == last && last == point[0] => {
                    return problem("is a third row with the same first number");
                }
                _ => points.push(point),
            }
        }
        match points.is_empty() {
            true => Err(failed(&"has no rows of numbers")),
            false => {
                let pieces = points.chunk_by(|p, q| p[0] < q[0]);
                let slopes = pieces.flat_map(|piece| slopes(piece, shape)).collect();
                Ok(Self { shape, slopes, points })
            }
        }
    }

    /// f(a); at a jump the value after it.
    pub(super) fn at(&self, a: f64) -> f64 {
        let next = self.points.partition_point(|[other, _]| *other <= a);
        match (&self.points[..next], &self.points[next..]) {
            _ if a.is_nan() => a,
            ([], [[_, f], ..]) | ([.., [_, f]], []) => *f,
            ([.., [p, f]], [[q, g], ..]) => {
                let (y, rise) = ((a - p) / (q - p), g - f);
                let [u, b, c] = self.cubic(next).unwrap_or([rise, 0.0, 0.0]);
                let value = f + y * (u + y * (b + y * c));
                // Rounding does not carry a monotone function beyond the values.
                if self.shape == Shape::Cubic { value } else { value.clamp(f.min(*g), f.max(*g)) }
            }
            ([], []) => f64::NAN,
        }
    }

    /// The coefficients of y, y² and y³ between the point before `next`, y = 0, and this one, y = 1.
    fn cubic(&self, next: usize) -> Option<[f64; 3]> {
        let [[p, f], [q, g]] = [self.points[next - 1], self.points[next]];
        let slopes = self.slopes.get(next - 1..=next)?;
        let ([u, v], rise) = ([slopes[0] * (q - p), slopes[1] * (q - p)], g - f);
        Some([u, 3.0 * rise - 2.0 * u - v, u + v - 2.0 * rise])
    }

    /// May it have a kink or a jump in an interval? It may at its ends, at jumps, and at all points if it is linear between them.
    pub(super) fn bends_in(&self, [low, high]: [f64; 2]) -> bool {
        let first = self.points.partition_point(|[a, _]| *a < low);
        let last = self.points.partition_point(|[a, _]| *a <= high);
        let is_smooth = |i: usize| {
            let [before, next] = [i.checked_sub(1), Some(i + 1)].map(|k| self.points.get(k?));
            let is_within = before
                .zip(next)
                .is_some_and(|(p, q)| p[0] < self.points[i][0] && self.points[i][0] < q[0]);
            is_within && !self.slopes.is_empty()
        };
        !(first..last).all(is_smooth)
    }

    /// Values whose range contains all f(a) in an interval: the values at its ends, at the points in it, and where a cubic
    /// function turns between two points.
    pub(super) fn within(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
        // At a jump at the lower end the value after it counts.
        let first = self.points.partition_point(|[a, _]| *a <= low);
        let inside = self.points[first..].iter().take_while(move |[a, _]| *a <= high);
        let next = first.max(1)..=(first + inside.clone().count()).min(self.points.len() - 1);
        let turns = next.filter(|_| self.shape == Shape::Cubic).flat_map(move |next| {
            let [p, q] = [next - 1, next].map(|i| self.points[i][0]);
            let turns = self.cubic(next).map_or([f64::NAN; 2], turning_points);
            turns.map(|y| (0.0 < y && y < 1.0).then_some(p + y * (q - p)))
        });
        let turns = turns.flatten().filter(move |a| (low..=high).contains(a)).map(|a| self.at(a));
        [self.at(low), self.at(high)].into_iter().chain(inside.map(|[_, f]| *f)).chain(turns)
    }
}

/// The zeros of the derivative u + 2by + 3cy² of a cubic function.
fn turning_points([u, b, c]: [f64; 3]) -> [f64; 2] {
    let q = -(b + b.signum() * (b * b - 3.0 * c * u).sqrt());
    [q / (3.0 * c), u / q]
}

/// The slopes at points of increasing a; none of a piecewise linear function. At the ends, and at the middle of three points,
/// `Cubic` functions have those of the parabola through three points: f' = s₁ + h₁(s₁ − s₂)/(h₁ + h₂), with the length h₁
/// and the secant slope s₁ of the interval at the end.
fn slopes(points: &[[f64; 2]], shape: Shape) -> Vec<f64> {
    let secant = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
    let secants = points.windows(2).map(secant).map(|(h, rise)| [h, rise / h]);
    let secants: Vec<[f64; 2]> = secants.collect();
    let end = |[h1, s1]: [f64; 2], [h2, s2]: [f64; 2]| s1 + h1 / (h1 + h2) * (s1 - s2);
    match (shape, &secants[..]) {
        (Shape::Linear, _) => Vec::new(),
        (_, []) => vec![0.0],
        (_, &[[_, s]]) => vec![s, s],
        (Shape::Cubic, &[a, b]) => {
            vec![end(a, b), (b[0] * a[1] + a[0] * b[1]) / (a[0] + b[0]), end(b, a)]
        }
        (Shape::Cubic, _) => twice_differentiable(&secants),
        // Limited to between 0 and 3s₁ (Moler, Numerical Computing with MATLAB, 2004, 3.6).
        (Shape::Monotone, all) => {
            let limited =
                |a: [f64; 2], b| end(a, b).clamp((3.0 * a[1]).min(0.0), (3.0 * a[1]).max(0.0));
            let mut slopes = vec![limited(all[0], all[1])];
            slopes.extend(secants.windows(2).map(|pair| monotone(pair[0], pair[1])));
            slopes.push(limited(all[all.len() - 1], all[all.len() - 2]));
            slopes
        }
    }
}

/// The slope at a point of a monotone piecewise cubic function (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980): 0 if the
/// secant slopes of the two intervals have different signs, else (w₁ + w₂)/f' = w₁/s₁ + w₂/s₂, w₁ = h₁ + 2h₂, w₂ = 2h₁ + h₂
/// (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984).
fn monotone([h1, s1]: [f64; 2], [h2, s2]: [f64; 2]) -> f64 {
    let [w1, w2] = [h1 + 2.0 * h2, 2.0 * h1 + h2];
    if s1 * s2 > 0.0 { (w1 + w2) / (w1 / s1 + w2 / s2) } else { 0.0 }
}

/// The slopes f'_i of a cubic spline (de Boor, A Practical Guide to Splines, 1978, ch. IV), by elimination in
///
/// h₂ f'_{i−1} + 2(h₁ + h₂) f'_i + h₁ f'_{i+1} = 3(h₂s₁ + h₁s₂);
///
/// the first and last two intervals have one cubic function ("not-a-knot"): h₂ f'_0 + (h₁ + h₂) f'_1 = r.
fn twice_differentiable(secants: &[[f64; 2]]) -> Vec<f64> {
    let right = |[h1, s1]: [f64; 2], [h2, s2]: [f64; 2]| {
        ((3.0 * h1 + 2.0 * h2) * h2 * s1 + h1 * h1 * s2) / (h1 + h2)
    };
    let (first, last) = ([secants[0], secants[1]], secants.len() - 1);
    let last = [secants[last], secants[last - 1]];
    // Below the diagonal, on it, above it, and the right-hand side.
    let mut rows = vec![[0.0, first[1][0], first[0][0] + first[1][0], right(first[0], first[1])]];
    rows.extend(secants.windows(2).map(|pair| {
        let ([h1, s1], [h2, s2]) = (pair[0], pair[1]);
        [h2, 2.0 * (h1 + h2), h1, 3.0 * (h2 * s1 + h1 * s2)]
    }));
    rows.push([last[0][0] + last[1][0], last[1][0], 0.0, right(last[0], last[1])]);
    for i in 1..rows.len() {
        let ([_, diagonal, above, r], below) = (rows[i - 1], rows[i][0]);
        let ratio = below / diagonal;
        rows[i][1] -= ratio * above;
        rows[i][3] -= ratio * r;
    }
    let mut slopes = vec![0.0; rows.len() + 1];
    for (i, [_, diagonal, above, r]) in rows.into_iter().enumerate().rev() {
        slopes[i] = (r - above * slopes[i + 1]) / diagonal;
    }
    slopes.pop();
    slopes
}

/// Whether a row begins like a number. Then it is a wrong row and not a header.
fn is_like_a_number(row: &csv::StringRecord) -> bool {
    row.get(0)
        .is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}
