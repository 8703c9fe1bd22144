//! Functions given by points in a file.

use crate::{scene::document::absolute, whole_file};
use std::path::Path;

/// A function through points (a, f), piecewise linear or smooth, constant before the first and after the last point.
#[derive(Debug)]
pub(super) struct Table {
    /// The points in the order of a. At a jump two points have the same a.
    points: Vec<[f64; 2]>,
    /// The derivatives f' at the points, if the function is smooth; empty if it is piecewise linear.
    slopes: Vec<f64>,
}

impl Table {
    /// Reads the points from the CSV file at `path`: a and f in each row. The first row may be a header.
    /// Lines that begin with `#` are comments. The function between them is piecewise linear, or smooth.
    ///
    /// # Errors
    /// The file cannot be read, or a row has not two finite numbers or is not in order.
    pub(super) fn read(path: &Path, is_smooth: bool) -> Result<Self, String> {
        let failed =
            |error: &dyn std::fmt::Display| format!("the table {}: {error}", path.display());
        if absolute(path).to_str().is_none() {
            return Err(failed(&"the name of a folder is not in UTF-8; rename the folder"));
        }
        // Reading a device might never end.
        if path.exists() && !path.is_file() {
            return Err(failed(&"is no file"));
        }
        let bytes = std::fs::read(path).map_err(|error| failed(&error))?;
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
                let pieces = points.chunk_by(|p, q| p[0] < q[0]).filter(|_| is_smooth);
                Ok(Self { slopes: pieces.flat_map(slopes).collect(), points })
            }
        }
    }

    /// f(a); at a jump the value after it.
    pub(super) fn at(&self, a: f64) -> f64 {
        let next = self.points.partition_point(|[other, _]| *other <= a);
        match (&self.points[..next], &self.points[next..]) {
            _ if a.is_nan() => a,
            ([], [[_, f], ..]) | ([.., [_, f]], []) => *f,
            ([.., [p, f]], [[q, g], ..]) => match self.slopes.get(next - 1..=next) {
                None => f + (a - p) / (q - p) * (g - f),
                Some(slopes) => cubic(a - p, q - p, [*f, *g], [slopes[0], slopes[1]]),
            },
            ([], []) => f64::NAN,
        }
    }

    /// Is it linear between more than two points?
    pub(super) fn has_kinks(&self) -> bool {
        self.slopes.is_empty() && self.points.len() > 2
    }

    /// Values whose range contains all f(a) in an interval: the values at its ends and at the points in it, as f is monotone
    /// between two points.
    pub(super) fn within(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
        // At a jump at the lower end the value after it counts.
        let first = self.points.partition_point(|[a, _]| *a <= low);
        let inside = self.points[first..].iter().take_while(move |[a, _]| *a <= high);
        [self.at(low), self.at(high)].into_iter().chain(inside.map(|[_, f]| *f))
    }
}

/// The slopes of the monotone piecewise cubic function through points of increasing a (Fritsch and Carlson, SIAM J. Numer.
/// Anal. 17, 1980). With the lengths h and the secant slopes s of the two intervals at a point: f' = 0 if s₁s₂ ≤ 0, else
/// (w₁ + w₂)/f' = w₁/s₁ + w₂/s₂, w₁ = h₁ + 2h₂, w₂ = 2h₁ + h₂ (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984). At an
/// end f' = s₁ + h₁(s₁ − s₂)/(h₁ + h₂), with s₁, h₁ of the interval there, limited to between 0 and 3s₁ (Moler, Numerical
/// Computing with MATLAB, 2004, 3.6).
fn slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let secant = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
    let secants = points.windows(2).map(secant).map(|(h, rise)| [h, rise / h]);
    let secants: Vec<[f64; 2]> = secants.collect();
    let inner = |pair: &[[f64; 2]]| {
        let [[h1, s1], [h2, s2]] = [pair[0], pair[1]];
        let [w1, w2] = [h1 + 2.0 * h2, 2.0 * h1 + h2];
        if s1 * s2 > 0.0 { (w1 + w2) / (w1 / s1 + w2 / s2) } else { 0.0 }
    };
    let end = |[h1, s1]: [f64; 2], [h2, s2]: [f64; 2]| {
        let slope = s1 + h1 / (h1 + h2) * (s1 - s2);
        slope.clamp((3.0 * s1).min(0.0), (3.0 * s1).max(0.0))
    };
    let (Some(&first), Some(&last)) = (secants.first(), secants.last()) else { return vec![0.0] };
    // Of one interval, its own secant: the function is a line.
    let second = *secants.get(1).unwrap_or(&first);
    let before = *secants.iter().rev().nth(1).unwrap_or(&last);
    let inner = secants.windows(2).map(inner);
    [end(first, second)].into_iter().chain(inner).chain([end(last, before)]).collect()
}

/// The cubic function at the distance z from the first end of an interval of length h, by its values and slopes at both ends.
/// Rounding does not carry it beyond the values.
fn cubic(z: f64, h: f64, [f, g]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    let s = (g - f) / h;
    let value = f + z * (u + z / h * (3.0 * s - 2.0 * u - v + z / h * (u + v - 2.0 * s)));
    value.clamp(f.min(g), f.max(g))
}

/// Whether a row begins like a number. Then it is a wrong row and not a header.
fn is_like_a_number(row: &csv::StringRecord) -> bool {
    row.get(0)
        .is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}
