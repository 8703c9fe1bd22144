//! From directions and values at nodes to nodal bases, prescribed unknowns and bounds.

use super::{Bound, Conflict, ConstraintError, NodalConstraint, RowLaw};
use crate::{
    ROUNDING,
    fem::{NodalBases, Subdomain},
    mesh::{SAME_DIRECTION, extent},
};
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;

/// All displacement conditions of a body.
#[derive(Debug, Clone)]
pub struct Constraints {
    /// The nodal bases; prescribed unknowns are fixed there (and later the pins of free motions).
    pub bases: NodalBases,
    /// The bounded unknowns in increasing order, each with its first gap condition. [`Self::prescribed_and_bounds`] adds the
    /// others.
    pub bounds: Vec<Bound>,
    /// The numbers of the rows of these conditions.
    first: Vec<usize>,
    /// Prescribed unknowns, each with the number of its row.
    prescribed: Vec<(usize, usize)>,
    /// Rows in directions that other rows prescribe already, with their numbers.
    implied: Vec<(NodalConstraint, usize)>,
    further: Vec<FurtherGap>,
    /// The number of all rows that prescribe a displacement; they come first.
    prescribed_rows: usize,
}

/// A gap condition without an unknown of its own, u·ν = u_D·ν + b c ≤ g. Here u_D is the part of u from the
/// prescribed unknowns of the node.
#[derive(Debug, Clone, Copy)]
struct FurtherGap {
    row: NodalConstraint,
    number: usize,
    /// The unknown c, which has a bound from another gap condition, and b; `None` if u·ν is prescribed.
    bounded: Option<(usize, f64)>,
}

/// Directions whose lines are closer than this angle, rad, are one direction.
const PARALLEL: f64 = 1e-8;

impl Constraints {
    /// Combines all rows node by node: the prescribed ones, then the gaps, joined where boundaries meet smoothly.
    /// Error messages need the `coordinates`, m. Gaps along one line get exactly this line as their normal, so
    /// that rounding makes no contradiction. The bounds get the `values` of their rows.
    ///
    /// # Errors
    /// Directions at a node are nearly dependent, or too many for its two unknowns.
    pub fn new(
        coordinates: &[[f64; 2]],
        rows: &mut [NodalConstraint],
        values: &[f64],
    ) -> Result<Self, ConstraintError> {
        let mut nodes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (number, row) in rows.iter().enumerate() {
            nodes.entry(row.node).or_default().push(number);
        }
        let mut constraints = Self {
            bases: NodalBases::identity(coordinates.len()),
            bounds: Vec::new(),
            first: Vec::new(),
            prescribed: Vec::new(),
            implied: Vec::new(),
            further: Vec::new(),
            prescribed_rows: rows.partition_point(|row| !row.is_gap()),
        };
        for (node, numbers) in nodes {
            let (fixed, gaps) = numbers.split_at(numbers.partition_point(|&n| !rows[n].is_gap()));
            let error = |conflict| ConstraintError { at: coordinates[node], conflict };
            // The basis of a node: its prescribed directions, then the independent normals of its gaps.
            let mut basis = constraints.prescribe(fixed, rows);
            let prescribed = basis.len();
            for &number in gaps {
                let gap = (number, &mut rows[number], values[number]);
                constraints.add_gap(gap, &mut basis, prescribed).map_err(error)?;
            }
            constraints.set_basis(node, &basis).map_err(error)?;
        }
        Ok(constraints)
    }

    /// Prescribes unknowns of a node in the first independent directions, and returns these.
    fn prescribe(&mut self, numbers: &[usize], rows: &[NodalConstraint]) -> Vec<[f64; 2]> {
        let mut basis: Vec<[f64; 2]> = Vec::new();
        for &number in numbers {
            let (d, dof) = (rows[number].direction, 2 * rows[number].node + basis.len());
            if basis.len() < 2 && basis.iter().all(|b| cross(*b, d).abs() > PARALLEL) {
                self.prescribed.push((dof, number));
                self.bases.fix(dof);
                basis.push(d);
            } else {
                self.implied.push((rows[number], number));
            }
        }
        basis
    }

    /// Adds a gap condition at a node whose first `prescribed` directions are prescribed. A gap along or
    /// against an earlier normal (a node between two plates) bounds the same unknown.
    fn add_gap(
        &mut self,
        (number, gap, value): (usize, &mut NodalConstraint, f64),
        basis: &mut Vec<[f64; 2]>,
        prescribed: usize,
    ) -> Result<(), Conflict> {
        // If the displacement is prescribed, the gap needs no unknown.
        let line = if prescribed == 2 { None } else { parallel(basis, gap.direction)? };
        if let Some(line) = line {
            gap.direction = along(basis[line], gap.direction);
        }
        let (normal, dof) = (gap.direction, |line: usize| 2 * gap.node + line);
        let tributary_length = match gap.law {
            RowLaw::Prescribed => return Ok(()),
            RowLaw::Rigid { tributary_length } => tributary_length,
        };
        let bounded = match line {
            _ if prescribed == 2 => None,
            Some(line) if line < prescribed => None,
            Some(line) => Some((dof(line), if basis[line] == normal { 1.0 } else { -1.0 })),
            None if basis.len() < 2 => {
                self.bounds.push(Bound {
                    dof: dof(basis.len()),
                    node: gap.node,
                    normal,
                    lower: f64::NEG_INFINITY,
                    upper: value,
                    tributary_length,
                });
                self.first.push(number);
                basis.push(normal);
                return Ok(());
            }
            None if prescribed == 0 => return Err(Conflict::TooMany),
            // ν = a d + b n with the prescribed direction d, by Cramer's rule.
            None => Some((dof(1), cross(basis[0], normal) / cross(basis[0], basis[1]))),
        };
        self.further.push(FurtherGap { row: *gap, number, bounded });
        Ok(())
    }

    /// Makes `basis`, completed by a perpendicular, the basis of a node, unless it is the identity.
    fn set_basis(&mut self, node: usize, basis: &[[f64; 2]]) -> Result<(), Conflict> {
        let (a, b) = match *basis {
            [d] => (d, [-d[1], d[0]]),
            [a, b] => (a, b),
            _ => return Ok(()),
        };
        let directions = Matrix2::new(a[0], a[1], b[0], b[1]);
        if directions == Matrix2::identity() {
            return Ok(());
        }
        self.bases.set(node, directions).ok_or(Conflict::Dependent(cross(a, b).abs()))
    }

    /// The prescribed unknowns (pins are none).
    pub fn prescribed(&self) -> impl Iterator<Item = usize> {
        self.prescribed.iter().map(|&(dof, _)| dof)
    }

    /// The index in `bounds` of the unknown on which a contact force along `normal` acts at `node`.
    pub fn bound_along(&self, node: usize, normal: [f64; 2]) -> Option<usize> {
        let first = self.bounds.partition_point(|bound| bound.node < node);
        let at_node = (first..self.bounds.len()).take_while(|&i| self.bounds[i].node == node);
        let off = |i: &usize| cross(self.bounds[*i].normal, normal).abs();
        at_node.min_by(|i, j| off(i).total_cmp(&off(j)))
    }

    /// The prescribed unknowns c_D, m (0 elsewhere; two entries per node), and the bounds on the others, from the
    /// `values` of all rows.
    ///
    /// # Errors
    /// Values contradict each other or go through the obstacle, or the obstacles on both sides of a
    /// node overlap.
    pub fn prescribed_and_bounds(
        &self,
        values: &[f64],
        coordinates: &[[f64; 2]],
    ) -> Result<(Vec<f64>, Vec<Bound>), ConstraintError> {
        let mut c_prescribed = vec![0.0; 2 * coordinates.len()];
        self.prescribed.iter().for_each(|&(dof, row)| c_prescribed[dof] = values[row]);
        let along = |node: usize, [x, y]: [f64; 2]| {
            let c = Vector2::new(c_prescribed[2 * node], c_prescribed[2 * node + 1]);
            let u = self.bases.inverse(node).map_or(c, |inverse| inverse * c);
            u.x * x + u.y * y
        };
        let error = |node: usize, conflict| ConstraintError { at: coordinates[node], conflict };
        let prescribed = &values[..self.prescribed_rows];
        let largest = || prescribed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for &(NodalConstraint { node, direction, .. }, number) in &self.implied {
            let values = [along(node, direction), values[number]];
            if (values[0] - values[1]).abs() > ROUNDING * largest() {
                return Err(error(node, Conflict::Contradicts { values, direction }));
            }
        }
        let mut bounds = self.bounds.clone();
        for (bound, number) in bounds.iter_mut().zip(&self.first) {
            bound.upper = values[*number];
        }
        for &FurtherGap { row, number, bounded } in &self.further {
            let room = values[number] - along(row.node, row.direction);
            let Some((dof, b)) = bounded else {
                let depth = -room;
                if depth > 0.0 && depth > ROUNDING * largest().max(extent(coordinates)) {
                    return Err(error(row.node, Conflict::Penetrates(depth)));
                }
                continue;
            };
            let Ok(index) = bounds.binary_search_by_key(&dof, |bound| bound.dof) else { continue };
            let Bound { lower, upper, .. } = &mut bounds[index];
            if b > 0.0 {
                *upper = upper.min(room / b)
            } else {
                *lower = lower.max(room / b)
            }
            let depth = *lower - *upper;
            if depth > 0.0 && depth > ROUNDING * extent(coordinates) {
                return Err(error(row.node, Conflict::NoRoom(depth)));
            }
            *lower = lower.min(*upper);
        }
        Ok((c_prescribed, bounds))
    }

    /// The conditions of a rank: prescribed unknowns of its subdomain, and the other conditions of its owned
    /// nodes. All rows keep their numbers.
    pub fn restrict(&self, subdomain: &Subdomain) -> Self {
        let owned = |node: usize| subdomain.owned(node);
        let renumbered = |dof: usize, node: usize| 2 * node + dof % 2;
        let bound = |(b, number): (&Bound, &usize)| {
            let node = owned(b.node)?;
            Some((Bound { node, dof: renumbered(b.dof, node), ..*b }, *number))
        };
        let bounds = self.bounds.iter().zip(&self.first);
        let mut bounds: Vec<(Bound, usize)> = bounds.filter_map(bound).collect();
        bounds.sort_by_key(|(bound, _)| bound.dof);
        let (bounds, first) = bounds.into_iter().unzip();
        let prescribed =
            |&(dof, row): &(usize, usize)| Some((renumbered(dof, subdomain.local(dof / 2)?), row));
        let implied = |&(row, number): &(NodalConstraint, usize)| {
            Some((NodalConstraint { node: owned(row.node)?, ..row }, number))
        };
        let further = |&FurtherGap { row, number, bounded }: &FurtherGap| {
            let row = NodalConstraint { node: owned(row.node)?, ..row };
            let bounded = bounded.map(|(dof, b)| (renumbered(dof, row.node), b));
            Some(FurtherGap { row, number, bounded })
        };
        Self {
            bases: self.bases.restrict(subdomain),
            bounds,
            first,
            prescribed: self.prescribed.iter().filter_map(prescribed).collect(),
            implied: self.implied.iter().filter_map(implied).collect(),
            further: self.further.iter().filter_map(further).collect(),
            prescribed_rows: self.prescribed_rows,
        }
    }
}

/// The direction of `basis` on whose line `normal` lies.
fn parallel(basis: &[[f64; 2]], normal: [f64; 2]) -> Result<Option<usize>, Conflict> {
    let angles = || basis.iter().map(|b| cross(*b, normal).abs());
    if let Some(angle) = angles().find(|angle| (PARALLEL..SAME_DIRECTION).contains(angle)) {
        return Err(Conflict::Dependent(angle));
    }
    Ok(angles().position(|angle| angle < PARALLEL))
}

/// `line` or its opposite, whichever `normal` nearly is.
fn along(line: [f64; 2], normal: [f64; 2]) -> [f64; 2] {
    if line[0] * normal[0] + line[1] * normal[1] >= 0.0 { line } else { line.map(|v| -v) }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
