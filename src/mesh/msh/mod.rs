//! Reads gmsh's `.msh` files of versions 1, 2, 4.0 and 4.1, text and binary
//! (<https://gmsh.info/doc/texinfo/gmsh.html#File-formats>).

mod body;
mod byte_reader;
mod contents;
mod flat;
mod one_body;
mod quadrilaterals;
mod slit;
mod v2;
mod v4;
mod write;

use super::{Mesh, MeshError};
use crate::whole_file;
use byte_reader::{ByteReader, Encoding, Result, Section, error_at, expected, not_a_mesh};
use contents::Contents;
use std::{collections::BTreeMap, path::Path};

/// Reads a `.msh` file.
///
/// If there are physical surfaces, only their triangles make the body. Physical curves of the same name are
/// one curve, and so are physical surfaces. Nodes and triangles keep the order of the file, and the halves of
/// quadrilaterals come last.
///
/// # Errors
/// The file cannot be read, or it is not the mesh of a plane body. The message names the place.
pub fn read(path: &Path) -> std::result::Result<Mesh, MeshError> {
    let bytes = whole_file::read(path).map_err(MeshError::io(path))?;
    // Some editors begin a text with a byte order mark.
    parse(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes), path)
}

/// As [`read`], from the bytes of a file. Messages name the file `path`.
///
/// # Errors
/// The bytes are not the mesh of a plane body.
pub fn parse(bytes: &[u8], path: &Path) -> std::result::Result<Mesh, MeshError> {
    let mut sections = Vec::new();
    let mesh = Section::split(bytes, &mut sections)
        .and_then(|()| contents(&sections))
        .and_then(body::mesh);
    let comment = |start| {
        let comments = sections.iter().filter(|section| section.name == "Comments");
        comments.filter_map(move |section| comment(section, start))
    };
    let finished = mesh.map(|mut mesh| {
        mesh.notes.extend(comment("note "));
        Mesh { gmsh: comment("gmsh ").next(), ..mesh }
    });
    finished.map_err(|(at, problem)| {
        let place = at.map_or_else(String::new, |at| place(at, bytes, &sections));
        MeshError::File { path: path.to_owned(), place, problem }
    })
}

/// As [`parse`], from the bytes that gmsh has made of the file `path`.
pub(super) fn parse_made(bytes: &[u8], path: &Path) -> std::result::Result<Mesh, MeshError> {
    parse(bytes, path).map_err(|error| match error {
        // The place in these bytes is no place in the file.
        MeshError::File { path, problem, .. } => MeshError::file(&path, problem),
        other => other,
    })
}

/// Whether a file has sections, of which the last one is complete.
pub(super) fn is_complete(bytes: &[u8]) -> bool {
    let mut sections = Vec::new();
    Section::split(bytes, &mut sections).is_ok() && !sections.is_empty()
}

/// The words after this start of a comment, such as the version of gmsh in `gmsh 4.8.4`.
fn comment(section: &Section, start: &str) -> Option<String> {
    let line = ByteReader::new(section, Encoding::default()).line("a comment").ok()?;
    line.strip_prefix(start).map(str::to_owned)
}

/// The place of a byte in a message: the line in a text file, the byte in a binary file.
fn place(byte: usize, bytes: &[u8], sections: &[Section]) -> String {
    // Every binary file holds the four bytes of the integer 1.
    if !bytes.contains(&0) {
        return format!(":{}", 1 + bytes[..byte].iter().filter(|&&b| b == b'\n').count());
    }
    let section = sections.iter().rfind(|section| section.at <= byte);
    let section = section.map_or(String::new(), |section| format!(" in ${}", section.name));
    format!(", byte {byte}{section}")
}

/// The contents of the sections, which may have any order.
fn contents(sections: &[Section]) -> Result<Contents> {
    let all = |name| sections.iter().filter(move |section| section.name == name);
    let header = all("MeshFormat").next();
    let (version, encoding) = match header {
        Some(header) => format(header)?,
        None if all("NOD").next().is_some() => (1.0, Encoding::default()),
        None if sections.is_empty() => return error_at(None, "the file is empty"),
        None => return not_a_mesh(None),
    };
    let mut contents = Contents { names: names(sections)?, version, ..Contents::default() };
    // The elements need the groups of their entities.
    let others = sections.iter().filter(|section| section.name != "Entities");
    let (mut has_nodes, mut has_elements) = (false, false);
    for section in all("Entities").chain(others) {
        let mut reader = ByteReader::new(section, encoding);
        let read = match section.name {
            "Entities" if version >= 4.0 => v4::entities,
            "Nodes" if version >= 4.0 => v4::nodes,
            "Elements" if version >= 4.0 => v4::elements,
            "Nodes" | "ParametricNodes" | "NOD" => v2::nodes,
            "Elements" | "ELM" => v2::elements,
            "PartitionedEntities" => {
                let whole = "the mesh is partitioned; write it whole: mesh without -part, or \
                             without Mesh.NbPartitions in the .geo";
                return error_at(section.at, whole);
            }
            _ => continue,
        };
        has_nodes |= matches!(section.name, "Nodes" | "ParametricNodes" | "NOD");
        has_elements |= matches!(section.name, "Elements" | "ELM");
        read(&mut reader, &mut contents)?;
        reader.finish()?;
    }
    match [(has_nodes, "Nodes"), (has_elements, "Elements")].into_iter().find(|(has, _)| !has) {
        Some((_, missing)) => {
            error_at(None, format!("there is no ${missing} section: has the .geo a surface?"))
        }
        None => Ok(contents),
    }
}

/// Reads `$MeshFormat`: version, text or binary, size of a number; in a binary file then the integer 1, whose bytes
/// tell their order.
fn format(section: &Section) -> Result<(f64, Encoding)> {
    let what = "version, file type and data size";
    let mut reader = ByteReader::new(section, Encoding::default());
    let at = reader.position();
    let version = reader.real("a version such as 4.1")?;
    if !(2.0..3.0).contains(&version) && ![4.0, 4.1].contains(&version) {
        let problem = format!(
            "version {version} is not read; write the mesh as version 4.1 or 2.2 (gmsh: -save -format msh41)"
        );
        return error_at(at, problem);
    }
    let at = reader.position();
    let (file_type, size) = (reader.int(what)?, reader.int(what)?);
    match file_type {
        0 => return Ok((version, Encoding::default())),
        1 if size == 8 => reader.line(what)?,
        1 => return expected(at, "numbers of 8 bytes", size),
        other => return expected(at, "file type 0 (text) or 1 (binary)", other),
    };
    reader.encoding.is_binary = true;
    let at = reader.position();
    let one = reader.int("the number 1")?;
    let is_swapped = one.swap_bytes() == 1;
    match one == 1 || is_swapped {
        true => {
            Ok((version, Encoding { is_binary: true, is_swapped, has_short_tags: version < 4.1 }))
        }
        false => expected(at, "the number 1", one),
    }
}

/// The names of the physical curves and surfaces by dimension and tag, from `$PhysicalNames`, which is text
/// in any file: dimension, tag, quoted name.
fn names(sections: &[Section]) -> Result<BTreeMap<(i32, i32), String>> {
    let (mut names, what) = (BTreeMap::new(), "dimension, tag and \"name\"");
    for section in sections.iter().filter(|section| section.name == "PhysicalNames") {
        let mut reader = ByteReader::new(section, Encoding::default());
        for _ in 0..reader.count_line()? {
            let at = reader.position();
            let (dimension, tag) = (reader.int(what)?, reader.int(what)?);
            let name = reader.line(what)?;
            let quoted = name.strip_prefix('"').and_then(|name| name.strip_suffix('"'));
            match dimension {
                0..=3 if name.is_empty() => {
                    return expected(at, what, format!("{dimension} {tag}"));
                }
                1 | 2 => drop(names.insert((dimension, tag), quoted.unwrap_or(&name).to_owned())),
                0..=3 => {}
                _ => return expected(at, what, dimension),
            }
        }
        reader.finish()?;
    }
    Ok(names)
}
