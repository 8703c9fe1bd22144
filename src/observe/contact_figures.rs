//! The figures of contact of each foundation at a step: length and ends of contact, largest pressure, line of action.

use super::{ContactRow, ObservedProblem, Value, contact_line::parts_from_open_nodes};

/// The figures of contact of Γ_C or of a foundation.
pub(crate) struct ContactFigures {
    /// The largest contact pressure, Pa, and the length of contact, m.
    pub values: [Value; 2],
    /// The coordinates, m, of the first and the last active node with the body on the left (on a closed part from its longest
    /// stretch without contact), the one with the largest pressure, and the point of the resultant's line of action that is
    /// nearest to the middle between the first and the last one. NaN without contact.
    pub places: [f64; 8],
    /// The least remaining gap, m; 0 with contact.
    pub opening: f64,
}

impl ObservedProblem {
    /// The figures of the contact at some `rows` of Γ_C.
    pub(crate) fn contact_figures(&self, rows: &[ContactRow]) -> ContactFigures {
        let ordered = parts_from_open_nodes(rows).concat();
        let mut active = ordered.iter().filter(|row| row.active == 1);
        let peak = rows.iter().max_by(|a, b| a.pressure.total_cmp(&b.pressure));
        let first = active.next();
        let place = |row: &ContactRow| [row.x, row.y];
        let at = |row: Option<&ContactRow>| row.map_or([f64::NAN; 2], place);
        let [start, end] = [first, active.next_back().or(first)].map(at);
        let pressure = peak.map_or(0.0, |row| row.pressure);
        let middle = [0, 1].map(|k| 0.5 * (start[k] + end[k]));
        let acts_at = point_of_action(rows, middle, self.tolerance);
        let of_peak = at(peak.filter(|row| row.pressure > 0.0));
        let places = [start, end, of_peak, acts_at];
        ContactFigures {
            values: [
                Value { value: pressure, at: peak.map(place) },
                self.supports.contact.length(rows).0.into(),
            ],
            opening: match first {
                Some(_) => 0.0,
                None => rows.iter().map(|row| row.gap).fold(f64::INFINITY, f64::min).max(0.0),
            },
            places: std::array::from_fn(|k| places[k / 2][k % 2]),
        }
    }
}

/// The rows of the foundation `name`.
pub(crate) fn rows_of<'a>(rows: &'a [ContactRow], name: &str) -> &'a [ContactRow] {
    let mut foundations = rows.chunk_by(|a, b| a.boundary == b.boundary);
    foundations.find(|rows| rows[0].boundary == name).unwrap_or_default()
}

/// The point nearest to (x, y) on the line of action of Σ R, with the forces R = −pν at the nodes. NaN if they cancel.
fn point_of_action(rows: &[ContactRow], [x, y]: [f64; 2], tolerance: f64) -> [f64; 2] {
    let [mut fx, mut fy, mut moment] = [0.0; 3];
    let all: f64 = rows.iter().map(|row| row.force).sum();
    for row in rows {
        let [rx, ry] = [-row.force * row.normal_x, -row.force * row.normal_y];
        (fx, fy) = (fx + rx, fy + ry);
        moment += (row.x - x) * ry - (row.y - y) * rx;
    }
    // Each reaction may be off by the tolerance of the contact step.
    if fx.hypot(fy) <= rows.len() as f64 * tolerance * all {
        return [f64::NAN; 2];
    }
    // F at (x, y) + s (F_y, −F_x) has the moment of the forces.
    let s = moment / (fx * fx + fy * fy);
    [x + s * fy, y - s * fx]
}
