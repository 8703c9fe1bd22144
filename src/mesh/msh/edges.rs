//! The edges of the triangulation: how the triangles hang together, and its curves.

use std::collections::{BTreeMap, HashSet};

use super::{
    super::{Curve, error::Problem},
    assemble::{Index, Triangle, at},
    raw::Raw,
    source::Result,
};

/// An edge as its triangle runs through it, sorted first by the nodes in order.
type Side = ([usize; 2], usize, [usize; 2]);

/// All edges, in the order of their sorted nodes. A boundary edge is there once, an inner
/// edge twice.
pub(super) struct Edges(Vec<Side>);

fn sorted([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

impl Edges {
    /// Lists the edges of counter-clockwise triangles and makes sure that these fit together.
    pub(super) fn new(raw: &Raw, triangles: &[Triangle]) -> Result<Self> {
        let mut sides: Vec<Side> = Vec::with_capacity(3 * triangles.len());
        for (i, &(_, [a, b, c])) in triangles.iter().enumerate() {
            sides.extend([[a, b], [b, c], [c, a]].map(|side| (sorted(side), i, side)));
        }
        sides.sort_unstable();
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            let nodes = same[0].0.map(|node| raw.nodes[node].tag);
            let element = |side: &Side| triangles[side.1].0;
            match same {
                [p, q, r, ..] => {
                    let triangles = [p, q, r].map(|side| element(side).tag);
                    return at(element(r).at, Problem::CrowdedEdge { nodes, triangles });
                }
                // Counter-clockwise neighbours run through their edge in opposite directions.
                [p, q] if p.2 == q.2 => {
                    let triangles = [p, q].map(|side| element(side).tag);
                    return at(element(q).at, Problem::Fold { nodes, triangles });
                }
                _ => {}
            }
        }
        Ok(Self(sides))
    }

    /// The one or two sides of an edge; none if it is no edge.
    fn get(&self, nodes: [usize; 2]) -> &[Side] {
        let Self(sides) = self;
        let start = sides.partition_point(|side| side.0 < nodes);
        let count = sides[start..].iter().take_while(|side| side.0 == nodes).count();
        &sides[start..start + count]
    }

    /// Collects the physical curves, each edge once.
    pub(super) fn curves(&self, raw: &Raw, index: &Index) -> Result<BTreeMap<String, Curve>> {
        let mut curves = BTreeMap::<String, Curve>::new();
        let mut seen = HashSet::new();
        for line in raw.lines.iter().filter(|line| line.group != 0) {
            let nodes = sorted(index.resolve(line)?);
            let name = raw.curve_names.get(&line.group);
            let name = name.cloned().unwrap_or_else(|| line.group.to_string());
            let sides = self.get(nodes);
            if sides.is_empty() {
                let (line, at_line, nodes) = (line.tag, line.at, line.nodes);
                return at(at_line, Problem::StrayLine { line, curve: name, nodes });
            }
            let first = seen.insert((name.clone(), nodes));
            let curve = curves.entry(name).or_default();
            match sides {
                _ if !first => {}
                [only] => curve.edges.push(only.2),
                _ => curve.interior_edges += 1,
            }
        }
        Ok(curves)
    }
}
