//! The nodes and elements of MSH 1 and 2, where each element names its own physical group.

use super::{
    byte_reader::{ByteReader, Result},
    contents::Contents,
};

pub fn nodes(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let is_parametric = reader.section_name() == "ParametricNodes";
    for _ in 0..reader.count_line()? {
        let at = reader.position();
        let tag = reader.tag("a node tag")?;
        contents.read_node(reader, (tag, at), false)?;
        if is_parametric {
            let dimension = reader.int("a dimension")?;
            reader.int("an entity tag")?;
            // A node has a parameter per dimension of its curve or surface.
            for _ in 0..if dimension < 3 { dimension } else { 0 } {
                reader.real("a number")?;
            }
        }
    }
    Ok(())
}

/// The elements. A line of a text has one; in a binary file they stand in blocks of the same type and number of tags.
pub fn elements(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let announced = reader.count_line()?;
    let is_first_version = reader.section_name() == "ELM";
    let mut found = 0;
    while found < announced {
        let mut block = [0, 1, 2];
        if reader.encoding.is_binary {
            for (number, what) in block.iter_mut().zip(["an element type", "a count", "a count"]) {
                *number = reader.int(what)?;
            }
        }
        let [mut kind, count, mut tags] = block;
        for _ in 0..count {
            let at = reader.position();
            let element = reader.tag("an element tag")?;
            if !reader.encoding.is_binary {
                kind = reader.int("an element type")?;
                tags = if is_first_version { 2 } else { reader.int("a count of tags")? };
            }
            let mut group = 0;
            for tag in 0..tags {
                let value = reader.int("a tag")?;
                group = if tag == 0 { value.saturating_abs() } else { group };
            }
            if is_first_version {
                reader.int("a count of nodes")?;
            }
            let groups = Vec::from_iter((group != 0).then_some(group));
            contents.read_element(reader, kind, (element, at), &groups)?;
        }
        found += u64::try_from(count.max(1)).unwrap_or(1);
    }
    Ok(())
}
