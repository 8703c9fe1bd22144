//! What a scene may hold, told by its reader: every key as it is asked for, with its type and range.
//! The reader is run without a document (its values note their facts and refuse themselves); what a key means is written in `keys.toml`.

use std::any::type_name;
use std::cell::RefCell;
use std::path::Path;

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Value as Json, json};

use super::document::SceneText;
use super::{reader, tables};

/// What the keys mean, by their paths.
const MEANINGS: &str = include_str!("keys.toml");

/// The keys that a reader asks for, as a JSON schema (draft 2020-12). A path is of names with points
/// between them; `[]` stands behind the name of an array for its elements, `*` for any name.
#[derive(Default)]
pub(super) struct Description(RefCell<Json>);

impl Description {
    /// Notes what is taken for the key at a path; what was noted first stays.
    pub(super) fn add(&self, path: &str, facts: Json) {
        let mut root = self.0.borrow_mut();
        let node = node(&mut root, path);
        for (name, fact) in facts.as_object().into_iter().flatten() {
            if node[name].is_null() {
                node[name] = fact.clone();
            }
        }
    }

    /// Notes whether the key must be there.
    pub(super) fn require(&self, path: &str, required: bool) {
        let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
        let mut root = self.0.borrow_mut();
        // The order of the keys is that in which they are asked for.
        node(&mut root, path);
        let list = &mut node(&mut root, table)["required"];
        let mut names = list.as_array().cloned().unwrap_or_default();
        names.retain(|other| other != name);
        names.extend(required.then(|| name.into()));
        *list = names.into();
    }

    /// Notes the type of a value that serde reads.
    pub(super) fn add_type<T>(&self, path: &str) {
        let kind = match type_name::<T>() {
            "bool" => "boolean",
            "f64" => "number",
            _ => "string",
        };
        self.add(path, json!({ "type": kind }));
    }
}

/// The schema at a path below `root`.
fn node<'a>(root: &'a mut Json, path: &str) -> &'a mut Json {
    let names = path.split('.').filter(|name| !name.is_empty());
    names.fold(root, |node, name| match name.trim_end_matches("[]") {
        "*" => {
            let any = &mut node["additionalProperties"];
            if any.is_boolean() {
                *any = json!({});
            }
            any
        }
        array if array != name => &mut node["properties"][array]["items"],
        name => &mut node["properties"][name],
    })
}

/// The schema of a type that serde reads or writes, from its fields and their comments.
#[must_use]
pub fn schema_of<T: JsonSchema>() -> Json {
    let settings = SchemaSettings::draft2020_12().with(|settings| {
        settings.inline_subschemas = true;
        settings.meta_schema = None;
    });
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.remove("title");
    schema.to_value()
}

/// The JSON schema of scenes, with the meaning, the default and an example of every key. It has
/// annotations of its own, in words: `values`, what a value may be, with its unit, and `absent`, what
/// holds without the key where no one value is the default.
#[must_use]
pub fn schema() -> Json {
    let description = Description::default();
    let (path, text) = (Path::new(""), SceneText::new(Path::new(""), "", &[]));
    reader::describe(&text, &description, |table| tables::scene(table, path, &text));
    let mut schema = description.0.take();
    let meanings: toml::Table = MEANINGS.parse().unwrap_or_default();
    for (path, meaning) in &meanings {
        for (name, text) in meaning.as_table().into_iter().flatten() {
            node(&mut schema, path)[name] = json!(text);
        }
    }
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "A scene of signorini".into();
    schema
}
