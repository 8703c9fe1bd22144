//! The peaks of the contact pressure that the mesh does not resolve, for two reasons:
//!
//! - A node next to the peak is open: the pressure that the nodes there show is the force over an edge.
//! - The gap has a kink there. A wedge whose slope changes by Δ presses with (E Δ/2π) ln(2a/r) at the distance r from its
//!   tip (Johnson, Contact Mechanics, 5.2), a the half length of contact. A bisection of the edges adds (E Δ/2π) ln 2.

use super::{SEEN, Singular};
use crate::{observe::ContactRow, problem::DiscreteProblem};
use std::f64::consts::{LN_2, TAU};

impl DiscreteProblem {
    /// The peaks of the pressure by the `rows` of Γ_C that the mesh does not resolve, with the reason.
    pub(crate) fn unresolved_peaks(&self, rows: &[ContactRow]) -> Vec<Singular> {
        // The rows of the next vertices; a corner has two rows and ends a line.
        let step = 1 + self.scene().order as usize;
        let is_next = |a: &ContactRow, b: &ContactRow| {
            (&a.boundary, a.part) == (&b.boundary, b.part) && [a.x, a.y] != [b.x, b.y]
        };
        let young = self.scene().materials().map(|material| material.young).fold(0.0, f64::max);
        let unresolved = |line: &[ContactRow], i: usize| {
            let (row, around) = (&line[i], [i.checked_sub(step), Some(i + step)]);
            let around = Vec::from_iter(around.into_iter().flatten().filter_map(|k| line.get(k)));
            if row.pressure <= 0.0 || around.iter().any(|other| other.pressure > row.pressure) {
                return None;
            }
            let growth = young * self.kink(line, i, step).unwrap_or(0.0) / TAU * LN_2;
            let reason = match around.iter().all(|other| other.active == 1) {
                true if around.is_empty() || growth <= SEEN * row.pressure => return None,
                true => "a kink of the gap",
                false => "contact of few nodes",
            };
            let edges = around.iter().map(|other| (other.arc_length - row.arc_length).abs());
            let (at, radius) = ([row.x, row.y], edges.fold(0.0, f64::max));
            let name = format!("{reason} of `{}`", row.boundary);
            Some(Singular { at, radius, name, is_open: false })
        };
        let lines = rows.chunk_by(is_next);
        let places = lines.flat_map(|line| (0..line.len()).map(move |i| (line, i)));
        places.filter_map(|(line, i)| unresolved(line, i)).collect()
    }

    /// The change of the slope of the gap at the row `i` of a line, beyond twice the change at the second next vertices: a
    /// smooth gap bends there as much, and a kink between two vertices does not reach them. `None` at the ends of the line.
    fn kink(&self, line: &[ContactRow], i: usize, step: usize) -> Option<f64> {
        let boundary = self.scene().boundaries.iter().find(|of| of.name == line[i].boundary)?;
        let gap = &boundary.gap()?.distance;
        let point =
            |k: usize| line.get(k).map(|row| [row.arc_length, gap.eval(row.x, row.y, row.time)]);
        // The change of the slope at a vertex, and the length of its edges, m.
        let bend = |k: usize| {
            let [[r, a], [s, b], [t, c]] =
                [point(k.checked_sub(step)?)?, point(k)?, point(k + step)?];
            Some([(c - b) / (t - s) - (b - a) / (s - r), t - r])
        };
        let [own, length] = bend(i)?;
        let others = [i.checked_sub(2 * step), Some(i + 2 * step)].into_iter().flatten();
        let curvatures = others.filter_map(bend).map(|[bend, length]| bend / length);
        Some(own - 2.0 * length * curvatures.reduce(f64::max)?.max(0.0))
    }
}
