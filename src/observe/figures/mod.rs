//! The figures of a run: every number that it prints with a name, a label, a unit and a place.
//!
//! One list, made once per problem: of the whole body, of each of several materials, of each boundary of the scene, and of
//! each probe. The columns of `history.csv`, the entries of `summary.json`, the closing lines, the error bars, the names of
//! `accuracy_of` and the reports follow from it. A new figure is one more [`Figure`] in [`Figures::new`].

mod observation;
mod scales;

pub(crate) use observation::{Observation, greatest};
pub use scales::Bar;
pub(crate) use scales::{NEGLIGIBLE_DAMAGE, SHOWN_AS_ZERO};

use super::{Supports, away::Region};
use crate::{
    problem::DiscreteProblem,
    scene::{Boundary, Gap, Units},
};
use serde::{Deserialize, Serialize};
use std::{fmt, iter, ops::Index, slice};

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
    /// ζ at a point.
    Zeta,
    /// A number from 0 to 1 that follows from ζ in the whole body, as its mean.
    OfZeta,
    /// A stress, or the contact pressure, Pa.
    Stress,
    /// m, along Γ_C.
    ContactLength,
    /// s.
    Time,
    /// A coordinate of a place, m. It has no error bar and no extreme in a run.
    Place,
    /// A length that the scene gives, m. It has no error.
    Given,
}

impl Dimension {
    /// The unit, by the names of a scene; "" without a unit.
    pub fn unit(self, units: &Units) -> String {
        match self {
            Self::Work => units.work(),
            Self::Length | Self::ContactLength | Self::Place | Self::Given => units.length.clone(),
            Self::Force => format!("{}/{}", units.force, units.length),
            Self::Moment => units.force.clone(),
            Self::Time => units.time.clone(),
            Self::Zeta | Self::OfZeta => String::new(),
            Self::Stress => units.stress.clone(),
        }
    }

    /// Do figures of this dimension have error bars?
    pub fn has_bar(self) -> bool {
        !matches!(self, Self::Place | Self::Given)
    }

    /// Is it a value of ζ?
    pub fn is_damage(self) -> bool {
        matches!(self, Self::Zeta | Self::OfZeta)
    }
}

/// Which value of a run governs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Governing {
    Largest,
    Least,
    LargestModulus,
}

/// The part of the problem that a figure describes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Of {
    /// The whole body, or all of Γ_C.
    Body,
    /// One of several materials, by its name.
    Material(String),
    /// A boundary of the scene, by its name.
    Boundary(String),
    /// A probe, by its name.
    Probe(String),
}

/// The value of a figure in a state, and the place at which it is found, m, if it is found at one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Value {
    /// In the unit of the figure. It is NaN if there is no such place, as without contact.
    pub value: f64,
    /// The place, m.
    pub at: Option<[f64; 2]>,
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self { value, at: None }
    }
}

/// A printed number.
pub struct Figure {
    /// The name, as in `history.csv` and `summary.json`: `KIND`, or `NAME.KIND`.
    pub name: String,
    /// The part of the name that figures of the body and of its parts share.
    pub kind: &'static str,
    /// The body, material, boundary or probe that it describes.
    pub of: Of,
    /// Its name in words, for people.
    pub label: String,
    /// Its dimension.
    pub dimension: Dimension,
    governing: Governing,
    /// Figures of one group share a scale: the components of a force, of a displacement, of a stress.
    pub(crate) group: String,
    value: Box<dyn Fn(&Observation) -> Value>,
}

impl fmt::Debug for Figure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} ({:?})", self.name, self.dimension)
    }
}

impl Figure {
    /// Is it an extreme over points, which may be singular or not resolved?
    pub fn is_extreme(&self) -> bool {
        self.dimension == Dimension::Stress && self.governing != Governing::LargestModulus
    }

    /// Is it an extreme over places away from singular points?
    pub fn is_away(&self) -> bool {
        self.kind.ends_with("_away")
    }

    /// Is it an extreme of the contact pressure?
    pub fn is_pressure(&self) -> bool {
        self.kind == "pressure_max"
    }

    /// The value, or its opposite if the extreme is a minimum: the extreme has the largest size.
    pub fn size(&self, value: f64) -> f64 {
        if self.governing == Governing::Least { -value } else { value }
    }

    /// Is `value` more extreme than `other`, the extreme of the steps before? Before the first step `other` is `None`. Places have
    /// no extremes.
    pub fn governs(&self, value: f64, other: Option<f64>) -> bool {
        // A first contact has no value before.
        let Some(other) = other else {
            return !value.is_nan() && self.dimension != Dimension::Place;
        };
        match self.governing {
            Governing::Largest => value > other,
            Governing::Least => value < other,
            Governing::LargestModulus => value.abs() > other.abs(),
        }
    }
}

/// A boundary of the scene.
struct PartOfBoundary<'a> {
    name: &'a str,
    /// Its number among the supports, and among the foundations.
    support: Option<usize>,
    foundation: Option<usize>,
    /// Does its foundation move?
    moves: bool,
    /// Is the undeformed body apart from its foundation at the start?
    is_open: bool,
}

/// The kinds of the figures of a first contact: its time, and the components of the resultant of all loads then.
pub const FIRST_CONTACT: [&str; 3] =
    ["first_contact", "load_x_at_first_contact", "load_y_at_first_contact"];

/// The figures of a problem.
#[derive(Debug, Default)]
pub struct Figures(Vec<Figure>);

impl Index<usize> for Figures {
    type Output = Figure;

    fn index(&self, number: usize) -> &Figure {
        &self.0[number]
    }
}

/// The name of a material in texts. Surfaces without a table of their own are the rest of the body.
pub fn in_words(material: &str) -> &str {
    if material == "material" { "the rest of the body" } else { material }
}

impl Figures {
    /// The list of all figures of a problem with these supports and this region `away` from singular points.
    pub(super) fn of(problem: &DiscreteProblem, supports: &Supports, away: &Region) -> Self {
        let several = if problem.materials.len() > 1 { &problem.materials[..] } else { &[] };
        let number = |names: &[String], of: &str| names.iter().position(|name| name == of);
        let opens = |gap: &Gap, of: &Boundary| {
            let mut places = problem.mesh().edges_of(&of.name).iter().flatten();
            places.all(|&node| {
                let [x, y] = problem.mesh().nodes[node];
                gap.distance.eval(x, y, 0.0) > 0.0
            })
        };
        let boundaries = problem.scene().boundaries.iter().map(|of| PartOfBoundary {
            name: &of.name,
            support: number(&supports.names, &of.name),
            foundation: number(&problem.foundations, &of.name),
            moves: of.gap().is_some_and(|gap| gap.distance.depends_on_time()),
            is_open: problem.scene().time.is_some() && of.gap().is_some_and(|gap| opens(gap, of)),
        });
        let materials = several.iter().map(|(_, name)| name.as_str());
        let probes = problem.scene().probes.iter().map(|probe| probe.name.as_str());
        let parts = several.iter().map(|(number, _)| away.has(number));
        let has_away = iter::once(away.exists()).chain(parts);
        Self::new(
            (&Vec::from_iter(materials), &Vec::from_iter(has_away)),
            &Vec::from_iter(boundaries),
            &Vec::from_iter(probes),
        )
    }

    /// The list of all figures: of the body, of these `materials` if there are several, of the `boundaries` with a table and of the
    /// `probes`. The body and each material may have extremes away from singular points.
    fn new(
        (materials, has_away): (&[&str], &[bool]),
        boundaries: &[PartOfBoundary],
        probes: &[&str],
    ) -> Self {
        use Dimension::{
            ContactLength, Force, Given, Length, Moment, OfZeta, Place, Stress, Time, Work, Zeta,
        };
        use Governing::{Largest, LargestModulus, Least};
        let (mut all, body) = (Self::default(), Of::Body);
        all.add(&body, [("zeta_min", "least ζ", Zeta, Least)], |of, _| of.zeta_min);
        all.add(&body, [("zeta_mean", "mean ζ", OfZeta, Least)], |of, _| of.zeta_mean.into());
        let most = ("displacement_max", "largest displacement", Length, Largest);
        all.add(&body, [most], |of, _| of.displacement_max);
        let work = ("work", "work of the loads", Work, LargestModulus);
        all.add(&body, [work], |of, _| of.work.into());
        let stresses = [
            ("von_mises_max", "largest von Mises stress@", Stress, Largest),
            ("principal_max", "largest σ₁@", Stress, Largest),
            ("principal_min", "smallest σ₂@", Stress, Least),
        ];
        let away = [
            (
                "von_mises_max_away",
                "largest von Mises stress@ away from singular points",
                Stress,
                Largest,
            ),
            ("principal_max_away", "largest σ₁@ away from singular points", Stress, Largest),
            ("principal_min_away", "smallest σ₂@ away from singular points", Stress, Least),
        ];
        let parts = iter::once(Of::Body)
            .chain(materials.iter().map(|name| Of::Material((*name).to_owned())));
        for (i, of) in parts.enumerate() {
            all.add(&of, stresses, move |of, k| of.stresses[i][k]);
            if has_away[i] {
                all.add(&of, away, move |of, k| of.away[i][k]);
            }
        }
        let contact = [
            ("pressure_max", "largest contact pressure@", Stress, Largest),
            ("contact_length", "length of contact@", ContactLength, Largest),
        ];
        if boundaries.iter().any(|of| of.foundation.is_some()) {
            let force = ("contact_force", "sum of contact reactions", Force, Largest);
            all.add(&body, [force], |of, _| of.contact_force.into());
            all.add(&body, contact, |of, k| of.contact[0].values[k]);
        }
        for (i, boundary) in boundaries.iter().enumerate() {
            let of = Of::Boundary(boundary.name.to_owned());
            if let Some(support) = boundary.support {
                let resultants = [
                    ("force_x", "resultant@, x", Force, LargestModulus),
                    ("force_y", "resultant@, y", Force, LargestModulus),
                    ("moment", "moment@ about (0, 0)", Moment, LargestModulus),
                ];
                all.add(&of, resultants, move |of, k| of.resultants[support][k].into());
            }
            let means = [
                ("u_x", "mean displacement@, x", Length, LargestModulus),
                ("u_y", "mean displacement@, y", Length, LargestModulus),
            ];
            // A probe of the same name has these figures.
            if !probes.contains(&boundary.name) {
                all.add(&of, means, move |of, k| of.means[i][k].into());
            }
            if boundary.moves {
                let travel = ("travel", "travel of the foundation@", Given, LargestModulus);
                all.add(&of, [travel], move |of, _| of.means[i][2].into());
            }
            if boundary.is_open {
                let [time, x, y] = FIRST_CONTACT;
                let first = [
                    (time, "time of first contact@", Time, LargestModulus),
                    (x, "loads at first contact@, x", Force, LargestModulus),
                    (y, "loads at first contact@, y", Force, LargestModulus),
                ];
                // The steps set them.
                all.add(&of, first, |_, _| f64::NAN.into());
            }
            if let Some(foundation) = boundary.foundation {
                all.add(&of, contact, move |of, k| of.contact[1 + foundation].values[k]);
                let places = [
                    ("contact_start_x", "first point of contact@, x"),
                    ("contact_start_y", "first point of contact@, y"),
                    ("contact_end_x", "last point of contact@, x"),
                    ("contact_end_y", "last point of contact@, y"),
                    ("peak_x", "place of the largest pressure@, x"),
                    ("peak_y", "place of the largest pressure@, y"),
                    ("acts_at_x", "point on the line of action@, x"),
                    ("acts_at_y", "point on the line of action@, y"),
                ];
                let places = places.map(|(kind, label)| (kind, label, Place, LargestModulus));
                let value = move |of: &Observation, k: usize| of.contact[1 + foundation].places[k];
                all.add(&of, places, move |of, k| value(of, k).into());
            }
        }
        for (i, name) in probes.iter().enumerate() {
            let observed = [
                ("u_x", "displacement@, x", Length, LargestModulus),
                ("u_y", "displacement@, y", Length, LargestModulus),
                ("zeta", "ζ@", Zeta, Least),
                ("stress_xx", "stress@, xx", Stress, LargestModulus),
                ("stress_yy", "stress@, yy", Stress, LargestModulus),
                ("stress_xy", "stress@, xy", Stress, LargestModulus),
                ("von_mises", "von Mises stress@", Stress, LargestModulus),
            ];
            let of = Of::Probe((*name).to_owned());
            all.add(&of, observed, move |of, k| of.probes[i][k].into());
        }
        all
    }

    /// The figures that a scene may have, with general names of its parts.
    pub fn of_any_scene() -> Self {
        let [support, foundation] = [Some(0); 2];
        let boundary =
            PartOfBoundary { name: "BOUNDARY", support, foundation, moves: true, is_open: true };
        Self::new((&["MATERIAL"], &[true; 2]), &[boundary], &["PROBE"])
    }

    /// Adds several figures of one part. Each has a kind, a label in which @ stands for the name of the part, a dimension, and which
    /// value of a run governs. `value` returns the value of the figure with the number k among them.
    fn add<const N: usize>(
        &mut self,
        of: &Of,
        figures: [(&'static str, &str, Dimension, Governing); N],
        value: impl Fn(&Observation, usize) -> Value + Copy + 'static,
    ) {
        for (k, (kind, label, dimension, governing)) in figures.into_iter().enumerate() {
            let (name, place) = match of {
                Of::Body => (kind.to_owned(), String::new()),
                Of::Material(of) => (format!("{of}.{kind}"), format!(" in {}", in_words(of))),
                Of::Boundary(of) => (format!("{of}.{kind}"), format!(" of {of}")),
                Of::Probe(of) => (format!("{of}.{kind}"), format!(" at {of}")),
            };
            let group = match (dimension, of, kind) {
                (Dimension::Force, Of::Boundary(_), _) => "resultants".to_owned(),
                (Dimension::Length, Of::Boundary(_), _) => "displacement_max".to_owned(),
                (Dimension::Zeta, ..) => "zeta_min".to_owned(),
                (Dimension::Length, Of::Probe(of), _) => format!("u at {of}"),
                (Dimension::Stress, Of::Probe(of), _) => format!("stress at {of}"),
                (Dimension::Stress, Of::Material(_) | Of::Body, kind) if kind != "pressure_max" => {
                    let away = if kind.ends_with("_away") { " away" } else { "" };
                    format!("stress{place}{away}")
                }
                _ => kind.to_owned(),
            };
            let (of, label) = (of.clone(), label.replace('@', &place));
            let value = Box::new(move |of: &Observation| value(of, k));
            self.0.push(Figure { name, kind, of, label, dimension, governing, group, value });
        }
    }

    /// The values of all figures.
    pub(crate) fn values(&self, of: &Observation) -> Vec<Value> {
        self.0.iter().map(|figure| (figure.value)(of)).collect()
    }

    /// The numbers of the figures that describe parts (materials or foundations), if the figure `number` describes the whole in
    /// the same way.
    pub(crate) fn parts(&self, number: usize) -> impl Iterator<Item = usize> {
        let whole = &self[number];
        let is_part =
            |part: &Figure| whole.of == Of::Body && part.of != Of::Body && part.kind == whole.kind;
        (0..self.0.len()).filter(move |&k| is_part(&self[k]))
    }

    /// The figures in their order.
    pub fn iter(&self) -> slice::Iter<'_, Figure> {
        self.0.iter()
    }

    /// The number of a figure in the list; `None` if there is no such figure.
    pub fn number(&self, name: &str) -> Option<usize> {
        self.0.iter().position(|figure| figure.name == name)
    }
}
