//! Writes a mesh as text in MSH 2.2, which gmsh and our reader turn into the same mesh again.

use crate::mesh::{Mesh, sides, sorted};
use std::fmt::Write;

/// gmsh's element types: lines and triangles with straight and with curved sides.
const LINES: [u8; 2] = [1, 8];
const TRIANGLES: [u8; 2] = [2, 9];

impl Mesh {
    /// The text of an MSH file. Where an edge is curved, all elements are of second order.
    pub fn to_msh(&self) -> String {
        let order = usize::from(!self.curved.is_empty());
        let midpoints = if order == 1 { self.midpoints() } else { Vec::new() };
        let middle = |edge: [usize; 2]| {
            let found = midpoints.binary_search_by_key(&sorted(edge), |(edge, _)| *edge);
            found.ok().map(|i| self.nodes.len() + i)
        };

        let mut elements = Vec::new();
        let mut names = String::new();
        let surfaces: Vec<(&str, Vec<usize>)> = match self.surfaces.is_empty() {
            true => vec![("body", (0..self.triangles.len()).collect())],
            false => self.surfaces.iter().map(|(name, t)| (&**name, t.clone())).collect(),
        };
        for (group, (name, curve)) in (surfaces.len() + 1..).zip(&self.curves) {
            names += &format!("1 {group} \"{name}\"\n");
            for &[a, b] in &curve.edges {
                let nodes = [Some(a), Some(b), middle([a, b])];
                let nodes: Vec<usize> = nodes.into_iter().flatten().collect();
                elements.push((LINES[order], [group, group], nodes));
            }
        }
        // Triangle by triangle, so that they are read in their order, once for each surface.
        let mut groups = vec![Vec::new(); self.triangles.len()];
        for (group, (name, triangles)) in (1..).zip(&surfaces) {
            names += &format!("2 {group} \"{name}\"\n");
            triangles.iter().for_each(|&t| groups[t].push(group));
        }
        for (&[a, b, c], groups) in self.triangles.iter().zip(groups) {
            let sides = [[a, b], [b, c], [c, a]].into_iter().filter_map(middle);
            let nodes: Vec<usize> = [a, b, c].into_iter().chain(sides).collect();
            let of = |group| (TRIANGLES[order], [group, 1], nodes.clone());
            elements.extend(groups.into_iter().map(of));
        }

        let points = self.nodes.iter().chain(midpoints.iter().map(|(_, point)| point));
        let mut text = format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n{names}\
             $EndPhysicalNames\n$Nodes\n{}\n",
            self.curves.len() + surfaces.len(),
            self.nodes.len() + midpoints.len()
        );
        for (number, [x, y]) in (1..).zip(points) {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{number} {x} {y} 0");
        }
        let _ = write!(text, "$EndNodes\n$Elements\n{}\n", elements.len());
        for (number, (kind, [group, entity], nodes)) in (1..).zip(&elements) {
            let nodes: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
            let _ = writeln!(text, "{number} {kind} 2 {group} {entity} {}", nodes.join(" "));
        }
        text + "$EndElements\n"
    }

    /// The midpoints, m, of all edges, sorted by their ends in increasing order.
    fn midpoints(&self) -> Vec<([usize; 2], [f64; 2])> {
        let mut edges: Vec<_> = sides(&self.triangles).into_iter().map(|side| side.edge).collect();
        edges.dedup();
        edges.into_iter().map(|edge| (edge, self.midpoint(edge))).collect()
    }
}
