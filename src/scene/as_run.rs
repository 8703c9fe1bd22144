//! The scene file in a folder of results, which runs again from any folder.

use super::{
    Scene,
    document::{EXPRESSIONS, absolute, map_tables},
};
use crate::mesh;
use std::path::PathBuf;

/// The first line of the file.
const FIRST_LINE: &str = "# As run by signorini; the results stand beside it.";

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
    /// Whether a text is that of such a scene file.
    pub fn is_text(text: &str) -> bool {
        text.starts_with(FIRST_LINE)
    }

    /// Whether a file has the name of a copy.
    pub fn is_copy(name: &str) -> bool {
        let number = name.strip_prefix("scene-table").and_then(|rest| rest.strip_suffix(".csv"));
        ["scene.geo", "scene.msh"].contains(&name)
            || number.is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))
    }
}

impl Scene {
    /// The scene file that repeats the run. Copies of tables and of the mesh or its geometry stand beside it. A
    /// geometry that reads other files keeps its full path; so does a mesh file if the run writes no frames.
    pub fn as_run(&self) -> AsRun {
        let mut scene = self.text.document.clone();
        let mut copies = Vec::new();
        for key in EXPRESSIONS {
            let mut name = |file: &str| {
                let number = self.text.tables.iter().position(|(path, _)| path == file)?;
                let name = format!("scene-table{}.csv", number + 1);
                copies.push((name.clone(), PathBuf::from(file)));
                Some(name)
            };
            scene.get_mut(key).into_iter().for_each(|value| map_tables(value, &mut name));
        }
        scene.insert("title".into(), self.title.clone().into());
        let source = &self.mesh.file;
        let has = |ending: &str| source.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
        let copy = match () {
            () if has("geo") => mesh::is_self_contained(source).then_some("scene.geo"),
            () => (self.output.every != Some(0)).then_some("scene.msh"),
        };
        let full = || absolute(source).to_string_lossy().into_owned();
        let file = copy.map_or_else(full, str::to_owned);
        copies.extend(copy.map(|name| (name.to_owned(), source.clone())));
        let mut mesh = toml::Table::new();
        mesh.insert("file".into(), file.into());
        let mut parameters = self.mesh.parameters.clone();
        mesh.extend(parameters.remove("size").map(|size| ("size".into(), size.into())));
        if !parameters.is_empty() {
            mesh.insert("parameters".into(), parameters.into());
        }
        scene.insert("mesh".into(), mesh.into());
        let tables = self.text.tables.iter().flat_map(|(_, content)| content).copied().collect();
        AsRun { text: format!("{FIRST_LINE}\n{scene}"), copies, tables }
    }
}
