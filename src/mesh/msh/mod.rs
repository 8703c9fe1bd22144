//! Reads gmsh's `.msh` files, versions 4.1 and 2.2, text and binary
//! (<https://gmsh.info/doc/texinfo/gmsh.html#File-formats>).

mod body;
mod byte_reader;
mod contents;
mod one_body;
mod v2;
mod v4;
mod write;

use super::{Mesh, MeshError};
use byte_reader::{
    ByteReader, Numbers, Result, Section, expected, fault, not_a_mesh, unsupported_version,
};
use contents::Contents;
use std::{fs, path::Path};

/// Reads a `.msh` file.
///
/// If any triangle belongs to a physical surface, only such triangles make the body. Physical curves of
/// the same name are one curve, as are physical surfaces. Nodes and triangles keep the order of the
/// file.
///
/// # Errors
/// The file cannot be read, or it is not the mesh of a plane body; the message says where.
pub fn read(path: &Path) -> std::result::Result<Mesh, MeshError> {
    parse(&fs::read(path).map_err(MeshError::io(path))?, path)
}

/// As [`read`], from the bytes of a file that would stand at `path`.
///
/// # Errors
/// As [`read`], but for the reading itself.
pub fn parse(bytes: &[u8], path: &Path) -> std::result::Result<Mesh, MeshError> {
    let mut sections = Vec::new();
    let mesh = Section::split(bytes, &mut sections)
        .and_then(|()| contents(&sections))
        .and_then(|contents| body::mesh(&contents));
    mesh.map_err(|(at, problem)| {
        let place = at.map_or_else(String::new, |at| place(at, bytes, &sections));
        MeshError::File { path: path.to_owned(), place, problem }
    })
}

/// The number of elements that a `.msh` file announces, triangles for the most part; 0 where it is none.
///
/// # Errors
/// The file cannot be read.
pub fn announced_elements(path: &Path) -> std::result::Result<usize, MeshError> {
    let bytes = fs::read(path).map_err(MeshError::io(path))?;
    let mut sections = Vec::new();
    // What else is wrong is told by who reads all of it.
    let _ = Section::split(&bytes, &mut sections);
    Ok(announced(&sections).unwrap_or(0) as usize)
}

/// The number of elements that the sections announce.
fn announced(sections: &[Section]) -> Option<u64> {
    let named = |name| sections.iter().find(|section| section.name == name);
    let (version, numbers) = format(named("MeshFormat")?).ok()?;
    let mut reader = ByteReader::new(named("Elements")?, numbers);
    match version {
        2 => reader.count_line().ok(),
        _ => Some(v4::header(&mut reader).ok()?.1),
    }
}

/// The place of a byte for a message: a line of a text file, a byte of a binary one.
fn place(byte: usize, bytes: &[u8], sections: &[Section]) -> String {
    // Every binary file holds the four bytes of the integer 1.
    if !bytes.contains(&0) {
        return format!(":{}", 1 + bytes[..byte].iter().filter(|&&b| b == b'\n').count());
    }
    let section = sections.iter().rfind(|section| section.at <= byte);
    let section = section.map_or(String::new(), |section| format!(" in ${}", section.name));
    format!(", byte {byte}{section}")
}

/// What the sections list, in whatever order they stand.
fn contents(sections: &[Section]) -> Result<Contents> {
    let all = |name| sections.iter().filter(move |section| section.name == name);
    let Some(header) = all("MeshFormat").next() else {
        return if sections.is_empty() {
            fault(None, "the file is empty")
        } else {
            not_a_mesh(None)
        };
    };
    let (version, numbers) = format(header)?;
    let mut contents = Contents::default();
    // The elements need the groups of their entities.
    let others = sections.iter().filter(|section| section.name != "Entities");
    for section in all("Entities").chain(others) {
        let mut reader = ByteReader::new(section, numbers);
        let read = match (section.name, version) {
            ("PhysicalNames", _) => physical_names,
            ("Nodes", 2) => v2::nodes,
            ("Elements", 2) => v2::elements,
            ("Entities", 4) => v4::entities,
            ("Nodes", 4) => v4::nodes,
            ("Elements", 4) => v4::elements,
            ("PartitionedEntities", _) => {
                let whole = "the mesh is partitioned; write it whole: mesh without -part, or \
                             without Mesh.NbPartitions in the .geo";
                return fault(section.at, whole);
            }
            ("ParametricNodes", _) => {
                let plain = "$ParametricNodes of MSH 2 are not supported; mesh without \
                             -save_parametric (Mesh.SaveParametric = 0), or with -format msh41";
                return fault(section.at, plain);
            }
            _ => continue,
        };
        read(&mut reader, &mut contents)?;
        reader.finish()?;
    }
    match ["Nodes", "Elements"].into_iter().find(|name| all(name).next().is_none()) {
        Some(missing) => fault(None, format!("there is no ${missing} section")),
        None => Ok(contents),
    }
}

/// `$MeshFormat`: version, text or binary, size of a number; in a binary file then the integer 1,
/// which shows its byte order. Returns the version's first digit.
fn format(section: &Section) -> Result<(u8, Numbers)> {
    let what = "version, file type and data size";
    let mut reader = ByteReader::new(section, Numbers::Text);
    let at = reader.position();
    let (version, binary) = match reader.real("a version such as 4.1")? {
        4.1 => (4, Numbers::Binary4),
        2.0 | 2.1 | 2.2 => (2, Numbers::Binary2),
        other => return unsupported_version(at, other),
    };
    let at = reader.position();
    let (file_type, size) = (reader.int(what)?, reader.int(what)?);
    match file_type {
        0 => return Ok((version, Numbers::Text)),
        1 => reader.line(what)?,
        other => return expected(at, "file type 0 (text) or 1 (binary)", other),
    };
    reader.numbers = binary;
    let at = reader.position();
    match reader.int("the number 1")? {
        1 if size == 8 => Ok((version, binary)),
        one if one == 1 || one.swap_bytes() == 1 => {
            let foreign = "its binary numbers are those of another machine (byte order or size); \
                           convert it there with `gmsh OLD.msh -save -format msh41 -o NEW.msh` \
                           (text, without -bin)";
            fault(at, foreign)
        }
        other => expected(at, "the number 1", other),
    }
}

/// `$PhysicalNames`: dimension, tag, quoted name.
fn physical_names(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let what = "dimension, tag and \"name\"";
    reader.numbers = Numbers::Text;
    for _ in 0..reader.count_line()? {
        let at = reader.position();
        let (dimension, tag) = (reader.int(what)?, reader.int(what)?);
        let name = reader.line(what)?;
        let quoted = name.strip_prefix('"').and_then(|name| name.strip_suffix('"'));
        match dimension {
            0..=3 if name.is_empty() => return expected(at, what, format!("{dimension} {tag}")),
            1 | 2 => {
                contents.names.insert((dimension, tag), quoted.unwrap_or(&name).to_owned());
            }
            0..=3 => {}
            _ => return expected(at, what, dimension),
        }
    }
    Ok(())
}
