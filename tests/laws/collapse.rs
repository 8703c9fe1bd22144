//! Bodies that lose their support: the time follows from equilibrium by hand.

use crate::support::{moved, problem, run, with_part};
use signorini::{contact::SOLVERS, evolution::ObservedProblem, mesh::Mesh};

/// A scene on `mesh`, with time from 0 to 1 in steps of `step`.
fn scene(mesh: Mesh, step: &str, conditions: &str) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 1e5, poisson = 0.2, plane = 'strain' }}
         time = {{ end = 1, step = {step} }}
         {conditions}"
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// `motion` is the beginning of its name: where a body may slide, the height of the point of rest is arbitrary.
fn check(problem: &ObservedProblem, expected: f64, motion: &str) {
    let collapse = problem.collapse.expect("the body loses its support");
    assert!((collapse.time - expected).abs() < 1e-6, "{} is not {expected}", collapse.time);
    let found = collapse.motion.to_string();
    assert!(found.starts_with(motion), "{found}");
    // The run reaches its end, just before.
    let last = run(problem, SOLVERS[0]).last;
    assert!((last.state.time - expected).abs() < 2.5e-6, "{}", last.state.time);
    assert!(last.record.kkt().worst() < 1e-10);
}

/// A wall of the weight 12 behind a key of the height ½ at its toe, under water of the height h = 6t. The wall turns
/// about the top of the key when h²/2 (h/3 − ½) = 12 · 1.
#[test]
fn a_wall_turns_about_the_key_at_its_toe_when_the_water_is_high_enough() {
    let excess = |h: f64| h * h / 2.0 * (h / 3.0 - 0.5) - 12.0;
    let (mut low, mut high) = (0.5_f64, 6.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { high = middle } else { low = middle }
    }
    for step in ["0.01", "0.07", "'auto'"] {
        let mesh = with_part(Mesh::rectangle(2.0, 6.0, 8, 24), "right", "key", |[_, y]| y <= 0.5);
        let wall = scene(
            mesh,
            step,
            "body.force = [0, -1]
             boundary = [
                { name = 'bottom', gap = 0 },
                { name = 'key', gap = 0 },
                { name = 'left', pressure = 'max(0, 6*t - y)' },
             ]",
        );
        check(&wall, low / 6.0, "the rotation about (2.0000, 0.5000)");
    }
}

/// A seesaw of the weight 10 on a fulcrum from x = 4 to 6, with the load 1 at x = ½ and 20t at 9½: the resultant
/// leaves the fulcrum when (50 + ½ + 190 t)/(11 + 20t) = 6.
#[test]
fn a_lever_turns_about_the_edge_of_its_fulcrum() {
    let bar = Mesh::rectangle(10.0, 1.0, 40, 4);
    let bar = with_part(bar, "bottom", "fulcrum", |[x, _]| (4.0..=6.0).contains(&x));
    let lever = scene(
        bar,
        "0.02",
        "body.force = [0, -1]
         boundary = [
            { name = 'fulcrum', gap = 0 },
            { name = 'top', traction = [0, 'if(x < 1, -1, if(x > 9, -20*t, 0))'] },
         ]",
    );
    check(&lever, 15.5 / 70.0, "the rotation about (6.000, ");
}

/// A block in a groove of two faces, under gravity that turns by t: it leaves the left face when gravity turns away.
#[test]
fn a_block_slides_out_of_its_groove_when_gravity_has_turned() {
    let block = scene(
        Mesh::rectangle(1.0, 1.0, 4, 4),
        "0.03",
        "body.force = ['-sin(0.5 - t)', '-cos(0.5 - t)']
         boundary = [{ name = 'bottom', gap = 0 }, { name = 'left', gap = 0 }]",
    );
    check(&block, 0.5, "the horizontal translation");
}

/// The base is 1½ wide, and the resultant of the load stands at x = 1 + 2t.
#[test]
fn a_body_that_widens_upwards_turns_over_its_base_and_others_stand() {
    let widens = |[x, y]: [f64; 2]| [x * (1.5 + 0.5 * y), y];
    let top = |load: &str| {
        format!("boundary = [{{ name = 'bottom', gap = 0 }}, {{ name = 'top', {load} }}]")
    };
    let mesh = || moved(Mesh::rectangle(1.0, 1.0, 6, 6), widens);
    let falling = scene(mesh(), "0.01", &top("traction = [0, '-1 - 6*t*(x - 1)']"));
    check(&falling, 0.25, "the rotation about (1.5000, ");
    let standing = scene(mesh(), "0.01", &top("traction = [0, '-1 - t*(x - 1)']"));
    assert!(standing.collapse.is_none());
}

/// A body of the weight 2 on a floor and a ramp, which hold the horizontal force 4t tan α until t = ½. Few nodes are enough
/// if the mesh has the points of the geometry.
#[test]
fn a_ramp_holds_a_body_until_it_slides_whatever_its_angle() {
    for degrees in [2.0_f64, 5.0, 10.0, 20.0, 29.0, 31.0, 60.0] {
        for (n, is_known) in [(1, true), (2, true), (3, true), (5, true), (3, false), (5, false)] {
            let slope = degrees.to_radians().tan();
            let mut mesh = Mesh::rectangle(2.0, 1.0, 2 * n, n);
            let is_point =
                |&node: &usize| mesh.nodes[node][1] == 0.0 && mesh.nodes[node][0].fract() == 0.0;
            if is_known {
                mesh.points = (0..mesh.nodes.len()).filter(is_point).collect();
            } else if degrees == 2.0 {
                // The limit of lines of which the points are not known.
                continue;
            }
            let mesh = moved(mesh, |[x, y]| [x, y + slope * (x - 1.0).max(0.0)]);
            let ramp = scene(
                mesh,
                "0.1",
                &format!(
                    "body.force = [0, -1]
                     boundary = [
                        {{ name = 'bottom', gap = 0 }},
                        {{ name = 'right', traction = ['{}*t', 0] }},
                     ]",
                    4.0 * slope
                ),
            );
            check(&ramp, 0.5, "the translation along");
        }
    }
}
