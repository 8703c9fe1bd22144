//! A body that turns over on a point: its last contact.

use crate::problem::{Collapse, DiscreteProblem};

impl DiscreteProblem {
    /// The collapse, if the contact shrinks to a point just before it: the motion is a rotation v that opens nearly all
    /// of Γ_C, v·ν < 0. Displacements and stresses then grow as the mesh is refined. A bearing in which the body turns
    /// stays in contact.
    pub fn collapse_on_a_point(&self) -> Option<Collapse> {
        /// Slower motions away from an edge do not open it, relative to the fastest motion.
        const OPENING: f64 = 0.005;
        /// The contact remains if this part of Γ_C does not open.
        const REMAINS: f64 = 0.1;
        let mesh = self.mesh();
        let motion = self.collapse?.motion;
        let speed = |&[x, y]: &[f64; 2]| x.hypot(y);
        let speeds = mesh.nodes.iter().map(|&node| speed(&motion.at(node)));
        let slow = OPENING * speeds.fold(0.0, f64::max);
        let (mut remains, mut all) = (0.0, 0.0);
        for boundary in &self.scene().boundaries {
            let Some(gap) = boundary.gap() else { continue };
            for &edge in mesh.edges_of(&boundary.name) {
                let [a, b] = edge.map(|node| motion.at(mesh.nodes[node]));
                let (normal, length) = mesh.edge_normal(edge);
                let [x, y] = gap.normal.unwrap_or(normal);
                let opens = -0.5 * ((a[0] + b[0]) * x + (a[1] + b[1]) * y);
                all += length;
                remains += if opens <= slow { length } else { 0.0 };
            }
        }
        self.collapse.filter(|_| motion.is_rotation() && remains < REMAINS * all)
    }
}
