//! The scales of figures: of relative errors, and of rounding.

use super::{Dimension, Figure, Figures, Governing, Value};
use crate::observe::ObservedProblem;
use serde::{Deserialize, Serialize};

/// A damage below this is negligible.
pub(crate) const NEGLIGIBLE_DAMAGE: f64 = 1e-6;

/// A quantity below this fraction of the natural scale of its dimension is rounding, and shown as zero. Forces are compared
/// with Σ|f|, and so are the reactions of contact.
pub(crate) const SHOWN_AS_ZERO: f64 = 1e-9;

/// The error bar of a figure of the last state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    /// The name of the figure, as in `summary.json`.
    pub name: String,
    /// Its dimension.
    pub dimension: Dimension,
    /// The error bar, in the unit of the figure.
    pub bar: f64,
    /// The scale of its relative error: the maximum of the figure in the run, and of 1 − ζ for a damage ζ.
    pub scale: f64,
}

impl Bar {
    /// The bar over the scale; infinite if it is no number.
    pub fn relative(&self) -> f64 {
        match self.bar / self.scale {
            _ if self.bar == 0.0 => 0.0,
            relative if relative.is_nan() => f64::INFINITY,
            relative => relative,
        }
    }
}

impl ObservedProblem {
    /// The extreme of the part in which the extreme `number` lies; itself if it has no parts.
    pub(crate) fn part_of(&self, number: usize, values: &[Value]) -> usize {
        let size = |k: &usize| self.figures[*k].size(values[*k].value);
        self.figures.parts(number).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(number)
    }

    /// The `values` of figures with zeros in place of rounding, which is in a force at most `force`, N per metre
    /// of thickness, and in a displacement at most `displacement`, m. With the body's radius of gyration r it is in a
    /// moment r times the force, and in a stress the force over r.
    pub(crate) fn without_rounding(
        &self,
        mut values: Vec<Value>,
        (force, displacement): (f64, f64),
    ) -> Vec<Value> {
        let lever = self.body.radius_of_gyration();
        for (Value { value, .. }, figure) in values.iter_mut().zip(self.figures.iter()) {
            let rounding = match figure.dimension {
                Dimension::Length => displacement,
                Dimension::Force => force,
                Dimension::Moment => lever * force,
                Dimension::Stress => force / lever,
                _ => 0.0,
            };
            // No -0.
            *value = if value.abs() <= rounding { 0.0 } else { *value + 0.0 };
        }
        values
    }
}

impl Figure {
    /// The size of a value, from which scales come: |value|, and 1 − ζ for a least or mean ζ.
    pub fn magnitude(&self, value: f64) -> f64 {
        match self.dimension {
            dimension if dimension.is_damage() && self.governing == Governing::Least => 1.0 - value,
            dimension if dimension.has_bar() => value.abs(),
            _ => 0.0,
        }
    }
}

impl Figures {
    /// The magnitudes of all figures.
    pub(crate) fn magnitudes(&self, values: impl IntoIterator<Item = f64>) -> Vec<f64> {
        self.iter().zip(values).map(|(figure, value)| figure.magnitude(value)).collect()
    }
}
