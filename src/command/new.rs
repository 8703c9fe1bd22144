//! `signorini new`: writes a geometry and a scene as a start, and the schema by which editors check scenes.

use super::Failure;
use signorini::output::{terminal::say, write_whole};
use signorini::scene::SCHEMA;
use signorini::suggestion::suggestion;
use std::{fs, path::Path};

/// A name, a scene, and the geometry that it names, with its file name.
type Start = [&'static str; 4];

const FIRST: Start = ["new", include_str!("new.toml"), "new.geo", include_str!("new.geo")];

macro_rules! starts {
    ($($folder:literal: $($name:literal $geometry:literal)*;)*) => { &[$($([
        $name,
        include_str!(concat!("../../", $folder, $name, ".toml")),
        $geometry,
        include_str!(concat!("../../", $folder, $geometry)),
    ],)*)*] };
}

/// The scenes of the gallery; scripts/site/gallery.toml says what its pages show of them.
const GALLERY: &[Start] = starts! {
    "geo/": "hertz" "hertz.geo" "lshape" "lshape.geo" "bridge" "bridge.geo";
    "validation/handbook/": "wavy" "rectangle.geo" "press_fit" "sector.geo" "rotating_disc" "disc.geo"
        "overturn" "rectangle.geo" "nafems_le1" "nafems_le1.geo" "cook" "cook.geo" "howland" "hole.geo"
        "levy_dam" "dam.geo" "rubber_ring" "sector.geo" "compound_ring" "rings.geo"
        "damage_contact" "rectangle.geo" "damage_stop" "rectangle.geo";
    "validation/handbook2/": "stripe_breaks" "stripes.geo";
};

/// `signorini new --list`: names and titles of the gallery.
pub fn list_gallery() -> Result<(), Failure> {
    for [name, scene, ..] in GALLERY {
        let title = scene.lines().find_map(|line| line.strip_prefix("title = "));
        say(&format!("{name:<15} {}", title.unwrap_or_default().trim_matches('"')));
    }
    Ok(())
}

/// `signorini new NAME --from START`: writes `NAME.geo` and `NAME.toml`, which run as they are. NAME may have the ending of
/// one of the files; without it the files have the name of START. The first line of the scene names the schema
/// to editors; the schema is written unless it is there.
pub fn new(name: Option<&Path>, from: Option<&str>) -> Result<(), Failure> {
    let start = from.map_or(Ok(&FIRST), |from| {
        GALLERY.iter().find(|start| start[0] == from).ok_or_else(|| {
            let names = suggestion(from, &Vec::from_iter(GALLERY.iter().map(|start| start[0])));
            Failure::input(format!("the gallery has no scene {from:?}{names}"))
        })
    });
    let [own, scene_text, geometry_file, geometry_text] = *start?;
    let name = name.unwrap_or(Path::new(own));
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
    let file = toml::Value::from(&*file).to_string();
    let text = scene_text.replace(&format!("{geometry_file:?}"), &file);
    let text = format!("#:schema ./scene.schema.json\n{text}");
    let schema = name.with_file_name("scene.schema.json");
    let is_there = fs::symlink_metadata(&schema).is_ok();
    let files = [(&geometry, geometry_text), (&scene, &text), (&schema, SCHEMA)];
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
