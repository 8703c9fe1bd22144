//! Reads values of their final types out of the document. What is wrong with a value is noted and
//! reading goes on, so that all problems of a scene are told at once.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;

use serde::de::{DeserializeOwned, IntoDeserializer};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::document::{NOWHERE, Problem, SceneText, name_of};
use super::error::{SceneError, suggestion};
use super::expression::Expression;

/// A value was refused; its problem is noted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refused;

/// What a value was read as.
pub(super) type Reading<T> = Result<T, Refused>;

/// What was found so far in the text that is read.
struct Findings<'d> {
    text: &'d SceneText,
    places: RefCell<BTreeMap<String, Range<usize>>>,
    problems: RefCell<Vec<Problem>>,
}

/// Reads the document `root` of `text`: `read` gets its table. Also tells where the values that
/// have been read are written.
///
/// # Errors
/// All problems that were found, in the order of the file.
pub(super) fn read<T>(
    text: &SceneText,
    root: DeTable<'_>,
    read: impl FnOnce(&mut Table) -> Reading<T>,
) -> Result<(T, BTreeMap<String, Range<usize>>), SceneError> {
    let (places, problems) = Default::default();
    let findings = Findings { text, places, problems };
    let root = DeValue::Table(root);
    let (key, place, value) = (String::new(), NOWHERE, Some(&root));
    let result = Value { key, place, value, findings: &findings }.table("", read);
    text.verdict(findings.problems.take())?;
    // Nothing was refused, or there would be a problem.
    let result = result.map_err(|Refused| SceneError::Refused(vec![]))?;
    Ok((result, findings.places.take()))
}

/// A value, or the lack of one, and its key in full.
pub(super) struct Value<'d> {
    key: String,
    /// Where it is written; of one that is missing, where it should be.
    place: Range<usize>,
    value: Option<&'d DeValue<'d>>,
    findings: &'d Findings<'d>,
}

impl<'d> Value<'d> {
    /// A value below this one, or the lack of one.
    fn below(&self, key: String, place: Range<usize>, value: Option<&'d DeValue<'d>>) -> Self {
        self.findings.places.borrow_mut().insert(key.clone(), place.clone());
        Self { key, place, value, findings: self.findings }
    }

    /// Where the value is written, in words.
    pub(super) fn place(&self) -> String {
        self.findings.text.in_words(&self.place)
    }

    fn note(&self, message: String) -> Refused {
        self.findings.problems.borrow_mut().push((self.place.clone(), message));
        Refused
    }

    /// Notes a problem: the message begins with the key, `problem` goes on from there.
    pub(super) fn refuse(&self, problem: impl Display) -> Refused {
        self.note(format!("{} {problem}", self.key))
    }

    /// The value, which must be there.
    pub(super) fn required(&self) -> Reading<&'d DeValue<'d>> {
        self.value.ok_or_else(|| self.refuse("is required but missing"))
    }

    /// What is read from the value if there is one.
    pub(super) fn optional<T>(&self, read: impl FnOnce(&Self) -> Reading<T>) -> Reading<Option<T>> {
        self.value.map(|_| read(self)).transpose()
    }

    /// A value as serde reads it: text, a flag.
    pub(super) fn read<T: DeserializeOwned>(&self) -> Reading<T> {
        self.deserialize(self.required()?.clone())
    }

    fn deserialize<T: DeserializeOwned>(&self, value: DeValue<'d>) -> Reading<T> {
        let value = Spanned::new(self.place.clone(), value).into_deserializer();
        T::deserialize(value).map_err(|error| self.refuse_as_found(error.message()))
    }

    /// Notes what serde found, which quotes an unknown name and then the known ones in backquotes.
    fn refuse_as_found(&self, found: &str) -> Refused {
        let mut quoted = found.split('`').skip(1).step_by(2);
        if found.starts_with("unknown field") {
            let (unknown, known) = (quoted.next().unwrap_or_default(), quoted.collect::<Vec<_>>());
            return self.note(format!("unknown key {}{}", self.key, suggestion(unknown, &known)));
        }
        let Some((found, wanted)) = found.split_once(", expected ") else {
            return self.refuse(format!("is wrong: {found}"));
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
        let value = kinds.iter().find_map(|kind| found.strip_prefix(kind)).unwrap_or(found);
        let value = value.trim_end_matches(" as i128").trim_matches('`');
        match found {
            "map" | "sequence" => self.refuse(format!("must be {wanted}")),
            _ => self.refuse(format!("must be {wanted}, but is {value}")),
        }
    }

    /// What one of the `choices` stands for.
    pub(super) fn choice<T: Copy>(&self, choices: [(&str, T); 2]) -> Reading<T> {
        let [first, second] = choices.map(|(known, _)| known);
        let name = self.required()?.as_str();
        let chosen = choices.into_iter().find(|(known, _)| Some(*known) == name);
        let wanted = || self.refuse(format!("must be \"{first}\" or \"{second}\""));
        chosen.map(|(_, meaning)| meaning).ok_or_else(wanted)
    }

    /// A finite number for which `holds`; `rule` says so in words.
    pub(super) fn number(&self, rule: &str, holds: impl Fn(f64) -> bool) -> Reading<f64> {
        let number: f64 = self.read()?;
        match number.is_finite() && holds(number) {
            true => Ok(number),
            false => Err(self.refuse(format!("must be {rule}, but is {number}"))),
        }
    }

    pub(super) fn positive(&self, unit: &str) -> Reading<f64> {
        self.number(&format!("positive ({unit})"), |number| number > 0.0)
    }

    /// An expression that is finite if it is constant.
    pub(super) fn expression(&self) -> Reading<Expression> {
        let expression = match self.required()? {
            DeValue::String(text) => Expression::parse_in(text, self.findings.text.folder())
                .map_err(|e| self.refuse(e))?,
            DeValue::Integer(_) | DeValue::Float(_) => Expression::constant(self.read()?),
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
    pub(super) fn array(&self, key: impl Fn(usize, &DeValue) -> String) -> Reading<Vec<Self>> {
        let Some(values) = self.required()?.as_array() else {
            return Err(self.refuse("must be an array"));
        };
        let element = |(i, value): (usize, &'d Spanned<DeValue<'d>>)| {
            self.below(key(i, value.get_ref()), value.span(), Some(value.get_ref()))
        };
        Ok(values.iter().enumerate().map(element).collect())
    }

    /// An array of tables that `read` reads, each with a `name` that no other one has; `kind` says what
    /// they are.
    pub(super) fn named_tables<T>(
        &self,
        kind: &str,
        read: impl Fn(&mut Table) -> Reading<T>,
    ) -> Reading<Vec<T>> {
        let key = |i: usize, table: &DeValue| match name_of(table) {
            Some(name) => format!("{kind} \"{name}\""),
            None => format!("{kind} number {}", i + 1),
        };
        let mut first = BTreeMap::new();
        let mut tables = Vec::new();
        for value in self.array(key)? {
            tables.push(value.table(": ", &read));
            let Some(name) = name_of(value.required()?) else { continue };
            if let Some(earlier) = first.insert(name, value.place()) {
                value.refuse(format!("is given twice, first at {earlier}; merge the two"));
            }
        }
        tables.into_iter().collect()
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

    /// The values of a table by their names; the `separator` stands between its key and theirs.
    fn entries(&self, separator: &str) -> Reading<BTreeMap<&'d str, Self>> {
        let Some(table) = self.required()?.as_table() else {
            return Err(self.refuse("must be a table"));
        };
        let entry = |(name, value): (&'d Spanned<DeString<'d>>, &'d Spanned<DeValue<'d>>)| {
            let span = value.span();
            // A table is where its header is.
            let start = if value.get_ref().is_table() { span.start } else { name.span().start };
            let key = format!("{}{separator}{}", self.key, name.get_ref());
            let place = start..span.end;
            (&**name.get_ref(), self.below(key, place, Some(value.get_ref())))
        };
        Ok(table.iter().map(entry).collect())
    }

    /// A table of values by names of the user's.
    pub(super) fn map<T>(
        &self,
        read: impl Fn(&Self) -> Reading<T>,
    ) -> Reading<BTreeMap<String, T>> {
        let entries = self.entries(".")?.into_iter();
        let entries = entries.map(|(name, value)| Ok((name.to_owned(), read(&value)?)));
        entries.collect::<Vec<_>>().into_iter().collect()
    }

    /// A table of options that a room below reads by serde and that has a default for each. Each
    /// value is also read alone, so that all that are wrong are told.
    pub(super) fn options<T: DeserializeOwned>(&self) -> Reading<T> {
        self.each_option::<T>(&|option| option)?;
        self.read()
    }

    /// Reads each value below this one alone, in the tables in which it `stands`.
    fn each_option<T: DeserializeOwned>(
        &self,
        stands: &dyn Fn(DeValue<'d>) -> DeValue<'d>,
    ) -> Reading<()> {
        let mut all = Ok(());
        for (name, entry) in self.entries(".")? {
            let spanned_name = Spanned::new(0..0, name.into());
            let stands = |option| {
                let option = Spanned::new(entry.place.clone(), option);
                stands(DeValue::Table([(spanned_name.clone(), option)].into_iter().collect()))
            };
            let one = match entry.required()? {
                DeValue::Table(_) => entry.each_option::<T>(&stands),
                option => entry.deserialize::<T>(stands(option.clone())).map(drop),
            };
            all = all.and(one);
        }
        all
    }

    /// A table whose keys are those that `read` asks for; the `separator` stands between its own
    /// key and theirs.
    pub(super) fn table<T>(
        &self,
        separator: &'static str,
        read: impl FnOnce(&mut Table) -> Reading<T>,
    ) -> Reading<T> {
        let entries = self.entries(separator)?;
        let mut table = Table { value: self, separator, entries, known: vec![] };
        let problems = &self.findings.problems;
        let earlier = problems.borrow().len();
        let result = read(&mut table);
        let suggest = |name: &&str| suggestion(name, &table.known);
        if table.entries.keys().any(|name| suggest(name).contains("did you mean")) {
            // What the table lacks is what was misspelt.
            let own = problems.borrow_mut().split_off(earlier);
            let others = own.into_iter().filter(|(place, _)| *place != self.place);
            problems.borrow_mut().extend(others);
        }
        for (name, value) in &table.entries {
            value.note(format!("unknown key {}{}", value.key, suggest(name)));
        }
        result
    }
}

/// A table while it is read. All its keys must be asked for, whatever their values: the others
/// are unknown.
pub(super) struct Table<'d> {
    pub(super) value: &'d Value<'d>,
    /// What stands between its key and those of its entries.
    separator: &'static str,
    /// The entries that were not yet asked for.
    entries: BTreeMap<&'d str, Value<'d>>,
    /// The keys that were asked for.
    known: Vec<&'static str>,
}

impl<'d> Table<'d> {
    /// What is read from all tables among the entries that were not yet asked for, by their names.
    pub(super) fn tables<T>(
        &mut self,
        read: impl Fn(&mut Table) -> Reading<T>,
    ) -> Reading<Vec<(String, T)>> {
        let is_table = |value: &Value| value.value.is_some_and(DeValue::is_table);
        let entries = std::mem::take(&mut self.entries).into_iter();
        let (tables, others): (Vec<_>, _) = entries.partition(|(_, value)| is_table(value));
        self.entries = others.into_iter().collect();
        let read = |(name, value): (&str, Value)| Ok((name.to_owned(), value.table(".", &read)?));
        tables.into_iter().map(read).collect::<Vec<_>>().into_iter().collect()
    }

    /// The value of `key`, or the lack of one, once.
    pub(super) fn get(&mut self, key: &'static str) -> Value<'d> {
        self.known.push(key);
        self.entries.remove(key).unwrap_or_else(|| {
            let key = format!("{}{}{key}", self.value.key, self.separator);
            self.value.below(key, self.value.place.clone(), None)
        })
    }
}
