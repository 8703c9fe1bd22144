//! The TOML document of a scene: the file with the `--set` arguments put in. Every value knows
//! where it is written.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde::{Deserialize, de::IntoDeserializer};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{MOST_SHOWN, SceneError};
use crate::suggestion::suggestion;

/// Where something is wrong, and what.
pub(super) type Problem = (Range<usize>, String);

/// The key of what is called `name` in the table at `key`, "" of the table itself.
pub(super) fn below(key: &str, name: &str) -> String {
    match (key, name) {
        (key, "") => key.to_owned(),
        ("", name) => name.to_owned(),
        _ => format!("{key}.{name}"),
    }
}

/// The place of what concerns the file as a whole.
pub(super) const NOWHERE: Range<usize> = Range { start: 1, end: 0 };

/// The text of a scene. A place in it is a range of bytes: those of the file are counted from 0,
/// those of the n-th `--set` argument from n times the `stride`.
#[derive(Debug, Clone)]
pub(super) struct SceneText {
    path: PathBuf,
    /// The content of the file.
    file: String,
    /// The `--set` arguments.
    sets: Vec<String>,
    /// These as TOML, indented to their places.
    arguments: Vec<String>,
    /// More bytes than the file or any of the arguments has.
    stride: usize,
    /// Where the values that have been read are written, by their keys in full.
    pub(super) places: BTreeMap<String, Range<usize>>,
    /// The values, and what the files of tables hold: as [`Self::values`] gives them.
    pub(super) document: toml::Table,
    pub(super) tables: Vec<u8>,
}

impl SceneText {
    /// The content of the `file` at `path` and the `--set` arguments. A value of these that is no
    /// TOML is taken for a string, so that shells need no second pair of quotes.
    pub(super) fn new(path: &Path, file: &str, sets: &[String]) -> Self {
        let stride = sets.iter().map(String::len).fold(file.len(), usize::max) + 2;
        let toml = |set: &String| match (DeTable::parse(set), set.split_once('=')) {
            (Err(_), Some((key, value))) => format!("{key}={}", toml::Value::from(value.trim())),
            _ => set.clone(),
        };
        let indented = |(i, set)| " ".repeat((i + 1) * stride) + &toml(set);
        Self {
            path: path.to_owned(),
            file: file.to_owned(),
            sets: sets.to_vec(),
            arguments: sets.iter().enumerate().map(indented).collect(),
            stride,
            places: BTreeMap::new(),
            document: toml::Table::new(),
            tables: Vec::new(),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Where relative paths begin.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// All is well if there are no problems; else they are told in the order of the file.
    pub(super) fn verdict(&self, mut problems: Vec<Problem>) -> Result<(), SceneError> {
        problems.sort_by_key(|(place, _)| (place.start, place.end));
        let mut reports: Vec<String> = Vec::with_capacity(problems.len());
        for (place, message) in &problems {
            // Those that are only counted need no picture of their lines.
            let is_shown = reports.len() < MOST_SHOWN;
            reports.push(if is_shown { self.report(place, message) } else { message.clone() });
        }
        let Some(last) = reports.last_mut() else { return Ok(()) };
        // What contradicts a line of the file may stand on the command line.
        let of_the_file = |(place, _): &Problem| place.start < self.stride;
        if !self.sets.is_empty() && problems.iter().all(of_the_file) {
            *last += &format!("\n(the file was read with --set {})", self.sets.join(" --set "));
        }
        Err(SceneError(reports))
    }

    /// The message with its place before it and the lines of the file after it, underlined.
    fn report(&self, place: &Range<usize>, message: &str) -> String {
        let problem = format!("{}: {message}", self.in_words(place));
        if *place == NOWHERE || place.start >= self.stride {
            return problem;
        }
        let value = AnnotationKind::Primary.span(place.clone());
        let lines = Snippet::source(self.file.as_str()).annotation(value);
        let lines = Renderer::plain().render(&[Group::with_level(Level::ERROR).element(lines)]);
        format!("{problem}\n{lines}")
    }

    /// The file and the line, or the file and the `--set` argument.
    pub(super) fn in_words(&self, place: &Range<usize>) -> String {
        let path = self.path.display();
        match place.start / self.stride {
            _ if *place == NOWHERE => path.to_string(),
            0 => {
                let before = self.file.bytes().take(place.start);
                format!("{path}:{}", before.filter(|byte| *byte == b'\n').count() + 1)
            }
            set => format!("{path}, --set {}", self.sets[set - 1]),
        }
    }

    /// Where the value of a key is written.
    pub(super) fn place(&self, key: &str) -> Range<usize> {
        self.places.get(key).cloned().unwrap_or(NOWHERE)
    }

    /// The values of a document with full paths of tables, and what these files hold; nothing where one
    /// is out of the range of its type.
    pub(super) fn values(&self, root: &DeValue) -> (toml::Table, Vec<u8>) {
        let root = Spanned::new(NOWHERE, root.clone()).into_deserializer();
        let mut document = toml::Table::deserialize(root).unwrap_or_default();
        let mut tables = Vec::new();
        for key in ["body", "boundary", "damage"] {
            let expressions = document.get_mut(key).into_iter();
            expressions.for_each(|value| complete_paths(value, self.folder(), &mut tables));
        }
        (document, tables)
    }

    /// What was meant by the line of the file that has the byte `at`, as far as the line tells.
    fn hint(&self, at: usize) -> &'static str {
        let start =
            self.file.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |end| end + 1);
        let line = self.file.get(start..).and_then(|text| text.lines().next()).unwrap_or_default();
        if line.trim_start().starts_with("[boundary]") {
            "; boundary is a list, each begins with [[boundary]]"
        } else if line.split_once('=').is_some_and(|(_, value)| !value.contains('"')) {
            "; expressions and texts stand in quotes"
        } else {
            ""
        }
    }

    /// The value `1,5` in the line of the file that has the byte `at`, if a key of this line has one.
    fn decimal_comma(&self, at: usize) -> Option<Problem> {
        let before = self.file.get(..at)?;
        let start = before.rfind('\n').map_or(0, |end| end + 1);
        let line = self.file[start..].lines().next()?;
        line.match_indices('=').find_map(|(equals, _)| {
            let value = line[equals + 1..].trim_start();
            let length = with_decimal_comma(value)?;
            let key = line[..equals].trim_end();
            let key = &key[key.rfind(['{', ',', ' ']).map_or(0, |end| end + 1)..];
            let from = start + line.len() - value.len();
            let number = &value[..length];
            let mended = number.replace(',', ".");
            let problem = format!("{key} is {number}: write a decimal point, {key} = {mended}");
            Some((from..from + length, problem))
        })
    }

    /// Parses the file and puts the `--set` arguments in, in their order.
    pub(super) fn parse(&self) -> Result<DeValue<'_>, SceneError> {
        let (root, errors) = DeTable::parse_recoverable(&self.file);
        let mut commas = BTreeMap::new();
        let mut syntax = |error: &toml::de::Error| {
            let place = error.span().unwrap_or(NOWHERE);
            match self.decimal_comma(place.start) {
                // What else is wrong in this line may come of it.
                Some((place, problem)) => commas
                    .insert(place.start, problem.clone())
                    .is_none()
                    .then_some((place, problem)),
                None => {
                    let hint = self.hint(place.start);
                    Some((place, format!("not valid TOML: {}{hint}", error.message())))
                }
            }
        };
        // Behind an unclosed table, keys seem to be duplicates.
        let is_duplicate = |error: &toml::de::Error| error.message() == "duplicate key";
        let all = errors.first().is_none_or(is_duplicate);
        let told = errors.iter().filter(|error| all || !is_duplicate(error));
        self.verdict(told.filter_map(&mut syntax).collect())?;
        let mut root = DeValue::Table(root.into_inner());
        let mut problems = Vec::new();
        for argument in &self.arguments {
            let put = match DeTable::parse(argument) {
                Ok(given) if argument.contains('=') && !argument.contains('\n') => {
                    put_all(&mut root, given.into_inner(), "", argument)
                }
                _ => Err(misshapen(argument)),
            };
            let start = argument.len() - argument.trim_start_matches(' ').len();
            problems.extend(put.err().map(|problem| (start..start, problem)));
        }
        self.verdict(problems).map(|()| root)
    }
}

/// Writes the paths of `table("file")` in full, relative ones begin at `folder`, and adds to `tables`
/// what the files hold.
pub(super) fn complete_paths(value: &mut toml::Value, folder: &Path, tables: &mut Vec<u8>) {
    match value {
        toml::Value::String(text) if text.contains("table") => {
            // An expression quotes nothing but files.
            let mut full = |part: &str| {
                let file = folder.join(part);
                // What is no file may be endless.
                match file.is_file().then(|| fs::read(&file)) {
                    Some(Ok(table)) => {
                        tables.extend(table);
                        std::path::absolute(&file).unwrap_or(file).to_string_lossy().into_owned()
                    }
                    _ => part.to_owned(),
                }
            };
            for quote in ["\"", "'"] {
                *text = text.split(quote).map(&mut full).collect::<Vec<_>>().join(quote);
            }
        }
        toml::Value::Array(values) => {
            values.iter_mut().for_each(|value| complete_paths(value, folder, tables));
        }
        toml::Value::Table(table) => {
            table.iter_mut().for_each(|(_, value)| complete_paths(value, folder, tables));
        }
        _ => {}
    }
}

/// The length of the number with a decimal comma with which a text begins, like `-1,5e3`; none where it
/// begins with another value.
pub(super) fn with_decimal_comma(text: &str) -> Option<usize> {
    let end = text.find(|c: char| !c.is_ascii_alphanumeric() && !"+-.,_".contains(c));
    let number = text[..end.unwrap_or(text.len())].trim_end_matches(',');
    let (whole, rest) = number.split_once(',')?;
    let is_number = whole.parse::<i64>().is_ok() && rest.starts_with(|c: char| c.is_ascii_digit());
    let mended = format!("{whole}.{rest}");
    (is_number && mended.parse::<f64>().is_ok()).then_some(number.len())
}

/// What is wrong with a `--set` argument that is no TOML.
fn misshapen(argument: &str) -> String {
    let problem = match argument.contains('=') {
        true if argument.contains('\n') => "is more than one line",
        true => "the key is no dotted TOML key (quote odd names: boundary.\"left side\".gap=0)",
        false => "has no `=`",
    };
    format!("{problem}; write --set KEY=VALUE, for example --set time.step=0.005")
}

/// Puts the values that are `given` by an `argument` in the place of those in the table, or in the array of
/// tables with names, at `key`. Dotted keys reach into both; a table in braces takes the place of the old
/// one.
fn put_all<'t>(
    old: &mut DeValue<'t>,
    given: DeTable<'t>,
    key: &str,
    argument: &str,
) -> Result<(), String> {
    for (name, value) in given {
        let key = below(key, name.get_ref());
        let place = value.span();
        let there = match old {
            DeValue::Table(table) => table.get_mut(&name),
            DeValue::Array(tables) => {
                tables.iter_mut().find(|table| name_of(table.get_ref()) == Some(name.get_ref()))
            }
            _ => None,
        };
        let is_braced = argument[place.start..].starts_with('{');
        match (there.map(Spanned::get_mut), value.into_inner()) {
            (Some(there @ (DeValue::Table(_) | DeValue::Array(_))), DeValue::Table(given))
                if !is_braced =>
            {
                put_all(there, given, &key, argument)?;
            }
            (there, value) => match (there.is_some(), &mut *old) {
                (_, DeValue::Table(table)) => {
                    // The old key would tell where the old value was written.
                    table.remove(&name);
                    table.insert(name, Spanned::new(place, value));
                }
                (false, DeValue::Array(tables)) => {
                    let names = tables.iter().filter_map(|table| name_of(table.get_ref()));
                    let suggestion = suggestion(name.get_ref(), &names.collect::<Vec<_>>());
                    return Err(format!("unknown key {key}{suggestion}"));
                }
                _ => return Err(format!("{key} needs a key; write --set {key}.KEY=VALUE")),
            },
        }
    }
    Ok(())
}

/// The `name` of a boundary's table.
pub(super) fn name_of<'a>(table: &'a DeValue<'_>) -> Option<&'a str> {
    table.get("name")?.get_ref().as_str()
}
