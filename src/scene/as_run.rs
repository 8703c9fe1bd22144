//! The scene file in a folder of results, which runs again from any folder.

use super::{Scene, document::absolute};
use crate::mesh::{self, Format};
use std::{fs, path::PathBuf};

/// A scene file that repeats a run: the `--set` arguments are inserted, and the mesh is the one in use.
#[derive(Debug, Clone)]
pub struct AsRun {
    /// The text of the file.
    pub text: String,
    /// The names of the files that it expects beside it, and the files to copy there.
    pub copies: Vec<(String, PathBuf)>,
    /// The contents of all files with tables, one after the other.
    pub tables: Vec<u8>,
}

impl AsRun {
    /// The first line of the file.
    pub const FIRST_LINE: &str = "# As run by signorini; the results stand beside it.";

    /// Whether a file has the name of a copy.
    pub fn is_copy(name: &str) -> bool {
        let stem = name.split('.').next().unwrap_or_default();
        let number = ["scene-table", "scene-mesh"].iter().find_map(|kind| stem.strip_prefix(kind));
        number.is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))
            || (stem == "scene" && (Format::of(name.as_ref()).is_some()))
    }
}

impl Scene {
    /// The scene file that repeats the run. Copies of tables and of the mesh or its geometry stand beside it. A
    /// geometry whose files are not known keeps its full path; so does a mesh file if the run writes no frames.
    pub fn as_run(&self) -> AsRun {
        let mut scene = self.text.document.clone();
        let (mut copies, mut tables) = (Vec::new(), Vec::new());
        let mut name = |file: &str| {
            let path = absolute(&self.text.folder().join(file));
            // Reading a device might never end.
            let content = path.is_file().then(|| fs::read(&path).ok()).flatten()?;
            let known = copies.iter().position(|(_, known)| *known == path);
            let name = format!("scene-table{}.csv", known.unwrap_or(copies.len()) + 1);
            if known.is_none() {
                tables.extend(content);
                copies.push((name.clone(), path));
            }
            Some(name)
        };
        scene.iter_mut().for_each(|(_, value)| map_tables(value, &mut name));
        scene.insert("title".into(), self.title.clone().into());
        let source = &self.mesh.file;
        let is_copied =
            self.output.every != Some(0) || Format::of(source) == Some(Format::Geometry);
        let of_mesh = if is_copied { mesh::copies(source) } else { Vec::new() };
        let full = || absolute(source).to_string_lossy().into_owned();
        let file = of_mesh.first().map_or_else(full, |(name, _)| name.clone());
        copies.extend(of_mesh);
        // A mesh from the command line has no other keys.
        let written = scene.get("mesh").and_then(toml::Value::as_table).cloned();
        let has_keys = !self.mesh.parameters.is_empty() || self.mesh.materials.is_some();
        let mut mesh = written.filter(|_| has_keys).unwrap_or_default();
        mesh.insert("file".into(), file.into());
        scene.insert("mesh".into(), mesh.into());
        AsRun { text: format!("{}\n{scene}", AsRun::FIRST_LINE), copies, tables }
    }
}

/// Replaces the names of files in `table("file")` by those that `map` returns.
fn map_tables(value: &mut toml::Value, map: &mut impl FnMut(&str) -> Option<String>) {
    match value {
        toml::Value::String(text) => {
            // Only names of files are quoted in an expression.
            for quote in ["\"", "'"] {
                let parts = text.split(quote).enumerate().map(|(i, part)| match i % 2 {
                    0 => part.into(),
                    _ => map(part).unwrap_or_else(|| part.into()),
                });
                *text = parts.collect::<Vec<String>>().join(quote);
            }
        }
        toml::Value::Array(values) => values.iter_mut().for_each(|value| map_tables(value, map)),
        toml::Value::Table(table) => {
            table.iter_mut().for_each(|(_, value)| map_tables(value, map));
        }
        _ => {}
    }
}
