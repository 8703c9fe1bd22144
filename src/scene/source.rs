//! Where every value of a scene came from: its line in the file, or its `--set`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::error::{Names, Place, SceneError};

/// One `--set` argument, read as a TOML document of its own.
///
/// Its spans count from `start`, past the end of the file, so that a span tells
/// which input it points into.
#[derive(Debug, Clone)]
struct Set {
    argument: String,
    start: usize,
}

/// The texts a scene was read from.
#[derive(Debug, Clone)]
pub(super) struct Source {
    path: PathBuf,
    /// Offset of the first byte of every line.
    lines: Vec<usize>,
    sets: Vec<Set>,
    /// Spans of all keys and values with the key in full; later ones lie deeper.
    keys: Vec<(Range<usize>, String)>,
}

/// The key of something on a boundary, as it is written in messages.
pub(super) fn boundary_key(name: &str, key: &str) -> String {
    format!("boundary \"{name}\": {key}")
}

impl Source {
    /// The source of `text` and of `sets`, whose `documents` are [`set_document`]s.
    pub(super) fn new(path: &Path, text: &str, sets: &[String], documents: &[String]) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n');
        let mut start = text.len() + 1;
        let sets = sets.iter().zip(documents).map(|(argument, document)| {
            let set = Set { argument: argument.clone(), start };
            start += document.len() + 1;
            set
        });
        Self {
            path: path.to_owned(),
            sets: sets.collect(),
            lines: std::iter::once(0).chain(breaks.map(|(i, _)| i + 1)).collect(),
            keys: Vec::new(),
        }
    }

    /// The table of the file with the `--set` documents put in, in their order.
    ///
    /// Remembers all keys, so that spans and keys can be looked up.
    pub(super) fn table<'a>(
        &mut self,
        text: &'a str,
        documents: &'a [String],
    ) -> Result<DeTable<'a>, SceneError> {
        let mut root = DeTable::parse(text).map_err(|e| self.not_toml(&e))?.into_inner();
        for (set, document) in self.sets.iter().zip(documents) {
            let given = DeTable::parse(document).map_err(|e| self.not_toml(&e))?;
            let given = shifted_table(given.into_inner(), set.start);
            self.merge_root(&mut root, given)?;
        }
        remember_table(&mut self.keys, "", &root);
        Ok(root)
    }

    /// The key whose name or value has exactly this span; empty for the whole file.
    pub(super) fn key(&self, span: &Range<usize>) -> &str {
        let found = self.keys.iter().rev().find(|(s, _)| s == span);
        found.map_or("", |(_, key)| key)
    }

    /// Where a span stands.
    pub(super) fn place(&self, span: &Range<usize>) -> Place {
        let set = self.sets.iter().rev().find(|s| s.start <= span.start);
        let line = self.lines.partition_point(|&first| first <= span.start);
        Place {
            path: self.path.clone(),
            line: set.is_none().then_some(line),
            set: set.map(|s| s.argument.clone()),
        }
    }

    /// Where the value of a key stands; the whole file when the key is not written.
    pub(super) fn place_of(&self, key: &str) -> Place {
        match self.keys.iter().rev().find(|(_, k)| k == key) {
            Some((span, _)) => self.place(span),
            None => self.whole_file(),
        }
    }

    /// The file, no line in particular.
    pub(super) fn whole_file(&self) -> Place {
        Place { path: self.path.clone(), line: None, set: None }
    }

    fn not_toml(&self, error: &toml::de::Error) -> SceneError {
        SceneError::Syntax {
            place: error.span().map_or(self.whole_file(), |s| self.place(&s)),
            message: error.message().to_owned(),
        }
    }

    /// Merges one `--set`; `boundary.NAME.key` reaches into the boundary of that name.
    fn merge_root<'a>(
        &self,
        root: &mut DeTable<'a>,
        mut given: DeTable<'a>,
    ) -> Result<(), SceneError> {
        let by_name = given.remove("boundary").map(|v| (v.span(), v.into_inner()));
        match by_name {
            Some((_, DeValue::Table(by_name))) => {
                for (name, keys) in by_name {
                    self.merge_boundary(root, &name, keys)?;
                }
            }
            Some((span, _)) => {
                return Err(SceneError::Invalid {
                    place: self.place(&span),
                    key: "boundary".into(),
                    problem: "must be addressed by name: --set boundary.NAME.KEY=VALUE".into(),
                });
            }
            None => {}
        }
        merge(root, given);
        Ok(())
    }

    fn merge_boundary<'a>(
        &self,
        root: &mut DeTable<'a>,
        name: &Spanned<std::borrow::Cow<'a, str>>,
        keys: Spanned<DeValue<'a>>,
    ) -> Result<(), SceneError> {
        let list = match root.get_mut("boundary").map(Spanned::get_mut) {
            Some(DeValue::Array(list)) => list,
            _ => &mut DeArray::new(),
        };
        let known: Vec<String> = list.iter().filter_map(boundary_name).collect();
        let named =
            list.iter_mut().find(|b| boundary_name(b).as_deref() == Some(name.get_ref().as_ref()));
        let span = keys.span();
        match (named.map(Spanned::get_mut), keys.into_inner()) {
            (Some(DeValue::Table(boundary)), DeValue::Table(keys)) => {
                merge(boundary, keys);
                Ok(())
            }
            (None, _) => Err(SceneError::UnknownKey {
                place: self.place(&name.span()),
                key: format!("boundary.{}", name.get_ref()),
                names: Box::new(Names::like(name.get_ref(), known)),
            }),
            _ => Err(SceneError::Invalid {
                place: self.place(&span),
                key: format!("boundary.{}", name.get_ref()),
                problem: "needs a key: --set boundary.NAME.KEY=VALUE".into(),
            }),
        }
    }
}

/// `KEY=VALUE` as TOML; a value that is none is taken for a string, so that shells
/// need no second pair of quotes.
pub(super) fn set_document(argument: &str) -> Result<String, SceneError> {
    let refused = |problem: &str| SceneError::Override {
        set: argument.to_owned(),
        problem: problem.to_owned(),
    };
    let Some((key, value)) = argument.split_once('=') else {
        return Err(refused("has no `=`"));
    };
    if DeTable::parse(argument).is_ok() {
        return Ok(argument.to_owned());
    }
    let quoted = format!("{key}={}", toml::Value::String(value.trim().to_owned()));
    match DeTable::parse(&quoted) {
        Ok(_) => Ok(quoted),
        Err(_) => Err(refused(
            "the key is no dotted TOML key (quote odd names: boundary.\"left side\".gap=0)",
        )),
    }
}

fn merge<'a>(into: &mut DeTable<'a>, given: DeTable<'a>) {
    for (key, value) in given {
        let span = value.span();
        match (into.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut), value.into_inner()) {
            (Some(DeValue::Table(old)), DeValue::Table(new)) => merge(old, new),
            (_, new) => {
                // Out with the old key too: its span would point into the file.
                into.remove(key.get_ref().as_ref());
                into.insert(key, Spanned::new(span, new));
            }
        }
    }
}

fn shifted_table(table: DeTable<'_>, by: usize) -> DeTable<'_> {
    let moved = |s: Range<usize>| s.start + by..s.end + by;
    let entries = table.into_iter().map(|(key, value)| {
        let key = Spanned::new(moved(key.span()), key.into_inner());
        (key, shifted(value, by))
    });
    entries.collect()
}

fn shifted(value: Spanned<DeValue<'_>>, by: usize) -> Spanned<DeValue<'_>> {
    let span = value.span();
    let value = match value.into_inner() {
        DeValue::Table(table) => DeValue::Table(shifted_table(table, by)),
        DeValue::Array(array) => {
            let mut moved = DeArray::new();
            for element in array {
                moved.push(shifted(element, by));
            }
            DeValue::Array(moved)
        }
        leaf => leaf,
    };
    Spanned::new(span.start + by..span.end + by, value)
}

fn boundary_name(boundary: &Spanned<DeValue<'_>>) -> Option<String> {
    Some(boundary.get_ref().get("name")?.get_ref().as_str()?.to_owned())
}

fn remember_table(keys: &mut Vec<(Range<usize>, String)>, prefix: &str, table: &DeTable<'_>) {
    for (name, value) in table {
        let key = format!("{prefix}{}", name.get_ref());
        keys.push((name.span(), key.clone()));
        remember_value(keys, key, value);
    }
}

fn remember_value(
    keys: &mut Vec<(Range<usize>, String)>,
    key: String,
    value: &Spanned<DeValue<'_>>,
) {
    keys.push((value.span(), key.clone()));
    match value.get_ref() {
        DeValue::Table(table) => remember_table(keys, &format!("{key}."), table),
        DeValue::Array(array) if key == "boundary" => {
            for (i, boundary) in array.iter().enumerate() {
                let key = match boundary_name(boundary) {
                    Some(name) => boundary_key(&name, ""),
                    None => format!("boundary number {}: ", i + 1),
                };
                keys.push((boundary.span(), key.clone()));
                if let DeValue::Table(table) = boundary.get_ref() {
                    remember_table(keys, &key, table);
                }
            }
        }
        DeValue::Array(array) => {
            for (i, element) in array.iter().enumerate() {
                remember_value(keys, format!("{key}[{i}]"), element);
            }
        }
        _ => {}
    }
}
