//! What a `.msh` file says, before it is known to be a mesh of a plane body.

use std::collections::BTreeMap;

use super::{
    super::error::Problem,
    source::{Result, Source},
};

/// A node as listed.
pub(super) struct Node {
    pub(super) tag: u64,
    pub(super) point: [f64; 3],
    /// Byte where it is listed, for messages.
    pub(super) at: usize,
}

/// An element with N nodes in one physical group; listed once for each of its groups.
pub(super) struct Element<const N: usize> {
    pub(super) tag: u64,
    /// Tag of the physical group, 0 for none.
    pub(super) group: i32,
    /// Tag of the geometrical entity it was meshed on, 0 when unknown.
    pub(super) entity: i32,
    pub(super) nodes: [u64; N],
    /// Byte where it is listed, for messages.
    pub(super) at: usize,
}

/// The contents of a file that matter.
#[derive(Default)]
pub(super) struct Raw {
    /// Names of the physical curves by tag.
    pub(super) curve_names: BTreeMap<i32, String>,
    pub(super) nodes: Vec<Node>,
    pub(super) lines: Vec<Element<2>>,
    pub(super) triangles: Vec<Element<3>>,
    /// By gmsh's type number: how many elements nobody can use, and where the first is.
    pub(super) unusable: BTreeMap<i32, (usize, usize)>,
}

impl Raw {
    /// Reads the coordinates of a node.
    pub(super) fn push_node(&mut self, source: &mut Source, tag: u64, at: usize) -> Result<()> {
        let point = [source.real()?, source.real()?, source.real()?];
        if point.iter().any(|x| !x.is_finite()) {
            return source.fault(at, Problem::NotFinite(tag));
        }
        self.nodes.push(Node { tag, point, at });
        Ok(())
    }
}

/// What to do with the elements of one type.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Line,
    Triangle,
    /// Passed over.
    Point,
    /// Passed over and reported.
    Other,
}

/// The kind and number of nodes of gmsh's element type, or a fault if it is unknown.
pub(super) fn kind(source: &Source, at: usize, number: i32) -> Result<(Kind, usize)> {
    match number {
        1 => Ok((Kind::Line, 2)),
        2 => Ok((Kind::Triangle, 3)),
        15 => Ok((Kind::Point, 1)),
        _ => match OTHER.iter().find(|(other, ..)| *other == number) {
            Some((_, nodes, _)) => Ok((Kind::Other, *nodes)),
            None => source.fault(at, Problem::UnknownType(number.into())),
        },
    }
}

/// What gmsh's element type is called, in the plural.
pub(super) fn name(number: i32) -> &'static str {
    let found = OTHER.iter().find(|(other, ..)| *other == number);
    found.map_or("elements", |(.., name)| name)
}

/// The other element types gmsh writes in one to three dimensions: type, nodes, name.
const OTHER: [(i32, usize, &str); 28] = [
    (3, 4, "quadrangles"),
    (4, 4, "tetrahedra"),
    (5, 8, "hexahedra"),
    (6, 6, "prisms"),
    (7, 5, "pyramids"),
    (8, 3, "second-order lines"),
    (9, 6, "second-order triangles"),
    (10, 9, "second-order quadrangles"),
    (11, 10, "second-order tetrahedra"),
    (12, 27, "second-order hexahedra"),
    (13, 18, "second-order prisms"),
    (14, 14, "second-order pyramids"),
    (16, 8, "second-order quadrangles with 8 nodes"),
    (17, 20, "second-order hexahedra with 20 nodes"),
    (18, 15, "second-order prisms with 15 nodes"),
    (19, 13, "second-order pyramids with 13 nodes"),
    (20, 9, "third-order triangles with 9 nodes"),
    (21, 10, "third-order triangles"),
    (22, 12, "fourth-order triangles with 12 nodes"),
    (23, 15, "fourth-order triangles"),
    (24, 15, "fifth-order triangles with 15 nodes"),
    (25, 21, "fifth-order triangles"),
    (26, 4, "third-order lines"),
    (27, 5, "fourth-order lines"),
    (28, 6, "fifth-order lines"),
    (29, 20, "third-order tetrahedra"),
    (36, 16, "third-order quadrangles"),
    (37, 25, "fourth-order quadrangles"),
];
