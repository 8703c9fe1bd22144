//! Norms of differences between fields on two meshes.

use super::Study;
use signorini::{
    fem::Body,
    mesh::{self, Mesh, Order},
};
use signorini_study::{Embedding, Fields, Norms, refined};

fn square(n: usize) -> Body {
    Body::new(Mesh::rectangle(1.0, 1.0, n, n), Order::Linear)
}

/// The L, whose re-entrant corner no box of triangles may cut across: area 28 m².
fn l_shape(size: f64) -> Mesh {
    let study = Study::of("lshape", "lshape.geo");
    let geo = study.folder.path().join("lshape.geo");
    mesh::load(&geo, &[("size".to_owned(), size)].into(), Order::Linear).unwrap()
}

/// The interpolant of (u_x, u_y, ζ)(x, y).
fn fields(body: &Body, of: impl Fn(f64, f64) -> [f64; 3]) -> Fields {
    let values: Vec<_> = body.mesh.nodes.iter().map(|&[x, y]| of(x, y)).collect();
    Fields {
        u: values.iter().flat_map(|&[ux, uy, _]| [ux, uy]).collect(),
        zeta: values.iter().map(|&[_, _, zeta]| zeta).collect(),
    }
}

fn assert_close(norms: &Norms, expected: [f64; 4], tolerance: f64) {
    let found = [norms.strain, norms.gradient, norms.zeta, norms.zeta_gradient];
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{norms:?} is not {expected:?}");
    }
}

/// A linear field is in the space of every mesh, nested or not.
#[test]
fn a_linear_field_has_no_error_on_any_mesh() {
    let linear = |x: f64, y: f64| [0.3 * x - 0.7 * y, 1.1 * x + 0.2 * y + 5.0, 1.0 - 0.4 * x + y];
    let l = l_shape(1.0);
    for (fine, coarse) in [
        (square(16), square(4)),
        (square(16), square(7)),
        (Body::new(refined(&l), Order::Linear), Body::new(l, Order::Linear)),
        (Body::new(l_shape(0.4), Order::Linear), Body::new(l_shape(0.7), Order::Linear)),
    ] {
        let embedding = Embedding::new(&fine, &coarse);
        let norms = embedding.difference(&fields(&fine, linear), &fields(&coarse, linear));
        assert_close(&norms, [0.0; 4], 1e-12);
    }
}

/// A function of the coarse space is one of the fine space: at a midpoint the mean of both ends.
/// That a mesh keeps its numbers when refined, midpoints following, says which ends.
#[test]
fn functions_of_the_coarse_mesh_are_exact_on_its_refinement() {
    let wild = |x: f64, y: f64| {
        [(17.0 * x + 5.0 * y).sin(), (9.0 * x * y).cos(), (31.0 * x - 23.0 * y).sin()]
    };
    for mesh in [Mesh::rectangle(1.0, 1.0, 4, 4), l_shape(1.0)] {
        let (coarse, fine) =
            (Body::new(mesh.clone(), Order::Linear), Body::new(refined(&mesh), Order::Linear));
        let below = fields(&coarse, wild);
        let mut above = Fields::zero(fine.mesh.nodes.len());
        above.u[..below.u.len()].copy_from_slice(&below.u);
        above.zeta[..below.zeta.len()].copy_from_slice(&below.zeta);
        // The fourth child of a triangle joins the midpoints of its sides ab, bc, ca.
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            let middles = fine.mesh.triangles[4 * t + 3];
            for (middle, [p, q]) in middles.into_iter().zip([[a, b], [b, c], [c, a]]) {
                above.zeta[middle] = 0.5 * (below.zeta[p] + below.zeta[q]);
                for i in 0..2 {
                    above.u[2 * middle + i] = 0.5 * (below.u[2 * p + i] + below.u[2 * q + i]);
                }
            }
        }
        let norms = Embedding::new(&fine, &coarse).difference(&above, &below);
        assert_close(&norms, [0.0; 4], 1e-12);
    }
}

/// u = (2x + 3y, y − x), ζ = x: ε = (2, 1; shear 1), |ε|² = 4 + 1 + 2·1², |∇u|² = 15, ∫x² = 1/3.
#[test]
fn norms_of_a_known_difference() {
    let (fine, coarse) = (square(8), square(3));
    let field = fields(&fine, |x, y| [2.0 * x + 3.0 * y, y - x, x]);
    let zero = Fields::zero(coarse.mesh.nodes.len());
    let norms = Embedding::new(&fine, &coarse).difference(&field, &zero);
    assert_close(&norms, [7.0_f64.sqrt(), 15.0_f64.sqrt(), (1.0_f64 / 3.0).sqrt(), 1.0], 1e-13);
    assert!((norms.sum() - 7.0_f64.sqrt() - (1.0_f64 / 3.0).sqrt()).abs() < 1e-13);
}

/// ζ = x²: its interpolant on cells of width h is off by h⁴/30 in ‖·‖² and h²/3 in |·|², those of
/// the fine mesh being the smaller ones; they are orthogonal to each other in H¹.
#[test]
fn norms_of_an_interpolation_error() {
    let (fine, coarse) = (square(64), square(4));
    let parabola = |x: f64, _: f64| [0.0, 0.0, x * x];
    let embedding = Embedding::new(&fine, &coarse);
    let norms = embedding.difference(&fields(&fine, parabola), &fields(&coarse, parabola));
    let (h, d) = (1.0 / 4.0_f64, 1.0 / 64.0_f64);
    assert!((norms.zeta_gradient.powi(2) - (h * h - d * d) / 3.0).abs() < 1e-13, "{norms:?}");
    assert!((norms.zeta / (h * h / 30.0_f64.sqrt()) - 1.0).abs() < 0.01, "{norms:?}");
}
