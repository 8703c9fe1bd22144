//! Reads gmsh's `.msh` files of version 4.1, text and binary
//! (<https://gmsh.info/doc/texinfo/gmsh.html#File-formats>). gmsh converts files of other versions.

mod body;
mod byte_reader;
mod contents;
mod flat;
mod one_body;
mod slit;
mod v4;
mod write;

use super::{Mesh, MeshError, gmsh};
use byte_reader::{ByteReader, Result, Section, error_at, expected, not_a_mesh};
use contents::Contents;
use std::{collections::BTreeMap, ffi::OsString, fs, path::Path};

/// Reads a `.msh` file.
///
/// If there are physical surfaces, only their triangles make the body. Physical curves of the same name are
/// one curve, and so are physical surfaces. Nodes and triangles keep the order of the file.
///
/// gmsh converts a file of another version, or of a machine with another byte order.
///
/// # Errors
/// The file cannot be read or converted, or it is not the mesh of a plane body. The message names the place.
pub fn read(path: &Path) -> std::result::Result<Mesh, MeshError> {
    let bytes = fs::read(path).map_err(MeshError::io(path))?;
    // Some editors begin a text with a byte order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let Some(version) = foreign_version(bytes) else { return parse(bytes, path) };
    let converted = converted(path, bytes, version)?;
    let mesh = sections_of(&converted)
        .and_then(|sections| contents(&sections, version < 4.0))
        // gmsh drops the names that several groups share.
        .and_then(|contents| {
            let sections = sections_of(bytes).unwrap_or_default();
            Ok(Contents { names: names(&sections)?, ..contents })
        })
        .and_then(|contents| body::mesh(&contents));
    // The place in the converted bytes is no place in the file.
    mesh.map_err(|(_, problem)| MeshError::file(path, problem))
}

/// As [`read`], from the bytes of a file of version 4.1. Messages name the file `path`.
///
/// # Errors
/// The bytes are not the mesh of a plane body.
pub fn parse(bytes: &[u8], path: &Path) -> std::result::Result<Mesh, MeshError> {
    let mut sections = Vec::new();
    let mesh = Section::split(bytes, &mut sections)
        .and_then(|()| contents(&sections, false))
        .and_then(|contents| body::mesh(&contents));
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
    sections_of(bytes).is_ok_and(|sections| !sections.is_empty())
}

/// What follows this start of a comment, such as the version of gmsh in `gmsh 4.8.4`.
fn comment(section: &Section, start: &str) -> Option<String> {
    let line = ByteReader::new(section, false).line("a comment").ok()?;
    line.strip_prefix(start).map(str::to_owned)
}

fn sections_of(bytes: &[u8]) -> Result<Vec<Section<'_>>> {
    let mut sections = Vec::new();
    Section::split(bytes, &mut sections).map(|()| sections)
}

/// The version of a complete file that gmsh must convert: its version is not 4.1, or its binary numbers have
/// another byte order.
fn foreign_version(bytes: &[u8]) -> Option<f64> {
    if bytes.starts_with(b"$NOD") {
        return Some(1.0);
    }
    // With another beginning gmsh would run the file as a script.
    if ![&b"$MeshFormat"[..], b"$Comments"].iter().any(|first| bytes.starts_with(first)) {
        return None;
    }
    let sections = sections_of(bytes).ok()?;
    let header = sections.iter().find(|section| section.name == "MeshFormat")?;
    format(header).ok()?.err()
}

/// The bytes of a file of this version after gmsh has converted it to MSH 4.1.
///
/// In versions before 4 each element names its own group, but gmsh would give all groups of an entity's
/// elements to the entity. If its tags are switched, the groups become the entities.
fn converted(path: &Path, bytes: &[u8], version: f64) -> std::result::Result<Vec<u8>, MeshError> {
    let switch = (version < 4.0).then_some("-switch_tags");
    let arguments = ["-save", "-save_all", "-bin"].into_iter().chain(switch).map(OsString::from);
    gmsh::run((path, Some(bytes)), arguments, "", "convert it to MSH 4.1")
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

/// The contents of the sections, which may have any order. The physical groups are those of the entities, or
/// the entities themselves.
fn contents(sections: &[Section], groups_are_entities: bool) -> Result<Contents> {
    let all = |name| sections.iter().filter(move |section| section.name == name);
    let Some(header) = all("MeshFormat").next() else {
        return if sections.is_empty() {
            error_at(None, "the file is empty")
        } else {
            not_a_mesh(None)
        };
    };
    let is_binary =
        format(header)?.or_else(|version| expected(header.at, "version 4.1", version))?;
    let names = names(sections)?;
    let mut contents = Contents { names, groups_are_entities, ..Contents::default() };
    // The elements need the groups of their entities.
    let others = sections.iter().filter(|section| section.name != "Entities");
    for section in all("Entities").chain(others) {
        let mut reader = ByteReader::new(section, is_binary);
        let read = match section.name {
            "Entities" => v4::entities,
            "Nodes" => v4::nodes,
            "Elements" => v4::elements,
            "PartitionedEntities" => {
                let whole = "the mesh is partitioned; write it whole: mesh without -part, or \
                             without Mesh.NbPartitions in the .geo";
                return error_at(section.at, whole);
            }
            _ => continue,
        };
        read(&mut reader, &mut contents)?;
        reader.finish()?;
    }
    match ["Nodes", "Elements"].into_iter().find(|name| all(name).next().is_none()) {
        Some(missing) => {
            error_at(None, format!("there is no ${missing} section: has the .geo a surface?"))
        }
        None => Ok(contents),
    }
}

/// Reads `$MeshFormat`: version, text or binary, size of a number; in a binary file then the integer 1.
/// Returns whether the numbers of version 4.1 are binary, or the version of a file that gmsh must convert.
fn format(section: &Section) -> Result<std::result::Result<bool, f64>> {
    let what = "version, file type and data size";
    let mut reader = ByteReader::new(section, false);
    let version = reader.real("a version such as 4.1")?;
    let at = reader.position();
    let (file_type, size) = (reader.int(what)?, reader.int(what)?);
    match file_type {
        _ if version != 4.1 => return Ok(Err(version)),
        0 => return Ok(Ok(false)),
        1 if size == 8 => reader.line(what)?,
        1 => return expected(at, "numbers of 8 bytes", size),
        other => return expected(at, "file type 0 (text) or 1 (binary)", other),
    };
    reader.is_binary = true;
    let at = reader.position();
    match reader.int("the number 1")? {
        1 => Ok(Ok(true)),
        other if other.swap_bytes() == 1 => Ok(Err(version)),
        other => expected(at, "the number 1", other),
    }
}

/// The names of the physical curves and surfaces by dimension and tag, from `$PhysicalNames`, which is text
/// in any file: dimension, tag, quoted name.
fn names(sections: &[Section]) -> Result<BTreeMap<(i32, i32), String>> {
    let (mut names, what) = (BTreeMap::new(), "dimension, tag and \"name\"");
    for section in sections.iter().filter(|section| section.name == "PhysicalNames") {
        let mut reader = ByteReader::new(section, false);
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
