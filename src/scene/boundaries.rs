//! What may hold on the parts of the boundary, and what may not hold together.

use std::collections::BTreeMap;

use toml::Spanned;

use super::error::SceneError;
use super::expression::Expression;
use super::file::{BoundaryTable, Formula, Vector};
use super::validate::Check;
use super::{Boundary, Gap};

impl Check<'_> {
    pub(super) fn boundaries(
        &self,
        tables: &Spanned<Vec<Spanned<BoundaryTable>>>,
    ) -> Result<Vec<Boundary>, SceneError> {
        if tables.get_ref().is_empty() {
            return Err(self.invalid(&tables.span(), "must hold at least one boundary"));
        }
        let mut first: BTreeMap<&str, &Spanned<String>> = BTreeMap::new();
        let mut boundaries = Vec::new();
        for table in tables.get_ref() {
            let name = &table.get_ref().name;
            if let Some(earlier) = first.insert(name.get_ref(), name) {
                let earlier = self.source.place(&earlier.span());
                let problem = format!("is given twice, first at {earlier}; merge the two");
                return Err(self.invalid(&table.span(), problem));
            }
            boundaries.push(self.boundary(table)?);
        }
        Ok(boundaries)
    }

    fn boundary(&self, table: &Spanned<BoundaryTable>) -> Result<Boundary, SceneError> {
        let (span, table) = (table.span(), table.get_ref());
        let symmetry = table.symmetry.unwrap_or(false);
        let conflict = match (&table.displacement, symmetry, &table.gap) {
            (Some(_), _, Some(_)) => Some("a displacement and a gap"),
            (Some(_), true, _) => Some("a displacement and a symmetry"),
            (_, true, Some(_)) => Some("a symmetry and a gap"),
            _ => None,
        };
        if let Some(both) = conflict {
            let problem = format!("has {both}; only one of them can hold");
            return Err(self.invalid(&span, problem));
        }
        let displacement = table.displacement.as_ref();
        let boundary = Boundary {
            name: table.name.get_ref().clone(),
            displacement: displacement.map(|d| self.displacement(d)).transpose()?,
            symmetry,
            traction: table.traction.as_ref().map(|t| self.vector(t)).transpose()?,
            gap: self.gap(table)?,
        };
        match &boundary {
            Boundary { displacement: Some([Some(_), Some(_)]), traction: Some(_), .. } => {
                let problem = "has a traction, but both displacements are prescribed: \
                               leave the traction out or a component \"free\"";
                Err(self.invalid(&span, problem))
            }
            Boundary { displacement: None, symmetry: false, traction: None, gap: None, .. } => {
                let problem = "has nothing in it: give it a displacement, symmetry = true, \
                               a traction or a gap, or remove it";
                Err(self.invalid(&span, problem))
            }
            _ => Ok(boundary),
        }
    }

    fn displacement(&self, vector: &Vector) -> Result<[Option<Expression>; 2], SceneError> {
        let component = |formula: &Spanned<Formula>| match formula.get_ref() {
            Formula::Text(text) if text.trim() == "free" => Ok(None),
            _ => self.expression(formula).map(Some),
        };
        let [x, y] = self.pair(vector)?;
        match [component(x)?, component(y)?] {
            [None, None] => {
                let problem = "is \"free\" in both components; leave it out";
                Err(self.invalid(&vector.span(), problem))
            }
            components => Ok(components),
        }
    }

    fn gap(&self, table: &BoundaryTable) -> Result<Option<Gap>, SceneError> {
        let Some(gap) = &table.gap else {
            return match &table.normal {
                Some(normal) => Err(self.invalid(&normal.span(), "needs a gap beside it")),
                None => Ok(None),
            };
        };
        let distance = self.in_space(gap)?;
        let normal = table.normal.as_ref().map(|n| self.normal(n)).transpose()?;
        Ok(Some(Gap { distance, normal }))
    }

    /// A constant direction, scaled to length 1.
    fn normal(&self, vector: &Vector) -> Result<[f64; 2], SceneError> {
        let component = |formula| {
            let value = self.expression(formula)?.as_constant();
            value.ok_or_else(|| self.invalid(&formula.span(), "must be a constant"))
        };
        let [x, y] = self.pair(vector)?;
        let (x, y) = (component(x)?, component(y)?);
        let length = x.hypot(y);
        if length > 0.0 && length.is_finite() {
            Ok([x / length, y / length])
        } else {
            Err(self.invalid(&vector.span(), "has no direction: its length is zero"))
        }
    }
}

/// What `a` and `b`, two boundaries on the same edge, have that cannot both hold there; as within
/// one boundary.
pub(super) fn contradiction(a: &Boundary, b: &Boundary) -> Option<[&'static str; 2]> {
    let one_way = |a: &Boundary, b: &Boundary| match (&a.displacement, a.symmetry) {
        (Some(_), _) if b.gap.is_some() => Some(["a displacement", "a gap"]),
        (Some(_), _) if b.symmetry => Some(["a displacement", "a symmetry"]),
        (Some([Some(_), Some(_)]), _) if b.traction.is_some() => {
            Some(["both displacements prescribed", "a traction"])
        }
        (_, true) if b.gap.is_some() => Some(["a symmetry", "a gap"]),
        _ => None,
    };
    one_way(a, b).or_else(|| one_way(b, a).map(|[of_b, of_a]| [of_a, of_b]))
}
