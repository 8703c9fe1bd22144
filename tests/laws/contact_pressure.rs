//! The contact pressure as a field on Γ_C: uniform and linear pressures keep their values, the area under it is the
//! force of each foundation.

use crate::free_motions::disc;
use crate::support::{
    close_relative, distorted, figures, moved, problem, run, shipped, square, turn, with_part,
};
use signorini::{
    contact::SOLVERS,
    evolution::{ContactRow, ObservedProblem, State},
    mesh::{Curve, Mesh},
};

/// The rows of Γ_C by boundary and part.
fn parts(problem: &ObservedProblem, state: &State) -> Vec<Vec<ContactRow>> {
    let rows = problem.supports.contact.rows(&problem.body, state).0;
    let parts = rows.chunk_by(|a, b| (&a.boundary, a.part) == (&b.boundary, b.part));
    parts.map(<[ContactRow]>::to_vec).collect()
}

/// The area under the pressure along a part.
fn area(rows: &[ContactRow]) -> f64 {
    let pairs = rows.windows(2);
    pairs.map(|p| 0.5 * (p[0].pressure + p[1].pressure) * (p[1].arc_length - p[0].arc_length)).sum()
}

/// `mesh` with two more curves, "near" the left end of its bottom and "far" from it.
fn divided(mesh: Mesh, at: f64) -> Mesh {
    let near = with_part(mesh, "bottom", "near", |[x, _]| x < at + 1e-9);
    with_part(near, "bottom", "far", |[x, _]| x > at - 1e-9)
}

#[test]
fn a_uniform_pressure_keeps_its_value_at_every_node_and_where_foundations_meet() {
    for (degree, angle) in [(1, 0.0), (2, 0.0), (1, 0.4), (2, 0.4)] {
        let [down, aside] = [turn(angle, [0.0, -3.0]), turn(angle, [-2.0, 0.0])];
        let text = format!(
            "contact.tolerance = 1e-12
             discretisation.displacement = {degree}
             material = {{ young = 200, poisson = 0.3, plane = 'stress' }}
             boundary = [{{ name = 'left', gap = 0 }}, {{ name = 'near', gap = 0 }},
                         {{ name = 'far', gap = 0 }}, {{ name = 'top', traction = {down:?} }},
                         {{ name = 'right', traction = {aside:?} }}]"
        );
        let mut mesh = moved(distorted(6), |x| turn(angle, x));
        let joint = square(6).nodes.iter().position(|x| (x[0] - 0.5).abs() < 1e-9 && x[1] == 0.0);
        let joint = joint.unwrap();
        mesh =
            moved(divided(moved(mesh, |x| turn(-angle, x)), distorted(6).nodes[joint][0]), |x| {
                turn(angle, x)
            });
        for solver in SOLVERS {
            let problem = problem(mesh.clone(), &text).unwrap_or_else(|e| panic!("{e}"));
            let state = run(&problem, solver).last.state;
            let parts = parts(&problem, &state);
            let nodes: Vec<usize> = parts.iter().map(Vec::len).collect();
            assert_eq!(nodes, [6 * degree + 1, 3 * degree + 1, 3 * degree + 1]);
            // Around a corner of Γ_C the arc length goes on.
            for row in parts.iter().flatten() {
                let [x, y] = turn(-angle, [row.x, row.y]);
                let (pressure, along) =
                    if row.boundary == "left" { (2.0, 1.0 - y) } else { (3.0, x) };
                close_relative(row.pressure, pressure, 1e-9);
                assert!(row.boundary == "far" || (row.arc_length - along).abs() < 1e-12, "{row:?}");
            }
        }
    }
}

#[test]
fn the_area_under_the_pressure_is_the_force_of_each_foundation() {
    // The load leaves a part of the bottom open, and presses on a node where two foundations meet.
    for degree in [1, 2] {
        for load in ["-4*if(x < 0.5, 1, -0.9)", "-4*if(x < 0.1, 1, 0)", "-x", "-4*(x - 0.3)"] {
            let text = format!(
                "discretisation.displacement = {degree}
                 material = {{ young = 200, poisson = 0.3, plane = 'strain' }}
                 boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'near', gap = '0.001*x*x' }},
                             {{ name = 'far', gap = '0.001*x*x' }}, {{ name = 'right', symmetry = true }},
                             {{ name = 'top', traction = [0, '{load}'] }}]"
            );
            let problem = problem(divided(square(8), 0.5), &text).unwrap_or_else(|e| panic!("{e}"));
            let last = run(&problem, SOLVERS[0]).last;
            let figures = figures(&problem, &last);
            for part in parts(&problem, &last.state) {
                let name = format!("{}.force_y", part[0].boundary);
                let force = figures[&name];
                let wrong = (area(&part) - force).abs() / last.record.contact_force;
                assert!(wrong < 1e-9, "P{degree}, {load}: {name} {force}, area {}", area(&part));
                assert!(part.iter().all(|row| row.pressure >= 0.0));
            }
        }
    }
    // On curved edges, with one end on an axis.
    let problem = shipped("hertz", &["discretisation.displacement=2", "mesh.size=0.008"]);
    let last = run(&problem, SOLVERS[0]).last;
    close_relative(area(&parts(&problem, &last.state)[0]), last.record.contact_force, 1e-9);
}

#[test]
fn a_foundation_that_is_farther_away_bears_nothing_at_a_shared_node() {
    for degree in [1, 2] {
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = 200, poisson = 0.3, plane = 'strain' }}
             boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'near', gap = 0 }},
                         {{ name = 'far', gap = 0.1 }}, {{ name = 'right', symmetry = true }},
                         {{ name = 'top', traction = [0, -1] }}]"
        );
        let problem = problem(divided(square(8), 0.5), &text).unwrap_or_else(|e| panic!("{e}"));
        let last = run(&problem, SOLVERS[0]).last;
        for part in parts(&problem, &last.state) {
            match &*part[0].boundary {
                "near" => close_relative(area(&part), last.record.contact_force, 1e-9),
                _ => assert!(part.iter().all(|row| row.active == 0 && row.gap > 0.05)),
            }
        }
        assert_eq!(figures(&problem, &last)["far.force_y"], 0.0, "P{degree}");
    }
}

#[test]
fn a_foundation_has_its_length_its_ends_and_its_line_of_action() {
    // Uniform pressure 3 on two halves: each one carries it in its middle.
    let text = "contact.tolerance = 1e-12
                material = { young = 200, poisson = 0.3, plane = 'stress' }
                boundary = [{ name = 'left', symmetry = true }, { name = 'near', gap = 0 },
                            { name = 'far', gap = 0 }, { name = 'top', traction = [0, -3] }]";
    let flat = problem(divided(square(6), 0.5), text).unwrap_or_else(|e| panic!("{e}"));
    let found = figures(&flat, &run(&flat, SOLVERS[0]).last);
    let others = ["force", "moment", "u_", "peak"];
    for (name, value) in found {
        let Some((of @ ("near" | "far"), figure)) = name.split_once('.') else { continue };
        if others.iter().any(|other| figure.contains(other)) {
            continue;
        }
        let start = if of == "near" { 0.0 } else { 0.5 };
        let expected = match figure {
            "contact_length" => 0.5,
            "pressure_max" => 3.0,
            "contact_start_x" => start,
            "contact_end_x" => start + 0.5,
            "acts_at_x" => start + 0.25,
            _ => 0.0,
        };
        assert!((value - expected).abs() < 1e-9, "{name} is {value}");
    }
    // On a curved foundation and an inclined one, too, the force at this point has the moment of the reactions.
    let text = "material = { young = 200, poisson = 0.3, plane = 'stress' }
                boundary = [{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
                            { name = 'top', pressure = '2 + x' }]";
    let inclined = problem(moved(square(4), |x| turn(0.4, x)), text);
    let inclined = inclined.unwrap_or_else(|e| panic!("{e}"));
    for (problem, foundation) in [(shipped("hertz", &[]), "foundation"), (inclined, "bottom")] {
        let last = run(&problem, SOLVERS[0]).last;
        let figures = figures(&problem, &last);
        let value = |name: &str| figures[&format!("{foundation}.{name}")];
        let moment = value("acts_at_x") * value("force_y") - value("acts_at_y") * value("force_x");
        close_relative(moment, value("moment"), 1e-9);
        if foundation == "foundation" {
            assert!((value("contact_length") - value("contact_end_x")).abs() < 2e-4);
            assert!(value("contact_start_x").abs() < 1e-12 && value("peak_x") < 1e-3);
        }
    }
}

/// The figures of contact of a body in a closed foundation, whose list of edges begins with the edge `first`.
fn closed_figures(mut mesh: Mesh, text: &str, first: usize) -> Vec<f64> {
    mesh.curves.get_mut("rim0").unwrap().edges.rotate_left(first);
    let problem = problem(mesh, text).unwrap_or_else(|e| panic!("{e}"));
    let figures = figures(&problem, &run(&problem, SOLVERS[0]).last);
    let places = ["contact_start", "contact_end", "peak", "acts_at"];
    let places = places.iter().flat_map(|of| ["x", "y"].map(|axis| format!("{of}_{axis}")));
    let names = ["contact_length", "pressure_max"].map(str::to_owned).into_iter().chain(places);
    names.map(|name| figures[&format!("rim0.{name}")]).collect()
}

#[test]
fn the_figures_of_a_closed_foundation_turn_with_the_load_wherever_its_edges_begin() {
    const CENTRE: [f64; 2] = [3.0, 2.0];
    for degree in [1, 2] {
        let text = |angle: f64, gap: f64| {
            let force = turn(angle, [0.0, -1.0]);
            format!(
                "contact.tolerance = 1e-12
                 discretisation.displacement = {degree}
                 material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
                 body.force = {force:?}
                 boundary = [{{ name = 'rim0', gap = {gap} }}]"
            )
        };
        let mut expected = Vec::new();
        for k in (0..24).step_by(5) {
            // The mesh of the disc is the same after a turn by 15°.
            let angle = f64::from(k) * std::f64::consts::TAU / 24.0;
            let mut found =
                closed_figures(disc(24, 0.0, 1), &text(angle, 0.2), (7 * k % 24) as usize);
            for place in found[2..].chunks_mut(2) {
                let [x, y] = turn(-angle, [place[0] - CENTRE[0], place[1] - CENTRE[1]]);
                place.copy_from_slice(&[x, y]);
            }
            let [length, _, _, start_y, _, end_y, .., acts_at_y] = found[..] else { panic!() };
            assert!(
                length > 0.2 && length < 2.0 && start_y < -0.5 && end_y < -0.5 && acts_at_y < -0.7
            );
            assert!(
                found[2] < 0.0 && found[4] > 0.0,
                "the body is on the left of the way from start to end"
            );
            expected = if k == 0 { found.clone() } else { expected };
            let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
            assert!(
                apart.fold(0.0, f64::max) < 1e-7,
                "P{degree}, turn {k}: {found:?}, {expected:?}"
            );
        }
        // A press fit: all nodes are active, and contact begins and ends at the least pressure, on the side of the body
        // force.
        for first in [0, 6, 17] {
            let found = closed_figures(disc(24, 0.0, 1), &text(0.0, -0.05), first);
            let rim = 48.0 * (std::f64::consts::TAU / 48.0).sin();
            assert!((found[0] / rim - 1.0).abs() < 2e-3, "P{degree}: {} of {rim}", found[0]);
            assert_eq!(found[2..4], found[4..6]);
            assert!(
                found[3] > CENTRE[1] + 0.9 && found[7] < CENTRE[1] - 0.9,
                "P{degree}: {found:?}"
            );
        }
    }
}

#[test]
fn contact_around_a_corner_of_a_closed_foundation_has_the_same_figures_wherever_its_edges_begin() {
    let mut mesh = square(4);
    let sides = ["bottom", "right", "top", "left"];
    let edges = sides.iter().flat_map(|side| mesh.curves[*side].edges.clone()).collect();
    mesh.curves.insert("rim0".to_owned(), Curve { edges, other_edges: 0 });
    let text = "contact.tolerance = 1e-12
                material = { young = 100, poisson = 0.3, plane = 'stress' }
                body.force = [1, -1.3]
                boundary = [{ name = 'rim0', gap = 0.01 }]";
    let expected = closed_figures(mesh.clone(), text, 0);
    // The bottom and the right side bear the square.
    close_relative(expected[0], 2.0, 1e-9);
    assert_eq!(expected[2..6], [0.0, 0.0, 1.0, 1.0]);
    for first in 1..16 {
        let found = closed_figures(mesh.clone(), text, first);
        let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-7, "edge {first}: {found:?}, {expected:?}");
    }
}

/// Stripes with E = 100, 200, … side by side, from 0 to `at[0]`, to `at[1]`, … on the unit square.
fn striped(mut mesh: Mesh, at: &[f64]) -> Mesh {
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let centre = triangle.iter().map(|&node| mesh.nodes[node][0]).sum::<f64>() / 3.0;
        let stripe = at.iter().filter(|x| **x < centre).count();
        mesh.surfaces.entry(format!("s{stripe}")).or_default().push(t);
    }
    mesh
}

#[test]
fn materials_side_by_side_press_with_a_pressure_each_up_to_their_interface() {
    // ν is the same on all sides, so that σ_yy = E ε_yy is uniform in each stripe.
    for (degree, angle, poisson) in [(1, 0.0, 0.0), (2, 0.4, 0.0), (1, 2.0, 0.3), (2, 0.0, 0.3)] {
        for at in [&[0.5][..], &[1.0 / 3.0, 2.0 / 3.0]] {
            for several in [false, true] {
                let wide = |x: f64| 0.01 * poisson * x;
                let [down, right] = [turn(angle, [0.0, -0.01]), turn(angle, [wide(1.0), 0.0])];
                let [c, s] = turn(angle, [1.0, 0.0]);
                let along = |k: usize| format!("{} + ({})*({c}*x + {s}*y)", down[k], right[k]);
                let foundations = match several {
                    false => "{ name = 'bottom', gap = 0 }",
                    true => "{ name = 'near', gap = 0 }, { name = 'far', gap = 0 }",
                };
                let third = if at.len() > 1 { ", s2 = { young = 300 }" } else { "" };
                let text = format!(
                    "contact.tolerance = 1e-12
                     discretisation.displacement = {degree}
                     material = {{ young = 100, poisson = {poisson}, plane = 'stress',
                                   s1 = {{ young = 200 }}{third} }}
                     boundary = [{foundations}, {{ name = 'top', displacement = ['{}', '{}'] }}]",
                    along(0),
                    along(1)
                );
                let mesh = moved(striped(divided(square(6), at[0]), at), |x| turn(angle, x));
                let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
                let last = run(&problem, SOLVERS[0]).last;
                let parts = parts(&problem, &last.state);
                let count = if several { 2 } else { 1 };
                assert_eq!(parts.concat().len(), 6 * degree + 1 + at.len(), "{at:?}, {several}");
                assert_eq!(parts.len(), count);
                let mut before = 0;
                for (i, row) in parts.concat().iter().enumerate() {
                    // At an interface the first row is that of the stripe on its left.
                    let [x, _] = turn(-angle, [row.x, row.y]);
                    let stripe = at.iter().filter(|at| x > **at - 1e-9).count();
                    let is_joint = at.iter().any(|at| (x - at).abs() < 1e-9) && before < stripe;
                    before = stripe;
                    let expected = (1 + stripe - usize::from(is_joint)) as f64;
                    assert!((row.pressure - expected).abs() < 1e-8, "row {i} at {x}: {row:?}");
                }
                let figures = figures(&problem, &last);
                for part in &parts {
                    let name = format!("{}.force_y", part[0].boundary);
                    let force = figures[&name];
                    close_relative(area(part) * angle.cos(), force, 1e-9);
                }
            }
        }
    }
}

/// Beside a clamped node contact goes on up to it: its length and its places say the same, also with one node between two clamps.
#[test]
fn length_and_places_of_contact_beside_clamps_agree() {
    for (degree, cells, left, right) in
        [(1, 2, true, true), (1, 5, true, false), (2, 4, true, true), (1, 5, false, true)]
    {
        let side = |name: &str, is_clamped: bool| match is_clamped {
            true => format!("{{ name = '{name}', displacement = [0, '-0.001*y'] }}"),
            false => format!("{{ name = '{name}', symmetry = true }}"),
        };
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = 200, poisson = 0, plane = 'stress' }}
             boundary = [{}, {}, {{ name = 'bottom', gap = 0 }}, {{ name = 'top', traction = [0, -0.2] }}]",
            side("left", left),
            side("right", right)
        );
        let problem = problem(square(cells), &text).unwrap_or_else(|e| panic!("{e}"));
        let last = run(&problem, SOLVERS[0]).last;
        let figures = figures(&problem, &last);
        let value = |name: &str| figures[&format!("bottom.{name}")];
        close_relative(value("contact_length"), 1.0, 1e-9);
        close_relative(value("contact_end_x") - value("contact_start_x"), 1.0, 1e-9);
        let (rows, _) = problem.supports.contact.rows(&problem.body, &last.state);
        assert_eq!(problem.supports.contact.resolves_length(&rows), Some(true));
    }
}

/// A single active node shows no length, whatever its share of the edges is; two neighbours do.
#[test]
fn a_length_of_single_nodes_is_not_resolved() {
    let row = |active| ContactRow { boundary: "g".into(), active, ..ContactRow::default() };
    let rows = |flags: &[u8]| -> Vec<ContactRow> {
        let place = |(i, &active): (usize, &u8)| ContactRow {
            arc_length: i as f64,
            x: i as f64,
            ..row(active)
        };
        flags.iter().enumerate().map(place).collect()
    };
    let line = signorini::observe::ContactLine::default();
    for (flags, expected) in [
        (&[0, 0, 0][..], None),
        (&[0, 1, 0], Some(false)),
        (&[1, 0, 1], Some(false)),
        (&[0, 1, 1], Some(true)),
        (&[1, 0, 0, 1, 1], Some(true)),
    ] {
        assert_eq!(line.resolves_length(&rows(flags)), expected, "{flags:?}");
    }
}
