//! Data that the nodes do not resolve. Prescribed displacements and the initial damage enter by their values at
//! nodes, and may vary more between them.

use super::loads::{
    DEVIATION, NOTED, SAMPLE_TIMES, centroid, edge_parts, triangle_parts, triangle_point,
};
use crate::{
    fem::{GAUSS, POINTS, parabola, part_point, six_points},
    mesh::{Mesh, Order, longest_side, midpoint, sorted},
    scene::{Condition, Expression, Scene},
};
use std::collections::HashSet;

/// The fraction of the accuracy that the interpolation of the initial damage may take.
const INTERPOLATION_SHARE: f64 = 0.5;
/// An edge shorter than this fraction of its curve is not halved: the displacement must jump there.
const SHORTEST: f64 = 1e-4;
/// Maximum number of triangle parts added for the integrals of the initial damage.
const MAX_ADDED: f64 = 100_000.0;

/// The edges that must be halved for a relative `accuracy`, by their ends in increasing order. The maximum |u| is
/// `displacement`, m. There are two kinds:
///
/// - edges on which |u_D − Iu_D| exceeds `accuracy` · `displacement`, with Iu_D the nodal interpolation of u_D;
/// - the longest sides of the triangles with the largest ‖ζ₀ − Iζ₀‖_T in L². The triangles left out have Σ
///   ‖ζ₀ − Iζ₀‖²_T ≤ (½ `accuracy` ‖1 − ζ₀‖)².
pub(crate) fn unresolved(
    scene: &Scene,
    mesh: &Mesh,
    accuracy: f64,
    displacement: f64,
) -> HashSet<[usize; 2]> {
    let mut found = HashSet::new();
    for boundary in &scene.boundaries {
        let edges = mesh.edges_of(&boundary.name);
        let length = |edge: &[usize; 2]| mesh.edge_normal(*edge).1;
        let shortest = SHORTEST * edges.iter().map(length).sum::<f64>();
        for u in displacements(&boundary.conditions) {
            let missed = missed_displacements(scene, mesh, edges, u).0;
            let lost = edges.iter().zip(missed).filter(|(edge, missed)| {
                *missed > accuracy * displacement && length(edge) > shortest
            });
            found.extend(lost.map(|(edge, _)| sorted(*edge)));
        }
    }
    if let Some(damage) = missed_damage(scene, mesh) {
        let allowed = INTERPOLATION_SHARE * accuracy;
        let mut largest: Vec<_> = damage.squares.iter().copied().enumerate().collect();
        largest.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let mut rest: f64 = damage.squares.iter().sum();
        for (triangle, square) in largest {
            if rest <= allowed * allowed * damage.square {
                break;
            }
            rest -= square;
            found.insert(longest_side(&mesh.nodes, mesh.triangles[triangle]).0);
        }
    }
    found
}

/// Notes on prescribed displacements and initial damage that vary much between the nodes.
pub(super) fn notes(scene: &Scene, mesh: &Mesh) -> Vec<String> {
    let mut notes = Vec::new();
    for boundary in &scene.boundaries {
        let edges = mesh.edges_of(&boundary.name);
        for u in displacements(&boundary.conditions) {
            let (missed, largest) = missed_displacements(scene, mesh, edges, u);
            let worst = missed.into_iter().zip(edges).max_by(|(a, _), (b, _)| a.total_cmp(b));
            let Some((missed, edge)) = worst.filter(|worst| worst.0 > NOTED * largest) else {
                continue;
            };
            let at = mesh.place(mesh.midpoint(*edge));
            notes.push(format!(
                "the displacement of boundary \"{}\" varies within the mesh's edges near {at}: \
                 up to {missed:.1e} {} of it is missed, of {largest:.1e} at most; refine there",
                boundary.name, scene.units.length
            ));
        }
    }
    if let Some(damage) = missed_damage(scene, mesh).filter(|d| d.missed > NOTED * d.integral) {
        let worst = (0..damage.squares.len())
            .max_by(|a, b| damage.squares[*a].total_cmp(&damage.squares[*b]));
        let corners = mesh.triangles[worst.unwrap_or(0)].map(|node| mesh.nodes[node]);
        let at = [0, 1].map(|k| corners.iter().map(|corner| corner[k]).sum::<f64>() / 3.0);
        let at = mesh.place(at);
        let shown = if damage.shown > 1e-9 * damage.integral { damage.shown } else { 0.0 };
        notes.push(format!(
            "the initial damage varies within the mesh's triangles near {at}: ∫(1 − ζ) is {:.3e} \
             on this mesh, integrated finely {:.3e}; refine there",
            shown, damage.integral
        ));
    }
    notes
}

/// The components of prescribed displacements that depend on the place.
fn displacements(conditions: &[Condition]) -> impl Iterator<Item = &Expression> {
    let prescribed = conditions.iter().filter(|of| matches!(of, Condition::Displacement(_)));
    prescribed.flat_map(Condition::expressions).flatten().filter(|u| u.depends_on_space())
}

/// Per edge of a curve: max |u_D − Iu_D| at some times, m. Then the maximum |u_D| of all edges, m.
fn missed_displacements(
    scene: &Scene,
    mesh: &Mesh,
    edges: &[[usize; 2]],
    u: &Expression,
) -> (Vec<f64>, f64) {
    let line = |edge: &[usize; 2]| {
        let [p, q] = edge.map(|node| mesh.nodes[node]);
        [p, if scene.order == Order::Linear { midpoint(p, q) } else { mesh.midpoint(*edge) }, q]
    };
    let lines: Vec<_> = edges.iter().map(line).collect();
    let mut times = scene.sample_times(SAMPLE_TIMES);
    times.truncate(if u.depends_on_time() { usize::MAX } else { 1 });
    let (mut missed, mut largest) = (vec![0.0_f64; lines.len()], 0.0_f64);
    for t in times {
        let at = |edge: usize, s: f64| {
            let [x, y] = parabola(lines[edge], s);
            u.eval(x, y, t)
        };
        for (edge, [from, to]) in edge_parts(&lines, std::slice::from_ref(u), t, DEVIATION).parts {
            let [a, m, b] = [0.0, 0.5, 1.0].map(|s| at(edge, s));
            let middle = if scene.order == Order::Linear { 0.5 * (a + b) } else { m };
            for s in [GAUSS[0], 0.5, GAUSS[1]].map(|s| from + s * (to - from)) {
                let (value, [shown]) = (at(edge, s), parabola([[a], [middle], [b]], s));
                missed[edge] = missed[edge].max((value - shown).abs());
                largest = largest.max(value.abs());
            }
        }
    }
    (missed, largest)
}

/// How far the initial damage is from its interpolation at the vertices.
struct MissedDamage {
    /// ‖ζ₀ − Iζ₀‖²_T of each triangle, and ‖1 − ζ₀‖², m².
    squares: Vec<f64>,
    square: f64,
    /// ∫|ζ₀ − Iζ₀|, ∫(1 − ζ₀) and ∫(1 − Iζ₀), m².
    missed: f64,
    integral: f64,
    shown: f64,
}

/// The interpolation error of the initial damage; `None` if it is the same everywhere.
fn missed_damage(scene: &Scene, mesh: &Mesh) -> Option<MissedDamage> {
    let initial = &scene.damage.as_ref()?.initial;
    if !initial.depends_on_space() {
        return None;
    }
    let six = |triangle: &[usize; 3]| six_points(triangle.map(|node| mesh.nodes[node]));
    let triangles: Vec<_> = mesh.triangles.iter().map(six).collect();
    let at = |[x, y]: [f64; 2]| initial.eval(x, y, 0.0);
    let squares = vec![0.0; triangles.len()];
    let mut found = MissedDamage { squares, square: 0.0, missed: 0.0, integral: 0.0, shown: 0.0 };
    let f = (std::slice::from_ref(initial), 1.0);
    for part in triangle_parts(&triangles, f, &[0.0], MAX_ADDED).parts {
        let (triangle, corners) = part;
        let points = &triangles[triangle];
        let [a, b, c] = [points[0], points[1], points[2]].map(at);
        let weight = centroid(&triangles, &part).1 / 3.0;
        for point in POINTS.map(|point| part_point(&corners, point)) {
            let value = at(triangle_point(points, point));
            let shown = point[0] * a + point[1] * b + point[2] * c;
            found.squares[triangle] += weight * (value - shown).powi(2);
            found.square += weight * (1.0 - value).powi(2);
            found.missed += weight * (value - shown).abs();
            found.integral += weight * (1.0 - value);
            found.shown += weight * (1.0 - shown);
        }
    }
    Some(found)
}
