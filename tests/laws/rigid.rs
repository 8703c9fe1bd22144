//! Rigid motions: which are prevented, which only contact resists, which the load drives.

use crate::{
    free_motions::disc,
    support::{
        close, difference, distorted, largest, moved, problem, run, square, turn, with_part,
    },
};
use nalgebra::{DMatrix, DVector};
use signorini::{
    contact::{
        ContactError, ContactProblem, ContactReport, ContactSolver, NodalConstraint, RigidMotions,
        RowLaw, SOLVERS, nonnegative,
    },
    estimate::Simulation,
    evolution::{ObservedProblem, RunError, SetupError},
    fem::{Body, RigidMotion},
    linear::LinearSolver,
    mesh::{Mesh, Order, Refinement},
    petsc::{Session, Vector},
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

fn bounded(mesh: Mesh, boundaries: &str) -> Result<ObservedProblem, SetupError> {
    of_order(1, mesh, boundaries)
}

/// The same with displacements of this order.
fn of_order(order: u8, mesh: Mesh, boundaries: &str) -> Result<ObservedProblem, SetupError> {
    let text = format!("discretisation.displacement = {order}\n{MATERIAL}");
    problem(mesh, &format!("{text}\nboundary = [{boundaries}]"))
}

/// The motions of a scene that stands.
fn motions(mesh: Mesh, boundaries: &str) -> RigidMotions {
    bounded(mesh, boundaries).unwrap_or_else(|e| panic!("{e}")).motions.clone()
}

/// The motion that the load drives, in words.
#[track_caller]
fn driven(order: u8, mesh: Mesh, boundaries: &str) -> String {
    match of_order(order, mesh, boundaries) {
        Err(SetupError::Driven { source, .. }) => source.motion.to_string(),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the load was accepted"),
    }
}

/// The square with two more curves: the parts of the top and the bottom within `foot` and
/// `load` in x.
fn footed(foot: [f64; 2], load: [f64; 2]) -> Mesh {
    let within = |[from, to]: [f64; 2]| move |[x, _]: [f64; 2]| from - 1e-9 < x && x < to + 1e-9;
    let mesh = with_part(square(10), "bottom", "foot", within(foot));
    with_part(mesh, "top", "load", within(load))
}

#[test]
fn a_clamped_side_holds_the_body() {
    let motions = motions(square(3), "{ name = 'left', displacement = [0, 0] }");
    assert!(motions.all_prevented() && motions.free.is_empty() && motions.resisted.is_empty());
}

#[test]
fn a_body_on_a_foundation_may_slide_but_not_sink_or_turn() {
    for order in [1, 2] {
        let down = "{ name = 'bottom', gap = 0 }, { name = 'top', traction = [0, -1] }";
        let problem = of_order(order, distorted(4), down).unwrap();
        assert!(!problem.motions.all_prevented() && problem.motions.resisted.len() == 2);
        let names: Vec<_> = problem.motions.free.iter().map(RigidMotion::to_string).collect();
        assert_eq!(names, ["the horizontal translation"]);
        assert_eq!(problem.notes().len(), 1);
        for solver in SOLVERS {
            // Of all answers the one that does not slide on average.
            let u = run(&problem, solver).last.state.u;
            let mean: f64 =
                (problem.body.nodes.weights.iter().enumerate()).map(|(i, a)| a * u[2 * i]).sum();
            assert!(mean.abs() < 1e-15 && largest(&u) > 1e-3);
        }
    }
}

#[test]
fn loads_that_nothing_balances_are_named_by_the_motion_they_drive() {
    let on_ground = |load: &str| {
        let ground = "{ name = 'bottom', gap = 0 }, { name = 'top', traction = ";
        driven(1, square(4), &format!("{ground}{load} }}"))
    };
    assert_eq!(on_ground("[1, -1]"), "the horizontal translation");
    assert_eq!(on_ground("[1e-6, -1]"), "the horizontal translation");
    assert_eq!(on_ground("[0, 1]"), "the vertical translation");
    let couple = "{ name = 'left', traction = [0, -1] }, { name = 'right', traction = [0, 1] }";
    assert!(driven(1, square(4), couple).starts_with("the rotation about (0.5000, 0.5000)"));
    // Supported sideways by an axis, a body is still lifted.
    let lifted = "{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
                  { name = 'top', traction = [0, 1] }";
    assert_eq!(driven(1, square(4), lifted), "the vertical translation");
}

#[test]
fn a_body_about_to_tip_stands_on_one_edge() {
    for order in [1, 2] {
        // The load 0.6 ≤ x ≤ 0.8 has its resultant above the end of the foot: all of the
        // reaction, 0.2, is in that one node.
        let scene = "{ name = 'foot', gap = 0 }, { name = 'load', traction = [0, -1] }";
        for solver in SOLVERS {
            let problem = of_order(order, footed([0.3, 0.7], [0.6, 0.8]), scene).unwrap();
            let last = run(&problem, solver).last;
            close(last.record.contact_force, 0.2, 1e-9);
            for point in &last.state.contact {
                let [x, _] = problem.body.nodes.points[point.node];
                let force = if (x - 0.7).abs() < 1e-9 { 0.2 } else { 0.0 };
                close(point.force, force, 1e-9);
            }
        }
    }
}

#[test]
fn a_body_that_nothing_holds_takes_balanced_loads() {
    for order in [1, 2] {
        // Pulled by ±σ on opposite sides of a square turned by any angle: u = (σ/E)(x − x̄) along
        // the pull and −ν as much across, less what of it is a rigid motion.
        for angle in [0.0, 0.6, 2.0] {
            let mesh = moved(distorted(5), |x| turn(angle, x));
            let text = format!(
                "{{ name = 'left', traction = {:?} }}, {{ name = 'right', traction = {:?} }}",
                turn(angle, [-2.0, 0.0]),
                turn(angle, [2.0, 0.0])
            );
            let problem = of_order(order, mesh, &text).unwrap();
            assert_eq!(problem.motions.free.len(), 3);
            let mut expected: Vec<f64> = (problem.body.nodes.points.iter())
                .flat_map(|x| {
                    let [x, y] = turn(-angle, *x);
                    turn(angle, [0.02 * (x - 0.5), -0.006 * (y - 0.5)])
                })
                .collect();
            problem.motions.remove_free(&problem.body, &mut expected);
            let u = run(&problem, SOLVERS[0]).last.state.u;
            let error = difference(&u, &expected);
            assert!(error < 1e-12, "{error}");
            // Σ area_i u_i·m(x_i) = 0 for each free motion m.
            for motion in &problem.motions.free {
                let nodes = problem
                    .body
                    .nodes
                    .points
                    .iter()
                    .zip(&problem.body.nodes.weights)
                    .zip(u.chunks(2));
                let share: f64 = nodes
                    .map(|((x, area), u)| {
                        let m = motion.at(*x);
                        area * (m[0] * u[0] + m[1] * u[1])
                    })
                    .sum();
                assert!(share.abs() < 1e-15, "{share}");
            }
        }
    }
}

#[test]
fn a_body_without_load_rests() {
    for order in [1, 2] {
        let problem = of_order(order, square(4), "{ name = 'top', traction = [0, 0] }").unwrap();
        assert_eq!(problem.motions.free.len(), 3);
        assert_eq!(problem.notes().len(), 3);
        for solver in SOLVERS {
            let outcome = run(&problem, solver);
            assert!(outcome.last.state.u.iter().all(|u| *u == 0.0));
            assert_eq!(outcome.kkt.worst(), 0.0);
        }
    }
}

#[test]
fn free_motions_are_orthonormal_over_the_body() {
    for order in [1, 2] {
        let problem = of_order(order, distorted(4), "{ name = 'top', traction = [0, 0] }").unwrap();
        let (body, free) = (&problem.body, &problem.motions.free);
        for (i, a) in free.iter().enumerate() {
            for (j, b) in free.iter().enumerate() {
                let product: f64 = (body.nodes.points.iter().zip(&body.nodes.weights))
                    .map(|(x, area)| {
                        let (a, b) = (a.at(*x), b.at(*x));
                        area * (a[0] * b[0] + a[1] * b[1])
                    })
                    .sum();
                // The square's area is 1, so a unit translation has length 1.
                close(product, if i == j { 1.0 } else { 0.0 }, 1e-12);
            }
        }
    }
}

#[test]
fn an_axis_leaves_the_translation_along_it() {
    let free = |mesh: Mesh, boundaries: &str| -> Vec<String> {
        motions(mesh, boundaries).free.iter().map(RigidMotion::to_string).collect()
    };
    let left = "{ name = 'left', symmetry = true }";
    let bottom = "{ name = 'bottom', symmetry = true }";
    assert_eq!(free(square(3), left), ["the vertical translation"]);
    assert_eq!(free(square(3), bottom), ["the horizontal translation"]);
    let turned = moved(square(3), |x| turn(0.25 * std::f64::consts::PI, x));
    let [name] = &free(turned, left)[..] else { panic!("one motion") };
    assert!(name.contains("0.707"), "{name}");
    assert!(motions(square(3), &format!("{left}, {bottom}")).all_prevented());
    // u_y = 0 along x = 0 leaves the translation in x and turning about a point of that side.
    let component = motions(square(3), "{ name = 'left', displacement = ['free', 0] }");
    assert_eq!(component.free.len(), 2);
    for motion in &component.free {
        assert!((0..5).all(|i| motion.at([0.0, f64::from(i)])[1].abs() < 1e-12), "{motion}");
    }
}

/// A disc of radius 1 around (3, 2) as a regular polygon, and with curved sides.
fn discs() -> [Mesh; 2] {
    let mesh = disc(18, 0.0, 1);
    let mut round = mesh.clone();
    for &[a, b] in &mesh.curves["rim0"].edges {
        // The sagitta 1 − cos(π/n), outwards.
        let sagitta = 1.0 - (std::f64::consts::PI / 18.0).cos();
        round.set_offset([a, b], mesh.edge_normal([a, b]).0.map(|normal| sagitta * normal));
    }
    [mesh, round]
}

#[test]
fn a_disc_in_a_ring_can_only_turn() {
    // Its boundary is all axis or all foundation: every normal passes through the centre.
    let [mesh, round] = discs();
    for condition in ["symmetry = true", "gap = 0"] {
        for (order, mesh) in [(1, &mesh), (2, &mesh), (2, &round)] {
            let rim = format!("{{ name = 'rim0', {condition} }}");
            let problem = of_order(order, mesh.clone(), &rim).unwrap_or_else(|e| panic!("{e}"));
            let motions = &problem.motions;
            let names: Vec<_> = motions.free.iter().map(RigidMotion::to_string).collect();
            assert_eq!(names, ["the rotation about (3.0000, 2.0000)"], "P{order}, {condition}");
            assert_eq!(!motions.resisted.is_empty(), condition == "gap = 0");
        }
    }
}

#[test]
fn contact_on_opposite_sides_resists_both_ways_on_one_side_only_one() {
    // Farkas: a load is balanced by p ≥ 0 if no motion that contact allows does work.
    let body = Body::new(square(2), Order::Linear);
    let gap = |node: usize, direction| NodalConstraint {
        node,
        direction,
        law: RowLaw::Rigid { tributary_length: 1.0 },
    };
    let load = |force: [f64; 2]| -> Vec<f64> {
        (0..9).flat_map(|i| if i == 4 { force } else { [0.0; 2] }).collect()
    };
    let exact = || ([0.0; 3], 0.0);
    // Nodes 3 and 5 are (0, ½) and (1, ½), 4 is the centre.
    let between = RigidMotions::new(&body, &[gap(3, [-1.0, 0.0]), gap(5, [1.0, 0.0])], &[0.0; 9]);
    assert!(between.check(&body, &load([1.0, 0.0]), exact).is_ok());
    assert!(between.check(&body, &load([-1.0, 0.0]), exact).is_ok());
    assert!(between.check(&body, &load([0.0, 1.0]), exact).is_err());
    let against = RigidMotions::new(&body, &[gap(5, [1.0, 0.0])], &[0.0; 9]);
    assert!(against.check(&body, &load([1.0, 0.0]), exact).is_ok());
    assert!(against.check(&body, &load([-1.0, 0.0]), exact).is_err());
}

#[test]
fn a_disc_refined_on_one_side_still_turns_in_its_ring() {
    // Where parabolas of the same circle are bisected, and others are not, their normals miss the centre by
    // φ³/16 and more; no such normal is a lever against turning.
    let [_, round] = discs();
    let mut refined = Refinement::start(round);
    for _ in 0..4 {
        let mesh = &refined.mesh;
        let right = |nodes: &[usize; 3]| nodes.iter().any(|&node| mesh.nodes[node][0] > 3.95);
        let marked: Vec<bool> = mesh.triangles.iter().map(right).collect();
        refined = refined.refine(&marked).unwrap();
    }
    for condition in ["symmetry = true", "gap = '0.001*(1 + x - 3)'"] {
        let load = "body.force = [1, 0]\n";
        let rim = format!("boundary = [{{ name = 'rim0', {condition} }}]");
        let text = format!("{load}discretisation.displacement = 2\n{MATERIAL}\n{rim}");
        let problem = problem(refined.mesh.clone(), &text).unwrap_or_else(|e| panic!("{e}"));
        let [free] = &problem.motions.free[..] else { panic!("{:?}", problem.motions.free) };
        let [at_centre, at_rim] = [[3.0, 2.0], [4.0, 2.0]].map(|x| free.at(x));
        assert!(largest(&at_centre) < 1e-2 * at_rim[1].abs(), "{free}");
        // Pressed to the right, it does not turn.
        let outcome = run(&problem, SOLVERS[0]);
        let u = outcome.last.state.u;
        let mut rest = u.clone();
        problem.motions.remove_free(&problem.body, &mut rest);
        assert!(difference(&rest, &u) < 1e-9);
        assert!(outcome.accuracy.displacement < 1e-6, "{}", outcome.accuracy.displacement);
    }
}

#[test]
fn of_many_answers_every_solver_gives_the_one_of_least_displacement() {
    // A block stands on the one node below its load, or on the edge x = 0.7 of its foot: turning about
    // that node is resisted by no force, on the edge to one side by the closed gap.
    for order in [1, 2] {
        for (foot, gap, leans) in [([0.0, 1.0], "0.01*abs(x-0.5)", false), ([0.3, 0.7], "0", true)]
        {
            let middle = if leans { 0.7 } else { 0.5 };
            let scene = format!(
                "{{ name = 'foot', gap = '{gap}' }}, {{ name = 'load', traction = [0, -1e-3] }}"
            );
            let mut answers = Vec::new();
            for solver in SOLVERS {
                let mesh = footed(foot, [middle - 0.1, middle + 0.1]);
                // The fixed point of penalty-duality is slow where nothing stops the rotation.
                let text = format!(
                    "contact.rescue = {}\ndiscretisation.displacement = {order}\n{MATERIAL}\nboundary = [{scene}]",
                    solver == "penalty-duality"
                );
                let problem = problem(mesh, &text).unwrap();
                let outcome = run(&problem, solver);
                assert!(outcome.notes(&problem).iter().any(|note| note.contains("one of many")));
                let u = outcome.last.state.u;
                // ∫ u·m of the rotation m about the centre; the translation in x is free.
                let nodes = problem.body.nodes.points.iter().zip(&problem.body.nodes.weights);
                let about = |((x, area), u): ((&[f64; 2], &f64), &[f64])| {
                    area * ((x[0] - middle) * u[1] - (x[1] - 0.5) * u[0])
                };
                let turn: f64 = nodes.zip(u.chunks(2)).map(about).sum();
                assert!(leans || turn.abs() < 1e-8 * largest(&u), "{solver}: {turn:e}");
                answers.push(u);
            }
            let [first, others @ ..] = &answers[..] else { panic!("no solvers") };
            others.iter().for_each(|u| assert!(difference(u, first) < 1e-6));
        }
    }
}

/// Two supports carry a load between them: p ≥ 0 with Aᵀp = b exists. On these rows, orthogonal up to rounding,
/// nalgebra's singular values err by 3e-4.
#[test]
fn a_load_between_two_supports_is_carried() {
    let near = [-1.000000000002524, -0.8164965809256531];
    let far = [-0.9999999999962141, 1.2247448713946802];
    let supports = DMatrix::from_row_slice(2, 2, &[near, far].concat());
    let load = DVector::from_row_slice(&[-300.0, 9.273418017439675e-10]);
    let carried = supports.transpose() * nonnegative(&supports, &load);
    assert!((carried - load).norm() < 1e-11);
}

/// Lifts a body off its foundation, whose normal is (0, −1), to this height by a translation that K does not resist. Bounds are
/// measured from the reference, which follows the body.
struct Lifts(f64);

impl ContactSolver for Lifts {
    fn name(&self) -> &'static str {
        "lifts"
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        _: &mut LinearSolver,
        _: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let height = self.0 - problem.bounds[0].upper;
        c.write(|c| {
            c.chunks_mut(2).for_each(|u| u.copy_from_slice(&[0.0, height]));
            for bound in problem.bounds {
                c[2 * bound.node..2 * bound.node + 2].fill(0.0);
                c[bound.dof] = -height;
            }
        })?;
        Ok(ContactReport::default())
    }
}

/// Nothing balances the load of a body that has left its foundation, whose K is singular. The forces of a rigid motion are
/// rounding, which must not hide this load: its scale would make it a part of 1e-4.
#[test]
fn a_body_that_has_left_its_foundation_is_never_certified() {
    let session = Session::start(&[]).unwrap();
    for (gap, tolerance) in [("0", 1e-10), ("1e-3", 1e-10), ("0", 1e-3)] {
        let text = format!(
            "contact = {{ rescue = false, tolerance = {tolerance} }}\n{MATERIAL}
             boundary = [{{ name = 'bottom', gap = '{gap}' }}, {{ name = 'top', traction = [0, -1] }},
                         {{ name = 'left', displacement = [0, 'free'] }}]"
        );
        for lift in [0.0, 1e-3, 1.0, 1e10, 1e20, 1e30] {
            let problem = problem(square(4), &text).unwrap();
            let run = Simulation::new(&problem).solver(Box::new(Lifts(lift))).run(&session);
            assert!(matches!(run, Err(RunError::Contact { .. })), "{lift:e} {gap}: {run:?}");
        }
    }
}
