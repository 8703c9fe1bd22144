//! The nodes and elements of a `.msh` file, before they are checked to be the mesh of a plane body.

use super::byte_reader::{ByteReader, Result, error_at};
use rustc_hash::FxHashMap as HashMap;
use std::collections::BTreeMap;

/// A node as listed.
pub struct Node {
    pub tag: u64,
    pub point: [f64; 3],
    /// Is it a point of the geometry?
    pub is_point: bool,
    /// The byte where it is listed, for messages.
    pub at: usize,
}

/// An element with N vertices in one physical group.
pub struct Element<const N: usize> {
    pub tag: u64,
    /// Tag of the physical group, 0 for none.
    pub group: i32,
    /// Tags of its vertices.
    pub nodes: [u64; N],
    /// The byte where it is listed, for messages.
    pub at: usize,
}

/// The contents of a file in its order.
#[derive(Default)]
pub struct Contents {
    /// Names of the physical curves and surfaces by dimension and tag.
    pub names: BTreeMap<(i32, i32), String>,
    /// Physical groups of the entities, by dimension and tag.
    pub groups: HashMap<(i32, i32), Vec<i32>>,
    /// The version of the format.
    pub version: f64,
    pub nodes: Vec<Node>,
    /// The lines in physical groups, once for each group.
    pub lines: Vec<Element<2>>,
    /// The triangles, once for each of their groups.
    pub triangles: Vec<Element<3>>,
    /// The quadrilaterals, once for each of their groups, with the node at their centre, if they have one; until they
    /// are divided.
    pub quadrilaterals: Vec<(Element<4>, Option<u64>)>,
    /// The number of quadrilaterals that were cut into triangles.
    pub divided: usize,
    /// Tags of the midpoint nodes of second-order elements, by the vertices of their edges in increasing
    /// order.
    pub midpoints: HashMap<[u64; 2], u64>,
}

impl Contents {
    /// The name of a physical group, or its tag.
    pub fn name(&self, dimension: i32, group: i32) -> String {
        self.names.get(&(dimension, group)).cloned().unwrap_or_else(|| group.to_string())
    }

    /// The midpoint node of the edge between two nodes of a second-order element.
    pub fn midpoint(&self, [a, b]: [u64; 2]) -> Option<u64> {
        self.midpoints.get(&[a.min(b), a.max(b)]).copied()
    }

    /// Reads the coordinates of the node `tag`, which is listed at byte `at`.
    pub fn read_node(
        &mut self,
        reader: &mut ByteReader,
        (tag, at): (u64, usize),
        is_point: bool,
    ) -> Result<()> {
        let mut point = [0.0; 3];
        for coordinate in &mut point {
            *coordinate = reader.real("a number")?;
        }
        if point.iter().any(|x| !x.is_finite()) {
            return error_at(at, format!("a coordinate of node {tag} is not a finite number"));
        }
        self.nodes.push(Node { tag, point, is_point, at });
        Ok(())
    }

    /// Reads the nodes of the element `tag` of gmsh's `element_type`, which is listed at byte `at`. The
    /// contents get it once for each of its physical `groups`; without groups, faces get group 0.
    pub fn read_element(
        &mut self,
        reader: &mut ByteReader,
        element_type: i32,
        (tag, at): (u64, usize),
        groups: &[i32],
    ) -> Result<()> {
        let faces = if groups.is_empty() { &[0] } else { groups };
        let (name, mend) = match element_type {
            1 | 8 => {
                let nodes = node_tags(reader)?;
                if element_type == 8 {
                    self.read_midpoints(reader, &[nodes], tag, at)?;
                }
                let of = |&group: &i32| Element { tag, group, nodes, at };
                self.lines.extend(groups.iter().map(of));
                return Ok(());
            }
            2 | 9 => {
                let nodes @ [a, b, c] = node_tags(reader)?;
                if element_type == 9 {
                    self.read_midpoints(reader, &[[a, b], [b, c], [c, a]], tag, at)?;
                }
                let of = |&group: &i32| Element { tag, group, nodes, at };
                self.triangles.extend(faces.iter().map(of));
                return Ok(());
            }
            3 | 10 | 16 => {
                let nodes @ [a, b, c, d] = node_tags(reader)?;
                if element_type != 3 {
                    self.read_midpoints(reader, &[[a, b], [b, c], [c, d], [d, a]], tag, at)?;
                }
                let centre = (element_type == 10).then(|| reader.tag("a node tag")).transpose()?;
                let of = |&group: &i32| (Element { tag, group, nodes, at }, centre);
                self.quadrilaterals.extend(faces.iter().map(of));
                return Ok(());
            }
            // A point.
            15 => return node_tags::<1>(reader).map(drop),
            20..=28 | 36 | 37 => {
                ("an element of higher order", "mesh with Mesh.ElementOrder = 1 or 2")
            }
            4..=7 | 11..=14 | 17..=19 | 29 => ("solid", "mesh with `gmsh -2`"),
            _ => ("unknown", "mesh with `gmsh -2`"),
        };
        let problem = format!(
            "element {tag} is of gmsh's type {element_type} ({name}), not a triangle or quadrilateral of order 1 or 2; {mend}"
        );
        error_at(at, problem)
    }

    /// Reads the midpoint nodes of the second-order element `tag`, one for each of its `edges`.
    fn read_midpoints(
        &mut self,
        reader: &mut ByteReader,
        edges: &[[u64; 2]],
        tag: u64,
        at: usize,
    ) -> Result<()> {
        for &[a, b] in edges {
            let node = reader.tag("a node tag")?;
            if a == b {
                continue;
            }
            let first = *self.midpoints.entry([a.min(b), a.max(b)]).or_insert(node);
            if node != first {
                let problem = format!(
                    "element {tag} has node {node} between nodes {a} and {b}, where another \
                     element has node {first}: the mesh has a gap there, mend it"
                );
                return error_at(at, problem);
            }
        }
        Ok(())
    }
}

fn node_tags<const N: usize>(reader: &mut ByteReader) -> Result<[u64; N]> {
    let mut tags = [0; N];
    for tag in &mut tags {
        *tag = reader.tag("a node tag")?;
    }
    Ok(tags)
}
