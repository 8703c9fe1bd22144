//! The scene file as it is written: one struct per table, every value with its span.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, Visitor};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Names, SceneError};
use super::source::Source;
use crate::{contact::ContactOptions, fem::Mass, model::Plane};

/// The tables that stand alone.
const TABLES: [&str; 7] = ["mesh", "material", "damage", "time", "body", "contact", "output"];

type Number = Spanned<f64>;
/// Two expressions; a list, because serde would ignore a third component.
pub(super) type Vector = Spanned<Vec<Spanned<Formula>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct File {
    pub(super) title: Option<String>,
    pub(super) mesh: MeshTable,
    pub(super) material: MaterialTable,
    pub(super) damage: Option<DamageTable>,
    pub(super) time: Option<TimeTable>,
    #[serde(default)]
    pub(super) body: BodyTable,
    #[serde(default)]
    pub(super) contact: ContactOptions,
    #[serde(default)]
    pub(super) output: OutputTable,
    pub(super) boundary: Spanned<Vec<Spanned<BoundaryTable>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct MeshTable {
    pub(super) file: Spanned<String>,
    pub(super) size: Option<Number>,
    #[serde(default)]
    pub(super) parameters: BTreeMap<String, Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct MaterialTable {
    pub(super) young: Number,
    pub(super) poisson: Number,
    pub(super) plane: Plane,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct DamageTable {
    pub(super) diffusion: Number,
    pub(super) lambda_d: Number,
    pub(super) lambda_u: Number,
    pub(super) lambda_w: Number,
    pub(super) strain_cap: Number,
    pub(super) threshold: Number,
    pub(super) initial: Spanned<Formula>,
    #[serde(default)]
    pub(super) mass: Mass,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct TimeTable {
    pub(super) end: Number,
    pub(super) step: Spanned<Formula>,
    pub(super) tolerance: Option<Number>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct BodyTable {
    pub(super) force: Option<Vector>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct OutputTable {
    pub(super) every: Option<Spanned<usize>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct BoundaryTable {
    pub(super) name: Spanned<String>,
    pub(super) displacement: Option<Vector>,
    pub(super) symmetry: Option<bool>,
    pub(super) traction: Option<Vector>,
    pub(super) gap: Option<Spanned<Formula>>,
    pub(super) normal: Option<Vector>,
}

/// An expression as it is written: a number or a text.
pub(super) enum Formula {
    Number(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrText;
        impl Visitor<'_> for NumberOrText {
            type Value = Formula;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or an expression in quotes")
            }
            fn visit_f64<E: Error>(self, value: f64) -> Result<Formula, E> {
                Ok(Formula::Number(value))
            }
            fn visit_i64<E: Error>(self, value: i64) -> Result<Formula, E> {
                // Beyond 2^53 the nearest f64 is what a decimal point would give too.
                Ok(Formula::Number(value as f64))
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Formula, E> {
                Ok(Formula::Text(text.to_owned()))
            }
        }
        deserializer.deserialize_any(NumberOrText)
    }
}

/// Reads the tables out of `root`.
pub(super) fn read(root: DeTable<'_>, source: &Source) -> Result<File, SceneError> {
    for (name, value) in &root {
        refuse_arrays(name.get_ref(), value, source)?;
    }
    // The root has no span of its own; an empty one names no key.
    let root = Spanned::new(usize::MAX..usize::MAX, root);
    File::deserialize(toml::Deserializer::from(root)).map_err(|e| explain(&e, source))
}

/// serde would fill a struct from an array, `time = [1, 0.01]`, by position.
fn refuse_arrays(
    name: &str,
    value: &Spanned<DeValue<'_>>,
    source: &Source,
) -> Result<(), SceneError> {
    let (span, key) = match (name, value.get_ref()) {
        ("boundary", DeValue::Array(list)) => {
            match list.iter().find(|element| !element.get_ref().is_table()) {
                Some(element) => (element.span(), source.key(&element.span())),
                None => return Ok(()),
            }
        }
        _ if TABLES.contains(&name) && value.get_ref().is_array() => (value.span(), name),
        _ => return Ok(()),
    };
    Err(SceneError::Invalid {
        place: source.place(&span),
        key: key.trim_end_matches(": ").to_owned(),
        problem: "must be a table".into(),
    })
}

/// Says what serde found in the terms of the scene.
///
/// serde quotes names in backquotes, the unknown first and then the known.
fn explain(error: &toml::de::Error, source: &Source) -> SceneError {
    let span = error.span().unwrap_or(usize::MAX..usize::MAX);
    let key = source.key(&span).to_owned();
    let place = match key.as_str() {
        "" => source.whole_file(),
        _ => source.place(&span),
    };
    let message = error.message();
    let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
    if message.starts_with("unknown field") {
        let unknown = quoted.next().unwrap_or_default();
        return SceneError::UnknownKey {
            place,
            key,
            names: Box::new(Names::like(&unknown, quoted.collect())),
        };
    }
    if message.starts_with("missing field") {
        let missing = quoted.next().unwrap_or_default();
        // A boundary's key already ends in its colon.
        let dot = if key.is_empty() || key.ends_with(": ") { "" } else { "." };
        return SceneError::MissingKey { place, key: format!("{key}{dot}{missing}") };
    }
    let problem = match message.split_once(", expected ") {
        Some((found, expected)) => {
            let found = ["invalid type: ", "invalid value: ", "unknown variant "]
                .iter()
                .find_map(|start| found.strip_prefix(start))
                .unwrap_or(found);
            format!("must be {}, but is {}", in_words(expected), in_words(found))
        }
        None => format!("is not understood: {message}"),
    };
    SceneError::Invalid { place, key, problem }
}

/// serde's names of types and values in the words of TOML.
fn in_words(kind: &str) -> &str {
    match kind {
        "f64" => "a number",
        "usize" => "a whole number, not negative",
        "a sequence" | "sequence" => "an array",
        "map" => "a table",
        "a boolean" => "true or false",
        // A value says what it is: "string \"fast\"".
        other => ["string ", "integer ", "floating point ", "boolean "]
            .iter()
            .find_map(|kind| other.strip_prefix(kind))
            .unwrap_or(other),
    }
}
