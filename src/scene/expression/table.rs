//! Functions given by points in a file.

use crate::{scene::document::absolute, whole_file};
use std::path::Path;

/// A piecewise linear function through points (a, f), constant before the first and after the last point.
#[derive(Debug)]
pub(super) struct Table {
    /// The points in the order of a. At a jump two points have the same a.
    points: Vec<[f64; 2]>,
}

impl Table {
    /// Reads the points from the CSV file at `path`: a and f in each row. The first row may be a header.
    /// Lines that begin with `#` are comments.
    ///
    /// # Errors
    /// The file cannot be read, or a row has not two finite numbers or is not in order.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
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
            false => Ok(Self { points }),
        }
    }

    /// f(a); at a jump the value after it.
    pub(super) fn at(&self, a: f64) -> f64 {
        let next = self.points.partition_point(|[other, _]| *other <= a);
        match (&self.points[..next], &self.points[next..]) {
            _ if a.is_nan() => a,
            ([], [[_, f], ..]) | ([.., [_, f]], []) => *f,
            ([.., [p, f]], [[q, g], ..]) => f + (a - p) / (q - p) * (g - f),
            ([], []) => f64::NAN,
        }
    }

    /// Values whose range contains all f(a) in an interval: the values at its ends and at the points in it.
    pub(super) fn within(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
        // At a jump at the lower end the value after it counts.
        let first = self.points.partition_point(|[a, _]| *a <= low);
        let inside = self.points[first..].iter().take_while(move |[a, _]| *a <= high);
        [self.at(low), self.at(high)].into_iter().chain(inside.map(|[_, f]| *f))
    }
}

/// Whether a row begins like a number. Then it is a wrong row and not a header.
fn is_like_a_number(row: &csv::StringRecord) -> bool {
    row.get(0)
        .is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}
