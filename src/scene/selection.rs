//! Boundaries that a scene selects by their place, with `where`.

use super::{Scene, SceneError, check::boundary_key};
use crate::{
    fem::parabola,
    mesh::{Curve, Mesh, bounds},
};
use std::collections::BTreeSet;

/// The number of parts of an edge in which `where` must agree.
const PARTS: u32 = 100;

impl Scene {
    /// Names the edges of `mesh` at whose midpoints the `where` of a boundary is true. Refined meshes keep these names.
    ///
    /// # Errors
    /// A boundary has no edges, other ones than the physical curve of its name, or, for an accuracy, an end within an edge.
    pub fn name_edges(&self, mesh: &mut Mesh) -> Result<(), SceneError> {
        let mut problems = Vec::new();
        let outer = mesh.boundary_edges();
        let middles: Vec<_> = outer.iter().map(|&edge| mesh.midpoint(edge)).collect();
        for boundary in &self.boundaries {
            let Some(selection) = &boundary.selection else { continue };
            let key = boundary_key(&boundary.name, "where");
            problems.extend(self.check(&key, selection, &middles, &[0.0], ("", &|_| true)));
            let is_true = |&[a, b]: &[usize; 2], s: f64| {
                let [x, y] = parabola([mesh.nodes[a], mesh.midpoint([a, b]), mesh.nodes[b]], s);
                selection.eval(x, y, 0.0) != 0.0
            };
            let is_cut = |edge: &&[usize; 2]| {
                let in_part = |part: u32| is_true(edge, (f64::from(part) + 0.5) / f64::from(PARTS));
                (1..PARTS).any(|part| in_part(part) != in_part(0))
            };
            let edges: BTreeSet<_> = outer.iter().copied().filter(|e| is_true(e, 0.5)).collect();
            let curve = mesh.curves.get(&boundary.name).map(|curve| &curve.edges);
            if edges.is_empty() {
                let [x, y] = bounds(&middles);
                let [low, high] = [0, 1].map(|i| mesh.place([x[i], y[i]]));
                let none =
                    format!("is true at no midpoint of the edges, which lie from {low} to {high}");
                problems.push(self.at_key(&key, &none));
            } else if curve.is_some_and(|curve| edges != curve.iter().copied().collect()) {
                let others = "is true at other edges than those of the physical curve of this name; rename the boundary, \
                              or leave out where";
                problems.push(self.at_key(&key, others));
            } else if let Some(edge) = outer.iter().find(is_cut) {
                let [a, b] = edge.map(|node| mesh.place(mesh.nodes[node]));
                let cut = format!(
                    "changes within the edge from {a} to {b}, and a boundary ends at nodes: let it end at one (a point of \
                     the geometry), or make its tolerance smaller"
                );
                match self.accuracy {
                    Some(_) => problems.push(self.at_key(&key, &cut)),
                    None => mesh.notes.push(format!("{key} {cut}")),
                }
            }
            let edges = edges.into_iter().collect();
            mesh.curves.insert(boundary.name.clone(), Curve { edges, other_edges: 0 });
        }
        self.text.refuse(problems)
    }
}
