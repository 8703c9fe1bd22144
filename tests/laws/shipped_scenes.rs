//! The shipped scenes, coarse and in few steps: all solvers agree, and the whole bridge is
//! twice its half.

use crate::support::{close, close_relative, difference, history, largest, shipped, shipped_names};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, Outcome, Step},
};
use std::collections::BTreeSet;

/// Overrides that make a shipped scene quick.
fn quick(name: &str) -> ObservedProblem {
    let sets: &[&str] = match name {
        // It breaks at t = 0.04 on this mesh, in the eighth of these steps.
        "square" => &["mesh.size=0.0625", "time.end=0.05", "time.step=0.005"],
        "hertz" => &["mesh.size=0.008"],
        "square-mild" | "square-table1" => &["mesh.size=0.0625", "time.step=0.1"],
        "lshape-rolling" => &["mesh.size=0.25", "time.step=0.05"],
        "beam" => &["mesh.size=0.125", "time.step=0.05"],
        _ => &["mesh.size=0.5", "mesh.parameters.grading=1", "time.step=0.1"],
    };
    shipped(name, &[sets, &["discretisation.displacement=1"]].concat())
}

/// The same with quadratic displacements.
fn quick_quadratic(name: &str) -> ObservedProblem {
    let sets: &[&str] = match name {
        "square" => &["mesh.size=0.125", "time.end=0.05", "time.step=0.005"],
        "hertz" => &["mesh.size=0.016", "mesh.parameters.grading=25"],
        "square-mild" | "square-table1" => &["mesh.size=0.125", "time.step=0.1"],
        "lshape-rolling" => &["mesh.size=0.5", "time.step=0.05"],
        "beam" => &["mesh.size=0.25", "time.step=0.1"],
        _ => &["mesh.size=1", "time.step=0.2"],
    };
    shipped(name, &[sets, &["discretisation.displacement=2"]].concat())
}

/// The steps and the outcome of each solver.
type Answers = [(Vec<Step>, Outcome); SOLVERS.len()];

/// All solvers give the same answer of this scene, which is returned.
fn agreed(name: &str, problem: &ObservedProblem) -> Answers {
    let all = SOLVERS.map(|solver| history(problem, solver));
    for (solver, (_, outcome)) in SOLVERS.iter().zip(&all) {
        assert!(outcome.kkt.within(1e-10), "{name}, {solver}: {}", outcome.kkt);
        assert_eq!(outcome.stopped.is_some(), name == "square", "{name}, {solver}");
    }
    let [(first, first_outcome), others @ ..] = &all;
    // A body that is lifted off has no contact force to be relative to.
    let force = first.iter().map(|step| step.record.contact_force).fold(0.0, f64::max);
    for (solver, (steps, outcome)) in SOLVERS[1..].iter().zip(others) {
        assert_eq!(steps.len(), first.len(), "{name}, {solver}");
        let stopped = |o: &Outcome| o.stopped.map(|stop| stop.time);
        assert_eq!(stopped(outcome), stopped(first_outcome), "{name}, {solver}");
        for (step, other) in steps.iter().zip(first) {
            if largest(&other.state.u) > 0.0 {
                let error = difference(&step.state.u, &other.state.u);
                assert!(error < 1e-8, "{name}, {solver}: u differs by {error:.1e}");
            }
            // Contact is solved to 1e-10 in each step, which a slender beam enlarges.
            for (a, b) in step.state.zeta.iter().zip(&other.state.zeta) {
                assert!((a - b).abs() < 1e-9, "{name}, {solver}: ζ is {a} and {b}");
            }
            let [found, expected] = [step, other].map(|s| s.record.contact_force / force);
            close(found, expected, 1e-8);
            assert_eq!(step.record.active_nodes, other.record.active_nodes, "{name}, {solver}");
        }
    }
    all
}

#[test]
fn all_solvers_agree_on_the_squares_and_the_disc() {
    let of_others = ["lshape", "lshape-rolling", "beam", "bridge", "bridge-half"];
    for name in shipped_names().iter().filter(|name| !of_others.contains(&name.as_str())) {
        agreed(name, &quick(name));
        agreed(name, &quick_quadratic(name));
    }
}

#[test]
fn contact_travels_where_a_scene_says_so() {
    // From no node to all of them and back; from part of them to all, to none, to part.
    for (name, turns) in [("lshape-rolling", "none all"), ("beam", "all none")] {
        agreed(name, &quick_quadratic(name));
        let problem = quick(name);
        let [(steps, _), ..] = agreed(name, &problem);
        let all = problem.constraints.bounds.len();
        let at = |nodes: usize| steps.iter().position(|s| s.record.active_nodes == nodes);
        let (first_all, first_none) = (at(all).expect(name), at(0).expect(name));
        assert_eq!(first_none < first_all, turns == "none all", "{name}");
        let active: BTreeSet<_> = steps.iter().map(|step| step.record.active_nodes).collect();
        assert!(active.len() >= 6, "{name}: the active nodes number {active:?}");
        let last = steps.last().expect("steps").record.active_nodes;
        assert!(0 < last && last < all, "{name} ends with {last} of {all} nodes active");
        if name == "beam" {
            // Under a wave it comes in several pieces.
            let x = |node: usize| problem.body.mesh.nodes[node][0];
            let pieces = |step: &Step| {
                let mut contact = step.state.contact.clone();
                contact.sort_by(|a, b| x(a.node).total_cmp(&x(b.node)));
                let pieces = contact.chunk_by(|a, b| a.active == b.active);
                pieces.filter(|piece| piece[0].active).count()
            };
            let counts: BTreeSet<_> = steps.iter().map(pieces).collect();
            assert!(counts.is_superset(&[0, 1, 2].into()), "{counts:?}");
        }
    }
}

/// The node of `problem` at a point.
fn node_at(problem: &ObservedProblem, [x, y]: [f64; 2]) -> usize {
    let near = |p: &[f64; 2]| (p[0] - x).hypot(p[1] - y) < 1e-8;
    problem.body.nodes.points.iter().position(near).unwrap_or_else(|| panic!("no node at {x}, {y}"))
}

#[test]
fn the_whole_bridge_is_symmetric_and_twice_its_half() {
    for quick in [quick, quick_quadratic] {
        let (whole, half) = (quick("bridge"), quick("bridge-half"));
        assert_eq!(whole.motions.free.len(), 1);
        assert!(half.motions.free.is_empty());
        let answers = agreed("bridge", &whole).into_iter().zip(agreed("bridge-half", &half));
        for (solver, ((_, full), (_, part))) in SOLVERS.iter().zip(answers) {
            let (full, part) = (full.last, part.last);
            let full_zeta = whole.body.at_nodes(&full.state.zeta);
            let part_zeta = half.body.at_nodes(&part.state.zeta);
            let size = largest(&full.state.u);
            let nodes = &whole.body.nodes.points;
            for (i, [x, y]) in nodes.iter().enumerate() {
                let m = node_at(&whole, [12.0 - x, *y]);
                let (u, v) = (&full.state.u[2 * i..2 * i + 2], &full.state.u[2 * m..2 * m + 2]);
                let error = (u[0] + v[0]).abs().max((u[1] - v[1]).abs());
                assert!(error < 1e-8 * size, "{solver}: asymmetric by {error:.1e} at ({x}, {y})");
                close(full_zeta[i], full_zeta[m], 1e-10);
            }
            for (i, x) in half.body.nodes.points.iter().enumerate() {
                let j = node_at(&whole, *x);
                for k in 0..2 {
                    let error = (part.state.u[2 * i + k] - full.state.u[2 * j + k]).abs();
                    assert!(error < 1e-8 * size, "{solver}: the half differs by {error:.1e}");
                }
                close(part_zeta[i], full_zeta[j], 1e-10);
            }
            // Nothing supports the bridge sideways: the answer given has ∫u_x = 0.
            let area: f64 = whole.body.nodes.weights.iter().sum();
            let drift: f64 =
                (0..nodes.len()).map(|i| whole.body.nodes.weights[i] * full.state.u[2 * i]).sum();
            assert!(drift.abs() < 1e-14 * area * size, "{drift}");
            // 80 N/m² over 4 m, at t = 1.
            close_relative(full.record.contact_force, 320.0, 1e-10);
            close_relative(part.record.contact_force, 160.0, 1e-10);
            close_relative(full.record.work, 2.0 * part.record.work, 1e-8);
        }
    }
}

/// Σ of all nodal residuals is minus the load: ∫f_N = (0, −80 t · 8).
#[test]
fn contact_and_clamp_together_carry_the_load_of_the_lshape() {
    for problem in [quick("lshape"), quick_quadratic("lshape")] {
        let edges = problem.body.edges(&problem.body.mesh.curves["clamp"].edges);
        let clamp: BTreeSet<usize> =
            edges.iter().flat_map(|edge| edge.ends.into_iter().chain(edge.middle)).collect();
        for (_, outcome) in agreed("lshape", &problem) {
            let state = outcome.last.state;
            let zeta = problem.zeta_at_points(&state.zeta);
            let internal = problem.elasticity.internal_force(&problem.body, &zeta, &state.u);
            let load = problem.loads.at(&problem.body, state.time);
            let reaction =
                |k: usize| clamp.iter().map(|i| internal[2 * i + k] - load[2 * i + k]).sum::<f64>();
            let contact: f64 = state.contact.iter().map(|point| point.force).sum();
            close_relative(reaction(1) + contact, 640.0, 1e-10);
            assert!(reaction(0).abs() < 1e-7, "{}", reaction(0));
            assert!(contact > 100.0 && reaction(1) > 100.0);
        }
    }
}
