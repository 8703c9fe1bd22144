//! Norms of differences between fields on two grids.

use signorini::{
    fem::Body,
    study::{Embedding, Fields, Grid, Norms},
};

/// The interpolant on `grid` of (u_x, u_y, ζ)(x, y).
fn fields(grid: &Grid, of: impl Fn(f64, f64) -> [f64; 3]) -> Fields {
    let values: Vec<_> = grid.mesh().nodes.iter().map(|&[x, y]| of(x, y)).collect();
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

/// A linear field is in the space of every grid, nested or not.
#[test]
fn a_linear_field_has_no_error_on_any_grid() {
    let linear = |x: f64, y: f64| [0.3 * x - 0.7 * y, 1.1 * x + 0.2 * y + 5.0, 1.0 - 0.4 * x + y];
    let fine = Grid::square(16, 1.0);
    let body = Body::new(fine.mesh());
    for coarse in [Grid::square(4, 1.0), Grid::square(5, 1.0), Grid::square(7, 6.0)] {
        let embedding = Embedding::new(&body, &coarse);
        let norms = embedding.difference(&fields(&fine, linear), &fields(&coarse, linear));
        assert_close(&norms, [0.0; 4], 1e-13);
    }
}

/// A function of the coarse space is a function of the fine one where the meshes are nested; a
/// kink where the other diagonal ran would show.
#[test]
fn functions_of_the_coarse_grid_are_exact_on_a_nested_fine_one() {
    let (coarse, fine) = (Grid::square(4, 1.0), Grid::square(16, 1.0));
    let wild = |x: f64, y: f64| {
        [(17.0 * x + 5.0 * y).sin(), (9.0 * x * y).cos(), (31.0 * x - 23.0 * y).sin()]
    };
    let below = fields(&coarse, wild);
    let mesh = coarse.mesh();
    let above = fields(&fine, |x, y| {
        let (triangle, place) = coarse.locate([x, y]);
        let mut values = [0.0; 3];
        for (weight, node) in place.iter().zip(mesh.triangles[triangle]) {
            let corner = [below.u[2 * node], below.u[2 * node + 1], below.zeta[node]];
            values.iter_mut().zip(corner).for_each(|(sum, value)| *sum += weight * value);
        }
        values
    });
    let body = Body::new(fine.mesh());
    assert_close(&Embedding::new(&body, &coarse).difference(&above, &below), [0.0; 4], 1e-12);
}

/// u = (2x + 3y, y − x), ζ = x: ε = (2, 1; shear 1), |ε|² = 4 + 1 + 2·1², |∇u|² = 15, ∫x² = 1/3.
#[test]
fn norms_of_a_known_difference() {
    let (fine, coarse) = (Grid::square(8, 3.0), Grid::square(3, 1.0));
    let body = Body::new(fine.mesh());
    let field = fields(&fine, |x, y| [2.0 * x + 3.0 * y, y - x, x]);
    let zero = fields(&coarse, |_, _| [0.0; 3]);
    let norms = Embedding::new(&body, &coarse).difference(&field, &zero);
    assert_close(&norms, [7.0_f64.sqrt(), 15.0_f64.sqrt(), (1.0_f64 / 3.0).sqrt(), 1.0], 1e-13);
    assert!((norms.sum() - 7.0_f64.sqrt() - (1.0_f64 / 3.0).sqrt()).abs() < 1e-13);
}

/// ζ = x²: its interpolant on cells of width h is off by h⁴/30 in ‖·‖² and h²/3 in |·|², those of
/// the fine grid being the smaller ones; they are orthogonal to each other in H¹.
#[test]
fn norms_of_an_interpolation_error() {
    let (fine, coarse) = (Grid::square(64, 1.0), Grid::square(4, 1.0));
    let body = Body::new(fine.mesh());
    let square = |x: f64, _: f64| [0.0, 0.0, x * x];
    let norms =
        Embedding::new(&body, &coarse).difference(&fields(&fine, square), &fields(&coarse, square));
    let (h, d) = (1.0 / 4.0_f64, 1.0 / 64.0_f64);
    assert!((norms.zeta_gradient.powi(2) - (h * h - d * d) / 3.0).abs() < 1e-13, "{norms:?}");
    assert!((norms.zeta / (h * h / 30.0_f64.sqrt()) - 1.0).abs() < 0.01, "{norms:?}");
}
