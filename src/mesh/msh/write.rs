//! Writes a mesh as text in MSH 4.1. gmsh and our reader read the same mesh from it.

use crate::mesh::{Mesh, sides, sorted};
use std::collections::BTreeMap;

/// gmsh's element types: lines and triangles with straight and with curved sides.
const LINES: [u8; 2] = [1, 8];
const TRIANGLES: [u8; 2] = [2, 9];

impl Mesh {
    /// The text of an MSH file. If any edge is curved, all elements are of second order. Each curve is an
    /// entity, and so are each combination of surfaces that triangles belong to and each point of the geometry.
    pub fn to_msh(&self) -> String {
        let midpoints = if self.curved.is_empty() { Vec::new() } else { self.midpoints() };
        let (surfaces, groups): (Vec<&str>, _) = match self.surfaces.is_empty() {
            true => (vec!["body"], vec![vec![0]; self.triangles.len()]),
            false => {
                (self.surfaces.keys().map(|name| &**name).collect(), self.surfaces_of_triangles())
            }
        };
        let mut names = String::new();
        for (group, name) in (1..).zip(self.curves.keys()) {
            names += &format!("1 {group} \"{name}\"\n");
        }
        for (group, name) in (1..).zip(&surfaces) {
            names += &format!("2 {group} \"{name}\"\n");
        }
        let mut entities: BTreeMap<&[usize], usize> = BTreeMap::new();
        for groups in &groups {
            let next = entities.len() + 1;
            entities.entry(groups).or_insert(next);
        }
        // An entity: tag, bounding box (unused), physical groups, no boundary.
        let entity = |tag: usize, groups: &[usize]| {
            let listed: String = groups.iter().map(|group| format!(" {}", group + 1)).collect();
            format!("{tag} 0 0 0 0 0 0 {}{listed} 0\n", groups.len())
        };
        let lines: String =
            (0..self.curves.len()).map(|curve| entity(curve + 1, &[curve])).collect();
        let faces: String = entities.iter().map(|(groups, &tag)| entity(tag, groups)).collect();

        let at = self.nodes.iter().chain(midpoints.iter().map(|(_, point)| point));
        let at: Vec<String> = at.map(|[x, y]| format!("{x} {y} 0")).collect();
        // Nodes keep their order. Each block: dimension, entity, first node and the node after the last one.
        let (mut corners, mut blocks, mut next) = (String::new(), Vec::new(), 0);
        for (tag, &node) in (1..).zip(&self.points) {
            corners += &format!("{tag} {} 0\n", at[node]);
            blocks.extend([[2, 1, next, node], [0, tag, node, node + 1]]);
            next = node + 1;
        }
        blocks.push([2, 1, next, at.len()]);
        blocks.retain(|[.., first, end]| first < end);

        let mut text = format!(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n{names}$EndPhysicalNames\n\
             $Entities\n{} {} {} 0\n{corners}{lines}{faces}$EndEntities\n$Nodes\n{} {count} 1 {count}\n",
            self.curves.len() + surfaces.len(),
            self.points.len(),
            self.curves.len(),
            entities.len(),
            blocks.len(),
            count = at.len(),
        );
        for [dimension, entity, first, end] in blocks {
            text += &format!("{dimension} {entity} 0 {}\n", end - first);
            (first..end).for_each(|node| text += &format!("{}\n", node + 1));
            at[first..end].iter().for_each(|at| text += &format!("{at}\n"));
        }
        let gmsh =
            self.gmsh.iter().map(|version| format!("$Comments\ngmsh {version}\n$EndComments\n"));
        text +=
            &format!("$EndNodes\n{}$EndElements\n", self.elements(&midpoints, &groups, &entities));
        text + &gmsh.collect::<String>()
    }

    /// `$Elements` without its last line. Triangles keep their order. Consecutive triangles of the same
    /// surfaces make a block.
    fn elements(
        &self,
        midpoints: &[([usize; 2], [f64; 2])],
        groups: &[Vec<usize>],
        entities: &BTreeMap<&[usize], usize>,
    ) -> String {
        let order = usize::from(!midpoints.is_empty());
        let middle = |edge: [usize; 2]| {
            let found = midpoints.binary_search_by_key(&sorted(edge), |(edge, _)| *edge);
            found.ok().map(|i| self.nodes.len() + i)
        };
        let (mut blocks, mut tag, mut text) = (0, 0, String::new());
        let mut begin =
            |text: &mut String, [dimension, entity]: [usize; 2], kind: u8, count: usize| {
                blocks += 1;
                *text += &format!("{dimension} {entity} {kind} {count}\n");
            };
        let mut add = |text: &mut String, nodes: &mut dyn Iterator<Item = usize>| {
            tag += 1;
            *text += &tag.to_string();
            nodes.for_each(|node| *text += &format!(" {}", node + 1));
            text.push('\n');
        };
        for (entity, curve) in (1..).zip(self.curves.values()) {
            begin(&mut text, [1, entity], LINES[order], curve.edges.len());
            for &[a, b] in &curve.edges {
                add(&mut text, &mut [a, b].into_iter().chain(middle([a, b])));
            }
        }
        let mut triangles = self.triangles.iter();
        for run in groups.chunk_by(|a, b| a == b) {
            begin(&mut text, [2, entities[&*run[0]]], TRIANGLES[order], run.len());
            for &[a, b, c] in triangles.by_ref().take(run.len()) {
                let sides = [[a, b], [b, c], [c, a]].into_iter().filter_map(middle);
                add(&mut text, &mut [a, b, c].into_iter().chain(sides));
            }
        }
        format!("$Elements\n{blocks} {tag} 1 {tag}\n{text}")
    }

    /// The midpoints, m, of all edges, sorted by their ends in increasing order.
    fn midpoints(&self) -> Vec<([usize; 2], [f64; 2])> {
        let mut edges: Vec<_> =
            sides(&self.triangles).into_iter().map(|side| side.edge()).collect();
        edges.dedup();
        edges.into_iter().map(|edge| (edge, self.midpoint(edge))).collect()
    }
}
