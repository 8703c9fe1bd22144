//! The figures of the last accepted state, as the screen and `summary.json` tell them.

use super::task::Task;
use serde::Serialize;
use signorini::{
    accuracy::{BY_DIRECTION, Extreme},
    evolution::{GoverningValue, Outcome, Step},
    mesh::Mesh,
    observe::{Bar, Dimension, Figure, ObservedProblem, Of},
    output::terminal::{plain, with_bar},
    scene::rounded,
};
use std::collections::BTreeSet;

/// A figure of the last state.
#[derive(Serialize)]
pub(super) struct LastFigure<'a> {
    #[serde(skip)]
    pub(super) figure: &'a Figure,
    label: &'a str,
    unit: String,
    /// In `summary.json` it is null if there is no such place, as without contact.
    value: f64,
    /// The error bar, if the errors were measured and the mesh determines the figure.
    bar: Option<f64>,
    /// Is the value zero within its bar, and this bar the solver's tolerance?
    #[serde(skip)]
    is_zero: bool,
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

/// A bar below this fraction of the scale of its figure is the solver's tolerance.
const SMALLEST_PART: f64 = 1e-6;

/// The extreme of a run is shown if it differs by more than this fraction from the last value.
const DIFFERENT: f64 = 1e-3;

/// A fact of the screen under the name of its group.
pub(super) type Fact = (&'static str, String);

/// The name under which the screen shows a figure.
fn group(figure: &Figure) -> &'static str {
    match (&figure.of, figure.dimension) {
        (Of::Probe(_), _) => "probe",
        (Of::Boundary(_), _) => "boundary",
        (_, Dimension::Zeta | Dimension::OfZeta) => "damage",
        (_, Dimension::Length) => "displacement",
        (_, Dimension::Work) => "work",
        (_, Dimension::Stress) if !figure.is_pressure() => "stress",
        _ => "contact",
    }
}

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
            let bar = bars.iter().find(|bar| bar.name == figure.name);
            let is_zero = |bar: &Bar| {
                last.figures[i].value.abs() <= bar.bar && bar.relative() < SMALLEST_PART
            };
            LastFigure {
                figure,
                label: &figure.label,
                unit: figure.dimension.unit(units),
                value: last.figures[i].value,
                is_zero: bar.is_some_and(is_zero),
                bar: bar.map(|bar| bar.bar).filter(|_| {
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

    /// The facts about the last state, which is that of a `step`. Displacements of boundaries are for experts.
    pub(super) fn facts(&self, task: &Task, step: usize) -> Vec<Fact> {
        let (problem, figures) = (&task.problem, &self.all);
        let is_sound = self.is_sound();
        // A lone foundation has the pressure of the whole.
        let several = problem.foundations.len() > 1;
        let fact = |(i, of): (usize, &LastFigure)| {
            let group = group(of.figure);
            let is_shown = match (group, of.figure.kind) {
                _ if of.value.is_nan() || of.label.ends_with(", y") => false,
                ("damage", "zeta_min") if is_sound && step == 1 && problem.damage().is_some() => {
                    let why = "none yet: it begins in the second step; set a shorter time.step";
                    return Some((group, why.to_owned()));
                }
                ("damage", "zeta_min") if is_sound => return Some((group, "none".to_owned())),
                ("damage", _) => !is_sound,
                ("boundary", "pressure_max" | "contact_length") if !several => false,
                (_, "pressure_max") => of.value != 0.0,
                ("contact", _) => task.contact_nodes > 0,
                ("boundary", "u_x" | "travel" | "peak_x") => task.verbose,
                ("probe", "zeta") => problem.scene().damage.is_some(),
                _ => true,
            };
            is_shown.then(|| (group, self.fact(i)))
        };
        figures.iter().enumerate().filter_map(fact).collect()
    }

    /// A figure with its label, its bar or the digits that it deserves, and its unit; an extreme also with its place and why the
    /// mesh does not determine it. Two components are one fact.
    fn fact(&self, i: usize) -> String {
        let of = &self.all[i];
        let text = |of: &LastFigure| self.written(of, of.value);
        let (label, text) = match (of.label.strip_suffix(", x"), self.all.get(i + 1)) {
            (Some(label), Some(y)) if of.figure.dimension == Dimension::Place => {
                return format!("{label} {}", self.mesh.place([of.value, y.value]));
            }
            (Some(label), Some(y)) => (label, format!("({}, {})", text(of), text(y))),
            _ => (of.label, text(of)),
        };
        let at = of.at.filter(|_| of.figure.is_extreme());
        let at = at.map_or_else(String::new, |at| format!(" at {}", self.mesh.place(at)));
        let fact = format!("{label} {text} {}", of.unit);
        format!("{}{at}{}", fact.trim_end(), of.reason())
    }

    fn written(&self, of: &LastFigure, value: f64) -> String {
        match of.bar {
            _ if !of.reason().is_empty() => plain(value, 2),
            Some(_) if of.is_zero => "0".to_owned(),
            Some(bar) => with_bar(value, Some(bar)),
            None if of.figure.is_extreme() => plain(value, self.of_stress),
            None => plain(value, self.digits),
        }
    }

    fn is_sound(&self) -> bool {
        self.all.iter().any(|of| of.figure.name == "zeta_min" && of.value == 1.0)
    }

    /// Notes on the extremes that the mesh does not determine, by their reasons.
    pub(super) fn notes(&self, problem: &ObservedProblem) -> Vec<String> {
        let all = |reason: fn(&LastFigure) -> Option<String>| {
            BTreeSet::from_iter(self.all.iter().filter_map(reason))
        };
        let mut notes = Vec::new();
        let places = Vec::from_iter(all(|of| of.singular.clone()));
        if !places.is_empty() {
            let mut note = format!(
                "stresses grow without limit as the mesh is refined at {}",
                places.join(", ")
            );
            if self.is_sound() && problem.damage().is_some() {
                note += ", so that damage may begin there on finer meshes";
            }
            let has_away = self.all.iter().any(|of| of.figure.is_away());
            if let Some(length) = problem.proposed_distance().filter(|_| !has_away) {
                let (length, unit) = (plain(length, 1), &problem.scene().units.length);
                note += &format!(
                    "; `away = {length}` in the scene adds the extremes {length} {unit} away from there"
                );
            }
            notes.push(note + " (explain singular)");
        }
        let coarse = all(|of| of.unresolved.clone().filter(|of| of != BY_DIRECTION));
        notes.extend(
            coarse.iter().map(|reason| format!("not resolved: {reason} (explain not-resolved)")),
        );
        notes
    }

    /// The extremes in the run of figures of the body and of contact, where they differ from the last values: with their times.
    pub(super) fn governing(&self) -> impl Iterator<Item = String> {
        // A lone foundation has the pressure of the whole.
        let several = self.all.iter().filter(|of| of.figure.is_pressure()).count() > 2;
        let is_asked = move |of: &&LastFigure| match (group(of.figure), of.figure.dimension) {
            ("boundary", Dimension::Force) => true,
            ("boundary", _) => of.figure.is_pressure() && several,
            (group, _) => group != "probe",
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
            differs.then(|| format!("{} {} (t = {})", of.label, value(), rounded(governing.time)))
        })
    }
}
