//! Data that the nodes do not resolve. Prescribed displacements and the initial damage enter by their values at
//! nodes, and may vary more between them.

use crate::{
    ROUNDING,
    fem::{DamageSystem, GAUSS, POINTS, parabola, part_point, six_points},
    mesh::{Mesh, Order, distance, longest_side, midpoint, sorted},
    petsc::{PetscError, Session},
    problem::{
        DEVIATION, DiscreteProblem, NOTED, SAMPLE_TIMES, State, centroid, edge_parts,
        triangle_parts, triangle_point,
    },
    scene::{Condition, Expression, Scene},
};
use std::{
    collections::HashSet,
    f64::consts::{E, PI},
};

/// The fraction of the accuracy that the interpolation of the initial damage may take.
const INTERPOLATION_SHARE: f64 = 0.5;
/// Number of steps in which the missed initial damage diffuses. With more steps less of it is left.
const DIFFUSION_STEPS: usize = 8;
/// An edge shorter than this fraction of its curve is not halved: the displacement must jump there.
const SHORTEST: f64 = 1e-4;
/// Maximum number of triangle parts added for the integrals of the initial damage.
const MAX_ADDED: f64 = 100_000.0;

/// The edges that must be halved for a relative `accuracy` of the `state` at the end of a run, by their ends in increasing
/// order. The maximum |u| is `displacement`, m. There are two kinds:
///
/// - edges on which |u_D − Iu_D| exceeds `accuracy` · `displacement`, with Iu_D the nodal interpolation of u_D;
/// - the longest sides of the triangles with the largest ‖ζ₀ − Iζ₀‖_T in L². Diffusion smooths
///   what the nodes miss: the part q of ‖ζ₀ − Iζ₀‖² is left at the end. The
///   other triangles have q Σ ‖ζ₀ − Iζ₀‖²_T ≤ (½ `accuracy` ‖1 − ζ‖)².
///
/// Collective.
pub(crate) fn unresolved(
    session: &Session,
    problem: &DiscreteProblem,
    state: &State,
    accuracy: f64,
    displacement: f64,
) -> Result<HashSet<[usize; 2]>, PetscError> {
    let (scene, mesh, mut found) = (problem.scene(), problem.mesh(), HashSet::new());
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
    if let Some(missed) = missed_damage(scene, mesh).filter(|of| of.missed > 0.0) {
        let mut rest: f64 = missed.squares.iter().sum();
        let part = missed.at_end(session, problem, state)? / rest;
        let weighted = state.zeta.iter().zip(&problem.body.vertices.weights);
        let own = weighted.take(problem.body.vertices.partition.owned());
        let damage = own.map(|(zeta, weight)| weight * (1.0 - zeta).powi(2)).sum();
        let damage = problem.body.comm().total(damage);
        let allowed = (INTERPOLATION_SHARE * accuracy).powi(2) * damage / part;
        let mut largest: Vec<_> = missed.squares.iter().copied().enumerate().collect();
        largest.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        for (triangle, square) in largest {
            if rest <= allowed {
                break;
            }
            rest -= square;
            found.insert(longest_side(&mesh.nodes, mesh.triangles[triangle]).0);
        }
    }
    Ok(found)
}

/// |∫(ζ₀ − Iζ₀)|/|Ω|: the part of the mean initial damage that the nodes miss. The mesh that was bisected to measure the bars may
/// miss as much, so that their comparison does not show it.
pub(crate) fn missed_mean(problem: &DiscreteProblem) -> f64 {
    let missed = missed_damage(problem.scene(), problem.mesh());
    missed.map_or(0.0, |of| (of.integral - of.shown).abs() / problem.body.area)
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
                 up to {missed:.1e} {} of it is missed, of {largest:.1e} at most; refine the mesh there (explain penetration)",
                boundary.name, scene.units.length
            ));
        }
    }
    // With an accuracy the mesh resolves what is left of the initial damage at the end.
    let varies = |of: &MissedDamage| scene.accuracy.is_none() && of.missed > NOTED * of.integral;
    if let Some(damage) = missed_damage(scene, mesh).filter(varies) {
        let worst = (0..damage.squares.len())
            .max_by(|a, b| damage.squares[*a].total_cmp(&damage.squares[*b]));
        let corners = mesh.triangles[worst.unwrap_or(0)].map(|node| mesh.nodes[node]);
        let at = [0, 1].map(|k| corners.iter().map(|corner| corner[k]).sum::<f64>() / 3.0);
        let at = mesh.place(at);
        let shown = if damage.shown > 1e-9 * damage.integral { damage.shown } else { 0.0 };
        notes.push(format!(
            "the initial damage varies within the mesh's triangles near {at}: ∫(1 − ζ) is {:.3e} \
             on this mesh, integrated finely {:.3e}; refine the mesh there (explain penetration)",
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
    /// Per triangle: ‖ζ₀ − Iζ₀‖²_T, m², and ∫(ζ₀ − Iζ₀) λ_i with the barycentric coordinates λ_i, m².
    squares: Vec<f64>,
    loads: Vec<[f64; 3]>,
    /// ∫|ζ₀ − Iζ₀|, ∫(1 − ζ₀) and ∫(1 − Iζ₀), m².
    missed: f64,
    integral: f64,
    shown: f64,
}

impl MissedDamage {
    /// The square of the missed damage δ = ζ₀ − Iζ₀ in L² that is left in a `state` at the time t, m²:
    ///
    /// min(‖δ‖², ‖δ_N‖² + Σ_T min(1, d²/(2π²e κt)) ‖δ‖²_T),   t = N k.
    ///
    /// The first part is the one that the mesh shows: (M + kκL) δ_1 = (∫δφ_i), (M + kκL) δ_n = M δ_{n−1}. The second part is a
    /// bound on the rest, as far as its mean is zero in each triangle, of the diameter d: at most d/π times its norm is
    /// its norm in H⁻¹ (Payne and Weinberger, Arch. Ration. Mech. Anal. 5, 1960), and √λ e^(−λκt) ≤ 1/√(2eκt). Collective.
    fn at_end(
        &self,
        session: &Session,
        problem: &DiscreteProblem,
        state: &State,
    ) -> Result<f64, PetscError> {
        let (body, diffusions) = (&problem.body, problem.diffusions());
        let (vertices, whole) = (&body.vertices, self.squares.iter().sum());
        let (comm, owned) = (vertices.partition.comm(), vertices.partition.owned());
        let k = state.time / DIFFUSION_STEPS as f64;
        if diffusions.is_empty() || k <= 0.0 {
            return Ok(whole);
        }
        let mut load = vec![0.0; body.mesh.nodes.len()];
        for (nodes, &triangle) in body.mesh.triangles.iter().zip(&body.global_triangles) {
            let parts = nodes.iter().zip(self.loads[triangle]);
            parts.for_each(|(&node, part)| load[node] += part / k);
        }
        let mut system = DamageSystem::new(session, body, problem.mass(), &diffusions, k)?;
        system.factorise()?;
        let Some(mut shown) = system.correction(&load)? else { return Ok(whole) };
        for _ in 1..DIFFUSION_STEPS {
            if !system.advance(&vec![0.0; owned], &mut shown)? {
                return Ok(whole);
            }
        }
        let shown =
            shown.iter().zip(&vertices.weights).map(|(value, weight)| weight * value * value);
        let hidden = |t: usize| {
            let ([a, b], _) = longest_side(&body.mesh.nodes, body.mesh.triangles[t]);
            let diameter = distance(body.mesh.nodes[a], body.mesh.nodes[b]);
            let diffused = 2.0 * PI * PI * E * diffusions[body.material(t)] * state.time;
            (diameter * diameter / diffused).min(1.0) * self.squares[body.global_triangles[t]]
        };
        let left = shown.sum::<f64>() + (0..body.own_triangles).map(hidden).sum::<f64>();
        Ok(comm.total(left).min(whole))
    }
}

/// The interpolation error of the initial damage, without rounding; `None` if it is the same everywhere.
fn missed_damage(scene: &Scene, mesh: &Mesh) -> Option<MissedDamage> {
    let initial = &scene.damage.as_ref()?.initial;
    if !initial.depends_on_space() {
        return None;
    }
    let six = |triangle: &[usize; 3]| six_points(triangle.map(|node| mesh.nodes[node]));
    let triangles: Vec<_> = mesh.triangles.iter().map(six).collect();
    let at = |[x, y]: [f64; 2]| initial.eval(x, y, 0.0);
    let (squares, loads) = (vec![0.0; triangles.len()], vec![[0.0; 3]; triangles.len()]);
    let mut found = MissedDamage { squares, loads, missed: 0.0, integral: 0.0, shown: 0.0 };
    let f = (std::slice::from_ref(initial), 1.0);
    for part in triangle_parts(&triangles, f, &[0.0], MAX_ADDED).parts {
        let (triangle, corners) = part;
        let points = &triangles[triangle];
        let [a, b, c] = [points[0], points[1], points[2]].map(at);
        let weight = centroid(&triangles, &part).1 / 3.0;
        for point in POINTS.map(|point| part_point(&corners, point)) {
            let value = at(triangle_point(points, point));
            let shown = point[0] * a + point[1] * b + point[2] * c;
            let missed =
                Some(value - shown).filter(|missed| missed.abs() > ROUNDING).unwrap_or(0.0);
            found.squares[triangle] += weight * missed * missed;
            found.loads[triangle]
                .iter_mut()
                .zip(point)
                .for_each(|(sum, l)| *sum += weight * missed * l);
            found.missed += weight * missed.abs();
            found.integral += weight * (1.0 - value);
            found.shown += weight * (1.0 - shown);
        }
    }
    Some(found)
}
