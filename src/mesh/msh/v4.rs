//! `$Entities`, `$Nodes` and `$Elements` of MSH 4.1, in blocks for each entity.

use super::{
    byte_reader::{ByteReader, Result, expected},
    contents::Contents,
};

pub fn entities(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = reader.size("a count")?;
    }
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = reader.int("an entity tag")?;
            // A point has three coordinates, other entities have the six of their bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                reader.real("a number")?;
            }
            let groups = contents.groups.entry((dimension, tag)).or_default();
            for _ in 0..reader.size("a count")? {
                // The sign of a group is the direction of the curve.
                groups.push(reader.int("a physical tag")?.saturating_abs());
            }
            let boundary = if dimension == 0 { 0 } else { reader.size("a count")? };
            for _ in 0..boundary {
                reader.int("an entity tag")?;
            }
        }
    }
    Ok(())
}

pub fn nodes(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let before = contents.nodes.len();
    let start = reader.position();
    let (blocks, announced) = header(reader)?;
    for _ in 0..blocks {
        let dimension = reader.int("a dimension")?;
        reader.int("an entity tag")?;
        let parametric = reader.int("0 or 1 (parametric nodes)")? != 0;
        // A converted file lacks the points that are in no physical group.
        let is_point = dimension == 0 && !contents.groups_are_entities;
        let mut tags = Vec::new();
        for _ in 0..reader.size("a count")? {
            tags.push((reader.position(), reader.size("a node tag")?));
        }
        for (at, tag) in tags {
            contents.read_node(reader, (tag, at), is_point)?;
            // A parametric node has one more number per dimension of its entity.
            for _ in 0..if parametric { dimension.clamp(0, 3) } else { 0 } {
                reader.real("a number")?;
            }
        }
    }
    check_total(start, "nodes", announced, (contents.nodes.len() - before) as u64)
}

pub fn elements(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let start = reader.position();
    let (blocks, announced) = header(reader)?;
    let mut found = 0;
    for _ in 0..blocks {
        let dimension = reader.int("a dimension")?;
        let entity = reader.int("an entity tag")?;
        let element_type = reader.int("an element type")?;
        let count = reader.size("a count")?;
        let groups = match contents.groups_are_entities {
            true => Vec::from_iter((entity != 0).then(|| entity.saturating_abs())),
            false => contents.groups.get(&(dimension, entity)).cloned().unwrap_or_default(),
        };
        for _ in 0..count {
            let at = reader.position();
            let tag = reader.size("an element tag")?;
            contents.read_element(reader, element_type, (tag, at), &groups)?;
        }
        found += count;
    }
    check_total(start, "elements", announced, found)
}

/// The number of blocks, and the number of items in all blocks. Skips the range of their tags.
pub fn header(reader: &mut ByteReader) -> Result<(u64, u64)> {
    let counts = (reader.size("a count")?, reader.size("a count")?);
    reader.size("the smallest tag")?;
    reader.size("the largest tag")?;
    Ok(counts)
}

fn check_total(at: usize, what: &str, announced: u64, found: u64) -> Result<()> {
    match announced == found {
        true => Ok(()),
        false => expected(at, &format!("{announced} {what} as announced"), found),
    }
}
