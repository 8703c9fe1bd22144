//! The TOML document of a scene: the file with the `--set` arguments put in. Every value knows
//! where it is written.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::error::{SceneError, suggestion};

/// Where a value is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    /// In the file, nowhere in particular.
    File,
    /// Between two bytes of the file.
    Bytes(usize, usize),
    /// In the `--set` argument of this number.
    Set(usize),
}

/// Where something is wrong, and what.
pub(super) type Problem = (Origin, String);

/// The text of a scene.
#[derive(Debug, Clone)]
pub(super) struct SceneText {
    pub(super) path: PathBuf,
    /// The content of the file.
    pub(super) text: String,
    /// The `--set` arguments.
    pub(super) sets: Vec<String>,
    /// Where the values that have been read are written, by their keys in full.
    pub(super) origins: BTreeMap<String, Origin>,
}

impl SceneText {
    /// All is well if there are no problems; else they are told in the order of the file.
    pub(super) fn verdict(&self, mut problems: Vec<Problem>) -> Result<(), SceneError> {
        problems.sort_by_key(|(origin, _)| *origin);
        let mut reports: Vec<String> =
            problems.iter().map(|(origin, message)| self.report(*origin, message)).collect();
        let Some(last) = reports.last_mut() else { return Ok(()) };
        // What contradicts a line of the file may stand on the command line.
        let of_the_file = |(origin, _): &Problem| !matches!(origin, Origin::Set(_));
        if !self.sets.is_empty() && problems.iter().all(of_the_file) {
            *last += &format!("\n(the file was read with --set {})", self.sets.join(" --set "));
        }
        Err(SceneError::Refused(reports))
    }

    /// The message with its place before it and the lines of the file after it, underlined.
    fn report(&self, origin: Origin, message: &str) -> String {
        let problem = format!("{}: {message}", self.place(origin));
        let Origin::Bytes(start, end) = origin else { return problem };
        let value = AnnotationKind::Primary.span(start..end);
        let lines = Snippet::source(self.text.as_str()).annotation(value);
        let lines = Renderer::plain().render(&[Group::with_level(Level::ERROR).element(lines)]);
        format!("{problem}\n{lines}")
    }

    /// The file and the line, or the file and the `--set` argument.
    pub(super) fn place(&self, origin: Origin) -> String {
        let path = self.path.display();
        match origin {
            Origin::File => path.to_string(),
            Origin::Bytes(start, _) => {
                let line = self.text.bytes().take(start).filter(|byte| *byte == b'\n').count() + 1;
                format!("{path}:{line}")
            }
            Origin::Set(i) => format!("{path}, --set {}", self.sets[i]),
        }
    }

    /// Where the value of a key is written.
    pub(super) fn origin(&self, key: &str) -> Origin {
        self.origins.get(key).copied().unwrap_or(Origin::File)
    }
}

/// A value of the document.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) origin: Origin,
    pub(super) content: Content,
}

/// What a value is.
#[derive(Debug)]
pub(super) enum Content {
    Text(String),
    Number(f64),
    Flag(bool),
    Date,
    Array(Vec<Node>),
    Table(Entries),
}

/// The entries of a table.
pub(super) type Entries = BTreeMap<String, Node>;

impl Node {
    /// A value whose bytes, with its key where it has one, begin at `start`.
    fn new(value: &Spanned<DeValue<'_>>, start: usize, origin: OriginOf<'_>) -> Self {
        let content = match value.get_ref() {
            DeValue::String(text) => Content::Text(text.to_string()),
            DeValue::Integer(number) => {
                let whole = i64::from_str_radix(number.as_str(), number.radix());
                Content::Number(whole.map_or(f64::NAN, |whole| whole as f64))
            }
            DeValue::Float(number) => Content::Number(number.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(flag) => Content::Flag(*flag),
            DeValue::Datetime(_) => Content::Date,
            DeValue::Array(values) => Content::Array(
                values.iter().map(|value| Self::new(value, value.span().start, origin)).collect(),
            ),
            DeValue::Table(table) => Content::Table(entries(table, origin)),
        };
        Self { origin: origin(start..value.span().end), content }
    }

    /// The value as serde reads it.
    pub(super) fn to_toml(&self) -> toml::Value {
        match &self.content {
            Content::Text(text) => toml::Value::String(text.clone()),
            Content::Number(number) if number.fract() == 0.0 => (*number as i64).into(),
            Content::Number(number) => (*number).into(),
            Content::Flag(flag) => (*flag).into(),
            Content::Date => "a date or time".into(),
            Content::Array(nodes) => nodes.iter().map(Self::to_toml).collect::<Vec<_>>().into(),
            Content::Table(entries) => {
                let entries = entries.iter().map(|(key, node)| (key.clone(), node.to_toml()));
                toml::Value::Table(entries.collect())
            }
        }
    }

    /// Puts what is `given` in the place of what is there under `key`. Tables are merged; one that
    /// is given for an array of tables reaches into them by their names.
    fn put(&mut self, given: Self, key: &str) -> Result<(), String> {
        match (&mut self.content, given.content) {
            (Content::Table(entries), Content::Table(given)) => {
                for (name, node) in given {
                    match entries.get_mut(&name) {
                        Some(old) => old.put(node, &format!("{key}{name}."))?,
                        None => drop(entries.insert(name, node)),
                    }
                }
            }
            (Content::Array(list), Content::Table(given)) => {
                for (name, node) in given {
                    let Some(i) = list.iter().position(|old| old.name() == Some(&name)) else {
                        let known: Vec<&str> = list.iter().filter_map(Self::name).collect();
                        let suggestion = suggestion(&name, &known);
                        return Err(format!("unknown key {key}{name}{suggestion}"));
                    };
                    if !matches!(node.content, Content::Table(_)) {
                        let form = "write --set boundary.NAME.KEY=VALUE";
                        return Err(format!("{key}{name} needs a key; {form}"));
                    }
                    list[i].put(node, &format!("{key}{name}."))?;
                }
            }
            (_, content) => *self = Self { content, ..given },
        }
        Ok(())
    }

    /// The `name` of a boundary's table.
    pub(super) fn name(&self) -> Option<&str> {
        let Content::Table(entries) = &self.content else { return None };
        match &entries.get("name")?.content {
            Content::Text(name) => Some(name),
            _ => None,
        }
    }
}

/// Where some bytes of a parsed text are.
type OriginOf<'a> = &'a dyn Fn(Range<usize>) -> Origin;

fn entries(table: &DeTable<'_>, origin: OriginOf<'_>) -> Entries {
    let entry = |(key, value): (&Spanned<DeString<'_>>, &Spanned<DeValue<'_>>)| {
        // A table is where its header is.
        let start = if value.get_ref().is_table() { value.span() } else { key.span() }.start;
        (key.get_ref().to_string(), Node::new(value, start, origin))
    };
    table.iter().map(entry).collect()
}

/// Parses the file and puts the `--set` arguments in, in their order.
pub(super) fn parse(text: &SceneText) -> Result<Node, SceneError> {
    let (table, errors) = DeTable::parse_recoverable(&text.text);
    let bytes = |bytes: Range<usize>| Origin::Bytes(bytes.start, bytes.end);
    let syntax = |error: &toml::de::Error| {
        let origin = error.span().map_or(Origin::File, bytes);
        (origin, format!("not valid TOML: {}", error.message()))
    };
    text.verdict(errors.iter().map(syntax).collect())?;

    let content = Content::Table(entries(table.get_ref(), &bytes));
    let mut root = Node { origin: Origin::File, content };
    let put = |(i, argument): (usize, &String)| {
        let origin = Origin::Set(i);
        let given = set_entries(argument, origin).map(Content::Table);
        let put = given.and_then(|content| root.put(Node { origin, content }, ""));
        Some((origin, put.err()?))
    };
    text.verdict(text.sets.iter().enumerate().filter_map(put).collect())?;
    Ok(root)
}

/// A `--set` argument as TOML. A value that is no TOML is taken for a string, so that shells need
/// no second pair of quotes.
fn set_entries(argument: &str, origin: Origin) -> Result<Entries, String> {
    let form = "write --set KEY=VALUE, for example --set time.step=0.005";
    let (key, value) = argument.split_once('=').ok_or(format!("has no `=`; {form}"))?;
    let quoted = format!("{key}={}", toml::Value::String(value.trim().to_owned()));
    match DeTable::parse(argument).or_else(|_| DeTable::parse(&quoted)) {
        Ok(table) => Ok(entries(table.get_ref(), &|_| origin)),
        Err(_) => Err(format!(
            "the key is no dotted TOML key (quote odd names: boundary.\"left side\".gap=0); {form}"
        )),
    }
}
