//! The figures of contact of each foundation at a step: length and ends of contact, largest pressure, line of action.

use super::{ContactRow, DiscreteProblem, State, contact_line::parts_from_open_nodes};

/// The first and the last active node with the body on the left (on a closed part from its longest stretch without contact), the one with the largest pressure, and the point of the
/// resultant's line of action that is nearest to the middle between the first and the last one.
const PLACES: [&str; 4] = ["contact_start", "contact_end", "peak", "acts_at"];

impl DiscreteProblem {
    /// The names of the figures of contact of a step, `FOUNDATION.contact_length` and others.
    pub fn contact_columns(&self) -> Vec<String> {
        let mut names = vec!["contact_length".to_owned(), "pressure_max".to_owned()];
        names.extend(PLACES.iter().flat_map(|of| ["x", "y"].map(|axis| format!("{of}_{axis}"))));
        let of = |foundation| names.iter().map(move |name| format!("{foundation}.{name}"));
        self.foundations.iter().flat_map(of).collect()
    }

    /// The values of [`Self::contact_columns`] in a state; places are NaN without contact. Collective.
    pub fn contact_figures(&self, state: &State) -> Vec<f64> {
        let (rows, _) = self.supports.contact.rows(&self.body, state);
        let figures = |name: &String| {
            let rows = rows_of(&rows, name);
            let ordered = parts_from_open_nodes(rows).concat();
            let mut active = ordered.iter().filter(|row| row.active == 1);
            let peak = active.clone().max_by(|a, b| a.pressure.total_cmp(&b.pressure));
            let first = active.next();
            let at = |row: Option<&ContactRow>| row.map_or([f64::NAN; 2], |row| [row.x, row.y]);
            let [start, end] = [first, active.next_back().or(first)].map(at);
            let pressure = peak.map_or(0.0, |row| row.pressure);
            let length = self.supports.contact.length(rows).0;
            let middle = [0, 1].map(|k| 0.5 * (start[k] + end[k]));
            let acts_at = point_of_action(rows, middle, self.tolerance);
            [[length, pressure], start, end, at(peak), acts_at].into_iter().flatten()
        };
        self.foundations.iter().flat_map(figures).collect()
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
