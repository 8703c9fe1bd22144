//! Where the conditioning or the discretisation is poor: answers stay right, or notes say not.

use crate::support::{
    close, close_relative, difference, distorted, history, moved, order, problem, run, square,
    try_run,
};
use signorini::{contact::SOLVERS, evolution::ObservedProblem, mesh::Mesh};
use std::f64::consts::PI;

/// Clamped left, pressed down on the left half of the top and pulled up on the right.
const PRESSED: &str = "
    { name = 'left', displacement = [0, 0] },
    { name = 'bottom', gap = 0 },
    { name = 'top', traction = [0, '-1.5 + 2.5*max(-1, min(1, 1e6*(x - 0.5)))'] },";

/// A body with Young's modulus 80 of the material `law`.
fn body(mesh: Mesh, law: &str, more: &str, boundaries: &str) -> ObservedProblem {
    let text = format!("material = {{ young = 80, {law} }}\n{more}\nboundary = [{boundaries}]");
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

const STRESS: &str = "poisson = 0.3, plane = 'stress'";

/// The square with one column of cells so narrow that its triangles have the angle, in degrees.
fn needles(n: usize, angle: f64) -> Mesh {
    let (cells, column) = (n as f64, (n / 2) as f64);
    let narrow = angle.to_radians().tan() / cells;
    let wide = (1.0 - narrow) / (cells - 1.0);
    moved(square(n), |[x, y]| {
        let i = (x * cells).round();
        [if i <= column { i * wide } else { (i - 1.0) * wide + narrow }, y]
    })
}

/// A strip of length 100 and height 1 on a foundation, pressed in its middle only.
fn strip(tolerance: f64) -> ObservedProblem {
    let contact = format!("contact = {{ tolerance = {tolerance:e} }}");
    let boundaries = "{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
        { name = 'top', traction = [0, '-max(0, 1 - abs(x - 50)/5)'] }";
    body(Mesh::rectangle(100.0, 1.0, 100, 1), STRESS, &contact, boundaries)
}

#[test]
fn nearly_incompressible_plane_strain_is_told_and_nothing_else() {
    for (law, told) in [
        ("poisson = 0.4, plane = 'strain'", false),
        ("poisson = 0.45, plane = 'strain'", false),
        ("poisson = 0.46, plane = 'strain'", true),
        ("poisson = 0.49, plane = 'strain'", true),
        ("poisson = 0.49, plane = 'stress'", false),
    ] {
        let notes = body(distorted(24), law, "", PRESSED).notes();
        assert_eq!(notes.len(), usize::from(told), "{law}: {notes:?}");
        assert!(notes.iter().all(|note| note.contains("linear triangles lock")), "{notes:?}");
    }
}

#[test]
fn slivers_are_told_with_their_place() {
    assert!(body(needles(4, 2.0), STRESS, "", PRESSED).notes().is_empty());
    let notes = body(needles(4, 0.1), STRESS, "", PRESSED).notes();
    assert!(notes.len() == 1 && notes[0].contains("angle of 1.0e-1°"), "{notes:?}");
    // A node almost on the opposite edge: the smallest angle is at the edge's ends.
    let mut cap = square(2);
    cap.nodes[4] = [0.749, 0.251];
    let notes = body(cap, STRESS, "", PRESSED).notes();
    assert!(notes.len() == 1 && notes[0].contains("angle of 2.3e-1°"), "{notes:?}");
}

/// The curl of ψ = sin²(πx) sin(πy)/100 prescribed on the boundary of the square, with the body
/// force that makes it the exact answer: the relative error of u at the nodes.
fn curl_error(order: u8, n: usize, poisson: f64) -> f64 {
    let u = "['pi*sin(pi*x)^2*cos(pi*y)/100', '-pi*sin(2*pi*x)*sin(pi*y)/100']";
    // div u = 0: f = −μΔu.
    let f = 0.01 * PI.powi(3) * 80.0 / (2.0 * (1.0 + poisson));
    let force = format!(
        "body = {{ force = ['-{f}*(2*cos(2*pi*x) - sin(pi*x)^2)*cos(pi*y)', \
         '-{f}*5*sin(2*pi*x)*sin(pi*y)'] }}"
    );
    let sides = ["left", "right", "bottom", "top"];
    let sides = sides.map(|name| format!("{{ name = '{name}', displacement = {u} }}")).join(",");
    let law = format!("poisson = {poisson}, plane = 'strain'");
    let more = format!("discretisation.displacement = {order}\n{force}");
    let problem = body(square(n), &law, &more, &sides);
    let exact = |&[x, y]: &[f64; 2]| {
        let (a, b) = ((PI * x).sin().powi(2), (2.0 * PI * x).sin());
        [a * (PI * y).cos(), -b * (PI * y).sin()].map(|v| 0.01 * PI * v)
    };
    let exact: Vec<f64> = problem.body.nodes.points.iter().flat_map(exact).collect();
    difference(&run(&problem, SOLVERS[0]).last.state.u, &exact)
}

#[test]
fn linear_triangles_lock_as_poissons_ratio_goes_to_a_half() {
    for n in [8, 16] {
        let errors = [0.3, 0.45, 0.49, 0.499, 0.4999].map(|nu| curl_error(1, n, nu));
        assert!(errors.is_sorted() && errors[4] > 0.4, "{errors:?}");
        // Up to where no note is given the error stays that of a coarse mesh.
        assert!(errors[1] < 3.0 * errors[0] && errors[0] < 8.0 / (n * n) as f64, "{errors:?}");
    }
}

#[test]
fn quadratic_triangles_converge_more_slowly_instead_of_locking() {
    // At the nodes of these regular meshes with order 4 where ν is small, with order 2 in the limit.
    for (poisson, least) in [(0.3, 3.7), (0.49, 3.2), (0.4999, 1.9)] {
        let cells = [8, 16, 32];
        let errors = cells.map(|n| curl_error(2, n, poisson));
        let order = order(&cells.map(|n| 1.0 / n as f64), &errors);
        println!("ν = {poisson}: {errors:?}, order {order:.2}");
        assert!(order > least, "ν = {poisson}: {order}, {errors:?}");
        // Linear triangles with as many nodes are worse, and far worse where they lock.
        let part = if poisson < 0.4 { 0.3 } else { 0.1 };
        assert!(errors[0] < part * curl_error(1, 16, poisson), "ν = {poisson}");
    }
    let told = "poisson = 0.4999, plane = 'strain'";
    let notes = body(distorted(24), told, "discretisation.displacement = 2", PRESSED).notes();
    assert_eq!(notes, [""; 0]);
}

#[test]
fn soft_holes_and_slivers_do_not_spoil_certified_answers() {
    let hole = "damage = { diffusion = 1, lambda_d = 0, lambda_u = 0, lambda_w = 0, \
        strain_cap = 1, threshold = 1e-7, \
        initial = '1e-6 + (1 - 1e-6)*min(1, max(0, 20*(hypot - 0.2)))' }"
        .replace("hypot", "sqrt((x - 0.5)^2 + (y - 0.5)^2)");
    for problem in
        [body(square(12), STRESS, &hole, PRESSED), body(needles(12, 0.1), STRESS, "", PRESSED)]
    {
        let answers = SOLVERS.map(|solver| run(&problem, solver));
        for answer in &answers {
            assert!(answer.kkt.within(1e-10));
            assert!(answer.accuracy.displacement < 1e-8, "{:?}", answer.accuracy);
            assert!(answer.accuracy.notes(1e-10).is_empty());
        }
        for other in &answers[1..] {
            let off = difference(&other.last.state.u, &answers[0].last.state.u);
            assert!(off < 1e-8, "{off}");
        }
    }
}

#[test]
fn a_slender_body_is_solved_as_exactly_as_rounding_allows_and_told_so() {
    // Deflected by FL³/3EI, I = 1/12; a last digit of that bends the body by forces above 1e-10 F.
    let clamped =
        "{ name = 'left', displacement = [0, 0] }, { name = 'right', traction = [0, -1e-6] },
        { name = 'bottom', gap = 10 }";
    let slender = |more: &str| {
        let more = format!("discretisation.displacement = 2\n{more}");
        body(Mesh::rectangle(200.0, 1.0, 200, 2), STRESS, &more, clamped)
    };
    let outcome = run(&slender(""), SOLVERS[0]);
    assert!(outcome.kkt.worst() > 1e-10, "the case is to be hard: {:?}", outcome.kkt);
    close(outcome.last.record.displacement_max, 4e-6 * 200.0_f64.powi(3) / 80.0, 1e-3);
    let notes = outcome.notes(&slender(""));
    assert!(notes[0].contains("rounding allows no less"), "{notes:?}");
    // A tolerance that was asked for is not eased.
    let exact = slender("contact = { tolerance = 9e-11, rescue = false }");
    let refused = try_run(&exact, SOLVERS[0]).unwrap_err().to_string();
    assert!(refused.contains("double precision reaches only"), "{refused}");
}

/// Walls close on a strip under a light load that balances itself: its displacements are large and the forces,
/// also those that the walls seem to need, are small.
#[test]
fn a_slender_body_between_walls_is_not_refused_for_rounding_that_can_be_avoided() {
    for (waves, force, gap) in [(1, 0.02, 0.016), (4, 0.2, 0.001), (7, 0.2, 0.016)] {
        let text = format!(
            "material = {{ young = 1e8, poisson = 0.3, plane = 'strain' }}
             contact.rescue = false
             body.force = [0, '{force}*sin(2*pi*({waves}*x/100 - 2*t))']
             time = {{ end = 1, step = 0.05 }}
             boundary = [
                {{ name = 'left', displacement = [0, 'free'] }},
                {{ name = 'bottom', gap = '{gap}*(1.01 - t)' }},
                {{ name = 'top', gap = '{gap}*(1.01 - t)' }},
             ]"
        );
        let problem = problem(Mesh::rectangle(100.0, 1.0, 200, 2), &text).unwrap();
        if let Err(refused) = try_run(&problem, SOLVERS[0]) {
            panic!("{waves} waves of {force} N/m³, gap {gap} m: {refused}");
        }
    }
}

#[test]
fn the_estimated_error_of_displacements_is_the_true_one() {
    // Forces of a relative 1e-6 move the far ends of a slender strip by much more.
    let exact = run(&strip(1e-10), "active-set");
    assert!(exact.accuracy.displacement < 1e-6 && exact.accuracy.notes(1e-10).is_empty());
    let answer = run(&strip(1e-6), "tao");
    assert!(answer.kkt.within(1e-6), "certified");
    let (found, u) = (answer.accuracy.displacement, &answer.last.state.u);
    let largest = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0_f64, |m, v| m.max(v.abs()));
    let off = largest(&mut u.iter().zip(&exact.last.state.u).map(|(a, b)| a - b));
    let off = off / largest(&mut exact.last.state.u.iter().copied());
    assert!(off > 1e-4, "tao: the case is to be hard, but {off}");
    assert!(0.2 * off < found && found < 5.0 * off, "tao: {found} for {off}");
    let notes = answer.accuracy.notes(1e-6);
    assert!(notes.len() == 1 && notes[0].contains("ill-conditioned"), "{notes:?}");
}

#[test]
fn the_energy_error_vanishes_for_a_linear_field_and_halves_with_the_mesh() {
    let linear = "{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
        { name = 'top', traction = [0, -1] }";
    let patch = run(&body(distorted(5), STRESS, "", linear), SOLVERS[0]);
    assert!(patch.accuracy.energy < 1e-10, "{:?}", patch.accuracy);
    // A smooth load on a body that may shear freely along both axes.
    let smooth = "{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
        { name = 'top', traction = [0, '-2 - cos(pi*x)'] }";
    let [coarse, fine] =
        [16, 32].map(|n| run(&body(square(n), STRESS, "", smooth), SOLVERS[0]).accuracy.energy);
    close(coarse / fine, 2.0, 0.1);
}

#[test]
fn a_strip_one_triangle_high_that_bends_is_told() {
    let bent = |ny: usize| {
        let clamped = "{ name = 'left', displacement = [0, 0] }, { name = 'bottom', gap = 1 },
            { name = 'top', traction = [0, -1e-3] }";
        let outcome =
            run(&body(Mesh::rectangle(10.0, 1.0, 10 * ny, ny), STRESS, "", clamped), SOLVERS[0]);
        (outcome.last.record.displacement_max, outcome.accuracy.notes(1e-10))
    };
    let ((one, told), (eight, silent)) = (bent(1), bent(8));
    assert!(one < 0.6 * eight, "{one} against {eight}");
    assert!(told.len() == 1 && told[0].contains("too coarse") && silent.is_empty(), "{told:?}");
}

#[test]
fn the_estimated_error_of_displacements_is_that_of_the_worst_step() {
    // Solved to a residual of 1e-6 of the forces of the run. But for a bend at t = 0.5 the loads are straight in
    // time, as the start of a step is, up to what the tolerance forgives: a force that bends the
    // strip by 1e-4 of its displacements at t = 0.5, by less at the end.
    let pulled_and_bent = |tolerance: f64| {
        let text = format!(
            "material = {{ young = 80, {STRESS} }}
             contact.tolerance = {tolerance:e}
             time = {{ end = 1, step = 0.125 }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'bottom', gap = 10 }},
                {{ name = 'right', traction = ['40*max(0, 1 - 2*abs(t - 0.5))', '-0.04*abs(t - 0.5) - 5e-6*max(0, 1 - 8*abs(t - 0.5)) - 2e-7*max(0, 8*t - 7)'] }},
             ]"
        );
        let mesh = Mesh::rectangle(10.0, 0.5, 60, 3);
        history(&problem(mesh, &text).unwrap_or_else(|e| panic!("{e}")), "active-set")
    };
    let (exact, _) = pulled_and_bent(1e-11);
    let (steps, outcome) = pulled_and_bent(1e-6);
    let errors: Vec<f64> =
        steps.iter().zip(&exact).map(|(a, b)| difference(&a.state.u, &b.state.u)).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let at = steps.iter().position(|s| s.state.time == outcome.accuracy.time).unwrap();
    assert!(errors[8] < 0.1 * worst, "the last step is not the worst: {errors:?}");
    assert!(errors[at] > 0.1 * worst, "t = {}: {errors:?}", outcome.accuracy.time);
    let found = outcome.accuracy.displacement;
    assert!(0.1 * worst < found && found < 10.0 * worst, "{found} for {worst}");
}

#[test]
fn residuals_of_rounding_are_accepted_by_the_error_of_the_answer() {
    // A beam 200 times as long as high, graded to its clamp: a residual of 1e-6 F, the rounding of its internal
    // forces, moves its tip by 1e-8 of its deflection 4 F L³/(E h³).
    let grade = |s: f64| 200.0 * (1.15_f64.powf(100.0 * s) - 1.0) / (1.15_f64.powi(100) - 1.0);
    let mesh = moved(Mesh::rectangle(1.0, 1.0, 100, 32), |[x, y]| [grade(x), y]);
    let load =
        "{ name = 'left', displacement = [0, 0] }, { name = 'right', traction = [0, -1e-6] }";
    let problem = body(mesh, STRESS, "discretisation.displacement = 2", load);
    let outcome = run(&problem, SOLVERS[0]);
    let deflection = 4.0 * 1e-6 * 200.0_f64.powi(3) / 80.0;
    close_relative(outcome.last.record.displacement_max, deflection, 0.01);
    assert!(outcome.accuracy.displacement < 1e-6, "{}", outcome.accuracy.displacement);
}
