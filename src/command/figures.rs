//! The figures of the last accepted state, as the screen and `summary.json` tell them.

use super::task::Task;
use serde::Serialize;
use signorini::{
    accuracy::{BY_DIRECTION, Extreme},
    evolution::{GoverningValue, Outcome, Step},
    mesh::Mesh,
    observe::{Dimension, Figure, Of},
    output::terminal::{plain, with_bar},
};

/// A figure of the last state.
#[derive(Serialize)]
pub(super) struct LastFigure<'a> {
    #[serde(skip)]
    pub(super) figure: &'a Figure,
    label: &'a str,
    pub(super) unit: String,
    /// In `summary.json` it is null if there is no such place, as without contact.
    pub(super) value: f64,
    /// The error bar, if the errors were measured and the mesh determines the figure.
    bar: Option<f64>,
    /// Its place, m, if it is found at one.
    at: Option<[f64; 2]>,
    /// Why the mesh does not determine an extreme.
    singular: Option<String>,
    unresolved: Option<String>,
    /// The extreme over all steps, and its time.
    governing: Option<GoverningValue>,
}

impl LastFigure<'_> {
    /// Why the mesh does not determine it, in a word; "" if it does.
    fn reason(&self) -> &'static str {
        match (&self.singular, &self.unresolved) {
            (Some(_), _) => ": singular",
            (None, Some(reason)) if reason == BY_DIRECTION => ": depends on the direction there",
            (None, Some(_)) => ": not resolved",
            (None, None) => "",
        }
    }
}

/// The figures of the last state, and how they are written.
pub(super) struct LastFigures<'a> {
    pub(super) all: Vec<LastFigure<'a>>,
    mesh: &'a Mesh,
    /// The decimals of a figure without a bar: all that the residuals deserve, or two if the measurement gave no bar.
    digits: usize,
    /// The digits that the estimated error of u leaves in a stress, at most five.
    of_stress: usize,
}

/// The extreme of a run is shown if it differs by more than this fraction from the last value.
const DIFFERENT: f64 = 1e-3;

impl<'a> LastFigures<'a> {
    /// The figures of the step `last` of a run, whose `extremes` the mesh may not determine.
    pub(super) fn new(
        task: &'a Task,
        last: &Step,
        extremes: &[Extreme],
        outcome: Option<&Outcome>,
    ) -> Self {
        let (problem, measured) = (&task.problem, &task.accuracy.measured);
        let units = &problem.scene().units;
        let bars = outcome.map_or(&[][..], |outcome| &outcome.bars);
        let figure = |(i, figure): (usize, &'a Figure)| {
            let extreme = extremes.iter().find(|of| of.name == figure.name);
            let bar = bars.iter().find(|bar| bar.name == figure.name).map(|bar| bar.bar);
            LastFigure {
                figure,
                label: &figure.label,
                unit: figure.dimension.unit(units),
                value: last.figures[i].value,
                bar: bar.filter(|_| {
                    extreme.is_none_or(Extreme::is_known) && !last.figures[i].value.is_nan()
                }),
                at: last.figures[i].at,
                singular: extreme.and_then(|of| of.singular.clone()),
                unresolved: extreme.and_then(|of| of.unresolved.clone()),
                governing: last.governing[i],
            }
        };
        let is_measured =
            task.accuracy.adapted.is_some() || !measured.bars.is_empty() || measured.stop.is_some();
        let error = outcome.map_or(0.0, |outcome| outcome.errors.displacement_mesh);
        let of_stress = (1.0 - error.log10()).ceil().clamp(2.0, 5.0) as usize;
        Self {
            all: problem.figures.iter().enumerate().map(figure).collect(),
            mesh: problem.mesh(),
            digits: if is_measured { 3 } else { 7 },
            of_stress: if is_measured { 3 } else { of_stress },
        }
    }

    /// A figure by its name.
    pub(super) fn get(&self, name: &str) -> Option<&LastFigure<'a>> {
        self.all.iter().find(|of| of.figure.name == name)
    }

    /// A value by the name of its figure; NaN if there is no such figure.
    pub(super) fn value(&self, name: &str) -> f64 {
        self.get(name).map_or(f64::NAN, |of| of.value)
    }

    /// A figure with its bar or, without one, with the digits that it deserves; "" if there is no such figure.
    pub(super) fn text(&self, name: &str) -> String {
        self.get(name).map_or_else(String::new, |of| self.written(of, of.value))
    }

    /// As [`Self::text`], with its unit, and an extreme also with its place and why the mesh does not determine it.
    pub(super) fn full_text(&self, name: &str) -> String {
        let Some(of) = self.get(name) else { return String::new() };
        let at = of.at.filter(|_| of.figure.is_extreme());
        let at = at.map_or_else(String::new, |at| format!(" at {}", self.mesh.place(at)));
        format!("{} {}{at}{}", self.written(of, of.value), of.unit, of.reason())
    }

    fn written(&self, of: &LastFigure, value: f64) -> String {
        match of.bar {
            _ if !of.reason().is_empty() => plain(value, 2),
            Some(bar) => with_bar(value, Some(bar)),
            None if of.figure.is_extreme() => plain(value, self.of_stress),
            None => plain(value, self.digits),
        }
    }

    /// The reason why an extreme is singular, if it is.
    pub(super) fn singular(&self, name: &str) -> Option<&str> {
        self.get(name)?.singular.as_deref()
    }

    /// The place with the coordinates `KIND_x` and `KIND_y`; `None` if there is none.
    pub(super) fn place(&self, kind: &str) -> Option<String> {
        let place = ["x", "y"].map(|axis| self.value(&format!("{kind}_{axis}")));
        place[0].is_finite().then(|| self.mesh.place(place))
    }

    /// The extremes in the run of figures of the body and of contact, where they differ from the last values: the label, the
    /// extreme and its time.
    pub(super) fn governing(&self) -> impl Iterator<Item = (&str, String, f64)> {
        // A lone foundation has the pressure of the whole.
        let several = self.all.iter().filter(|of| of.figure.is_pressure()).count() > 2;
        let is_asked = move |of: &&LastFigure| match (&of.figure.of, of.figure.dimension) {
            (Of::Body | Of::Material(_), _) | (Of::Boundary(_), Dimension::Force) => true,
            (Of::Boundary(_), _) => of.figure.is_pressure() && several,
            (Of::Probe(_), _) => false,
        };
        self.all.iter().filter(is_asked).filter_map(|of| {
            let governing = of.governing?;
            let scale = [of.value, governing.value].map(|value| of.figure.magnitude(value));
            // The reason why the mesh does not determine the last value holds at its place.
            let (digits, reason) = match of.figure.is_extreme() && governing.at == of.at {
                true if !of.reason().is_empty() => (2, of.reason()),
                _ => (4, ""),
            };
            let value = || {
                let value = format!("{} {}", plain(governing.value, digits), of.unit);
                format!("{}{reason}", value.trim_end())
            };
            let change = (governing.value - of.value).abs();
            let differs = change > DIFFERENT * scale[0].max(scale[1])
                && plain(governing.value, digits) != plain(of.value, digits);
            differs.then(|| (of.label, value(), governing.time))
        })
    }
}
