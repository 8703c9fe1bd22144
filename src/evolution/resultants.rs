//! Whether the mesh resolves the tractions on its edges.

use crate::{
    fem::gauss_points,
    mesh::Mesh,
    scene::{Expression, Scene},
};

/// Midpoints an edge of the finer quadrature.
const FINE: usize = 16;
/// A resultant further than this from the finer one is told, relative to ∫|f|.
const DIFFERENCE: f64 = 0.05;
/// Times at which a traction is looked at, about.
const TIMES: usize = 8;

/// A note for each traction whose resultant ∫f by the two Gauss points an edge of
/// [`add_traction`](crate::fem::add_traction) is far from ∫f by `FINE` midpoints an edge, relative
/// to the largest ∫|f| of all sampled times: it varies within the edges, is lost or counts twice.
pub(super) fn unresolved(scene: &Scene, mesh: &Mesh) -> Vec<String> {
    let mut notes = Vec::new();
    for boundary in &scene.boundaries {
        let (Some(f), Some(curve)) = (boundary.traction(), mesh.curves.get(&boundary.name)) else {
            continue;
        };
        if !f.iter().any(Expression::depends_on_space) {
            continue;
        }
        let mut times = scene.sample_times(TIMES);
        times.truncate(if f.iter().any(Expression::depends_on_time) { usize::MAX } else { 1 });
        let (mut largest, mut worst) = (0.0_f64, (0.0, [0.0; 4], 0.0));
        for t in times {
            let [gx, gy, coarse] = integral(mesh, &curve.edges, gauss_points, f, t);
            let [x, y, fine] = integral(mesh, &curve.edges, midpoints, f, t);
            largest = largest.max(coarse).max(fine);
            let difference = (gx - x).hypot(gy - y);
            if difference > worst.0 {
                worst = (difference, [gx, gy, x, y], t);
            }
        }
        let (difference, sums, t) = worst;
        if difference > DIFFERENCE * largest {
            // What cancels leaves rounding.
            let [gx, gy, x, y] = sums.map(|v| if v.abs() > 1e-9 * largest { v } else { 0.0 });
            let when =
                if scene.time.is_some() { format!(" at t = {t:.4e}") } else { String::new() };
            notes.push(format!(
                "the traction of boundary \"{}\" varies within the mesh's edges: its resultant on \
                 this mesh is ({gx:.4e}, {gy:.4e}) N/m{when}, integrated finely ({x:.4e}, {y:.4e}); \
                 refine there",
                boundary.name
            ));
        }
    }
    notes
}

/// ∫f_x, ∫f_y and ∫|f| over `edges` at time t, by equal weights at `points` of an edge.
fn integral<const N: usize>(
    mesh: &Mesh,
    edges: &[[usize; 2]],
    points: impl Fn([f64; 2], [f64; 2]) -> [[f64; 2]; N],
    f: &[Expression; 2],
    t: f64,
) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for &[a, b] in edges {
        let weight = mesh.edge_normal([a, b]).1 / N as f64;
        for [x, y] in points(mesh.nodes[a], mesh.nodes[b]) {
            let [fx, fy] = [f[0].eval(x, y, t), f[1].eval(x, y, t)];
            let values = [fx, fy, fx.hypot(fy)];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    sums
}

/// The midpoints of `FINE` equal parts of the edge from `p` to `q`.
fn midpoints(p: [f64; 2], q: [f64; 2]) -> [[f64; 2]; FINE] {
    std::array::from_fn(|i| {
        let s = (i as f64 + 0.5) / FINE as f64;
        [p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]
    })
}
