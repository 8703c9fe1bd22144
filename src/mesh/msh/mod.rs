//! Reads gmsh's `.msh` files, versions 4.1 and 2.2, text and binary.

use std::{fs, path::Path};

mod assemble;
mod edges;
mod raw;
mod source;
mod v2;
mod v4;

use super::{
    Mesh,
    error::{MeshError, Problem},
};
use raw::Raw;
use source::{Fault, Result, Source};

/// Reads a `.msh` file.
///
/// If any triangle belongs to a physical surface, only such triangles make the body.
/// Physical curves of the same name are one curve. Nodes and triangles keep the order of
/// the file.
///
/// # Errors
/// The file cannot be read, or it is not the mesh of a plane body; the message says where.
pub fn read(path: &Path) -> std::result::Result<Mesh, MeshError> {
    let bytes = fs::read(path).map_err(|source| MeshError::Io { path: path.to_owned(), source })?;
    let mut source = Source::new(&bytes);
    let result = if bytes.trim_ascii().is_empty() {
        fault(Problem::Empty)
    } else {
        parse(&mut source).and_then(assemble::assemble)
    };
    result.map_err(|Fault { at, problem }| MeshError::File {
        path: path.to_owned(),
        place: at.map(|at| source.place(at)),
        problem: Box::new(problem),
    })
}

/// A fault of the file as a whole.
fn fault<T>(problem: Problem) -> Result<T> {
    Err(Fault { at: None, problem })
}

#[derive(Clone, Copy, PartialEq)]
enum Version {
    V2,
    V4,
}

fn parse(source: &mut Source) -> Result<Raw> {
    let mut raw = Raw::default();
    let mut groups = v4::Groups::new();
    let mut version = None;
    let (mut nodes, mut elements) = (false, false);
    let mut at = 0;
    while let Some(section) = source.open()? {
        match (section.as_str(), version) {
            ("MeshFormat", _) => version = Some(format(source)?),
            // MSH 1 had no header.
            ("NOD" | "ELM", None) => return source.fault(at, Problem::Version("1".into())),
            ("PhysicalNames", Some(_)) => names(source, &mut raw)?,
            ("PartitionedEntities", _) => return source.fault(at, Problem::Partitioned),
            ("ParametricNodes", _) => return source.fault(at, Problem::ParametricNodes),
            ("Entities", Some(Version::V4)) => {
                if elements {
                    return source.fault(at, Problem::LateEntities);
                }
                v4::entities(source, &mut groups)?;
            }
            ("Nodes", Some(version)) => {
                nodes = true;
                match version {
                    Version::V2 => v2::nodes(source, &mut raw)?,
                    Version::V4 => v4::nodes(source, &mut raw)?,
                }
            }
            ("Elements", Some(version)) => {
                elements = true;
                match version {
                    Version::V2 => v2::elements(source, &mut raw)?,
                    Version::V4 => v4::elements(source, &mut raw, &groups)?,
                }
            }
            ("Comments", None) | (_, Some(_)) => {
                source.skip()?;
                at = source.at();
                continue;
            }
            _ => return source.fault(at, Problem::NotMsh),
        }
        source.close()?;
        at = source.at();
    }
    match (version, nodes, elements) {
        (None, ..) => fault(Problem::NotMsh),
        (_, false, _) => fault(Problem::MissingSection("Nodes")),
        (.., false) => fault(Problem::MissingSection("Elements")),
        _ => Ok(raw),
    }
}

/// `$MeshFormat`: version, text or binary, size of a number; then 1 in the file's byte order.
fn format(source: &mut Source) -> Result<Version> {
    let at = source.at();
    let line = source.line()?;
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let [version, kind, size] = words[..] else {
        return source.expected(at, "version, file type and data size", &line);
    };
    let version = match version {
        "4.1" => Version::V4,
        "2.2" | "2.1" | "2" => Version::V2,
        other if other.parse::<f64>().is_ok() => {
            return source.fault(at, Problem::Version(other.into()));
        }
        other => return source.expected(at, "a version such as 4.1", other),
    };
    match kind {
        "0" => source.binary = false,
        "1" => {
            source.binary = true;
            if size != "8" {
                return source.fault(at, Problem::DataSize(size.into()));
            }
            let at = source.at();
            match source.int("the number 1")? {
                1 => {}
                one if one.swap_bytes() == 1 => return source.fault(at, Problem::ByteOrder),
                other => return source.expected(at, "the number 1", &other.to_string()),
            }
        }
        other => return source.expected(at, "file type 0 (text) or 1 (binary)", other),
    }
    Ok(version)
}

/// `$PhysicalNames`, text in any file: dimension, tag, quoted name.
fn names(source: &mut Source, raw: &mut Raw) -> Result<()> {
    for _ in 0..source.count_line("physical names", 1)? {
        let at = source.at();
        let line = source.line()?;
        match physical_name(&line) {
            Some((1, tag, name)) => {
                raw.curve_names.insert(tag, name.to_owned());
            }
            Some((0..=3, ..)) => {}
            _ => return source.expected(at, "dimension, tag and \"name\"", &line),
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
