//! Orders of convergence to smooth manufactured solutions.

use crate::support::{distorted, order, problem, run, unstructured};
use signorini::{contact::SOLVERS, evolution::DiscreteProblem, mesh::Mesh};
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
fn manufactured(mesh: Mesh, plane: &str, d: f64) -> DiscreteProblem {
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
        "material = {{ young = {YOUNG}, poisson = {POISSON}, plane = '{plane}' }}
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

/// ‖u − u_h‖ in L² and |u − u_h| in H¹, by the midpoints of the sides of each triangle.
fn errors(problem: &DiscreteProblem, u: &[f64]) -> [f64; 2] {
    let (body, mut squares) = (&problem.body, [0.0; 2]);
    for (t, (nodes, triangle)) in body.mesh.triangles.iter().zip(&body.triangles).enumerate() {
        let values = body.gather(t, u);
        let slope = |k: usize, l: usize| -> f64 {
            (0..3).map(|i| triangle.gradients[i][l] * values[2 * i + k]).sum()
        };
        for side in 0..3 {
            let next = (side + 1) % 3;
            let (p, q) = (body.mesh.nodes[nodes[side]], body.mesh.nodes[nodes[next]]);
            let middle = [0, 1].map(|k| 0.5 * (p[k] + q[k]));
            let (value, gradient) = (exact(middle), gradient(middle));
            for k in 0..2 {
                let discrete = 0.5 * (values[2 * side + k] + values[2 * next + k]);
                squares[0] += triangle.area / 3.0 * (value[k] - discrete).powi(2);
                for (l, exact) in gradient[k].iter().enumerate() {
                    squares[1] += triangle.area / 3.0 * (exact - slope(k, l)).powi(2);
                }
            }
        }
    }
    squares.map(f64::sqrt)
}

/// Slopes over three meshes: 1 in H¹ and 2 in L².
fn check(meshes: [Mesh; 3], plane: &str, d: f64) {
    let size = |mesh: &Mesh| (mesh.triangles.len() as f64).powf(-0.5);
    let sizes = [size(&meshes[0]), size(&meshes[1]), size(&meshes[2])];
    let errors = meshes.map(|mesh| {
        let problem = manufactured(mesh, plane, d);
        errors(&problem, &run(&problem, SOLVERS[0]).last.state.u)
    });
    for (k, expected) in [2.0, 1.0].into_iter().enumerate() {
        let errors = [errors[0][k], errors[1][k], errors[2][k]];
        let order = order(&sizes, &errors);
        println!("plane {plane}, d = {d}, errors {errors:?}: order {order:.3}");
        assert!((order - expected).abs() < 0.15, "{order} is not {expected}: {errors:?}");
    }
}

#[test]
fn displacements_converge_with_order_one_in_h1_and_two_in_l2() {
    for plane in ["stress", "strain"] {
        check([8, 16, 32].map(distorted), plane, 0.0);
    }
}

#[test]
fn orders_hold_on_the_meshes_of_gmsh_and_with_damage_that_varies() {
    for plane in ["stress", "strain"] {
        check([0.1, 0.05, 0.025].map(unstructured), plane, 0.6);
    }
}
