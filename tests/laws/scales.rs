//! What counts as large: gaps much wider than displacements, loads that pass zero, and obstacles
//! on both sides of a node. No right answer is refused.

use crate::support::{
    close, close_relative, difference, distorted, history, largest, moved, problem, run, square,
    try_run, turn,
};
use signorini::{
    contact::SOLVERS,
    evolution::ObservedProblem,
    mesh::{Curve, Mesh},
};

/// A block on rollers at its left, falling onto a level foundation under its weight.
fn falling(gap: f64) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 30e9, poisson = 0.2, plane = 'strain' }}
         body.force = [0, -25e3]
         boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = {gap:e} }}]"
    );
    problem(distorted(6), &text).unwrap()
}

#[test]
fn a_body_that_falls_through_a_gap_deforms_as_if_there_were_none() {
    // u(g) = u(0) − g e_y, however small u(0) is against g: 4e-7 m here.
    for solver in SOLVERS {
        let resting = run(&falling(0.0), solver).last;
        let size = largest(&resting.state.u);
        for gap in [1e-9, 1e-6, 1e-3, 0.01, 10.0, 400.0] {
            let fallen = run(&falling(gap), solver).last;
            let off = fallen.state.u.iter().zip(&resting.state.u).enumerate();
            let off = off.fold(0.0_f64, |worst, (i, (u, v))| {
                worst.max((u - v + if i % 2 == 1 { gap } else { 0.0 }).abs())
            });
            // Rounding of u itself is 1e-16 of the gap.
            assert!(off < 1e-9 * size + 2e-16 * gap, "{solver}, {gap} m: {:.1e}", off / size);
            close(fallen.record.contact_force / 25e3, 1.0, 1e-9);
            assert!(fallen.record.kkt().worst() <= 1e-10);
        }
    }
}

#[test]
fn a_load_that_passes_zero_leaves_what_a_linear_body_leaves_nothing() {
    // Far from the obstacle u is proportional to the load; at its zeros 1e-16 of it is left.
    let text = "
        material = { young = 210e9, poisson = 0.3, plane = 'stress' }
        time = { end = 1, step = 0.125 }
        boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'bottom', gap = 0.01 },
            { name = 'top', traction = [0, '-1e4*sin(2*pi*t)'] },
        ]";
    for solver in SOLVERS {
        let problem = problem(distorted(5), text).unwrap();
        let (steps, _) = history(&problem, solver);
        let most = &steps[2].state.u;
        for step in &steps {
            let factor = (std::f64::consts::TAU * step.state.time).sin();
            let off = step.state.u.iter().zip(most).map(|(u, v)| (u - factor * v).abs());
            assert!(
                off.fold(0.0, f64::max) < 1e-9 * largest(most),
                "{solver}: {}",
                step.state.time
            );
            assert_eq!(step.record.active_nodes, 0);
        }
    }
}

/// A wedge, its tip at the origin, between two plates along its axis; turned by an angle.
fn wedge(angle: f64, slope: f64, gap: f64) -> ObservedProblem {
    let n = 8;
    // Row i of the wedge has i + 1 nodes.
    let first = |i: usize| i * (i + 1) / 2;
    let place = |i: usize, j: usize| {
        let x = 2.0 * i as f64 / n as f64;
        [x, slope * x * (2.0 * j as f64 / i.max(1) as f64 - if i > 0 { 1.0 } else { 0.0 })]
    };
    let nodes = (0..=n).flat_map(|i| (0..=i).map(move |j| place(i, j))).collect();
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..=i {
            let (a, b) = (first(i) + j, first(i + 1) + j);
            triangles.push([a, b, b + 1]);
            if j < i {
                triangles.push([a, b + 1, a + 1]);
            }
        }
    }
    let curve = |edges: Vec<[usize; 2]>| Curve { edges, other_edges: 0 };
    let lower = (0..n).map(|i| [first(i), first(i + 1)]).collect();
    let upper = (0..n).map(|i| [first(i + 1) + i + 1, first(i) + i]).collect();
    let end = (0..n).map(|j| [first(n) + j, first(n) + j + 1]).collect();
    let curves = [("lower", curve(lower)), ("upper", curve(upper)), ("end", curve(end))];
    let curves = curves.map(|(n, c)| (n.to_owned(), c)).into();
    let mesh = Mesh { nodes, triangles, curves, ..Mesh::default() };
    let [fx, fy] = turn(angle, [0.01, 0.003]);
    let [nx, ny] = turn(angle, [0.0, 1.0]);
    let text = format!(
        "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
         body.force = [{fx:e}, {fy:e}]
         boundary = [
            {{ name = 'end', displacement = [0, 0] }},
            {{ name = 'lower', gap = {gap:e}, normal = [{:e}, {:e}] }},
            {{ name = 'upper', gap = {gap:e}, normal = [{nx:e}, {ny:e}] }},
         ]",
        -nx, -ny
    );
    problem(moved(mesh, |x| turn(angle, x)), &text).unwrap()
}

#[test]
fn a_tip_between_two_plates_stays_between_them_whichever_way_they_lie() {
    for gap in [0.0, 0.001, 0.003] {
        let level = run(&wedge(0.0, 0.2, gap), SOLVERS[0]).last.state;
        for solver in SOLVERS {
            for angle in [0.0, 0.4, 1.3] {
                let state = run(&wedge(angle, 0.2, gap), solver).last.state;
                let back: Vec<f64> =
                    (state.u.as_chunks::<2>().0.iter()).flat_map(|&u| turn(-angle, u)).collect();
                assert!(difference(&back, &level.u) < 1e-8, "{solver}, turned by {angle}");
                assert!(back[1].abs() <= gap + 1e-10 * largest(&back), "{solver}: {}", back[1]);
                assert!(back[0].abs() > 1e-3, "the tip is pushed along the plates");
                let at_tip = state.contact.iter().filter(|point| point.node == 0);
                assert_eq!(at_tip.count(), 2, "each plate has its own gap and pressure");
            }
        }
    }
}

/// Numbers whose squares underflow have zero residuals whatever u is: they are refused. Others scale with their units.
#[test]
fn what_double_precision_cannot_square_is_refused() {
    let text = |young: f64, load: f64, top: f64| {
        format!(
            "material = {{ young = {young:e}, poisson = 0.3, plane = 'stress' }}
             boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = 0 }},
                         {{ name = 'top', {} }}]",
            match top {
                0.0 => format!("traction = [0, '{load:e}']"),
                _ => format!("displacement = ['free', '{top:e}']"),
            }
        )
    };
    let run = |text: &str| try_run(&problem(square(3), text).unwrap(), SOLVERS[0]);
    for (young, load, top) in [
        (1.0, -1e-300, 0.0),
        (1e5, -1e-170, 0.0),
        (1e-300, -1e-300, 0.0),
        (1e-300, 0.0, -1e-3),
        (1.0, 0.0, -1e-300),
        (1e100, -1e-99, 0.0),
    ] {
        let message = run(&text(young, load, top)).err().map(|error| error.to_string());
        let message =
            message.unwrap_or_else(|| panic!("E = {young:e}, {load:e}, {top:e}: no error"));
        assert!(message.contains("material.young") || message.contains("units"), "{message}");
    }
    // Uniform compression σ = −p: u_y = −p/E at the top.
    for (young, load) in [(1e-60, -1e-60), (1e60, -1e60), (1e-30, -1e-40)] {
        let found = run(&text(young, load, 0.0)).unwrap_or_else(|error| panic!("{error}"));
        let top = found.last.state.u.chunks_exact(2).map(|u| -u[1]).fold(0.0, f64::max);
        close_relative(top, -load / young, 1e-9);
    }
}
