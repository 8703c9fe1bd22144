//! Rigid motions that neither supports nor contact prevent: in all units, for discs in bores, and with gaps of rounding.

use crate::support::{difference, moved, problem, run, square, turn};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, SetupError},
    mesh::{Curve, Mesh},
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

fn bounded(mesh: Mesh, boundaries: &str) -> Result<ObservedProblem, SetupError> {
    problem(mesh, &format!("{MATERIAL}\nboundary = [{boundaries}]"))
}

#[test]
fn what_is_free_does_not_depend_on_units() {
    for length in [1.0, 1e3, 1e-3] {
        let decided = |boundaries: &str| {
            let mesh = moved(square(4), |[x, y]| [length * (x + 3.0), length * y]);
            match bounded(mesh, &format!("{{ name = 'bottom', gap = 0 }}, {boundaries}")) {
                Ok(problem) => Some((problem.motions.free.len(), problem.motions.resisted.len())),
                Err(SetupError::Driven { .. }) => None,
                Err(other) => panic!("{other}"),
            }
        };
        assert_eq!(decided("{ name = 'top', traction = [0, -1] }"), Some((1, 2)));
        assert_eq!(decided("{ name = 'top', traction = ['sin(pi)', -1] }"), Some((1, 2)));
        assert_eq!(decided("{ name = 'top', traction = [1e-6, -1] }"), None);
        assert_eq!(decided("{ name = 'left', symmetry = true }"), Some((0, 1)));
        assert_eq!(decided("{ name = 'left', displacement = [0, 0] }"), Some((0, 0)));
    }
}

/// A disc of radius 1 around (3, 2), its rim cut into `n` edges equal up to `uneven`, in `curves`
/// curves.
pub fn disc(n: usize, uneven: f64, curves: usize) -> Mesh {
    let (rings, centre) = (n / 6, [3.0, 2.0]);
    let point = |ring: usize, i: usize| {
        let angle = std::f64::consts::TAU * (i as f64 + uneven * (7.0 * i as f64).sin()) / n as f64;
        let [x, y] = turn(angle, [ring as f64 / rings as f64, 0.0]);
        [centre[0] + x, centre[1] + y]
    };
    let node = |ring: usize, i: usize| 1 + (ring - 1) * n + i % n;
    let mut triangles: Vec<_> = (0..n).map(|i| [0, node(1, i), node(1, i + 1)]).collect();
    for (ring, i) in (1..rings).flat_map(|ring| (0..n).map(move |i| (ring, i))) {
        let [a, b] = [node(ring, i), node(ring, i + 1)];
        let [c, d] = [node(ring + 1, i), node(ring + 1, i + 1)];
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    let arc = |k: usize| {
        let edges =
            (k * n / curves..(k + 1) * n / curves).map(|i| [node(rings, i), node(rings, i + 1)]);
        (format!("rim{k}"), Curve { edges: edges.collect(), other_edges: 0 })
    };
    Mesh {
        nodes: std::iter::once(centre)
            .chain(
                (1..=rings)
                    .flat_map(|ring| (0..n).map(move |i| (ring, i)))
                    .map(|(r, i)| point(r, i)),
            )
            .collect(),
        triangles,
        curves: (0..curves).map(arc).collect(),
        ..Mesh::default()
    }
}

#[test]
fn a_disc_in_a_bore_turns_freely_although_its_edges_are_only_nearly_equal() {
    // gmsh cuts a circle into edges equal to 1e-8, in one curve or several.
    for (uneven, curves) in [(0.0, 1), (1e-8, 1), (1e-8, 4), (1e-6, 3)] {
        for length in [1.0, 1e3, 1e-3] {
            let rims = (0..curves).map(|k| format!("{{ name = 'rim{k}', gap = 0 }},"));
            let text = format!(
                "{MATERIAL}\nbody = {{ force = [0, -1] }}\nboundary = [{}]",
                rims.collect::<String>()
            );
            let mesh = moved(disc(24, uneven, curves), |x| x.map(|v| length * v));
            let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((problem.motions.free.len(), problem.motions.resisted.len()), (1, 2));
            assert!(problem.motions.free[0].to_string().starts_with("the rotation about"));
            // The bore leaves the motion exactly free.
            let field = problem.motions.free[0].field(&problem.body);
            for bound in &problem.constraints.bounds {
                let [nx, ny] = bound.normal;
                let slope = field[2 * bound.node] * nx + field[2 * bound.node + 1] * ny;
                assert!(slope.abs() < 1e-13, "{slope}");
            }
            if length == 1.0 && uneven == 1e-6 {
                let answers = SOLVERS.map(|solver| run(&problem, solver));
                assert!(answers.iter().all(|answer| answer.kkt.within(1e-10)));
                for other in &answers[1..] {
                    let apart = difference(&other.last.state.u, &answers[0].last.state.u);
                    assert!(apart < 1e-8, "{uneven}, {curves}: {apart}");
                }
            }
        }
    }
}

#[test]
fn a_keyway_or_a_flat_stops_the_disc() {
    // One node of the rim out of place by a hundredth.
    let mut mesh = disc(24, 0.0, 1);
    let rim = mesh.curves["rim0"].edges[5][0];
    mesh.nodes[rim][0] += 0.01;
    let problem = bounded(mesh, "{ name = 'rim0', gap = 0 }").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((problem.motions.free.len(), problem.motions.resisted.len()), (0, 3));
}

#[test]
fn a_gap_below_zero_by_rounding_is_none() {
    let gap = |gap: &str| {
        let pressed = "{ name = 'top', traction = [0, -1] }, { name = 'left', symmetry = true }";
        let clamped = "{ name = 'right', displacement = ['free', 0] }";
        bounded(square(3), &format!("{pressed}, {clamped}, {{ name = 'bottom', gap = {gap} }}"))
    };
    let (none, rounding) = (gap("0").unwrap(), gap("'0.3-0.1*3'").unwrap());
    assert!(rounding.constraints.bounds.iter().all(|bound| bound.upper == 0.0));
    for solver in SOLVERS {
        let [a, b] = [&none, &rounding].map(|problem| run(problem, solver).last.state.u);
        assert!(difference(&a, &b) < 1e-10);
    }
    // The right end of the bottom is prescribed.
    assert!(matches!(gap("-1e-9"), Err(SetupError::Constraint { .. })));
}
