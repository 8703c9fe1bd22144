//! Whether the mesh resolves the tractions on its edges.

use super::boundary_conditions::Traction;
use crate::{
    fem::gauss_points,
    mesh::Mesh,
    scene::{Expression, Scene},
};

/// Midpoints per edge of the finer quadrature.
const FINE: usize = 16;
/// A resultant is noted if it is further than this from the finer one, relative to ∫|f|.
const DIFFERENCE: f64 = 0.05;
/// Times at which a traction is sampled, about.
const TIMES: usize = 8;

/// A note if the resultant ∫f by the two Gauss points per edge of
/// [`add_traction`](crate::fem::add_traction) is far from ∫f by `FINE` midpoints per edge, relative
/// to the largest ∫|f| of all sampled times: then f varies within the edges, is lost or counts twice.
pub(super) fn unresolved(scene: &Scene, mesh: &Mesh, traction: &Traction) -> Option<String> {
    let f = &traction.force;
    if !f.iter().any(Expression::depends_on_space) {
        return None;
    }
    let mut times = scene.sample_times(TIMES);
    times.truncate(if f.iter().any(Expression::depends_on_time) { usize::MAX } else { 1 });
    // Points of an edge from p to q as parts of the way.
    let gauss = gauss_points([0.0; 2], [1.0, 0.0]).map(|[s, _]| s);
    let midpoints: [f64; FINE] = std::array::from_fn(|i| (i as f64 + 0.5) / FINE as f64);
    let (mut largest, mut worst) = (0.0_f64, (0.0, [0.0; 4], 0.0));
    for t in times {
        let [gx, gy, coarse] = integral(mesh, traction, &gauss, t);
        let [x, y, fine] = integral(mesh, traction, &midpoints, t);
        largest = largest.max(coarse).max(fine);
        let difference = (gx - x).hypot(gy - y);
        if difference > worst.0 {
            worst = (difference, [gx, gy, x, y], t);
        }
    }
    let (difference, resultants, t) = worst;
    (difference > DIFFERENCE * largest).then(|| {
        // What cancels leaves rounding.
        let rounded = |v: f64| if v.abs() > 1e-9 * largest { v } else { 0.0 };
        let [gx, gy, x, y] = resultants.map(rounded);
        let when = scene.time.map_or(String::new(), |_| format!(" at t = {t:.4e}"));
        format!(
            "the traction of boundary \"{}\" varies within the mesh's edges: its resultant on \
             this mesh is ({gx:.4e}, {gy:.4e}) N/m{when}, integrated finely ({x:.4e}, {y:.4e}); \
             refine there",
            traction.boundary
        )
    })
}

/// ∫f_x, ∫f_y and ∫|f| of a traction at time t, by equal weights at these parts of each edge.
fn integral(mesh: &Mesh, traction: &Traction, parts: &[f64], t: f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for &[a, b] in &traction.edges {
        let (p, q) = (mesh.nodes[a], mesh.nodes[b]);
        let weight = mesh.edge_normal([a, b]).1 / parts.len() as f64;
        for s in parts {
            let [x, y] = [0, 1].map(|k| p[k] + s * (q[k] - p[k]));
            let [fx, fy] = traction.force.each_ref().map(|f| f.eval(x, y, t));
            let values = [fx, fy, fx.hypot(fy)];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    sums
}
