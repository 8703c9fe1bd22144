//! The figures that a run prints, and their error bars.

use super::{DiscreteProblem, notes::TIMES};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, iter};

/// The figures of a [`StepRecord`](crate::evolution::StepRecord) that have an error bar.
const OF_RECORD: [&str; 5] = ["work", "displacement_max", "contact_force", "zeta_min", "zeta_mean"];
/// The extreme stresses of the body, and of each of several materials; and the extremes on Γ_C, of the whole and of
/// each of several foundations: the largest contact pressure, Pa, and the length of contact, m.
const STRESSES: [&str; 3] = ["von_mises_max", "principal_max", "principal_min"];
const CONTACT: [&str; 2] = ["pressure_max", "contact_length"];
/// The groups of the supports' forces and moments.
const FORCES: &str = "forces";
const MOMENTS: &str = "moments";
/// The scale of a figure is at least this fraction of the natural scale of its dimension: of the energy ‖u‖² for a work,
/// of max |u| for a length, and of Σ|f| for a force. Otherwise a force that is zero by symmetry would have no relative error.
const MIN_SCALE: f64 = 1e-3;
/// The scale of a moment is at least this fraction of the maximum force times the body's radius of gyration: a moment is
/// small about any point near the line of its force. The scale of a stress is at least this fraction of the mean stress
/// of the body, about √(E ‖u‖²/|Ω|): a stress at a free corner is zero.
const MIN_PART: f64 = 0.1;
/// The components of a displacement and of a stress at a probe.
const OF_PROBE: [&str; 6] =
    [".u_x", ".u_y", ".stress_xx", ".stress_yy", ".stress_xy", ".von_mises"];
/// The bar of a component is at least this fraction of the largest bar of the components. Without it 7.4 % of 1900 bars of
/// stresses at probes fail on 40 bodies of a user; with a fifth it is 1.5 %, and with 0.3 1.1 %.
const OF_COMPONENTS: f64 = 0.25;
/// A damage below this is negligible.
pub(crate) const NEGLIGIBLE_DAMAGE: f64 = 1e-6;

/// A quantity below this fraction of the natural scale of its dimension is rounding, and shown as zero. Forces are compared
/// with Σ|f|, and so are the reactions of contact.
pub(crate) const SHOWN_AS_ZERO: f64 = 1e-9;

/// The dimension of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dimension {
    /// J per metre of thickness.
    Work,
    /// m.
    Length,
    /// N per metre of thickness.
    Force,
    /// N.
    Moment,
    /// min ζ, mean ζ, or ζ at a point.
    Damage,
    /// Pa.
    Stress,
    /// m, along Γ_C.
    ContactLength,
}

struct Figure {
    name: String,
    dimension: Dimension,
    /// Figures of one group share a scale: the components of a force, of a displacement, of a stress.
    group: String,
}

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
    /// The bar over the scale.
    pub fn relative(&self) -> f64 {
        if self.bar > 0.0 { self.bar / self.scale } else { 0.0 }
    }
}

/// `None` for the whole, and each of the `parts` if there are several.
pub(crate) fn whole_and_parts<T>(parts: &[T]) -> impl Iterator<Item = Option<&T>> {
    let several = if parts.len() > 1 { parts } else { &[] };
    iter::once(None).chain(several.iter().map(Some))
}

impl DiscreteProblem {
    fn figures(&self) -> Vec<Figure> {
        use Dimension::{ContactLength, Damage, Force, Length, Moment, Stress, Work};
        let figure = |name: String| {
            let (of, kind) = name.rsplit_once('.').unwrap_or(("", &name));
            let (dimension, group) = match kind {
                "work" => (Work, name.clone()),
                "displacement_max" => (Length, name.clone()),
                "contact_force" => (Force, name.clone()),
                "force_x" | "force_y" => (Force, FORCES.to_owned()),
                "moment" => (Moment, MOMENTS.to_owned()),
                "u_x" | "u_y" => (Length, format!("u of {of}")),
                // The scale of a damage at a point is the maximum damage of the body.
                "zeta" => (Damage, "zeta_min".to_owned()),
                "zeta_min" | "zeta_mean" => (Damage, name.clone()),
                "pressure_max" => (Stress, kind.to_owned()),
                "contact_length" => (ContactLength, kind.to_owned()),
                _ => (Stress, format!("stress of {of}")),
            };
            Figure { dimension, group, name }
        };
        let of_record = OF_RECORD.map(str::to_owned).into_iter();
        of_record.chain(self.quantities()).chain(self.extremes()).map(figure).collect()
    }

    /// The names of the extremes of a state. With several materials or foundations each has its own too.
    pub(crate) fn extremes(&self) -> Vec<String> {
        let named = |of: Option<&String>, name: &str| match of {
            Some(of) => format!("{of}.{name}"),
            None => name.to_owned(),
        };
        let materials = whole_and_parts(&self.materials).map(|of| of.map(|(_, name)| name));
        let stresses = materials.flat_map(|of| STRESSES.map(|name| named(of, name)));
        let of_contact = CONTACT.iter().filter(|_| self.has_contact());
        let foundations = |name| whole_and_parts(&self.foundations).map(move |of| named(of, name));
        stresses.chain(of_contact.flat_map(|name| foundations(name))).collect()
    }

    pub(crate) fn dimensions(&self) -> Vec<Dimension> {
        self.figures().into_iter().map(|figure| figure.dimension).collect()
    }

    pub(crate) fn figure_names(&self) -> Vec<String> {
        self.figures().into_iter().map(|figure| figure.name).collect()
    }

    /// The error bars of all figures, from their errors and scales. An error may be small by chance, but hardly those of all
    /// components at a probe: it is at least [`OF_COMPONENTS`] of the largest of them.
    pub(crate) fn bars(&self, errors: &[f64], scales: &[f64]) -> Vec<Bar> {
        let figures = self.figures();
        let is_component = |of: &Figure| OF_PROBE.iter().any(|kind| of.name.ends_with(kind));
        let mut largest = BTreeMap::<&str, f64>::new();
        for (of, error) in figures.iter().zip(errors).filter(|(of, _)| is_component(of)) {
            let most = largest.entry(&of.group).or_default();
            *most = most.max(*error);
        }
        let bar = |(of, (&error, &scale)): (&Figure, (&f64, &f64))| {
            let least = largest.get(&*of.group).filter(|_| is_component(of));
            let bar = error.max(least.map_or(0.0, |most| OF_COMPONENTS * most));
            Bar { name: of.name.clone(), dimension: of.dimension, bar, scale }
        };
        figures.iter().zip(errors.iter().zip(scales)).map(bar).collect()
    }

    /// The scale of each figure: the maximum of its group in a run, and at least a part of its natural scale. From the
    /// `largest` [sizes](Self::figure_sizes) and extremes, ‖u‖² (`energy`, N m per metre of thickness) and Σ|f| (`forces`, N per metre
    /// of thickness) of the run. All forces may balance, as in pure bending; their sum of moduli does not vanish.
    /// An extreme that the meshes leave `unsettled` is no scale of the others.
    pub(crate) fn figure_scales(
        &self,
        largest: [&[f64]; 2],
        unsettled: &[String],
        energy: f64,
        forces: f64,
    ) -> Vec<f64> {
        let figures = self.figures();
        let sizes = || figures.iter().zip(largest.into_iter().flatten());
        let most = |is_like: &dyn Fn(&Figure) -> bool| {
            let like = sizes().filter(|(of, _)| is_like(of) && !unsettled.contains(&of.name));
            like.map(|(_, value)| *value).fold(0.0, f64::max)
        };
        let lever = self.body.radius_of_gyration();
        let young = self.scene().materials().map(|material| material.young);
        let mean_stress = (young.fold(f64::INFINITY, f64::min) * energy / self.body.area).sqrt();
        let scale = |figure: &Figure| {
            let own = most(&|other| other.group == figure.group);
            let least = match figure.dimension {
                Dimension::Work => MIN_SCALE * energy,
                Dimension::Length => {
                    MIN_SCALE * most(&|other| other.dimension == Dimension::Length)
                }
                Dimension::Force => MIN_SCALE * forces,
                Dimension::Moment => {
                    let resultant = most(&|other| other.dimension == Dimension::Force);
                    lever * (MIN_PART * resultant).max(MIN_SCALE * forces)
                }
                Dimension::Damage => NEGLIGIBLE_DAMAGE,
                Dimension::Stress => MIN_PART * mean_stress,
                // A sum of lengths of edges has no rounding.
                Dimension::ContactLength => 0.0,
            };
            own.max(least)
        };
        figures.iter().map(scale).collect()
    }

    /// The values of [`Self::quantities`] with zeros in place of rounding, which is in a force at most `force`, N per metre
    /// of thickness, and in a displacement at most `displacement`, m. With the body's radius of gyration r it is in a
    /// moment r times the force, and in a stress the force over r.
    pub(crate) fn without_rounding(
        &self,
        mut values: Vec<f64>,
        (force, displacement): (f64, f64),
    ) -> Vec<f64> {
        let figures = &self.figures()[OF_RECORD.len()..];
        let lever = self.body.radius_of_gyration();
        for (value, figure) in values.iter_mut().zip(figures) {
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

    /// The sizes of all figures, from which their scales come: |value|, and 1 − ζ for a damage.
    pub(crate) fn figure_sizes(&self, values: &[f64]) -> Vec<f64> {
        let size = |(figure, value): (&Figure, &f64)| match figure.dimension {
            Dimension::Damage => 1.0 - value,
            _ => value.abs(),
        };
        self.figures().iter().zip(values).map(size).collect()
    }

    /// Adds to the error bars the solver's tolerance and the errors of the loads' integrals, which all meshes
    /// of a measurement may have, and of the time steps.
    ///
    /// u depends on the past, and so on the steps, only through ζ: their errors are relative to the scales `now`, in the last
    /// state.
    pub(crate) fn add_step_errors(&self, bars: &mut [Bar], now: &[f64], of_steps: [f64; 4]) {
        let [force, of_loads] =
            self.loads.integral_errors(&self.body, &self.scene().sample_times(TIMES));
        let lever =
            self.body.radius_of_gyration() + self.body.centroid[0].hypot(self.body.centroid[1]);
        let [zeta, zeta_min, zeta_mean, displacement] = of_steps;
        for (bar, now) in bars.iter_mut().zip(now) {
            bar.bar += self.tolerance * bar.scale;
            bar.bar += match bar.dimension {
                Dimension::Damage => 0.0,
                Dimension::Force if bar.name == "contact_force" && !self.has_contact() => 0.0,
                Dimension::Force => force.max(of_loads * bar.scale),
                Dimension::Moment => (lever * force).max(of_loads * bar.scale),
                _ => of_loads * bar.scale,
            };
            bar.bar += match bar.dimension {
                Dimension::Damage if bar.name == "zeta_min" => zeta_min,
                Dimension::Damage if bar.name == "zeta_mean" => zeta_mean,
                Dimension::Damage => zeta,
                // σ = ζ𝒜ε(u).
                Dimension::Stress => (displacement + zeta) * now,
                _ => displacement * now,
            };
        }
    }
}
