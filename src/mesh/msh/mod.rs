//! Reads gmsh's `.msh` files, versions 4.1 and 2.2, text and binary
//! (<https://gmsh.info/doc/texinfo/gmsh.html#File-formats>).

mod body;
mod byte_reader;
mod contents;
mod v2;
mod v4;

use super::{
    Mesh,
    error::{MeshError, Place, Problem},
};
use byte_reader::{ByteReader, Fault, Numbers, Result, Section, expected, fault};
use contents::Contents;
use std::{fs, path::Path};

/// Reads a `.msh` file.
///
/// If any triangle belongs to a physical surface, only such triangles make the body.
/// Physical curves of the same name are one curve. Nodes and triangles keep the order of
/// the file.
///
/// # Errors
/// The file cannot be read, or it is not the mesh of a plane body; the message says where.
pub fn read(path: &Path) -> std::result::Result<Mesh, MeshError> {
    let bytes = fs::read(path).map_err(MeshError::io(path))?;
    let mut sections = Vec::new();
    let mesh = Section::split(&bytes, &mut sections)
        .and_then(|()| contents(&sections))
        .and_then(|contents| body::mesh(&contents));
    mesh.map_err(|Fault { at, problem }| MeshError::File {
        path: path.to_owned(),
        place: at.map(|at| place(at, &bytes, &sections)),
        problem: Box::new(problem),
    })
}

/// The place of a byte for a message: a line of a text file, a byte of a binary one.
fn place(byte: usize, bytes: &[u8], sections: &[Section]) -> Place {
    // Every binary file holds the four bytes of the integer 1.
    if bytes.contains(&0) {
        let section = sections.iter().rfind(|section| section.at <= byte);
        Place::Byte { section: section.map_or("", |section| section.name).to_owned(), byte }
    } else {
        Place::Line(1 + bytes[..byte].iter().filter(|&&b| b == b'\n').count())
    }
}

/// Reads a section.
type Parse = fn(&mut ByteReader, &mut Contents) -> Result<()>;

/// The sections of MSH 2.2 (also announced as 2.1 or 2) that are read, in this order.
const V2: &[(&str, Parse)] =
    &[("PhysicalNames", physical_names), ("Nodes", v2::nodes), ("Elements", v2::elements)];
/// Those of MSH 4.1.
const V4: &[(&str, Parse)] = &[
    ("PhysicalNames", physical_names),
    ("Entities", v4::entities),
    ("Nodes", v4::nodes),
    ("Elements", v4::elements),
];

/// What the sections list, in whatever order they stand.
fn contents(sections: &[Section]) -> Result<Contents> {
    let all = |name| sections.iter().filter(move |section| section.name == name);
    let Some(header) = all("MeshFormat").next() else {
        let problem = if sections.is_empty() { Problem::Empty } else { Problem::NotMsh };
        return fault(None, problem);
    };
    let (version, numbers) = format(header)?;
    for section in sections {
        match section.name {
            "PartitionedEntities" => return fault(section.at, Problem::Partitioned),
            "ParametricNodes" => return fault(section.at, Problem::ParametricNodes),
            _ => {}
        }
    }
    let mut contents = Contents::default();
    for (name, parse) in version {
        for section in all(name) {
            let mut reader = ByteReader::new(section, numbers);
            parse(&mut reader, &mut contents)?;
            reader.finish()?;
        }
    }
    match ["Nodes", "Elements"].into_iter().find(|name| all(name).next().is_none()) {
        Some(missing) => fault(None, Problem::MissingSection(missing)),
        None => Ok(contents),
    }
}

/// `$MeshFormat`: version, text or binary, size of a number; in a binary file then the integer 1,
/// which shows its byte order.
fn format(section: &Section) -> Result<(&'static [(&'static str, Parse)], Numbers)> {
    let what = "version, file type and data size";
    let mut reader = ByteReader::new(section, Numbers::Text);
    let at = reader.position();
    let line = reader.line(what)?;
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let [version, file_type, size] = words[..] else { return expected(at, what, &line) };
    let (version, binary) = match version {
        "4.1" => (V4, Numbers::Binary4),
        "2.2" | "2.1" | "2" => (V2, Numbers::Binary2),
        other if other.parse::<f64>().is_ok() => return fault(at, Problem::Version(other.into())),
        other => return expected(at, "a version such as 4.1", other),
    };
    match file_type {
        "0" => return Ok((version, Numbers::Text)),
        "1" => reader.numbers = binary,
        other => return expected(at, "file type 0 (text) or 1 (binary)", other),
    }
    let at = reader.position();
    match reader.int("the number 1")? {
        1 if size == "8" => Ok((version, binary)),
        one if one == 1 || one.swap_bytes() == 1 => fault(at, Problem::ForeignNumbers),
        other => expected(at, "the number 1", &other.to_string()),
    }
}

/// `$PhysicalNames`, text in any file: dimension, tag, quoted name.
fn physical_names(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    for _ in 0..reader.count_line()? {
        let at = reader.position();
        let line = reader.line("dimension, tag and \"name\"")?;
        match physical_name(&line) {
            Some((1, tag, name)) => drop(contents.curve_names.insert(tag, name.to_owned())),
            Some((0..=3, ..)) => {}
            _ => return expected(at, "dimension, tag and \"name\"", &line),
        }
    }
    Ok(())
}

fn physical_name(line: &str) -> Option<(u8, i32, &str)> {
    let blank = |c: char| c.is_ascii_whitespace();
    let (dimension, rest) = line.split_once(blank)?;
    let (tag, name) = rest.trim_start().split_once(blank)?;
    let name = name.trim();
    let quoted = name.strip_prefix('"').and_then(|name| name.strip_suffix('"'));
    Some((dimension.parse().ok()?, tag.parse().ok()?, quoted.unwrap_or(name)))
}
