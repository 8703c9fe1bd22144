//! From directions and values at nodes to frames, prescribed unknowns and bounds.

use crate::fem::{Frames, Share};
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;

/// u·d is prescribed at a node (a displacement component, or 0 across a symmetry axis).
#[derive(Debug, Clone)]
pub struct FixedRow {
    /// The node.
    pub node: usize,
    /// d, a unit vector.
    pub direction: [f64; 2],
}

/// u·ν ≤ g at a node of Γ_C.
#[derive(Debug, Clone)]
pub struct GapRow {
    /// The node.
    pub node: usize,
    /// ν, a unit vector.
    pub normal: [f64; 2],
    /// g ≥ 0, m.
    pub gap: f64,
    /// The node's share of Γ_C, m.
    pub weight: f64,
}

/// A gap condition as a bound c_dof ≤ gap on one unknown.
#[derive(Debug, Clone)]
pub struct Bound {
    /// The unknown, 2·node + component in the node's frame.
    pub dof: usize,
    /// The node.
    pub node: usize,
    /// ν: the unknown is u·ν.
    pub normal: [f64; 2],
    /// g, m.
    pub gap: f64,
    /// The node's share of Γ_C, m.
    pub weight: f64,
}

/// Conditions at a node that cannot hold together.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ConstraintError {
    /// A prescribed displacement goes through the obstacle.
    #[error(
        "the displacement prescribed at node ({x}, {y}) goes {depth:.3e} m through the obstacle \
         there: a node that is both held and in contact keeps its prescribed value, which must \
         respect the gap"
    )]
    Penetrates {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// How far beyond the gap, m.
        depth: f64,
    },
    /// Two prescribed values contradict each other.
    #[error(
        "two boundaries prescribe different displacements at their common node ({x}, {y}): \
         {first} and {second} m along ({dx:.3}, {dy:.3})"
    )]
    Contradicts {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
        /// The value kept, m.
        first: f64,
        /// The value that differs, m.
        second: f64,
        /// The common direction.
        dx: f64,
        /// The common direction.
        dy: f64,
    },
    /// More independent conditions than the two unknowns of a node.
    #[error(
        "more than two independent conditions (held directions and contact normals) meet at \
         node ({x}, {y}): a node of the plane has two unknowns; free one of them or separate \
         the boundaries"
    )]
    TooMany {
        /// Coordinates of the node.
        x: f64,
        /// Coordinates of the node.
        y: f64,
    },
}

/// All displacement conditions of a body.
#[derive(Debug, Clone)]
pub struct Constraints {
    /// The unknowns; prescribed ones are fixed there (and later the pins of free motions).
    pub frames: Frames,
    /// The gap conditions that are bounds on unknowns.
    pub bounds: Vec<Bound>,
    /// Unknowns that take the value of a fixed row: (dof, row).
    prescribed: Vec<(usize, usize)>,
    /// Rows whose direction other rows determine already.
    implied: Vec<FixedRow>,
    implied_rows: Vec<usize>,
    /// Gap conditions at nodes whose normal displacement is prescribed.
    held_gaps: Vec<GapRow>,
}

/// Unit vectors closer than this are one direction.
const PARALLEL: f64 = 1e-8;
/// Contact normals closer than 30° belong to one smooth boundary.
const CORNER_COSINE: f64 = 0.866_025_403_784_438_6;

impl Constraints {
    /// Combines all rows node by node; `coordinates` serve the error messages.
    pub fn new(
        coordinates: &[[f64; 2]],
        fixed: &[FixedRow],
        gaps: &[GapRow],
    ) -> Result<Self, ConstraintError> {
        let mut at: BTreeMap<usize, (Vec<usize>, Vec<GapRow>)> = BTreeMap::new();
        for (row, fixed) in fixed.iter().enumerate() {
            at.entry(fixed.node).or_default().0.push(row);
        }
        for gap in gaps {
            join_gap(&mut at.entry(gap.node).or_default().1, gap);
        }
        let mut constraints = Self {
            frames: Frames::identity(coordinates.len()),
            bounds: Vec::new(),
            prescribed: Vec::new(),
            implied: Vec::new(),
            implied_rows: Vec::new(),
            held_gaps: Vec::new(),
        };
        for (node, (rows, gaps)) in at {
            constraints.add_node(node, &rows, fixed, gaps, coordinates[node])?;
        }
        Ok(constraints)
    }

    fn add_node(
        &mut self,
        node: usize,
        rows: &[usize],
        fixed: &[FixedRow],
        gaps: Vec<GapRow>,
        [x, y]: [f64; 2],
    ) -> Result<(), ConstraintError> {
        let mut basis: Vec<[f64; 2]> = Vec::new();
        for &row in rows {
            let d = fixed[row].direction;
            if basis.len() < 2 && basis.iter().all(|b| cross(*b, d).abs() > PARALLEL) {
                self.prescribed.push((2 * node + basis.len(), row));
                self.frames.fix(2 * node + basis.len());
                basis.push(d);
            } else {
                self.implied.push(fixed[row].clone());
                self.implied_rows.push(row);
            }
        }
        let held = basis.clone();
        for gap in gaps {
            if held.len() == 2 || held.iter().any(|b| cross(*b, gap.normal).abs() <= PARALLEL) {
                self.held_gaps.push(gap);
            } else if basis.len() == 2 {
                return Err(ConstraintError::TooMany { x, y });
            } else {
                self.bounds.push(Bound {
                    dof: 2 * node + basis.len(),
                    node,
                    normal: gap.normal,
                    gap: gap.gap,
                    weight: gap.weight,
                });
                basis.push(gap.normal);
            }
        }
        if let [d] = basis[..] {
            basis.push([-d[1], d[0]]);
        }
        if let [a, b] = basis[..] {
            let directions = Matrix2::new(a[0], a[1], b[0], b[1]);
            if directions != Matrix2::identity() {
                self.frames.set(node, directions);
            }
        }
        Ok(())
    }

    /// The prescribed unknowns c_D (0 elsewhere) when `values[row]` is u·d of each fixed row.
    ///
    /// # Errors
    /// Values contradict each other or go through the obstacle.
    pub fn lift(
        &self,
        values: &[f64],
        coordinates: &[[f64; 2]],
    ) -> Result<Vec<f64>, ConstraintError> {
        let mut c = vec![0.0; 2 * coordinates.len()];
        for &(dof, row) in &self.prescribed {
            c[dof] = values[row];
        }
        if self.implied.is_empty() && self.held_gaps.is_empty() {
            return Ok(c);
        }
        let mut u = c.clone();
        self.frames.displacement_from_frame(&mut u);
        let along = |node: usize, d: [f64; 2]| u[2 * node] * d[0] + u[2 * node + 1] * d[1];
        let size = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (row, &index) in self.implied.iter().zip(&self.implied_rows) {
            let (first, second) = (along(row.node, row.direction), values[index]);
            if (first - second).abs() > 1e-9 * size {
                let ([x, y], [dx, dy]) = (coordinates[row.node], row.direction);
                return Err(ConstraintError::Contradicts { x, y, first, second, dx, dy });
            }
        }
        for gap in &self.held_gaps {
            let depth = along(gap.node, gap.normal) - gap.gap;
            if depth > 1e-12 * size {
                let [x, y] = coordinates[gap.node];
                return Err(ConstraintError::Penetrates { x, y, depth });
            }
        }
        Ok(c)
    }

    /// The conditions at the nodes of a rank's share; bounds are their owners'. The fixed rows
    /// keep their numbers.
    pub fn share(&self, share: &Share) -> Self {
        let local = |node: usize, dof: usize| share.local(node).map(|local| 2 * local + dof % 2);
        let bound = |bound: &Bound| {
            let node = share.owned(bound.node)?;
            Some(Bound { node, dof: 2 * node + bound.dof % 2, ..*bound })
        };
        let mut bounds: Vec<Bound> = self.bounds.iter().filter_map(bound).collect();
        bounds.sort_by_key(|bound| bound.node);
        let rows = self.implied.iter().zip(&self.implied_rows);
        let (implied, implied_rows) = rows
            .filter_map(|(row, &index)| {
                Some((FixedRow { node: share.local(row.node)?, ..*row }, index))
            })
            .unzip();
        let held = |gap: &GapRow| Some(GapRow { node: share.local(gap.node)?, ..*gap });
        let prescribed = |&(dof, row): &(usize, usize)| Some((local(dof / 2, dof)?, row));
        Self {
            frames: self.frames.share(share),
            bounds,
            prescribed: self.prescribed.iter().filter_map(prescribed).collect(),
            implied,
            implied_rows,
            held_gaps: self.held_gaps.iter().filter_map(held).collect(),
        }
    }

    /// Whether the unknown is prescribed (pins are not).
    pub fn is_prescribed(&self) -> Vec<bool> {
        let mut prescribed = vec![false; self.frames.fixed().len()];
        self.prescribed.iter().for_each(|&(dof, _)| prescribed[dof] = true);
        prescribed
    }
}

/// Adds a gap row to those of its node: rows of one smooth boundary become one, their
/// normals averaged by length; across a corner both stay.
fn join_gap(rows: &mut Vec<GapRow>, new: &GapRow) {
    let (n, w) = (Vector2::from(new.normal), new.weight);
    match rows.iter_mut().find(|row| Vector2::from(row.normal).dot(&n) > CORNER_COSINE) {
        None => rows.push(new.clone()),
        Some(row) => {
            let mean = (Vector2::from(row.normal) * row.weight + n * w).normalize();
            row.normal = mean.into();
            row.weight += w;
            row.gap = row.gap.min(new.gap);
        }
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
