//! The proved bound on the error of u: never below the true error, and not far above it.
//!
//! The true error is that against the answer of second order on the mesh bisected twice, with the same ζ. The study
//! `validation/bounds.py` has many more scenes.

use crate::support::{ORDERS, distorted, layered, moved, problem, square, turn, unstructured};
use nalgebra::{DMatrix, DVector, Vector3};
use signorini::{
    estimate::{EquilibratedStress, Simulation},
    evolution::{ContactStep, RunOptions, State},
    fem::{Body, Location},
    mesh::{Mesh, Order, Refinement},
    observe::ObservedProblem,
    petsc::Session,
};
use std::collections::HashMap;

/// Damage that stays as it begins.
fn lasting_damage(initial: &str) -> String {
    format!(
        "[damage]
         diffusion = 1e-9
         lambda_d = 0
         lambda_u = 0
         lambda_w = 0
         strain_cap = 1
         threshold = 0.01
         initial = '{initial}'
         [time]
         end = 1e-6
         step = 1e-6"
    )
}

/// ‖v‖² of nodal v.
fn square_norm(problem: &ObservedProblem, zeta: &[f64], v: &[f64]) -> f64 {
    let zeta = problem.zeta_at_points(zeta);
    problem.elasticity.energies(&problem.body, &zeta, v).iter().sum()
}

/// The true error of a state, relative, in the energy norm.
fn true_error(problem: &ObservedProblem, state: &State) -> f64 {
    let (body, mut finer) = (&problem.body, Refinement::start(problem.body.mesh.clone()));
    let (mut zeta, mut parents) = (state.zeta.clone(), Vec::from_iter(0..body.triangles.len()));
    for _ in 0..2 {
        finer = finer.refine_everywhere().unwrap();
        parents = finer.parent_of_triangle.iter().map(|&parent| parents[parent]).collect();
        let mean = |&[a, b]: &[usize; 2]| 0.5 * (zeta[a] + zeta[b]);
        let new = Vec::from_iter(finer.halved_edges.iter().map(mean));
        zeta.extend(new);
    }
    let mut scene = problem.scene().clone();
    scene.order = Order::Quadratic;
    let fine = ObservedProblem::new(scene, finer.mesh).unwrap();
    let session = Session::start(&[]).unwrap();
    let run_options = RunOptions::of(fine.scene());
    let mut step = ContactStep::new(&session, &fine, &run_options).unwrap();
    let exact = step.solve(0, state.time, &zeta).unwrap().state.u;
    let difference = difference(body, &state.u, &fine.body, &parents, &exact);
    let own = square_norm(problem, &state.zeta, &state.u);
    (square_norm(&fine, &zeta, &difference) / own).sqrt()
}

/// `exact` − u at the nodes of a finer body, whose triangles lie in those of `parents`.
fn difference(body: &Body, u: &[f64], finer: &Body, parents: &[usize], exact: &[f64]) -> Vec<f64> {
    let (mut difference, zeta) = (exact.to_vec(), vec![1.0; body.mesh.nodes.len()]);
    for (nodes, &parent) in finer.quadratic_nodes().unwrap().iter().zip(parents) {
        let from = body.mesh.nodes[body.mesh.triangles[parent][0]];
        let gradients = body.triangles[parent].gradients();
        for &node in nodes {
            let [dx, dy] = [0, 1].map(|k| finer.nodes.points[node][k] - from[k]);
            let part = |i: usize| gradients[i][0] * dx + gradients[i][1] * dy;
            let barycentric = [1.0 + part(0), part(1), part(2)];
            let at = Location { triangle: parent, barycentric };
            let own = at.values(body, parent, u, &zeta).u;
            (0..2).for_each(|k| difference[2 * node + k] = exact[2 * node + k] - own[k]);
        }
    }
    difference
}

/// The proved bound of a scene, with the true error.
fn errors(mesh: Mesh, text: &str) -> [f64; 2] {
    let problem = problem(mesh, text).unwrap_or_else(|e| panic!("{e}"));
    let outcome = Simulation::new(&problem).bound().run(&Session::start(&[]).unwrap()).unwrap();
    let errors = &outcome.errors;
    let bound = errors.displacement_bound.unwrap_or_else(|| panic!("{:?}", errors.reservations));
    [bound, true_error(&problem, &outcome.last.state)]
}

/// Is the bound at least the error, and at most `most` times as large?
fn bounds(mesh: Mesh, text: &str, most: f64) {
    for order in 1..=2 {
        let text = format!("discretisation.displacement = {order}\n{text}");
        let [bound, truth] = errors(mesh.clone(), &text);
        println!("P{order}: {bound:.4} proved, {truth:.4} true, ratio {:.3}", bound / truth);
        assert!(bound >= truth * (1.0 - 1e-9), "{bound} < {truth}\n{text}");
        assert!(bound <= most * truth, "{bound} > {most} × {truth}\n{text}");
    }
}

#[test]
fn it_is_rounding_where_the_element_has_the_exact_answer() {
    // Uniform tension, and pressure on a foundation between a clamp's side and a free one.
    let pulled = "material = { young = 3, poisson = 0.3, plane = 'strain' }
         boundary = [
            { name = 'left', symmetry = true },
            { name = 'bottom', gap = 0 },
            { name = 'top', traction = [0, -0.1] },
         ]";
    for mesh in [square(3), distorted(4), unstructured(0.2)] {
        for degree in 1..=2 {
            let text = format!("discretisation.displacement = {degree}\n{pulled}");
            let problem = problem(mesh.clone(), &text).unwrap();
            let outcome =
                Simulation::new(&problem).bound().run(&Session::start(&[]).unwrap()).unwrap();
            let bound = outcome.errors.displacement_bound.unwrap();
            assert!(bound < 1e-7, "P{degree}, {} triangles: {bound:e}", mesh.triangles.len());
        }
    }
}

#[test]
fn it_is_above_the_error_of_clamped_bodies_with_loads_of_all_kinds() {
    let scene = |more: &str| {
        format!(
            "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             {more}"
        )
    };
    let clamped = "boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'right', traction = [1, 0.3] },
         ]";
    for mesh in [square(4), distorted(5), unstructured(0.2)] {
        bounds(mesh, &scene(clamped), 2.0);
    }
    // A body force, a pressure, an axis, and a side that slides along an inclined wall.
    let others = "body = { force = [0.5, -1] }
         boundary = [
            { name = 'left', symmetry = true },
            { name = 'top', pressure = 0.4 },
            { name = 'right', displacement = ['free', 0.01] },
         ]";
    bounds(distorted(5), &scene(others), 2.0);
}

#[test]
fn it_is_above_the_error_with_contact() {
    let pressed = |foundation: &str, right: &str| {
        format!(
            "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'bottom', {foundation} }},
                {{ name = 'right', {right} }},
             ]"
        )
    };
    for (foundation, right, most) in [
        ("gap = 0", "traction = [0.5, -1]", 2.5),
        ("gap = 0.004", "traction = [0, -1]", 2.5),
        ("gap = 0, normal = [0.1, -1]", "traction = [0.5, -1]", 2.5),
        // The gap is affine, and the body touches at one corner.
        ("gap = '0.01*(1 - x)'", "traction = [0, -0.2]", 4.0),
    ] {
        bounds(distorted(6), &pressed(foundation, right), most);
    }
    // Contact alone holds the body.
    let loose = "material = { young = 100, poisson = 0.3, plane = 'stress' }
         boundary = [
            { name = 'left', gap = 0 },
            { name = 'bottom', gap = 0 },
            { name = 'top', traction = [0, -1] },
            { name = 'right', traction = [-0.4, 0] },
         ]
         body = { force = [0, '-0.3'] }";
    bounds(distorted(5), loose, 4.0);
}

#[test]
fn it_is_above_the_error_where_a_clamped_end_of_a_foundation_has_an_open_gap() {
    // Γ_C begins or ends at a clamp that keeps its node away from the obstacle, also by a displacement of its own.
    for angle in [0.0_f64, 0.4, 2.0] {
        let [c, s] = turn(angle, [1.0, 0.0]);
        let x = format!("({c}*x + {s}*y)");
        let load = turn(angle, [0.0, -0.01]);
        let rise = turn(angle, [0.0, 0.2]);
        for (clamp, gap) in [
            ("[0, 0]".to_owned(), format!("1 - {x}")),
            ("[0, 0]".to_owned(), format!("0.1*(1 - {x})")),
            (format!("{rise:?}"), format!("0.3*(1 - {x})")),
            (format!("{rise:?}"), "0".to_owned()),
        ] {
            for (mesh, other) in [(square(1), ""), (square(2), ""), (distorted(3), "right")] {
                let other = match other {
                    "" => String::new(),
                    name => format!("{{ name = '{name}', displacement = {clamp} }},"),
                };
                let text = format!(
                    "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
                     boundary = [
                        {{ name = 'left', displacement = {clamp} }}, {other}
                        {{ name = 'bottom', gap = '{gap}' }},
                        {{ name = 'top', traction = {load:?} }},
                     ]"
                );
                // Pressure on whole edges, whose gap is open, makes a bound that is far too large.
                bounds(moved(mesh, |x| turn(angle, x)), &text, f64::INFINITY);
            }
        }
    }
}

#[test]
fn materials_and_compressibility_and_damage_do_not_break_it() {
    let clamped = |material: &str, more: &str| {
        format!(
            "material = {{ {material} }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'right', traction = [0.4, -1] }},
             ]
             {more}"
        )
    };
    for poisson in ["0", "0.49", "0.4999", "0.499999"] {
        let material = format!("young = 100, poisson = {poisson}, plane = 'strain'");
        bounds(distorted(5), &clamped(&material, ""), 6.0);
    }
    for contrast in ["1e-3", "1e3", "1e6"] {
        let material =
            format!("young = 1, poisson = 0.3, plane = 'stress', upper.young = {contrast}");
        let text = clamped(&material, "").replace("[0.4, -1]", "[1e-3, 0]");
        bounds(layered(Mesh::rectangle(1.0, 1.0, 6, 6)), &text, 4.0);
    }
    // ζ from its threshold to 1: the damage stays as it begins.
    let material = "young = 100, poisson = 0.3, plane = 'stress'";
    bounds(square(5), &clamped(material, &lasting_damage("0.02 + 0.98*x")), 3.0);
}

#[test]
fn what_the_proof_leaves_out_is_named() {
    let scene = |force: &str, gap: &str| {
        format!(
            "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'bottom', gap = '{gap}' }},
                {{ name = 'right', traction = [0, '{force}'] }},
             ]"
        )
    };
    for (force, gap, named) in [
        ("-1", "0", &[][..]),
        ("-1 - y", "0.001*x", &[]),
        ("-exp(3*y)", "0", &["loads vary within triangles"]),
        // Bands and peaks between the nodes, jumps and kinks between and at them.
        ("if(y > 0.51 and y < 0.511, -100, 0)", "0", &["loads vary within triangles"]),
        ("-100*exp(-((y - 0.62)/0.003)^2)", "0", &["loads vary within triangles"]),
        ("-min(y, 0.3)", "0", &["loads vary within triangles"]),
        ("-min(y, 0.5) - x*y/2", "0", &[]),
        ("if(y < 0.25, -1, -2)", "max(0, x - 0.5)", &[]),
        ("-1", "0.01*x^3", &["gaps or displacements vary between nodes"]),
    ] {
        for order in ORDERS {
            let text = format!("discretisation.displacement = {}\n", order as usize + 1);
            let problem = problem(square(4), &(text + &scene(force, gap))).unwrap();
            let outcome =
                Simulation::new(&problem).bound().run(&Session::start(&[]).unwrap()).unwrap();
            assert_eq!(outcome.errors.reservations, named, "{force}, {gap}");
        }
    }
}

/// A polynomial of degree k in x and y for each component of a stress.
struct Polynomial {
    degree: usize,
    coefficients: DMatrix<f64>,
}

impl Polynomial {
    fn monomials(degree: usize, [x, y]: [f64; 2]) -> Vec<f64> {
        let all = [1.0, x, y, x * x, x * y, y * y];
        all[..if degree == 1 { 3 } else { 6 }].to_vec()
    }

    /// The polynomial with these values at seven points of a part of a triangle.
    fn through(degree: usize, points: &[([f64; 2], Vector3<f64>); 7]) -> Self {
        let rows =
            points.iter().map(|(at, _)| DVector::from(Self::monomials(degree, *at)).transpose());
        let rows = DMatrix::from_rows(&Vec::from_iter(rows));
        let values = points.map(|(_, stress)| stress.transpose());
        let values = DMatrix::from_fn(7, 3, |i, j| values[i][j]);
        let coefficients = rows.clone().pseudo_inverse(1e-13).unwrap() * &values;
        assert!((rows * &coefficients - &values).amax() < 1e-8 * values.amax().max(1.0));
        Self { degree, coefficients }
    }

    /// The traction τn at a place.
    fn traction(&self, at: [f64; 2], [n, m]: [f64; 2]) -> [f64; 2] {
        let values =
            DVector::from(Self::monomials(self.degree, at)).transpose() * &self.coefficients;
        [values[0] * n + values[2] * m, values[2] * n + values[1] * m]
    }

    /// div τ at a place.
    fn divergence(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let slope = |derivatives: [f64; 6], component: usize| {
            let column = self.coefficients.column(component);
            column.iter().zip(derivatives).map(|(c, d)| c * d).sum::<f64>()
        };
        let [by_x, by_y] = [[0.0, 1.0, 0.0, 2.0 * x, y, 0.0], [0.0, 0.0, 1.0, 0.0, x, 2.0 * y]];
        [slope(by_x, 0) + slope(by_y, 2), slope(by_x, 2) + slope(by_y, 1)]
    }
}

/// A place between two.
fn along([a, b]: [[f64; 2]; 2], s: f64) -> [f64; 2] {
    [0, 1].map(|k| a[k] + s * (b[k] - a[k]))
}

/// The unit normal to the right of the way from one place to another.
fn normal([a, b]: [[f64; 2]; 2]) -> [f64; 2] {
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    [(b[1] - a[1]) / length, (a[0] - b[0]) / length]
}

fn near(a: [f64; 2], b: [f64; 2], what: &str) {
    assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-7, "{what}: {a:?}, {b:?}");
}

/// Where tractions of a side are compared.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];

/// Checks −div τ = `force` in each part of each triangle, and that τn is continuous between them. Returns the tractions at the
/// places of each side, with the normal to the right for its nodes in increasing order, and the pressures.
#[allow(clippy::type_complexity)]
fn balanced(
    mesh: Mesh,
    text: &str,
    force: [f64; 2],
) -> (HashMap<[usize; 2], [[f64; 2]; 3]>, Vec<([[f64; 2]; 2], [f64; 3])>) {
    let problem = problem(mesh, text).unwrap_or_else(|e| panic!("{e}"));
    let degree = problem.scene().order as usize + 1;
    let session = Session::start(&[]).unwrap();
    let state = Simulation::new(&problem).run(&session).unwrap().last.state;
    let run_options = RunOptions::of(problem.scene());
    let mut step = ContactStep::new(&session, &problem, &run_options).unwrap();
    let state = step.solve(0, state.time, &state.zeta).unwrap().state;
    let mut stress = EquilibratedStress::new(&mut step, &state).unwrap().unwrap();
    stress.improve();
    let mesh = &problem.body.mesh;
    let mut sides = HashMap::<[usize; 2], [[f64; 2]; 3]>::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let parts = stress.stresses(t).map(|points| Polynomial::through(degree, &points));
        let corners = triangle.map(|node| mesh.nodes[node]);
        let centroid = [0, 1].map(|k| corners.iter().map(|x| x[k]).sum::<f64>() / 3.0);
        for (s, part) in parts.iter().enumerate() {
            for at in [corners[s], corners[(s + 1) % 3], centroid] {
                near(part.divergence(at), force.map(|f| -f), "div τ");
            }
            let (spoke, before) = ([corners[s], centroid], &parts[(s + 2) % 3]);
            for place in PLACES {
                let (at, n) = (along(spoke, place), normal(spoke));
                near(part.traction(at, n), before.traction(at, n), "between parts");
            }
            let mut nodes = [triangle[s], triangle[(s + 1) % 3]];
            nodes.sort();
            let ends = nodes.map(|node| mesh.nodes[node]);
            let tractions = PLACES.map(|place| part.traction(along(ends, place), normal(ends)));
            if let Some(others) = sides.insert(nodes, tractions) {
                (0..3).for_each(|k| near(tractions[k], others[k], "between triangles"));
            }
        }
    }
    (sides, stress.pressures().collect())
}

#[test]
fn the_stress_balances_the_loads_in_each_triangle_and_across_all_sides() {
    // On Γ_N τn is the load, and on Γ_C −pν with p ≥ 0. τ is symmetric, because it has three components.
    let text = "material = { young = 100, poisson = 0.3, plane = 'stress', upper.young = 1000 }
         body = { force = [0.5, -2] }
         boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'bottom', gap = '0.002*x' },
            { name = 'right', traction = ['y', -1] },
         ]";
    let text = format!("{text}\n{}", lasting_damage("0.3 + 0.7*x"));
    for degree in 1..=2 {
        let (mesh, text) =
            (layered(distorted(6)), format!("discretisation.displacement = {degree}\n{text}"));
        let (sides, pressures) = balanced(mesh.clone(), &text, [0.5, -2.0]);
        // The outward tractions of an edge of the square.
        let outward = |edge: &[usize; 2]| {
            let mut nodes = *edge;
            nodes.sort();
            let ends = nodes.map(|node| mesh.nodes[node]);
            let ([x, y], n) = (along(ends, 0.5), normal(ends));
            let sign = if (x - 0.5) * n[0] + (y - 0.5) * n[1] > 0.0 { 1.0 } else { -1.0 };
            (ends, sides[&nodes].map(|traction| traction.map(|component| sign * component)))
        };
        for (name, load) in [("right", [1.0, -1.0]), ("top", [0.0, 0.0])] {
            for (ends, tractions) in mesh.edges_of(name).iter().map(outward) {
                for (place, traction) in PLACES.into_iter().zip(tractions) {
                    near(traction, [load[0] * along(ends, place)[1], load[1]], name);
                }
            }
        }
        let mut force = 0.0;
        for (ends, [a, c, b]) in pressures {
            assert!(a >= 0.0 && b >= 0.0 && c >= 0.0, "{a}, {c}, {b}");
            let mut edges = mesh.edges_of("bottom").iter().map(outward);
            let is_known = |(of, _): &([[f64; 2]; 2], _)| *of == ends || [of[1], of[0]] == ends;
            let (of, tractions) = edges.find(is_known).unwrap();
            let p = |s: f64| a * (1.0 - s).powi(2) + 2.0 * c * s * (1.0 - s) + b * s * s;
            for (place, traction) in PLACES.into_iter().zip(tractions) {
                near(traction, [0.0, p(if of == ends { place } else { 1.0 - place })], "pressure");
            }
            force += (a + c + b) / 3.0 * (ends[0][0] - ends[1][0]).abs();
        }
        assert!(force > 0.1, "the body presses on its foundation: {force}");
    }
}

#[test]
fn the_stress_balances_the_loads_whatever_holds_the_body() {
    let material = "material = { young = 100, poisson = 0.3, plane = 'strain' }";
    let on_axes = "{ name = 'left', symmetry = true },
        { name = 'bottom', symmetry = true },
        { name = 'top', pressure = 2 }";
    let by_contact = "{ name = 'left', gap = 0 },
        { name = 'bottom', gap = 0 },
        { name = 'top', traction = [-0.5, -1] }";
    let on_skew_contact = "{ name = 'left', displacement = [0, 'free'] },
        { name = 'right', displacement = [0.01, 'free'] },
        { name = 'bottom', gap = 0.001, normal = [0.1, -1], traction = [0.2, -1] }";
    for (boundary, force) in [(on_axes, 0.0), (by_contact, -1.0), (on_skew_contact, -3.0)] {
        for degree in 1..=2 {
            let text = format!(
                "discretisation.displacement = {degree}\n{material}
                 body = {{ force = [0, {force}] }}\nboundary = [{boundary}]"
            );
            balanced(unstructured(0.2), &text, [0.0, force]);
        }
    }
}

/// A bound is proved where it is asked for; a plain run estimates, and says so.
#[test]
fn a_run_proves_a_bound_only_if_it_is_asked_for() {
    let pressed = "material = { young = 3, poisson = 0.3, plane = 'strain' }
         boundary = [
            { name = 'left', symmetry = true },
            { name = 'bottom', gap = 0 },
            { name = 'top', traction = ['0.1*x', -0.1] },
         ]";
    let problem = problem(square(4), pressed).unwrap();
    let session = Session::start(&[]).unwrap();
    let plain = Simulation::new(&problem).run(&session).unwrap().errors;
    let proved = Simulation::new(&problem).bound().run(&session).unwrap().errors;
    let bound = proved.displacement_bound.expect("a bound");
    assert!(plain.displacement_bound.is_none() && plain.reservations.is_empty(), "{plain:?}");
    assert!(plain.displacement_mesh > 0.0 && bound >= proved.displacement_mesh, "{proved:?}");
    let [plain, proved] = [plain, proved].map(|errors| errors.lines(None).0);
    assert!(plain[0].ends_with(" % (estimated, energy norm)"), "{plain:?}");
    assert!(proved[1].contains("u at most "), "{proved:?}");
}
