//! Straight sides that are chords of smooth curves, as curved sides.
//!
//! Tangents that leave both ends of a side of length ℓ at the angles α and β to the chord, to the same side, give its middle the
//! offset ℓ/4 (tan(α/2) + tan(β/2)): exactly for a circle, and up to O(ℓ⁴) for other curves.

use super::{Lines, Mesh, SAME_DIRECTION, sorted};

impl Mesh {
    /// The mesh with midpoints of the sides that are chords of smooth curves, the boundary or the interfaces between surfaces
    /// ([`Lines`]), so that refined sides follow these curves; the same mesh if it has curved sides already. Where a curve would
    /// fold a triangle over, its sides stay straight. With notes on what is assumed, and on the sides that stay.
    pub fn on_smooth_curves(&self) -> (Self, Vec<String>) {
        let (mut mesh, surfaces) = (self.clone(), self.surfaces_of_triangles());
        if !self.curved.is_empty() {
            return (mesh, Vec::new());
        }
        let lines = Lines::new(self, |triangle| &surfaces[triangle]);
        let sides = lines.ends.iter().flat_map(|(&a, ends)| ends.iter().map(move |&b| [a, b]));
        for [a, b] in sides.filter(|[a, b]| a < b) {
            let ([nx, ny], length) = self.edge_normal([a, b]);
            let angles = [lines.angle(a, b), -lines.angle(b, a)];
            if angles.iter().any(|angle| angle.abs() > SAME_DIRECTION) {
                let offset =
                    -0.25 * length * angles.map(|angle| (0.5 * angle).tan()).iter().sum::<f64>();
                mesh.set_offset([a, b], [offset * nx, offset * ny]);
            }
        }
        let folds =
            |mesh: &Self, t: &[usize; 3]| mesh.is_curved(*t) && !mesh.jacobian_exceeds(0.0, *t);
        let mut folded = Vec::new();
        while let Some(&[a, b, c]) = self.triangles.iter().find(|triangle| folds(&mesh, triangle)) {
            for side in [[a, b], [b, c], [c, a]].map(sorted) {
                folded.extend(mesh.curved.remove(&side).map(|_| side));
            }
        }
        let stays = folded.first().map(|[a, _]| {
            format!(
                "{} curved sides stay straight, as at {}: their curves would fold triangles over; mesh finer there",
                folded.len(),
                self.place(self.nodes[*a])
            )
        });
        let notes = [self.assumed(&mesh), stays];
        (mesh, notes.into_iter().flatten().collect())
    }

    /// A note on the curved sides of a mesh without a geometry.
    fn assumed(&self, curved: &Self) -> Option<String> {
        let [a, _] = curved.curved.keys().next().filter(|_| self.points.is_empty())?;
        let is_curved = |edge: &[usize; 2]| curved.curved.contains_key(&sorted(*edge));
        let named = self.curves.iter().filter(|(_, of)| of.edges.iter().any(is_curved));
        let names = Vec::from_iter(named.map(|(name, _)| format!("`{name}`")));
        let at = format!("at {}", self.place(self.nodes[*a]));
        let which = if names.is_empty() { at } else { format!("of {}", names.join(", ")) };
        Some(format!(
            "the mesh has no geometry: the sides {which} are taken as smooth curves through their nodes; mesh with \
             elements of order 2 if this is not their shape"
        ))
    }
}
