//! `$Nodes` and `$Elements` of MSH 2.2. A binary file keeps the counts in text.

use super::{
    super::error::Problem,
    raw::{Element, Kind, Raw, kind},
    source::{Result, Source},
};

pub(super) fn nodes(source: &mut Source, raw: &mut Raw) -> Result<()> {
    let count = source.count_line("nodes", 4)?;
    raw.nodes.reserve(count);
    for _ in 0..count {
        let at = source.at();
        let tag = positive(source, "a node tag")?;
        raw.push_node(source, tag, at)?;
    }
    Ok(())
}

pub(super) fn elements(source: &mut Source, raw: &mut Raw) -> Result<()> {
    let count = source.count_line("elements", 2)?;
    let mut left = count;
    while left > 0 {
        // A text file gives type and number of tags with every element; a binary one heads
        // a run of like elements with type, how many follow, number of tags.
        let at = source.at();
        let (tag, number, run) = if source.binary {
            let number = source.int("an element type")?;
            let run = positive(source, "a count")?;
            match usize::try_from(run) {
                Ok(run @ 1..) if run <= left => (None, number, run),
                _ => {
                    return source.fault(at, Problem::Count { what: "elements", count: run });
                }
            }
        } else {
            let tag = positive(source, "an element tag")?;
            (Some(tag), source.int("an element type")?, 1)
        };
        let (kind, size) = kind(source, at, number)?;
        let labels = positive(source, "a number of tags")?;
        let labels = source.bounded(at, "element tags", labels, 1)?;
        for _ in 0..run {
            let at = source.at();
            let tag = match tag {
                Some(tag) => tag,
                None => positive(source, "an element tag")?,
            };
            let (group, entity) = group_and_entity(source, labels)?;
            match kind {
                Kind::Line => {
                    let nodes = tag_list(source)?;
                    raw.lines.push(Element { tag, group, entity, nodes, at });
                }
                Kind::Triangle => {
                    let nodes = tag_list(source)?;
                    raw.triangles.push(Element { tag, group, entity, nodes, at });
                }
                Kind::Point | Kind::Other => {
                    for _ in 0..size {
                        source.int("a node tag")?;
                    }
                    if matches!(kind, Kind::Other) {
                        raw.unusable.entry(number).or_insert((0, at)).0 += 1;
                    }
                }
            }
        }
        left -= run;
    }
    Ok(())
}

/// The first two of an element's tags; partitions follow, and nobody asks for them.
fn group_and_entity(source: &mut Source, labels: usize) -> Result<(i32, i32)> {
    let mut first = [0, 0];
    for i in 0..labels {
        let label = source.int("an element's tag")?;
        if let Some(slot) = first.get_mut(i) {
            *slot = label;
        }
    }
    // A negative group only says that the curve runs backwards.
    Ok((first[0].saturating_abs(), first[1]))
}

fn tag_list<const N: usize>(source: &mut Source) -> Result<[u64; N]> {
    let mut tags = [0; N];
    for tag in &mut tags {
        *tag = positive(source, "a node tag")?;
    }
    Ok(tags)
}

fn positive(source: &mut Source, what: &'static str) -> Result<u64> {
    let at = source.at();
    let tag = source.int(what)?;
    match u64::try_from(tag) {
        Ok(tag) => Ok(tag),
        Err(_) => source.expected(at, what, &tag.to_string()),
    }
}
