//! The P2 elements, straight and curved, against formulas of their own: fields are interpolated as
//! Σ λ_i v_i + Σ 4λ_iλ_j (v_ij − (v_i + v_j)/2), and derived by central differences, which are exact.

use crate::{
    elements::{check_stiffness, material},
    support::{
        DAMAGE_LAW, Random, bent, close, curved, difference, distorted, random_strains, square,
        unstructured,
    },
};
use nalgebra::{Matrix2, Vector3};
use signorini::{
    fem::{Body, Elasticity, Element, Elements, Mass, source, source_load},
    mesh::Order,
    model::{Fremond, Material, Plane},
};

/// Barycentric coordinates of the three quadrature points.
const POINTS: [[f64; 3]; 3] = {
    let (near, far) = (2.0 / 3.0, 1.0 / 6.0);
    [[near, far, far], [far, near, far], [far, far, near]]
};

/// The value at λ of a field with these values at vertices and midpoints.
fn interpolate(values: &[[f64; 2]; 6], l: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|k| {
        let side = |i: usize| {
            let j = (i + 1) % 3;
            4.0 * l[i] * l[j] * (values[3 + i][k] - 0.5 * (values[i][k] + values[j][k]))
        };
        (0..3).map(|i| l[i] * values[i][k] + side(i)).sum()
    })
}

/// The derivatives by λ_1 and λ_2 there (columns).
fn derivatives(values: &[[f64; 2]; 6], [a, b, c]: [f64; 3]) -> Matrix2<f64> {
    let h = 0.125;
    let slope = |forth: [f64; 3], back: [f64; 3]| {
        let [p, q] = [forth, back].map(|l| interpolate(values, l));
        [0, 1].map(|k| (p[k] - q[k]) / (2.0 * h))
    };
    let first = slope([a - h, b + h, c], [a + h, b - h, c]);
    let second = slope([a - h, b, c + h], [a + h, b, c - h]);
    Matrix2::new(first[0], second[0], first[1], second[1])
}

/// The weight det J/6 and ∇u at a point of the element with these nodes.
fn gradient(nodes: &[[f64; 2]; 6], u: &[[f64; 2]; 6], l: [f64; 3]) -> (f64, Matrix2<f64>) {
    let jacobian = derivatives(nodes, l);
    (jacobian.determinant() / 6.0, derivatives(u, l) * jacobian.try_inverse().unwrap())
}

/// Nodes of elements of all shapes that are neither too thin nor folded: straight ones, and some
/// with parabolas for sides.
fn shapes() -> Vec<[[f64; 2]; 6]> {
    let mut random = Random::new(11);
    let shapes = (0..200).map(|n| {
        let vertices: [[f64; 2]; 3] = std::array::from_fn(|_| [random.next(), random.next()]);
        let bulge = if n % 2 == 0 { 0.0 } else { 0.1 };
        std::array::from_fn(|i| match i {
            0..3 => vertices[i],
            _ => [0, 1].map(|k| {
                let mean = 0.5 * (vertices[i - 3][k] + vertices[(i - 2) % 3][k]);
                mean + bulge * random.next()
            }),
        })
    });
    let thick =
        |nodes: &[[f64; 2]; 6]| POINTS.iter().all(|&l| derivatives(nodes, l).determinant() > 0.1);
    shapes.filter(thick).collect()
}

#[test]
fn the_stiffness_has_three_rigid_motions_and_gives_the_forces() {
    assert!(shapes().len() > 40);
    let mut random = Random::new(12);
    shapes()
        .into_iter()
        .for_each(|nodes| check_stiffness(&Element::<6, 3>::new(nodes), &mut random));
}

#[test]
fn weights_and_gradients_are_those_of_the_parabolic_map() {
    let mut random = Random::new(13);
    for nodes in shapes() {
        let element = Element::<6, 3>::new(nodes);
        let u: [[f64; 2]; 6] = std::array::from_fn(|_| [random.next(), random.next()]);
        for (point, l) in element.points.iter().zip(POINTS) {
            let (weight, expected) = gradient(&nodes, &u, l);
            close(point.weight / weight, 1.0, 1e-13);
            assert!((point.gradient(&u) - expected).amax() <= 1e-12 * expected.amax());
        }
    }
}

/// The nodes of each triangle as those of a quadratic one, and its values of a vector field.
fn quadratic(body: &Body, field: &[f64]) -> Vec<[[[f64; 2]; 6]; 2]> {
    let value = |node: usize| [field[2 * node], field[2 * node + 1]];
    let straight = |[a, b, c]: [[f64; 2]; 3]| {
        let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| 0.5 * (p[k] + q[k]));
        [a, b, c, middle(a, b), middle(b, c), middle(c, a)]
    };
    match body.elements() {
        Elements::Linear(cells) => (cells.nodes.iter())
            .map(|t| [straight(t.map(|i| body.nodes.points[i])), straight(t.map(value))])
            .collect(),
        Elements::Quadratic(cells) => {
            (cells.nodes.iter()).map(|t| [t.map(|i| body.nodes.points[i]), t.map(value)]).collect()
        }
    }
}

/// ½ ∫ ζ Aε(u):ε(u) with A as printed in the paper, (Aτ):τ = Er/(1−r²) tr²τ + E/(1+r) |τ|², by the quadrature points
/// of the elements. Plane strain is plane stress with E/(1−r²) and r/(1−r).
fn energy(body: &Body, plane: Plane, zeta: &[f64], u: &[f64]) -> f64 {
    let Material { young, poisson, .. } = material(plane);
    let (e, r) = match plane {
        Plane::Stress => (young, poisson),
        Plane::Strain => (young / (1.0 - poisson * poisson), poisson / (1.0 - poisson)),
    };
    let elements = quadratic(body, u);
    let points = zeta.len() / elements.len();
    let of_element = |([at, v], zeta): (&[[[f64; 2]; 6]; 2], &[f64])| -> f64 {
        let of_point = POINTS.iter().enumerate().map(|(q, &l)| {
            let (weight, gradient) = gradient(at, v, l);
            let strain = 0.5 * (gradient + gradient.transpose());
            let (trace, square) = (strain.trace(), strain.norm_squared());
            let density = e * r / (1.0 - r * r) * trace * trace + e / (1.0 + r) * square;
            weight * zeta[q % points] * density
        });
        of_point.sum()
    };
    0.5 * elements.iter().zip(zeta.chunks(points)).map(of_element).sum::<f64>()
}

#[test]
fn internal_forces_are_the_gradient_of_the_energy() {
    let mut random = Random::new(14);
    for (mesh, order, plane) in [
        (unstructured(0.2), Order::Linear, Plane::Stress),
        (unstructured(0.2), Order::Linear, Plane::Strain),
        (distorted(4), Order::Quadratic, Plane::Stress),
        (curved(), Order::Quadratic, Plane::Strain),
    ] {
        let (elasticity, body) = (Elasticity::new([material(plane)]), Body::new(mesh, order));
        let points = if order == Order::Linear { 1 } else { 3 };
        let zeta = random.field(points * body.triangles.len());
        let zeta: Vec<f64> = zeta.iter().map(|z| 1.5 + z).collect();
        let u = random.field(2 * body.nodes.points.len());
        let force = elasticity.internal_force(&body, &zeta, &u);
        // Twice the energy is u·F, and central differences of a quadratic are exact.
        let work: f64 = force.iter().zip(&u).map(|(f, u)| f * u).sum();
        close(work / (2.0 * energy(&body, plane, &zeta, &u)), 1.0, 1e-12);
        let energies: f64 = elasticity.energies(&body, &zeta, &u).iter().sum();
        close(energies / work, 1.0, 1e-12);
        for _ in 0..5 {
            let v = random.field(u.len());
            let at = |s: f64| {
                let moved: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + s * v).collect();
                energy(&body, plane, &zeta, &moved)
            };
            let slope: f64 = force.iter().zip(&v).map(|(f, v)| f * v).sum();
            close((at(1.0) - at(-1.0)) / 2.0 / work, slope / work, 1e-12);
        }
    }
}

#[test]
fn the_damage_source_is_taken_at_the_quadrature_points() {
    // b_i = Σ |T|/3 φ(|ε|²(x_q), ζ(x_q)) λ_i(x_q).
    let body = Body::new(curved(), Order::Quadratic);
    let law = DAMAGE_LAW;
    let mut random = Random::new(15);
    let zeta: Vec<f64> = body.mesh.nodes.iter().map(|_| 0.6 + 0.3 * random.next()).collect();
    let (strains, squares) = random_strains(&mut random, 3 * body.triangles.len());
    let mut expected = vec![0.0; zeta.len()];
    for (t, nodes) in body.mesh.triangles.iter().enumerate() {
        for (q, l) in POINTS.iter().enumerate() {
            let z: f64 = nodes.iter().zip(l).map(|(&node, l)| l * zeta[node]).sum();
            let rate =
                law.lambda_d * (1.0 - z) / z + 0.5 * law.lambda_u * squares[3 * t + q].min(0.8);
            let phi = -(rate - 0.1).max(0.0);
            for (&node, l) in nodes.iter().zip(l) {
                expected[node] += body.triangles[t].area() / 3.0 * phi * l;
            }
        }
    }
    for mass in [Mass::Consistent, Mass::Lumped] {
        let load =
            source_load(&body, mass, &source(&body, (&Fremond, &[law]), &strains, &zeta).unwrap());
        let error = difference(&load, &expected);
        assert!(error < 1e-14, "{error}");
    }
}

#[test]
fn the_stress_of_a_curved_triangle_is_its_mean() {
    // ∫ ε(u) = ∮ (u ⊗ n + n ⊗ u)/2 ds: along a parabola u and x are quadratic, so Simpson's rule is exact.
    let mesh = bent(&square(2), |[x, y]| [x + 0.2 * y * y, y + 0.15 * x * (1.0 - x)]);
    let (body, elasticity) =
        (Body::new(mesh, Order::Quadratic), Elasticity::new([material(Plane::Stress)]));
    let mut random = Random::new(5);
    let points = &body.nodes.points;
    let u: Vec<f64> = (0..2 * points.len()).map(|_| random.next()).collect();
    let zeta = body.at_points(&vec![1.0; body.mesh.nodes.len()]);
    let stresses = elasticity.stresses(&body, &zeta, &u);
    for (stress, &[a, b, c]) in stresses.iter().zip(&body.mesh.triangles) {
        let (mut area, mut strain) = (0.0, Vector3::zeros());
        for edge in body.edges(&[[a, b], [b, c], [c, a]]) {
            for (s, weight) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)].map(|(s, w)| (s, w / 6.0)) {
                let ([x, y], [tx, ty]) = (edge.at(points, s), edge.tangent(points, s));
                let (nx, ny) = (weight * ty, -weight * tx);
                let [ux, uy] = [0, 1].map(|k| {
                    edge.values(s).map(|(node, value)| value * u[2 * node + k]).sum::<f64>()
                });
                area += 0.5 * (x * nx + y * ny);
                strain += Vector3::new(ux * nx, uy * ny, ux * ny + uy * nx);
            }
        }
        let expected = material(Plane::Stress).stiffness() * strain / area;
        assert!((stress - expected).norm() < 1e-11 * expected.norm(), "{stress} is not {expected}");
    }
}
