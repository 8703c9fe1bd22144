//! Peaks of the contact pressure that the mesh does not resolve: a node next to the peak is open, so that the pressure shown there is
//! the force over an edge.

use super::Singular;
use crate::{observe::ContactRow, problem::DiscreteProblem};

impl DiscreteProblem {
    /// The peaks of the pressure by the `rows` of Γ_C that the mesh does not resolve, with the reason.
    pub(crate) fn unresolved_peaks(&self, rows: &[ContactRow]) -> Vec<Singular> {
        // The rows of the next vertices; a corner has two rows and ends a line.
        let step = 1 + self.scene().order as usize;
        let is_next = |a: &ContactRow, b: &ContactRow| {
            (&a.boundary, a.part) == (&b.boundary, b.part) && [a.x, a.y] != [b.x, b.y]
        };
        let unresolved = |line: &[ContactRow], i: usize| {
            let (row, around) = (&line[i], [i.checked_sub(step), Some(i + step)]);
            let around = Vec::from_iter(around.into_iter().flatten().filter_map(|k| line.get(k)));
            let is_peak =
                row.pressure > 0.0 && around.iter().all(|other| other.pressure <= row.pressure);
            if !is_peak || around.iter().all(|other| other.active == 1) {
                return None;
            }
            let edges = around.iter().map(|other| (other.arc_length - row.arc_length).abs());
            let (at, radius) = ([row.x, row.y], edges.fold(0.0, f64::max));
            let name = format!("contact of few nodes of `{}`", row.boundary);
            Some(Singular { at, radius, name, is_open: false })
        };
        let lines = rows.chunk_by(is_next);
        let places = lines.flat_map(|line| (0..line.len()).map(move |i| (line, i)));
        places.filter_map(|(line, i)| unresolved(line, i)).collect()
    }
}
