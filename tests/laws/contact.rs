//! What a solution of the contact problem must be, whoever computes it.

use crate::support::{
    Random, close, close_relative, difference, distorted, history, largest, problem, run, shipped,
};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, State},
};

/// A bending L over an obstacle from which its arm partly lifts off, elastic and static.
fn lshape(step: &str, sets: &[&str]) -> ObservedProblem {
    let uniform = ["discretisation.displacement=1", "mesh.parameters.grading=1", "mesh.size=0.5"];
    let sets = [&uniform[..], &[step], sets].concat();
    shipped("lshape", &sets)
}

/// ½ uᵀKu − fᵀu and Ku − f at the state.
fn energy(problem: &ObservedProblem, state: &State, u: &[f64]) -> (f64, Vec<f64>) {
    let internal =
        problem.elasticity.internal_force(&problem.body, &problem.zeta_at_points(&state.zeta), u);
    let load = problem.loads.at(&problem.body, state.time);
    let energy = (0..u.len()).map(|i| (0.5 * internal[i] - load[i]) * u[i]).sum();
    (energy, internal.iter().zip(&load).map(|(r, f)| r - f).collect())
}

/// Makes u + v feasible: v = 0 on the clamp and (u + v)·ν ≤ g on Γ_C.
fn project(problem: &ObservedProblem, u: &[f64], v: &mut [f64]) {
    for [a, b] in &problem.body.mesh.curves["clamp"].edges {
        [a, b].into_iter().for_each(|&node| v[2 * node..2 * node + 2].fill(0.0));
    }
    for bound in &problem.constraints.bounds {
        let along = |w: &[f64]| {
            w[2 * bound.node] * bound.normal[0] + w[2 * bound.node + 1] * bound.normal[1]
        };
        let overlap = (along(u) + along(v) - bound.upper).max(0.0);
        for k in 0..2 {
            v[2 * bound.node + k] -= overlap * bound.normal[k];
        }
    }
}

#[test]
fn no_feasible_displacement_has_less_energy() {
    for solver in SOLVERS {
        let problem = lshape("time.step=1", &[]);
        let state = run(&problem, solver).last.state;
        let (least, residual) = energy(&problem, &state, &state.u);
        let (mut random, size) = (Random::new(11), largest(&state.u));
        let count = |active: bool| state.contact.iter().filter(|p| p.active == active).count();
        assert!(count(true) > 0 && count(false) > 0, "some nodes press and some gape");
        for scale in [1.0, 1e-1, 1e-2, 1e-3] {
            for _ in 0..50 {
                let mut v = random.field(state.u.len());
                v.iter_mut().for_each(|v| *v *= scale * size);
                project(&problem, &state.u, &mut v);
                // The variational inequality (26): (Ku − f)·v ≥ 0.
                let slope: f64 = residual.iter().zip(&v).map(|(r, v)| r * v).sum();
                assert!(slope >= -1e-9 * scale * least.abs(), "{solver}: {slope}");
                let moved: Vec<f64> = state.u.iter().zip(&v).map(|(u, v)| u + v).collect();
                let more = energy(&problem, &state, &moved).0 - least;
                assert!(more > 0.0, "{solver}: lower by {more}");
            }
        }
        // An active node moved into the obstacle does lower the energy: it is the
        // constraint that makes the minimum.
        let point = state.contact.iter().max_by(|a, b| a.force.total_cmp(&b.force)).unwrap();
        let mut inside = state.u.clone();
        inside[2 * point.node + 1] -= 1e-3 * size;
        assert!(energy(&problem, &state, &inside).0 < least);
    }
}

#[test]
fn more_load_presses_more() {
    // A load kt on a linear body whose contact set does not change with k: u and the
    // pressures are proportional to it (g = 0: the problem is positively homogeneous).
    for solver in SOLVERS {
        let problem = lshape("time.step=0.25", &["damage.lambda_u=0", "damage.lambda_d=0"]);
        let (steps, _) = history(&problem, solver);
        let last = &steps[4];
        assert!(largest(&steps[0].state.u) == 0.0, "no load at t = 0");
        for step in &steps[1..4] {
            let t = step.state.time;
            let scaled: Vec<f64> = last.state.u.iter().map(|u| t * u).collect();
            let error = difference(&step.state.u, &scaled);
            assert!(error < 1e-8, "{solver}: {error}");
            close_relative(step.record.contact_force, t * last.record.contact_force, 1e-8);
            close_relative(step.record.work, t * t * last.record.work, 1e-8);
        }
    }
}

#[test]
fn a_uniform_gap_closes_when_the_top_has_come_down_by_it() {
    // The top moves down by t, the gap is g = 0.35: free fall up to t = g, then uniaxial
    // compression ε_yy = −(t − g), σ_yy = E ε_yy in plane stress; E = 100.
    let text = "
        material = { young = 100, poisson = 0.3, plane = 'stress' }
        time = { end = 1, step = 0.05 }
        boundary = [
            { name = 'left', symmetry = true },
            { name = 'top', displacement = ['free', '-t'] },
            { name = 'bottom', gap = 0.35 },
        ]";
    for solver in SOLVERS {
        let problem = problem(distorted(5), text).unwrap();
        for step in history(&problem, solver).0 {
            let t = step.state.time;
            let (gap, pressure) = ((0.35 - t).max(0.0), 100.0 * (t - 0.35).max(0.0));
            for point in &step.state.contact {
                close(point.gap, gap, 1e-9);
                close(point.pressure, pressure, 1e-9);
            }
            close(step.record.contact_force, pressure, 1e-9);
            let nodes = if t > 0.36 { 6 } else { 0 };
            if (t - 0.35).abs() > 1e-9 {
                assert_eq!(step.record.active_nodes, nodes, "{solver} at t = {t}");
            }
        }
    }
}

#[test]
fn an_inclined_foundation_is_met_along_its_normal() {
    // The obstacle's direction ν = (3, −4)/5 is given: only u·ν ≤ g holds, and the reaction
    // has no part across ν. All of the bottom is pushed by (3, −4) per length.
    let text = "
        material = { young = 1000, poisson = 0.3, plane = 'stress' }
        boundary = [
            { name = 'top', displacement = [0, 0] },
            { name = 'bottom', gap = 0.001, normal = [3, -4], traction = [3, -4] },
        ]";
    for solver in SOLVERS {
        let problem = problem(distorted(6), text).unwrap();
        let state = run(&problem, solver).last.state;
        let (_, residual) = energy(&problem, &state, &state.u);
        assert!(state.contact.iter().filter(|p| p.active).count() > 2);
        for point in &state.contact {
            let (i, prescribed) = (2 * point.node, [0.6, -0.8]);
            if problem.body.mesh.nodes[point.node][1] > 0.0 {
                continue;
            }
            // f − Ku = p ν
            for k in 0..2 {
                close(-residual[i + k], point.force * prescribed[k], 1e-8);
            }
            let along = 0.6 * state.u[i] - 0.8 * state.u[i + 1];
            close(point.gap, 0.001 - along, 1e-12);
            assert!(point.gap > -1e-12, "{point:?}");
        }
    }
}

/// A clamped node at the end of a foundation keeps its place, and bears no contact force across the open gap there. Where the
/// whole gap stays open, the foundation changes nothing.
#[test]
fn a_clamp_at_the_end_of_an_open_gap_bears_no_contact_force() {
    let clamped = |bottom: &str| {
        let text = format!(
            "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'bottom', {bottom} }},
                {{ name = 'top', traction = [0, '-x'] }},
             ]"
        );
        problem(distorted(5), &text).unwrap()
    };
    for solver in SOLVERS {
        let alone = run(&clamped("traction = [0, 0]"), solver).last.state.u;
        for (gap, closes) in [("gap = 1", false), ("gap = 1e-3", true)] {
            let problem = clamped(gap);
            let last = run(&problem, solver).last;
            let clamp = problem.body.mesh.nodes.iter().position(|x| *x == [0.0, 0.0]).unwrap();
            assert!(last.state.contact.iter().all(|point| point.node != clamp), "{solver}, {gap}");
            let force = last.state.contact.iter().map(|point| point.force).sum();
            close(last.record.contact_force, force, 1e-12);
            let is_met = last.state.contact.iter().any(|point| point.active);
            assert_eq!(is_met, closes, "{solver}, {gap}");
            assert!(closes || difference(&last.state.u, &alone) < 1e-9, "{solver}, {gap}");
        }
    }
}
