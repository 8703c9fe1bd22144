//! Reads the values of a scene file by the JSON schema of scenes, key by key. Here alone a number, or an expression of
//! constants in its place, is read. The problems are collected, so that one message lists all problems of a scene.

use super::document::{NOWHERE, Problem, SceneText, below, name_of};
use super::expression::{Expression, NOT_CONSTANT, Scope, WITHOUT_VALUE, refused_name};
use super::units::without_prefix;
use crate::suggestion::suggestion;
use serde::de::{Deserialize, DeserializeOwned, IntoDeserializer};
use serde_json::Value as Schema;
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Display,
    ops::Range,
    sync::LazyLock,
};
use toml::de::{DeArray, DeTable, DeValue};
use toml::{Spanned, Value};

/// The JSON schema of scenes. It has six additional words: `values` describes the values in messages, `absent` the
/// behaviour without the key, `example` a value, `format` the kind of an expression, `also` other usual names of the
/// key, and `parameters_in` the table that has the parameters of a geometry.
pub const SCHEMA: &str = include_str!("../../geo/scene.schema.json");

static ROOT: LazyLock<Schema> = LazyLock::new(|| serde_json::from_str(SCHEMA).unwrap_or_default());

/// The type of a value. A number may also be a string: an expression of constants.
fn type_of(schema: &Schema) -> Option<&str> {
    schema["type"].as_str().or(schema["type"][0].as_str())
}

/// Is `name` a key at the top of a scene?
pub(super) fn is_key(name: &str) -> bool {
    ROOT["properties"].get(name).is_some()
}

/// The keys of the elements of the list `table`.
pub(super) fn keys_of_element(table: &str) -> impl Iterator<Item = &'static str> {
    let keys = ROOT["properties"][table]["items"]["properties"].as_object();
    keys.into_iter().flatten().map(|(key, _)| &**key)
}

/// The end of a message about an unknown key: the most similar key, the key with this name `also` in use, or the table
/// of parameters in which a number may stand.
fn known_as(schema: &Schema, name: &str, value: &DeValue, constants: &toml::Table) -> String {
    let keys = || schema["properties"].as_object().into_iter().flatten();
    // The names of constants are known at the top of a scene.
    let names = constants.keys().filter(|_| std::ptr::eq(schema, &*ROOT));
    let similar = suggestion(name, &keys().map(|(key, _)| key).chain(names).collect::<Vec<_>>());
    let is_also =
        |of: &Schema| of["also"].as_array().is_some_and(|also| also.contains(&name.into()));
    let is_number = matches!(value, DeValue::Integer(_) | DeValue::Float(_));
    let table = schema["parameters_in"].as_str().filter(|_| is_number);
    match (keys().find(|(_, of)| is_also(of)), table) {
        _ if similar.contains("did you mean") => similar,
        (Some((key, _)), _) => format!("; did you mean `{key}`?"),
        (None, Some(table)) => format!("; did you mean `{table}.{name}`?"),
        (None, None) => similar,
    }
}

/// A contradiction within a table: the key below that of the table ("" for the whole table), and the problem.
pub(super) type Diagnostic = (&'static str, String);

/// A document and its problems.
pub(super) struct Diagnostics<'t> {
    pub(super) text: &'t SceneText,
    scope: Scope,
    /// The values, completed by defaults.
    document: Value,
    pub(super) problems: Vec<Problem>,
    /// The positions of the values, by their full keys.
    pub(super) positions: BTreeMap<String, Range<usize>>,
    /// The keys of values with problems.
    unsound: BTreeSet<String>,
}

impl<'t> Diagnostics<'t> {
    /// Reads the document of `text`: `root` has the positions, `document` the values.
    pub(super) fn check(text: &'t SceneText, root: &DeValue, document: &toml::Table) -> Self {
        let constants = document.get("constants").and_then(Value::as_table).cloned();
        let scope = Scope::new(text.folder(), constants.unwrap_or_default());
        let (problems, positions, unsound) = Default::default();
        let document = Value::Boolean(false);
        let mut found = Self { text, scope, document, problems, positions, unsound };
        found.document = found.read(String::new(), root, &ROOT);
        // Messages that only follow from a wrong constant are left out.
        let follows = |problem: &str| problem.contains(WITHOUT_VALUE);
        found.problems.retain(|(_, of)| of.starts_with("constants.") || !follows(of));
        found
    }

    /// Adds a problem of a key; the message begins with the key.
    pub(super) fn note(&mut self, key: &str, problem: impl Display) {
        self.note_at(key, format!("{key} {problem}"));
    }

    /// Adds a problem at the position of a key.
    fn note_at(&mut self, key: &str, problem: String) {
        self.problems.push((self.positions.get(key).cloned().unwrap_or(NOWHERE), problem));
    }

    /// Checks a value against its schema and returns what it means: a number for an expression of constants, and
    /// defaults for missing keys. A wrong value becomes `false`.
    fn read(&mut self, key: String, value: &DeValue, schema: &Schema) -> Value {
        let same = schema["$ref"].as_str().and_then(|path| ROOT.pointer(&path[1..]));
        let schema = same.unwrap_or(schema);
        let before = self.problems.len();
        let read = match (value, schema["type"].as_str()) {
            (DeValue::Table(table), Some("object")) => Ok(self.read_table(&key, table, schema)),
            (DeValue::Array(array), Some("array")) => self.read_array(&key, array, schema),
            (DeValue::Table(_), Some("array")) => {
                Err(format!("is a list, each begins with [[{key}]]"))
            }
            _ => {
                let value = Spanned::new(NOWHERE, value.clone()).into_deserializer();
                Value::deserialize(value)
                    .map_err(|_| "is a number beyond 64 bits; write a smaller one".to_owned())
                    .and_then(|value| read_value(&value, schema, &self.scope))
            }
        };
        let read = read.unwrap_or_else(|problem| {
            let position = self.positions.get(&key).cloned().unwrap_or(NOWHERE);
            let wrong = value.as_str().and_then(|text| Expression::wrong_part(text, &self.scope));
            let wrong = wrong.filter(|(error, _)| problem.contains(error));
            let part = wrong.and_then(|(_, place)| self.text.within(&position, &place));
            self.problems.push((part.unwrap_or(position), format!("{key} {problem}")));
            false.into()
        });
        if self.problems.len() > before {
            self.unsound.insert(key);
        }
        read
    }

    /// Notes unknown and missing keys of the table `key`, and reads its values by their schemas.
    fn read_table(&mut self, key: &str, table: &DeTable, schema: &Schema) -> Value {
        let (mut is_misspelt, mut read) = (false, toml::Table::new());
        for (name, value) in table {
            // The position of a table is its header.
            let span = value.span();
            let start = if value.get_ref().is_table() { span.start } else { name.span().start };
            let (name, position, value) = (name.get_ref(), start..span.end, value.get_ref());
            let refused = refused_name(name).filter(|_| key == "constants");
            let key = below(key, name);
            if let Some(problem) = refused {
                self.problems.push((position.clone(), format!("{key} {problem}")));
            }
            // The keys of this table are names of the user.
            let named = &schema["additionalProperties"];
            let is_named = named.is_object() && (named["type"] != "object" || value.is_table());
            let schema = match schema["properties"].get(&**name) {
                Some(_) if is_named => {
                    let problem = "has the name of a key; give the physical surface another name";
                    self.problems.push((position, format!("{key} {problem}")));
                    continue;
                }
                None if !is_named => {
                    let suggestion = known_as(schema, name, value, &self.scope.constants);
                    is_misspelt |= suggestion.contains("did you mean");
                    self.problems.push((position, format!("unknown key {key}{suggestion}")));
                    continue;
                }
                schema => schema.unwrap_or(named),
            };
            self.positions.insert(key.clone(), position);
            read.insert(name.to_string(), self.read(key, value, schema));
        }
        for (name, schema) in schema["properties"].as_object().into_iter().flatten() {
            let text = format!("default={}", schema["default"]);
            // Without a default this is `null`, which is not TOML.
            if let (false, Ok(default)) = (table.contains_key(&**name), DeTable::parse(&text)) {
                let default = default.get_ref()["default"].get_ref();
                read.insert(name.clone(), self.read(below(key, name), default, schema));
            }
        }
        // A misspelt key is probably the missing one.
        let required = schema["required"].as_array().filter(|_| !is_misspelt);
        for name in required.into_iter().flatten().filter_map(Schema::as_str) {
            if !table.contains_key(name) {
                self.note_at(key, format!("{} is required but missing", below(key, name)));
            }
        }
        Value::Table(read)
    }

    /// Reads an array. Its tables are known by their names, which must differ.
    fn read_array(&mut self, key: &str, array: &DeArray, schema: &Schema) -> Result<Value, String> {
        let count = array.len() as u64;
        if schema["maxItems"].as_u64().is_some_and(|all| count != all) {
            return Err(format!("must have two components, but has {count}"));
        }
        if schema["minItems"].as_u64().is_some_and(|least| count < least) {
            return Err(format!("must hold at least one {key}"));
        }
        let (mut seen, mut read) = (BTreeMap::new(), Vec::new());
        for (i, value) in array.iter().enumerate() {
            let element = key_of_element(key, i, name_of(value.get_ref()));
            self.positions.insert(element.clone(), value.span());
            read.push(self.read(element.clone(), value.get_ref(), &schema["items"]));
            if let Some(first) = seen.insert(element.clone(), value.span()) {
                let first = self.text.in_words(&first);
                self.note(&element, format!("is given twice, first at {first}; merge the two"));
            }
        }
        Ok(Value::Array(read))
    }

    /// The result of `build` for the value of a dotted `key`, if there is one and the schema allows it.
    pub(super) fn build<K: DeserializeOwned, T>(
        &mut self,
        key: &str,
        build: impl FnOnce(K) -> Result<T, Diagnostic>,
    ) -> Option<T> {
        let value = key.split('.').try_fold(&self.document, |table, name| table.get(name))?.clone();
        self.build_value(key, value, build)
    }

    /// The results of `build` for the elements of the array at `key`; see [`Self::build`].
    pub(super) fn build_all<K: DeserializeOwned, T>(
        &mut self,
        key: &str,
        build: impl Fn(K) -> Result<T, Diagnostic>,
    ) -> Vec<T> {
        let elements = self.document.get(key).and_then(Value::as_array).cloned();
        let mut built = Vec::new();
        for (i, element) in elements.into_iter().flatten().enumerate() {
            let key = key_of_element(key, i, element.get("name").and_then(Value::as_str));
            built.extend(self.build_value(&key, element, &build));
        }
        built
    }

    fn build_value<K: DeserializeOwned, T>(
        &mut self,
        key: &str,
        value: Value,
        build: impl FnOnce(K) -> Result<T, Diagnostic>,
    ) -> Option<T> {
        if self.unsound.contains(key) {
            return None;
        }
        let built = value.try_into().map_err(is_wrong).and_then(build);
        built.map_err(|(name, problem)| self.note(&below(key, name), problem)).ok()
    }
}

/// The key of an element of an array: by its name, else by its index.
fn key_of_element(key: &str, i: usize, name: Option<&str>) -> String {
    match name.filter(|name| !name.is_empty() && !name.contains(char::is_control)) {
        None => format!("{key}[{i}]"),
        Some(name) => below(key, name),
    }
}

/// The problem of a value that the schema allows and its type refuses.
pub(super) fn is_wrong(error: toml::de::Error) -> Diagnostic {
    ("", format!("is wrong: {}", error.message()))
}

/// Checks a text, number or flag against the schema and returns what it means. A string in a number's place is an
/// expression of constants.
///
/// # Errors
/// The problem; if there are several alternatives, the problem of the last one.
fn read_value(value: &Value, schema: &Schema, scope: &Scope) -> Result<Value, String> {
    let read = |schema: &Schema| read_value(value, schema, scope);
    if let Some([other, last]) = schema["anyOf"].as_array().map(Vec::as_slice) {
        return read(other).or_else(|_| read(last));
    }
    if let Some(kind) = schema["format"].as_str() {
        return read_expression(value, kind, scope);
    }
    let is_number = matches!(type_of(schema), Some("number" | "integer"));
    let evaluated = is_number.then(|| Expression::number(value, scope));
    let number = evaluated.iter().flatten().next().copied();
    let is = |choice: &Schema| match choice.as_str() {
        Some(name) => value.as_str() == Some(name),
        None => number.is_some() && number == choice.as_f64(),
    };
    let is_text =
        value.as_str().is_some_and(|text| !text.trim().is_empty() && !text.contains(['\n', '\r']));
    let rule = schema["values"].as_str().unwrap_or("finite");
    let (wanted, holds) = match (schema["enum"].as_array(), type_of(schema), number) {
        (Some(choices), ..) => {
            let names: Vec<String> = choices.iter().map(Schema::to_string).collect();
            (names.join(" or "), choices.iter().any(is))
        }
        (_, Some("string"), _) => ("a string that is not empty, in one line".to_owned(), is_text),
        (_, Some("boolean"), _) => ("true or false".to_owned(), value.is_bool()),
        (_, Some("array"), _) if schema["maxItems"] == 2 && schema["items"]["type"] != "number" => {
            ("an array of two, expressions in quotes, like [\"2*x\", 0]".to_owned(), false)
        }
        (_, Some("array"), _) => ("an array".to_owned(), false),
        (_, Some("object"), _) => ("a table".to_owned(), false),
        (.., Some(number)) => (rule.to_owned(), is_within(number, schema)),
        _ => (format!("a number: {rule}"), false),
    };
    let found = match value {
        Value::Array(_) | Value::Table(_) => String::new(),
        Value::Float(number) => format!(", but is {number:?}"),
        Value::String(text)
            if text.contains(',') && text.split(',').all(|part| part.parse::<f64>().is_ok()) =>
        {
            format!(
                ", but is {value}: write a decimal point; `signorini study` runs several values"
            )
        }
        _ => match evaluated.filter(|_| value.is_str()) {
            Some(Ok(number)) => format!(", but is {value} = {number:?}"),
            Some(Err(error)) if !scope.constants.is_empty() => format!(", but {value} {error}"),
            _ => format!(
                ", but is {value}{}",
                value.as_str().and_then(without_prefix).unwrap_or_default()
            ),
        },
    };
    match number {
        _ if !holds => Err(format!("must be {wanted}{}", found.replace(['\n', '\r'], "\\n"))),
        Some(number) if type_of(schema) == Some("integer") => Ok(Value::Integer(number as i64)),
        Some(number) => Ok(Value::Float(number)),
        None => Ok(value.clone()),
    }
}

/// Whether a number is finite and within the bounds of the schema.
fn is_within(number: f64, schema: &Schema) -> bool {
    let obeys = |bound: &str, holds: fn(&f64, &f64) -> bool| {
        schema[bound].as_f64().is_none_or(|bound| holds(&number, &bound))
    };
    number.is_finite()
        && (type_of(schema) != Some("integer") || number.fract() == 0.0)
        && obeys("minimum", f64::ge)
        && obeys("exclusiveMinimum", f64::gt)
        && obeys("maximum", f64::le)
        && obeys("exclusiveMaximum", f64::lt)
}

/// Checks that a value is an expression of this kind, and finite if it is constant. Returns it with its scope.
fn read_expression(value: &Value, kind: &str, scope: &Scope) -> Result<Value, String> {
    let expression = Expression::from_toml(value, scope).map_err(|error| error.to_string())?;
    match expression.as_constant() {
        Some(value) if !value.is_finite() => Err(format!("must be finite, but is {value}")),
        None if kind == "constant" => Err(NOT_CONSTANT.to_owned()),
        None if kind == "expression in x, y" && expression.depends_on_time() => {
            Err("depends on t; it must be a function of x and y alone".to_owned())
        }
        _ => Value::try_from((value, scope.folder.to_string_lossy(), &scope.constants))
            .map_err(|error| error.to_string()),
    }
}
