//! `$Entities`, `$Nodes` and `$Elements` of MSH 4.1: everything in blocks, one per entity.

use std::collections::HashMap;

use super::{
    super::error::Problem,
    raw::{Element, Kind, Raw, kind},
    source::{Result, Source},
};

/// Physical groups of the entities, by dimension and tag.
pub(super) type Groups = HashMap<(usize, i32), Vec<i32>>;

pub(super) fn entities(source: &mut Source, groups: &mut Groups) -> Result<()> {
    // A point has three coordinates, the others six of their bounding box.
    let counts = [
        source.count("points", 5)?,
        source.count("curves", 9)?,
        source.count("surfaces", 9)?,
        source.count("volumes", 9)?,
    ];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = source.int("an entity tag")?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                source.real()?;
            }
            let mut list = Vec::new();
            for _ in 0..source.count("physical groups", 1)? {
                // A negative group only says that the curve runs backwards.
                list.push(source.int("a physical tag")?.saturating_abs());
            }
            list.sort_unstable();
            list.dedup();
            groups.insert((dimension, tag), list);
            if dimension > 0 {
                for _ in 0..source.count("bounding entities", 1)? {
                    source.int("an entity tag")?;
                }
            }
        }
    }
    Ok(())
}

pub(super) fn nodes(source: &mut Source, raw: &mut Raw) -> Result<()> {
    let start = source.at();
    let blocks = source.count("blocks of nodes", 4)?;
    let announced = source.count("nodes", 4)?;
    raw.nodes.reserve(announced);
    let before = raw.nodes.len();
    span(source)?;
    for _ in 0..blocks {
        let dimension = source.int("a dimension")?;
        source.int("an entity tag")?;
        let parametric = source.int("0 or 1 (parametric nodes)")?;
        let count = source.count("nodes", 4)?;
        let mut tags = Vec::with_capacity(count);
        for _ in 0..count {
            tags.push((source.at(), source.size("a node tag")?));
        }
        for (at, tag) in tags {
            raw.push_node(source, tag, at)?;
            // A parametric node adds as many parameters as its entity has dimensions.
            if parametric != 0 {
                for _ in 0..dimension.clamp(0, 3) {
                    source.real()?;
                }
            }
        }
    }
    total(source, start, "nodes", announced, raw.nodes.len() - before)
}

pub(super) fn elements(source: &mut Source, raw: &mut Raw, groups: &Groups) -> Result<()> {
    let start = source.at();
    let blocks = source.count("blocks of elements", 4)?;
    let announced = source.count("elements", 2)?;
    let mut found = 0;
    span(source)?;
    for _ in 0..blocks {
        let at = source.at();
        let dimension = source.int("a dimension")?;
        let entity = source.int("an entity tag")?;
        let number = source.int("an element type")?;
        let (kind, size) = kind(source, at, number)?;
        let count = source.count("elements", 1 + size as u64)?;
        let groups = usize::try_from(dimension)
            .ok()
            .and_then(|dimension| groups.get(&(dimension, entity)))
            .map_or(&[][..], Vec::as_slice);
        for _ in 0..count {
            let at = source.at();
            let tag = source.size("an element tag")?;
            match kind {
                Kind::Line => {
                    let nodes = tag_list(source)?;
                    let lines =
                        groups.iter().map(|&group| Element { tag, group, entity, nodes, at });
                    raw.lines.extend(lines);
                }
                Kind::Triangle => {
                    let group = groups.first().copied().unwrap_or(0);
                    let nodes = tag_list(source)?;
                    raw.triangles.push(Element { tag, group, entity, nodes, at });
                }
                Kind::Point | Kind::Other => {
                    for _ in 0..size {
                        source.size("a node tag")?;
                    }
                    if matches!(kind, Kind::Other) {
                        raw.unusable.entry(number).or_insert((0, at)).0 += 1;
                    }
                }
            }
        }
        found += count;
    }
    total(source, start, "elements", announced, found)
}

/// The smallest and largest tag, of no use here.
fn span(source: &mut Source) -> Result<()> {
    source.size("the smallest tag")?;
    source.size("the largest tag")?;
    Ok(())
}

fn tag_list<const N: usize>(source: &mut Source) -> Result<[u64; N]> {
    let mut tags = [0; N];
    for tag in &mut tags {
        *tag = source.size("a node tag")?;
    }
    Ok(tags)
}

fn total(
    source: &Source,
    at: usize,
    what: &'static str,
    announced: usize,
    found: usize,
) -> Result<()> {
    if announced == found {
        return Ok(());
    }
    source.fault(at, Problem::Total { what, announced, found })
}
