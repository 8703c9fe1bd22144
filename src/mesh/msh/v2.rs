//! `$Nodes` and `$Elements` of MSH 2.2. A binary file keeps the counts in text.

use super::{
    byte_reader::{ByteReader, Result, expected},
    contents::Contents,
};

pub fn nodes(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    for _ in 0..reader.count_line()? {
        let at = reader.position();
        let tag = reader.size("a node tag")?;
        contents.read_node(reader, tag, at)?;
    }
    Ok(())
}

/// A text file lists for each element its number, type, number of labels, labels (gmsh's manual calls
/// them tags) and nodes. A binary one lists runs of like elements: type, number of elements, number of
/// labels, then for each element its number, labels and nodes.
pub fn elements(reader: &mut ByteReader, contents: &mut Contents) -> Result<()> {
    let mut left = reader.count_line()?;
    while left > 0 {
        let at = reader.position();
        let text_tag = if reader.is_binary() { None } else { Some(reader.size("an element tag")?) };
        let element_type = reader.int("an element type")?;
        let run = if reader.is_binary() { reader.size("a count")? } else { 1 };
        let labels = reader.size("a number of tags")?;
        for _ in 0..run {
            let at = reader.position();
            let tag = match text_tag {
                Some(tag) => tag,
                None => reader.size("an element tag")?,
            };
            // The physical group (0 for none) and the entity; partitions may follow.
            let (mut group, mut entity) = (0, 0);
            for i in 0..labels {
                let label = reader.int("an element's tag")?;
                match i {
                    // A negative group only says that the curve runs backwards.
                    0 => group = label.saturating_abs(),
                    1 => entity = label,
                    _ => {}
                }
            }
            let groups = if group == 0 { &[][..] } else { &[group] };
            contents.read_element(reader, element_type, (tag, entity, at), groups)?;
        }
        let Some(rest) = left.checked_sub(run) else {
            return expected(at, "no more elements than announced", run);
        };
        left = rest;
    }
    Ok(())
}
