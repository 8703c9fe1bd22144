//! One triangle, and the operators assembled from many.

use crate::support::{
    DAMAGE_LAW, ORDERS, Random, close, difference, distorted, largest, moved, random_strains, turn,
    unstructured,
};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, SVector, Vector3};
use signorini::{
    fem::{
        Body, DamageSystem, Elasticity, Element, Mass, NodalBases, Stiffness, Triangle, source,
        source_load,
    },
    mesh::Order,
    model::{Fremond, Material, Plane},
    petsc::{Session, Vector},
};

const YOUNG: f64 = 2.1e5;
const POISSON: f64 = 0.3;

/// The material of these tests.
pub fn material(plane: Plane) -> Material {
    Material { young: YOUNG, poisson: POISSON, plane, density: 0.0 }
}

fn elasticity(plane: Plane) -> Elasticity {
    Elasticity::new([material(plane)])
}

/// Counter-clockwise triangles of all shapes that are not too thin.
fn triangles() -> Vec<Triangle> {
    let mut random = Random::new(1);
    let mut point = || [random.next(), random.next()];
    let triangles = (0..200).map(|_| Triangle::new([point(), point(), point()]));
    triangles.filter(|t| t.area() > 0.02).collect()
}

/// The stiffness of an element is symmetric, vanishes on three rigid motions only, and its products are the
/// forces of the element.
pub fn check_stiffness<const N: usize, const Q: usize>(
    element: &Element<N, Q>,
    random: &mut Random,
) {
    for plane in [Plane::Stress, Plane::Strain] {
        let d = material(plane).stiffness();
        let k = DMatrix::<f64>::from_fn(2 * N, 2 * N, |i, j| {
            let blocks = element.points.iter().map(|point| point.stiffness(&d, i / 2, j / 2));
            blocks.map(|block| block[(i % 2, j % 2)]).sum()
        });
        assert!((&k - k.transpose()).amax() <= 1e-14 * k.amax());
        let mut values = k.symmetric_eigenvalues().as_slice().to_vec();
        values.sort_by(f64::total_cmp);
        let largest = values[2 * N - 1];
        assert!(values[..3].iter().all(|v| v.abs() < 1e-12 * largest), "{values:?}");
        // Flat triangles are soft against shear along themselves, but not this soft.
        assert!(values[3] > 1e-7 * largest, "{values:?}");
        let u: [[f64; 2]; N] = std::array::from_fn(|_| [random.next(), random.next()]);
        let mut force = DVector::<f64>::zeros(2 * N);
        for point in &element.points {
            let of_point = point.force(&(d * point.strain(&u)));
            force += DVector::from_column_slice(of_point.as_flattened());
        }
        let error = (k * DVector::from_column_slice(u.as_flattened()) - &force).amax();
        assert!(error <= 1e-12 * force.amax(), "{error}");
    }
}

#[test]
fn the_stiffness_of_a_triangle_has_three_rigid_motions_and_gives_its_forces() {
    let mut random = Random::new(2);
    triangles().iter().for_each(|triangle| check_stiffness(triangle, &mut random));
}

#[test]
fn mass_is_a_partition_of_unity_and_laplace_sees_gradients_only() {
    let mut random = Random::new(3);
    for triangle in triangles() {
        let area = triangle.area();
        let (mass, laplace) = (triangle.mass(), triangle.laplace());
        for i in 0..3 {
            // Σ_j ∫λ_i λ_j = ∫λ_i = area/3, and ∇Σλ_j = 0.
            close(mass.row(i).sum() / area, 1.0 / 3.0, 1e-15);
            assert!(laplace.row(i).sum().abs() <= 1e-14 * laplace.amax());
        }
        // ∫(a·x)² over the triangle by its side midpoints; |∇(a·x)|² = |a|².
        let corners = corners(&triangle);
        let a = [random.next(), random.next()];
        let value = SVector::<f64, 3>::from_fn(|i, _| a[0] * corners[i][0] + a[1] * corners[i][1]);
        let middle = |i: usize| (0.5 * (value[i] + value[(i + 1) % 3])).powi(2);
        let square = area / 3.0 * (0..3).map(middle).sum::<f64>();
        close(value.dot(&(mass * value)), square, 1e-14);
        let norm = a[0] * a[0] + a[1] * a[1];
        close(value.dot(&(laplace * value)), norm * area, 1e-12);
    }
}

/// A triangle of the same gradients with its first corner at the origin.
fn corners(triangle: &Triangle) -> [[f64; 2]; 3] {
    let [_, b, c] = triangle.gradients();
    // ∇λ_b·(x_b − x_a) = 1 and ∇λ_c·(x_b − x_a) = 0, and so on.
    let sides = Matrix2::new(b[0], b[1], c[0], c[1]).try_inverse().unwrap();
    [[0.0; 2], sides.column(0).into_owned().into(), sides.column(1).into_owned().into()]
}

#[test]
fn rigid_motions_have_neither_strain_nor_force() {
    for order in ORDERS {
        let body = Body::new(unstructured(0.2), order);
        let zeta: Vec<f64> =
            Random::new(4).field(3 * body.triangles.len()).iter().map(|z| 1.5 + z).collect();
        let elasticity = elasticity(Plane::Strain);
        // u = a + θ e_z × x
        let u: Vec<f64> =
            body.nodes.points.iter().flat_map(|[x, y]| [0.3 - 0.7 * y, -1.1 + 0.7 * x]).collect();
        assert!(body.strains(&u).iter().all(|strain| strain.amax() < 1e-13));
        assert!(largest(&elasticity.internal_force(&body, &zeta, &u)) < 1e-12 * YOUNG);
        // u = (a x + γ y, 0): ε_xx = a, 2ε_xy = γ.
        let strained: Vec<f64> =
            body.nodes.points.iter().flat_map(|[x, y]| [x + 0.4 * y, 0.0]).collect();
        let expected = Vector3::new(1.0, 0.0, 0.4);
        assert!(body.strains(&strained).iter().all(|strain| (strain - expected).amax() < 1e-12));
    }
}

#[test]
fn forces_turn_with_the_body() {
    // F(Ru) on the body turned by R is R F(u).
    let (mesh, angle) = (distorted(4), 1.234);
    let mut random = Random::new(6);
    let turned =
        |v: &[f64]| -> Vec<f64> { v.chunks(2).flat_map(|v| turn(angle, [v[0], v[1]])).collect() };
    let elasticity = elasticity(Plane::Stress);
    for order in ORDERS {
        let body = Body::new(mesh.clone(), order);
        let zeta: Vec<f64> = (0..3 * body.triangles.len()).map(|_| 1.5 + random.next()).collect();
        let u = random.field(2 * body.nodes.points.len());
        let force = elasticity.internal_force(&body, &zeta, &u);
        let body = Body::new(moved(mesh.clone(), |x| turn(angle, x)), order);
        let error =
            difference(&elasticity.internal_force(&body, &zeta, &turned(&u)), &turned(&force));
        assert!(error < 1e-13, "{error}");
    }
}

/// Bases at a third of the nodes, orthonormal and oblique, and a fixed unknown at some.
fn bases(nodes: usize, random: &mut Random) -> NodalBases {
    let mut bases = NodalBases::identity(nodes);
    for node in (0..nodes).step_by(3) {
        let angle = 3.0 * random.next();
        let opening = if node % 2 == 0 { 0.5 * std::f64::consts::PI } else { 0.8 };
        let (s, c) = angle.sin_cos();
        let (t, d) = (angle + opening).sin_cos();
        bases.set(node, Matrix2::new(c, s, d, t)).unwrap();
        if node % 4 == 0 {
            bases.fix(2 * node + 1);
        }
    }
    bases.fix(2);
    bases
}

#[test]
fn nodal_bases_keep_work_and_give_back_what_they_take() {
    let mut random = Random::new(7);
    let bases = bases(30, &mut random);
    let (u, r) = (random.field(60), random.field(60));
    let (mut c, mut s) = (u.clone(), r.clone());
    bases.displacement_to_local(&mut c);
    bases.force_to_local(&mut s);
    let work = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    assert!(difference(&c, &u) > 0.1);
    close(work(&s, &c), work(&r, &u), 1e-13);
    bases.displacement_to_global(&mut c);
    assert!(difference(&c, &u) < 1e-14);
}

#[test]
fn the_stiffness_is_the_internal_force_in_the_nodal_bases() {
    let (mesh, session) = (unstructured(0.2), Session::start(&[]).unwrap());
    let elasticity = elasticity(Plane::Stress);
    for order in ORDERS {
        let body = Body::new(mesh.clone(), order);
        let nodes = body.nodes.points.len();
        let mut random = Random::new(8);
        let bases = bases(nodes, &mut random);
        let mut stiffness = Stiffness::new(&session, &body, &elasticity, &bases).unwrap();
        for _ in 0..3 {
            let zeta: Vec<f64> = body.mesh.nodes.iter().map(|_| 1.5 + random.next()).collect();
            let zeta = body.at_points(&zeta);
            stiffness.set_damage(&body, &zeta);
            let fixed = bases.fixed();
            let c: Vec<f64> =
                (0..2 * nodes).map(|i| if fixed[i] { 0.0 } else { random.next() }).collect();
            let (mut x, mut y) = (vector(&session, &c), vector(&session, &c));
            stiffness.matrix.multiply(&x, &mut y).unwrap();
            let product = y.read(<[f64]>::to_vec).unwrap();

            // K c = D⁻ᵀ F(D⁻¹ c) on the free unknowns, and the fixed are decoupled from them.
            let mut u = c.clone();
            bases.displacement_to_global(&mut u);
            let mut force = elasticity.internal_force(&body, &zeta, &u);
            bases.force_to_local(&mut force);
            force.iter_mut().zip(fixed).for_each(|(f, fixed)| *f = if *fixed { 0.0 } else { *f });
            let error = difference(&product, &force);
            assert!(error < 1e-13, "{error}");

            // The entries, written for a copy, are those of the same matrix.
            stiffness.matrix.duplicate().unwrap().multiply(&x, &mut y).unwrap();
            let error = difference(&y.read(<[f64]>::to_vec).unwrap(), &product);
            assert!(error < 1e-13, "{error}");

            let only_fixed: Vec<f64> = fixed.iter().map(|f| if *f { 1.0 } else { 0.0 }).collect();
            x.set(&only_fixed).unwrap();
            stiffness.matrix.multiply(&x, &mut y).unwrap();
            let product = y.read(<[f64]>::to_vec).unwrap();
            let expected: Vec<f64> = only_fixed.iter().map(|f| f * stiffness.scale).collect();
            assert_eq!(product, expected);
        }
    }
}

fn vector(session: &Session, values: &[f64]) -> Vector {
    let mut vector = Vector::zeros(session, values.len()).unwrap();
    vector.set(values).unwrap();
    vector
}

#[test]
fn a_damage_step_solves_the_assembled_system() {
    // (M + kκL) ζ_n = M ζ_{n−1} + k b with M and L summed from the elements in a dense
    // matrix, and b = ∫ φ λ_i of the affine φ through its values at the vertices.
    let session = Session::start(&[]).unwrap();
    let body = Body::new(distorted(3), Order::Linear);
    let law = DAMAGE_LAW;
    let (n, step, mut random) = (body.mesh.nodes.len(), 0.05, Random::new(9));
    let zeta: Vec<f64> = (0..n).map(|_| 0.6 + 0.3 * random.next()).collect();
    let (strains, squares) = random_strains(&mut random, body.triangles.len());
    let mut left = DMatrix::<f64>::zeros(n, n);
    let mut right = DVector::<f64>::zeros(n);
    for ((nodes, triangle), e2) in body.mesh.triangles.iter().zip(&body.triangles).zip(&squares) {
        let (mass, laplace): (Matrix3<f64>, Matrix3<f64>) = (triangle.mass(), triangle.laplace());
        for i in 0..3 {
            for j in 0..3 {
                left[(nodes[i], nodes[j])] += mass[(i, j)] + step * law.diffusion * laplace[(i, j)];
                let z = zeta[nodes[j]];
                let rate = law.lambda_d * (1.0 - z) / z + 0.5 * law.lambda_u * e2.min(0.8) - 0.1;
                right[nodes[i]] += mass[(i, j)] * (z - step * rate.max(0.0));
            }
        }
    }
    let expected = left.lu().solve(&right).unwrap();
    let mut next = zeta.clone();
    let load = source_load(
        &body,
        Mass::Consistent,
        &source(&body, (&Fremond, &[law]), &strains, &zeta).unwrap(),
    );
    let mut system =
        DamageSystem::new(&session, &body, Mass::Consistent, &[law.diffusion], step).unwrap();
    assert!(system.advance(&load, &mut next).unwrap());
    let error = difference(&next, expected.as_slice());
    assert!(error < 1e-13, "{error}");
}
