//! Reads values of their final types out of the document. What is wrong with a value is noted and
//! reading goes on, so that all problems of a scene are told at once.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Display;

use serde::de::DeserializeOwned;

use super::document::{Content, Entries, Node, Problem, SceneText};
use super::error::{SceneError, suggestion};
use super::expression::Expression;

/// A value was refused; its problem is noted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refused;

/// What a value was read as.
pub(super) type Reading<T> = Result<T, Refused>;

/// The text that is read, and what was found wrong with it so far.
struct Findings {
    text: RefCell<SceneText>,
    problems: RefCell<Vec<Problem>>,
}

/// Reads the document `root` of `text`: `read` gets its table.
///
/// # Errors
/// All problems that were found, in the order of the file.
pub(super) fn read<T>(
    text: SceneText,
    root: &Node,
    read: impl FnOnce(&mut Table) -> Reading<T>,
) -> Result<T, SceneError> {
    let findings = Findings { text: text.into(), problems: RefCell::default() };
    let result = Value::new(String::new(), root, &findings).table("", read);
    findings.text.into_inner().verdict(findings.problems.into_inner())?;
    // Nothing was refused, or there would be a problem.
    result.map_err(|Refused| SceneError::Refused(vec![]))
}

/// A value and its key in full.
pub(super) struct Value<'d> {
    key: String,
    pub(super) node: &'d Node,
    findings: &'d Findings,
}

impl<'d> Value<'d> {
    fn new(key: String, node: &'d Node, findings: &'d Findings) -> Self {
        findings.text.borrow_mut().origins.insert(key.clone(), node.origin);
        Self { key, node, findings }
    }

    /// The text of the scene, with the places of all values that have been read.
    pub(super) fn scene_text(&self) -> SceneText {
        self.findings.text.borrow().clone()
    }

    /// Where the value is written, in words.
    pub(super) fn place(&self) -> String {
        self.findings.text.borrow().place(self.node.origin)
    }

    fn note(&self, message: String) -> Refused {
        self.findings.problems.borrow_mut().push((self.node.origin, message));
        Refused
    }

    /// Notes a problem, as the predicate of the key.
    pub(super) fn refuse(&self, problem: impl Display) -> Refused {
        self.note(format!("{} {problem}", self.key))
    }

    pub(super) fn text(&self) -> Reading<String> {
        match &self.node.content {
            Content::Text(text) => Ok(text.clone()),
            _ => Err(self.refuse("must be a string")),
        }
    }

    pub(super) fn flag(&self) -> Reading<bool> {
        match self.node.content {
            Content::Flag(flag) => Ok(flag),
            _ => Err(self.refuse("must be true or false")),
        }
    }

    /// What one of the `choices` stands for.
    pub(super) fn choice<T: Copy>(&self, choices: [(&str, T); 2]) -> Reading<T> {
        let chosen = match &self.node.content {
            Content::Text(text) => choices.iter().find(|(name, _)| name == text),
            _ => None,
        };
        let [(first, _), (second, _)] = choices;
        let wanted = || self.refuse(format!("must be \"{first}\" or \"{second}\""));
        chosen.map(|(_, meaning)| *meaning).ok_or_else(wanted)
    }

    /// A finite number for which `holds`; `rule` says so in words.
    pub(super) fn number(&self, rule: &str, holds: impl Fn(f64) -> bool) -> Reading<f64> {
        match self.node.content {
            Content::Number(number) if number.is_finite() && holds(number) => Ok(number),
            Content::Number(number) => Err(self.refuse(format!("must be {rule}, but is {number}"))),
            _ => Err(self.refuse("must be a number")),
        }
    }

    pub(super) fn whole(&self, least: usize) -> Reading<usize> {
        let rule = format!("a whole number, at least {least}");
        Ok(self.number(&rule, |number| number.fract() == 0.0 && number >= least as f64)? as usize)
    }

    pub(super) fn positive(&self, unit: &str) -> Reading<f64> {
        self.number(&format!("positive ({unit})"), |number| number > 0.0)
    }

    /// A number in (0, 1).
    pub(super) fn fraction(&self) -> Reading<f64> {
        self.number("between 0 and 1, both excluded", |number| 0.0 < number && number < 1.0)
    }

    /// An expression that is finite if it is constant.
    pub(super) fn expression(&self) -> Reading<Expression> {
        let expression = match &self.node.content {
            Content::Number(number) => Expression::constant(*number),
            Content::Text(text) => Expression::parse(text).map_err(|e| self.refuse(e))?,
            _ => return Err(self.refuse("must be a number or an expression in quotes")),
        };
        match expression.as_constant().filter(|value| !value.is_finite()) {
            Some(value) => Err(self.refuse(format!("must be finite, but is {value}"))),
            None => Ok(expression),
        }
    }

    /// An expression in x and y.
    pub(super) fn expression_in_space(&self) -> Reading<Expression> {
        let expression = self.expression()?;
        match expression.depends_on_time() {
            true => Err(self.refuse("depends on t; it must be a function of x and y alone")),
            false => Ok(expression),
        }
    }

    /// The elements of an array, each under the key that it gets by its index.
    pub(super) fn array(&self, key: impl Fn(usize, &Node) -> String) -> Reading<Vec<Self>> {
        let Content::Array(nodes) = &self.node.content else {
            return Err(self.refuse("must be an array"));
        };
        let element = |(i, node)| Self::new(key(i, node), node, self.findings);
        Ok(nodes.iter().enumerate().map(element).collect())
    }

    /// An array of two components.
    pub(super) fn pair<T>(&self, read: impl Fn(&Self) -> Reading<T>) -> Reading<[T; 2]> {
        match self.array(|i, _| format!("{}[{i}]", self.key))?.as_slice() {
            [x, y] => {
                let (x, y) = (read(x), read(y));
                Ok([x?, y?])
            }
            other => Err(self.refuse(format!("must have two components, but has {}", other.len()))),
        }
    }

    fn entries(&self) -> Reading<&'d Entries> {
        match &self.node.content {
            Content::Table(entries) => Ok(entries),
            _ => Err(self.refuse("must be a table")),
        }
    }

    /// A table of values by names of the user's.
    pub(super) fn map<T>(
        &self,
        read: impl Fn(&Self) -> Reading<T>,
    ) -> Reading<BTreeMap<String, T>> {
        let value = |key, node| Self::new(format!("{}.{key}", self.key), node, self.findings);
        let entries = self.entries()?.iter();
        let entries = entries.map(|(key, node)| Ok((key.clone(), read(&value(key, node))?)));
        entries.collect::<Vec<_>>().into_iter().collect()
    }

    /// A table of options that a room below reads by serde and that has a default for each. Each
    /// value is also read alone, so that all that are wrong are told.
    pub(super) fn options<T: DeserializeOwned>(&self) -> Reading<T> {
        self.each_option::<T>(&|option| option)?;
        T::deserialize(self.node.to_toml()).map_err(|error| self.refuse_option(error.message()))
    }

    /// Reads each value below this one alone, in the tables in which it `stands`.
    fn each_option<T: DeserializeOwned>(
        &self,
        stands: &dyn Fn(toml::Value) -> toml::Value,
    ) -> Reading<()> {
        let mut all = Ok(());
        for (key, node) in self.entries()? {
            let value = Self::new(format!("{}.{key}", self.key), node, self.findings);
            let stands = |option| stands(toml::Table::from_iter([(key.clone(), option)]).into());
            let one = match node.content {
                Content::Table(_) => value.each_option::<T>(&stands),
                _ => match T::deserialize(stands(node.to_toml())) {
                    Ok(_) => Ok(()),
                    Err(error) => Err(value.refuse_option(error.message())),
                },
            };
            all = all.and(one);
        }
        all
    }

    /// Notes what serde found, which quotes an unknown name and then the known ones in backquotes.
    fn refuse_option(&self, found: &str) -> Refused {
        let mut quoted = found.split('`').skip(1).step_by(2);
        if found.starts_with("unknown field") {
            let (unknown, known) = (quoted.next().unwrap_or_default(), quoted.collect::<Vec<_>>());
            return self.note(format!("unknown key {}{}", self.key, suggestion(unknown, &known)));
        }
        let Some((found, wanted)) = found.split_once(", expected ") else {
            return self.refuse(found);
        };
        let wanted = match wanted {
            "f64" => "a number",
            "usize" => "a whole number, not negative",
            "a boolean" => "true or false",
            other => other,
        };
        // A value says what it is: `invalid type: string "fast"`.
        let found = found.split_once(": ").map_or(found, |(_, found)| found);
        let kinds = ["string ", "integer ", "floating point ", "boolean "];
        let found = kinds.iter().find_map(|kind| found.strip_prefix(kind)).unwrap_or(found);
        self.refuse(format!("must be {wanted}, but is {}", found.trim_matches('`')))
    }

    /// A table whose keys are those that `read` asks for; the `separator` stands between its own
    /// key and theirs.
    pub(super) fn table<T>(
        &self,
        separator: &str,
        read: impl FnOnce(&mut Table) -> Reading<T>,
    ) -> Reading<T> {
        let prefix = format!("{}{separator}", self.key);
        let mut table = Table { value: self, prefix, entries: self.entries()?, known: vec![] };
        let result = read(&mut table);
        for key in table.entries.keys().filter(|key| !table.known.contains(&key.as_str())) {
            let Some(value) = table.entry(key) else { continue };
            value.note(format!("unknown key {}{}", value.key, suggestion(key, &table.known)));
        }
        result
    }
}

/// A table while it is read. All its keys must be asked for, whatever their values: the others
/// are unknown.
pub(super) struct Table<'d> {
    pub(super) value: &'d Value<'d>,
    /// What stands before the keys of entries.
    prefix: String,
    entries: &'d Entries,
    /// The keys that were asked for.
    known: Vec<&'static str>,
}

impl<'d> Table<'d> {
    fn entry(&self, key: &str) -> Option<Value<'d>> {
        let node = self.entries.get(key)?;
        Some(Value::new(format!("{}{key}", self.prefix), node, self.value.findings))
    }

    pub(super) fn optional<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&Value<'d>) -> Reading<T>,
    ) -> Reading<Option<T>> {
        self.known.push(key);
        self.entry(key).as_ref().map(read).transpose()
    }

    pub(super) fn required<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&Value<'d>) -> Reading<T>,
    ) -> Reading<T> {
        let value = self.optional(key, read)?;
        let missing = || self.value.note(format!("{}{key} is required but missing", self.prefix));
        value.ok_or_else(missing)
    }

    /// Notes a problem of the value of `key`.
    pub(super) fn refuse(&self, key: &str, problem: impl Display) -> Refused {
        self.entry(key).as_ref().unwrap_or(self.value).refuse(problem)
    }
}
