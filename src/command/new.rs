//! `signorini new`: writes a geometry and a scene as a start, and the schema by which editors check scenes.

use super::Failure;
use signorini::output::{terminal::say, write_whole};
use signorini::scene::SCHEMA;
use std::{fs, path::Path};

const GEOMETRY: &str = include_str!("new.geo");
const FIRST_SCENE: &str = include_str!("new.toml");

/// `signorini new NAME`: writes `NAME.geo` and `NAME.toml`, which run as they are. NAME may have the ending of
/// one of the files. The first line of the scene names the schema to editors; it is written unless it is there.
pub fn new(name: &Path) -> Result<(), Failure> {
    let file = name.extension().is_some_and(|ending| ending == "toml" || ending == "geo");
    let Some(stem) = (if file { name.file_stem() } else { name.file_name() }) else {
        let name = name.display();
        return Err(Failure::input(format!("{name} is no name; write, say, `signorini new dam`")));
    };
    let [geometry, scene] = [".geo", ".toml"].map(|extension| {
        let mut file = stem.to_owned();
        file.push(extension);
        name.with_file_name(file)
    });
    if let Some(there) =
        [&geometry, &scene].into_iter().find(|path| fs::symlink_metadata(path).is_ok())
    {
        let there = there.display();
        return Err(Failure::input(format!("{there} is there already; give another name")));
    }
    let file = geometry.file_name().unwrap_or_default().to_string_lossy();
    let text = FIRST_SCENE.replace("\"new.geo\"", &toml::Value::from(&*file).to_string());
    let schema = name.with_file_name("scene.schema.json");
    let is_there = fs::symlink_metadata(&schema).is_ok();
    let files = [(&geometry, GEOMETRY), (&scene, &text), (&schema, SCHEMA)];
    for (path, text) in &files[..3 - usize::from(is_there)] {
        write_whole(path, text.as_bytes()).map_err(Failure::input)?;
    }
    let results = Path::new("out").join(stem);
    let [word, folder] = [&scene, &results].map(|path| quoted(path));
    say(&format!(
        "{} and {} are written; next:\n  signorini check {word}\n  signorini run {word}\n  \
         signorini plot {folder}",
        geometry.display(),
        scene.display()
    ));
    Ok(())
}

/// A path as a word of a shell.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    match text.chars().all(|c| c.is_alphanumeric() || "/._-+".contains(c)) {
        true => text,
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}
