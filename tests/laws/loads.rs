//! Nodal loads against the integrals they stand for.

use crate::support::{
    ORDERS, close, curved, curved_area, difference, distorted, history, layered, moved, problem,
    square, turn,
};
use signorini::{
    contact::SOLVERS,
    evolution::ObservedProblem,
    fem::{Body, Edge, Elasticity, TriangleParts, add_body_force, add_traction, parabola},
    mesh::{Mesh, Order},
    model::{Material, Plane},
};

/// Σ load_i and Σ x_i load_i, y_i load_i, component by component: as 1, x and y are in the
/// space, these are ∫f, ∫x f and ∫y f wherever the quadrature is exact for f times an
/// affine function.
fn moments(body: &Body, load: &[f64]) -> [[f64; 3]; 2] {
    [0, 1].map(|k| {
        let mut sums = [0.0; 3];
        for (i, [x, y]) in body.nodes.points.iter().enumerate() {
            for (sum, weight) in sums.iter_mut().zip([1.0, *x, *y]) {
                *sum += weight * load[2 * i + k];
            }
        }
        sums
    })
}

/// Edges in one part each.
fn whole(body: &Body, edges: &[[usize; 2]]) -> impl Iterator<Item = (Edge, [f64; 2])> {
    body.edges(edges).into_iter().map(|edge| (edge, [0.0, 1.0]))
}

/// Adds a force to the loads of a node.
fn add(load: &mut [f64], node: usize, [fx, fy]: [f64; 2]) {
    load[2 * node] += fx;
    load[2 * node + 1] += fy;
}

/// Node `i` of triangle `t`.
fn node(body: &Body, t: usize, i: usize) -> usize {
    body.quadratic_nodes().map_or_else(|| body.mesh.triangles[t][i], |nodes| nodes[t][i])
}

#[test]
fn quadratic_tractions_and_affine_body_forces_are_integrated_exactly() {
    for order in ORDERS {
        let body = Body::new(distorted(5), order);
        let zero = vec![0.0; 2 * body.nodes.points.len()];
        let check = |load: &[f64], expected: [[f64; 3]; 2]| {
            let found = moments(&body, load);
            let pairs = found.as_flattened().iter().zip(expected.as_flattened());
            pairs.for_each(|(value, expected)| close(*value, *expected, 1e-14));
        };
        // On the top, y = 1: f = (1 − 2x + 6x², 3x²). ∫f_x = 1 − 1 + 2, ∫x f_x = 1/2 − 2/3 + 6/4; ∫f_y = 1, ∫x f_y = 3/4.
        let mut load = zero.clone();
        let f = |[x, _]: [f64; 2], _| [1.0 - 2.0 * x + 6.0 * x * x, 3.0 * x * x];
        add_traction(
            &body.nodes.points,
            whole(&body, &body.mesh.curves["top"].edges),
            f,
            &mut |_, node, f| add(&mut load, node, f),
        );
        check(&load, [[2.0, 4.0 / 3.0, 2.0], [1.0, 0.75, 1.0]]);
        // f = (2 − x + 3y, 6y) on the square. ∫xy = 1/4, ∫x² = 1/3.
        let mut load = zero;
        let f = |_, [x, y]: [f64; 2]| [2.0 - x + 3.0 * y, 6.0 * y];
        add_body_force(&body, &TriangleParts::default(), f, &mut |t, i, f| {
            add(&mut load, node(&body, t, i), f)
        });
        check(&load, [[3.0, 17.0 / 12.0, 1.75], [3.0, 1.5, 2.0]]);
    }
}

#[test]
fn a_pressure_all_around_has_no_resultant() {
    // ∮ν = 0 and ∮x × ν = 0 for any closed outline.
    for order in ORDERS {
        let body = Body::new(
            moved(distorted(4), |[x, y]| turn(0.5, [x + 0.3 * y, y - 0.2 * x * y])),
            order,
        );
        let mut load = vec![0.0; 2 * body.nodes.points.len()];
        for curve in body.mesh.curves.values() {
            for edge in &curve.edges {
                add_traction(
                    &body.nodes.points,
                    whole(&body, &[*edge]),
                    |_, normal| normal,
                    &mut |_, node, f| add(&mut load, node, f),
                );
            }
        }
        let [[x, _, moment_x], [y, moment_y, _]] = moments(&body, &load);
        assert!(load.iter().any(|f| f.abs() > 0.1));
        assert!(x.abs() < 1e-15 && y.abs() < 1e-15 && (moment_y - moment_x).abs() < 1e-15);
    }
}

#[test]
fn a_pressure_on_a_curved_boundary_has_the_resultant_and_moment_of_its_ends() {
    // ∫ν ds is the way from end to end turned by −90°, ∫x × ν ds = −½ [|x|²]; on parabolas both
    // are integrals of polynomials of degree three at most.
    let body = Body::new(curved(), Order::Quadratic);
    for curve in body.mesh.curves.values() {
        let mut load = vec![0.0; 2 * body.nodes.points.len()];
        add_traction(
            &body.nodes.points,
            whole(&body, &curve.edges),
            |_, normal| normal,
            &mut |_, node, f| add(&mut load, node, f),
        );
        let ends = curve.edges.iter().map(|edge| edge.map(|node| body.mesh.nodes[node]));
        let square = |[x, y]: [f64; 2]| x * x + y * y;
        let mut expected = [0.0; 3];
        for [p, q] in ends {
            let of_edge = [q[1] - p[1], p[0] - q[0], -0.5 * (square(q) - square(p))];
            expected.iter_mut().zip(of_edge).for_each(|(sum, v)| *sum += v);
        }
        let [[x, _, moment_x], [y, moment_y, _]] = moments(&body, &load);
        for (value, expected) in [x, y, moment_y - moment_x].into_iter().zip(expected) {
            close(value, expected, 1e-14);
        }
    }
}

#[test]
fn a_uniform_stress_is_in_equilibrium_with_its_traction_on_curved_elements() {
    // u = (ax + by, cx + dy): ∫σ : ε(φ_i) = ∫_∂Ω σν·φ_i, to round-off by both quadratures.
    let body = Body::new(curved(), Order::Quadratic);
    let elasticity = Elasticity::new([Material {
        young: 3.0,
        poisson: 0.3,
        plane: Plane::Strain,
        density: 0.0,
    }]);
    let u: Vec<f64> = (body.nodes.points.iter())
        .flat_map(|[x, y]| [0.2 * x + 0.7 * y, 0.1 * x - 0.4 * y])
        .collect();
    let ones = vec![1.0; 3 * body.triangles.len()];
    let force = elasticity.internal_force(&body, &ones, &u);
    let stress = elasticity.stresses(&body, &ones, &u)[0];
    let mut load = vec![0.0; u.len()];
    for curve in body.mesh.curves.values() {
        let traction = |_, [nx, ny]: [f64; 2]| {
            [stress[0] * nx + stress[2] * ny, stress[2] * nx + stress[1] * ny]
        };
        add_traction(
            &body.nodes.points,
            whole(&body, &curve.edges),
            traction,
            &mut |_, node, f| add(&mut load, node, f),
        );
    }
    let error = difference(&load, &force);
    assert!(error < 1e-13, "{error}");
}

#[test]
fn body_forces_on_curved_elements_have_their_resultant() {
    // x and the Jacobian are quadratic: a uniform f is integrated exactly.
    let body = Body::new(curved(), Order::Quadratic);
    let mut load = vec![0.0; 2 * body.nodes.points.len()];
    add_body_force(&body, &TriangleParts::default(), |_, _| [2.0, -3.0], &mut |t, i, f| {
        add(&mut load, node(&body, t, i), f)
    });
    let [[x, ..], [y, ..]] = moments(&body, &load);
    let area = curved_area(&body.mesh);
    close(x, 2.0 * area, 1e-14);
    close(y, -3.0 * area, 1e-14);
    close(body.area, area, 1e-14);
    // ζ lives on the straight triangles.
    let straight: f64 = body.triangles.iter().map(|triangle| triangle.area()).sum();
    close(body.vertices.area, straight, 1e-14);
    assert!((area - straight).abs() > 1e-4);
}

#[test]
fn the_weights_of_the_nodes_add_up_to_the_area() {
    for order in ORDERS {
        let body = Body::new(distorted(6), order);
        close(body.nodes.weights.iter().sum(), 1.0, 1e-14);
        let affine: Vec<f64> = body.mesh.nodes.iter().map(|[x, y]| 1.0 + 2.0 * x - y).collect();
        close(body.mean(&affine), 1.5, 1e-14);
        let affine = body.at_nodes(&affine);
        close(affine.iter().zip(&body.nodes.weights).map(|(v, w)| v * w).sum(), 1.5, 1e-14);
    }
}

#[test]
fn the_weights_of_quadratic_nodes_are_those_of_the_midpoints() {
    // ∫φ_i on straight triangles: 0 at the vertices, a third of each triangle at the middle of a side.
    let body = Body::new(distorted(6), Order::Quadratic);
    let (vertices, midpoints) = body.nodes.weights.split_at(body.mesh.nodes.len());
    assert!(vertices.iter().all(|weight| weight.abs() < 1e-16));
    assert!(midpoints.iter().all(|weight| *weight > 0.0));
    // ∫x² + y² = 2/3, ∫|x − x̄|² = 1/6.
    let square = |([x, y], weight): (&[f64; 2], &f64)| weight * (x * x + y * y);
    close(body.nodes.points.iter().zip(&body.nodes.weights).map(square).sum(), 2.0 / 3.0, 1e-14);
    close(body.polar_inertia, 1.0 / 6.0, 1e-14);
}

#[test]
fn the_force_of_a_pressure_that_ends_within_an_edge_is_that_of_its_length() {
    // It spreads over the top of four edges; by the two Gauss points of each it would grow in leaps of ½ · ¼.
    for degree in [1, 2] {
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             time = {{ end = 1, step = 0.02 }}
             boundary = [
                {{ name = 'left', symmetry = true }},
                {{ name = 'bottom', gap = 0 }},
                {{ name = 'top', pressure = 'if(x < t, 1, 0)' }},
             ]"
        );
        let problem = problem(square(4), &text).unwrap_or_else(|e| panic!("{e}"));
        for step in history(&problem, SOLVERS[0]).0 {
            let (force, t) = (step.record.contact_force, step.record.time);
            assert!((force - t).abs() < 1e-5, "P{degree}: {force} at t = {t}");
        }
    }
}

/// The square of n cells a side, clamped at its bottom, under `loads`, at the order `degree`.
fn loaded(mesh: Mesh, degree: usize, loads: &str) -> ObservedProblem {
    let text = format!(
        "discretisation.displacement = {degree}
         material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         time = {{ end = 1, step = 0.25 }}
         {loads}"
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// ∫f_x, ∫f_y and ∫x f_y − y f_x of the load at time t.
fn resultant(problem: &ObservedProblem, t: f64) -> [f64; 3] {
    let [[x, _, moment_x], [y, moment_y, _]] = moments(&problem.body, &problem.load(t));
    [x, y, moment_y - moment_x]
}

#[test]
fn loads_that_are_narrow_jump_or_roll_have_their_resultant_and_moment() {
    // On the top of the square: ∫f dx and ∫x f dx by hand; −∫y f_x is that of a load in y alone, 0.
    let sqrt_pi = std::f64::consts::PI.sqrt();
    type Expected<'a> = &'a dyn Fn(f64) -> [f64; 2];
    let cases: [(&str, Expected); 6] = [
        ("if(abs(x - 0.6137) < 0.001, 500, 0)", &|_| [1.0, 0.6137]),
        ("exp(-((x - 0.31)/0.001)^2)/0.001", &|_| [sqrt_pi, 0.31 * sqrt_pi]),
        ("if(x < t, 1, 0)", &|t| [t, 0.5 * t * t]),
        // Both at once; the second is a hundred thousand times as narrow as the square.
        ("1 + 1e5*if(abs(x - 0.77) < 0.5e-5, 1, 0)", &|_| [2.0, 0.5 + 0.77]),
        ("max(0, 1 - abs(x - 0.2 - 0.6*t)/0.01)/0.01", &|t| [1.0, 0.2 + 0.6 * t]),
        // Hidden from the middle, the ends and the Gauss points of any edge; the moment of a couple.
        ("sin(2*pi*x*1000)^2", &|_| [0.5, 0.25]),
    ];
    for (degree, n) in [(1, 1), (1, 4), (2, 1), (2, 4)] {
        for (load, expected) in &cases {
            let boundary = "boundary = [{ name = 'bottom', displacement = [0, 0] }, ";
            let text = format!("{boundary} {{ name = 'top', traction = [0, '{load}'] }}]");
            let problem = loaded(square(n), degree, &text);
            for t in [0.25, 0.5, 1.0] {
                let ([_, force, moment], expected) = (resultant(&problem, t), expected(t));
                let tolerance = 3e-6 * expected[0];
                assert!((force - expected[0]).abs() < tolerance, "P{degree}, {n}: {load}: {force}");
                assert!(
                    (moment - expected[1]).abs() < tolerance,
                    "P{degree}, {n}: {load}: {moment}"
                );
            }
        }
    }
}

#[test]
fn a_narrow_pressure_on_a_curved_edge_has_the_resultant_of_its_chord() {
    // The pressure on a piece of a curve is that on its chord, turned by 90°.
    let problem = loaded(
        curved(),
        2,
        "boundary = [{ name = 'bottom', displacement = [0, 0] },
                     { name = 'top', pressure = 'if(x > 0.71 and x < 0.714, 1, 0)' }]",
    );
    let mesh = &problem.body.mesh;
    let y = |x: f64| {
        let on = mesh.curves["top"].edges.iter().find_map(|edge| {
            let [p, m, q] = [mesh.nodes[edge[0]], mesh.midpoint(*edge), mesh.nodes[edge[1]]];
            let at = |s| parabola([p, m, q], s);
            if (p[0] - x) * (q[0] - x) > 0.0 {
                return None;
            }
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let s = 0.5 * (low + high);
                if (at(s)[0] - x) * (p[0] - x) > 0.0 { low = s } else { high = s }
            }
            Some(at(low)[1])
        });
        on.expect("the top is there")
    };
    let [fx, fy, _] = resultant(&problem, 0.0);
    let expected = [y(0.714) - y(0.71), 0.71 - 0.714];
    let error = (fx - expected[0]).hypot(fy - expected[1]);
    assert!(error < 1e-5 * 0.004, "{fx}, {fy} is not {expected:?}");
}

#[test]
fn body_forces_narrower_than_triangles_have_their_resultant_and_moment_or_a_note() {
    let pi = std::f64::consts::PI;
    let bump = "exp(-((x - 0.31)^2 + (y - 0.6)^2)/0.01^2)/0.01^2".to_owned();
    let mut cases = vec![(bump, [pi, 0.31 * pi], 1e-3)];
    // Strips across the triangles and along their sides. Those that need too many parts are noted.
    for (at, width) in [0.6137, 1.0 / 3.0]
        .into_iter()
        .flat_map(|at| [0.1, 0.01, 1e-3, 1e-4, 1e-6].map(|width| (at, width)))
    {
        let strip = format!("if(abs(x - {at}) < {}, {}, 0)", 0.5 * width, 1.0 / width);
        cases.push((strip, [1.0, at], 3e-3));
    }
    // What depends on time is divided less, as it is integrated in each step.
    for (force, expected, tolerance) in cases {
        for (degree, in_time) in [(1, ""), (2, ""), (1, "*cos(t)"), (2, "*cos(t)")] {
            let boundary = "boundary = [{ name = 'bottom', displacement = [0, 0] }]";
            let text = format!("body.force = [0, '{force}{in_time}']\n{boundary}");
            let problem = loaded(square(3), degree, &text);
            let noted = problem.notes().iter().any(|note| note.contains("body force changes too"));
            let [_, sum, moment] = resultant(&problem, 0.0);
            for (value, expected) in [sum, moment].into_iter().zip(expected) {
                let error = (value - expected).abs() / expected;
                let case = format!("P{degree}: {force}{in_time}: {value}, {expected}");
                assert!(noted || error < tolerance, "{case}");
                assert!(!noted || error > 1e-4, "noted without need: {case}");
            }
        }
    }
}

#[test]
fn loads_that_are_too_narrow_to_be_integrated_are_noted() {
    let notes = |load: &str| {
        let boundary = "boundary = [{ name = 'bottom', displacement = [0, 0] }";
        let text = match load.split_once(' ') {
            Some(("body", force)) => format!("body.force = [0, '{force}']\n{boundary}]"),
            Some((_, force)) => {
                format!("{boundary}, {{ name = 'top', traction = [0, '{force}'] }}]")
            }
            None => panic!("{load}"),
        };
        loaded(square(8), 1, &text).notes()
    };
    for (load, fragment) in [
        ("body if(abs(y - 0.3*x - 0.2) < 1e-6, 1, 0)", "the body force changes too sharply"),
        ("body if(abs(y - 0.3*x - 0.2) < 5e-4, 1, 0)", "% of it may be missed; refine the mesh"),
        ("top sin(1e6*x)^2", "the surface load changes too sharply"),
    ] {
        let notes = notes(load);
        assert!(notes.len() == 1 && notes[0].contains(fragment), "{load}: {notes:?}");
    }
    for smooth in ["body x*(1 - x)*sin(3*y)", "body if(x^2 + y^2 < 0.3, 1, 0)", "top exp(-x)*x"] {
        assert_eq!(notes(smooth), [""; 0], "{smooth}");
    }
}

#[test]
fn the_units_of_a_narrow_load_do_not_matter() {
    let force = |scale: f64| {
        let text = format!(
            "boundary = [{{ name = 'bottom', displacement = [0, 0] }},
                         {{ name = 'top', traction = [0, '{scale:e}*if(abs(x - 0.6137) < 0.001, 500, 1)'] }}]"
        );
        resultant(&loaded(square(2), 1, &text), 0.0)[1] / scale
    };
    let [one, large, small] = [1.0, 1e12, 1e-12].map(force);
    close(large, one, 1e-12);
    close(small, one, 1e-12);
}

/// Weights ρ A g of two surfaces, ρ = 2 on the lower half and 5 on the upper one, under gravity that turns.
#[test]
fn gravity_pulls_on_each_material_by_its_density() {
    for degree in [1, 2] {
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = 1, poisson = 0, plane = 'stress', density = 2, upper.density = 5 }}
             time = {{ end = 1, step = 0.5 }}
             body = {{ force = [0, 1], gravity = ['10*sin(t)', '-10*cos(t)'] }}
             boundary = [{{ name = 'bottom', displacement = [0, 0] }}]"
        );
        let problem = problem(layered(square(4)), &text).unwrap_or_else(|e| panic!("{e}"));
        for t in [0.0, 0.5, 1.0_f64] {
            let [x, y, moment] = resultant(&problem, t);
            let (gx, gy) = (10.0 * t.sin(), -10.0 * t.cos());
            close(x, 3.5 * gx, 1e-12);
            close(y, 3.5 * gy + 1.0, 1e-12);
            // The weights 1 and 2.5 act at (½, ¼) and (½, ¾), the force 1 at (½, ½).
            close(moment, 0.5 * y - (0.25 + 2.5 * 0.75) * gx, 1e-12);
        }
    }
}
