//! `$Entities`, `$Nodes` and `$Elements` of MSH 4.0 and 4.1, in blocks for each entity.

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
            // A point has three coordinates since 4.1, other entities have the six of their bounding box.
            for _ in 0..if dimension == 0 && contents.version > 4.0 { 3 } else { 6 } {
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
    let (blocks, announced) = header(reader, contents)?;
    for _ in 0..blocks {
        let (dimension, _) = entity(reader, contents)?;
        let parametric = reader.int("0 or 1 (parametric nodes)")? != 0;
        // Since 4.1 the tags of a block stand before its coordinates.
        let count = reader.size("a count")?;
        let is_together = contents.version == 4.0;
        let mut tags = Vec::new();
        for _ in 0..if is_together { 0 } else { count } {
            let at = reader.position();
            tags.push((reader.tag("a node tag")?, at));
        }
        for number in 0..count {
            let at = reader.position();
            let node = match is_together {
                true => (reader.tag("a node tag")?, at),
                false => tags[number as usize],
            };
            contents.read_node(reader, node, dimension == 0)?;
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
    let (blocks, announced) = header(reader, contents)?;
    let mut found = 0;
    for _ in 0..blocks {
        let entity = entity(reader, contents)?;
        let element_type = reader.int("an element type")?;
        let count = reader.size("a count")?;
        let groups = contents.groups.get(&entity).cloned().unwrap_or_default();
        for _ in 0..count {
            let at = reader.position();
            let tag = reader.tag("an element tag")?;
            contents.read_element(reader, element_type, (tag, at), &groups)?;
        }
        found += count;
    }
    check_total(start, "elements", announced, found)
}

/// The number of blocks, and the number of items in all blocks. Skips the range of their tags.
fn header(reader: &mut ByteReader, contents: &Contents) -> Result<(u64, u64)> {
    let counts = (reader.size("a count")?, reader.size("a count")?);
    if contents.version > 4.0 {
        reader.size("the smallest tag")?;
        reader.size("the largest tag")?;
    }
    Ok(counts)
}

/// The dimension and the tag of the entity of a block; before 4.1 the tag comes first.
fn entity(reader: &mut ByteReader, contents: &Contents) -> Result<(i32, i32)> {
    let first = reader.int("a dimension or an entity tag")?;
    let second = reader.int("an entity tag or a dimension")?;
    Ok(if contents.version == 4.0 { (second, first) } else { (first, second) })
}

fn check_total(at: usize, what: &str, announced: u64, found: u64) -> Result<()> {
    match announced == found {
        true => Ok(()),
        false => expected(at, &format!("{announced} {what} as announced"), found),
    }
}
