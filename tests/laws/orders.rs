//! Orders of convergence to smooth manufactured solutions.

use crate::support::{distorted, order, problem, run, unstructured};
use nalgebra::Vector3;
use signorini::{
    contact::SOLVERS,
    estimate::RecoveredStrains,
    evolution::ObservedProblem,
    fem::Elements,
    mesh::{Mesh, twice_area},
};
use std::fmt::Write;

const YOUNG: f64 = 50.0;
const POISSON: f64 = 0.3;

/// u = (sin ax cos by, c cos ax sin by).
const A: f64 = 2.0;
const B: f64 = 3.0;
const C: f64 = 0.5;

/// Rows ∇u_x, ∇u_y.
fn gradient([x, y]: [f64; 2]) -> [[f64; 2]; 2] {
    let ((sx, cx), (sy, cy)) = ((A * x).sin_cos(), (B * y).sin_cos());
    [[A * cx * cy, -B * sx * sy], [-C * A * sx * sy, C * B * cx * cy]]
}

fn exact([x, y]: [f64; 2]) -> [f64; 2] {
    let ((sx, cx), (sy, cy)) = ((A * x).sin_cos(), (B * y).sin_cos());
    [sx * cy, C * cx * sy]
}

/// The scene in which u is the solution for ζ = 1 − dx, by f_B = −div(ζ σ(u)):
/// −div σ = −μ Δu − (λ+μ) ∇div u with div u = (A + CB) cos ax cos by, Δu = −(A² + B²) u,
/// and −∇ζ·σ = d (σ_xx, σ_xy).
fn manufactured(mesh: Mesh, plane: &str, d: f64, degree: u8) -> ObservedProblem {
    let mu = 0.5 * YOUNG / (1.0 + POISSON);
    let lambda = match plane {
        "stress" => YOUNG * POISSON / (1.0 - POISSON * POISSON),
        _ => YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)),
    };
    let divergence = A + C * B;
    let fx = mu * (A * A + B * B) + (lambda + mu) * A * divergence;
    let fy = C * mu * (A * A + B * B) + (lambda + mu) * B * divergence;
    let xx = lambda * divergence + 2.0 * mu * A;
    let xy = -mu * (B + C * A);
    let (sx, cx) = (format!("sin({A}*x)"), format!("cos({A}*x)"));
    let (sy, cy) = (format!("sin({B}*y)"), format!("cos({B}*y)"));
    let mut text = format!(
        "discretisation.displacement = {degree}
         material = {{ young = {YOUNG}, poisson = {POISSON}, plane = '{plane}' }}
         body.force = [
            '(1 - {d}*x)*{fx}*{sx}*{cy} + {d}*{xx}*{cx}*{cy}',
            '(1 - {d}*x)*{fy}*{cx}*{sy} + {d}*({xy})*{sx}*{sy}',
         ]
         damage = {{ diffusion = 1, lambda_d = 0, lambda_u = 1, lambda_w = 0,
                     strain_cap = 1, threshold = 0.01, initial = '1 - {d}*x' }}\n"
    );
    for side in ["left", "right", "top", "bottom"] {
        let value = format!("['{sx}*{cy}', '{C}*{cx}*{sy}']");
        writeln!(text, "[[boundary]]\nname = '{side}'\ndisplacement = {value}").unwrap();
    }
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

/// The value of a function and its derivatives by the barycentric coordinates.
type Function = (f64, [f64; 3]);

/// The nodal functions of P1 (3 values) or P2 (6) at barycentric coordinates λ, and their derivatives
/// by λ.
fn nodal_functions(count: usize, l: [f64; 3]) -> Vec<Function> {
    let unit = |i: usize| [0, 1, 2].map(|k| f64::from(k == i));
    if count == 3 {
        return (0..3).map(|i| (l[i], unit(i))).collect();
    }
    let vertex = |i: usize| (l[i] * (2.0 * l[i] - 1.0), unit(i).map(|on| on * (4.0 * l[i] - 1.0)));
    let middle = |i: usize, j: usize| {
        let slope = [0, 1, 2].map(|k| 4.0 * (unit(i)[k] * l[j] + l[i] * unit(j)[k]));
        (4.0 * l[i] * l[j], slope)
    };
    vec![vertex(0), vertex(1), vertex(2), middle(0, 1), middle(1, 2), middle(2, 0)]
}

/// Barycentric points and weights (Σ = 1): the product of two Gauss rules of four points, collapsed.
fn quadrature() -> Vec<([f64; 3], f64)> {
    let gauss = [
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    ];
    let line =
        || gauss.iter().flat_map(|&(x, w)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)]);
    let point =
        |(s, v): (f64, f64), (t, w): (f64, f64)| ([1.0 - s, s * (1.0 - t), s * t], 2.0 * s * v * w);
    line().flat_map(|a| line().map(move |b| point(a, b))).collect()
}

/// ‖u − u_h‖ in L², |u − u_h| in H¹ and ‖u − u_h‖ in the energy norm with ζ = 1 − dx, on straight
/// triangles.
fn errors(problem: &ObservedProblem, u: &[f64], d: f64) -> [f64; 3] {
    let (body, mut squares) = (&problem.body, [0.0; 3]);
    let stiffness = problem.scene().material.stiffness();
    for (t, corners) in body.mesh.triangles.iter().enumerate() {
        let nodes: Vec<usize> = match body.elements() {
            Elements::Linear(cells) => cells.nodes[t].to_vec(),
            Elements::Quadratic(cells) => cells.nodes[t].to_vec(),
        };
        let [a, b, c] = corners.map(|node| body.mesh.nodes[node]);
        let twice = twice_area(a, b, c);
        // ∇λ_a is the opposite side turned by 90° over twice the area.
        let turned = |p: [f64; 2], q: [f64; 2]| [(p[1] - q[1]) / twice, (q[0] - p[0]) / twice];
        let lambda = [turned(b, c), turned(c, a), turned(a, b)];
        for (l, weight) in quadrature() {
            let place = [0, 1].map(|k| l[0] * a[k] + l[1] * b[k] + l[2] * c[k]);
            let (value, gradient) = (exact(place), gradient(place));
            let functions = nodal_functions(nodes.len(), l);
            let mut off = [[0.0; 2]; 2];
            for k in 0..2 {
                let sum = |of: &dyn Fn(&Function) -> f64| -> f64 {
                    nodes.iter().zip(&functions).map(|(&i, f)| u[2 * i + k] * of(f)).sum()
                };
                squares[0] += 0.5 * twice * weight * (value[k] - sum(&|f| f.0)).powi(2);
                for axis in 0..2 {
                    let slope = sum(&|f| (0..3).map(|i| f.1[i] * lambda[i][axis]).sum());
                    off[k][axis] = gradient[k][axis] - slope;
                    squares[1] += 0.5 * twice * weight * off[k][axis].powi(2);
                }
            }
            let strain = Vector3::new(off[0][0], off[1][1], off[0][1] + off[1][0]);
            let energy = (1.0 - d * place[0]) * strain.dot(&(stiffness * strain));
            squares[2] += 0.5 * twice * weight * energy;
        }
    }
    squares.map(f64::sqrt)
}

/// Slopes over three meshes: `degree` in H¹ and one more in L². The recovered strains know the error in
/// the energy norm.
fn check(meshes: [Mesh; 3], plane: &str, d: f64, degree: u8) {
    let size = |mesh: &Mesh| (mesh.triangles.len() as f64).powf(-0.5);
    let sizes = [size(&meshes[0]), size(&meshes[1]), size(&meshes[2])];
    let errors = meshes.map(|mesh| {
        let problem = manufactured(mesh, plane, d, degree);
        let state = run(&problem, SOLVERS[0]).last.state;
        let errors = errors(&problem, &state.u, d);
        let recovered = RecoveredStrains::new(&problem.body, &state.u).unwrap();
        let zeta = problem.zeta_at_points(&state.zeta);
        let estimate = recovered.energy_error(&problem.elasticity, &zeta, &state.u);
        let ratio = estimate.error.sqrt() / errors[2];
        println!("estimated over true: {ratio:.3}");
        assert!((0.7..1.4).contains(&ratio), "{ratio} of {}", errors[2]);
        errors
    });
    for (k, expected) in [f64::from(degree) + 1.0, f64::from(degree)].into_iter().enumerate() {
        let errors = [errors[0][k], errors[1][k], errors[2][k]];
        let order = order(&sizes, &errors);
        println!("P{degree}, plane {plane}, d = {d}, errors {errors:?}: order {order:.3}");
        assert!((order - expected).abs() < 0.15, "{order} is not {expected}: {errors:?}");
    }
}

#[test]
fn displacements_converge_with_the_degree_in_h1_and_one_more_in_l2() {
    check([8, 16, 32].map(distorted), "stress", 0.0, 1);
    check([6, 12, 24].map(distorted), "strain", 0.0, 2);
    // With damage that varies.
    check([0.1, 0.05, 0.025].map(unstructured), "strain", 0.6, 1);
    check([0.2, 0.1, 0.05].map(unstructured), "stress", 0.6, 2);
}
