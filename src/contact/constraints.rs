//! From directions and values at nodes to nodal bases, prescribed unknowns and bounds.

use super::{Bound, ConstraintError, FixedRow, GapRow};
use crate::{
    fem::{NodalBases, Subdomain},
    mesh::extent,
};
use nalgebra::Matrix2;
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
    /// Fixed rows whose direction other rows determine already, with their numbers.
    implied: Vec<(FixedRow, usize)>,
    /// Gap conditions that bound an unknown which another one bounds already.
    further: Vec<FurtherGap>,
    /// Gap conditions at nodes whose normal displacement is prescribed.
    prescribed_gaps: Vec<GapRow>,
}

/// u·ν ≤ g as a u·d + b c ≤ g, with d a prescribed direction and c a bounded unknown.
#[derive(Debug, Clone, Copy)]
struct FurtherGap {
    /// The bounded unknown c.
    dof: usize,
    /// The prescribed unknown u·d, if a is not 0.
    fixed: Option<usize>,
    /// ν = a d + b n, where n is the direction of c.
    a: f64,
    b: f64,
    /// g, m.
    gap: f64,
}

/// Directions whose lines are closer than this angle, rad, are one direction.
const PARALLEL: f64 = 1e-8;
/// Directions closer than this angle, rad, but not one, are refused: the basis they make at a node
/// loses as many digits as the angle has zeros. (A contact solve reaches the default tolerance
/// down to here.)
pub(super) const DEPENDENT: f64 = 1e-4;
/// Prescribed values may differ by this much of the largest, and a gap may lack this much of the
/// body's size: rounding of coordinates and expressions.
const ROUNDING: f64 = 1e-12;

impl Constraints {
    /// Combines all rows node by node, gap rows being joined ([`GapRow::joined`]); `coordinates`, m,
    /// serve the error messages.
    ///
    /// # Errors
    /// Conditions of a node contradict each other, or are too many for its two unknowns.
    pub fn new(
        coordinates: &[[f64; 2]],
        fixed: &[FixedRow],
        gaps: &[GapRow],
    ) -> Result<Self, ConstraintError> {
        let mut nodes: BTreeMap<usize, (Vec<usize>, Vec<GapRow>)> = BTreeMap::new();
        for (number, row) in fixed.iter().enumerate() {
            nodes.entry(row.node).or_default().0.push(number);
        }
        gaps.iter().for_each(|gap| nodes.entry(gap.node).or_default().1.push(*gap));
        let mut constraints = Self {
            bases: NodalBases::identity(coordinates.len()),
            bounds: Vec::new(),
            gaps: Vec::new(),
            prescribed: Vec::new(),
            implied: Vec::new(),
            further: Vec::new(),
            prescribed_gaps: Vec::new(),
        };
        for (node, (numbers, gaps)) in nodes {
            let at = coordinates[node];
            // The basis of a node: its prescribed directions, then the normals of its gaps as far
            // as they are independent of these and of each other.
            let mut basis = constraints.prescribe(node, &numbers, fixed);
            let prescribed = basis.len();
            for gap in gaps {
                constraints.add_gap(gap, &mut basis, prescribed, at)?;
            }
            constraints.set_basis(node, &basis, at)?;
        }
        // Only what prescribed displacements change is left for later.
        let (moving, still) = constraints.further.into_iter().partition(|gap| gap.fixed.is_some());
        constraints.further = still;
        constraints.bounds = constraints.bounds_at(&[], coordinates)?;
        constraints.further = moving;
        Ok(constraints)
    }

    /// Prescribes unknowns of a node in the first independent directions, and returns these.
    fn prescribe(&mut self, node: usize, numbers: &[usize], fixed: &[FixedRow]) -> Vec<[f64; 2]> {
        let mut basis: Vec<[f64; 2]> = Vec::new();
        for &number in numbers {
            let (d, dof) = (fixed[number].direction, 2 * node + basis.len());
            if basis.len() < 2 && basis.iter().all(|b| cross(*b, d).abs() > PARALLEL) {
                self.prescribed.push((dof, number));
                self.bases.fix(dof);
                basis.push(d);
            } else {
                self.implied.push((fixed[number], number));
            }
        }
        basis
    }

    /// Adds a gap condition at a node whose first `prescribed` directions are prescribed. A gap
    /// along an earlier normal (or against it: a node between two plates) is one more side of the
    /// same unknown.
    fn add_gap(
        &mut self,
        mut gap: GapRow,
        basis: &mut Vec<[f64; 2]>,
        prescribed: usize,
        at: [f64; 2],
    ) -> Result<(), ConstraintError> {
        let node = gap.node;
        // Where nothing is left to move, no unknown is needed.
        let line = if prescribed == 2 { None } else { parallel(basis, gap.normal, at)? };
        if let Some(line) = line {
            // Exactly this line, so that its rows cannot contradict each other by rounding.
            gap.normal = along(basis[line], gap.normal);
        }
        self.gaps.push(gap);
        match line {
            _ if prescribed == 2 => self.prescribed_gaps.push(gap),
            Some(line) if line < prescribed => self.prescribed_gaps.push(gap),
            Some(line) => {
                let b = if basis[line] == gap.normal { 1.0 } else { -1.0 };
                let dof = 2 * node + line;
                self.further.push(FurtherGap { dof, fixed: None, a: 0.0, b, gap: gap.gap });
            }
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
            None if prescribed == 0 => return Err(ConstraintError::TooMany { at }),
            None => {
                // ν = a d + b n, by Cramer's rule.
                let (d, n) = (basis[0], basis[1]);
                let area = cross(d, n);
                let (a, b) = (cross(gap.normal, n) / area, cross(d, gap.normal) / area);
                let (dof, fixed) = (2 * node + 1, Some(2 * node));
                self.further.push(FurtherGap { dof, fixed, a, b, gap: gap.gap });
            }
        }
        Ok(())
    }

    /// Makes `basis`, completed by a perpendicular, the basis of a node, unless it is the identity.
    fn set_basis(
        &mut self,
        node: usize,
        basis: &[[f64; 2]],
        at: [f64; 2],
    ) -> Result<(), ConstraintError> {
        let (a, b) = match *basis {
            [d] => (d, [-d[1], d[0]]),
            [a, b] => (a, b),
            _ => return Ok(()),
        };
        let directions = Matrix2::new(a[0], a[1], b[0], b[1]);
        if directions == Matrix2::identity() {
            return Ok(());
        }
        let dependent = ConstraintError::Dependent { at, angle: cross(a, b).abs() };
        self.bases.set(node, directions).ok_or(dependent)
    }

    /// The bounded unknowns with their bounds where the prescribed ones have the values `lift`, m
    /// (two entries per node).
    ///
    /// # Errors
    /// Obstacles on both sides of a node leave it no room.
    pub fn bounds_at(
        &self,
        lift: &[f64],
        coordinates: &[[f64; 2]],
    ) -> Result<Vec<Bound>, ConstraintError> {
        let mut bounds = self.bounds.clone();
        for &FurtherGap { dof, fixed, a, b, gap } in &self.further {
            let Ok(place) = bounds.binary_search_by_key(&dof, |bound| bound.dof) else {
                continue;
            };
            let bound = &mut bounds[place];
            let value = (gap - fixed.map_or(0.0, |dof| a * lift[dof])) / b;
            match b > 0.0 {
                true => bound.upper = bound.upper.min(value),
                false => bound.lower = bound.lower.max(value),
            }
            let depth = bound.lower - bound.upper;
            if depth > 0.0 {
                if depth > ROUNDING * extent(coordinates) {
                    return Err(ConstraintError::NoRoom { at: coordinates[bound.node], depth });
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
        let at_node = (first..self.bounds.len()).take_while(|&i| self.bounds[i].node == node);
        let off = |i: &usize| cross(self.bounds[*i].normal, normal).abs();
        at_node.min_by(|i, j| off(i).total_cmp(&off(j)))
    }

    /// The prescribed unknowns c_D, m (0 elsewhere) when `values[row]` is u·d of each fixed row.
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
        let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for &(FixedRow { node, direction }, number) in &self.implied {
            let values = [along(node, direction), values[number]];
            if (values[0] - values[1]).abs() > ROUNDING * largest {
                let at = coordinates[node];
                return Err(ConstraintError::Contradicts { at, values, direction });
            }
        }
        for gap in &self.prescribed_gaps {
            let depth = along(gap.node, gap.normal) - gap.gap;
            if depth > ROUNDING * largest.max(extent(coordinates)) {
                return Err(ConstraintError::Penetrates { at: coordinates[gap.node], depth });
            }
        }
        Ok(c)
    }

    /// The conditions at the nodes of a rank's subdomain; bounds are their owners'. The fixed rows
    /// keep their numbers.
    pub fn restrict(&self, subdomain: &Subdomain) -> Self {
        let local = |node: usize| subdomain.local(node);
        let owned = |node: usize| subdomain.owned(node);
        let renumbered = |dof: usize, node: usize| 2 * node + dof % 2;
        let bound = |b: &Bound| {
            let node = owned(b.node)?;
            Some(Bound { node, dof: renumbered(b.dof, node), ..*b })
        };
        let mut bounds: Vec<Bound> = self.bounds.iter().filter_map(bound).collect();
        bounds.sort_by_key(|bound| bound.dof);
        let gap = |gap: &GapRow| Some(GapRow { node: owned(gap.node)?, ..*gap });
        let mut gaps: Vec<GapRow> = self.gaps.iter().filter_map(gap).collect();
        gaps.sort_by_key(|gap| gap.node);
        let local_dof = |dof: usize| Some(renumbered(dof, local(dof / 2)?));
        let prescribed = |&(dof, row): &(usize, usize)| Some((local_dof(dof)?, row));
        let implied = |&(row, number): &(FixedRow, usize)| {
            Some((FixedRow { node: local(row.node)?, ..row }, number))
        };
        let further = |gap: &FurtherGap| {
            let dof = renumbered(gap.dof, owned(gap.dof / 2)?);
            Some(FurtherGap { dof, fixed: gap.fixed.and_then(local_dof), ..*gap })
        };
        let known = |gap: &GapRow| Some(GapRow { node: local(gap.node)?, ..*gap });
        Self {
            bases: self.bases.restrict(subdomain),
            bounds,
            gaps,
            prescribed: self.prescribed.iter().filter_map(prescribed).collect(),
            implied: self.implied.iter().filter_map(implied).collect(),
            further: self.further.iter().filter_map(further).collect(),
            prescribed_gaps: self.prescribed_gaps.iter().filter_map(known).collect(),
        }
    }
}

/// The direction of `basis` on whose line `normal` lies.
fn parallel(
    basis: &[[f64; 2]],
    normal: [f64; 2],
    at: [f64; 2],
) -> Result<Option<usize>, ConstraintError> {
    let angles = || basis.iter().map(|b| cross(*b, normal).abs());
    if let Some(angle) = angles().find(|angle| (PARALLEL..DEPENDENT).contains(angle)) {
        return Err(ConstraintError::Dependent { at, angle });
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

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
