//! From directions and values at nodes to frames, prescribed unknowns and bounds.

use super::{Bound, ConstraintError, FixedRow, GapRow};
use crate::fem::{NodalBases, Subdomain};
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;

/// All displacement conditions of a body.
#[derive(Debug, Clone)]
pub struct Constraints {
    /// The nodal bases; prescribed unknowns are fixed there (and later the pins of free motions).
    pub bases: NodalBases,
    /// The bounded unknowns, rising; [`Self::bounds_at`] adds what prescribed displacements change.
    pub bounds: Vec<Bound>,
    /// The gap conditions as posed: one per node and smooth boundary, by node.
    pub gaps: Vec<GapRow>,
    /// Unknowns that take the value of a fixed row: (dof, row).
    prescribed: Vec<(usize, usize)>,
    /// Rows whose direction other rows determine already.
    implied: Vec<FixedRow>,
    implied_rows: Vec<usize>,
    /// Gap conditions that bound an unknown which another one bounds already.
    sides: Vec<Side>,
    /// Gap conditions at nodes whose normal displacement is prescribed.
    prescribed_gaps: Vec<GapRow>,
}

/// u·ν ≤ g as a u·d + b c ≤ g, with d a prescribed direction and c a bounded unknown.
#[derive(Debug, Clone)]
struct Side {
    /// The bounded unknown c.
    dof: usize,
    /// The prescribed unknown u·d, if a is not 0.
    fixed: Option<usize>,
    /// ν = a d + b n, where n is the direction of c.
    shares: [f64; 2],
    /// g, m.
    gap: f64,
}

/// Directions whose lines are closer than this angle, rad, are one direction.
const PARALLEL: f64 = 1e-8;
/// Directions closer than this angle, rad, but not one, are refused: the basis they make at a node
/// loses as many digits as the angle has zeros. (A contact solve reaches the default tolerance
/// down to here.)
pub(super) const DEPENDENT: f64 = 1e-4;
/// Contact normals closer than 30° belong to one smooth boundary.
const CORNER_COSINE: f64 = 0.866_025_403_784_438_6;
/// Prescribed values may differ by this much of the largest, and a gap may lack this much of the
/// body's size: rounding of coordinates and expressions.
const ROUNDING: f64 = 1e-12;

impl Constraints {
    /// Combines all rows node by node; `coordinates` serve the error messages.
    ///
    /// # Errors
    /// Conditions of a node contradict each other, or are too many for its two unknowns.
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
            bases: NodalBases::identity(coordinates.len()),
            bounds: Vec::new(),
            gaps: Vec::new(),
            prescribed: Vec::new(),
            implied: Vec::new(),
            implied_rows: Vec::new(),
            sides: Vec::new(),
            prescribed_gaps: Vec::new(),
        };
        for (node, (rows, gaps)) in at {
            constraints.add_node(node, &rows, fixed, gaps, coordinates[node])?;
        }
        // Only sides that prescribed displacements move are left for later.
        let (moving, fixed) = constraints.sides.into_iter().partition(|side| side.fixed.is_some());
        constraints.sides = fixed;
        constraints.bounds = constraints.bounds_at(&[], coordinates)?;
        constraints.sides = moving;
        Ok(constraints)
    }

    /// The basis of a node: its prescribed directions, then the normals of its gaps as far as they
    /// are independent of these and of each other. A gap along an earlier normal (or against it:
    /// a node between two plates) is one more side of the same unknown.
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
                self.bases.fix(2 * node + basis.len());
                basis.push(d);
            } else {
                self.implied.push(fixed[row].clone());
                self.implied_rows.push(row);
            }
        }
        let prescribed = basis.len();
        for mut gap in gaps {
            // Where nothing is left to move, no unknown is needed.
            let line = match prescribed {
                2 => None,
                _ => parallel(&basis, gap.normal, [x, y])?,
            };
            if let Some(line) = line {
                // Exactly this line, so that its rows cannot contradict each other by rounding.
                gap.normal = along(basis[line], gap.normal);
            }
            self.gaps.push(gap.clone());
            match line {
                _ if prescribed == 2 => self.prescribed_gaps.push(gap),
                Some(line) if line < prescribed => self.prescribed_gaps.push(gap),
                None if basis.len() < 2 => {
                    self.bounds.push(Bound {
                        dof: 2 * node + basis.len(),
                        node,
                        normal: gap.normal,
                        lower: f64::NEG_INFINITY,
                        upper: gap.gap,
                        tributary_length: gap.tributary_length,
                    });
                    basis.push(gap.normal);
                }
                None if prescribed == 0 => return Err(ConstraintError::TooMany { x, y }),
                _ => self.sides.push(side(node, &basis, prescribed, line, &gap)),
            }
        }
        if let [d] = basis[..] {
            basis.push([-d[1], d[0]]);
        }
        if let [a, b] = basis[..] {
            let directions = Matrix2::new(a[0], a[1], b[0], b[1]);
            if directions != Matrix2::identity() {
                let angle = cross(a, b).abs();
                self.bases.set(node, directions).ok_or(ConstraintError::Dependent {
                    x,
                    y,
                    angle,
                })?;
            }
        }
        Ok(())
    }

    /// The bounded unknowns with their bounds where the prescribed ones have the values `lift`.
    ///
    /// # Errors
    /// Obstacles on both sides of a node leave it no room.
    pub fn bounds_at(
        &self,
        lift: &[f64],
        coordinates: &[[f64; 2]],
    ) -> Result<Vec<Bound>, ConstraintError> {
        let mut bounds = self.bounds.clone();
        for side in &self.sides {
            let Ok(place) = bounds.binary_search_by_key(&side.dof, |bound| bound.dof) else {
                continue;
            };
            let (bound, [a, b]) = (&mut bounds[place], side.shares);
            let value = (side.gap - side.fixed.map_or(0.0, |dof| a * lift[dof])) / b;
            match b > 0.0 {
                true => bound.upper = bound.upper.min(value),
                false => bound.lower = bound.lower.max(value),
            }
            let depth = bound.lower - bound.upper;
            if depth > 0.0 {
                if depth > ROUNDING * extent(coordinates) {
                    let [x, y] = coordinates[bound.node];
                    return Err(ConstraintError::NoRoom { x, y, depth });
                }
                bound.lower = bound.upper;
            }
        }
        Ok(bounds)
    }

    /// The prescribed unknowns (pins are none).
    pub fn prescribed(&self) -> impl Iterator<Item = usize> {
        self.prescribed.iter().map(|&(dof, _)| dof)
    }

    /// The place in `bounds` of the unknown that a contact force along `normal` at `node` acts on.
    pub fn bound_along(&self, node: usize, normal: [f64; 2]) -> Option<usize> {
        let first = self.bounds.partition_point(|bound| bound.node < node);
        let at = (first..self.bounds.len()).take_while(|&i| self.bounds[i].node == node);
        at.min_by(|&i, &j| {
            let off = |i: usize| cross(self.bounds[i].normal, normal).abs();
            off(i).total_cmp(&off(j))
        })
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
        if self.implied.is_empty() && self.prescribed_gaps.is_empty() {
            return Ok(c);
        }
        let mut u = c.clone();
        self.bases.displacement_to_global(&mut u);
        let along = |node: usize, d: [f64; 2]| u[2 * node] * d[0] + u[2 * node + 1] * d[1];
        let size = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (row, &index) in self.implied.iter().zip(&self.implied_rows) {
            let (first, second) = (along(row.node, row.direction), values[index]);
            if (first - second).abs() > ROUNDING * size {
                let ([x, y], [dx, dy]) = (coordinates[row.node], row.direction);
                return Err(ConstraintError::Contradicts { x, y, first, second, dx, dy });
            }
        }
        for gap in &self.prescribed_gaps {
            let depth = along(gap.node, gap.normal) - gap.gap;
            if depth > ROUNDING * size.max(extent(coordinates)) {
                let [x, y] = coordinates[gap.node];
                return Err(ConstraintError::Penetrates { x, y, depth });
            }
        }
        Ok(c)
    }

    /// The conditions at the nodes of a rank's share; bounds are their owners'. The fixed rows
    /// keep their numbers.
    pub fn restrict(&self, subdomain: &Subdomain) -> Self {
        let local = |dof: usize| subdomain.local(dof / 2).map(|node| 2 * node + dof % 2);
        let bound = |bound: &Bound| {
            let node = subdomain.owned(bound.node)?;
            Some(Bound { node, dof: 2 * node + bound.dof % 2, ..*bound })
        };
        let mut bounds: Vec<Bound> = self.bounds.iter().filter_map(bound).collect();
        bounds.sort_by_key(|bound| bound.dof);
        let gap = |gap: &GapRow| Some(GapRow { node: subdomain.owned(gap.node)?, ..*gap });
        let mut gaps: Vec<GapRow> = self.gaps.iter().filter_map(gap).collect();
        gaps.sort_by_key(|gap| gap.node);
        let side = |side: &Side| {
            let dof = subdomain.owned(side.dof / 2).map(|node| 2 * node + side.dof % 2)?;
            Some(Side { dof, fixed: side.fixed.and_then(local), ..*side })
        };
        let rows = self.implied.iter().zip(&self.implied_rows);
        let (implied, implied_rows) = rows
            .filter_map(|(row, &index)| {
                Some((FixedRow { node: subdomain.local(row.node)?, ..*row }, index))
            })
            .unzip();
        let known = |gap: &GapRow| Some(GapRow { node: subdomain.local(gap.node)?, ..*gap });
        let prescribed = |&(dof, row): &(usize, usize)| Some((local(dof)?, row));
        Self {
            bases: self.bases.restrict(subdomain),
            bounds,
            gaps,
            prescribed: self.prescribed.iter().filter_map(prescribed).collect(),
            implied,
            implied_rows,
            sides: self.sides.iter().filter_map(side).collect(),
            prescribed_gaps: self.prescribed_gaps.iter().filter_map(known).collect(),
        }
    }
}

/// Adds a gap row to those of its node: rows of one smooth boundary become one, their
/// normals averaged by length; across a corner both stay.
pub(crate) fn join_gap(rows: &mut Vec<GapRow>, new: &GapRow) {
    let (n, w) = (Vector2::from(new.normal), new.tributary_length);
    match rows.iter_mut().find(|row| Vector2::from(row.normal).dot(&n) > CORNER_COSINE) {
        None => rows.push(new.clone()),
        Some(row) => {
            let mean = (Vector2::from(row.normal) * row.tributary_length + n * w).normalize();
            row.normal = mean.into();
            row.tributary_length += w;
            row.gap = row.gap.min(new.gap);
        }
    }
}

/// The direction of `basis` on whose line `normal` lies.
fn parallel(
    basis: &[[f64; 2]],
    normal: [f64; 2],
    [x, y]: [f64; 2],
) -> Result<Option<usize>, ConstraintError> {
    let angles = || basis.iter().map(|b| cross(*b, normal).abs());
    if let Some(angle) = angles().find(|angle| (PARALLEL..DEPENDENT).contains(angle)) {
        return Err(ConstraintError::Dependent { x, y, angle });
    }
    Ok(angles().position(|angle| angle < PARALLEL))
}

/// `line` or its opposite, whichever `normal` nearly is.
fn along(line: [f64; 2], normal: [f64; 2]) -> [f64; 2] {
    match line[0] * normal[0] + line[1] * normal[1] >= 0.0 {
        true => line,
        false => line.map(|v| -v),
    }
}

/// A gap whose unknown is bounded already: `line` of the basis if it lies on one, else the second
/// of a basis whose first direction is prescribed.
fn side(
    node: usize,
    basis: &[[f64; 2]],
    prescribed: usize,
    line: Option<usize>,
    gap: &GapRow,
) -> Side {
    let n = gap.normal;
    let (dof, fixed, shares) = match line {
        Some(line) => {
            let same = basis[line] == n;
            (2 * node + line, None, [0.0, if same { 1.0 } else { -1.0 }])
        }
        None => {
            // ν = a d + b n₁, by Cramer's rule.
            let (d, first) = (basis[0], basis[1]);
            let area = cross(d, first);
            let shares = [cross(n, first) / area, cross(d, n) / area];
            (2 * node + 1, (prescribed == 1).then_some(2 * node), shares)
        }
    };
    Side { dof, fixed, shares, gap: gap.gap }
}

/// The longer side of the box around `points`, m.
fn extent(points: &[[f64; 2]]) -> f64 {
    let side = |axis: usize| {
        let range = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (p[axis].min(low), p[axis].max(high))
        });
        range.1 - range.0
    };
    side(0).max(side(1)).max(0.0)
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
