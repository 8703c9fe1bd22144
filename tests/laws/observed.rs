//! What is observed beside the fields: resultants of the supports, values at probes, Γ_C as a line.

use crate::support::{bent, close, distorted, figures, moved, problem, run, turn};
use signorini::contact::SOLVERS;
use std::collections::BTreeMap;

/// The figures of the last step by their names, and the resultant of the loads.
fn observed(mesh: signorini::mesh::Mesh, text: &str) -> (BTreeMap<String, f64>, [f64; 3]) {
    let problem = problem(mesh, text).unwrap_or_else(|e| panic!("{e}"));
    let step = run(&problem, "active-set").last;
    let load = problem.load(1.0);
    let mut resultant = [0.0; 3];
    for ([x, y], f) in problem.body.nodes.points.iter().zip(load.chunks(2)) {
        let parts = [f[0], f[1], x * f[1] - y * f[0]];
        resultant.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
    }
    (figures(&problem, &step), resultant)
}

#[test]
fn of_uniform_stress_everything_observed_is_exact() {
    // σ_yy = −p alone: u = p/E (ν x, −y); the bottom carries p on the length 1, at ½ in the mean. The
    // whole is turned about the origin.
    let (p, young, poisson) = (7.0, 200.0, 0.3);
    for (order, angle) in [(1, 0.0), (2, 0.7)] {
        let [x, y] = turn(angle, [0.31, 0.83]);
        let text = format!(
            "discretisation.displacement = {order}
             contact.tolerance = 1e-13
             material = {{ young = {young}, poisson = {poisson}, plane = 'stress' }}
             probe = [{{ name = 'inside', point = [{x}, {y}] }}]
             boundary = [
                {{ name = 'left', symmetry = true }},
                {{ name = 'bottom', gap = 0 }},
                {{ name = 'top', traction = {:?} }},
             ]",
            turn(angle, [0.0, -p]),
        );
        let (observed, _) = observed(moved(distorted(6), |x| turn(angle, x)), &text);
        let [fx, fy] = turn(angle, [0.0, p]);
        let [ux, uy] = turn(angle, [p * poisson / young * 0.31, -p / young * 0.83]);
        // σ = −p n⊗n with n the turned normal.
        let [nx, ny] = turn(angle, [0.0, 1.0]);
        let expected = [
            ("left.force_x", 0.0),
            ("left.force_y", 0.0),
            ("left.moment", 0.0),
            ("bottom.force_x", fx),
            ("bottom.force_y", fy),
            ("bottom.moment", p / 2.0),
            ("inside.u_x", ux),
            ("inside.u_y", uy),
            ("inside.zeta", 1.0),
            ("inside.stress_xx", -p * nx * nx),
            ("inside.stress_yy", -p * ny * ny),
            ("inside.stress_xy", -p * nx * ny),
            ("inside.von_mises", p),
        ];
        expected.iter().for_each(|(name, value)| close(observed[*name], *value, 1e-10));
    }
}

#[test]
fn where_supports_meet_each_exerts_what_it_prescribes() {
    // Uniform σ_yy = −2 between an axis below and a plate above, beside another axis: in whatever order.
    let boundaries = [
        "{ name = 'left', symmetry = true }",
        "{ name = 'bottom', symmetry = true }",
        "{ name = 'top', displacement = ['free', -0.01] }",
    ];
    for [i, j, k] in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
        let text = format!(
            "material = {{ young = 200, poisson = 0.3, plane = 'stress' }}
             boundary = [{}, {}, {}]",
            boundaries[i], boundaries[j], boundaries[k]
        );
        let (observed, _) = observed(distorted(6), &text);
        for (name, force, moment) in [("left", 0.0, 0.0), ("bottom", 2.0, 1.0), ("top", -2.0, -1.0)]
        {
            close(observed[&format!("{name}.force_x")], 0.0, 1e-10);
            close(observed[&format!("{name}.force_y")], force, 1e-10);
            close(observed[&format!("{name}.moment")], moment, 1e-10);
        }
    }
}

#[test]
fn supports_balance_the_loads() {
    // A clamp and an obstacle that meet at a corner, curved sides, a body force.
    for order in [1, 2] {
        let text = format!(
            "discretisation.displacement = {order}
             contact.tolerance = 1e-12
             material = {{ young = 200, poisson = 0.3, plane = 'strain' }}
             body.force = ['3', '-5*x']
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'bottom', gap = '0.001*x' }},
                {{ name = 'top', traction = ['1', '-2'] }},
             ]"
        );
        let mesh = bent(&distorted(6), |[x, y]| [x, y + 0.1 * x * (1.0 - x)]);
        let (observed, load) = observed(mesh, &text);
        for (part, load) in ["force_x", "force_y", "moment"].iter().zip(load) {
            let [clamp, bottom] =
                ["left", "bottom"].map(|name| observed[&format!("{name}.{part}")]);
            assert!(clamp.abs() > 0.01 && (*part == "force_x" || bottom.abs() > 0.01));
            close(clamp + bottom, -load, 1e-9);
        }
    }
}

#[test]
fn rounding_is_shown_as_zero() {
    // The left half of the top is pressed and the right one pulled: part of the bottom is open, the axis
    // exerts no vertical force, and neither does the bottom a horizontal one.
    let text = "material = { young = 30e9, poisson = 0.2, plane = 'strain' }
                boundary = [{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
                            { name = 'right', symmetry = true },
                            { name = 'top', traction = [0, '-4e5*if(x < 0.5, 1, -0.9)'] }]";
    for solver in SOLVERS {
        let problem = problem(distorted(8), text).unwrap_or_else(|e| panic!("{e}"));
        let last = run(&problem, solver).last;
        let rows = problem.supports.contact.rows(&problem.body, &last.state).0;
        let open: Vec<_> = rows.iter().filter(|row| row.active == 0).collect();
        assert!(!open.is_empty() && open.len() < rows.len(), "{solver}");
        assert!(open.iter().all(|row| row.pressure == 0.0), "{solver}: {open:?}");
        assert!(rows.iter().all(|row| row.active == 0 || row.pressure > 0.0));
        let zeros =
            figures(&problem, &last).into_iter().filter(|of| of.1 == 0.0 && of.0.contains("force"));
        let zeros = Vec::from_iter(zeros.map(|of| of.0));
        assert_eq!(zeros, ["bottom.force_x", "left.force_y", "right.force_y"], "{solver}");
    }
}

#[test]
fn a_probe_outside_the_body_is_refused() {
    let text = "material = { young = 200, poisson = 0.3, plane = 'stress' }
                probe = [{ name = 'far', point = [0.5, 1.2] }]
                boundary = [{ name = 'left', displacement = [0, 0] }]";
    let error = problem(distorted(6), text).expect_err("outside").to_string();
    assert!(error.contains("probe.far.point (0.5, 1.2) lies outside the body"), "{error}");
}

/// Strains of linear triangles are constant, so that a point inside each of the triangles at a vertex has its strain.
#[test]
fn a_probe_at_a_vertex_has_the_mean_stress_of_its_triangles() {
    let mesh = distorted(4);
    let distance = |&node: &usize| (mesh.nodes[node][0] - 0.5).hypot(mesh.nodes[node][1] - 0.5);
    let nodes = 0..mesh.nodes.len();
    let vertex = nodes.min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("nodes");
    let around = mesh.triangles.iter().filter(|triangle| triangle.contains(&vertex));
    let centres = around.map(|nodes| {
        [0, 1].map(|k| nodes.iter().map(|&node| mesh.nodes[node][k]).sum::<f64>() / 3.0)
    });
    let centres: Vec<[f64; 2]> = centres.collect();
    let probe =
        |(name, [x, y]): (String, [f64; 2])| format!("{{ name = '{name}', point = [{x}, {y}] }}");
    let inside = centres.iter().enumerate().map(|(i, at)| (format!("t{i}"), *at));
    let probes = inside.chain([("vertex".to_owned(), mesh.nodes[vertex])]).map(probe);
    let text = format!(
        "discretisation.displacement = 1
         material = {{ young = 90, poisson = 0.2, plane = 'stress' }}
         probe = [{}]
         boundary = [
            {{ name = 'bottom', displacement = [0, 0] }},
            {{ name = 'top', traction = ['x^2', '1 - 3*x'] }},
         ]",
        Vec::from_iter(probes).join(", ")
    );
    let (observed, _) = observed(mesh.clone(), &text);
    for component in ["stress_xx", "stress_yy", "stress_xy"] {
        let of = |i: usize| observed[&format!("t{i}.{component}")];
        let values = Vec::from_iter((0..centres.len()).map(of));
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        close(observed[&format!("vertex.{component}")], mean, 1e-10);
        assert!(values.iter().any(|value| (value - mean).abs() > 1e-3), "{values:?}");
    }
}
